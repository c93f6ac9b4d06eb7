//! Which rules are in force: all that are not optional, changed by `--with` and `--without`.

use crate::model::effort;
use crate::model::space::Row;
use crate::model::space::{RuleDef, Space};
use crate::syntax::{listed, nearest};

/// Number of rules that are copied or passed over in one step of a proof.
const RULES_A_STEP: usize = 16;

/// The rules in force, by index in `Space::rules`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RulesInForce {
    in_force: Vec<bool>,
    /// By index in `Space::requirements`.
    required: Vec<bool>,
}

/// A rule was named that the space does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown rule `{name}`; {hint}")]
pub struct UnknownRule {
    pub name: String,
    /// The nearest rule, or all of them.
    pub hint: String,
}

impl RulesInForce {
    /// Every rule that is not `optional`, and those of `with`, except those of `without`.
    ///
    /// # Errors
    /// The first name that is no rule of the space.
    pub fn new(space: &Space, with: &[String], without: &[String]) -> Result<RulesInForce, UnknownRule> {
        let mut rules = RulesInForce::by_default(space);
        for (names, on) in [(with, true), (without, false)] {
            for name in names {
                let rule = space.rules.iter().position(|rule| rule.name == *name);
                let requirement = space.requirements.iter().position(|required| required.name == *name);
                match (rule, requirement) {
                    (Some(rule), _) => rules.in_force[rule] = on,
                    (None, Some(requirement)) => rules.required[requirement] = on,
                    (None, None) => return Err(unknown(space, name)),
                }
            }
        }
        Ok(rules)
    }

    /// Every rule that is not `optional`.
    pub fn by_default(space: &Space) -> RulesInForce {
        RulesInForce {
            in_force: space.rules.iter().map(|rule| !rule.optional).collect(),
            required: space.requirements.iter().map(|required| !required.optional).collect(),
        }
    }

    /// No rule at all.
    pub(crate) fn none(space: &Space) -> RulesInForce {
        RulesInForce {
            in_force: vec![false; space.rules.len()],
            required: vec![false; space.requirements.len()],
        }
    }

    /// One rule, and no other.
    pub(crate) fn only(space: &Space, rule: usize) -> RulesInForce {
        let mut rules = RulesInForce::none(space);
        rules.in_force[rule] = true;
        rules
    }

    /// These rules without one of them.
    pub fn except(&self, rule: usize) -> RulesInForce {
        effort::spend(1 + self.in_force.len() / RULES_A_STEP);
        let mut rules = self.clone();
        rules.in_force[rule] = false;
        rules
    }

    /// These rules and one more.
    pub(crate) fn with(&self, rule: usize) -> RulesInForce {
        effort::spend(1 + self.in_force.len() / RULES_A_STEP);
        let mut rules = self.clone();
        rules.in_force[rule] = true;
        rules
    }

    /// Whether the rule with that index is in force.
    pub fn contains(&self, rule: usize) -> bool {
        self.in_force[rule]
    }

    /// The requirements in force, by index, in the order of their declarations.
    pub fn required(&self) -> impl Iterator<Item = usize> {
        (0..self.required.len()).filter(|requirement| self.required[*requirement])
    }

    /// The rules in force, in the order of their declarations.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> {
        effort::spend(1 + self.in_force.len() / RULES_A_STEP);
        (0..self.in_force.len()).filter(|rule| self.in_force[*rule])
    }

    /// The rules in force that bind a row, in the order of their declarations.
    pub(crate) fn on_row(&self, row: &Row) -> impl Iterator<Item = usize> {
        row.rules.iter().copied().filter(|rule| self.in_force[*rule])
    }
}

fn unknown(space: &Space, name: &str) -> UnknownRule {
    let required = || space.requirements.iter().map(|required| required.name.as_str());
    let names = || space.rules.iter().map(|rule: &RuleDef| rule.name.as_str()).chain(required());
    let hint = match nearest(name, names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if names().next().is_none() => "the space has no rules".to_owned(),
        None => format!("the space has {}", listed(&names().collect::<Vec<_>>())),
    };
    UnknownRule { name: name.to_owned(), hint }
}
