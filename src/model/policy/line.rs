//! The readable face of a policy: lines of which the first that applies acts.
//!
//! A condition is a comparison of one variable with one value; a line wants all of its conditions. Of
//! the rows of a line the first that is legal at the moment acts; if none is, the step passes.

use crate::model::expr::Comparison;

/// A line: where all conditions hold, the first of the rows that is legal.
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
    /// Index in [`VARIABLES`].
    pub variable: usize,
    pub comparison: Comparison,
    /// In the variable's own unit; of a word the number that stands for it.
    pub value: f64,
}
