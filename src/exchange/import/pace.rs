//! How fast speeds change: what vehicles can, and profiles of speeds over time as phases.

use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_lang::model::command::RATE_MPS2;

use super::action::SpeedEntry;
use super::body::Body;
use super::said::Said;
use super::source::{Mark, Source};

/// A phase is done when its speed is so near to what it tells: m/s, and a part of that. A stop is exact.
const DONE_MPS: f64 = 0.1;
const DONE_PART: f64 = 0.02;

pub fn too_fast(mps: f64) -> String {
    format!("{mps:.1} m/s: nothing is faster than {} m/s", SPAWN_SPEED_MPS.end())
}

/// The rate at which a vehicle changes its speed, m/s²: a player keeps to what its vehicle can.
pub fn within(source: &mut Source, body: &Body, change: Change, rate_mps2: f64) -> f64 {
    let most_mps2 = match change {
        Change::Up => body.gains_mps2,
        Change::Down => body.loses_mps2,
        Change::Unknown => f64::INFINITY,
    };
    let (least, most) = (*RATE_MPS2.start(), most_mps2.min(*RATE_MPS2.end()));
    let within = rate_mps2.clamp(least.min(most), most);
    if rate_mps2 > within {
        source.note("speeds change no faster than the file's vehicles can, nor than 15 m/s^2");
    } else if rate_mps2 < within {
        source.note("speeds change by 0.1 m/s^2 at least");
    }
    within
}

#[derive(Debug, Clone, Copy)]
pub enum Change {
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

/// A phase for each entry of a profile, which begins when the one before it has had its time.
pub fn profile(
    source: &mut Source,
    mark: &Mark,
    body: &Body,
    from_mps: Option<f64>,
    entries: &[SpeedEntry],
    begins: Said,
) -> Option<Vec<Said>> {
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
                let rate = within(source, body, Change::between(from, Some(*mps)), by_mps / time_s);
                said = said.and(", rate: ").number(rate, "m/s^2");
            }
            let near_mps = if *mps == 0.0 { 0.0 } else { DONE_MPS.max(DONE_PART * mps) };
            if by_mps > near_mps {
                rest_s = time_s * near_mps / by_mps;
            }
        }
        phases.push(said.and(" }"));
        begins =
            if rest_s > 0.0 { Said::text("after ").number(rest_s, "s").and(" ") } else { Said::default() };
        from = Some(*mps);
    }
    Some(phases)
}
