//! Checked spaces, scenarios and policies. `check` builds them, `prove` reasons about them, and everything to the right
//! only reads them.
//!
//! Read [`Space`] first: actions, rules, states and roads, with every name resolved and every number in SI.
//! Its expressions are [`expr::Expr`], and [`evaluate`] is their one evaluator. A [`Row`] is one entry of the
//! action table; [`Memory`] holds the values of the states during an episode.

pub mod body;
pub mod code;
pub mod command;
mod digest;
pub mod effort;
mod eval;
pub mod expr;
mod fact;
mod facts;
pub mod field;
mod interval;
mod limits;
mod meaning;
mod memory;
mod numbers;
mod on_route;
mod outcome;
pub mod policy;
mod row;
pub(crate) mod requirement;
pub mod rules;
pub mod scenario;
mod sliding;
mod space;
mod trajectory;
mod value;
pub mod vocabulary;

pub use body::BodyWord;
pub use digest::{digest, digest_text};
pub use eval::evaluate;
pub use expr::{FnDef, WordExpr};
pub use facts::{
    CROSSWALK_GAP_M_MAX, Facts, JUNCTION_AHEAD_M_MAX, LEAD_GAP_M_MAX, LightTimes, MomentFacts, NearFacts,
    NpcFacts, OutcomeFacts, RoadFacts, SINCE_S_MAX, SpawnFacts, TIME_S_MAX, TickFacts, WorldFacts,
};
pub use interval::{End, Interval};
pub use limits::{
    AMBIENT_MAX, COMMANDED_MAX, EGO_ACCELERATION_MPS2_MAX, LIGHT_AT_M, LIMIT_PART_MAX, OFFSET_M, REPEAT,
    SIGNAL_PHASE_S, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, SPEED_MPS_MAX, START_MPS, TICK_MS, rounded_into,
    spawn_distance_m, spawn_out_of_bounds,
};
pub use meaning::Meaning;
pub(crate) use on_route::stretches;
pub use on_route::{LIGHT_AHEAD_M, NEAR_JUNCTION_M, OnRoute, Stretch, junction_ahead};
pub use policy::Policy;
pub use requirement::{Asked, Kept, ReadyRequirement, RequirementMemory};
pub use row::locals;
pub use rules::{NoStart, RulesInForce, UnknownRule};
pub use scenario::{
    Claim, DRIVERS, ENDS, Figure, MODULES, Obstacle, Origin, REPLAYS_MAX, Scenario, ScenarioStart,
    ScenarioStep, Trigger, ticks_s,
};
pub use sliding::Sliding;
pub use space::{
    ACTION_ODDS_MAX, ActionDef, BodyDef, COUNTED, Domain, EffectDef, EnumDef, EpisodeDef, GroupDef, InRow,
    Initial, LightDef, ManoeuvreCall, ManoeuvreDef, OrderDef, Parameter, PhaseDef, Reach, RequirementDef,
    RewardCase, Road, Row, RuleBinding, RuleBody, RuleDef, SetDef, SignalProgram, Space, SpawnDef, StateDef,
    StateMeaning, VerdictDef, reached, told,
};
pub use trajectory::{BesideRoute, Laid, Trajectory, TrajectoryDef, WayPoint, through};
pub(crate) use value::STATE_MAX;
pub use value::{EnumIndex, Memory, Type, Value};
pub use vocabulary::{Avoidability, ObstacleKind};
