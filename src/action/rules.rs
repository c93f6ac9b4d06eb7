//! Which rules are in force: `--with` and `--without`.

use crate::model::{RuleDef, Space};
use crate::syntax::{listed, nearest};

/// The rules in force, by index in `Space::rules`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ActiveRules {
    active: Vec<bool>,
}

/// A rule was asked for that the space does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown rule `{name}`; {hint}")]
pub struct UnknownRule {
    pub name: String,
    /// The nearest rule, or all of them.
    pub hint: String,
}

impl ActiveRules {
    /// Every rule that is not `optional`, and those of `with`, except those of `without`.
    ///
    /// # Errors
    /// The first name that is no rule of the space.
    pub fn new(space: &Space, with: &[String], without: &[String]) -> Result<ActiveRules, UnknownRule> {
        let mut active: Vec<bool> = space.rules.iter().map(|rule| !rule.optional).collect();
        for (names, on) in [(with, true), (without, false)] {
            for name in names {
                let found = space.rules.iter().position(|rule| rule.name == *name);
                active[found.ok_or_else(|| unknown(space, name))?] = on;
            }
        }
        Ok(ActiveRules { active })
    }

    /// Whether the rule with that index is in force.
    pub fn is_active(&self, rule: usize) -> bool {
        self.active[rule]
    }

    /// Names of the rules in force, as declared.
    pub fn names<'a>(&'a self, space: &'a Space) -> impl Iterator<Item = &'a str> {
        space.rules.iter().zip(&self.active).filter(|(_, on)| **on).map(|(rule, _)| rule.name.as_str())
    }
}

fn unknown(space: &Space, name: &str) -> UnknownRule {
    let names = || space.rules.iter().map(|rule: &RuleDef| rule.name.as_str());
    let hint = match nearest(name, names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if space.rules.is_empty() => "the space has no rules".to_owned(),
        None => format!("the space has {}", listed(&names().collect::<Vec<_>>())),
    };
    UnknownRule { name: name.to_owned(), hint }
}
