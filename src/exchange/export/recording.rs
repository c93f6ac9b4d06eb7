//! The replay of an emitted scenario, with the documentation and the claims of its file.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use avastra_campaign::episode::{Actor, EpisodeLog, Outcome, Recorder};
use avastra_campaign::oracle::ClaimResult;
use avastra_campaign::run::{RunError, Stage};
use avastra_drivers::Selected;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{Claim, NpcFacts, Road, Scenario};
use avastra_road::{LaneIndex, LanePlace, RoadMap};
use avastra_world::action::{ActionTable, Course, Effect, SpawnRequest};
use avastra_world::sim::DT_S;

use super::standalone::{Standalone, standalone};

/// Names of the facts that hold the scenario as text of the language, and what that text lacks.
pub const SCENARIO_TEXT: &str = "scenario_text";
pub const SCENARIO_TEXT_LACKS: &str = "scenario_text_lacks";

/// A replay as [`Recorder`] saw it, with its road and the facts of its file.
#[derive(Debug, Clone)]
pub struct Recording {
    pub name: String,
    /// The documentation of the scenario's file, line by line.
    pub docs: Vec<String>,
    pub map: Arc<RoadMap>,
    /// The OpenDRIVE file.
    pub map_path: PathBuf,
    /// Where the ego vehicle is to go.
    pub goal: LanePlace,
    /// The lanes of its route, in order.
    pub route: Vec<LaneIndex>,
    pub seen: Recorder,
    /// The road in its space, with its trajectories.
    pub road: Road,
    /// The spawns of road users that appear at the start and get no orders later.
    pub told: Vec<Told>,
    /// Names of the author's own bodies, by number of the road user.
    pub own_bodies: BTreeMap<u32, String>,
    /// The names that road users bear, likewise.
    pub names: BTreeMap<u32, String>,
    /// Where the scenario comes from, what it claims, and the scenario as text of the language: name and value.
    pub facts: Vec<(String, String)>,
    /// The steps whose action did not happen, each with the reason, in words.
    pub refused: Vec<String>,
}

/// The spawn of a road user that appears at the start and gets no orders later.
#[derive(Debug, Clone)]
pub struct Told {
    /// As claims number it.
    pub id: u32,
    pub request: SpawnRequest,
    pub course: Option<Arc<Course>>,
    /// As it appeared.
    pub facts: NpcFacts,
}

/// Why a scenario has no recording.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error(transparent)]
    Run(#[from] RunError),
    /// The replay is not what the scenario says.
    #[error("it does not replay: claimed {}, found {}", claims[0].claim, claims[0].found)]
    Refuted { claims: Vec<ClaimResult> },
}

impl Recording {
    pub fn duration_s(&self) -> f64 {
        self.seen.end_tick as f64 * DT_S
    }

    /// The ego vehicle and the others.
    pub fn actors(&self) -> impl Iterator<Item = &Actor> {
        core::iter::once(&self.seen.ego).chain(&self.seen.others)
    }
}

/// Plays a scenario again and writes down what happens. Its claims about the drive itself (collisions, end, digest of all
/// ticks) must hold; verdicts about collisions are handed on as they are written. Actions that are not legal in it are
/// listed in [`Recording::refused`].
///
/// # Errors
/// If it cannot be played, or plays otherwise than it claims.
pub fn record(table: &ActionTable, scenario: &Scenario, ads: &Selected) -> Result<Recording, ExportError> {
    let stage = Stage::new(table, scenario)?;
    let mut seen = Recorder::default();
    let mut facts_at_first = BTreeMap::new();
    let log = stage.play(ads, &mut |world, ads, contacts| {
        seen.note(world, ads, contacts);
        for other in seen.others.iter().filter(|other| other.samples.len() == 1) {
            facts_at_first.extend(world.npc_facts(other.id).map(|facts| (other.id, facts)));
        }
    });
    let driven = |claim: &Claim| {
        matches!(claim, Claim::Collision { .. } | Claim::Trace(_) | Claim::Proc(_) | Claim::End(_))
    };
    let mut claims = stage.refuted(ads, &log, &[], driven);
    let refused: Vec<String> =
        log.refused().map(|(step, reason)| format!("step {step} does not happen: {reason}")).collect();
    // Before those of the claims stand those of refused steps.
    claims.drain(..refused.len());
    if !claims.is_empty() {
        return Err(ExportError::Refuted { claims });
    }
    let road = &table.space().roads[scenario.road];
    let mut facts = facts(scenario, &road.name);
    if let Some(Standalone { text, lacks }) = standalone(table.space(), scenario, &log) {
        facts.push((SCENARIO_TEXT.to_owned(), text));
        facts.extend((!lacks.is_empty()).then(|| (SCENARIO_TEXT_LACKS.to_owned(), lacks.join("; "))));
    }
    let named = |(id, own): (u32, usize)| (id, table.space().bodies[own].name.clone());
    let borne = |(id, bearer): (u32, usize)| (id, table.space().bearers[bearer].clone());
    Ok(Recording {
        name: scenario.name.clone(),
        docs: scenario.docs.clone(),
        map: road.map.clone(),
        map_path: road.map_path.clone(),
        goal: road.goal,
        route: road.route.lanes.iter().map(|part| part.lane).collect(),
        seen,
        road: road.clone(),
        told: told(&log, &facts_at_first),
        own_bodies: log.own_bodies().into_iter().map(named).collect(),
        names: log.bearers().into_iter().map(borne).collect(),
        facts,
        refused,
    })
}

/// The spawns of road users that appear at once in the first step and get no orders later.
fn told(log: &EpisodeLog, facts: &BTreeMap<u32, NpcFacts>) -> Vec<Told> {
    let Some(Outcome::Done { draw, spawned, delay_ticks: 0, .. }) =
        log.steps.first().map(|step| &step.outcome)
    else {
        return Vec::new();
    };
    let mut ids = spawned.iter();
    let mut told = Vec::new();
    for (nth, effect) in draw.effects.iter().enumerate() {
        let Effect::Spawn(request) = effect else { continue };
        let id = ids.next();
        let later = log.steps.iter().skip(1).flat_map(|step| step.outcome.effects());
        let is_ordered =
            |effect: &Effect| matches!(effect, Effect::Order(order) if Some(order.bearer) == request.bearer);
        let is_free = !later.chain(&draw.effects).any(is_ordered);
        // The road user or object that hides it has an id, too.
        for _ in 1..effect.newcomers() {
            ids.next();
        }
        if let Some((id, facts)) = id.filter(|_| is_free).and_then(|id| Some((*id, *facts.get(id)?))) {
            told.push(Told { id, request: *request, course: draw.course(nth).cloned(), facts });
        }
    }
    told
}

/// Where a scenario comes from and what it claims.
fn facts(scenario: &Scenario, road: &str) -> Vec<(String, String)> {
    let origin = &scenario.origin;
    let seed = origin.seed.map(|seed| seed.to_string());
    let known = [
        ("road", Some(road)),
        ("seed", seed.as_deref()),
        ("policy", origin.policy.as_deref()),
        ("ads", origin.ads.as_deref()),
        ("profile", origin.profile.as_deref()),
        ("profile_digest", origin.profile_digest.as_deref()),
        ("engine", origin.engine.as_deref()),
        ("traffic_digest", origin.traffic_digest.as_deref()),
    ];
    let scenario_name = [("scenario".to_owned(), scenario.name.clone())];
    let known = known.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned())));
    scenario_name.into_iter().chain(known).chain(scenario.claims.iter().filter_map(fact)).collect()
}

/// A claim as a name and a value. The collision probabilities of the steps are left out: they mean nothing elsewhere.
fn fact(claim: &Claim) -> Option<(String, String)> {
    let of = |what: &str, obstacle: &Option<avastra_lang::model::scenario::Obstacle>| match obstacle {
        Some(obstacle) => format!("{what} npc_{}", obstacle.number),
        None => what.to_owned(),
    };
    Some(match claim {
        Claim::Collision { obstacle, time } => {
            let time = time.map_or_else(|| "at any time".to_owned(), |time| time.to_string());
            (of("collision", obstacle), time)
        }
        Claim::Verdict { name, obstacle } => (of("verdict", obstacle), name.clone()),
        Claim::Breach { requirement, time } => {
            let time = time.map_or_else(|| "at any time".to_owned(), |time| time.to_string());
            (format!("breach of {requirement}"), time)
        }
        Claim::Kept { requirement, by } => (format!("{requirement} kept by"), by.join(", ")),
        Claim::Avoidability { class, by, obstacle } => {
            let by = by.as_ref().map_or_else(String::new, |by| format!(" by {}", by.join(", ")));
            (of("avoidability", obstacle), format!("{}{by}", class.name()))
        }
        Claim::Cause { modules, obstacle } => (of("cause", obstacle), modules.join(", ")),
        Claim::Priority { priority, obstacle } => (of("priority", obstacle), priority.name().to_owned()),
        Claim::Recurrence { requirement, obstacle, from, recurred, replays } => {
            let what = requirement.as_ref().map_or_else(
                || of("recurrence", obstacle),
                |requirement| format!("recurrence of the breach of {requirement}"),
            );
            let from = from.map_or_else(String::new, |from| format!(" from {from} on"));
            (format!("{what}{from}"), format!("{recurred} of {replays}"))
        }
        Claim::Minimal { obstacle } => (of("minimal", obstacle), "true".to_owned()),
        Claim::End(end) => ("end".to_owned(), end.clone()),
        Claim::Trace(digest) => ("trace".to_owned(), digest.clone()),
        Claim::Proc(_) => return None,
    })
}
