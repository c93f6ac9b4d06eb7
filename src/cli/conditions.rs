//! The settings of episodes that a command line asks for: who drives, where, under which conditions.

use avastra_campaign::run::{self, Conditions, Profile, Run, RunSettings, TrafficRecord};
use avastra_lang::model::{Policy, Space};

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

/// The driving system that a policy was trained against.
pub fn trained_against(policy: &Policy) -> Result<UnderTest, Failure> {
    let ads = run::trained_against(policy)?;
    Ok(UnderTest { ads: ads.name().to_owned(), profile: ads.profile().map(Profile::new), external: None })
}

/// Fills in what a policy was trained under, where the command line names nothing else.
pub fn as_trained(
    conditions: &mut Conditions,
    arguments: &ConditionArguments,
    policy: &Policy,
    space: &Space,
) -> Result<(), Failure> {
    let origin = &policy.origin;
    let is_known = |name: &str| {
        space.rules.iter().any(|rule| rule.name == name)
            || space.requirements.iter().any(|of| of.name == name)
    };
    let is_here = |name: &String| space.roads.iter().any(|road| road.name == *name);
    if arguments.road.is_empty() && origin.roads.iter().all(is_here) {
        conditions.roads.clone_from(&origin.roads);
    }
    if arguments.traffic.is_none() {
        conditions.traffic = TrafficRecord::new(&run::trained_in(policy)?);
    }
    for (rules, trained, others) in [
        (&mut conditions.with, &origin.with, &arguments.rules.without),
        (&mut conditions.without, &origin.without, &arguments.rules.with),
    ] {
        // Another space may lack a rule. That it is not in force is told with all that is otherwise than in the training.
        let more =
            trained.iter().filter(|rule| !rules.contains(rule) && !others.contains(rule) && is_known(rule));
        let more: Vec<String> = more.cloned().collect();
        rules.extend(more);
    }
    Ok(())
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
