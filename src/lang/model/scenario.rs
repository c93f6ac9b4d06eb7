//! The typed form of an emitted scenario: one concrete timeline and what it claims.

use core::fmt;
use std::sync::Arc;

use crate::model::expr::{Expr, ExprKind};
use crate::model::limits::TICK_MS;
use crate::model::space::COUNTED;
use crate::model::value::{Memory, Value};
use crate::model::vocabulary::{Avoidability, ObstacleKind, Priority, Word};

/// One timeline over a space.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub name: String,
    pub docs: Vec<String>,
    pub origin: Origin,
    /// Index in `Space::roads`.
    pub road: usize,
    pub start: ScenarioStart,
    pub steps: Vec<ScenarioStep>,
    pub claims: Vec<Claim>,
}

/// Where a scenario came from. Every field may be missing in a file written by hand.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Origin {
    pub seed: Option<u64>,
    pub episode: Option<u64>,
    pub policy: Option<String>,
    pub ads: Option<String>,
    /// Settings of the driving system that are not its defaults, as one line of YAML.
    pub profile: Option<String>,
    /// Digest of all its settings.
    pub profile_digest: Option<String>,
    /// Digest of the answers of an external driving system.
    pub answers: Option<String>,
    /// The text of the file of these answers, if whoever read the scenario found it beside.
    pub recorded_answers: Option<Arc<str>>,
    pub engine: Option<String>,
    /// The traffic profile as one line of YAML, and its digest; the default if not given.
    pub traffic: Option<String>,
    pub traffic_digest: Option<String>,
    /// Rules that were asked for (`--with`) and switched off (`--without`).
    pub with: Vec<String>,
    pub without: Vec<String>,
}

/// How the episode begins.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioStart {
    /// Every state variable: as the `start` block says, else as the space declares.
    pub memory: Memory,
    /// `signal_phase`, s; if not given that of the road, or else 0.
    pub signal_phase_s: f64,
    /// `traffic_seed`: seed of the choices of other road users.
    pub traffic_seed: Option<u64>,
    /// `ambient`: vehicles of ambient traffic; 0 if not given.
    pub ambient: u32,
    /// `ego_speed`, m/s; that of the road if not given.
    pub ego_mps: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioStep {
    /// Number of the step, from 0.
    pub number: u64,
    /// Index of the row in the action table; `None` is `wait()`, a step without an action.
    pub row: Option<usize>,
    /// Values of the action's drawn (`any`) parameters, as declared.
    pub drawn: Vec<(Arc<str>, Value)>,
    /// When within the step it happens; `None`: at the beginning.
    pub trigger: Option<Arc<Trigger>>,
}

/// The moment within a step at which an action happens: some ticks after a condition has held for others.
#[derive(Debug, Clone, PartialEq)]
pub struct Trigger {
    /// `None` holds from the beginning of the step.
    pub once: Option<Condition>,
    /// How long it must have held without a break.
    pub held_ticks: u32,
    pub after_ticks: u32,
}

/// A condition and how it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    pub expr: Expr,
    pub text: String,
}

impl Trigger {
    /// The numbers of the road users that the condition asks about.
    pub fn road_users(&self) -> Vec<u32> {
        let number = |kind: &ExprKind| match kind {
            ExprKind::OfRoadUser(id, _) => Some(*id),
            _ => None,
        };
        self.once.iter().flat_map(|condition| condition.expr.filter_map(number)).collect()
    }

    /// The names of road users that the condition asks about, by index in `Space::bearers`.
    pub fn bearers(&self) -> Vec<usize> {
        // A scenario has no parameters that could hold one.
        self.once.iter().flat_map(|condition| condition.expr.bearers(0)).collect()
    }

    /// The trigger as a file spells it.
    pub fn text(&self) -> String {
        let once = self.once.as_ref().map(|once| format!("once {}", once.text));
        let time = |word: &str, ticks: u32| (ticks > 0).then(|| format!("{word} {} s", ticks_s(ticks)));
        let (held, after) = (time("for", self.held_ticks), time("after", self.after_ticks));
        once.into_iter().chain(held).chain(after).collect::<Vec<_>>().join(" ")
    }
}

/// A number of ticks in seconds, as the decimal that a file spells.
pub fn ticks_s(ticks: u32) -> f64 {
    f64::from(ticks) * TICK_MS as f64 / 1000.0
}

/// A claim of a scenario about what happens.
#[derive(Debug, Clone, PartialEq)]
pub enum Claim {
    /// `expect collision with npc#2 at 14.22 s`.
    Collision { obstacle: Option<Obstacle>, time: Option<Figure> },
    /// `expect proc == [0.0, 0.12]`: ProC of each step.
    Proc(Vec<Figure>),
    /// `expect trace == "sha256:…"`.
    Trace(String),
    /// `expect counted with npc#2`: the named verdict holds of the collision.
    Verdict { name: String, obstacle: Option<Obstacle> },
    /// `expect stops_at_red.breached at 14.22 s`: the requirement is not kept, for the first time then.
    Breach { requirement: String, time: Option<Figure> },
    /// `expect stops_at_red.kept by [cc, fsm]`: the careful drivers that keep the requirement in the same steps.
    Kept { requirement: String, by: Vec<String> },
    /// `expect avoidable by [cc, fsm] with npc#2`: the class of the collision, and the reference drivers
    /// that avoid it.
    Avoidability { class: Avoidability, by: Option<Vec<String>>, obstacle: Option<Obstacle> },
    /// `expect cause == perception with npc#2`, `expect cause == [tracking, planning]`: the module at
    /// fault, or the two that are at fault together; in words of [`MODULES`].
    Cause { modules: Vec<String>, obstacle: Option<Obstacle> },
    /// `expect priority == other with npc#2`: who had priority in the collision.
    Priority { priority: Priority, obstacle: Option<Obstacle> },
    /// `expect recurrence == 14 / 20 with npc#2`, `expect stops_at_red.recurrence == 14 / 20`: in how many replays under
    /// other chance the collision, or the breach of a requirement, happens again. `expect recurrence == 1 / 10 with npc#2 at 3.8 s`:
    /// the chance is another one from that moment on.
    Recurrence {
        requirement: Option<String>,
        obstacle: Option<Obstacle>,
        from: Option<Figure>,
        recurred: u32,
        replays: u32,
    },
    /// `expect minimal with npc#2`: if any one step is left out, with its time or without, there is no such
    /// collision.
    Minimal { obstacle: Option<Obstacle> },
    /// `expect end == arrived`: one of [`ENDS`].
    End(String),
}

impl Claim {
    /// Whether it is about a collision, and not about the drive as a whole.
    pub fn is_of_a_collision(&self) -> bool {
        match self {
            Claim::Collision { .. }
            | Claim::Verdict { .. }
            | Claim::Avoidability { .. }
            | Claim::Cause { .. }
            | Claim::Priority { .. }
            | Claim::Minimal { .. } => true,
            Claim::Recurrence { requirement, .. } => requirement.is_none(),
            Claim::Proc(_) | Claim::Trace(_) | Claim::Breach { .. } | Claim::Kept { .. } | Claim::End(_) => {
                false
            }
        }
    }
}

impl Scenario {
    /// The requirements that it says are breached.
    pub fn breached(&self) -> impl Iterator<Item = &str> {
        self.claims.iter().filter_map(|claim| match claim {
            Claim::Breach { requirement, .. } => Some(requirement.as_str()),
            _ => None,
        })
    }

    /// Whether it claims a collision, or a breach of a requirement.
    pub fn claims_a_finding(&self) -> bool {
        let is_finding = |claim: &Claim| matches!(claim, Claim::Collision { .. } | Claim::Breach { .. });
        self.claims.iter().any(is_finding)
    }

    /// Whether the first of its claims about a collision or a breach is about a breach.
    pub fn is_about_a_breach(&self) -> bool {
        let is_found = |claim: &&Claim| claim.is_of_a_collision() || matches!(claim, Claim::Breach { .. });
        self.claims.iter().find(is_found).is_some_and(|claim| matches!(claim, Claim::Breach { .. }))
    }

    /// Whether a crash with an obstacle is one that the scenario is about. If claims name a `counted` obstacle, only those
    /// obstacles matter. Otherwise the obstacles matter that its claims say are hit. Without either claim, any obstacle
    /// matters.
    pub fn crashes_with(&self, number: u32) -> bool {
        let of = |is_meant: fn(&Claim) -> Option<Obstacle>| {
            let numbers = self.claims.iter().filter_map(is_meant).map(|obstacle| obstacle.number);
            numbers.collect::<Vec<_>>()
        };
        let counted = of(|claim| match claim {
            Claim::Verdict { name, obstacle } if name == COUNTED => *obstacle,
            _ => None,
        });
        let hit = of(|claim| match claim {
            Claim::Collision { obstacle, .. } => *obstacle,
            _ => None,
        });
        let claimed = if counted.is_empty() { hit } else { counted };
        claimed.is_empty() || claimed.contains(&number)
    }
}

/// Most replays that a claim of recurrence is about.
pub const REPLAYS_MAX: u32 = 1000;

/// The modules of a driving system that can be at fault, in the words of `expect cause == …`.
pub const MODULES: [&str; 8] =
    ["localization", "perception", "tracking", "prediction", "planning", "latency", "control", "emergency"];

/// The drivers that can tell whether a collision was avoidable, in the words of `expect avoidable by […]`.
pub const DRIVERS: [&str; 8] = ["modular", "frenet", "reactive", "idm", "cc", "fsm", "rss", "r157"];

/// How an episode may end, in the words of `expect end == …`.
pub const ENDS: [&str; 14] = [
    "arrived",
    "stalled",
    "blocked",
    "astray",
    "left_the_map",
    "limit",
    "script",
    "ads_crash",
    "ads_timeout",
    "ads_protocol",
    "ads_flood",
    "ads_error",
    "ads_nondeterministic",
    "ads_absent",
];

/// A number with the unit and the precision in which it was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// In its own unit.
    pub value: f64,
    pub decimals: usize,
    /// The word of its unit; empty if it has none.
    pub unit: &'static str,
    /// Its unit in SI units.
    pub factor: f64,
}

impl Figure {
    /// The number in SI units.
    pub fn si(&self) -> f64 {
        self.value * self.factor
    }

    /// Whether a number in SI, rounded to the same precision, is this figure.
    pub fn rounds(&self, found: f64) -> bool {
        let as_written = |value: f64| format!("{value:.*}", self.decimals);
        // Minus zero is zero.
        as_written(found / self.factor + 0.0) == as_written(self.value + 0.0)
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.*}", self.decimals, self.value)?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// A road user as a claim names it: `npc#2`, `pedestrian#3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Obstacle {
    pub kind: ObstacleKind,
    /// Its place in the order of appearance, from 1.
    pub number: u32,
}

impl ObstacleKind {
    /// Whether the word fits a road user.
    pub fn fits(self, is_vehicle: bool) -> bool {
        match self {
            ObstacleKind::Npc => true,
            ObstacleKind::Pedestrian => !is_vehicle,
            ObstacleKind::Vehicle => is_vehicle,
        }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#{}", self.kind.name(), self.number)
    }
}
