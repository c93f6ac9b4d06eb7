//! Rows of the action table: the product of an action's `each` parameters.

use std::sync::Arc;

use crate::model::expr::Who;
use crate::model::space::{ActionDef, Parameter, Row};
use crate::model::value::Value;

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
