//! The audit: for every rule, which rows it binds and where it is enforced. No rule is ignored.

use core::fmt;

use crate::action::table::ActionTable;
use avastra_lang::model::vocabulary::Known;
use avastra_lang::model::{Reach, RuleBody};
use avastra_lang::prove::{Removal, removals};

/// The audit of every rule of a space.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Audit {
    pub rules: Vec<RuleAudit>,
}

#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RuleAudit {
    pub name: String,
    pub optional: bool,
    /// Rows that it binds.
    pub rows: Vec<usize>,
    /// Rows that this rule helps to mask on some road, alone or in conflict with other rules.
    pub masks: Vec<usize>,
    /// Numeric parameters whose range it cuts before they are drawn.
    pub cuts: Vec<String>,
    /// How much of their ranges it takes away by itself, on each road.
    pub removes: Vec<Removal>,
    pub enforced: Enforcement,
    /// Whether the states with which an episode begins obey it, too.
    pub from_the_start: bool,
}

/// When a rule is judged. Masks and cuts come earlier, but only to avoid draws that the rule would refuse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Enforcement {
    /// On every complete draw.
    Draw,
    /// On every draw, after the world has answered where the spawn would be.
    Survey,
    /// On the step from one state to the next.
    Transition,
    /// On every lane change that an action commanded, when it would begin.
    Change,
    /// On every phase of a manoeuvre, when it would begin.
    Phase,
}

/// Audits every rule of the table's space.
pub fn audit(table: &ActionTable) -> Audit {
    let space = table.space();
    let rules = space.rules.iter().enumerate().map(|(index, rule)| {
        let bound = table.rows().iter().filter(|row| row.rules.contains(&index));
        let helps = |reach: &Reach| matches!(reach, Reach::Dead { rules, .. } if rules.contains(&index));
        let masks = table.rows().iter().filter(|row| row.roads.iter().any(helps));
        let enforced = match &rule.body {
            RuleBody::Moves { .. } => Enforcement::Transition,
            RuleBody::During(_) => Enforcement::Change,
            RuleBody::Phases { .. } => Enforcement::Phase,
            RuleBody::Holds(bindings)
                if bindings.iter().any(|binding| binding.condition.known() > Known::Road) =>
            {
                Enforcement::Survey
            }
            RuleBody::Holds(_) => Enforcement::Draw,
        };
        let mut cuts: Vec<String> = Vec::new();
        for (action, bounds) in space.bounds.iter().enumerate() {
            for bound in bounds.iter().filter(|bound| bound.rule == Some(index) && bound.is_drawn_within) {
                let parameter = &space.actions[action].parameters[bound.local];
                if !parameter.axis && !cuts.contains(&parameter.name.to_string()) {
                    cuts.push(parameter.name.to_string());
                }
            }
        }
        RuleAudit {
            name: rule.name.clone(),
            optional: rule.optional,
            rows: bound.map(|row| row.index).collect(),
            masks: masks.map(|row| row.index).collect(),
            cuts,
            removes: removals(space, index),
            enforced,
            from_the_start: rule.start.is_some(),
        }
    });
    Audit { rules: rules.collect() }
}

impl fmt::Display for Audit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.rules.iter().map(|rule| rule.name.chars().count()).max().unwrap_or(0);
        for rule in &self.rules {
            let enforced = match rule.enforced {
                Enforcement::Draw => "every draw",
                Enforcement::Survey => "every draw, in the world",
                Enforcement::Transition => "every transition",
                Enforcement::Change => "every lane change, as it begins",
                Enforcement::Phase => "every phase of its manoeuvre, as it begins",
            };
            write!(f, "{:width$}  binds {:>3} rows, enforced on {enforced}", rule.name, rule.rows.len())?;
            if rule.from_the_start {
                f.write_str(" and at the start")?;
            }
            if !rule.masks.is_empty() {
                write!(f, ", masks {} rows", rule.masks.len())?;
            }
            writeln!(f, "{}", if rule.optional { " (optional)" } else { "" })?;
            if !rule.cuts.is_empty() {
                writeln!(f, "{:width$}  cuts {}", "", rule.cuts.join(", "))?;
            }
            // Roads of which as much is removed share a line.
            let mut removed: Vec<(String, Vec<&str>)> = Vec::new();
            for removal in rule.removes.iter().filter(|removal| removal.percent_max > 0.0) {
                let (least, most) = (removal.percent_min.round(), removal.percent_max.round());
                let share = if least == most { format!("{most}") } else { format!("{least} to {most}") };
                let what = format!("removes {share} % of {}", removal.parameter);
                match removed.iter_mut().find(|(known, _)| *known == what) {
                    Some((_, roads)) => roads.push(&removal.road),
                    None => removed.push((what, vec![&removal.road])),
                }
            }
            for (what, roads) in removed {
                writeln!(f, "{:width$}  {what} on {}", "", roads.join(", "))?;
            }
        }
        Ok(())
    }
}
