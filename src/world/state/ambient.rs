//! Ambient traffic: how many vehicles are wanted, and how many attempts were made.

use avastra_lang::model::AMBIENT_MAX;

use crate::state::trace::traced;

/// Ids up to this are of obstacles that an action made appear.
pub const COMMANDED_MAX: u32 = 1_000_000;

/// How many vehicles are wanted, and how many attempts were made.
#[derive(Debug, Clone)]
pub struct Ambient {
    pub wanted: u32,
    pub attempts: u64,
    pub next_id: u32,
}

impl Ambient {
    pub fn new(wanted: u32) -> Ambient {
        Ambient { wanted: wanted.min(AMBIENT_MAX), attempts: 0, next_id: COMMANDED_MAX + 1 }
    }
}

traced! {
    Ambient { wanted, attempts, next_id };
}
