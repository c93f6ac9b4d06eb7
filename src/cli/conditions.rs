//! The settings of episodes that a command line asks for: who drives, where, under which conditions.

use avastra_campaign::run::{Conditions, Profile, Run, RunSettings, TrafficRecord};
use avastra_lang::model::Space;

use super::arguments::ConditionArguments;
use super::error::Failure;
use super::load::{self, UnderTest};

/// So many episodes of an agent on each road against a driving system.
pub fn settings(
    space: &Space,
    arguments: &ConditionArguments,
    agent: &str,
    under_test: UnderTest,
    episodes: u32,
) -> Result<RunSettings, Failure> {
    let traffic = arguments.traffic.as_deref().map(load::traffic).transpose()?;
    let UnderTest { ads, profile, external } = under_test;
    let conditions = Conditions {
        roads: roads_or_all(&arguments.road, space),
        ads,
        profile,
        external,
        ambient: arguments.ambient,
        traffic: traffic.as_ref().and_then(TrafficRecord::new),
        without: arguments.rules.without.clone(),
        with: arguments.rules.with.clone(),
        ..Conditions::of(space)
    };
    Ok(RunSettings::new(conditions, agent, episodes, arguments.seed))
}

/// On which roads fewer vehicles of ambient traffic are there at the start of the first episode than were asked for; nothing if all
/// are.
pub fn ambient_text(run: &Run) -> Option<String> {
    let wanted = run.settings().conditions.ambient;
    if wanted == 0 {
        return None;
    }
    let lacking = run.ambient_at_start().into_iter().filter(|(_, found)| *found < wanted);
    let roads: Vec<String> = lacking.map(|(road, found)| format!("{found} on {road}")).collect();
    (!roads.is_empty()).then(|| {
        let roads = roads.join(", ");
        format!("of {wanted} vehicles of ambient traffic, at the start of its first episode there are {roads}; more come where there is room")
    })
}

/// What the driving system's profile changes, in a few words; empty if the profile is the default. The settings have the whole
/// profile, so a resumed command says so, too.
pub fn profile_text(profile: Option<&Profile>) -> String {
    let line = profile.map(|profile| profile.settings.in_words());
    line.filter(|line| !line.is_empty()).map_or_else(String::new, |line| format!(" with {line}"))
}

/// The roads that a command line names, or all of the space.
pub fn roads_or_all(named: &[String], space: &Space) -> Vec<String> {
    if named.is_empty() { space.roads.iter().map(|road| road.name.clone()).collect() } else { named.to_vec() }
}
