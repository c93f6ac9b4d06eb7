//! One row of the table, once: an episode of a protocol.

use ndarray::ArrayView1;

use crate::mdp::Observation;
use avastra_base::rng::Rng;

use super::acting::Agent;

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

    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, _: &mut Rng) -> Option<usize> {
        let chosen = self.open.iter().position(|row| legal[*row])?;
        let row = self.open.remove(chosen);
        if row == self.rows[0] {
            self.open.clear();
        }
        Some(row)
    }

    fn only(&self) -> &[usize] {
        // Of its own row it wants to know why it cannot be, of the next one before it whether it can.
        if self.open.is_empty() { &self.rows[..1] } else { &self.open }
    }
}
