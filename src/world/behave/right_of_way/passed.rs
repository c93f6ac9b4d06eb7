//! The lines that a vehicle passed last: whether it was allowed to.

use avastra_lang::model::vocabulary::Priority;
use avastra_road::{LaneIndex, RoadMap, SignKind, StopLine};

use crate::state::obstacle::{Moved, Obstacle};
use crate::state::passed::{Passed, PassedLight, PassedSign, Shown, Stand, Stop};
use crate::state::ruling::Rule;
use crate::state::sensed::SignalColour;
use crate::state::time::{DT_S, ticks};
use crate::view::around::Around;

/// A driver needs this long to react to yellow, s: the time by which yellow is set (ITE; German RiLSA), as is the braking.
const YELLOW_REACTION_S: f64 = 1.0;
const YELLOW_BRAKING_MPS2: f64 = 3.5;
/// A vehicle that is slower stands, m/s: as `stops_at_signs` asks.
const STOOD_MPS: f64 = 0.3;
/// To have stood before a sign means within this time, s.
const STOOD_S: f64 = 5.0;
/// To have stood at a line means no farther before it than this, m: no car fits in between. One that moves on by less stands there still.
/// Ours.
const AT_LINE_M: f64 = 5.0;
/// A front that reaches over the line of a stop sign by less has not passed it, m. Ours: a driver does not see a line under the bonnet.
const OVER_LINE_M: f64 = 0.5;
/// If two vehicles stood at their signs, the one that stood earlier by more than this was first, s. Ours.
const FIRST_S: f64 = 1.0;

impl Passed {
    /// Notes the lines that lie between two stations of a front: lights, and stop signs with the lanes that they stand
    /// on. Stop signs are noted once the front is [`OVER_LINE_M`] beyond. `speed_mps`: of the vehicle.
    pub fn pass(
        &mut self,
        lights: &[StopLine],
        stops: impl Iterator<Item = (f64, LaneIndex)>,
        (from_m, to_m): (f64, f64),
        speed_mps: f64,
        around: &Around,
    ) {
        self.note_standing(speed_mps, around);
        self.pass_light(lights, (from_m, to_m), speed_mps, around);
        self.pass_sign(stops, (from_m - OVER_LINE_M, to_m - OVER_LINE_M), around);
    }

    /// As [`Passed::pass`], of a vehicle that keeps to no lanes: the lines are those of the lane under its front.
    pub fn pass_freely(&mut self, this: &Obstacle, moved: &Moved, around: &Around) {
        let speed_mps = this.velocity_mps.norm();
        self.note_standing(speed_mps, around);
        let along_m = this.forward.dot(&(moved.pose.position - this.outline.pose.position));
        if !this.body.is_vehicle() || along_m <= 0.0 {
            return;
        }
        let map = &around.scene.map;
        let front_m = this.outline.half_length_m;
        let lane_at = |ahead_m: f64| {
            let pose = this.outline.pose.offset(ahead_m, 0.0);
            let place = map.nearest(pose.position, pose.heading_rad, 0.0)?;
            Some((place.lane, (place.station_m, place.station_m + along_m)))
        };
        if let Some((lane, moved_m)) = lane_at(front_m) {
            self.pass_light(&map.lane(lane).stop_lines, moved_m, speed_mps, around);
        }
        if let Some((lane, moved_m)) = lane_at(front_m - OVER_LINE_M) {
            let stops = map.lane(lane).sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
            self.pass_sign(stops.map(|line| (line.station_m, lane)), moved_m, around);
        }
    }

    /// Notes the light whose line lies between two stations.
    fn pass_light(
        &mut self,
        lights: &[StopLine],
        (from_m, to_m): (f64, f64),
        speed_mps: f64,
        around: &Around,
    ) {
        if let Some(line) = lights.iter().rfind(|line| (from_m..to_m).contains(&line.station_m)) {
            self.light =
                Some(PassedLight { signal: line.signal, shown: shown(line.signal, speed_mps, around) });
        }
    }

    /// Notes the stop sign whose line lies between two stations.
    fn pass_sign(
        &mut self,
        mut stops: impl Iterator<Item = (f64, LaneIndex)>,
        (from_m, to_m): (f64, f64),
        around: &Around,
    ) {
        if let Some((_, lane)) = stops.find(|(station_m, _)| (from_m..to_m).contains(station_m)) {
            self.sign = Some(PassedSign { lane, stood: self.stood_at_line(around) });
        }
    }

    fn note_standing(&mut self, speed_mps: f64, around: &Around) {
        if let Some(stand) = &mut self.stand {
            stand.gone_m = stand.gone_m.map(|gone_m| gone_m + speed_mps * DT_S);
        }
        if speed_mps <= STOOD_MPS {
            let tick = around.tick;
            let stands_still = |stand: &Stand| stand.gone_m[0] <= AT_LINE_M;
            self.stand = Some(match self.stand.filter(stands_still) {
                Some(stand) => Stand { to: tick, gone_m: [stand.gone_m[0], 0.0], ..stand },
                None => Stand { from: tick, to: tick, gone_m: [0.0; 2] },
            });
        }
    }

    /// Since when the vehicle, whose front passes a stop line now, stood before it, ticks; `None` if it did not.
    fn stood_at_line(&self, around: &Around) -> Option<u64> {
        let stand = self.just_stood(around)?;
        let is_near = |gone_m: f64| gone_m <= AT_LINE_M + OVER_LINE_M;
        let [from_m, to_m] = stand.gone_m;
        is_near(from_m).then_some(stand.from).or(is_near(to_m).then_some(stand.to))
    }

    /// Whether the vehicle has stood within a few seconds.
    pub fn has_just_stood(&self, around: &Around) -> bool {
        self.just_stood(around).is_some()
    }

    fn just_stood(&self, around: &Around) -> Option<Stand> {
        self.stand.filter(|stand| around.tick - stand.to <= ticks(STOOD_S))
    }

    /// Whether the vehicle passed the light of a lane in a junction though it could have stopped, or still has it red
    /// before it.
    pub fn ran_light(&self, lane: LaneIndex, around: &Around) -> bool {
        let map = &around.scene.map;
        map.stop_line_of(lane).is_some_and(|line| {
            let junction = |signal: usize| map.signals[signal].junction;
            match self.light.filter(|light| junction(light.signal) == junction(line.signal)) {
                Some(light) => light.shown != Shown::Free,
                // It has not come to its light yet, or was there before its light was looked at.
                None => around.colours[line.signal] == SignalColour::Red,
            }
        })
    }
}

/// The priority where both lanes have stop signs, or one of the vehicles ran its sign; `None` where that decides
/// nothing.
pub fn by_stops(
    [ego, other]: [LaneIndex; 2],
    passed: [&Passed; 2],
    map: &RoadMap,
) -> Option<(Priority, Rule)> {
    let stops = (passed[0].stop_before(ego, map), passed[1].stop_before(other, map));
    let found = |priority, rule| Some((priority, rule));
    match stops {
        (Stop::Ran, Stop::Ran) => found(Priority::None, Rule::StopSign),
        (Stop::Ran, _) => found(Priority::Other, Rule::StopSign),
        (_, Stop::Ran) => found(Priority::Ego, Rule::StopSign),
        (Stop::Ahead, Stop::Stood(_)) => found(Priority::Other, Rule::FirstToStop),
        (Stop::Stood(_), Stop::Ahead) => found(Priority::Ego, Rule::FirstToStop),
        (Stop::Stood(a), Stop::Stood(b)) if a + ticks(FIRST_S) < b => found(Priority::Ego, Rule::FirstToStop),
        (Stop::Stood(a), Stop::Stood(b)) if b + ticks(FIRST_S) < a => {
            found(Priority::Other, Rule::FirstToStop)
        }
        _ => None,
    }
}

/// The state of a light for a vehicle that passes it now.
fn shown(signal: usize, speed_mps: f64, around: &Around) -> Shown {
    let map = &around.scene.map;
    match around.colours[signal] {
        SignalColour::Red => Shown::Red,
        SignalColour::Yellow => {
            let (since, _) = around.signals.around(map, signal, around.tick);
            let stops_s = YELLOW_REACTION_S + speed_mps / (2.0 * YELLOW_BRAKING_MPS2);
            if since > ticks(stops_s) { Shown::LateYellow } else { Shown::Free }
        }
        SignalColour::Green => Shown::Free,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;
    use crate::sim::{Start, World};
    use avastra_base::geometry::OrientedBox;
    use avastra_lang::model::vocabulary::Body;

    #[test]
    fn at_stop_signs_the_first_to_stand_goes_first_and_who_did_not_stand_gives_way() {
        let (stop, none) = ("206", "274");
        let decided = |signs: [&str; 2], stood: [Option<Option<u64>>; 2]| {
            let map = testing::crossing_of(signs[0], signs[1]).map.clone();
            let lanes = ["2", "5"].map(|road| map.place(road, -1, 10.0).expect("it is there").lane);
            let passed = [0, 1].map(|nth| {
                let lane = map.approach(lanes[nth]).last().expect("a lane leads to it");
                Passed { sign: stood[nth].map(|stood| PassedSign { lane, stood }), ..Passed::default() }
            });
            by_stops(lanes, [&passed[0], &passed[1]], &map).map(|(priority, rule)| (priority, rule.name()))
        };
        let at = |tick: u64| Some(Some(tick));
        let (first, ran) = (Rule::FirstToStop.name(), Rule::StopSign.name());
        let both = |stood| decided([stop, stop], stood);
        // A second is 50 ticks: who is earlier by more goes first.
        assert_eq!(both([at(100), at(151)]), Some((Priority::Ego, first)));
        assert_eq!(both([at(151), at(100)]), Some((Priority::Other, first)));
        assert_eq!((both([at(100), at(150)]), both([at(150), at(100)])), (None, None));
        assert_eq!(both([at(100), None]), Some((Priority::Ego, first)), "the other has not come to its sign");
        assert_eq!(both([None, at(100)]), Some((Priority::Other, first)));
        assert_eq!(both([None, None]), None);
        assert_eq!(both([Some(None), at(100)]), Some((Priority::Other, ran)));
        assert_eq!(both([at(100), Some(None)]), Some((Priority::Ego, ran)));
        assert_eq!(both([Some(None), Some(None)]), Some((Priority::None, ran)));
        assert_eq!(decided([stop, none], [Some(None), None]), Some((Priority::Other, ran)));
        assert_eq!(decided([none, stop], [None, Some(None)]), Some((Priority::Ego, ran)));
        assert_eq!(decided([stop, none], [at(100), None]), None, "its sign alone decides, elsewhere");
        assert_eq!(decided([none, none], [None, None]), None);
    }

    /// At 7 m/s a vehicle can stop for 1 s of reaction and 1 s of braking: what is yellow for longer is late.
    #[test]
    fn yellow_is_late_once_the_vehicle_could_have_stopped() {
        let scene = testing::crossing();
        let world =
            |phase_s: f64| World::new(scene.clone(), &Start { signal_phase_s: phase_s, ..testing::start() });
        let colour = |phase_s: f64| {
            let world = world(phase_s);
            world.alone().signals.colour(&scene.map, 0, 0)
        };
        let mut phases = (0..3_400).map(|step| f64::from(step) * 0.02);
        let yellow_s = phases
            .find(|phase_s| {
                colour(*phase_s) == SignalColour::Yellow && colour(phase_s - 0.02) != SignalColour::Yellow
            })
            .expect("it is yellow once a cycle");
        let at = |since_s: f64, speed_mps: f64| {
            let world = world(yellow_s + since_s);
            shown(0, speed_mps, &world.alone())
        };
        assert_eq!((at(2.0, 7.0), at(2.02, 7.0)), (Shown::Free, Shown::LateYellow));
        assert_eq!((at(1.0, 0.0), at(1.02, 0.0)), (Shown::Free, Shown::LateYellow));
        assert_eq!((at(-0.1, 7.0), at(3.5, 7.0)), (Shown::Free, Shown::Red), "green before, red afterwards");
    }

    #[test]
    fn a_vehicle_that_keeps_to_no_lanes_passes_stop_signs_and_no_others() {
        let passes = |sign: &str, body: Body| {
            let scene = testing::crossing_of(sign, "274");
            let mut world = testing::world(&scene);
            world.put("1", -1, "2", 275.0, 5.0);
            let this = Obstacle { body, ..world.latest().obstacle };
            let pose = this.outline.pose.offset(20.0, 0.0);
            let (forward, velocity_mps) = (this.forward, this.velocity_mps);
            let moved = Moved { pose, forward, lane_heading_rad: pose.heading_rad, velocity_mps };
            let mut passed = Passed::default();
            passed.pass_freely(&this, &moved, &world.alone());
            passed.sign.is_some()
        };
        assert_eq!(["206", "205", "274"].map(|sign| passes(sign, Body::Sedan)), [true, false, false]);
        assert!(!passes("206", Body::Pedestrian), "no sign is for people on foot");
    }

    #[test]
    fn a_front_a_little_over_the_line_of_a_stop_sign_has_not_passed_it() {
        let scene = testing::crossing_of("206", "274");
        let map = &scene.map;
        let line_m = map.lane(map.place("1", -1, 100.0).expect("it is there").lane).sign_lines[0].station_m;
        // The front goes on by a metre, to so far behind the line.
        let passes = |over_m: f64| {
            let mut world = testing::world(&scene);
            world.put("1", -1, "2", 100.0, 5.0);
            let half_m = world.latest().obstacle.outline.half_length_m;
            world.put("1", -1, "2", line_m + over_m - 1.0 - half_m, 5.0);
            let this = &world.latest().obstacle;
            let pose = this.outline.pose.offset(1.0, 0.0);
            let (forward, velocity_mps) = (this.forward, this.velocity_mps);
            let moved = Moved { pose, forward, lane_heading_rad: pose.heading_rad, velocity_mps };
            let mut passed = Passed::default();
            passed.pass_freely(this, &moved, &world.alone());
            passed.sign.is_some()
        };
        assert_eq!([0.4, 0.6, 1.4, 1.6].map(passes), [false, true, true, false]);
    }

    #[test]
    fn a_stop_sign_is_being_run_from_its_lane_to_the_end_of_the_junction() {
        let map = testing::crossing_of("206", "274").map.clone();
        let lane = map.place("1", -1, 280.0).expect("it is there").lane;
        let at = |road: &str, s_m: f64, stood: Option<u64>| {
            let place = map.place(road, -1, s_m).expect("it is there");
            let outline = OrientedBox::new(map.lane(place.lane).centre.pose_at(place.station_m), 4.7, 1.9);
            Passed { sign: Some(PassedSign { lane, stood }), ..Passed::default() }
                .is_running_stop(&map, &outline)
        };
        assert!(at("1", 288.0, None), "it has just passed the line");
        assert!(at("2", 10.0, None), "it is in the junction");
        assert!(!at("3", 10.0, None), "it has left the junction");
        assert!(!at("5", 10.0, None), "another sign belongs to that lane");
        assert!(!at("2", 10.0, Some(7)), "it has stood");
    }

    #[test]
    fn to_have_stood_is_to_have_stood_within_five_seconds() {
        let scene = testing::crossing();
        let mut world = World::new(scene, &testing::start());
        let mut passed = Passed::default();
        passed.note_standing(0.4, &world.alone());
        assert!(!passed.has_just_stood(&world.alone()), "0.4 m/s is no stand");
        passed.note_standing(0.3, &world.alone());
        for _ in 0..250 {
            world.tick(&crate::sim::tests::hold(&world, 5.0));
        }
        assert!(passed.has_just_stood(&world.alone()));
        world.tick(&crate::sim::tests::hold(&world, 5.0));
        assert!(!passed.has_just_stood(&world.alone()));
    }

    /// The vehicle that first came to stand at its line goes first, however long it waits and inches up.
    #[test]
    fn a_stand_counts_from_its_beginning_at_the_line() {
        // At so many metres before its line, it stands for 2 s. Then it drives on, with another stand of 2 s if that is
        // told.
        let stood = |stands_m: &[f64]| {
            let mut world = World::new(testing::crossing(), &testing::start());
            let mut passed = Passed::default();
            let mut ahead_m = 20.0;
            let mut stands = stands_m.iter().copied().peekable();
            while ahead_m > -OVER_LINE_M {
                let is_there = stands.next_if(|stand_m| ahead_m <= *stand_m).is_some();
                for _ in 0..if is_there { 100 } else { 1 } {
                    passed.note_standing(if is_there { 0.0 } else { 5.0 }, &world.alone());
                    world.tick(&crate::sim::tests::hold(&world, 5.0));
                }
                if !is_there {
                    ahead_m -= 5.0 * DT_S;
                }
            }
            passed.stood_at_line(&world.alone()).map(|tick| tick as f64 * DT_S)
        };
        let near = |found: Option<f64>, wanted_s: f64| found.is_some_and(|s| (s - wanted_s).abs() < 0.1);
        assert_eq!(stood(&[]), None);
        assert!(near(stood(&[4.9]), 3.02), "{:?}", stood(&[4.9]));
        assert_eq!(stood(&[5.2]), None, "it stood in a queue, or for nothing");
        assert!(near(stood(&[4.5, 0.5]), 3.1), "it inched up: {:?}", stood(&[4.5, 0.5]));
        assert!(near(stood(&[2.5, -0.3]), 3.5), "over the line by less than half a metre");
        assert!(near(stood(&[9.0, 1.0]), 5.8), "it moved up in a queue: {:?}", stood(&[9.0, 1.0]));
        assert!(
            near(stood(&[5.8, 1.0]), 7.8),
            "its last stand alone was at the line: {:?}",
            stood(&[5.8, 1.0])
        );
    }
}
