//! Made-up OpenDRIVE files: each feature once, and the message for each kind of broken file.

use proptest::prelude::*;

use crate::testing::{road, street};
use crate::{Lane, RoadError, RoadMap, Route, SignKind};
use avastra_base::geometry::{Vec2, unit_vector, wrap_angle};

const CORNER: &str = include_str!("../../../scenarios/roads/corner.xodr");

const LINE_100: &str = r#"<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>"#;
const TWO_LANES: &str = r#"<laneSection s="0">
    <left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>
    <center><lane id="0" type="none"/></center>
    <right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right>
</laneSection>"#;

/// A map of one road, 100 m long.
fn one_road(attributes: &str, head: &str, geometry: &str, lanes: &str, tail: &str) -> String {
    format!(
        r#"<OpenDRIVE><header name="made up"/><road id="1" length="100" junction="-1" {attributes}>{head}
        <planView>{geometry}</planView><lanes>{lanes}</lanes>{tail}</road></OpenDRIVE>"#
    )
}

/// The same along the x axis, without a limit.
fn straight(lanes: &str, tail: &str) -> String {
    one_road("", "", LINE_100, lanes, tail)
}

fn read(text: &str) -> RoadMap {
    RoadMap::from_opendrive("test", text).unwrap()
}

fn lane(map: &RoadMap, section: usize, id: i32) -> &Lane {
    let of = |lane: &&Lane| lane.key.section == section && lane.key.lane == id;
    map.lanes.iter().find(of).unwrap()
}

#[test]
fn traffic_keeps_right_unless_the_road_says_left() {
    for (rule, along) in [("", -1), (r#"rule="RHT""#, -1), (r#"rule="LHT""#, 1)] {
        let map = read(&one_road(rule, "", LINE_100, TWO_LANES, ""));
        assert!(lane(&map, 0, along).centre.pose_at(0.0).heading_rad.abs() < 1e-12);
        let against = lane(&map, 0, -along);
        assert!((against.centre.pose_at(0.0).heading_rad.abs() - core::f64::consts::PI).abs() < 1e-12);
        assert_eq!(against.centre.points().len(), 2, "a straight needs no more than its ends");
        // Where traffic keeps left, oncoming traffic is on the right.
        let beside = if along < 0 { against.left } else { against.right };
        let neighbour = beside.unwrap();
        assert!(!neighbour.same_direction && neighbour.gap_m == 0.0);
    }
}

#[test]
fn limits_are_read_in_all_units_and_lanes_may_have_their_own() {
    for (unit, expected_mps) in [("m/s", 36.0), ("km/h", 10.0), ("mph", 16.093_44)] {
        let kind = format!(r#"<type s="0" type="town"><speed max="36" unit="{unit}"/></type>"#);
        let map = read(&one_road("", &kind, LINE_100, TWO_LANES, ""));
        assert!((lane(&map, 0, 1).speed_limit_mps - expected_mps).abs() < 1e-9);
    }
    let own =
        TWO_LANES.replace("</lane></right>", r#"<speed sOffset="0" max="7" unit="m/s"/></lane></right>"#);
    let map = read(&straight(&own, ""));
    assert_eq!(lane(&map, 0, -1).speed_limit_mps, 7.0);
    assert_eq!(lane(&map, 0, 1).speed_limit_mps, 50.0 / 3.6);
    assert!(map.warnings.iter().any(|warning| warning.contains("no speed limit")), "{:?}", map.warnings);
}

#[test]
fn a_median_is_a_gap_and_other_lanes_are_left_out() {
    let lanes = r#"<laneSection s="0">
        <left><lane id="2" type="driving"><width a="3"/></lane><lane id="1" type="median"><width a="2"/></lane></left>
        <right><lane id="-1" type="driving"><border a="-3"/></lane><lane id="-2" type="sidewalk"><width a="2"/></lane></right>
    </laneSection>"#;
    let map = read(&straight(lanes, ""));
    assert_eq!(map.lanes.len(), 2);
    let right = lane(&map, 0, -1);
    assert!((right.left.unwrap().gap_m - 2.0).abs() < 1e-9);
    assert_eq!(right.right, None);
    assert!((right.width_at(50.0) - 3.0).abs() < 1e-9);
    assert!((right.centre.pose_at(0.0).position.y + 1.5).abs() < 1e-9);
}

#[test]
fn sections_join_lanes_and_a_lane_that_appears_has_no_predecessor() {
    let lanes = r#"<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
        <laneSection s="0"><right><lane id="-1" type="driving"><link><successor id="-1"/></link><width a="3"/></lane></right></laneSection>
        <laneSection s="40"><right>
            <lane id="-1" type="driving"><link><predecessor id="-1"/></link><width a="3"/></lane>
            <lane id="-2" type="driving"><width a="0" b="0" c="0.0025" d="-0.00004166666667"/></lane>
        </right></laneSection>"#;
    let map = read(&straight(lanes, ""));
    assert_eq!(map.warnings.len(), 1, "only the missing limits: {:?}", map.warnings);
    let first = lane(&map, 0, -1);
    assert_eq!(first.successors.len(), 1);
    assert_eq!(map.lane(first.successors[0]).key.section, 1);
    assert!((first.centre.pose_at(0.0).position.y + 1.0).abs() < 1e-9, "the lane offset moves it");
    assert!(lane(&map, 1, -2).predecessors.is_empty());
    let place = map.place("1", -1, 60.0).unwrap();
    assert!((place.station_m - 20.0).abs() < 1e-6);
    let route = Route::find(&map, map.place("1", -1, 10.0).unwrap(), place).unwrap();
    assert!((route.goal_m - 50.0).abs() < 1e-6);
    assert!((route.path.length_m() - 90.0).abs() < 1e-6);
    assert!((route.lanes[1].from_m - 30.0).abs() < 1e-6);
}

#[test]
fn lights_stop_the_lanes_they_are_meant_for() {
    let lanes = r#"<laneSection s="0"><left><lane id="1" type="driving"><width a="3"/></lane></left><right>
        <lane id="-1" type="driving"><width a="3"/></lane><lane id="-2" type="driving"><width a="3"/></lane></right></laneSection>"#;
    let tail = r#"<signals>
        <signal id="a" s="90" t="-5" orientation="+" type="1000001"><validity fromLane="-1" toLane="-1"/></signal>
        <signal id="b" s="10" t="5" orientation="-" type="1000001"/>
        <signal id="c" s="10" t="5" orientation="-" type="206"/>
        <signal id="d" s="10" t="5" orientation="-" type="274"/></signals>"#;
    let map = read(&straight(lanes, tail));
    assert_eq!(map.signals.len(), 2);
    assert_eq!(lane(&map, 0, -1).stop_lines.len(), 1);
    assert!((lane(&map, 0, -1).stop_lines[0].station_m - 90.0).abs() < 1e-6);
    assert!(lane(&map, 0, -2).stop_lines.is_empty());
    assert!((lane(&map, 0, 1).stop_lines[0].station_m - 90.0).abs() < 1e-6, "counted in driving direction");
    assert!(map.warnings.iter().any(|warning| warning.contains("type `274`")), "{:?}", map.warnings);
    assert!(map.warnings.iter().any(|warning| warning.contains("2 signals belong to no junction")));
    // The sign has the lane that it holds for, with the station in driving direction.
    assert_eq!((map.signs.len(), map.signs[0].kind), (1, SignKind::Stop));
    assert_eq!(map.lane(map.signs[0].lanes[0].0).key.lane, 1);
    assert!((map.signs[0].lanes[0].1 - 90.0).abs() < 1e-6);
}

#[test]
fn a_light_for_the_cycle_lane_alone_is_none_for_vehicles() {
    let lanes = r#"<laneSection s="0"><right><lane id="-1" type="driving"><width a="3"/></lane>
        <lane id="-2" type="biking"><width a="2"/></lane></right></laneSection>"#;
    let light = |id: &str, lane: i32| {
        format!(
            r#"<signal id="{id}" s="90" orientation="+" type="1000001"><validity fromLane="{lane}" toLane="{lane}"/></signal>"#
        )
    };
    let tail = format!("<signals>{}{}</signals>", light("cars", -1), light("cycles", -2));
    let map = read(&straight(lanes, &tail));
    assert_eq!(map.signals.iter().map(|signal| signal.for_vehicles).collect::<Vec<_>>(), [true, false]);
    assert!(!map.warnings.iter().any(|warning| warning.contains("holds no lane")), "{:?}", map.warnings);
}

/// A junction of a road that turns round on the spot, of one that meets the next at a right angle, and of one that
/// goes on.
#[test]
fn what_no_car_can_follow_is_left_out() {
    let pi = core::f64::consts::PI;
    let one = r#"<laneSection s="0"><right><lane id="-1" type="driving"><link><predecessor id="-1"/>
        <successor id="-1"/></link><width a="3"/></lane></right></laneSection>"#;
    let both = TWO_LANES;
    let inside = |id: &str, hdg: f64, shape: &str, length_m: f64| {
        road(
            id,
            length_m,
            "9",
            r#"<predecessor elementType="road" elementId="1" contactPoint="end"/>
            <successor elementType="road" elementId="2" contactPoint="start"/>"#,
            &format!(r#"<geometry s="0" x="100" y="0" hdg="{hdg}" length="{length_m}">{shape}</geometry>"#),
            one,
            "",
        )
    };
    let arc = |radius_m: f64| format!(r#"<arc curvature="{}"/>"#, 1.0 / radius_m);
    let connection = |to: &str| {
        format!(
            r#"<connection id="{to}" incomingRoad="1" connectingRoad="{to}" contactPoint="start"><laneLink from="-1" to="-1"/></connection>"#
        )
    };
    let text = format!(
        r#"<OpenDRIVE>{}{}{}{}{}<junction id="9" name="">{}{}{}{}</junction></OpenDRIVE>"#,
        street(
            "1",
            [0.0, 0.0, 0.0, 100.0],
            "-1",
            r#"<successor elementType="junction" elementId="9"/>"#,
            both,
            ""
        ),
        inside("tight", 0.0, &arc(1.0), pi),
        inside("wide", 0.0, &arc(6.0), 6.0 * pi),
        inside("across", pi / 2.0, "<line/>", 10.0),
        inside("on", 0.0, "<line/>", 10.0),
        connection("tight"),
        connection("wide"),
        connection("across"),
        connection("on"),
    );
    let map = read(&text);
    let next: Vec<&str> =
        lane(&map, 0, -1).successors.iter().map(|next| map.lane(*next).key.road.as_str()).collect();
    assert_eq!(next, ["wide", "on"]);
    assert!(!map.lanes.iter().any(|lane| lane.key.road == "tight"));
    for part in
        ["left out 1 lanes that turn round", "meets lane -1 of road `across` at an angle of 90 degrees"]
    {
        assert!(map.warnings.iter().any(|warning| warning.contains(part)), "{part}: {:?}", map.warnings);
    }
}

#[test]
fn signs_are_known_by_number_or_name() {
    let lanes = r#"<laneSection s="0"><right><lane id="-1" type="driving"><width a="3"/></lane></right></laneSection>"#;
    let kinds = |signal: &str| -> Vec<SignKind> {
        let tail = format!(r#"<signals><signal id="a" s="90" t="-5" orientation="+" {signal}/></signals>"#);
        read(&straight(lanes, &tail)).signs.iter().map(|sign| sign.kind).collect()
    };
    for (signal, expected) in [
        (r#"type="206""#, Some(SignKind::Stop)),
        (r#"type="205" name="Sign_Yield""#, Some(SignKind::Yield)),
        (r#"type="306" country="DE""#, Some(SignKind::PriorityRoad)),
        (r#"type="R1-2" country="US""#, Some(SignKind::Yield)),
        (r#"type="R1" subtype="1" country="USA""#, Some(SignKind::Stop)),
        (r#"type="R1" subtype="-2" country="US""#, Some(SignKind::Yield)),
        (r#"type="R1" subtype="-1" country="US""#, None),
        (r#"type="206" subtype="-1" country="DE""#, Some(SignKind::Stop)),
        (r#"type="206" country="NO""#, Some(SignKind::PriorityRoad)),
        (r#"type="B" subtype="2" country="PT""#, Some(SignKind::Stop)),
        (r#"type="2.4" country="RU""#, Some(SignKind::Yield)),
        (r#"type="602" country="GB""#, Some(SignKind::Yield)),
        (r#"type="602""#, None),
        (r#"type="-1" name="StopSign""#, Some(SignKind::Stop)),
        (r#"type="-1" name="give way""#, Some(SignKind::Yield)),
        (r#"type="-1" name="Priority road""#, Some(SignKind::PriorityRoad)),
        (r#"type="-1" name="bus stop""#, None),
        (r#"type="-1" name="Stencil_STOP""#, None),
    ] {
        assert_eq!(kinds(signal), Vec::from_iter(expected), "{signal}");
    }
}

#[test]
fn signs_become_lines_of_the_route() {
    let lanes = r#"<laneSection s="0"><right><lane id="-1" type="driving"><width a="3"/></lane></right></laneSection>"#;
    let lines = |light: &str| {
        let sign = r#"<signal id="a" s="70" t="-5" orientation="+" type="205"/>"#;
        let tail = format!("<signals>{sign}{light}</signals>");
        let map = read(&straight(lanes, &tail));
        let place = |s_m| map.place("1", -1, s_m).unwrap();
        let route = Route::find(&map, place(10.0), place(90.0)).unwrap();
        route.sign_lines.iter().map(|line| (line.station_m.round(), line.kind)).collect::<Vec<_>>()
    };
    assert_eq!(lines(""), [(60.0, SignKind::Yield)]);
    let light = r#"<signal id="b" s="72" t="-5" orientation="+" type="1000001"/>"#;
    assert!(lines(light).is_empty(), "a light has precedence");
}

#[test]
fn crosswalks_have_corners_in_either_frame() {
    let tail = r#"<objects>
        <object type="crosswalk" id="local" s="50" t="0" hdg="1.5707963267948966"><outlines><outline>
            <cornerLocal u="-4" v="-1"/><cornerLocal u="4" v="-1"/><cornerLocal u="4" v="1"/></outline></outlines></object>
        <object type="crosswalk" id="road" s="50" t="0"><outline>
            <cornerRoad s="49" t="-4"/><cornerRoad s="51" t="-4"/><cornerRoad s="51" t="4"/></outline></object>
        <object type="crosswalk" id="box" s="50" t="0" length="2" width="8"/>
        <object type="crosswalk" id="nothing" s="50" t="0"/></objects>"#;
    let map = read(&straight(TWO_LANES, tail));
    let ids: Vec<_> = map.crosswalks.iter().map(|crosswalk| crosswalk.id.as_str()).collect();
    assert_eq!(ids, ["local", "road", "box"]);
    assert!((map.crosswalks[0].outline[0] - Vec2::new(51.0, -4.0)).norm() < 1e-9);
    assert!((map.crosswalks[1].outline[2] - Vec2::new(51.0, 4.0)).norm() < 1e-9);
    assert!((map.crosswalks[2].outline[0] - Vec2::new(49.0, -4.0)).norm() < 1e-9);
    let route =
        Route::find(&map, map.place("1", -1, 0.0).unwrap(), map.place("1", -1, 99.0).unwrap()).unwrap();
    assert_eq!(route.crosswalks_m.len(), 3);
}

/// In SUMO's maps no junction names the controllers, and there are arrow lights.
#[test]
fn lights_without_a_junctions_controller_are_grouped_by_their_arms() {
    let road = |id: &str, [x, y, heading]: [f64; 3], link: &str, signals: &str| {
        street(id, [x, y, heading, 50.0], "-1", link, TWO_LANES, &format!("<signals>{signals}</signals>"))
    };
    let ahead = r#"<successor elementType="junction" elementId="9"/>"#;
    let light = |id: &str, kind: &str| {
        format!(r#"<signal id="{id}" s="48" t="-3" orientation="+" dynamic="yes" type="{kind}"/>"#)
    };
    let text = format!(
        r#"<OpenDRIVE><header name="arms"/>{}{}{}<junction id="9" name=""/></OpenDRIVE>"#,
        road("1", [-60.0, 0.0, 0.0], ahead, &(light("a", "1000001") + &light("b", "1000011"))),
        road("2", [0.0, -60.0, core::f64::consts::FRAC_PI_2], ahead, &light("c", "1000011")),
        road("3", [100.0, 0.0, 0.0], "", &light("lone", "1000001")),
    );
    let map = read(&text);
    let groups: Vec<_> = map.signals.iter().map(|signal| (signal.junction, signal.group)).collect();
    assert_eq!(groups, [(Some(0), 0), (Some(0), 0), (Some(0), 1), (None, 0)]);
    assert_eq!(map.junctions[0].groups, 2);
    // Two signal heads of one arm share one stop line.
    assert!(map.lanes.iter().all(|lane| lane.stop_lines.len() <= 1));
    assert!(map.warnings.iter().any(|warning| warning.contains("3 signals")), "{:?}", map.warnings);
}

#[test]
fn what_a_flat_map_of_cars_cannot_hold_is_said() {
    let lanes = TWO_LANES.replace(
        r#"<lane id="-1" type="driving">"#,
        r#"<lane id="-2" type="onRamp"><width a="3"/></lane><lane id="-3" type="taxi"><width a="3"/></lane>
        <lane id="-4" type="driving" direction="reversed"><width a="3"/></lane><lane id="-1" type="driving">"#,
    );
    let heights = r#"<elevationProfile><elevation s="0" a="3" b="0.05" c="0" d="0"/></elevationProfile>
        <lateralProfile><superelevation s="0" a="0.02" b="0" c="0" d="0"/></lateralProfile>"#;
    let map = read(&one_road("", heights, LINE_100, &lanes, ""));
    let ids: Vec<_> = map.lanes.iter().map(|lane| lane.key.lane).collect();
    assert_eq!(ids, [1, -1, -2], "a ramp is a lane, a lane for taxis is none");
    for words in ["slopes", "banked", "type `taxi`", "direction `reversed`"] {
        assert!(map.warnings.iter().any(|warning| warning.contains(words)), "{words}: {:?}", map.warnings);
    }
    let level = r#"<elevationProfile><elevation s="0" a="3" b="0" c="0" d="0"/></elevationProfile>"#;
    let map = read(&one_road("", level, LINE_100, TWO_LANES, ""));
    assert!(!map.warnings.iter().any(|warning| warning.contains("slopes")), "{:?}", map.warnings);
}

#[test]
fn bus_lanes_are_told_by_type_and_by_access() {
    let lane = |id: i32, kind: &str, access: &str| {
        format!(r#"<lane id="{id}" type="{kind}"><width a="3"/>{access}</lane>"#)
    };
    let lanes = [
        lane(-2, "bus", ""),
        lane(-3, "driving", r#"<access sOffset="0" rule="allow" restriction="bus"/>"#),
        lane(-4, "driving", r#"<access sOffset="0" restriction="bus"/>"#),
        lane(-5, "driving", r#"<access sOffset="0" rule="deny"><restriction type="passengerCar"/></access>"#),
        lane(-6, "driving", r#"<access sOffset="0" rule="deny" restriction="bus"/>"#),
        lane(-7, "driving", r#"<access sOffset="0" rule="allow" restriction="none"/>"#),
    ];
    let lanes = TWO_LANES
        .replace(r#"<lane id="-1" type="driving">"#, &(lanes.concat() + r#"<lane id="-1" type="driving">"#));
    let map = read(&one_road("", "", LINE_100, &lanes, ""));
    let for_buses: Vec<_> =
        map.lanes.iter().filter(|lane| lane.for_buses).map(|lane| lane.key.lane).collect();
    assert_eq!(for_buses, [-2, -3, -4, -5]);
    assert!(!map.warnings.iter().any(|warning| warning.contains("access")), "{:?}", map.warnings);
    // No way leads over them.
    let place = |lane| map.place("1", lane, 20.0).expect("it is on the map");
    assert!(Route::find(&map, place(-1), place(-6)).is_err());
    assert!(Route::find(&map, place(-1), map.place("1", -2, 90.0).expect("it is on the map")).is_ok());
}

#[test]
fn a_repeated_crosswalk_is_several() {
    let tail = r#"<objects><object type="crosswalk" id="z" s="20" t="0" length="3" width="8">
        <repeat s="20" length="60" distance="30" tStart="0" tEnd="0"/></object></objects>"#;
    let map = read(&straight(TWO_LANES, tail));
    let middles: Vec<f64> = map
        .crosswalks
        .iter()
        .map(|crosswalk| (crosswalk.outline[0].x + crosswalk.outline[2].x) / 2.0)
        .collect();
    assert_eq!(middles.len(), 3);
    for (found_m, expected_m) in middles.iter().zip([20.0, 50.0, 80.0]) {
        assert!((found_m - expected_m).abs() < 1e-9, "{middles:?}");
    }
}

/// The end of each curve, from textbook formulas: a quarter of a circle, a parabola, and the clothoid
/// through its series `x = L - L⁵/(40 A⁴)`, `y = L³/(6 A²) - L⁷/(336 A⁶)` with `A² = L R`.
#[test]
fn curves_end_where_they_should() {
    let quarter = core::f64::consts::FRAC_PI_2 / 100.0;
    let radius_m = 1.0 / quarter;
    // L = 100 m and R = 1000 m.
    let clothoid = (99.975, 1.0 / 0.6 - 0.1 / 336.0);
    let cases = [
        (format!(r#"<arc curvature="{quarter}"/>"#), (radius_m, radius_m), 1e-9),
        (r#"<spiral curvStart="0" curvEnd="0.001"/>"#.to_owned(), clothoid, 1e-5),
        (r#"<paramPoly3 pRange="normalized" aU="0" bU="100" cU="0" dU="0" aV="0" bV="0" cV="2" dV="0"/>"#.to_owned(), (100.0, 2.0), 1e-9),
        (r#"<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0.0002" dV="0"/>"#.to_owned(), (100.0, 2.0), 1e-9),
    ];
    for (shape, (x, y), tolerance_m) in cases {
        let geometry = format!(r#"<geometry s="0" x="0" y="0" hdg="0" length="100">{shape}</geometry>"#);
        let lanes = r#"<laneOffset s="0" a="1.5"/><laneSection s="0"><right><lane id="-1" type="driving"><width a="3"/></lane></right></laneSection>"#;
        let map = read(&one_road("", "", &geometry, lanes, ""));
        let centre = &map.lanes[0].centre;
        let end = centre.points().last().unwrap();
        assert!((end.position - Vec2::new(x, y)).norm() < tolerance_m + 2e-7, "{shape}: {end:?}");
    }
    let poly3 =
        r#"<geometry s="0" x="0" y="0" hdg="0" length="100"><poly3 a="0" b="0" c="0.001" d="0"/></geometry>"#;
    let map = read(&one_road("", "", poly3, TWO_LANES, ""));
    assert!(map.lanes.iter().all(|lane| lane.centre.length_m() > 99.0), "{:?}", map.warnings);
}

/// On an S of spirals with a lane that widens: half-way between two vertices the exact curve is within a
/// millimetre, and headings and curvatures fit the path.
#[test]
fn sampled_centres_are_the_curves() {
    let geometry = r#"<geometry s="0" x="0" y="0" hdg="0" length="40"><spiral curvStart="0" curvEnd="0.1"/></geometry>
        <geometry s="40" x="26.703874" y="19.952474" hdg="2" length="60"><spiral curvStart="0.1" curvEnd="-0.1"/></geometry>"#;
    let lanes = r#"<laneSection s="0"><right>
        <lane id="-1" type="driving"><width a="3" b="0" c="0.0009" d="-0.000006"/></lane>
        <lane id="-2" type="driving"><width a="3"/></lane></right></laneSection>"#;
    let map = read(&one_road("", "", geometry, lanes, ""));
    for lane in &map.lanes {
        let points = lane.centre.points();
        for triple in points.windows(3) {
            let [a, b, c] = triple else { unreachable!() };
            let (before_m, after_m) = (b.station_m - a.station_m, c.station_m - b.station_m);
            if before_m < 0.01 || after_m < 0.01 {
                continue;
            }
            let mean = |p: &avastra_base::geometry::PathPoint, q: &avastra_base::geometry::PathPoint| {
                p.heading_rad + wrap_angle(q.heading_rad - p.heading_rad) / 2.0
            };
            let chord = (c.position - b.position).normalize();
            assert!((chord - unit_vector(mean(b, c))).norm() < 2e-3, "{b:?} {c:?}");
            let turned = wrap_angle(mean(b, c) - mean(a, b)) / ((before_m + after_m) / 2.0);
            assert!((turned - b.curvature_per_m).abs() < 5e-3, "{turned} against {b:?}");
            // The height of the arc over the chord is less than a millimetre.
            assert!(b.curvature_per_m.abs() * after_m * after_m / 8.0 < 1e-3, "{b:?}");
        }
    }
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let road = |attributes: &str| {
        format!(
            "<OpenDRIVE>\n<road {attributes}>\n<planView>{LINE_100}</planView>\n<lanes>{TWO_LANES}</lanes></road></OpenDRIVE>"
        )
    };
    let link = |link: &str| one_road("", &format!("<link>\n{link}</link>"), LINE_100, TWO_LANES, "");
    let only_left = TWO_LANES.replace(r#"<lane id="-1" type="driving">"#, r#"<lane id="-1" type="none">"#);
    let narrow = |width| straight(&only_left.replace(r#"a="3" b="0""#, width), "");
    let along = |plan: &str| one_road("", "", plan, TWO_LANES, "");
    let nested = "<a>".repeat(50_000);
    let cases = [
        (String::new(), 1, "the file is empty"),
        ("hello".to_owned(), 1, "not well-formed XML"),
        ("\u{0}\u{1}".to_owned(), 1, "not well-formed XML"),
        (nested, 1, "not well-formed XML"),
        ("<svg/>".to_owned(), 1, "the root element is `svg`"),
        ("<OpenDRIVE/>".to_owned(), 1, "no `road`"),
        (road(r#"length="100""#), 2, "`road` lacks its `id`"),
        (road(r#"id="1" length="NaN""#), 2, "no number a road can have"),
        (road(r#"id="1" length="long""#), 2, "`length` of `road` is `long`"),
        (road(r#"id="1" length="-3""#), 2, "is -3 m long"),
        (link(r#"<successor elementType="road" elementId="1"/>"#), 2, "lacks its `contactPoint`"),
        (along(""), 2, "no `geometry`"),
        (along("<geometry s='0' x='0' y='0' hdg='0' length='100'/>"), 2, "lacks its shape"),
        (straight("", ""), 2, "no `laneSection`"),
        (straight(&TWO_LANES.replace("driving", "sidewalk"), ""), 1, "no lane of type `driving`"),
        (narrow(r#"a="3" b="999999""#), 1, "is no road"),
        (narrow(r#"a="-3" b="0""#), 1, "narrower than nothing"),
        (narrow(r#"a="3" b="-1""#), 1, "narrower than nothing"),
    ];
    for (text, expected_line, part) in cases {
        let start: String = text.chars().take(200).collect();
        let Err(RoadError::Map { line, message }) = RoadMap::from_opendrive("test", &text) else {
            panic!("no error for {start}")
        };
        assert!(message.contains(part), "`{message}` for {start}");
        assert_eq!(line, expected_line, "`{message}` for {start}");
    }
}

/// One harmless fault does not cost the whole map: it is said, and the rest can be driven.
#[test]
fn a_harmless_fault_is_said_and_the_rest_is_read() {
    let link = |link: &str| one_road("", &format!("<link>\n{link}</link>"), LINE_100, TWO_LANES, "");
    let signals = |signals: &str| straight(TWO_LANES, &format!("<signals>{signals}</signals>"));
    let with =
        |element: &str| straight(TWO_LANES, "").replace("</OpenDRIVE>", &format!("{element}</OpenDRIVE>"));
    let lane = |from: &str, to: &str| straight(&TWO_LANES.replace(from, to), "");
    let light = r#"<signal id="-1" s="90" t="-5" orientation="+" type="1000001"/>"#;
    let cases = [
        (
            link(r#"<successor elementType="road" elementId="9" contactPoint="start"/>"#),
            2,
            "leads to road `9`",
        ),
        (link(r#"<successor elementType="junction" elementId="9"/>"#), 2, "leads to junction `9`"),
        (straight(TWO_LANES, "").replace(r#"junction="-1""#, r#"junction="7""#), 2, "junction `7`"),
        (signals(&light.repeat(3)), 2, "2 more signals have the id `-1`"),
        (
            signals(
                r#"<signal id="-1" s="90" orientation="+" type="1000001"><validity fromLane="-9" toLane="-9"/></signal>"#,
            ),
            2,
            "light `-1` holds no lane",
        ),
        (
            with(
                r#"<junction id="5" name=""><connection incomingRoad="1" connectingRoad="8" contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>"#,
            ),
            2,
            "connects road `8`",
        ),
        (with(r#"<junction id="5" name=""><controller id="6"/></junction>"#), 2, "names controller `6`"),
        (lane(r#"a="3" b="0""#, r#"a="3" b="-1""#), 1, "narrower than nothing"),
        (lane(r#"a="3" b="0""#, r#"a="3" b="999999""#), 1, "is no road"),
    ];
    for (text, lanes, part) in cases {
        let map = RoadMap::from_opendrive("test", &text).unwrap_or_else(|error| panic!("{error} in {text}"));
        assert_eq!(map.lanes.len(), lanes, "{text}");
        assert!(map.warnings.iter().any(|warning| warning.contains(part)), "{part}: {:?}", map.warnings);
    }
}

fn all_finite(map: &RoadMap) -> bool {
    map.lanes.iter().all(|lane| {
        let finite = |point: &avastra_base::geometry::PathPoint| {
            let numbers = [point.station_m, point.heading_rad, point.curvature_per_m];
            numbers.iter().all(|number| number.is_finite())
                && point.position.iter().all(|part| part.is_finite())
        };
        lane.centre.points().iter().all(finite) && lane.widths_m.iter().all(|width| width.is_finite())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Reading a file with changed values, and with lines that are missing or stand there twice, gives a map of finite
    /// numbers or an error.
    #[test]
    fn a_damaged_file_does_no_harm(
        damages in prop::collection::vec((0.0..1.0_f64, 0_usize..13), 1..4),
    ) {
        const VALUES: [&str; 9] = ["", "NaN", "1e308", "-1e9", "1e9", "0", "-7", "x", "1e-300"];
        let mut text = CORNER.to_owned();
        for (place, kind) in damages {
            let from = (place * text.len() as f64) as usize;
            let (before, after) = if kind < VALUES.len() { ("=\"", '"') } else { ("\n", '\n') };
            let mut begins = text.match_indices(before).map(|(at, _)| at + before.len());
            let Some(begin) = begins.find(|at| *at > from) else { continue };
            let Some(length) = text[begin..].find(after) else { continue };
            let line = &text[begin..begin + length];
            let new = match VALUES.get(kind) {
                Some(value) => (*value).to_owned(),
                None if kind % 2 == 0 => String::new(),
                None => format!("{line}\n{line}"),
            };
            text.replace_range(begin..begin + length, &new);
        }
        if let Ok(map) = RoadMap::from_opendrive("damaged", &text) {
            prop_assert!(all_finite(&map));
            let _ = map.nearest(Vec2::new(0.0, 0.0), 0.0, 1e6);
            if let (Ok(start), Ok(goal)) = (map.place("1", -1, 10.0), map.place("5", -3, 10.0)) {
                let _ = Route::find(&map, start, goal);
            }
        }
    }

    /// A file that ends too early, or begins too late, is an error or a smaller map.
    #[test]
    fn a_cut_file_does_no_harm(from in 0.0..1.0_f64, to in 0.0..1.0_f64) {
        let bytes = CORNER.as_bytes();
        let (low, high) = (from.min(to) * bytes.len() as f64, from.max(to) * bytes.len() as f64);
        let part = String::from_utf8_lossy(&bytes[low as usize..high as usize]);
        prop_assert!(RoadMap::from_opendrive("cut", &part).is_err());
        let hole = format!("{}{}", String::from_utf8_lossy(&bytes[..low as usize]), String::from_utf8_lossy(&bytes[high as usize..]));
        if let Ok(map) = RoadMap::from_opendrive("hole", &hole) {
            prop_assert!(all_finite(&map));
        }
    }
}

#[test]
fn a_width_may_fall_a_little_below_nothing_and_an_unknown_rule_is_said() {
    let lanes = TWO_LANES.replace(r#"a="3" b="0""#, r#"a="3" b="-0.0306""#);
    let map = read(&one_road(r#"rule="XYZ""#, "", LINE_100, &lanes, ""));
    assert!(map.warnings.iter().any(|warning| warning.contains("rule `XYZ`")), "{:?}", map.warnings);
}
