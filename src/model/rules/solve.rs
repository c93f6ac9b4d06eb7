//! Choosing numbers within the bounds of rules, each after the numbers that its bounds depend on.

use crate::model::eval::{Facts, evaluate};
use crate::model::expr::{Comparison, Expr};
use crate::model::rules::{Bound, RowRules};
use crate::model::value::{Memory, Value};

/// The numbers that the bounds leave to a parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room {
    pub low: f64,
    pub high: f64,
    low_open: bool,
    high_open: bool,
    /// The declared range, both ends included.
    declared: (f64, f64),
    /// Set by an equality.
    pub exact: Option<f64>,
    /// The rule that cut last.
    pub cut_by: Option<usize>,
}

impl RowRules<'_> {
    /// Sets each parameter of `open` once everything that bounds it is set. `number` chooses one: it gets
    /// the parameter, its value so far and its room, and decides with [`Room::settle`].
    ///
    /// # Errors
    /// The first error of `number`.
    pub fn solve<E>(
        &self,
        values: &mut [Value],
        mut open: Vec<usize>,
        mut number: impl FnMut(usize, Value, &Room) -> Result<f64, E>,
    ) -> Result<(), E> {
        while !open.is_empty() {
            let waits = |local: usize| {
                self.early_bounds(local).any(|bound| {
                    bound.op == Comparison::Equal
                        && open.iter().any(|other| *other != local && bound.needs(*other))
                })
            };
            // Where two equalities wait for each other, the order of declaration decides; the rules have
            // the last word.
            let next = open.iter().position(|local| !waits(*local)).unwrap_or(0);
            let local = open.remove(next);
            let room = self.room(local, &open, values);
            values[local] = Value::Number(number(local, values[local], &room)?);
        }
        Ok(())
    }

    /// Bounds on a parameter that can be computed beforehand.
    fn early_bounds(&self, local: usize) -> impl Iterator<Item = &Bound> {
        self.bounds().filter(move |bound| bound.local == local && bound.is_known_early)
    }

    /// What the bounds leave that do not depend on a parameter that is still open.
    fn room(&self, local: usize, open: &[usize], values: &[Value]) -> Room {
        let (low, high) = self.space.actions[self.row.action].parameters[local].domain.ends();
        let declared = (low, high);
        let mut room =
            Room { low, high, low_open: false, high_open: false, declared, exact: None, cut_by: None };
        // No early bound reads the memory.
        let memory = Memory::default();
        let facts = Facts { road: self.road, ..Facts::new(values, &memory) };
        let is_known = |bound: &&Bound| !open.iter().any(|other| bound.needs(*other));
        for bound in self.early_bounds(local).filter(is_known) {
            let holds = |guard: &Expr| evaluate(guard, &self.space.functions, &facts).truth();
            if bound.guards.iter().all(holds) {
                room.cut(bound, evaluate(&bound.limit, &self.space.functions, &facts).number());
            }
        }
        room
    }
}

impl Room {
    /// The number that an equality sets, else the chosen one; `None` if no number of the declared range is
    /// possible.
    pub fn settle(&self, chosen: f64) -> Option<f64> {
        let value = self.exact.unwrap_or(chosen);
        let is_empty = self.low > self.high || self.low == self.high && (self.low_open || self.high_open);
        (!is_empty && (self.declared.0..=self.declared.1).contains(&value)).then_some(value)
    }

    /// Whether a number lies between the ends; equalities do not count.
    pub fn contains(&self, value: f64) -> bool {
        (value > self.low || value == self.low && !self.low_open)
            && (value < self.high || value == self.high && !self.high_open)
    }

    pub fn middle(&self) -> f64 {
        self.low + (self.high - self.low) / 2.0
    }

    fn cut(&mut self, bound: &Bound, limit: f64) {
        let (low, high, exact) = (self.low, self.high, self.exact);
        match bound.op {
            Comparison::Equal => self.exact = self.exact.or(Some(limit)),
            Comparison::Less if limit <= self.high => (self.high, self.high_open) = (limit, true),
            Comparison::LessEqual if limit < self.high => (self.high, self.high_open) = (limit, false),
            Comparison::Greater if limit >= self.low => (self.low, self.low_open) = (limit, true),
            Comparison::GreaterEqual if limit > self.low => (self.low, self.low_open) = (limit, false),
            // The bound cuts nothing, or leaves out a single number: judging sees to that.
            Comparison::NotEqual
            | Comparison::Less
            | Comparison::LessEqual
            | Comparison::Greater
            | Comparison::GreaterEqual => {}
        }
        if (low, high, exact) != (self.low, self.high, self.exact) {
            self.cut_by = bound.rule;
        }
    }
}
