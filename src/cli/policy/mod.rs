//! `avastra policy`: what a policy prefers, its rules, its weights; and the claims that `avastra replay` checks.

pub mod claims;
pub mod distil;
mod explain;
mod weights;

use std::sync::Arc;

use avastra_lang::model::Policy;
use avastra_search::agent::{Face, QPolicy};
use avastra_world::action::ActionTable;
use avastra_world::sim::ENGINE;

use super::arguments::{PolicyArguments, PolicyCommand};
use super::error::Failure;
use super::output::Output;

/// Explains a policy, distils its rules or writes its weights.
pub fn policy(output: &Output, arguments: &PolicyArguments) -> Result<(), Failure> {
    match &arguments.command {
        PolicyCommand::Explain(arguments) => explain::explain(output, arguments),
        PolicyCommand::Distil(arguments) => distil::distil(output, arguments),
        PolicyCommand::Weights(arguments) => weights::weights(output, arguments),
    }
}

/// Checks that a policy was trained in this version of the simulated world.
pub fn same_world(policy: &Policy) -> Result<(), Failure> {
    let (name, engine) = (&policy.name, &policy.origin.engine);
    if engine == ENGINE {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "`{name}` was trained in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike"
    )))
}

/// The policy ready to act on a table, by its network or by its rules.
///
/// # Errors
/// If its settings cannot be read, its network does not fit them, or its rules are to act and it has none.
pub fn acting(table: &ActionTable, policy: &Policy, face: Face) -> Result<QPolicy, Failure> {
    let acting = QPolicy::read(policy, table)
        .map_err(|error| Failure::usage(format!("`{}`: {error}", policy.name)))?;
    match face {
        Face::Network => Ok(acting),
        Face::Rules if policy.rules.is_empty() => Err(Failure::usage(format!(
            "`{}` has no rules: `avastra policy distil FILE` makes some",
            policy.name
        ))),
        Face::Rules => Ok(acting.with_rules(Arc::new(policy.rules.clone()))),
    }
}
