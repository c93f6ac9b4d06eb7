//! One row of the table, once: an episode of a protocol.

use crate::mdp::Observation;
use avastra_base::rng::Rng;

use super::acting::{Agent, Mask};

/// Chooses its row as soon as that is legal, and nothing after that. Until then it chooses the rows that make the road users
/// appear about whom its row is, one after another.
#[derive(Debug)]
pub struct OneRow {
    /// Its own row, and those before it.
    rows: Vec<usize>,
    /// Those that are still to be chosen.
    open: Vec<usize>,
}

impl OneRow {
    pub fn new(row: usize, before: Vec<usize>) -> OneRow {
        let rows: Vec<usize> = [row].into_iter().chain(before).collect();
        OneRow { open: rows.clone(), rows }
    }
}

impl Agent for OneRow {
    fn begin(&mut self, _: u64) {
        self.open.clone_from(&self.rows);
    }

    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, _: &mut Rng) -> Option<usize> {
        // A run tells in how many steps its row could be chosen, and why not in the others.
        legal.is_legal(self.rows[0]);
        let chosen = self.open.iter().position(|row| legal.is_legal(*row))?;
        let row = self.open.remove(chosen);
        if row == self.rows[0] {
            self.open.clear();
        }
        Some(row)
    }
}
