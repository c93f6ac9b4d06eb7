//! Behaviour of road users: every verb on a hand-made road, and the properties that all of them share.

mod levels;
mod told;
mod vehicles;

use std::sync::Arc;

use proptest::prelude::*;

use super::testing::{digest, request};
use super::{
    Contact, Control, DT_S, Incident, Obstacle, Scene, Start, TrafficProfile, VehicleParameters, World,
    pedals_for, testing,
};
use crate::action::{Effect, SpawnRequest, Surroundings};
use avastra_base::geometry::{Vec2, distance_m, wrap_angle};
use avastra_lang::model::body::{Changes, OwnBody, parameters};
use avastra_lang::model::vocabulary::{
    Body, Field, LaneChoice, Level, Light, Phenomenon, Side, Then, Verb, Word,
};

/// Holds a speed and the route, whatever is in the way, by aiming at a point ahead (pure pursuit).
pub(crate) fn hold(world: &World, speed_mps: f64) -> Control {
    let ego = world.ego();
    let (throttle_pct, brake_pct) = pedals_for(2.0 * (speed_mps - ego.speed_mps));
    let ahead_m = 3.0 + 0.5 * ego.speed_mps;
    let aim = world.scene().route.path.pose_at(world.ego_station_m() + ahead_m);
    let local = ego.rear_axle.to_local(aim.position);
    let curvature_per_m = 2.0 * local.y / local.norm_squared();
    let steer_rad = libm::atan(curvature_per_m * VehicleParameters::MKZ.wheelbase_m);
    Control { throttle_pct, brake_pct, steer_rad }
}

/// Drives on for a while; returns the contacts.
fn drive(world: &mut World, speed_mps: f64, time_s: f64) -> Vec<Contact> {
    let end_s = world.time_s() + time_s;
    let mut contacts = Vec::new();
    while world.time_s() < end_s - 1e-9 {
        contacts.extend_from_slice(world.tick(&hold(world, speed_mps)));
    }
    contacts
}

/// A world after a drive at a speed for a while.
fn driven(scene: &Arc<Scene>, speed_mps: f64, time_s: f64) -> World {
    let mut world = testing::world(scene);
    drive(&mut world, speed_mps, time_s);
    world
}

fn spawn(world: &mut World, request: SpawnRequest) -> Obstacle {
    let facts = world.survey(&request).expect("there is room");
    let id = world.apply(&Effect::Spawn(request)).expect("there is room").expect("a newcomer has an id");
    let newcomer = *world.obstacle(id).expect("it just came");
    assert_eq!(facts.spawn_gap_m, distance_m(&world.ego_outline(), &newcomer.outline));
    newcomer
}

fn y_m(world: &World, id: u32) -> f64 {
    world.obstacle(id).expect("it is still there").outline.pose.position.y
}

#[test]
fn ahead_and_then_into_the_lane_of_the_ego_vehicle() {
    let mut world = driven(&testing::straight(), 8.0, 5.0);
    let own = spawn(&mut world, request(Verb::DriveAhead, 50.0, 10.0));
    assert!((distance_m(&world.ego_outline(), &own.outline) - 50.0).abs() < 1e-6);
    assert!((own.velocity_mps.x - 10.0).abs() < 1e-9);
    let beside =
        SpawnRequest { lane: LaneChoice::Right, then: Then::Change, ..request(Verb::DriveAhead, 12.0, 10.0) };
    let beside = spawn(&mut world, beside);
    assert!((beside.outline.pose.position.y + 5.25).abs() < 1e-9);
    let mut sideways_mps: f64 = 0.0;
    for _ in 0..400 {
        world.tick(&hold(&world, 8.0));
        let now = world.obstacle(beside.id).expect("it drives on");
        sideways_mps = sideways_mps.max(now.velocity_mps.y);
    }
    assert!((y_m(&world, beside.id) + 1.75).abs() < 1e-6);
    assert!((1.7..1.8 + 1e-6).contains(&sideways_mps), "{sideways_mps}");
    assert!(distance_m(&world.ego_outline(), &world.obstacle(beside.id).unwrap().outline) > 12.0);
}

#[test]
fn impossible_spawns_are_refused() {
    let world = driven(&testing::straight(), 8.0, 5.0);
    let ahead = request(Verb::DriveAhead, 50.0, 10.0);
    for speed_mps in [f64::NAN, f64::INFINITY, -0.1, 70.1, 1e300] {
        let refusal = world.survey(&SpawnRequest { speed_mps, ..ahead }).expect_err("no such speed");
        assert_eq!(refusal, format!("the spawn's speed is {speed_mps} m/s, possible is 0 .. 70 m/s"));
    }
    for distance_m in [f64::NAN, f64::INFINITY, -30.1, 1000.1, 1e300] {
        let refusal = world.survey(&SpawnRequest { distance_m, ..ahead }).expect_err("no such distance");
        assert_eq!(refusal, format!("the spawn's distance is {distance_m} m, possible is -30 .. 1000 m"));
    }
    let behind = SpawnRequest { verb: Verb::DriveOpposite, distance_m: -0.1, ..ahead };
    let refusal = world.survey(&behind).expect_err("no such distance");
    assert_eq!(refusal, "the spawn's distance is -0.1 m, possible is 0 .. 1000 m");
    for distance_m in [-2.0, -20.0] {
        let beside = SpawnRequest { distance_m, ..ahead };
        let refusal = world.survey(&beside).expect_err("the lane is the ego vehicle's own");
        assert_eq!(refusal, "in the ego vehicle's own lane nobody begins beside it");
    }
    // Every body may follow a trajectory, and this road has none.
    let follows = SpawnRequest { verb: Verb::Follow, ..ahead };
    assert_eq!(world.survey(&follows).expect_err("no such way"), "it follows no trajectory");
    for verb in Verb::ALL.iter().filter(|verb| **verb != Verb::Follow) {
        let on_foot = verb.is_on_foot();
        let body = if on_foot { Body::SUV } else { Body::Pedestrian };
        let refusal = world.survey(&SpawnRequest { verb: *verb, body, ..ahead }).expect_err("no such body");
        assert_eq!(
            refusal,
            if on_foot {
                "only pedestrians and animals walk"
            } else {
                "pedestrians, animals and objects do not drive"
            }
        );
    }
}

#[test]
fn refusals_say_why() {
    let mut world = driven(&testing::straight(), 8.0, 5.0);
    let refused =
        |world: &World, request: SpawnRequest| world.survey(&request).expect_err("it is impossible");
    let left = SpawnRequest { lane: LaneChoice::Left, ..request(Verb::DriveAhead, 12.0, 10.0) };
    assert_eq!(refused(&world, left), "no lane on the left");
    assert_eq!(
        refused(&world, request(Verb::DriveAhead, 900.0, 10.0)),
        "the route ends before that distance"
    );
    let crossing = request(Verb::CrossRoad, 12.0, 10.0);
    assert_eq!(refused(&world, crossing), "no crossing leg from the right within 60 m");
    spawn(&mut world, request(Verb::Stand, 40.0, 1.0));
    assert_eq!(refused(&world, request(Verb::Stand, 40.2, 1.0)), "npc#1 is nearer than 0.5 m");
    let driver = request(Verb::DriveAhead, 30.0, 20.0);
    let said = refused(&world, driver);
    assert!(said.starts_with("npc#1 is too near ahead in its lane: "), "{said}");
}

#[test]
fn overtakes_and_cuts_in() {
    for lane in [LaneChoice::Right, LaneChoice::Current] {
        let mut world = driven(&testing::straight(), 8.0, 8.0);
        let passing = SpawnRequest { lane, then: Then::Change, ..request(Verb::Overtake, 12.0, 14.0) };
        let passing = spawn(&mut world, passing);
        assert!(passing.outline.pose.position.x < world.ego_outline().pose.position.x - 12.0);
        assert_eq!(drive(&mut world, 8.0, 15.0), []);
        let now = world.obstacle(passing.id).expect("it drives on");
        assert!(now.outline.pose.position.x > world.ego_outline().pose.position.x + 10.0, "{lane:?}");
        assert!((now.outline.pose.position.y + 1.75).abs() < 1e-6, "{lane:?}");
    }
}

#[test]
fn does_not_come_where_it_cannot_pass() {
    let world = driven(&testing::crossing(), 8.0, 6.0);
    let refusal = world.survey(&request(Verb::Overtake, 15.0, 12.0)).expect_err("there is one lane");
    assert_eq!(refusal, "no lane beside it to change to");
    let refusal = world.survey(&request(Verb::Overtake, 15.0, 7.0)).expect_err("it is too slow");
    assert_eq!(refusal, "it would be no faster than the ego vehicle");
}

#[test]
fn comes_towards_in_the_inner_opposing_lane() {
    for then in [Then::Keep, Then::Change] {
        let mut world = driven(&testing::straight(), 8.0, 5.0);
        let towards = SpawnRequest { then, ..request(Verb::DriveOpposite, 50.0, 12.0) };
        let towards = spawn(&mut world, towards);
        assert!(towards.velocity_mps.x < -11.9);
        let begin_m = if then == Then::Keep { 1.75 } else { 5.25 };
        assert!((towards.outline.pose.position.y - begin_m).abs() < 1e-9);
        assert_eq!(drive(&mut world, 8.0, 6.0), []);
        assert!((y_m(&world, towards.id) - 1.75).abs() < 1e-6);
    }
}

#[test]
fn crosses_when_the_ego_vehicle_is_there() {
    // A vehicle that changes lanes first needs a longer way before the junction.
    for (then, begin_m) in [(Then::Keep, 150.0), (Then::Change, 110.0)] {
        let start = Start { signal_phase_s: 10.0, ..testing::start() };
        let mut world = World::new(testing::crossing(), &start);
        while world.ego_station_m() < begin_m {
            world.tick(&hold(&world, 13.5));
        }
        let across = SpawnRequest { then, ..request(Verb::CrossRoad, 30.0, 10.0) };
        // Its light is green from 7 to 19 s.
        assert!((7.0..15.0).contains(&world.time_s()));
        let across = spawn(&mut world, across);
        assert!(across.velocity_mps.y > 9.9);
        let contacts = drive(&mut world, 13.5, 9.0);
        assert_eq!(contacts.len(), 1, "{then:?}");
        assert!(contacts[0].closing_speed_mps > 5.0);
    }
}

#[test]
fn a_red_light_stops_and_refuses() {
    let mut world = driven(&testing::crossing(), 12.0, 4.0);
    // The light of the ego vehicle is green until 12 s, so the other one's is red.
    while world.ego_station_m() < 145.0 {
        drive(&mut world, 12.0, 0.1);
    }
    let across = request(Verb::CrossRoad, 25.0, 10.0);
    assert_eq!(world.survey(&across).expect_err("its light is red"), "its signal will not be green");

    let mut world = World::new(testing::crossing(), &Start { signal_phase_s: 15.0, ..testing::start() });
    let ahead = spawn(&mut world, request(Verb::DriveAhead, 60.0, 12.0));
    drive(&mut world, 3.0, 15.0);
    let stopped = world.obstacle(ahead.id).expect("it waits");
    assert!(stopped.velocity_mps.norm() < 0.2);
    let front_m = stopped.outline.pose.position.x + stopped.outline.half_length_m;
    assert!((281.0..285.0).contains(&front_m), "{front_m}");
}

#[test]
fn a_pedestrian_run_over_is_one_contact() {
    let mut world = driven(&testing::straight(), 15.0, 10.0);
    let standing = spawn(&mut world, request(Verb::Stand, 40.0, 1.0));
    let before_mps = world.ego().speed_mps;
    let contacts = drive(&mut world, 15.0, 6.0);
    assert_eq!(contacts.len(), 1);
    let contact = contacts[0];
    assert_eq!(contact.obstacle, standing.id);
    assert!((contact.on_ego.x - 2.35).abs() < 0.01, "{contact:?}");
    assert!((contact.closing_speed_mps - before_mps).abs() < 0.5);
    // It stays where it is while the ego vehicle would see it leave.
    let there = *world.obstacle(standing.id).expect("it lies behind the ego vehicle");
    assert!(there.distance_m > 10.0 && there.velocity_mps == Vec2::zeros());
    while world.obstacle(standing.id).is_some() {
        assert_eq!(drive(&mut world, 15.0, 0.1), []);
    }
    assert!((there.outline.pose.position - world.ego_outline().pose.position).norm() > 120.0);
}

#[test]
fn a_pedestrian_crosses_the_whole_road_and_leaves_out_of_sight() {
    let mut world = testing::world(&testing::straight());
    let walker = SpawnRequest { body: Body::Pedestrian, side: Side::Left, ..request(Verb::Walk, 40.0, 1.4) };
    let walker = spawn(&mut world, walker);
    assert!((walker.outline.pose.position.y - 7.75).abs() < 0.03);
    drive(&mut world, 0.0, 20.0);
    assert!(y_m(&world, walker.id) < -15.7, "8 m beyond the other kerb");
    drive(&mut world, 0.0, 20.0);
    assert!(world.obstacle(walker.id).is_some(), "it is in sight");
    drive(&mut world, 13.0, 20.0);
    assert_eq!(world.obstacle(walker.id), None);
}

#[test]
fn a_pedestrian_meets_the_ego_vehicle() {
    let mut met = 0;
    for seed in 0..20 {
        let mut world = World::new(testing::straight(), &Start { seed, ..testing::start() });
        drive(&mut world, 13.8, 12.0);
        spawn(&mut world, request(Verb::Walk, 100.0, 1.4));
        met += drive(&mut world, 13.8, 9.0).len();
    }
    // All but some of those that see a vehicle come.
    assert!(met >= 11, "{met}");
}

#[test]
fn a_pedestrian_steps_out_from_behind_a_parked_vehicle() {
    let mut world = driven(&testing::straight(), 10.0, 6.0);
    let hidden = SpawnRequest { cover: Some(Body::BoxTruck), ..request(Verb::Walk, 60.0, 1.4) };
    let facts = world.survey(&hidden).expect("there is room");
    let walker = world.apply(&Effect::Spawn(hidden)).expect("there is room").expect("it has an id");
    let parked = *world.obstacle(walker + 1).expect("the truck came with it");
    assert_eq!(facts.spawn_gap_m, parked.distance_m);
    assert!(facts.safety_gap_m > 10.0 && facts.safety_gap_m < 30.0, "{facts:?}");
    assert!((parked.outline.pose.position.y + 7.0 + 0.2 + 1.2).abs() < 0.03, "{parked:?}");
    let visible = |world: &World| {
        let sensed = world.sensed();
        sensed.objects.iter().find(|object| object.id == walker).expect("it is in range").visible_fraction
    };
    assert_eq!(visible(&world), 0.0);
    while y_m(&world, walker) < -6.5 {
        assert!(world.time_s() < 30.0);
        drive(&mut world, 4.0, 0.1);
    }
    assert_eq!(visible(&world), 1.0);
    // The truck stays where it is.
    assert_eq!(world.obstacle(walker + 1).map(|truck| truck.outline), Some(parked.outline));
    let driver = SpawnRequest { cover: Some(Body::SUV), ..request(Verb::DriveAhead, 90.0, 5.0) };
    assert!(world.survey(&driver).is_err_and(|why| why.starts_with("only a pedestrian")));
}

#[test]
fn a_wall_hides_who_is_behind_it_up_to_its_height() {
    for (height_m, shown) in [(2.5, 0.0), (1.05, 0.4)] {
        let mut world = testing::world(&testing::straight());
        let changes = Changes {
            length_m: Some(12.0),
            width_m: Some(0.3),
            height_m: Some(height_m),
            ..Changes::default()
        };
        let shape = parameters(Body::Object).changed(&changes);
        let stands = |body, distance_m, offset_m: f64| {
            let stands = SpawnRequest { body, ..request(Verb::Stand, distance_m, 0.0) };
            testing::told(stands, Field::Offset, offset_m)
        };
        let wall = stands(Body::Object, 40.0, -5.0);
        spawn(&mut world, SpawnRequest { own: Some(OwnBody { index: 0, shape }), ..wall });
        let hidden = spawn(&mut world, stands(Body::Pedestrian, 51.0, -6.2)).id;
        let sensed = world.sensed();
        let seen = sensed.objects.iter().find(|object| object.id == hidden).expect("it is in range");
        assert!((seen.visible_fraction - shown).abs() < 1e-9, "{height_m} m: {}", seen.visible_fraction);
    }
}

#[test]
fn a_pedestrian_without_a_way_on_turns_round() {
    let mut world = testing::world(&testing::straight());
    let parked =
        spawn(&mut world, SpawnRequest { lane: LaneChoice::Right, ..request(Verb::DriveAhead, 40.0, 0.0) });
    let walker = spawn(&mut world, request(Verb::Walk, 42.15, 1.0));
    drive(&mut world, 0.0, 8.0);
    let blocked_m = y_m(&world, walker.id);
    assert!((-7.5..-6.2).contains(&blocked_m), "{blocked_m}");
    drive(&mut world, 0.0, 12.0);
    assert!((y_m(&world, walker.id) + 7.75).abs() < 0.03, "{}", y_m(&world, walker.id));
    assert!(distance_m(&parked.outline, &world.obstacle(walker.id).unwrap().outline) > 1.0);
}

#[test]
fn an_eleventh_comes_when_one_of_the_ten_can_leave_unseen() {
    let mut world = testing::world(&testing::straight());
    for i in 0..10 {
        let walks = request(Verb::Walk, 10.0 * f64::from(i + 1), 1.0);
        spawn(&mut world, SpawnRequest { side: Side::ALL[i as usize % 2], ..walks });
    }
    let eleventh = request(Verb::Stand, 115.0, 1.0);
    assert_eq!(world.survey(&eleventh), Err("ten road users are there already".into()));
    assert!(world.apply(&Effect::Spawn(eleventh)).is_err());
    assert_eq!(world.obstacles().len(), 10);
    // In thick fog the ego vehicle sees 50 m: the oldest beyond is the sixth.
    world.apply(&Effect::Sky(Phenomenon::Fog, Level::High)).expect("the sky obeys");
    spawn(&mut world, eleventh);
    let ids: Vec<u32> = world.obstacles().map(|obstacle| obstacle.id).collect();
    assert_eq!(ids, [1, 2, 3, 4, 6, 7, 8, 9, 10, 11]);
}

/// A world in which everything that can be spawned was asked for.
fn busy_world(scene: &Arc<Scene>, seed: u64) -> World {
    let ambient = (seed % 7) as u32;
    let mut world = World::new(Arc::clone(scene), &Start { seed, ambient, ..testing::start() });
    drive(&mut world, 10.0, 6.0);
    let mut k = seed as usize;
    for verb in [Verb::DriveAhead, Verb::Overtake, Verb::DriveOpposite, Verb::CrossRoad, Verb::Walk] {
        for lane in [LaneChoice::Current, LaneChoice::Right] {
            k += 1;
            let request = SpawnRequest {
                body: if verb == Verb::Walk { Body::Pedestrian } else { Body::ALL[k % 6] },
                lane,
                then: Then::ALL[k % 2],
                side: Side::ALL[k % 2],
                ..request(verb, 15.0 + 2.0 * k as f64, 12.0)
            };
            // Some do not fit, which is no matter here.
            let _refusal = world.apply(&Effect::Spawn(request));
        }
    }
    world
}

fn scenes() -> [Arc<Scene>; 3] {
    [testing::straight(), testing::crossing(), testing::corner()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn drivers_do_not_run_into_each_other(seed in 0_u64..1000, road in 0..3) {
        let mut world = busy_world(&scenes()[road as usize], seed);
        world.apply(&Effect::Sky(Phenomenon::Wetness, Level::Moderate)).expect("the sky obeys");
        let mut met = Vec::new();
        // The ego vehicle brakes: those behind must, too.
        for _ in 0..1000 {
            let speed_mps = if world.time_s() < 10.0 { 10.0 } else { 0.0 };
            let before: Vec<Obstacle> = world.obstacles().copied().collect();
            world.tick(&hold(&world, speed_mps));
            for was in before.iter().filter(|was| was.verb != Verb::Walk) {
                let Some(now) = world.obstacle(was.id) else { continue };
                let now_met = world.incidents().iter().map(|incident| (incident.obstacle, incident.other));
                if now_met.chain(met.iter().copied()).any(|(a, b)| a == was.id || b == was.id) {
                    continue; // An impact moves it.
                }
                // No vehicle jumps, neither between lanes nor half-way through a lane change.
                let moved = now.outline.pose.position - was.outline.pose.position;
                prop_assert!((moved - now.velocity_mps * DT_S).norm() < 0.02, "{was:?} {now:?}");
                let turned = wrap_angle(now.outline.pose.heading_rad - was.outline.pose.heading_rad);
                prop_assert!(turned.abs() < 0.06, "{was:?} {now:?}");
            }
            met.extend(world.incidents().iter().map(|incident| (incident.obstacle, incident.other)));
            for (i, a) in world.obstacles().enumerate() {
                for b in world.obstacles().skip(i + 1) {
                    let told = met.contains(&(a.id, b.id)) || met.contains(&(b.id, a.id));
                    prop_assert!(told || distance_m(&a.outline, &b.outline) > 0.0, "{a:?} {b:?}");
                }
            }
        }
    }

    /// With all road users under way, in a changing sky: a clone of any moment drives on as its original.
    #[test]
    fn a_branch_of_any_moment_goes_on_alike(seed in 0_u64..1000, road in 0..3, moment in 1_u32..900, turn in 0..4) {
        let mut world = busy_world(&scenes()[road as usize], seed);
        let level = Level::ALL[turn as usize];
        let sky = [Effect::Sky(Phenomenon::Rain, level), Effect::Sky(Phenomenon::Fog, Level::Light)];
        for _ in 0..moment {
            world.tick(&hold(&world, 9.0));
        }
        let mut branch = world.clone();
        let go_on = |world: &mut World| {
            let mut met = Vec::new();
            for tick in 0..400 {
                if tick == 50 {
                    for effect in &sky {
                        world.apply(effect).expect("the sky obeys");
                    }
                    // Some do not fit, which is no matter here.
                    let _refusal = world.apply(&Effect::Spawn(request(Verb::DriveAhead, 40.0, 10.0)));
                }
                met.extend_from_slice(world.tick(&hold(world, 7.0)));
            }
            (met, digest(world), world.sensed())
        };
        prop_assert_eq!(go_on(&mut world), go_on(&mut branch));
    }
}

#[test]
fn an_unsignalled_crossing_flows() {
    let start = Start { ambient: 14, ..testing::start() };
    let mut world = World::new(testing::four_arms(), &start);
    let mut stood: std::collections::BTreeMap<u32, (u32, u32)> = std::collections::BTreeMap::new();
    let mut passed = std::collections::BTreeSet::new();
    for _ in 0..9000 {
        world.tick(&Control { brake_pct: 100.0, ..Control::default() });
        assert_eq!(world.incidents(), []);
        for obstacle in world.obstacles() {
            let pose = obstacle.outline.pose;
            // Vehicles behind the standing ego vehicle stand too.
            if pose.position.x < -100.0 && pose.position.y < 0.0 {
                continue;
            }
            let (now, most) = stood.entry(obstacle.id).or_default();
            *now = if obstacle.velocity_mps.norm() < 0.1 { *now + 1 } else { 0 };
            *most = (*most).max(*now);
            if pose.forward().dot(&pose.position) > 10.0 {
                passed.insert(obstacle.id);
            }
        }
    }
    let longest_s = f64::from(stood.values().map(|(_, most)| *most).max().unwrap_or(0)) * DT_S;
    assert!(longest_s < 15.0, "a vehicle stood for {longest_s} s");
    assert!(passed.len() > 60, "{} passed in 180 s", passed.len());
}

#[test]
fn no_vehicle_changes_lanes_across_a_median() {
    let world = driven(&testing::divided(), 8.0, 5.0);
    for (verb, lane) in [
        (Verb::DriveAhead, LaneChoice::Current),
        (Verb::DriveAhead, LaneChoice::Right),
        (Verb::Overtake, LaneChoice::Right),
    ] {
        let wish = SpawnRequest { lane, then: Then::Change, ..request(verb, 15.0, 10.0) };
        let refusal = world.survey(&wish).expect_err("there is no way over");
        assert!(refusal.starts_with("no lane ") || refusal.starts_with("no room "), "{refusal}");
    }
    // A vehicle that would have to pass does not appear either.
    world.survey(&request(Verb::Overtake, 15.0, 12.0)).expect_err("there is no way past");
}

#[test]
fn a_crosser_that_cannot_go_on_does_not_vanish_in_sight() {
    let mut world = World::new(testing::crossing(), &Start { signal_phase_s: 10.0, ..testing::start() });
    while world.ego_station_m() < 150.0 {
        world.tick(&hold(&world, 15.0));
    }
    let across = spawn(&mut world, request(Verb::CrossRoad, 25.0, 10.0));
    // The ego vehicle stops on the crossing and stays there.
    while world.time_s() < 60.0 {
        let before_m = 198.0 - world.ego_station_m();
        let ego_mps = world.ego().speed_mps;
        let brakes = before_m < ego_mps * ego_mps / 11.0;
        let control =
            if brakes { Control { brake_pct: 100.0, ..Control::default() } } else { hold(&world, 15.0) };
        world.tick(&control);
    }
    let stands = world.obstacle(across.id).expect("it is in sight");
    assert!(stands.distance_m < 20.0 && stands.velocity_mps.norm() < 0.1, "{stands:?}");
}

#[test]
fn who_takes_its_right_does_not_save_an_ego_vehicle_that_runs_a_red_light() {
    let crashes = |traffic: TrafficProfile, keeps_lights: bool| {
        let crashes = |seed: u64| {
            // Lights change every few seconds; the ego vehicle comes to them at any moment of the cycle.
            let start = Start { seed, signal_phase_s: seed as f64, ambient: 12, traffic, ..testing::start() };
            let mut world = World::new(testing::crossing(), &start);
            let mut has_crashed = false;
            while world.time_s() < 60.0 && !has_crashed {
                let line_m = world.scene().route.stop_lines[0].station_m - world.moment_facts().ego_front_m;
                let speed_mps = world.ego().speed_mps;
                let stops = keeps_lights
                    && world.moment_facts().ego_light != Light::Green
                    && (0.0..speed_mps * speed_mps / 4.0 + 2.0).contains(&line_m);
                let contacts = world.tick(&if stops {
                    Control { brake_pct: 60.0, ..Control::default() }
                } else {
                    hold(&world, 12.0)
                });
                // Only crossing road users count: an ego vehicle that ignores others rams a vehicle that drives ahead.
                has_crashed = contacts.iter().any(|contact| contact.obstacle_velocity_mps.y.abs() > 1.0);
            }
            has_crashed
        };
        (0..40).filter(|seed| crashes(*seed)).count()
    };
    let rightful = TrafficProfile::shipped("rightful").expect("it is shipped");
    let [saved, taken] = [TrafficProfile::default(), rightful].map(|traffic| crashes(traffic, false));
    assert!(taken >= saved + 5, "{saved} with those who save it, {taken} with those who do not");
    let [saved, taken] = [TrafficProfile::default(), rightful].map(|traffic| crashes(traffic, true));
    assert!(taken <= saved + 1, "who keeps to the lights is not run into: {saved}, {taken}");
}

#[test]
fn a_vehicle_that_appears_in_plain_view_leaves_time_to_notice() {
    let mut world = driven(&testing::straight(), 12.0, 10.0);
    // Faster than the ego vehicle, so no brakes are needed; but it was not there a moment ago.
    let wish = request(Verb::DriveAhead, 10.0, 20.0);
    let facts = world.survey(&wish).expect("there is room");
    assert!((facts.safety_gap_m - 1.15 * world.ego().speed_mps).abs() < 1e-9, "{facts:?}");
    // Behind a bus that is there already it is not seen to come.
    let bus = SpawnRequest { body: Body::SchoolBus, ..request(Verb::DriveAhead, 4.0, 20.0) };
    spawn(&mut world, bus);
    let hidden = SpawnRequest { body: Body::Hatchback, ..request(Verb::DriveAhead, 40.0, 20.0) };
    assert_eq!(world.survey(&hidden).expect("there is room").safety_gap_m, 0.0);
}

#[test]
fn rain_makes_the_road_slippery_in_time() {
    let mut world = testing::world(&testing::straight());
    world.apply(&Effect::Sky(Phenomenon::Rain, Level::High)).expect("the sky obeys");
    assert_eq!(world.conditions().friction, 0.85);
    drive(&mut world, 0.0, 60.0);
    assert!((0.55..0.62).contains(&world.conditions().friction), "{:?}", world.conditions());
    let water_mm = world.conditions().water_mm;
    for phenomenon in [Phenomenon::Rain, Phenomenon::Wetness] {
        world.apply(&Effect::Sky(phenomenon, Level::None)).expect("the sky obeys");
    }
    assert_eq!(world.conditions().water_mm, water_mm);
    drive(&mut world, 0.0, 144.0);
    let left = world.conditions().water_mm / water_mm;
    assert!((0.30..0.37).contains(&left), "after the time constant a third is left: {left}");
}

#[test]
fn ambient_traffic_is_there_and_comes_from_afar() {
    let mut world = World::new(testing::corner(), &Start { ambient: 6, ..testing::start() });
    assert!(world.obstacles().len() >= 4, "{}", world.obstacles().len());
    let mut known: Vec<u32> = world.obstacles().map(|obstacle| obstacle.id).collect();
    let mut newcomers = 0;
    while !world.arrived() {
        world.tick(&hold(&world, 7.0));
        assert!(world.obstacles().len() <= 6);
        for obstacle in world.obstacles() {
            assert!(obstacle.is_ambient());
            if !known.contains(&obstacle.id) {
                known.push(obstacle.id);
                newcomers += 1;
                assert!(obstacle.distance_m > 110.0, "{obstacle:?}");
            }
        }
    }
    assert!(newcomers > 0);
    // It asks for nothing of what actions draw.
    let commanded = spawn(&mut world, request(Verb::Stand, 15.0, 1.0));
    assert_eq!(commanded.id, 1);
}

#[test]
fn drivers_seldom_run_into_each_other() {
    let mut met = 0;
    for scene in scenes() {
        for seed in 0..100 {
            let mut world = busy_world(&scene, seed);
            for _ in 0..1500 {
                world.tick(&hold(&world, 8.0));
                let drives = |id| world.obstacle(id).is_some_and(|obstacle| obstacle.verb != Verb::Walk);
                let of_drivers = |incident: &&Incident| drives(incident.obstacle) && drives(incident.other);
                met += world.incidents().iter().filter(of_drivers).count();
            }
        }
    }
    // Counts all 300 worlds, whose vehicles (up to ten each) were placed without regard to what comes.
    assert!(met <= 5, "{met}");
}

#[test]
fn every_verb_has_its_place_on_road_2() {
    let scene = testing::corner();
    let mut found = Vec::new();
    for phase_s in [0.0, 17.0] {
        let mut world =
            World::new(Arc::clone(&scene), &Start { signal_phase_s: phase_s, ..testing::start() });
        while !world.arrived() {
            drive(&mut world, 7.0, 1.0);
            for verb in Verb::ALL {
                for (lane, side, then) in [
                    (LaneChoice::Current, Side::Left, Then::Keep),
                    (LaneChoice::Current, Side::Left, Then::Change),
                    (LaneChoice::Left, Side::Right, Then::Keep),
                    (LaneChoice::Right, Side::Right, Then::Change),
                ] {
                    let wish = SpawnRequest { lane, side, then, ..request(*verb, 20.0, 11.0) };
                    let kind = (*verb, lane, side, then);
                    if world.survey(&wish).is_ok() && !found.contains(&kind) {
                        found.push(kind);
                    }
                }
            }
        }
        assert!(world.ego_offset_m().abs() < 0.1, "it drives on the route");
    }
    // Without a trajectory no road user follows one.
    assert_eq!(found.len(), 4 * (Verb::ALL.len() - 1), "{found:?}");
}
