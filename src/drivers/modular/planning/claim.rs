//! When and where a predicted road user is on the ego vehicle's way: its region of the station-time graph.

use core::ops::Range;

use crate::kit::Guide;
use avastra_base::geometry::{Beside, Span, Vec2, larger, smaller};
use avastra_world::sim::VehicleParameters;

use super::super::prediction::{Forecast, STEP_S, STEPS};
use super::nudge::LateralPlan;

/// Road users farther behind the rear axle do not matter, m.
const BEHIND_M: f64 = 10.0;

/// A road user that moves along the way with more than this part of its speed drives along it; otherwise it
/// crosses. Cosine of 60°.
const ALONG_COSINE: f64 = 0.5;

/// The part of the way that a road user will take, over time, by one hypothesis of its future.
#[derive(Debug, Clone)]
pub struct Claim {
    pub id: u32,
    /// How probable the hypothesis is, in `(0, 1]`.
    pub probability: f64,
    pub on_wheels: bool,
    pub moving: bool,
    pub speed_mps: f64,
    /// Cosine of the angle between its motion and the way where it enters, and where it is last.
    pub cosine: f64,
    pub cosine_last: f64,
    /// Sine of the first of these angles: positive to the left.
    pub sine: f64,
    /// Part of the way taken at each predicted step; empty before `first` and after `last`.
    pub spans: [Span; STEPS + 1],
    pub first: usize,
    pub last: usize,
    /// Whether it must let the ego vehicle go first where they meet.
    pub owes_way: bool,
    /// The decision about it.
    pub stance: Stance,
}

/// The action of a road user on the way of the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Stands on it.
    Stands,
    /// Is on it and drives along it.
    Leads,
    /// Will come onto it and drive along it.
    Merges,
    /// Crosses it, or comes towards the ego vehicle on it.
    Crosses,
}

/// The response of a plan to a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stance {
    /// Nothing is to be decided: it counts as its role demands, or only in the cost.
    #[default]
    Open,
    /// Stays behind it: YIELD or, if it goes along the way, FOLLOW.
    Yield,
    /// Passes before it: OVERTAKE.
    Overtake,
}

/// Nothing taken.
const EMPTY: Span = Span { from_m: f64::INFINITY, to_m: f64::NEG_INFINITY };

impl Claim {
    /// The claim of a road user on the stations `ahead`, if it has one.
    pub fn of(
        forecast: &Forecast,
        guide: &Guide,
        lateral: &LateralPlan,
        ahead: &Range<f64>,
        lateral_buffer_m: f64,
    ) -> Option<Claim> {
        let half_way_m = VehicleParameters::MKZ.width_m / 2.0 + lateral_buffer_m;
        let mut claim = Claim::empty(forecast);
        let mut forward = forecast.forward;
        let reach_m = half_way_m + lateral.offset_m_max() + (forecast.length_m + forecast.width_m) / 2.0;
        let mut tracer = guide.trace(forecast.positions[0], ahead.start - BEHIND_M, ahead.end, reach_m);
        for step in 0..=STEPS {
            if step > 0 && !forecast.moving {
                claim.spans[step] = claim.spans[0];
                continue;
            }
            let position = forecast.positions[step];
            if step > 0 {
                forward = direction(position - forecast.positions[step - 1], forward);
            }
            let on_guide = if step == 0 { tracer.first() } else { tracer.next(position) };
            let taken = on_guide.and_then(|on_guide| {
                let offset_m = on_guide.offset_m - lateral.aside(on_guide.station_m).offset_m;
                let beside = Beside { offset_m, ..on_guide };
                let span = beside.taken(forward, forecast.length_m, forecast.width_m, half_way_m)?;
                Some((beside, span))
            });
            let near =
                |(_, span): &(Beside, Span)| span.from_m < ahead.end && span.to_m > ahead.start - BEHIND_M;
            match taken {
                Some((beside, span)) if near(&(beside, span)) => claim.take(step, span, forward, &beside),
                // A road user on the way far behind follows: it keeps its distance itself.
                Some((_, span)) if step == 0 && span.to_m <= ahead.start - BEHIND_M => return None,
                // Only the first stay on the way counts: what lies beyond is seen in a later cycle.
                _ if claim.first != usize::MAX => break,
                _ => {}
            }
        }
        if !forecast.moving {
            claim.last = STEPS;
        }
        (claim.first != usize::MAX).then_some(claim)
    }

    /// A claim that takes nothing yet.
    fn empty(forecast: &Forecast) -> Claim {
        Claim {
            id: forecast.id,
            probability: forecast.probability,
            on_wheels: forecast.body.is_vehicle(),
            moving: forecast.moving,
            speed_mps: if forecast.moving { forecast.velocity_mps.norm() } else { 0.0 },
            cosine: 0.0,
            cosine_last: 0.0,
            sine: 0.0,
            spans: [EMPTY; STEPS + 1],
            first: usize::MAX,
            last: 0,
            owes_way: false,
            stance: Stance::Open,
        }
    }

    /// Takes a stretch of the way in a step, with the body along `forward`.
    fn take(&mut self, step: usize, span: Span, forward: Vec2, beside: &Beside) {
        self.spans[step] = span;
        self.last = step;
        self.cosine_last = forward.dot(&beside.forward);
        if self.first == usize::MAX {
            (self.first, self.cosine) = (step, self.cosine_last);
            self.sine = beside.forward.perp(&forward);
        }
    }

    /// Whether it is on the way already.
    pub fn is_now(&self) -> bool {
        self.first == 0
    }

    /// When it comes onto the way, s from now.
    pub fn entry_s(&self) -> f64 {
        moment_s(self.first)
    }

    /// When it has left the way, s from now; infinite if it does not within the prediction.
    pub fn exit_s(&self) -> f64 {
        if self.last == STEPS { f64::INFINITY } else { moment_s(self.last + 1) }
    }

    /// Whether it drives along the way, at once or in the end.
    pub fn goes_along(&self) -> bool {
        let stays = self.last == STEPS && self.cosine_last > ALONG_COSINE;
        self.moving && (self.cosine > ALONG_COSINE || stays)
    }

    /// The road user's action on the way; slower than `static_mps` it stands.
    pub fn role(&self, static_mps: f64) -> Role {
        match self.goes_along() {
            _ if self.is_now() && (!self.moving || self.speed_mps < static_mps) => Role::Stands,
            true if self.is_now() && self.cosine > ALONG_COSINE => Role::Leads,
            true => Role::Merges,
            false => Role::Crosses,
        }
    }

    /// The parts of the way that it takes, each with its time from now, s.
    pub fn steps(&self) -> impl Iterator<Item = (f64, Span)> {
        (self.first..=self.last).map(|step| (moment_s(step), self.spans[step]))
    }

    /// Nearest station that it takes while it is on the way, m.
    pub fn near_m(&self) -> f64 {
        self.steps().fold(f64::INFINITY, |near_m, (_, span)| smaller(near_m, span.from_m))
    }

    /// Station of its near end (m) and its speed along the way (m/s) at a time from now; before its entry as
    /// if it came along the way, after the prediction as if it went on.
    pub fn near_end(&self, time_s: f64) -> (f64, f64) {
        let place = larger(time_s / STEP_S, 0.0);
        let index = place as u32 as usize;
        if index < self.first {
            let along_mps = self.speed_mps * larger(self.cosine, 0.0);
            return (self.spans[self.first].from_m - along_mps * (self.entry_s() - time_s), along_mps);
        }
        if index >= self.last {
            let along_mps = self.speed_mps * self.cosine_last;
            let since_s = time_s - moment_s(self.last);
            return (self.spans[self.last].from_m + along_mps * since_s, along_mps);
        }
        let (from_m, to_m) = (self.spans[index].from_m, self.spans[index + 1].from_m);
        (from_m + (to_m - from_m) * (place - f64::from(index as u32)), (to_m - from_m) / STEP_S)
    }
}

/// Time of a predicted step, s from now.
fn moment_s(step: usize) -> f64 {
    // There are few steps, and small numbers are converted at once.
    f64::from(step as u32) * STEP_S
}

/// Unit vector along a displacement, or `otherwise` if there is hardly any.
fn direction(displacement: Vec2, otherwise: Vec2) -> Vec2 {
    let length_m = displacement.norm();
    if length_m > 0.05 { displacement / length_m } else { otherwise }
}

#[cfg(test)]
pub mod testing {
    use super::*;

    /// A car that crosses at a station (m) between two moments, s.
    pub fn crosser(station_m: f64, from_s: f64, to_s: f64) -> Claim {
        let (first, last) = ((from_s / STEP_S) as usize, (to_s / STEP_S) as usize);
        let mut spans = [EMPTY; STEPS + 1];
        spans[first..=last].fill(Span { from_m: station_m, to_m: station_m + 2.0 });
        Claim {
            id: 1,
            probability: 1.0,
            on_wheels: true,
            moving: true,
            speed_mps: 8.0,
            cosine: 0.0,
            cosine_last: 0.0,
            sine: 0.0,
            spans,
            first,
            last,
            owes_way: false,
            stance: Stance::Open,
        }
    }
}
