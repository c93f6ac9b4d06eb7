//! Small changes of a scenario, and how often it crashes, or breaches a requirement, under them.
//!
//! On a street, no value of a scenario repeats to the last digit. A variation changes each of these by its own draw:
//!
//! - the time of an action: normal, 0.1 s, cut at 0.3 s (the first action stays at the start);
//! - every speed that an action draws: normal, 2 %, cut at 6 %;
//! - the phase of the signals: normal, 0.1 s, cut at 0.3 s;
//! - all errors of the driving system's sensors, which are drawn anew.
//!
//! Values that the rules set follow from the changed values, and values stay within the rules. The widths are ours: how
//! much repetitions of one manoeuvre may differ on a proving ground.

use std::sync::Arc;

use crate::episode::{Choice, EpisodeLog, Moment, Setup};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_base::statistics::proportion;
use avastra_base::units::Dimension;
use avastra_lang::model::{Type, Value};
use avastra_world::sim::DT_S;

use super::case::{Case, Found, play};

/// Standard deviation of times, s.
const TIME_S: f64 = 0.1;
/// Standard deviation of speeds, as a part of them.
const SPEED: f64 = 0.02;
/// Draws are cut at this many standard deviations.
const CUT: f64 = 3.0;
/// Draws that are tried for a step; if all are illegal, the step is carried out as it was.
const DRAWS_MAX: u32 = 8;

/// How often a finding happens under variations.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Likelihood {
    pub variations: u32,
    pub crashes: u32,
    /// Share of the variations that crash. One in which the obstacle never appeared, or the ego vehicle had
    /// no way to it, counts as no crash.
    pub share: f64,
    /// 95 % interval of the share, after Wilson.
    pub low: f64,
    pub high: f64,
}

/// A finding of a log under `variations` small changes; `setup` is what it was played from. A variation crashes if the ego
/// vehicle runs into the same obstacle, or breaches the same requirement.
pub fn likelihood(setup: &Setup, log: &EpisodeLog, found: Found, variations: u32) -> Likelihood {
    let case = Case::new(setup, log, found);
    let crashes = (1..=variations).filter(|&number| case.is_again(&varied(&case, number)));
    let crashes = crashes.count() as u32;
    let (share, [low, high]) = proportion(crashes, variations);
    Likelihood { variations, crashes, share, low, high }
}

/// Plays a scenario with small changes. A number selects the changes.
fn varied(case: &Case, number: u32) -> EpisodeLog {
    let seed = rng::child_seed(case.setup.seed, Stream::Variation, u64::from(number));
    let mut rng = rng::stream(seed, Stream::Variation, 0);
    let mut setup = case.setup.clone();
    setup.seed = seed;
    setup.start.signal_phase_s = (setup.start.signal_phase_s + cut_normal(&mut rng) * TIME_S).max(0.0);
    let mut late_ticks = 0;
    for _ in 1..case.script.steps.len() {
        let next_ticks = (cut_normal(&mut rng) * TIME_S / DT_S).round() as i32;
        setup.period_shifts.push(next_ticks - late_ticks);
        late_ticks = next_ticks;
    }
    play(&setup, |moment| choose(case, seed, moment)).0
}

/// The action of a step with other speeds. Where none of several draws is legal, the action is tried as it
/// was written.
fn choose(case: &Case, seed: u64, moment: &Moment) -> Choice {
    let table = &case.setup.table;
    let Some(Some(action)) = case.script.steps.get(moment.step) else {
        return case.script.choose(moment);
    };
    let parameters = &table.space().actions[table.rows()[action.row].action].parameters;
    let is_speed =
        |name: &str| parameters.iter().any(|p| &*p.name == name && p.ty == Type::Quantity(Dimension::SPEED));
    let mut rng = rng::stream(seed, Stream::Variation, 1 + moment.step as u64);
    for _ in 0..DRAWS_MAX {
        let values: Vec<(Arc<str>, Value)> = action
            .values
            .iter()
            .map(|(name, value)| match value {
                Value::Number(speed_mps) if is_speed(name) => {
                    let changed_mps = speed_mps * (1.0 + cut_normal(&mut rng) * SPEED);
                    (name.clone(), Value::Number(changed_mps))
                }
                _ => (name.clone(), *value),
            })
            .collect();
        if let Ok(draw) = table.nearest(moment.situation, action.row, &values) {
            return Choice::Act(draw);
        }
    }
    case.script.choose(moment)
}

/// Standard normal, no farther out than [`CUT`].
fn cut_normal(rng: &mut Rng) -> f64 {
    rng::normal(rng).clamp(-CUT, CUT)
}
