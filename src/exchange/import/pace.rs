//! How fast speeds change: what vehicles can, and profiles of speeds over time as phases.

use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_lang::model::command::RATE_MPS2;
use avastra_world::sim::{SPEED_REACHED_MPS, SPEED_REACHED_PART};

use super::action::SpeedEntry;
use super::body::Body;
use super::said::Said;
use super::source::{Mark, Source};

/// A shorter wait is none, s.
const LEAST_S: f64 = 1e-4;

pub fn too_fast(mps: f64) -> String {
    format!("{mps:.1} m/s: nothing is faster than {} m/s", SPAWN_SPEED_MPS.end())
}

/// A rate of a speed that the vehicle can keep to, as a player does, and an order may have, m/s².
pub fn rate_within_mps2(source: &mut Source, body: &Body, change: Change, rate_mps2: f64) -> f64 {
    let most_mps2 = match change {
        Change::Up => body.gains_mps2,
        Change::Down => body.loses_mps2,
        Change::Unknown => f64::INFINITY,
    };
    let (least, most) = (*RATE_MPS2.start(), *RATE_MPS2.end());
    let within = rate_mps2.clamp(least, most_mps2.clamp(least, most));
    if rate_mps2 > within {
        source.note(format!("speeds change no faster than the file's vehicles can, nor than {most} m/s^2"));
    } else if rate_mps2 < within {
        source.note(format!("speeds change by {least} m/s^2 at least"));
    }
    within
}

/// Which way a speed changes.
#[derive(Debug, Clone, Copy)]
pub enum Change {
    /// Or not at all.
    Up,
    Down,
    /// The file does not say from which speed.
    Unknown,
}

impl Change {
    pub fn between(from_mps: Option<f64>, to_mps: Option<f64>) -> Change {
        match (from_mps, to_mps) {
            (Some(from), Some(to)) if to < from => Change::Down,
            (Some(_), Some(_)) => Change::Up,
            _ => Change::Unknown,
        }
    }
}

/// A phase for each entry of a profile, which begins when the one before it has had its time, or has reached its speed if that
/// takes its vehicle longer.
///
/// With them the words before a phase that waits until the last one has had its time.
pub fn profile(
    source: &mut Source,
    mark: &Mark,
    body: &Body,
    from_mps: Option<f64>,
    entries: &[SpeedEntry],
    begins: Said,
) -> Option<(Vec<Said>, Said)> {
    let (mut from, mut begins, mut phases) = (from_mps, begins, Vec::new());
    for SpeedEntry { mps, time_s } in entries {
        source.refuse_if(*mps < 0.0, mark, "nobody drives backwards")?;
        source.refuse_if(*mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(*mps))?;
        let mut said = begins.and("{ speed: ").number(*mps, "m/s");
        let mut rest_s = *time_s;
        if *time_s > 0.0 {
            let Some(from_mps) = from else {
                return source.refuse(mark, "a profile is read of one whose speed the file says before it");
            };
            let by_mps = (mps - from_mps).abs();
            if by_mps > 0.0 {
                let change = Change::between(from, Some(*mps));
                let rate_mps2 = rate_within_mps2(source, body, change, by_mps / time_s);
                said = said.and(", rate: ").number(rate_mps2, "m/s^2");
                // A stop is exact.
                let near_mps =
                    if *mps == 0.0 { 0.0 } else { SPEED_REACHED_MPS.max(SPEED_REACHED_PART * mps) };
                // From when the phase is done; one whose vehicle is slower takes longer.
                rest_s = (time_s - (by_mps - near_mps).max(0.0) / rate_mps2).max(0.0);
            }
        }
        phases.push(said.and(" }"));
        begins = if rest_s >= LEAST_S {
            Said::text("after ").number(rest_s, "s").and(" ")
        } else {
            Said::default()
        };
        from = Some(*mps);
    }
    Some((phases, begins))
}
