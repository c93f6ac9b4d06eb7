//! The readable face of a policy: its lines. The first line that applies acts.
//!
//! A condition compares one variable with one value; a line applies if all of its conditions hold. The first
//! row of the line that is legal at the moment acts; if none is legal, the step passes without an action.

use crate::model::expr::Comparison;

/// A line: if all conditions hold, the first legal row acts.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicyRule {
    /// Empty for `_`.
    pub conditions: Vec<Condition>,
    /// Numbers of rows, at least one.
    pub rows: Vec<usize>,
}

/// `ego_speed > 8.25 m/s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Index in `VARIABLES`.
    pub variable: usize,
    pub comparison: Comparison,
    /// In the variable's own unit; for a word, the number that stands for it.
    pub value: f64,
}
