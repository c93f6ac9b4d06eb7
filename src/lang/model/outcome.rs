//! The judgement of a step or a collision by a space: its reward, its verdicts, and whether it counts.

use crate::model::eval::evaluate;
use crate::model::expr::{Expr, ExprKind};
use crate::model::facts::{Facts, OutcomeFacts};
use crate::model::space::{COUNTED, Space};
use crate::model::value::Memory;

impl Space {
    /// Reward of a step: the value of the first case that applies. It is 0 if none applies, or if the case has no value (a
    /// division by 0), so that neither a database nor a network meets it. `memory` holds the states after the action.
    /// `margins` holds the smallest margin of each requirement in the step (SI, NaN for a requirement that was not asked).
    pub fn reward(&self, outcome: OutcomeFacts, memory: &Memory, margins: &[f64]) -> f64 {
        let facts = Facts { outcome, margins, ..Facts::new(&[], memory) };
        let applies = |condition: &Option<Expr>| {
            condition.as_ref().is_none_or(|c| evaluate(c, &self.functions, &facts).truth())
        };
        let case = self.reward.iter().find(|case| applies(&case.condition));
        let value = case.map(|case| evaluate(&case.value, &self.functions, &facts).number());
        value.filter(|value| value.is_finite()).unwrap_or(0.0)
    }

    /// The requirements whose margins rewards ask for, by bit.
    pub fn margins_paid(&self) -> u64 {
        let asked = self.reward.iter().flat_map(|case| case.condition.iter().chain([&case.value]));
        let of = |expr: &Expr| -> Vec<usize> {
            let margins = expr.filter_map(|kind| match kind {
                ExprKind::Margin(requirement) => Some(*requirement),
                _ => None,
            });
            margins.into_iter().collect()
        };
        asked.flat_map(of).fold(0, |set, requirement| set | 1 << requirement)
    }

    /// Whether a collision passes the verdict of that name; `None` if there is no such verdict. `memory` is as for
    /// [`Space::reward`].
    pub fn verdict(&self, name: &str, outcome: OutcomeFacts, memory: &Memory) -> Option<bool> {
        let facts = Facts { outcome, ..Facts::new(&[], memory) };
        let verdict = self.verdicts.iter().find(|verdict| verdict.name == name)?;
        Some(evaluate(&verdict.condition, &self.functions, &facts).truth())
    }

    /// The clauses of the verdict [`COUNTED`] that a collision does not meet, as they were written; empty if it counts.
    pub fn unmet(&self, outcome: OutcomeFacts, memory: &Memory) -> Vec<&str> {
        let facts = Facts { outcome, ..Facts::new(&[], memory) };
        let Some(verdict) = self.verdicts.iter().find(|verdict| verdict.name == COUNTED) else {
            return Vec::new();
        };
        let is_unmet = |clause: &&Expr| !evaluate(clause, &self.functions, &facts).truth();
        let clauses = verdict.condition.clauses();
        clauses
            .iter()
            .zip(&verdict.clauses)
            .filter(|(clause, _)| is_unmet(clause))
            .map(|(_, text)| text.as_str())
            .collect()
    }

    /// Whether a collision counts: the verdict [`COUNTED`].
    pub fn counts(&self, outcome: OutcomeFacts, memory: &Memory) -> bool {
        let counts = self.verdict(COUNTED, outcome, memory);
        counts.expect("the checker adds the verdict where the author has none")
    }
}
