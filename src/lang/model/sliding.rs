//! The running maximum of the last numbers (Lemire 2006: a number is dropped once a later, larger one outlives it).

use std::collections::VecDeque;

/// The largest of the last numbers.
#[derive(Debug, Clone, Default)]
pub struct Sliding {
    tick: u32,
    /// Ticks with falling numbers.
    falling: VecDeque<(u32, f64)>,
}

impl Sliding {
    pub fn clear(&mut self) {
        if !self.falling.is_empty() {
            self.falling.clear();
        }
    }

    /// Takes one more; the largest of it and so many before it.
    pub fn largest(&mut self, number: f64, before: u32) -> f64 {
        // Without anything before it, it is the largest.
        if before == 0 {
            return number;
        }
        self.tick += 1;
        while self.falling.back().is_some_and(|(_, last)| *last <= number) {
            self.falling.pop_back();
        }
        self.falling.push_back((self.tick, number));
        while self.falling.front().is_some_and(|(tick, _)| self.tick - tick > before) {
            self.falling.pop_front();
        }
        self.falling[0].1
    }
}
