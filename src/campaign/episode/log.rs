//! The record of an episode: enough to judge it, to count it and to replay it.

use std::collections::BTreeMap;
use std::sync::Arc;

use avastra_drivers::external::{Conversation, Failure, FailureKind};
use avastra_drivers::{ModularConfig, Reason, Restraint, Status};
use avastra_lang::model::vocabulary::Verb;
use avastra_lang::model::{BodyWord, Memory, Space};
use avastra_search::mdp::{PerceptionCounts, StateVector};
use avastra_world::action::{Draw, Effect};
use avastra_world::sim::{Contact, Incident, Start};

use super::margins::MarginSeries;
use super::monitor::{Breach, Margin};
use super::precrash::PreCrash;
use super::shape::Shape;

/// One episode, from start to end.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeLog {
    pub road: String,
    pub ads: String,
    /// Settings of the driving system, if it has any.
    pub profile: Option<ModularConfig>,
    /// The requests to an external driving system, and its answers.
    pub conversation: Option<Arc<Conversation>>,
    /// Why an external driving system could not drive on.
    pub failure: Option<Failure>,
    pub seed: u64,
    pub start: Start,
    /// States of the space at the start.
    pub memory: Memory,
    pub steps: Vec<StepLog>,
    /// The reasons that limited the ego vehicle's speed, by rising time; each holds until the next one.
    pub held: Vec<Held>,
    pub collisions: Vec<Collision>,
    /// Contacts of obstacles with each other.
    pub incidents: Vec<Incident>,
    /// The ego vehicle's breaches of the space's requirements, by rising time.
    pub breaches: Vec<Breach>,
    /// For each requirement in force.
    pub margins: Vec<Margin>,
    /// Their margins tick by tick, if they were asked for.
    pub series: Vec<MarginSeries>,
    pub end: End,
    pub duration_s: f64,
    /// Distance driven by the ego vehicle, m.
    pub distance_m: f64,
    /// Red lights passed by the ego vehicle.
    pub red_runs: u32,
    /// Physics steps done.
    pub ticks: u64,
}

/// The reason that limited the ego vehicle's speed, as the driving system states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// From this time on, s.
    pub from_s: f64,
    reason: Reason,
    /// In the words of an external driving system.
    reported: Option<Arc<str>>,
}

impl Held {
    /// The reason that a driving system states at a time.
    pub(super) fn new(from_s: f64, status: &Status) -> Held {
        Held { from_s, reason: status.reason, reported: status.reported.clone() }
    }

    /// Whether a driving system still says so.
    pub(super) fn still(&self, status: &Status) -> bool {
        self.reason == status.reason && self.reported == status.reported
    }

    /// In a few words, for example `follow 3`.
    pub fn text(&self) -> String {
        self.reason.in_words(self.reported.as_deref())
    }

    /// How much it holds the speed back.
    pub fn restraint(&self) -> Restraint {
        self.reason.restraint()
    }
}

/// One action of the agent and the observation period after it.
#[derive(Debug, Clone, PartialEq)]
pub struct StepLog {
    /// When the step began, s.
    pub time_s: f64,
    /// The state vector before the action, shape `(STATE_LEN,)`.
    pub state: StateVector,
    pub outcome: Outcome,
    /// The states of the space after the action, or after a step without one.
    pub memory: Memory,
    /// Largest collision probability of the observation period, in `[0, 1]`.
    pub proc: f64,
    pub reward: f64,
    /// Obstacles that the driving system misses, and ghosts that it sees, at the end of the period.
    pub perception: PerceptionCounts,
    /// Digest of every bit of the world's state after every tick so far.
    pub trace: [u8; 32],
}

/// The outcome of the agent's choice.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Carried out as drawn, `delay_ticks` after the step began; `spawned` has the ids of the road users that it made
    /// appear.
    Done { draw: Draw, spawned: Vec<u32>, delay_ticks: u32 },
    /// No action was chosen: no row was legal, or the script has none here.
    Passed,
    /// The chosen row could not be carried out: nothing changed, and the step passed without an action.
    Refused { row: usize, rule: Option<String>, reason: String },
}

impl Outcome {
    /// Its effects on the world, in order.
    pub fn effects(&self) -> &[Effect] {
        match self {
            Outcome::Done { draw, .. } => &draw.effects,
            Outcome::Passed | Outcome::Refused { .. } => &[],
        }
    }

    /// The ids of the road users that it made appear.
    pub fn spawned(&self) -> &[u32] {
        match self {
            Outcome::Done { spawned, .. } => spawned,
            Outcome::Passed | Outcome::Refused { .. } => &[],
        }
    }
}

/// A contact of the ego vehicle with an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    pub contact: Contact,
    /// Index of the step in which it happened.
    pub step: usize,
    pub body: BodyWord,
    /// Mass of the obstacle, t.
    pub mass_t: f64,
    pub verb: Verb,
    /// When the obstacle appeared, s.
    pub spawned_s: f64,
    /// The shape of the ego vehicle's way to it.
    pub shape: Shape,
    pub kind: PreCrash,
}

impl EpisodeLog {
    /// The states of the space after the action of a step; those at the start if there is no such step.
    pub fn memory_after(&self, step: usize) -> &Memory {
        self.steps.get(step).map_or(&self.memory, |step| &step.memory)
    }

    /// The requirements that were breached at some moment of a step, by bit.
    pub fn breached_in(&self, step: usize) -> u64 {
        let begins_s = self.steps.get(step).map_or(f64::INFINITY, |step| step.time_s);
        let is_in = |breach: &&Breach| breach.step <= step && breach.until_s > begins_s;
        self.breaches.iter().filter(is_in).fold(0, |set, breach| set | 1 << breach.requirement)
    }

    /// The first breach of each requirement that was breached, by rising time.
    pub fn first_breaches(&self) -> impl Iterator<Item = &Breach> {
        let is_first = |(index, breach): &(usize, &Breach)| {
            !self.breaches[..*index].iter().any(|before| before.requirement == breach.requirement)
        };
        self.breaches.iter().enumerate().filter(is_first).map(|(_, breach)| breach)
    }

    /// The index of the first breach of a requirement, by its number in the space.
    pub fn first_breach(&self, requirement: usize) -> Option<usize> {
        self.breaches.iter().position(|breach| breach.requirement == requirement)
    }

    /// The first breach of a requirement of the space that was played, by its name.
    pub fn breach_of(&self, space: &Space, requirement: &str) -> Option<&Breach> {
        self.breaches.iter().find(|breach| space.requirements[breach.requirement].name == requirement)
    }

    /// The numbers of the steps whose action was refused, each with the reason.
    pub fn refused(&self) -> impl Iterator<Item = (usize, String)> {
        self.steps.iter().enumerate().filter_map(|(number, step)| match &step.outcome {
            Outcome::Refused { rule, reason, .. } => {
                let rule = rule.as_ref().map_or(String::new(), |rule| format!("rule `{rule}`: "));
                Some((number, format!("{rule}{reason}")))
            }
            Outcome::Done { .. } | Outcome::Passed => None,
        })
    }

    /// The reason that limited the speed at a time, s; `None` before the first reason.
    pub fn held_at(&self, time_s: f64) -> Option<&Held> {
        // Times of contacts lie within a tick, which is driven by what is said at its beginning.
        self.held[..self.held.partition_point(|held| held.from_s <= time_s)].last()
    }

    /// Whether road users crashed into each other, not into the ego vehicle, in a step.
    pub fn others_crashed_in(&self, step: usize) -> bool {
        let begins_s = |step: usize| self.steps.get(step).map_or(f64::INFINITY, |step| step.time_s);
        let of_step = begins_s(step)..begins_s(step + 1);
        self.incidents.iter().any(|incident| of_step.contains(&incident.time_s))
    }

    /// When road users first crash into each other, not into the ego vehicle, s.
    pub fn others_crash_s(&self) -> Option<f64> {
        self.incidents.first().map(|incident| incident.time_s)
    }

    /// Each crash of road users into each other, in words. `space` is the one that was played.
    pub fn incidents_in_words(&self, space: &Space) -> Vec<String> {
        let bearers = self.bearers();
        let name = |id: u32| match bearers.get(&id) {
            Some(bearer) => format!("npc#{id} (`{}`)", space.bearers[*bearer]),
            None => format!("npc#{id}"),
        };
        let told = |incident: &Incident| {
            let (one, other) = (name(incident.obstacle), name(incident.other));
            format!("{one} and {other} crash into each other at {:.2} s", incident.time_s)
        };
        self.incidents.iter().map(told).collect()
    }

    /// The author's own bodies among the road users: number of the road user, index in the space.
    pub fn own_bodies(&self) -> BTreeMap<u32, usize> {
        self.newcomers().into_iter().flat_map(|(first, effect)| effect.own_bodies(first)).collect()
    }

    /// The names that road users bear: number of the road user, index of the name in the space.
    pub fn bearers(&self) -> BTreeMap<u32, usize> {
        let bearer = |(first, effect): (u32, &Effect)| match effect {
            Effect::Spawn(request) => Some((first, request.bearer?)),
            Effect::Time(_) | Effect::Sky(..) | Effect::Order(_) | Effect::Light(_) => None,
        };
        self.newcomers().into_iter().filter_map(bearer).collect()
    }

    /// Each effect that made road users appear, with the number of the first of them.
    fn newcomers(&self) -> Vec<(u32, &Effect)> {
        let mut newcomers = Vec::new();
        for step in &self.steps {
            let Outcome::Done { draw, spawned, .. } = &step.outcome else { continue };
            let mut ids = spawned.iter();
            for effect in &draw.effects {
                let first = ids.by_ref().take(effect.newcomers() as usize).min();
                newcomers.extend(first.map(|first| (*first, effect)));
            }
        }
        newcomers
    }

    /// Digest of every bit of the world's state after every tick ([`Trace`]); zeros if there was no step.
    ///
    /// [`Trace`]: avastra_world::sim::Trace
    pub fn trace(&self) -> [u8; 32] {
        self.steps.last().map_or([0; 32], |step| step.trace)
    }
}

/// Why an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The goal was reached: terminal.
    Arrived,
    /// No progress for several steps: truncated.
    Stalled,
    /// No progress, because something stood in the way that would not go: wrecks, or vehicles that wait for each other.
    /// It says nothing about the driving system.
    Blocked,
    /// No progress, because the ego vehicle has left its lane and does not find back.
    Astray,
    /// It drove beyond the end of its way, or away from every road: there is nothing to drive on. The way up to there
    /// counts.
    LeftMap,
    /// The space's limit of steps was reached: truncated.
    StepLimit,
    /// The script of a replay has no more steps.
    Script,
    /// An external driving system failed: a separate finding, and no collision.
    Failed(FailureKind),
}

impl End {
    pub fn name(self) -> &'static str {
        match self {
            End::Arrived => "arrived",
            End::Stalled => "stalled",
            End::Blocked => "blocked",
            End::Astray => "astray",
            End::LeftMap => "left_the_map",
            End::StepLimit => "limit",
            End::Script => "script",
            End::Failed(kind) => kind.name(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_can_be_claimed() {
        let driven = [
            End::Arrived,
            End::Stalled,
            End::Blocked,
            End::Astray,
            End::LeftMap,
            End::StepLimit,
            End::Script,
        ];
        let ends = driven.into_iter().chain(FailureKind::ALL.map(End::Failed));
        assert_eq!(ends.map(End::name).collect::<Vec<_>>(), avastra_lang::model::ENDS);
    }
}
