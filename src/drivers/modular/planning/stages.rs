//! Scenarios with stages: how the vehicle takes a junction at which others may go first.
//!
//! Apollo's `TRAFFIC_LIGHT_UNPROTECTED_LEFT_TURN`, `STOP_SIGN_UNPROTECTED`, `YIELD_SIGN` and
//! `BARE_INTERSECTION_UNPROTECTED`: approach slowly, stop where a sign says so, creep a little into the junction
//! until nothing that moves enters the way within `creep_clear_s`, then go. From there on the decisions of the
//! station-time graph hold alone. A junction is protected, and has no stages, if a light lets the vehicle
//! through and nothing that may go at the same time goes first.
//!
//! Weakness `creep_skipped_at_speed`, as in the original: a vehicle that is still fast at the line goes without
//! creeping. The original's timeout of creeping is no weakness, since after it the way must still be clear.
//! Left out: right turns at a red light (the vehicle waits for green), and the order of arrival at all-way stops.
//! Ours: creeping ends as soon as nothing enters, not at its end only.

use crate::status::Reason;
use avastra_road::{SignKind, Turn};
use avastra_world::sim::{FRAME_S, Scene, VehicleParameters};

use super::super::config::{PlanningConfig, Weaknesses};
use super::super::junctions::Junctions;
use super::claim::Claim;
use super::rights::RouteRights;
use super::speed::Constraint;
use super::trajectory::Point;

/// A stop line or sign so far before a junction belongs to it, m. As for right of way (`road`).
const APPROACH_M: f64 = 40.0;
/// The front bumper is at a line if it is so near before it, m.
const AT_LINE_M: f64 = 0.5;
/// A vehicle that stands so near before a stop sign or a light has stopped for it, m, below Apollo's
/// `max_abs_speed_when_stopped`, m/s.
pub(super) const STOPPED_M: f64 = 2.5;
pub(super) const STOPPED_MPS: f64 = 0.2;
/// Room kept to the middle of the first lane that crosses, m: half a lane and a metre.
pub(super) const CROSSING_ROOM_M: f64 = 4.0;

#[derive(Debug, Clone)]
pub struct Stages {
    passages: Vec<Passage>,
}

/// A junction of the route at which others may go first.
#[derive(Debug, Clone, PartialEq)]
struct Passage {
    /// Where it is approached slowly, where creeping ends, and where the junction does, m.
    line_m: f64,
    hold_m: f64,
    exit_m: f64,
    sign: Option<SignKind>,
    approach_mps: f64,
    creeps: bool,
    stage: Stage,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Approach,
    Stop { stood_s: f64 },
    Creep,
    Go,
}

impl Stages {
    pub fn new(
        config: &PlanningConfig,
        scene: &Scene,
        junctions: &Junctions,
        rights: &RouteRights,
    ) -> Stages {
        let route = &scene.route;
        let passage = |(enter_m, exit_m): (f64, f64)| {
            let before = |at_m: &f64| (enter_m - APPROACH_M..exit_m).contains(at_m);
            let light_m = route.stop_lines.iter().map(|line| line.station_m).find(before);
            let sign = route.sign_lines.iter().find(|line| before(&line.station_m));
            let crossing_m = rights.first_to_wait_for_m(enter_m, exit_m)?;
            let lanes = route.lanes.iter().filter(|on| on.enter_m < exit_m && on.to_m > enter_m);
            let turns = lanes.map(|on| scene.map.lane(on.lane).turn).any(|turn| turn != Turn::Straight);
            if light_m.is_some() && !turns {
                return None;
            }
            let line_m = light_m.or(sign.map(|line| line.station_m)).unwrap_or(enter_m);
            let hold_m = (line_m + config.creep_m).max(enter_m).min(crossing_m - CROSSING_ROOM_M).max(line_m);
            let is_bare = light_m.is_none() && sign.is_none();
            let slowly = turns && !is_bare;
            Some(Passage {
                line_m,
                hold_m,
                exit_m,
                sign: sign.map(|line| line.kind),
                approach_mps: if slowly { config.approach_mps } else { config.bare_approach_mps },
                creeps: turns || sign.is_some(),
                stage: Stage::Approach,
            })
        };
        Stages { passages: junctions.between(0.0, f64::INFINITY).filter_map(passage).collect() }
    }

    /// Adds what the stage of the junction ahead demands.
    pub fn constrain(
        &mut self,
        config: &PlanningConfig,
        weaknesses: &Weaknesses,
        start: &Point,
        claims: &[Claim],
        constraints: &mut Vec<Constraint>,
    ) {
        let rear_m = VehicleParameters::MKZ.rear_m(start.station_m);
        if let Some(passage) = self.passages.iter_mut().find(|passage| passage.exit_m > rear_m) {
            let enters = claims.iter().any(|claim| passage.is_entered_by(config, claim));
            passage.advance(config, weaknesses, start, enters);
            passage.constrain(config, start, constraints);
        }
    }
}

impl Passage {
    /// Whether a road user comes onto the way in the junction soon. Apollo's `CheckCreepDone` asks for
    /// whatever moves and does not go along the way.
    fn is_entered_by(&self, config: &PlanningConfig, claim: &Claim) -> bool {
        let at_m = claim.spans[claim.first].middle_m();
        claim.is_contested(config)
            && claim.binds(config)
            && !claim.owes_way
            && claim.entry_s() < config.creep_clear_s
            && (self.line_m..self.exit_m + CROSSING_ROOM_M).contains(&at_m)
    }

    fn advance(&mut self, config: &PlanningConfig, weaknesses: &Weaknesses, start: &Point, enters: bool) {
        let to_line_m = self.line_m - VehicleParameters::MKZ.front_m(start.station_m);
        let is_at_line = to_line_m < AT_LINE_M;
        let stands = start.speed_mps < STOPPED_MPS;
        self.stage = match self.stage {
            Stage::Approach if self.sign == Some(SignKind::Stop) && stands && to_line_m < STOPPED_M => {
                Stage::Stop { stood_s: 0.0 }
            }
            Stage::Approach if is_at_line => {
                let skipped = weaknesses.creep_skipped_at_speed && start.speed_mps > config.creep_skip_mps;
                if self.creeps && !skipped { Stage::Creep } else { Stage::Go }
            }
            Stage::Stop { stood_s } if stood_s >= config.stop_sign_s => Stage::Creep,
            Stage::Stop { stood_s } => Stage::Stop { stood_s: stood_s + FRAME_S },
            Stage::Creep if !enters => Stage::Go,
            stage => stage,
        };
    }

    fn constrain(&self, config: &PlanningConfig, start: &Point, constraints: &mut Vec<Constraint>) {
        let stop = Constraint::line(Reason::StopSign, self.line_m - config.stop_line_gap_m);
        match self.stage {
            Stage::Approach => {
                let excess_m2ps2 = start.speed_mps * start.speed_mps - self.approach_mps * self.approach_mps;
                let needed_m = excess_m2ps2.max(0.0) / (2.0 * config.comfortable_mps2);
                let from_m = self.line_m - needed_m.max(config.approach_m);
                constraints.push(Constraint::limit(Reason::Approach, from_m, self.hold_m, self.approach_mps));
                if self.sign == Some(SignKind::Stop) {
                    constraints.push(stop);
                }
            }
            Stage::Stop { .. } => constraints.push(stop),
            Stage::Creep => {
                let from_m = f64::NEG_INFINITY;
                constraints.push(Constraint::limit(Reason::Creep, from_m, self.hold_m, config.approach_mps));
                constraints.push(Constraint::line(Reason::Creep, self.hold_m));
            }
            Stage::Go => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::planning::claim::testing::crosser;

    const LINE_M: f64 = 100.0;

    fn passage(sign: Option<SignKind>) -> Passage {
        Passage {
            line_m: LINE_M,
            hold_m: LINE_M + 2.0,
            exit_m: LINE_M + 30.0,
            sign,
            approach_mps: 2.78,
            creeps: true,
            stage: Stage::Approach,
        }
    }

    /// The stage of a vehicle whose front comes to a place at a speed and stays there for some time, with or without a
    /// vehicle that enters.
    fn stage(
        passage: &mut Passage,
        weak: bool,
        ahead_m: f64,
        speed_mps: f64,
        enters: bool,
        for_s: f64,
    ) -> Stage {
        let weaknesses = Weaknesses { creep_skipped_at_speed: weak, ..Weaknesses::NONE };
        let station_m = LINE_M + ahead_m - VehicleParameters::MKZ.front_m(0.0);
        let start = Point { station_m, speed_mps, acceleration_mps2: 0.0 };
        for _ in 0..=(for_s / FRAME_S) as u32 {
            passage.advance(&PlanningConfig::default(), &weaknesses, &start, enters);
        }
        passage.stage
    }

    #[test]
    fn it_creeps_until_nothing_enters() {
        let mut turn = passage(None);
        assert_eq!(stage(&mut turn, true, -20.0, 8.0, true, 1.0), Stage::Approach);
        assert_eq!(stage(&mut turn, true, 0.0, 2.5, true, 60.0), Stage::Creep);
        assert_eq!(stage(&mut turn, true, 2.0, 0.0, false, 0.0), Stage::Go);
    }

    #[test]
    fn creep_skipped_at_speed_goes_without_creeping() {
        assert_eq!(stage(&mut passage(None), true, 0.0, 6.0, true, 0.0), Stage::Go);
        assert_eq!(stage(&mut passage(None), false, 0.0, 6.0, true, 0.0), Stage::Creep);
    }

    #[test]
    fn it_stands_at_a_stop_sign_first() {
        let mut sign = passage(Some(SignKind::Stop));
        assert!(matches!(stage(&mut sign, true, -1.0, 0.0, false, 0.5), Stage::Stop { .. }));
        assert_eq!(stage(&mut sign, true, -1.0, 0.0, false, 1.5), Stage::Go);
    }

    #[test]
    fn what_enters_soon_is_waited_for() {
        let config = PlanningConfig::default();
        let enters = |at_m: f64, from_s: f64, owes_way: bool| {
            let claim = Claim { owes_way, ..crosser(at_m, from_s, from_s + 1.0) };
            passage(None).is_entered_by(&config, &claim)
        };
        assert!(enters(LINE_M + 10.0, 5.5, false));
        assert!(!enters(LINE_M + 10.0, 6.5, false), "comes late");
        assert!(!enters(LINE_M + 10.0, 2.0, true), "must wait itself");
        assert!(!enters(LINE_M + 50.0, 2.0, false), "crosses elsewhere");
    }
}
