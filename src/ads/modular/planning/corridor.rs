//! The station-time view: when and where a predicted road user is on the ego vehicle's way.

use core::ops::Range;

use crate::ads::guide::Guide;
use crate::geometry::{Beside, Span, Vec2};
use crate::sim::VehicleParameters;

use super::super::prediction::{Forecast, STEP_S, STEPS};
use super::nudge::LateralPlan;
use super::speed::Trajectory;

/// Road users farther behind the rear axle do not matter, m.
const BEHIND_M: f64 = 10.0;

/// The part of the way that a road user will take, over time.
#[derive(Debug, Clone)]
pub struct Claim {
    pub id: u32,
    pub on_wheels: bool,
    pub moving: bool,
    /// Speed along the way where it enters, m/s; may be negative.
    pub along_mps: f64,
    pub speed_mps: f64,
    /// Cosine of the angle between its motion and the way where it enters.
    pub cosine: f64,
    /// Part of the way taken at each predicted step; empty before `first` and after `last`.
    pub spans: [Span; STEPS + 1],
    pub first: usize,
    pub last: usize,
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
        let speed_mps = if forecast.moving { forecast.velocity_mps.norm() } else { 0.0 };
        let mut claim = Claim {
            id: forecast.id,
            on_wheels: forecast.body.is_vehicle(),
            moving: forecast.moving,
            along_mps: 0.0,
            speed_mps,
            cosine: 0.0,
            spans: [EMPTY; STEPS + 1],
            first: usize::MAX,
            last: 0,
        };
        let mut forward = forecast.forward;
        let reach_m = half_way_m + lateral.offset_m_max() + (forecast.length_m + forecast.width_m) / 2.0;
        let (now, mut tracer) =
            guide.trace(forecast.positions[0], ahead.start - BEHIND_M, ahead.end, reach_m);
        for step in 0..=STEPS {
            if step > 0 && !forecast.moving {
                claim.spans[step] = claim.spans[0];
                continue;
            }
            let position = forecast.positions[step];
            if step > 0 {
                forward = direction(position - forecast.positions[step - 1], forward);
            }
            let on_guide = if step == 0 { Some(now) } else { tracer.next(position) };
            let beside = on_guide.map(|on_guide| {
                let offset_m = on_guide.offset_m - lateral.aside(on_guide.station_m).offset_m;
                Beside { offset_m, ..on_guide }
            });
            let taken = beside.and_then(|beside| {
                let span = beside.taken(forward, forecast.length_m, forecast.width_m, half_way_m)?;
                Some((beside, span))
            });
            let near =
                |(_, span): &(Beside, Span)| span.from_m < ahead.end && span.to_m > ahead.start - BEHIND_M;
            let Some((beside, span)) = taken.filter(near) else {
                // Only the first stay on the way counts: what lies beyond is seen in a later cycle.
                if claim.first != usize::MAX {
                    break;
                }
                continue;
            };
            claim.spans[step] = span;
            if claim.first == usize::MAX {
                claim.first = step;
                claim.cosine = forward.dot(&beside.forward);
                claim.along_mps = speed_mps * claim.cosine;
            }
            claim.last = step;
        }
        if !forecast.moving {
            claim.last = STEPS;
        }
        (claim.first != usize::MAX).then_some(claim)
    }

    /// Whether it is on the way already.
    pub fn is_now(&self) -> bool {
        self.first == 0
    }

    /// When it comes onto the way, s from now.
    pub fn entry_s(&self) -> f64 {
        self.first as f64 * STEP_S
    }

    /// When it has left the way, s from now; infinite if it does not within the prediction.
    pub fn exit_s(&self) -> f64 {
        if self.last == STEPS { f64::INFINITY } else { (self.last + 1) as f64 * STEP_S }
    }

    /// Station of its near end at a time from now, m; before its entry, as if it came along the way.
    pub fn near_end_m(&self, time_s: f64) -> f64 {
        let place = (time_s / STEP_S).max(0.0);
        if place < self.first as f64 {
            return self.spans[self.first].from_m - self.along_mps * (self.entry_s() - time_s);
        }
        let index = place as usize;
        if index >= self.last {
            let since_s = time_s - self.last as f64 * STEP_S;
            return self.spans[self.last].from_m + self.along_mps * since_s;
        }
        let fraction = place - index as f64;
        self.spans[index].from_m * (1.0 - fraction) + self.spans[index + 1].from_m * fraction
    }

    /// The first step at which the ego vehicle, driving `trajectory`, is less than `buffer_s` in
    /// time from the same place.
    pub fn first_conflict(&self, trajectory: &Trajectory, buffer_s: f64) -> Option<usize> {
        (self.first..=self.last).find(|&step| {
            let time_s = step as f64 * STEP_S;
            let ego_from_m =
                VehicleParameters::MKZ.rear_m(trajectory.at((time_s - buffer_s).max(0.0)).station_m);
            let ego_to_m = VehicleParameters::MKZ.front_m(trajectory.at(time_s + buffer_s).station_m);
            let span = &self.spans[step];
            span.from_m <= ego_to_m && span.to_m >= ego_from_m
        })
    }
}

/// Unit vector along a displacement, or `otherwise` if there is hardly any.
fn direction(displacement: Vec2, otherwise: Vec2) -> Vec2 {
    let length_m = displacement.norm();
    if length_m > 0.05 { displacement / length_m } else { otherwise }
}
