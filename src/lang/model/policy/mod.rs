//! Policies: what an agent has learned, as it stands in a file.
//!
//! The network's numbers mean nothing here: only their count and the file's digest are checked, and `agent`
//! gives them meaning. The readable face (`line`) is checked completely.

mod line;
mod plain;
mod seal;
mod variable;
mod weights;

pub use line::{Condition, PolicyRule};
pub use plain::expression;
pub(crate) use plain::record;
pub use seal::seal;
pub use variable::{VARIABLES, Variable, VariableKind, variable_index};
pub use weights::{WEIGHT_MAX, weights_from_lines, weights_to_lines};

use serde_json::{Map, Value};

/// A policy, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    pub name: String,
    pub docs: Vec<String>,
    pub origin: PolicyOrigin,
    /// Widths of the network's layers: inputs, hidden ones, rows of the table.
    pub layers: Vec<usize>,
    /// Whether the last layer has one more output, the state's value.
    pub dueling: bool,
    /// Every setting of the agent by name.
    pub hyperparameters: Map<String, Value>,
    /// All weights and biases.
    pub parameters: Vec<f32>,
    pub claims: Option<PolicyClaims>,
    /// The readable face, the first line first; empty if there is none.
    pub rules: Vec<PolicyRule>,
    /// Digest of the whole file except the paths in it.
    pub digest: String,
}

/// Where a policy comes from: enough to train it again.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyOrigin {
    pub agent: String,
    pub seed: u64,
    pub episodes: u64,
    pub roads: Vec<String>,
    pub ads: String,
    /// Settings of the driving system that are not its defaults, as one line of YAML.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// Digest of all settings of the driving system; `None` if it was given none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile_digest: Option<String>,
    /// How other vehicles drove, if not as they usually do: the name of a profile, or its settings in one line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traffic: Option<String>,
    pub engine: String,
    pub avastra: String,
    #[serde(default)]
    pub with: Vec<String>,
    #[serde(default)]
    pub without: Vec<String>,
}

/// The results that a policy claims, on episodes that can be played again.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyClaims {
    /// Episodes on each road.
    pub episodes: u64,
    pub seed: u64,
    pub collisions: u64,
    pub counted: u64,
    /// Episodes with a counted collision.
    pub colliding: u64,
    /// Mean sum of the space's rewards in an episode, rounded to four decimals.
    #[serde(rename = "return")]
    pub return_mean: f64,
    /// SHA-256 over the traces of all episodes, in order.
    pub trace: String,
    /// The results of the readable face on the same episodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rules: Option<RulesClaims>,
}

/// The results that a policy claims for its readable face. Shares and means are rounded to four decimals.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RulesClaims {
    /// Number of states in which the rules were compared with the network: all that their episodes reached.
    pub states: u64,
    /// Share of these states in which both choose one and the same row.
    pub fidelity: f64,
    /// Mean Q-value that the choices of the rules lose, by the network's own Q-values.
    pub regret: f64,
    pub collisions: u64,
    pub counted: u64,
    /// Episodes with a counted collision.
    pub colliding: u64,
    /// Mean sum of the space's rewards in an episode.
    #[serde(rename = "return")]
    pub return_mean: f64,
    /// SHA-256 over the traces of all episodes, in order.
    pub trace: String,
}

/// The exact face of a policy as it stands in the file.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Net {
    pub layers: Vec<usize>,
    pub dueling: bool,
    pub hyperparameters: Map<String, Value>,
    /// Base64 of the weights and biases, little-endian `f32`, layer by layer, cut into lines.
    pub weights: Vec<String>,
    pub digest: String,
}
