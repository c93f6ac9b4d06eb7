//! Rows of the action table: the product of an action's `each` parameters.

use std::sync::Arc;

use crate::model::expr::Who;
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
    /// Indices in `Space::rules` of the rules that bind the row, optional ones included.
    pub rules: Arc<[usize]>,
    /// What is proved of the row on each road of `Space::roads` under the default rules.
    pub roads: Vec<Reach>,
}

/// Whether a row can run on a road.
#[derive(Debug, Clone, PartialEq)]
pub enum Reach {
    /// The row is not proved dead. Holds the ranges that the rules leave to its drawn numbers, SI.
    Open(Vec<(Arc<str>, Interval)>),
    /// The rules forbid every draw.
    Dead { rules: Vec<usize>, reason: String },
}

impl Reach {
    /// The ranges that the rules leave to the drawn numbers; `None` if the row is dead.
    pub fn ranges(&self) -> Option<&[(Arc<str>, Interval)]> {
        match self {
            Reach::Open(ranges) => Some(ranges),
            Reach::Dead { .. } => None,
        }
    }
}

impl Row {
    /// The name that an order or a fact is about; `None` where it is drawn.
    pub fn bearer(&self, who: Who, action: &ActionDef) -> Option<usize> {
        match who {
            Who::Named(bearer) => Some(bearer),
            Who::Given(local) => {
                let name = &action.parameters[local].name;
                self.axes.iter().find(|(axis, _)| axis == name).map(|(_, value)| value.variant())
            }
        }
    }
}

/// Values of all parameters of an action: the axes of the row, and the drawn values. A parameter that is
/// not drawn yet holds a placeholder.
pub fn locals(action: &ActionDef, row: &Row, drawn: &[(Arc<str>, Value)]) -> Vec<Value> {
    let find = |parameter: &Parameter| {
        let mut all = row.axes.iter().chain(drawn);
        all.find(|(name, _)| *name == parameter.name).map_or(Value::Bool(false), |(_, value)| *value)
    };
    action.parameters.iter().map(find).collect()
}
