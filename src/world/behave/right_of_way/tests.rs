//! Priority at contacts made by hand.

use std::sync::Arc;

use crate::action::{Effect, SpawnRequest};
use crate::behave::right_of_way::crossing::Crossing;
use crate::behave::right_of_way::order::right_of_way;
use crate::behave::right_of_way::room::allowed_mps;
use crate::behave::right_of_way::side::Side;
use crate::behave::right_of_way::vehicle::Vehicle;
use crate::sim::testing::{self, Heading, request, told};
use crate::sim::tests::hold;
use crate::sim::{Contact, Control, Scene, Start, World};
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::passed::Passed;
use crate::state::rights::{Foreseen, Meeting, Place, Rights};
use crate::state::road_user::Motion;
use crate::state::ruling::{Mover, Rule, Ruling};
use crate::state::sensed::SignalColour;
use avastra_lang::model::vocabulary::{Field, Priority};
use avastra_lang::model::vocabulary::{LaneChoice, Then, Verb};
use avastra_road::{LaneIndex, RoadMap};

fn inside(map: &RoadMap, road: &str) -> LaneIndex {
    map.place(road, -1, 10.0).expect("it is there").lane
}

#[test]
fn a_red_light_decides_before_the_right() {
    use SignalColour::{Green, Red};
    let map = testing::crossing().map.clone();
    let (east, north) = (inside(&map, "2"), inside(&map, "5"));
    let decided = |colours: [SignalColour; 2]| {
        [
            right_of_way(&map, |signal| colours[signal], east, north),
            right_of_way(&map, |signal| colours[signal], north, east),
        ]
    };
    // Signal 0 is that of the lane to the east.
    assert_eq!(decided([Green, Red]), [Priority::Ego, Priority::Other]);
    assert_eq!(decided([Red, Green]), [Priority::Other, Priority::Ego]);
    assert_eq!(decided([Red, Red]), [Priority::None, Priority::None]);
    assert_eq!(decided([Green, Green]), [Priority::Other, Priority::Ego], "the one from the right");
}

#[test]
fn signs_decide_before_the_right_and_lights_before_signs() {
    let decided = |ego: &str, other: &str| {
        let map = testing::crossing_of(ego, other).map.clone();
        right_of_way(&map, |_| SignalColour::Green, inside(&map, "2"), inside(&map, "5"))
    };
    let (light, stop, yields, priority, none) = ("1000001", "206", "205", "306", "274");
    assert_eq!(decided(none, none), Priority::Other, "the one from the right");
    assert_eq!(decided(priority, none), Priority::Ego);
    assert_eq!(decided(none, yields), Priority::Ego);
    assert_eq!(decided(priority, stop), Priority::Ego);
    assert_eq!(decided(yields, priority), Priority::Other);
    assert_eq!(decided(stop, stop), Priority::Other, "both signs say the same");
    assert_eq!(decided(light, light), Priority::Other);
}

/// Drives the route at a speed until a contact.
fn contact(world: &mut World, speed_mps: f64) -> Contact {
    for _ in 0..3000 {
        if let Some(contact) = world.tick(&hold(world, speed_mps)).first() {
            return *contact;
        }
    }
    panic!("no contact in a minute");
}

/// The scene with a light, entered at a green one: 34 s are a cycle.
fn begin(scene: &Arc<Scene>, signal_phase_s: f64) -> World {
    World::new(Arc::clone(scene), &Start { signal_phase_s, ..testing::start() })
}

/// Drives until the ego vehicle's front is at a station.
fn drive_to(world: &mut World, front_m: f64, speed_mps: f64) {
    while VehicleParameters::MKZ.front_m(world.ego_station_m()) < front_m {
        assert_eq!(world.tick(&hold(world, speed_mps)), []);
    }
}

#[test]
fn a_vehicle_that_turns_across_gives_way_and_so_does_the_ego_vehicle() {
    // Straight on at 10 m/s, 30 m before the middle; the other turns left at 7 m/s, 17 m before it.
    let mut world = begin(&testing::oncoming(Heading::Straight), 0.0);
    drive_to(&mut world, 80.0, 10.0);
    world.put("3", 1, "8", 193.0, 7.0);
    let met = contact(&mut world, 10.0);
    assert_eq!(met.ruling.priority, Priority::Ego, "{met:?}");
    assert!(met.on_ego.x > 2.0, "it is hit by the front of the ego vehicle: {met:?}");

    // The ego vehicle turns left at 5 m/s before one that comes straight on at 10 m/s.
    let mut world = begin(&testing::oncoming(Heading::Left), 0.0);
    drive_to(&mut world, 90.0, 5.0);
    world.put("3", 1, "2", 173.0, 10.0);
    let met = contact(&mut world, 5.0);
    assert_eq!(met.ruling.priority, Priority::Other, "{met:?}");
}

#[test]
fn a_siren_goes_first_whatever_the_lanes_say() {
    let mut world = begin(&testing::oncoming(Heading::Straight), 0.0);
    drive_to(&mut world, 80.0, 10.0);
    world.put("3", 1, "8", 193.0, 7.0);
    world.sound_siren();
    let Ruling { priority, rule, mover, time_s } = contact(&mut world, 10.0).ruling;
    assert_eq!((priority, rule, mover), (Priority::Other, Rule::Siren, Mover::Other));
    assert!((world.time_s() - 1.5..world.time_s()).contains(&time_s), "{time_s}");
}

#[test]
fn a_vehicle_that_stands_in_the_junction_has_given_way_long_ago() {
    let mut world = begin(&testing::oncoming(Heading::Straight), 0.0);
    drive_to(&mut world, 20.0, 8.0);
    world.put("3", 1, "8", 208.0, 0.3);
    let met = contact(&mut world, 8.0);
    assert_eq!(met.ruling.priority, Priority::Other, "{met:?}");
}

#[test]
fn an_ego_vehicle_blocks_who_crosses_while_it_is_on_its_strip() {
    let scene = testing::crossing();
    let area = &scene.route_areas[0].area;
    let middle_m = (area.from_m + area.to_m) / 2.0;
    // How far the middle of the ego vehicle is before the other's strip.
    let blocks = |before_m: f64| {
        let mut world = testing::world(&scene);
        drive_to(&mut world, middle_m - before_m + VehicleParameters::MKZ.length_m / 2.0, 5.0);
        world.put("4", -1, "5", 280.0, 0.0);
        let user = world.latest();
        let vehicle = Vehicle::of(&user.obstacle, &user.mover.motion).expect("it is a vehicle");
        let found = Crossing::of(&vehicle, &world.alone()).expect("the ego vehicle is in the area");
        found.is_blocked(Mover::Ego, &vehicle, &world.alone())
    };
    assert_eq!([3.8, 2.5, 0.0].map(blocks), [false, true, true]);
}

#[test]
fn a_vehicle_that_waits_in_the_junction_and_sets_out_comes_anew() {
    // It turns left before the ego vehicle, and waits in the junction beside the ego vehicle's strip.
    let scene = testing::oncoming(Heading::Straight);
    let passed = Passed::default();
    let judged = |first_mps: f64| {
        let mut world = begin(&scene, 0.0);
        drive_to(&mut world, 40.0, 10.0);
        world.put("3", 1, "8", 203.2, 0.0);
        let mut rights = Rights::default();
        let mut watch = |world: &World, speed_mps: f64| {
            let user = world.latest();
            let vehicle = Vehicle::of(&user.obstacle, &user.mover.motion).expect("it is a vehicle");
            let vehicle = Vehicle { speed_mps, ..vehicle };
            rights.watch_vehicle(&vehicle, &passed, &world.alone());
            rights.meeting.expect("the two ways cross").ruling
        };
        let first = watch(&world, first_mps);
        assert_eq!((first.priority, first.rule), (Priority::Other, Rule::Clearing));
        drive_to(&mut world, 95.0, 10.0);
        watch(&world, 4.0)
    };
    let of = |ruling: Ruling| (ruling.priority, ruling.rule, ruling.mover);
    assert_eq!(of(judged(0.0)), (Priority::Ego, Rule::Turning, Mover::Other));
    // One that has never stood still keeps what it has.
    assert_eq!(of(judged(1.0)), (Priority::Other, Rule::Clearing, Mover::Other));
}

#[test]
fn a_red_light_is_remembered_until_the_contact() {
    // 5 s into the cycle the ego vehicle's light is green, 15 s later the other's.
    let mut world = begin(&testing::crossing(), 5.0);
    drive_to(&mut world, 90.0, 15.0);
    assert!((world.time_s() - 8.5).abs() < 1.5, "{}", world.time_s());
    world.put("4", -1, "5", 240.0, 8.0);
    let met = contact(&mut world, 15.0);
    assert_eq!((met.ruling.priority, world.red_runs()), (Priority::Other, 1), "{met:?}");
}

#[test]
fn a_conflict_area_counts_once_the_ego_vehicle_is_eighty_metres_before_it() {
    let scene = testing::crossing();
    let found = |before_m: f64| {
        let mut world = testing::world(&scene);
        drive_to(&mut world, scene.route_areas[0].area.from_m - before_m, 5.0);
        world.put("4", -1, "5", 300.0, 1.0);
        let user = world.latest();
        let vehicle = Vehicle::of(&user.obstacle, &user.mover.motion).expect("it is a vehicle");
        Crossing::of(&vehicle, &world.alone()).is_some()
    };
    assert_eq!([90.0, 80.2, 79.7, 70.0].map(found), [false, false, true, true]);
}

#[test]
fn of_two_in_a_lane_the_one_ahead_has_priority() {
    let mut world = testing::world(&testing::straight());
    drive_to(&mut world, 60.0, 10.0);
    world.apply(&Effect::Spawn(request(Verb::DriveAhead, 30.0, 4.0))).expect("there is room");
    assert_eq!(contact(&mut world, 10.0).ruling.priority, Priority::Other);
}

#[test]
fn one_who_cuts_in_gives_way_unless_there_is_room() {
    let cuts_in = |distance_m: f64, speed_mps: f64| {
        let mut world = testing::world(&testing::straight());
        drive_to(&mut world, 60.0, 12.0);
        let lane = LaneChoice::Right;
        let cuts_in =
            SpawnRequest { lane, then: Then::Change, ..request(Verb::DriveAhead, distance_m, speed_mps) };
        world.apply(&Effect::Spawn(cuts_in)).expect("there is room");
        contact(&mut world, 12.0).ruling.priority
    };
    assert_eq!(cuts_in(22.0, 5.0), Priority::Ego);
    assert_eq!(cuts_in(75.0, 8.0), Priority::Other);
}

#[test]
fn one_who_cuts_in_and_stops_has_not_given_way_before_the_distance_is_back() {
    let side = |apart_m: f64, other_mps: f64| Side {
        aside_m: -1.0,
        apart_m,
        ego_is_ahead: false,
        along: 1.0,
        ego_mps: 10.0,
        allowed_mps: 10.0,
        other_mps,
        ego_does: None,
        other_does: Some(Rule::LeavingLane),
        has_siren: false,
    };
    let coming = |side: Side| side.at_coming(|| None, 0.0).map(|ruling| ruling.priority);
    // As fast as the ego vehicle, less than a second before it.
    assert_eq!(coming(side(4.0, 10.0)), Some(Priority::Ego));
    assert_eq!(coming(side(11.0, 10.0)), None);
    // The ruling stays while it brakes to rest, and until there is room to brake gently for it.
    assert!(!side(4.0, 10.0).is_gentle() && !side(6.0, 5.0).is_gentle() && !side(4.0, 0.0).is_gentle());
    assert!(side(22.0, 0.0).is_gentle());
    // A vehicle that is still as near once it could have stopped follows the other: 0.4 s, and 10 m/s at 3 m/s².
    let ruling = side(4.0, 10.0).at_coming(|| None, 0.0).expect("it cut in");
    let rests_s = side(4.0, 10.0).rests_in_s();
    let meeting = Meeting { rests_s, ..Meeting::new(Place::Lane, ruling, 0) };
    assert_eq!([3.7, 3.8].map(|time_s| meeting.is_over(&side(4.0, 10.0), time_s)), [false, true]);
    assert!(!meeting.is_over(&Side { along: -1.0, ..side(4.0, 10.0) }, 9.0), "they come towards each other");
}

#[test]
fn others_need_not_leave_more_room_to_who_speeds() {
    let side = |allowed_mps: f64| Side {
        aside_m: -1.0,
        apart_m: 30.0,
        ego_mps: 20.0,
        allowed_mps,
        other_mps: 6.0,
        ..SIDE
    };
    assert!(!side(20.0).is_gentle() && side(13.9).is_gentle());
    // The speed of the vehicle behind counts.
    assert!(Side { ego_is_ahead: true, other_mps: 20.0, ..side(13.9) }.is_gentle());
    let scene = testing::straight();
    let world = testing::world(&scene);
    let limit_mps = scene.map.lane(scene.route.lane_at(0.0).lane).speed_limit_mps;
    let allowed = |own_mps: f64| allowed_mps(own_mps, &world.alone());
    assert_eq!([5.0, limit_mps + 1.0].map(allowed), [5.0, limit_mps + 1.0]);
    assert_eq!(allowed(limit_mps + 1.1), limit_mps);
}

/// Two in one direction, the ego vehicle 2 m behind, flank to flank by half a metre and at the same speed. Neither
/// leaves its lane.
const SIDE: Side = Side {
    aside_m: -0.5,
    apart_m: 2.0,
    ego_is_ahead: false,
    along: 1.0,
    ego_mps: 10.0,
    allowed_mps: 10.0,
    other_mps: 10.0,
    ego_does: None,
    other_does: None,
    has_siren: false,
};

#[test]
fn in_one_lane_the_one_behind_keeps_its_distance_unless_the_one_ahead_backs() {
    let told = |side: Side| {
        let ruling = side.at_contact(|| None, 3.0).expect("their ends have met");
        assert_eq!(ruling.time_s, 3.0);
        (ruling.priority, ruling.rule, ruling.mover)
    };
    let (backs, leaves) = (Some(Rule::Backing), Some(Rule::LeavingLane));
    let behind = (Priority::Other, Rule::Distance, Mover::Ego);
    let ahead = (Priority::Ego, Rule::Distance, Mover::Other);
    assert_eq!(told(SIDE), behind);
    assert_eq!(told(Side { ego_does: backs, ..SIDE }), behind, "it is the one behind");
    assert_eq!(told(Side { other_does: backs, ..SIDE }), (Priority::Ego, Rule::Backing, Mover::Other));
    assert_eq!(told(Side { other_does: leaves, ..SIDE }), behind, "it had left its lane long ago");
    let before = Side { ego_is_ahead: true, ..SIDE };
    assert_eq!(told(before), ahead);
    assert_eq!(told(Side { other_does: backs, ..before }), ahead);
    assert_eq!(told(Side { ego_does: backs, ..before }), (Priority::Other, Rule::Backing, Mover::Ego));
    // Where the ends and the flanks are as near, the ends have met.
    assert_eq!(told(Side { apart_m: -0.5, ..SIDE }), behind);
}

#[test]
fn flank_at_flank_the_one_that_leaves_its_lane_gives_way_and_then_the_faster() {
    let told = |side: Side| side.at_contact(|| None, 3.0).map(|of| (of.priority, of.rule, of.mover));
    let beside = Side { apart_m: -3.0, aside_m: 0.0, ..SIDE };
    let leaves = Some(Rule::LeavingLane);
    let both = Some((Priority::None, Rule::BothLeaveLanes, Mover::Both));
    assert_eq!(told(Side { ego_does: leaves, other_does: leaves, ..beside }), both);
    let ego = Some((Priority::Other, Rule::Entering, Mover::Ego));
    assert_eq!(told(Side { ego_does: Some(Rule::Entering), ..beside }), ego);
    assert_eq!(
        told(Side { other_does: leaves, ..beside }),
        Some((Priority::Ego, Rule::LeavingLane, Mover::Other))
    );
    // The faster by more than a standing one's 0.1 m/s overtakes.
    let ego_passes = Some((Priority::Other, Rule::Overtaking, Mover::Ego));
    let other_passes = Some((Priority::Ego, Rule::Overtaking, Mover::Other));
    assert_eq!(told(Side { ego_mps: 12.0, ..beside }), ego_passes);
    assert_eq!(told(Side { ego_mps: 5.0, ..beside }), other_passes);
    assert_eq!(told(Side { ego_mps: 10.05, ..beside }), None);
    assert_eq!(told(Side { ego_mps: 12.0, along: 0.5, ..beside }), None, "they lie across each other");
    // Across each other no end decides.
    assert_eq!(
        told(Side { along: 0.5, ego_does: leaves, ..SIDE }),
        Some((Priority::Other, Rule::LeavingLane, Mover::Ego))
    );
}

#[test]
fn of_two_that_meet_the_middle_of_the_road_decides_and_then_the_lane() {
    let oncoming = Side { along: -0.9, ..SIDE };
    let middle = || Some(Ruling { rule: Rule::Middle, ..Ruling::default() });
    assert_eq!(oncoming.at_contact(middle, 3.0).map(|of| of.rule), Some(Rule::Middle));
    assert_eq!(oncoming.at_coming(middle, 3.0).map(|of| of.rule), Some(Rule::Middle));
    assert_eq!(Side { along: -0.5, ..SIDE }.at_coming(middle, 3.0), None, "that is across");
    let told = |side: Side| side.at_contact(|| None, 3.0).map(|of| (of.priority, of.rule, of.mover));
    let leaves = Some(Rule::LeavingLane);
    assert_eq!(
        told(Side { other_does: leaves, ..oncoming }),
        Some((Priority::Ego, Rule::LeavingLane, Mover::Other))
    );
    assert_eq!(
        told(Side { ego_does: leaves, ..oncoming }),
        Some((Priority::Other, Rule::LeavingLane, Mover::Ego))
    );
    assert_eq!(told(oncoming), Some((Priority::None, Rule::None, Mover::Both)));
}

#[test]
fn who_comes_into_a_lane_gives_way_unless_it_comes_behind_or_leaves_room() {
    let told = |side: Side| side.at_coming(|| None, 3.0).map(|of| (of.priority, of.mover));
    let leaves = Some(Rule::LeavingLane);
    let (of_ego, of_other) = (Some((Priority::Other, Mover::Ego)), Some((Priority::Ego, Mover::Other)));
    // 2 m before or behind, as fast: less than a second.
    let [ego, other] = [Side { ego_does: leaves, ..SIDE }, Side { other_does: leaves, ..SIDE }];
    assert_eq!(told(ego), None, "it comes behind the other");
    assert_eq!(told(other), of_other);
    assert_eq!(told(Side { ego_is_ahead: true, ..ego }), of_ego);
    assert_eq!(told(Side { ego_is_ahead: true, ..other }), None, "it comes behind the ego vehicle");
    // Beside the other, and not behind it.
    assert_eq!(told(Side { apart_m: -1.0, ..ego }), of_ego);
    assert_eq!(told(Side { apart_m: -1.0, ego_is_ahead: true, ..other }), of_other);
    assert_eq!(told(Side { along: 0.0, ..ego }), of_ego, "across the other");
    assert_eq!(told(SIDE), None, "neither comes");
    // A vehicle that turns off in good time clears the junction, where a vehicle that changes lanes drives on ahead.
    let room = Side { apart_m: 40.0, ..SIDE };
    let by_rule = |side: Side| side.at_coming(|| None, 3.0).map(|of| (of.priority, of.rule, of.mover));
    let turns = Some(Rule::TurningOff);
    for (side, priority, mover) in [
        (Side { ego_is_ahead: true, ego_does: turns, ..room }, Priority::Ego, Mover::Ego),
        (Side { other_does: turns, ..room }, Priority::Other, Mover::Other),
    ] {
        assert_eq!(by_rule(side), Some((priority, Rule::Clearing, mover)));
    }
    assert_eq!(by_rule(Side { ego_is_ahead: true, ego_does: leaves, ..room }), None);
}

#[test]
fn gentle_is_a_second_and_braking_at_3_mps2_after_a_reaction() {
    let gentle = |side: Side| side.is_gentle();
    // As fast: a second of the one ahead, 10 m.
    assert!(!gentle(Side { apart_m: 9.9, ..SIDE }) && gentle(Side { apart_m: 10.1, ..SIDE }));
    // 6 m/s faster: a second of 4 m/s, 2.4 m of reaction and 6 m of braking are 12.4 m.
    let closes = Side { other_mps: 4.0, ..SIDE };
    assert!(!gentle(Side { apart_m: 12.3, ..closes }) && gentle(Side { apart_m: 12.5, ..closes }));
    // The same, the other behind.
    let closed = Side { ego_mps: 4.0, ego_is_ahead: true, ..SIDE };
    assert!(!gentle(Side { apart_m: 12.3, ..closed }) && gentle(Side { apart_m: 12.5, ..closed }));
    // One that comes backwards counts as standing: 4 m of reaction and 16.7 m of braking.
    let backs = Side { other_mps: -5.0, ..SIDE };
    assert!(!gentle(Side { apart_m: 20.6, ..backs }) && gentle(Side { apart_m: 20.7, ..backs }));
    assert!(!gentle(Side { apart_m: 30.0, along: 0.0, ..SIDE }));
}

#[test]
fn on_foot_the_crosswalk_decides_and_elsewhere_the_time_to_brake() {
    let crosses = |scene: &Arc<Scene>, verb: Verb, distance_m: f64| {
        let mut world = testing::world(scene);
        drive_to(&mut world, 60.0, 11.0);
        world.apply(&Effect::Spawn(request(verb, distance_m, 1.4))).expect("there is room");
        contact(&mut world, 11.0).ruling.priority
    };
    // 11 m/s: 4.4 m until the brakes act, and 8 m to stop.
    let street = testing::straight();
    assert_eq!(crosses(&street, Verb::Stand, 10.0), Priority::Ego);
    assert_eq!(crosses(&street, Verb::Stand, 16.0), Priority::None);
    let zebra = testing::zebra();
    assert_eq!(crosses(&zebra, Verb::Stand, 10.0), Priority::Other);
}

#[test]
fn who_steps_out_too_late_is_no_surprise_once_the_ego_vehicle_can_stop() {
    let mut world = testing::world(&testing::straight());
    drive_to(&mut world, 60.0, 11.0);
    world.apply(&Effect::Spawn(request(Verb::Stand, 12.0, 1.4))).expect("there is room");
    let met = contact(&mut world, 2.5).ruling;
    assert_eq!((met.priority, met.rule, met.mover), (Priority::None, Rule::OnFoot, Mover::Other));
    // Its moment is that at which the pedestrian stepped out.
    assert!(world.time_s() - met.time_s > 0.8, "{} s, {met:?}", world.time_s());
}

#[test]
fn who_stands_beside_the_road_did_not_come_to_an_ego_vehicle_that_leaves_it() {
    // The road ends 1.75 m beside the ego vehicle's way. It drives so far to the right.
    let met = |person_m: f64, ego_m: f64| {
        let mut world = testing::world(&testing::overpass(3.0));
        let beside = told(request(Verb::Stand, 40.0, 1.4), Field::Offset, -person_m);
        world.apply(&Effect::Spawn(beside)).expect("there is room");
        let way_m = world.ego().rear_axle.position.y - ego_m;
        for _ in 0..400 {
            let axle = world.ego().rear_axle;
            let to_m = (way_m - axle.position.y).clamp(-1.0, 1.0);
            let control = Control { steer_rad: 0.1 * to_m - 0.6 * axle.heading_rad, ..hold(&world, 10.0) };
            if let Some(contact) = world.tick(&control).first() {
                return Some((contact.ruling.priority, contact.ruling.rule, contact.ruling.mover));
            }
        }
        None
    };
    let came = Some((Priority::Other, Rule::LeavingLane, Mover::Ego));
    assert_eq!(met(2.1, 1.2), came);
    assert_eq!(met(2.6, 1.6), came);
    assert_eq!(met(1.5, 1.2), Some((Priority::None, Rule::OnFoot, Mover::Other)), "on the carriageway");
    assert_eq!(met(2.6, 0.4), None);
}

/// The ruling on a car that came out of a drive, when the two touch.
#[test]
fn an_ego_vehicle_that_drives_gives_way_to_what_stands_and_one_that_stands_does_not() {
    let scene = testing::crossing();
    let told = |ego_mps: f64, other_mps: f64, seen_standing: bool, came: Option<Rule>, left_room: bool| {
        let mut world = World::new(scene.clone(), &Start { ego_mps, ..testing::start() });
        world.put("4", -1, "5", 250.0, 0.0);
        let this = &world.latest().obstacle;
        let this = Obstacle { velocity_mps: this.forward * other_mps, ..*this };
        let ruling = |rule: Rule| Ruling { priority: Priority::Ego, rule, mover: Mover::Other, time_s: 0.0 };
        let rights = Rights {
            meeting: came.map(|rule| Meeting::new(Place::Lane, ruling(rule), 0)),
            foreseen: seen_standing.then_some(Foreseen { at: this.outline.pose.position, blocks: true }),
            left_room,
            ..Rights::default()
        };
        let point = this.outline.pose.position;
        let of = rights.at_contact(&this, &Motion::Stand, point, &world.alone());
        (of.priority, of.rule, of.mover)
    };
    let (stands, entered) = ((Priority::Other, Rule::Standing, Mover::Ego), Some(Rule::Entering));
    assert_eq!(told(8.0, 0.0, true, entered, false), stands, "it had time to stop");
    assert_eq!(told(8.0, 0.0, false, entered, false), (Priority::Ego, Rule::Entering, Mover::Other));
    assert_eq!(
        told(8.0, 2.0, true, entered, false),
        (Priority::None, Rule::Standing, Mover::Other),
        "a step"
    );
    assert_eq!(told(8.0, 0.0, false, None, true), stands, "it came with room");
    assert_eq!(told(8.0, 0.0, false, None, false).1, Rule::None);
    assert_eq!(told(0.0, 2.0, true, entered, false), (Priority::Ego, Rule::Entering, Mover::Other));
}
