//! Routes with lane changes: where they may be, what their path is like, what they leave untouched.

use crate::{LaneIndex, RoadError, RoadMap, Route, Side};
use avastra_base::geometry::{Path, wrap_angle};

/// A one-way road of three lanes, 300 m long: 150 m straight, a bend to the left of 100 m radius, two lane
/// sections, a stop line at the end. `mark` is the marking between lanes -1 and -2, `bay` the widths of
/// lane -1 in the first section.
fn avenue(mark: &str, bay: &str) -> RoadMap {
    let width = r#"<width sOffset="0" a="3.5" b="0" c="0" d="0"/>"#;
    let lane = |id: i32, link: &str, width: &str, mark: &str| {
        format!(r#"<lane id="{id}" type="driving"><link><{link} id="{id}"/></link>{width}{mark}</lane>"#)
    };
    let section = |s: f64, link: &str, first: &str| {
        let lanes = [lane(-1, link, first, mark), lane(-2, link, width, ""), lane(-3, link, width, "")];
        format!(r#"<laneSection s="{s}"><right>{}</right></laneSection>"#, lanes.concat())
    };
    let text = format!(
        r#"<OpenDRIVE><header name="avenue"/><road id="1" length="300" junction="-1">
        <type s="0" type="town"><speed max="50" unit="km/h"/></type>
        <planView><geometry s="0" x="0" y="0" hdg="0" length="150"><line/></geometry>
        <geometry s="150" x="150" y="0" hdg="0" length="150"><arc curvature="0.01"/></geometry></planView>
        <lanes>{}{}</lanes><signals>
        <signal id="light" s="290" t="-12" orientation="+" type="1000001"/></signals></road></OpenDRIVE>"#,
        section(0.0, "successor", bay),
        section(40.0, "predecessor", width),
    );
    RoadMap::from_opendrive("avenue", &text).unwrap()
}

const FULL: &str = r#"<width sOffset="0" a="3.5" b="0" c="0" d="0"/>"#;
const BROKEN: &str = r#"<roadMark sOffset="0" type="broken"/>"#;

fn route(map: &RoadMap, from: (i32, f64), to: (i32, f64)) -> Result<Route, RoadError> {
    Route::find(map, map.place("1", from.0, from.1).unwrap(), map.place("1", to.0, to.1).unwrap())
}

/// Asserts that the headings fit the path and the curvatures fit the headings, and that neither jumps, except
/// where the road's own curvature jumps.
fn assert_smooth(path: &Path, jumps_m: &[f64]) {
    for triple in path.points().windows(3) {
        let [a, b, c] = triple else { unreachable!() };
        let (before_m, after_m) = (b.station_m - a.station_m, c.station_m - b.station_m);
        let at_jump = jumps_m.iter().any(|jump_m| (b.station_m - jump_m).abs() < 1.5);
        if before_m < 0.05 || after_m < 0.05 || at_jump {
            continue;
        }
        let chord = c.position - b.position;
        let middle_rad = b.heading_rad + wrap_angle(c.heading_rad - b.heading_rad) / 2.0;
        assert!(wrap_angle(libm::atan2(chord.y, chord.x) - middle_rad).abs() < 1e-3, "{b:?} {c:?}");
        let turned_per_m = wrap_angle(c.heading_rad - b.heading_rad) / after_m;
        let mean_per_m = (b.curvature_per_m + c.curvature_per_m) / 2.0;
        assert!((turned_per_m - mean_per_m).abs() < 1e-3, "{turned_per_m} {b:?} {c:?}");
        assert!((c.curvature_per_m - b.curvature_per_m).abs() < 0.015 * after_m, "{b:?} {c:?}");
    }
}

#[test]
fn two_changes_lead_across_an_avenue() {
    let map = avenue(BROKEN, FULL);
    let route = route(&map, (-3, 10.0), (-1, 280.0)).unwrap();
    assert_eq!(route.changes.len(), 2);
    let ids: Vec<_> = route
        .lanes
        .iter()
        .map(|part| (map.lane(part.lane).key.section, map.lane(part.lane).key.lane))
        .collect();
    // The first change lasts from 10 to 61 m; it has its middle in section 0.
    assert_eq!(ids, [(0, -3), (0, -2), (1, -2), (1, -1)]);
    for change in &route.changes {
        assert!((change.lateral_m - 3.5).abs() < 1e-6, "{change:?}");
        let length_m = change.end_m - change.begin_m;
        assert!((length_m - 50.9).abs() < 0.6, "{length_m}");
    }
    assert_eq!(route.changes[0].begin_m, 0.0);
    assert!((route.changes[1].begin_m - route.changes[0].end_m).abs() < 1e-6);
    // The second change must be over at the goal, the first so early that the second has its room.
    assert_eq!(route.changes[1].latest_m, route.goal_m);
    assert!(
        (route.changes[0].latest_m - (route.goal_m - 51.2)).abs() < 1.0,
        "{:?}",
        route.changes[0].latest_m
    );
    assert_smooth(&route.path, &[139.9]);
    let goal = map.place("1", -1, 280.0).unwrap();
    let expected = map.lane(goal.lane).centre.pose_at(goal.station_m).position;
    assert!((route.path.pose_at(route.goal_m).position - expected).norm() < 1e-3);
    assert_eq!(route.stop_lines.len(), 1);
    assert!((route.stop_lines[0].station_m - route.goal_m - 10.0 * (1.0 + 0.0175)).abs() < 0.01);
    // The list of lanes gives the station of the lane beside each station of the route.
    for i in 0..280 {
        let station_m = f64::from(i);
        let part = route.lane_at(station_m);
        let beside = map.lane(part.lane).centre.project(route.path.pose_at(station_m).position);
        assert!(
            (beside.station_m - (station_m - part.from_m)).abs() < 0.15,
            "{part:?} at {station_m}: {beside:?}"
        );
        assert!(beside.distance_m < 1.8, "{part:?} at {station_m}: {beside:?}");
    }
}

#[test]
fn the_source_lane_can_be_kept_until_the_latest_station() {
    let map = avenue(BROKEN, FULL);
    let route = route(&map, (-2, 10.0), (-1, 280.0)).unwrap();
    let change = &route.changes[0];
    let source = |station_m: f64| {
        let pose = route.path.pose_at(station_m).offset(0.0, change.source_offset_m(station_m));
        let lanes = map.lanes.iter().filter(|lane| lane.key.lane == -2);
        lanes.map(|lane| lane.centre.project(pose.position).distance_m).fold(f64::INFINITY, f64::min)
    };
    for i in 0..270 {
        assert!(source(f64::from(i)) < 0.05, "{} m at {i}", source(f64::from(i)));
    }
    // A change that begins later ends on the path, and a change that begins as planned follows the path.
    for i in 0..270 {
        let station_m = f64::from(i);
        assert!(change.postponed_offset_m(station_m, change.begin_m).abs() < 1e-9);
        let later_m = change.postponed_offset_m(station_m, 120.0);
        let expected_m = if station_m < 120.0 { change.source_offset_m(station_m) } else { later_m };
        assert_eq!(later_m, expected_m);
        assert!(station_m < 171.3 || later_m.abs() < 1e-9, "{later_m} at {station_m}");
    }
    // The place of a vehicle within its change tells where it began.
    for i in 125..160 {
        let station_m = f64::from(i);
        let from_source_m = change.postponed_offset_m(station_m, 120.0) - change.source_offset_m(station_m);
        let begun_m = change.begun_m(station_m, from_source_m);
        assert!((begun_m - 120.0).abs() < 1e-3, "{begun_m} at {station_m}");
        assert_eq!(change.begun_m(station_m, 9.0), change.begin_m, "farther than the earliest change leads");
    }
}

#[test]
fn markings_decide() {
    let solid = r#"<roadMark sOffset="0" type="solid"/>"#;
    let refused = route(&avenue(solid, FULL), (-2, 10.0), (-1, 280.0));
    let Err(RoadError::Route { message }) = refused else { panic!() };
    assert!(message.contains("no room"), "{message}");
    // The solid line forbids the change back to the right too; between lanes -2 and -3 nothing forbids a
    // change.
    assert!(route(&avenue(solid, FULL), (-1, 10.0), (-2, 280.0)).is_err());
    assert!(route(&avenue(solid, FULL), (-2, 10.0), (-3, 280.0)).is_ok());
    for (mark, inwards, outwards) in [
        (r#"<roadMark sOffset="0" type="solid" laneChange="both"/>"#, true, true),
        (r#"<roadMark sOffset="0" type="broken" laneChange="none"/>"#, false, false),
        (r#"<roadMark sOffset="0" type="broken" laneChange="increase"/>"#, true, false),
        (r#"<roadMark sOffset="0" type="broken" laneChange="decrease"/>"#, false, true),
        (r#"<roadMark sOffset="0" type="solid broken"/>"#, true, false),
        (r#"<roadMark sOffset="0" type="broken solid"/>"#, false, true),
    ] {
        let map = avenue(mark, FULL);
        assert_eq!(route(&map, (-2, 10.0), (-1, 280.0)).is_ok(), inwards, "{mark}");
        assert_eq!(route(&map, (-1, 10.0), (-2, 280.0)).is_ok(), outwards, "{mark}");
    }
    // A line that becomes solid after 30 m of each section leaves room only at 0 to 30 and 40 to 70 m.
    let changing = r#"<roadMark sOffset="0" type="broken"/><roadMark sOffset="30" type="solid"/>"#;
    let map = avenue(changing, FULL);
    let found = route(&map, (-2, 10.0), (-1, 280.0)).unwrap();
    let change = &found.changes[0];
    // The change begins at 40 m and is shortened: 30 m are less than the comfortable 51 m.
    assert!((change.begin_m - 30.0).abs() < 0.2 && (change.end_m - 55.6).abs() < 0.5, "{change:?}");
    assert!((change.latest_m - 60.0).abs() < 0.5, "{change:?}");
    assert!(route(&map, (-2, 50.0), (-1, 280.0)).is_err(), "20 m are too few");
}

#[test]
fn a_bay_is_entered_where_it_is_wide_enough() {
    // The bay opens from nothing to 3.5 m over the 40 m of the first section; it is 2 m wide after 22 m.
    let bay = r#"<width sOffset="0" a="0" b="0.0875" c="0" d="0"/>"#;
    let map = avenue(BROKEN, bay);
    let found = route(&map, (-2, 5.0), (-1, 280.0)).unwrap();
    assert!((found.changes[0].begin_m - 18.0).abs() < 1.1, "{:?}", found.changes[0]);
}

#[test]
fn a_goal_just_ahead_in_the_next_lane_is_out_of_reach() {
    let map = avenue(BROKEN, FULL);
    assert!(route(&map, (-2, 100.0), (-1, 120.0)).is_err());
    // 10 m more are enough for a shortened change.
    let near = route(&map, (-2, 100.0), (-1, 130.0)).unwrap();
    assert!(near.changes[0].end_m <= near.goal_m && near.changes[0].latest_m == near.goal_m);
    assert_smooth(&near.path, &[49.9]);
}

#[test]
fn the_room_for_a_lane_change_is_the_length_of_its_stretch() {
    let text = include_str!("../../../scenarios/roads/crossroad.xodr");
    let map = RoadMap::from_opendrive("crossroad", text).unwrap();
    let mut with_room = 0;
    for lane in (0..map.lanes.len()).map(LaneIndex) {
        for side in [Side::Left, Side::Right] {
            for station_m in (0..map.lane(lane).centre.length_m() as u32).step_by(3).map(f64::from) {
                let stretches = map.changes_from_m(lane, side, station_m);
                let here = stretches.into_iter().find(|(from_m, _)| from_m - station_m < 0.1);
                let room_m = map.change_room_m(lane, side, station_m);
                assert_eq!(room_m, here.map_or(0.0, |(_, length_m)| length_m), "{lane:?} {station_m}");
                with_room += usize::from(room_m > 0.0);
            }
        }
    }
    assert!(with_room > 500, "{with_room}");
}
