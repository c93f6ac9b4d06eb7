//! From tree to meaning: a checked [`Space`] or [`Scenario`], or diagnostics.

mod bound;
mod check;
pub mod code;
mod difference;
mod enclose;
mod eval;
pub mod explain;
pub mod expr;
mod interval;
mod limits;
mod load;
mod memory;
mod overriding;
mod proofs;
pub mod policy;
mod reach;
mod row;
mod scenario;
mod space;
mod suggest;
mod value;
pub mod vocabulary;

pub(crate) use bound::{Bound, bounds};
pub use check::scenario;
pub use difference::{Change, Difference, differences};
pub use eval::{Facts, OutcomeFacts, evaluate};
pub use interval::{End, Interval};
pub use limits::{AMBIENT_MAX, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, TICK_MS};
pub use load::{Loaded, LoadedFile, MapCache, ReadError, ReadFile, digest, digest_text, load, load_with};
pub use policy::Policy;
pub use proofs::{Removal, Witness, removals, witness};
pub(crate) use row::locals;
pub use row::{Reach, Row};
pub use scenario::{
    Avoidability, Claim, ENDS, Figure, MODULES, Origin, Scenario, ScenarioStart, ScenarioStep,
};
pub use space::{
    ActionDef, COUNTED, Domain, EffectDef, EnumDef, EpisodeDef, ExpectDef, FnDef, GroupDef, Initial,
    Parameter, RewardCase, Road, RoadFacts, RuleBinding, RuleBody, RuleDef, SetDef, Space, SpawnDef,
    StateDef, StateMeaning, VerdictDef, WordExpr,
};
pub use suggest::suggest_uses;
pub use value::{EnumIndex, Memory, Type, Value};

#[cfg(test)]
mod tests;
