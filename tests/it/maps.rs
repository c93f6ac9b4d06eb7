//! Maps for a kind of place each (`tests/cases/maps`): how they are read, and that every driving system arrives there.

use std::sync::Arc;

use avastra::action::ActionTable;
use avastra::ads;
use avastra::episode::{End, StepLog};
use avastra::road::{LaneIndex, Precedence, RoadMap, Route};
use avastra::run::{Conditions, Run, RunSettings};
use avastra::sim::{Scene, SensedObject, Start, World};

use crate::cases::{expect_snapshot, root};
use crate::command::{avastra, fails, outcome};
use crate::drives::start;
use crate::world::space_at;

const PLACES: [&str; 7] =
    ["dead_end", "left_hand", "motorway", "overpass", "parking", "priority", "roundabout"];

/// Maps with something that readers of maps get wrong; their first line says what.
const ODD: [&str; 7] =
    ["limits_by_lane", "limits_by_type", "no_limit", "obstacle", "unlinked", "us_stop", "virtual_junction"];

fn path(file: &str) -> String {
    format!("tests/cases/maps/{file}")
}

fn map(place: &str) -> RoadMap {
    let text = std::fs::read_to_string(root().join(path(&format!("{place}.xodr")))).expect("it is there");
    RoadMap::from_opendrive(place, &text).expect("it is sound")
}

/// The lane of a road with one section.
fn lane(map: &RoadMap, road: &str, id: i32) -> LaneIndex {
    let found = map.lanes.iter().position(|lane| lane.key.road == road && lane.key.lane == id);
    LaneIndex(found.unwrap_or_else(|| panic!("no lane {id} of road {road}")))
}

#[test]
fn every_place_is_read_as_it_was_meant() {
    for place in PLACES.into_iter().chain(ODD) {
        let (status, stdout, stderr) = outcome(&mut avastra(&["road", &path(&format!("{place}.xodr"))]));
        assert_eq!((status, stderr.as_str()), (0, ""), "{place}");
        expect_snapshot("maps", place, &stdout);
    }
}

/// What a map says by stations holds there: limits, motorways and lanes for buses, from both sides of a section.
#[test]
fn limits_and_access_hold_where_the_map_says() {
    for file in ["limits_by_type", "limits_by_lane"] {
        let map = map(file);
        for (s_m, limit_kmh) in [(100.0, 100.0), (199.0, 100.0), (201.0, 30.0), (399.0, 30.0), (401.0, 100.0)]
        {
            let place = map.place("1", -1, s_m).expect("it is there");
            assert!((map.lane(place.lane).speed_limit_mps * 3.6 - limit_kmh).abs() < 1e-9, "{file} at {s_m}");
        }
        let place = |s_m| map.place("1", -1, s_m).expect("it is there");
        let route = Route::find(&map, place(10.0), place(590.0)).expect("there is a way");
        assert!((route.goal_m - 580.0).abs() < 1e-6 && route.lanes.len() == 3, "{file}");
    }
    // Where nothing changes, nothing is cut.
    let text = std::fs::read_to_string(root().join(path("limits_by_type.xodr"))).expect("it is there");
    let even =
        RoadMap::from_opendrive("even", &text.replace("max=\"30\"", "max=\"100\"")).expect("it is sound");
    assert_eq!(even.lanes.len(), 1);
    let text = std::fs::read_to_string(root().join(path("limits_by_lane.xodr"))).expect("it is there");
    let before = "<speed sOffset=\"0\"";
    let buses = "<access sOffset=\"0\" restriction=\"none\"/><access sOffset=\"300\" restriction=\"bus\"/>";
    let map = RoadMap::from_opendrive("buses", &text.replacen(before, &format!("{buses}{before}"), 1));
    let map = map.expect("it is sound");
    for (s_m, for_buses) in [(100.0, false), (299.0, false), (301.0, true), (500.0, true)] {
        let place = map.place("1", -1, s_m).expect("it is there");
        assert_eq!(map.lane(place.lane).for_buses, for_buses, "at {s_m}");
    }
}

/// Contacts of a drive with ambient traffic, and whether it arrives within 4 min.
fn drive(scene: &Arc<Scene>, entry: &ads::Entry, seed: u64, ambient: u32) -> (usize, bool) {
    let mut world = World::new(scene.clone(), &Start { ambient, ..start(seed) });
    let mut driver = (entry.build)(scene, seed);
    let mut sensed = world.sensed();
    let mut contacts = 0;
    while !world.arrived() && contacts == 0 && world.time_s() < 240.0 {
        world.sense(&mut sensed);
        contacts += world.tick(&driver.drive(&sensed)).len();
    }
    (contacts, world.arrived())
}

#[test]
fn every_driving_system_arrives_at_every_place() {
    for place in PLACES {
        for road in &space_at(&path(&format!("{place}.ava"))).roads {
            let scene = Arc::new(Scene::of(road));
            for entry in ads::seeing() {
                for seed in 0..3 {
                    let case = format!("{} on {place}, {}, seed {seed}", entry.name, road.name);
                    assert_eq!(drive(&scene, entry, seed, 0), (0, true), "{case}");
                }
            }
        }
    }
}

#[test]
fn traffic_on_a_bridge_is_seen_only_if_the_bridge_is_flat() {
    let text = std::fs::read_to_string(root().join(path("overpass.xodr"))).expect("it is there");
    let flat =
        text.lines().filter(|line| !line.contains("<elevationProfile>")).collect::<Vec<_>>().join("\n");
    // How often something is sensed that comes along the other road, and how many of some drives arrive.
    let seen = |text: &str| {
        let map = Arc::new(RoadMap::from_opendrive("overpass", text).expect("it is sound"));
        let place = |s_m| map.place("street", -1, s_m).expect("it is on the map");
        let route = Route::find(&map, place(100.0), place(500.0)).expect("there is a way");
        let scene = Arc::new(Scene::new(map, route));
        let (mut seen, mut arrived) = (0, 0);
        for seed in 0..6 {
            let mut world = World::new(scene.clone(), &Start { ambient: 30, seed, ..start(0) });
            let mut driver =
                ads::by_name("idm").map(|entry| (entry.build)(&scene, seed)).expect("it is known");
            let mut sensed = world.sensed();
            while !world.arrived() && world.time_s() < 120.0 {
                world.sense(&mut sensed);
                // What has passed and comes down the ramp is seen again.
                let comes = |object: &&SensedObject| {
                    let y_m = object.pose.position.y;
                    y_m.abs() > 10.0 && y_m * object.velocity_mps.y < 0.0
                };
                seen += sensed.objects.iter().filter(comes).count();
                world.tick(&driver.drive(&sensed));
            }
            arrived += usize::from(world.arrived());
        }
        (seen, arrived)
    };
    assert_eq!(seen(&text), (0, 6));
    assert!(seen(&flat).0 > 0, "the other road has no traffic");
}

#[test]
fn priority_records_say_who_goes_first() {
    let map = map("priority");
    let of = |road: &str| map.lane(lane(&map, road, -1)).precedence;
    for (road, expected) in [
        ("0-to-2", Precedence::Priority),
        ("2-to-1", Precedence::Priority),
        ("1-to-3", Precedence::Yield),
        ("3-to-0", Precedence::Yield),
    ] {
        assert_eq!(of(road), expected, "{road}");
    }
}

#[test]
fn where_a_street_ends_there_is_no_way_on() {
    let file = path("dead_end.xodr");
    let reason = "there is no way from lane -1 of road `street` to lane 1 of road `street`";
    fails(&["road", &file, "--from", "street/-1@10", "--to", "street/1@10"], reason);
}

#[test]
fn a_wait_at_a_red_light_is_no_stall() {
    // Two steps without progress would end these episodes, unless they are a wait for a light.
    let space = space_at(&path("red_light.ava"));
    let conditions = Conditions { ads: "idm".to_owned(), ..Conditions::of(&space) };
    let settings = RunSettings::new(conditions, "none", 12, 1);
    let run = Run::new(ActionTable::new(space), settings).expect("the settings are sound");
    let mut waits = 0;
    for number in 0..run.episodes() {
        let log = run.episode(number);
        assert_eq!(log.end, End::Arrived, "episode {number}");
        // Standing at the beginning of three steps, one after the other: two whole steps without progress.
        let stands = |step: &StepLog| step.state.last().is_some_and(|speed_mps| *speed_mps < 0.01);
        waits += log.steps.windows(3).filter(|pair| pair.iter().all(stands)).count();
    }
    assert!(waits > 0, "no episode met a light that was red for long");
}

#[test]
fn an_episode_that_no_goal_ends_ends_where_the_map_does() {
    let space = space_at(&path("no_goal.ava"));
    let way_m = space.roads[0].route.path.length_m();
    for entry in ["modular", "frenet", "reactive", "idm", "cc"] {
        let conditions = Conditions { ads: entry.to_owned(), ..Conditions::of(&space) };
        let settings = RunSettings::new(conditions, "none", 1, 1);
        let run = Run::new(ActionTable::new(space.clone()), settings).expect("the settings are sound");
        let log = run.episode(0);
        assert_eq!(log.end, End::LeftMap, "{entry}");
        // The way is measured at the rear axle, 3.7 m behind the front bumper. Bends are cut a little.
        let driven_m = log.distance_m + 3.705;
        assert!((way_m - 5.0..=way_m + 1.0).contains(&driven_m), "{entry}: {driven_m} m of {way_m} m");
    }
}

#[test]
fn lanes_of_our_maps_meet_those_that_follow() {
    let shipped = ["boulevard", "corner", "crossroad", "residential"]
        .map(|name| format!("scenarios/roads/{name}.xodr"));
    let made = PLACES.map(|place| path(&format!("{place}.xodr")));
    for file in shipped.into_iter().chain(made) {
        let text = std::fs::read_to_string(root().join(&file)).expect("it is there");
        let map = RoadMap::from_opendrive("map", &text).expect("it is sound");
        for lane in &map.lanes {
            for next in lane.successors.iter().map(|next| map.lane(*next)) {
                let end = lane.centre.pose_at(lane.centre.length_m()).position;
                let gap_m = (next.centre.pose_at(0.0).position - end).norm();
                // The widths of a road's own lane sections are rounded.
                let most_m = if lane.key.road == next.key.road { 1e-4 } else { 1e-6 };
                assert!(gap_m < most_m, "{file}: {:?} misses {:?} by {gap_m} m", lane.key, next.key);
            }
        }
    }
}
