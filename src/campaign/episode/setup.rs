//! The setup of an episode: everything but the choices.

use std::sync::Arc;

use avastra_drivers::Selected;
use avastra_lang::model::{Memory, Road, RulesInForce};
use avastra_search::mdp::ProcKind;
use avastra_world::action::ActionTable;
use avastra_world::sim::{Scene, Start};

/// Everything that determines an episode, except the choices.
#[derive(Clone)]
pub struct Setup {
    pub table: ActionTable,
    /// Index of the road in the space.
    pub road_index: usize,
    pub scene: Arc<Scene>,
    pub rules: Arc<RulesInForce>,
    pub ads: Selected,
    pub seed: u64,
    pub start: Start,
    /// States of the space at the start; those that stand for weather agree with `start`.
    pub memory: Memory,
    /// How collision probabilities are computed.
    pub proc: ProcKind,
}

impl Setup {
    /// The road that is driven.
    pub fn road(&self) -> &Road {
        &self.table.space().roads[self.road_index]
    }
}
