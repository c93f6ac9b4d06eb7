//! The setup of an episode: everything but the choices.

use std::sync::Arc;

use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_drivers::Selected;
use avastra_lang::model::{Memory, Road, RulesInForce, START_MPS, Space};
use avastra_search::mdp::ProcKind;
use avastra_world::action::ActionTable;
use avastra_world::sim::{Scene, Start, TrafficProfile};

/// Signals begin anywhere in this span, s: a whole number of cycles of two, three and four groups.
const SIGNAL_PHASE_S: f64 = 204.0;

/// Everything that determines an episode, except the choices.
#[derive(Clone)]
pub struct Setup<'a> {
    pub table: &'a ActionTable,
    pub road: &'a Road,
    pub scene: Arc<Scene>,
    pub rules: &'a RulesInForce,
    pub ads: Selected,
    pub seed: u64,
    pub start: Start,
    /// States of the space at the start; those that stand for weather agree with `start`.
    pub memory: Memory,
    /// Ticks by which each observation period is longer than the space says (negative: shorter); steps beyond the
    /// list's end are not shifted. Used to ask what a little more or less time would have changed; otherwise empty.
    pub period_shifts: Vec<i32>,
    /// How collision probabilities are computed.
    pub proc: ProcKind,
}

/// The part of the world that all episodes on a road share.
pub fn scene(road: &Road) -> Scene {
    Scene::new(road.map.clone(), road.route.clone())
}

/// The start of an episode with this seed and memory, without ambient traffic, under the default traffic profile.
pub fn start(space: &Space, memory: &Memory, seed: u64) -> Start {
    let mut rng = rng::stream(seed, Stream::Reset, 1);
    // A multiple of 1/64 s is a short decimal in a file.
    let signal_phase_s = (rng::between(&mut rng, 0.0, SIGNAL_PHASE_S) * 64.0).floor() / 64.0;
    let (time, [rain, fog, wetness]) = space.weather(memory);
    Start {
        ego_mps: START_MPS,
        time,
        rain,
        fog,
        wetness,
        signal_phase_s,
        seed,
        ambient: 0,
        traffic: TrafficProfile::default(),
    }
}
