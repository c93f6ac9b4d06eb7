//! Rows of the action table: the product of an action's `each` parameters.

use std::sync::Arc;

use crate::model::interval::Interval;
use crate::model::space::{ActionDef, Parameter};
use crate::model::value::Value;

/// One row. Its number is the index of the network's output.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub index: usize,
    /// Index in `Space::actions`.
    pub action: usize,
    /// Names and values of the `each` parameters, as declared.
    pub axes: Vec<(Arc<str>, Value)>,
    /// `drive_ahead(lane: Left, mode: Near, then: Change)`.
    pub label: String,
    /// Indices in `Space::rules` of the rules that bind it, optional ones included.
    pub rules: Arc<[usize]>,
    /// What can be said of it beforehand on each road of `Space::roads`, with the default rules.
    pub roads: Vec<Reach>,
}

/// Whether a row can run on a road.
#[derive(Debug, Clone, PartialEq)]
pub enum Reach {
    /// Nothing forbids it beforehand. The ranges that the rules leave to its drawn numbers, SI.
    Open(Vec<(Arc<str>, Interval)>),
    /// The rules forbid every draw.
    Dead { rules: Vec<usize>, reason: String },
}

/// Values of all parameters of an action: its row's axes and what was drawn. What is not drawn yet
/// holds a placeholder.
pub(crate) fn locals(action: &ActionDef, row: &Row, drawn: &[(Arc<str>, Value)]) -> Vec<Value> {
    let find = |parameter: &Parameter| {
        let mut all = row.axes.iter().chain(drawn);
        all.find(|(name, _)| *name == parameter.name).map_or(Value::Bool(false), |(_, value)| *value)
    };
    action.parameters.iter().map(find).collect()
}
