//! Orders to road users beside the ego vehicle and along its route, against closed forms.

use std::sync::Arc;

use avastra_base::geometry::Path;
use avastra_lang::model::command::{Command, Told};
use avastra_lang::model::field::{IgnoredRules, Said};
use avastra_lang::model::vocabulary::{Field, LaneChoice, TrafficRule, Turning, Verb};
use avastra_lang::model::{Laid, Trajectory};

use crate::action::{Effect, OnTrajectory, OrderRequest, SpawnRequest, Surroundings};
use crate::scene::Scene;
use crate::sim::testing::{request, told};
use crate::sim::{DT_S, Obstacle, Start, VehicleParameters, World, testing};

use super::{drive, driven, hold, spawn};

fn named(request: SpawnRequest) -> SpawnRequest {
    SpawnRequest { bearer: Some(0), ..request }
}

fn order(world: &mut World, command: Command) {
    world
        .apply(&Effect::Order(OrderRequest { bearer: 0, command, phases: Told::NOTHING }))
        .expect("it obeys");
}

fn there(world: &World, id: u32) -> Obstacle {
    *world.obstacle(id).expect("it is there")
}

fn ego_front_m(world: &World) -> f64 {
    VehicleParameters::MKZ.front_m(world.ego_station_m())
}

#[test]
fn a_gap_to_the_ego_vehicle_is_kept_ahead_and_behind() {
    for (verb, gap) in [
        (Verb::DriveAhead, (Some(20.0), None)),
        (Verb::DriveAhead, (None, Some(1.5))),
        (Verb::DriveBehind, (Some(4.0), None)),
        (Verb::DriveBehind, (None, Some(0.7))),
    ] {
        let mut world = driven(&testing::straight(), 10.0, 8.0);
        let user = spawn(&mut world, named(request(verb, 16.0, 10.0)));
        let (value, second) = (gap.0.or(gap.1).expect("it is one of the two"), gap.1.is_some());
        let command = Command::default().with(Field::Keep, Said::Figure { value, second });
        order(&mut world, command);
        for (speed_mps, time_s) in [(10.0, 18.0), (8.0, 14.0), (6.0, 14.0)] {
            drive(&mut world, speed_mps, time_s);
            let now = there(&world, user.id);
            // The route begins at 0 m and is straight.
            let (front_m, rear_m) = (
                now.outline.pose.position.x + now.outline.half_length_m,
                now.outline.pose.position.x - now.outline.half_length_m,
            );
            let start_m = world.ego_outline().pose.position.x + world.ego_outline().half_length_m;
            let back_m = world.ego_outline().pose.position.x - world.ego_outline().half_length_m;
            let (gap_m, behind_mps) = match verb {
                Verb::DriveBehind => (back_m - front_m, now.velocity_mps.norm()),
                _ => (rear_m - start_m, world.ego().speed_mps),
            };
            let wanted_m = gap.0.unwrap_or_else(|| gap.1.expect("it is one of the two") * behind_mps);
            assert!((gap_m - wanted_m).abs() < 0.1, "{verb:?} {gap:?} at {speed_mps} m/s: {gap_m} m");
        }
        assert!(world.has_done(user.id, &command));
    }
}

#[test]
fn a_gap_to_another_one_is_the_same_whoever_appears_first() {
    let [follower, leader] = [0, 1];
    for order_of_spawns in [[leader, follower], [follower, leader]] {
        let mut world = driven(&testing::straight(), 10.0, 8.0);
        let mut ids = [0; 2];
        for who in order_of_spawns {
            let ahead_m = if who == leader { 70.0 } else { 40.0 };
            let appears = request(Verb::DriveAhead, ahead_m, 10.0);
            ids[who] = spawn(&mut world, SpawnRequest { bearer: Some(who), ..appears }).id;
        }
        let command = Command::default().with(Field::Keep, 10.0).with(Field::To, Said::Who(leader));
        order(&mut world, command);
        drive(&mut world, 10.0, 20.0);
        let [behind, ahead] = ids.map(|id| there(&world, id).outline);
        let between_m = ahead.pose.position.x - behind.pose.position.x;
        let gap_m = between_m - ahead.half_length_m - behind.half_length_m;
        assert!((gap_m - 10.0).abs() < 0.01, "{order_of_spawns:?}: {gap_m} m");
    }
}

#[test]
fn a_lane_change_that_is_broken_off_early_leads_back_and_no_farther() {
    for (out_mps, after_s, back_mps) in [(1.0, 0.7, 3.0), (0.6, 3.0, 3.0), (2.0, 0.1, 1.0)] {
        let mut world = driven(&testing::straight(), 8.0, 1.0);
        let user = spawn(&mut world, named(request(Verb::DriveAhead, 40.0, 8.0)));
        let told_to =
            |lane: LaneChoice, mps: f64| Command::default().with(Field::Lane, lane).with(Field::Aside, mps);
        order(&mut world, told_to(LaneChoice::Right, out_mps));
        drive(&mut world, 8.0, after_s);
        let left_m = there(&world, user.id).outline.pose.position.y;
        assert!((-5.25..-1.75).contains(&left_m), "{left_m} m: it is on its way");
        order(&mut world, told_to(LaneChoice::Current, back_mps));
        for _ in 0..700 {
            world.tick(&hold(&world, 8.0));
            let y_m = there(&world, user.id).outline.pose.position.y;
            assert!(y_m <= -1.75 + 1e-9, "{y_m} m is beyond the middle of the lane");
        }
        assert!((there(&world, user.id).outline.pose.position.y + 1.75).abs() < 1e-9);
    }
}

#[test]
fn who_keeps_a_short_gap_brakes_as_hard_as_it_must() {
    let mut world = driven(&testing::straight(), 15.0, 8.0);
    let user = spawn(&mut world, named(request(Verb::DriveBehind, 12.0, 15.0)));
    order(
        &mut world,
        Command::default()
            .with(Field::Keep, Said::Figure { value: 0.6, second: true })
            .with(Field::Speed, 20.0),
    );
    drive(&mut world, 15.0, 15.0);
    let contacts = drive(&mut world, 0.0, 10.0);
    assert!(contacts.is_empty(), "{contacts:?}");
    assert!(there(&world, user.id).velocity_mps.norm() < 0.1);
}

#[test]
fn somebody_is_at_a_place_so_much_before_the_ego_vehicle() {
    for early_s in [-1.0, 0.0, 1.5] {
        let mut world = driven(&testing::straight(), 10.0, 8.0);
        let lane = LaneChoice::Right;
        let user = spawn(&mut world, named(SpawnRequest { lane, ..request(Verb::DriveAhead, 10.0, 8.0) }));
        let place_m = ego_front_m(&world) + 100.0;
        let command =
            Command::default().with(Field::Early, early_s).with(Field::At, place_m).with(Field::Speed, 20.0);
        order(&mut world, command);
        let x_m = world.ego_outline().pose.position.x + world.ego_outline().half_length_m + 100.0;
        let (mut own_s, mut ego_s) = (None, None);
        while own_s.is_none() || ego_s.is_none() {
            world.tick(&hold(&world, 10.0));
            let (now, ego) = (there(&world, user.id), world.ego_outline());
            let passed =
                |front_m: f64, mps: f64| (front_m >= x_m).then(|| world.time_s() - (front_m - x_m) / mps);
            own_s = own_s
                .or(passed(now.outline.pose.position.x + now.outline.half_length_m, now.velocity_mps.norm()));
            ego_s = ego_s.or(passed(ego.pose.position.x + ego.half_length_m, world.ego().speed_mps));
        }
        let found_s = ego_s.expect("it came") - own_s.expect("it came");
        assert!((found_s - early_s).abs() < DT_S, "{early_s} s: {found_s} s");
        drive(&mut world, 10.0, DT_S);
        assert!(world.has_done(user.id, &command));
    }
}

#[test]
fn somebody_who_crosses_is_there_so_much_before_the_ego_vehicle() {
    for early_s in [-1.5, 0.0, 1.0] {
        let mut world = World::new(testing::crossing(), &Start { signal_phase_s: 10.0, ..testing::start() });
        while world.ego_station_m() < 150.0 {
            world.tick(&hold(&world, 13.5));
        }
        let user = {
            let ignores = IgnoredRules::of([TrafficRule::Ego]);
            spawn(&mut world, named(told(request(Verb::CrossRoad, 30.0, 10.0), Field::Ignores, ignores)))
        };
        let command = Command::default().with(Field::Early, early_s).with(Field::Speed, 20.0);
        order(&mut world, command);
        // Where the two straight ways cross.
        let cross = world.scene().route.path.position_at(world.scene().route.conflicts[0].station_m);
        let (mut own_s, mut ego_s) = (None, None);
        for _ in 0..1000 {
            let (now, ego) = (there(&world, user.id).outline, world.ego_outline());
            let own_m = (now.pose.position - cross).dot(&now.pose.forward()) + now.half_length_m;
            let ego_m = (ego.pose.position - cross).dot(&ego.pose.forward()) + ego.half_length_m;
            if own_m >= 0.0 && own_s.is_none() {
                own_s = Some(world.time_s() - own_m / there(&world, user.id).velocity_mps.norm());
            }
            if ego_m >= 0.0 && ego_s.is_none() {
                ego_s = Some(world.time_s() - ego_m / world.ego().speed_mps);
            }
            if own_s.is_some() && ego_s.is_some() {
                break;
            }
            world.tick(&hold(&world, 13.5));
        }
        let found_s = ego_s.expect("it came") - own_s.expect("it came");
        // At 0 s the two touch before both are there.
        assert!((found_s - early_s).abs() < DT_S || early_s == 0.0, "{early_s} s: {found_s} s");
    }
}

#[test]
fn nobody_is_early_where_ways_do_not_cross() {
    let mut world = driven(&testing::straight(), 10.0, 3.0);
    spawn(&mut world, named(request(Verb::DriveAhead, 30.0, 8.0)));
    let command = Command::default().with(Field::Early, 1.0);
    let order = OrderRequest { bearer: 0, command, phases: Told::NOTHING };
    let refusal = world.order_refusal(&order);
    assert_eq!(refusal.as_deref(), Some("its way does not cross the ego vehicle's ahead of it"));
    // It may be told to turn first.
    let command = command.with(Field::Turn, Turning::Left);
    assert_ne!(world.order_refusal(&OrderRequest { command, ..order }), refusal);
}

#[test]
fn pedestrians_walk_along_the_road_and_step_aside_when_told() {
    for (verb, forward) in [(Verb::WalkAhead, 1.0), (Verb::WalkOpposite, -1.0)] {
        let mut world = driven(&testing::straight(), 5.0, 8.0);
        let user = spawn(&mut world, named(told(request(verb, 80.0, 1.4), Field::Offset, -1.5)));
        let from = there(&world, user.id).outline.pose.position;
        assert!((user.velocity_mps.x - forward * 1.4).abs() < 1e-9);
        drive(&mut world, 1.0, 10.0);
        let way = there(&world, user.id).outline.pose.position - from;
        assert!((way.x - forward * 14.0).abs() < 1e-6 && way.y.abs() < 1e-6, "{verb:?} {way:?}");
        // Into the middle of the lane, at 1 m/s, and back again.
        let command = Command::default().with(Field::Offset, 0.0).with(Field::Aside, 1.0);
        order(&mut world, command);
        drive(&mut world, 1.0, 1.4);
        assert!(!world.has_done(user.id, &command));
        drive(&mut world, 1.0, 0.2);
        assert!(world.has_done(user.id, &command));
        let way = there(&world, user.id).outline.pose.position - from;
        assert!((way.y - 1.5).abs() < 1e-9, "{way:?}");
        order(&mut world, Command::default().with(Field::Speed, -2.0));
        let turns_at = there(&world, user.id).outline.pose.position;
        drive(&mut world, 1.0, 2.0);
        let back = there(&world, user.id).outline.pose.position - turns_at;
        assert!((back.x + forward * 4.0).abs() < 1e-6, "{back:?}");
        order(&mut world, Command::default().with(Field::Speed, 0.0));
        drive(&mut world, 1.0, 1.0);
        assert_eq!(there(&world, user.id).velocity_mps.norm(), 0.0);
    }
}

#[test]
fn a_pedestrian_who_waits_sets_out_after_that_time() {
    for waits_s in [0.0, 2.5] {
        let mut world = driven(&testing::straight(), 5.0, 8.0);
        let walker = told(request(Verb::Walk, 90.0, 1.4), Field::Waits, waits_s);
        let user = spawn(&mut world, walker);
        let from = user.outline.pose.position;
        drive(&mut world, 2.0, 5.0);
        let way_m = (there(&world, user.id).outline.pose.position - from).norm();
        assert!((way_m - 1.4 * (5.0 - waits_s)).abs() <= 1.4 * DT_S + 1e-9, "{waits_s} s: {way_m} m");
    }
}

#[test]
fn who_follows_a_trajectory_is_at_a_place_of_it_when_the_ego_vehicle_is_at_one_of_its_route() {
    let plain = testing::straight();
    let from = plain.route.path.pose_at(120.0).offset(0.0, -6.0).position;
    let to = plain.route.path.pose_at(120.0).offset(0.0, 14.0).position;
    let path = Path::through(&[from, to]).expect("a way");
    let heights_m = vec![0.0; path.points().len()];
    let mut scene = Scene::new(Arc::clone(&plain.map), plain.route.clone());
    scene.trajectories = vec![Some(Laid::OnMap(Arc::new(Trajectory { path, heights_m, turns: Vec::new() })))];
    let scene = Arc::new(scene);
    for (speed_mps, reach_m, steady_m) in [(2.0, 6.0, 3.0), (4.0, 9.0, 1.0), (1.0, 4.0, 0.0), (8.0, 9.0, 1.0)]
    {
        let mut world = World::new(Arc::clone(&scene), &Start { ego_mps: 10.0, ..testing::start() });
        let asked = SpawnRequest {
            trajectory: Some(OnTrajectory { index: 0, begins: None }),
            ..request(Verb::Follow, 0.0, 0.0)
        };
        let user = spawn(&mut world, named(asked)).id;
        let at_m = 110.0;
        let meets = Command::default().with(Field::Early, 0.0).with(Field::At, at_m);
        let meets = meets.with(Field::Reach, reach_m).with(Field::Steady, steady_m);
        order(&mut world, meets.with(Field::Speed, speed_mps));
        let mut last_mps = 0.0;
        while ego_front_m(&world) < at_m {
            world.tick(&hold(&world, 10.0));
            last_mps = there(&world, user).velocity_mps.norm();
        }
        let station_m = world.npc_facts(user).expect("it is there").station_m;
        // For 8 m/s after 8 m it would have to gain more than 3 m/s².
        let missed_s = world.late_s(user).expect("the ego vehicle has kept its speed");
        if speed_mps > 4.0 {
            assert!(
                (0.1..1.0).contains(&missed_s) && station_m < reach_m - 1.0,
                "{missed_s} s, at {station_m} m"
            );
            continue;
        }
        assert!(missed_s.abs() < 0.1, "{speed_mps}: {missed_s} s");
        // The ego vehicle is up to a tick beyond the place.
        let beyond_m = (ego_front_m(&world) - at_m) / 10.0 * speed_mps;
        assert!((station_m - beyond_m - reach_m).abs() < 0.05, "{reach_m}: at {station_m}");
        assert!((last_mps - speed_mps).abs() < 0.05, "{speed_mps}: {last_mps}");
    }
}
