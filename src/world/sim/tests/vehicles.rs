//! How other vehicles move: on bends, after a crash, at stop signs, by each traffic profile.

use avastra_lang::model::command::{Command, Told};
use avastra_lang::model::field::IgnoredRules;
use std::sync::Arc;

use crate::action::{Effect, OrderRequest, SpawnRequest, Surroundings};
use crate::scene::way::body_at;
use crate::sim::testing::request;
use crate::sim::{Control, DT_S, Scene, Start, TrafficProfile, World, testing};
use avastra_base::geometry::{OrientedBox, Path, Pose, Vec2, distance_m};
use avastra_lang::model::body::{self, BodyParameters};
use avastra_lang::model::vocabulary::{
    Body, Field, LaneChoice, Level, Phenomenon, Side, Then, TrafficRule, Verb, Word,
};

use super::{drive, driven, hold, spawn, y_m};

#[test]
fn a_bus_in_a_bend_keeps_its_tail_near_its_lane() {
    // How far the outline reaches beyond the sides that the widest part of it has on a straight way, m.
    let sweep_m = |radius_m: f64, pose_at: fn(&Path, f64, &BodyParameters) -> Pose| -> f64 {
        let arc = (0..=200).map(|i| {
            let turn_rad = f64::from(i) / 200.0 * core::f64::consts::PI;
            let (sin, cos) = libm::sincos(turn_rad);
            (Vec2::new(radius_m * sin, radius_m * (1.0 - cos)), turn_rad, 1.0 / radius_m)
        });
        let path = Path::new(arc).expect("it is a path");
        let bus = body::parameters(Body::SchoolBus);
        let pose = pose_at(&path, path.length_m() / 2.0, &bus);
        let outline = OrientedBox::new(pose, bus.length_m, bus.width_m);
        let centre = Vec2::new(0.0, radius_m);
        let far_m = outline.corners().iter().map(|corner| (corner - centre).norm()).fold(0.0, f64::max);
        far_m - radius_m - bus.width_m / 2.0
    };
    for (radius_m, most_m) in [(7.0, 1.25), (10.0, 1.0)] {
        let about_its_centre = sweep_m(radius_m, |path, station_m, _| path.pose_at(station_m));
        let on_its_axles = sweep_m(radius_m, |path, station_m, body| body_at(path, station_m, body).0);
        assert!(on_its_axles < most_m, "{on_its_axles}");
        assert!(on_its_axles < 0.8 * about_its_centre, "{on_its_axles} {about_its_centre}");
    }
}

#[test]
fn vehicles_that_touch_slide_to_rest_by_friction() {
    let mut world = driven(&testing::straight(), 8.0, 3.0);
    let (mut behind, mut ahead) =
        (request(Verb::DriveAhead, 30.0, 14.0), request(Verb::DriveAhead, 45.0, 14.0));
    behind.body = Body::SchoolBus;
    ahead.body = Body::Hatchback;
    let (behind, ahead) = (spawn(&mut world, behind), spawn(&mut world, ahead));
    // A pedestrian stands so near before the hatchback that it cannot stop.
    spawn(&mut world, request(Verb::Stand, 58.0, 1.0));
    let mut last = [behind, ahead];
    let mut crashes = 0;
    for _ in 0..500 {
        world.tick(&hold(&world, 0.0));
        let met = world.incidents().len();
        crashes += met;
        for was in &mut last {
            // The hatchback may leave while the bus hides it.
            let Some(&now) = world.obstacle(was.id) else { continue };
            let lost_mps = (now.velocity_mps - was.velocity_mps).norm();
            // Braking, or friction, or an impact with 75 kg; a bus that is heavier loses little in any.
            assert!(lost_mps < 0.2 + 3.0 * met as f64, "{was:?} {now:?}");
            *was = now;
        }
    }
    assert!(crashes > 0, "the hatchback touches the pedestrian");
    assert!(last.iter().all(|now| now.velocity_mps.norm() < 0.2));
}

#[test]
fn a_vehicle_that_is_asked_to_stand_stands_to_the_bit() {
    let mut world = testing::world(&testing::straight());
    let stands = spawn(&mut world, request(Verb::DriveAhead, 30.0, 0.0));
    for _ in 0..500 {
        world.tick(&hold(&world, 0.0));
        let now = world.obstacle(stands.id).expect("it stands in sight");
        assert_eq!((now.outline, now.velocity_mps), (stands.outline, Vec2::zeros()));
    }
    assert!(world.is_blocked(), "it will not go");
}

/// Speeds and ways of ordered changes of speed against closed forms: within a tick and 5 cm.
#[test]
fn an_order_changes_speed_at_its_rate() {
    let named = SpawnRequest { bearer: Some(7), ..request(Verb::DriveAhead, 60.0, 12.0) };
    for (speed_mps, rate_mps2) in [(0.0, 3.0), (4.0, 1.5), (0.0, 6.0), (14.0, 0.5)] {
        let mut world = driven(&testing::straight(), 8.0, 1.0);
        let user = spawn(&mut world, named);
        let command = Command::default().with(Field::Speed, speed_mps).with(Field::Rate, rate_mps2);
        let order = OrderRequest { bearer: 7, command, phases: Told::NOTHING };
        world.apply(&Effect::Order(order)).expect("it is there and drives");
        let from_m = user.outline.pose.position.x;
        let (mut ticks, mut now) = (0, user);
        while (now.velocity_mps.norm() - speed_mps).abs() > 1e-9 {
            world.tick(&hold(&world, 2.0));
            now = *world.obstacle(user.id).expect("it stays on the road");
            ticks += 1;
            assert!(ticks < 3_000, "{now:?}");
        }
        let change_mps: f64 = speed_mps - 12.0;
        let wanted_s = change_mps.abs() / rate_mps2;
        // Its velocity is the mean of a tick, so it arrives within the next one.
        assert!((f64::from(ticks) * DT_S - wanted_s).abs() < 1.5 * DT_S, "{ticks} ticks, {wanted_s} s");
        let way_m = now.outline.pose.position.x - from_m;
        let wanted_m = (speed_mps * speed_mps - 144.0).abs() / (2.0 * rate_mps2);
        let tick_m = speed_mps * DT_S;
        assert!((way_m - wanted_m).abs() <= 0.05 + tick_m, "{way_m} m, {wanted_m} m");
        // It keeps the speed that it was told to keep.
        drive(&mut world, 0.0, 2.0);
        let later = world.obstacle(user.id).expect("it stays on the road");
        assert!((later.velocity_mps.norm() - speed_mps).abs() < 1e-9, "{later:?}");
    }
}

#[test]
fn who_ignores_others_runs_into_the_one_ahead() {
    for (ignores, meets) in
        [(IgnoredRules::default(), false), (IgnoredRules::of([TrafficRule::Others]), true)]
    {
        let mut world = driven(&testing::straight(), 3.0, 1.0);
        spawn(&mut world, request(Verb::DriveAhead, 80.0, 2.0));
        spawn(&mut world, testing::told(request(Verb::DriveAhead, 30.0, 14.0), Field::Ignores, ignores));
        let mut has_met = false;
        for _ in 0..800 {
            world.tick(&hold(&world, 3.0));
            has_met |= !world.incidents().is_empty();
        }
        assert_eq!(has_met, meets, "{ignores:?}");
    }
}

#[test]
fn a_told_time_gap_is_kept_as_the_driver_model_has_it() {
    for gap_s in [0.3, 1.2, 2.5] {
        let mut world = driven(&testing::straight(), 5.0, 1.0);
        let leader = spawn(&mut world, request(Verb::DriveAhead, 120.0, 10.0));
        let named = SpawnRequest { bearer: Some(0), ..request(Verb::DriveAhead, 60.0, 10.0) };
        let follower = spawn(&mut world, named);
        let command = Command::default().with(Field::Speed, 20.0).with(Field::TimeGap, gap_s);
        world
            .apply(&Effect::Order(OrderRequest { bearer: 0, command, phases: Told::NOTHING }))
            .expect("it is there");
        drive(&mut world, 8.0, 32.0);
        let [ahead, behind] =
            [leader, follower].map(|user| world.obstacle(user.id).expect("it is there").outline);
        let gap_m = distance_m(&ahead, &behind);
        // IDM's gap at rest: s* / √(1 - (v/v0)⁴) at half of the wished speed.
        let wanted_m = (2.0 + 10.0 * gap_s) / (15.0_f64 / 16.0).sqrt();
        assert!((gap_m - wanted_m).abs() < 0.05 * wanted_m, "{gap_s} s: {gap_m} m, {wanted_m} m");
    }
}

#[test]
fn an_order_is_for_the_latest_bearer_and_no_wreck_obeys() {
    let mut world = driven(&testing::straight(), 8.0, 1.0);
    let order = OrderRequest {
        bearer: 0,
        command: Command::default().with(Field::Speed, 3.0),
        phases: Told::NOTHING,
    };
    assert_eq!(world.order_refusal(&order).as_deref(), Some("no road user of that name is there"));
    let named = |distance_m| SpawnRequest { bearer: Some(0), ..request(Verb::DriveAhead, distance_m, 9.0) };
    let [first, second] = [90.0, 60.0].map(|distance_m| spawn(&mut world, named(distance_m)).id);
    world.apply(&Effect::Order(order)).expect("it is there");
    drive(&mut world, 2.0, 6.0);
    let speed_mps = |world: &World, id| world.obstacle(id).expect("it is there").velocity_mps.norm();
    assert!((speed_mps(&world, second) - 3.0).abs() < 0.1 && speed_mps(&world, first) > 8.9);
    // The ego vehicle runs into it: a wreck only brakes.
    while world.tick(&hold(&world, 12.0)).is_empty() {}
    assert_eq!(world.order_refusal(&order).as_deref(), Some("it is a wreck"));
    let walker = SpawnRequest { bearer: Some(0), ..request(Verb::Stand, 40.0, 1.0) };
    spawn(&mut world, walker);
    assert_eq!(world.order_refusal(&order).as_deref(), Some("it stands, and does not walk"));
    let walker = SpawnRequest { bearer: Some(2), ..request(Verb::Walk, 50.0, 1.0) };
    spawn(&mut world, walker);
    let manoeuvre = OrderRequest { bearer: 2, command: Command::default(), phases: Told::BY_DRIVERS };
    assert_eq!(
        world.order_refusal(&manoeuvre).as_deref(),
        Some("it is on foot, and can be told a `speed` alone")
    );
    assert_eq!(world.order_refusal(&OrderRequest { phases: Told::NOTHING, ..manoeuvre }), None);
    let backwards = Command::default().with(Field::Speed, -1.0);
    let car = SpawnRequest { bearer: Some(1), ..request(Verb::DriveOpposite, 60.0, 9.0) };
    spawn(&mut world, car);
    let refusal = world.order_refusal(&OrderRequest { bearer: 1, command: backwards, phases: Told::NOTHING });
    assert_eq!(refusal.as_deref(), Some("it does not drive backwards"));
}

#[test]
fn what_has_a_name_makes_no_room() {
    let mut world = driven(&testing::straight(), 8.0, 1.0);
    let named = |who| SpawnRequest { bearer: Some(who), ..request(Verb::DriveOpposite, 30.0, 9.0) };
    let mut appeared = 0;
    while appeared < 10 {
        appeared += usize::from(world.apply(&Effect::Spawn(named(appeared))).is_ok());
        drive(&mut world, 8.0, 1.0);
        assert!(world.ticks() < 5_000, "{appeared} appeared");
        if world.obstacles().len() < appeared {
            return; // One drove off the map: there is room without anybody's leaving for it.
        }
    }
    let more = request(Verb::DriveOpposite, 30.0, 9.0);
    assert_eq!(world.survey(&more).err().as_deref(), Some("ten road users are there already"));
}

#[test]
fn a_lane_change_leads_past_what_stands_in_the_lane_before() {
    let mut world = testing::world(&testing::straight());
    let stands = spawn(&mut world, request(Verb::DriveAhead, 60.0, 0.0));
    let changes = SpawnRequest { then: Then::Change, ..request(Verb::DriveAhead, 20.0, 8.0) };
    let changes = spawn(&mut world, changes);
    drive(&mut world, 0.0, 15.0);
    let now = world.obstacle(changes.id).expect("it drives on");
    assert!(now.outline.pose.position.x > stands.outline.pose.position.x + 20.0, "{now:?}");
    assert!((now.outline.pose.position.y + 5.25).abs() < 1e-6, "{now:?}");
}

#[test]
fn an_overtaker_that_keeps_its_lane_comes_back_to_it_well_ahead() {
    let mut world = driven(&testing::straight(), 8.0, 8.0);
    let passing = spawn(&mut world, request(Verb::Overtake, 12.0, 14.0));
    // Where its rear is before the ego vehicle's front when it begins to come back, m.
    let mut begins_m = None;
    let mut most_aside_m: f64 = 0.0;
    for _ in 0..1200 {
        world.tick(&hold(&world, 8.0));
        let now = world.obstacle(passing.id).expect("it drives on");
        most_aside_m = most_aside_m.max(-1.75 - now.outline.pose.position.y);
        if most_aside_m > 3.4 && now.velocity_mps.y > 0.1 {
            begins_m = begins_m.or(Some(now.distance_m));
        }
    }
    let begins_m = begins_m.expect("it comes back");
    assert!((20.0..25.0).contains(&begins_m), "{begins_m}");
    assert!((y_m(&world, passing.id) + 1.75).abs() < 1e-6);
}

#[test]
fn vehicles_stand_at_a_stop_sign_before_they_cross() {
    let (none, stop) = ("274", "206");
    for (sign, stands) in [(stop, true), (none, false)] {
        let mut crossed = 0;
        for seed in 0..6 {
            let start = Start { seed, ambient: 12, ..testing::start() };
            let mut world = World::new(testing::crossing_of(none, sign), &start);
            // Ambient traffic is around the ego vehicle, which waits some way before the crossing.
            drive(&mut world, 8.0, 13.0);
            // The least speed of each vehicle while its front is within 5 m before the line, m/s.
            let mut least_mps = std::collections::BTreeMap::new();
            for _ in 0..4000 {
                world.tick(&Control { brake_pct: 100.0, ..Control::default() });
                for obstacle in world.obstacles().filter(|obstacle| obstacle.forward.y > 0.9) {
                    let front_m = obstacle.outline.pose.position.y + obstacle.outline.half_length_m;
                    let speed_mps = obstacle.velocity_mps.norm();
                    if front_m < -25.0 {
                        least_mps.insert(obstacle.id, f64::INFINITY);
                    }
                    // Only a vehicle whose whole approach was seen.
                    let Some(least): Option<&mut f64> = least_mps.get_mut(&obstacle.id) else { continue };
                    if (-20.0..-15.0).contains(&front_m) {
                        *least = least.min(speed_mps);
                    } else if front_m > 0.0 && least.is_finite() {
                        if stands {
                            // The velocity is the mean of a tick.
                            assert!(*least < 0.2, "{seed} {least}");
                        }
                        crossed += u32::from(*least > 1.0 || stands);
                        *least = f64::INFINITY;
                    }
                }
            }
        }
        assert!(crossed > 0, "{sign}");
    }
}

/// A world of another traffic profile.
fn released(scene: &Arc<Scene>) -> World {
    let traffic = TrafficProfile::shipped("released").expect("it is sound");
    World::new(Arc::clone(scene), &Start { traffic, ..testing::start() })
}

#[test]
fn released_vehicles_see_what_their_rays_meet_and_stop_at_once() {
    for ahead_m in [60.0, 20.0] {
        let mut world = released(&testing::straight());
        drive(&mut world, 8.0, 5.0);
        let ahead = spawn(&mut world, request(Verb::DriveAhead, 30.0, 12.0));
        spawn(&mut world, request(Verb::Stand, 30.0 + ahead_m, 1.0));
        let mut hardest_mps2: f64 = 0.0;
        let mut was_mps = 12.0;
        for _ in 0..500 {
            world.tick(&hold(&world, 0.0));
            let now_mps = world.obstacle(ahead.id).expect("it is in sight").velocity_mps.norm();
            hardest_mps2 = hardest_mps2.max((was_mps - now_mps) / DT_S);
            was_mps = now_mps;
        }
        assert!(was_mps < 0.1, "{was_mps}");
        // The wish is 4 to 8 1/s of 12 m/s; tyres give no more than this.
        assert!((7.0..=8.001).contains(&hardest_mps2), "{hardest_mps2}");
        assert_eq!(world.incidents(), []);
    }
}

#[test]
fn released_weather_rests_and_the_oldest_leaves_in_sight() {
    let mut world = released(&testing::straight());
    assert_eq!(world.weather_refusal(), None);
    world.apply(&Effect::Sky(Phenomenon::Rain, Level::Light)).expect("the sky obeys");
    assert!(world.weather_refusal().expect("it rests").contains("30 s"));
    drive(&mut world, 0.0, 29.9);
    assert!(world.weather_refusal().is_some());
    drive(&mut world, 0.0, 0.1);
    assert_eq!(world.weather_refusal(), None);
    for i in 0..11 {
        let walks = request(Verb::Walk, 10.0 * f64::from(i + 1), 1.0);
        spawn(&mut world, SpawnRequest { side: Side::ALL[i as usize % 2], ..walks });
    }
    let ids: Vec<u32> = world.obstacles().map(|obstacle| obstacle.id).collect();
    assert_eq!(ids, (2..=11).collect::<Vec<u32>>());
    let mut careful = testing::world(&testing::straight());
    careful.apply(&Effect::Sky(Phenomenon::Rain, Level::Light)).expect("the sky obeys");
    assert_eq!(careful.weather_refusal(), None);
}

#[test]
fn released_lane_changes_begin_beside_a_vehicle_that_the_sphere_misses() {
    // A vehicle in the own lane, a little behind: two metres and a second are not left, but the sphere is empty.
    for (profile, changes) in [("careful", false), ("released", true)] {
        let traffic = TrafficProfile::shipped(profile).expect("it is sound");
        let mut world = World::new(testing::straight(), &Start { traffic, ..testing::start() });
        drive(&mut world, 10.0, 8.0);
        let beside = SpawnRequest {
            lane: LaneChoice::Right,
            then: Then::Change,
            ..request(Verb::DriveAhead, 1.0, 10.0)
        };
        let beside = spawn(&mut world, beside);
        drive(&mut world, 10.0, 2.5);
        assert_eq!(y_m(&world, beside.id) > -5.2, changes, "{profile}");
    }
}

#[test]
fn ambient_vehicles_change_lanes_where_they_gain() {
    let count = |traffic: TrafficProfile| {
        let mut changed = std::collections::BTreeSet::new();
        for seed in 0..4 {
            let start = Start { seed, traffic, ambient: 10, ..testing::start() };
            let mut world = World::new(testing::straight(), &start);
            let mut lanes = std::collections::BTreeMap::new();
            for _ in 0..3000 {
                world.tick(&hold(&world, 5.0));
                assert_eq!(world.incidents(), []);
                for obstacle in world.obstacles() {
                    let lane = (obstacle.outline.pose.position.y / 3.5).floor() as i32;
                    if *lanes.entry(obstacle.id).or_insert(lane) != lane {
                        changed.insert((seed, obstacle.id));
                    }
                }
            }
        }
        changed.len()
    };
    assert!(count(TrafficProfile::default()) > 2);
    assert_eq!(count(TrafficProfile { mobil: false, ..TrafficProfile::default() }), 0);
}
