//! The lanes beside a lane: on its own road, across a median, in a junction.

use crate::abreast::{Abreast, Opposing};
use crate::testing::{lanes, street};
use crate::{LaneIndex, RoadMap, Route, Side};

use super::places::corner;

/// A boulevard like Road 4's: two roads of two lanes each, one way each, bending to the left, with 20 m
/// of median that no road describes. Traffic keeps to `rule`'s side.
fn boulevard(rule: &str) -> RoadMap {
    let lanes = r#"<lanes><laneSection s="0"><right>
        <lane id="-1" type="driving"><width a="3.5"/></lane><lane id="-2" type="driving"><width a="3"/></lane>
        </right></laneSection></lanes>"#;
    let lanes = match rule {
        "LHT" => lanes.replace("right>", "left>").replace(r#"id="-"#, r#"id=""#),
        _ => lanes.to_owned(),
    };
    let side = if rule == "LHT" { -1.0 } else { 1.0 };
    let road = |id: u32, x: f64, y: f64, hdg: f64, curvature: f64, length: f64| {
        format!(
            r#"<road id="{id}" length="{length}" junction="-1" rule="{rule}"><type s="0" type="town">
            <speed max="50" unit="km/h"/></type><planView><geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}">
            <arc curvature="{curvature}"/></geometry></planView>{lanes}</road>"#
        )
    };
    // Reference lines of radius 200 m and 180 m (220 m) about (0, 200).
    let inner_m = 200.0 - 20.0 * side;
    let text = format!(
        r#"<OpenDRIVE><header name="boulevard"/>{}{}</OpenDRIVE>"#,
        road(1, 0.0, 0.0, 0.0, 0.005, 100.0),
        road(
            2,
            inner_m * libm::sin(0.5),
            200.0 - inner_m * libm::cos(0.5),
            0.5 - core::f64::consts::PI,
            -1.0 / inner_m,
            inner_m * 0.5
        ),
    );
    RoadMap::from_opendrive("boulevard", &text).unwrap()
}

#[test]
fn the_opposing_lane_is_found_across_a_median() {
    for (rule, inner, outer, side) in [("RHT", -1, -2, 1.0), ("LHT", 1, 2, -1.0)] {
        let map = boulevard(rule);
        for (own, lateral_m) in [(inner, 20.0 + 3.5), (outer, 20.0 + 3.5 + 3.25)] {
            let place = map.place("1", own, 50.0).unwrap();
            let opposing = map.opposing(place.lane, place.station_m).unwrap();
            let key = &map.lane(opposing.lane).key;
            assert_eq!((key.road.as_str(), key.lane), ("2", inner), "{rule}");
            assert!((opposing.median_m - 20.0).abs() < 0.01, "{opposing:?}");
            assert!((opposing.lateral_m - side * lateral_m).abs() < 0.01, "{opposing:?}");
            // Both places lie at half of the same angle about the same centre.
            let half_m = map.lane(opposing.lane).centre.length_m() / 2.0;
            assert!((opposing.station_m - half_m).abs() < 0.1, "{opposing:?}");
        }
        let place = map.place("1", inner, 50.0).unwrap();
        let widths: Vec<_> = map
            .abreast(place.lane, place.station_m, 60.0)
            .iter()
            .map(|beside| (beside.same_direction, beside.width_m.round()))
            .collect();
        let mut expected = [(false, 3.0), (false, 4.0), (true, 3.0)];
        if rule == "LHT" {
            expected.reverse();
        }
        assert_eq!(widths, expected);
    }
}

#[test]
fn a_lane_change_never_crosses_a_median() {
    let map = boulevard("RHT");
    let place = |road: &str, lane: i32, s_m: f64| map.place(road, lane, s_m).unwrap();
    let (inner, outer) = (place("1", -1, 10.0), place("1", -2, 10.0));
    assert_eq!(map.change_room_m(inner.lane, Side::Left, 10.0), 0.0);
    for (from, side, to) in [(inner, Side::Right, outer), (outer, Side::Left, inner)] {
        assert_eq!(map.lane(from.lane).neighbour(side).unwrap().lane, to.lane);
        assert!(map.change_room_m(from.lane, side, 10.0) > 0.0);
    }
    assert!(Route::find(&map, inner, place("2", -1, 80.0)).is_err());
    assert!(Route::find(&map, inner, place("1", -2, 80.0)).is_ok());
    // A median between two lanes of one road is not crossed either: here a strip of grass of 2 m.
    let lanes = lanes(&[(-1, "driving", 3.0, ""), (-2, "median", 2.0, ""), (-3, "driving", 3.0, "")]);
    let road = street("1", [0.0, 0.0, 0.0, 100.0], "-1", "", &lanes, "");
    let map = RoadMap::from_opendrive("strip", &format!("<OpenDRIVE>{road}</OpenDRIVE>")).unwrap();
    let right = map.lane(LaneIndex(0)).right.unwrap();
    assert!(right.same_direction && (right.gap_m - 2.0).abs() < 1e-9);
    assert_eq!(map.change_room_m(LaneIndex(0), Side::Right, 50.0), 0.0);
}

#[test]
fn without_a_median_the_neighbour_is_the_opposing_lane() {
    let map = corner();
    let place = map.place("1", -2, 80.0).unwrap();
    let opposing = map.opposing(place.lane, place.station_m).unwrap();
    assert_eq!((map.lane(opposing.lane).key.lane, opposing.median_m), (1, 0.0));
    // A one-way street has no opposing lane.
    let one_way = map.place("5", -3, 60.0).unwrap();
    assert_eq!(map.opposing(one_way.lane, one_way.station_m), None);
}

/// The result of [`RoadMap::opposing`], from all that is abreast, however far away.
fn opposing_of_all(map: &RoadMap, lane: LaneIndex, station_m: f64) -> Option<Opposing> {
    let own = map.lane(lane);
    let side = if own.keeps_left { -1.0 } else { 1.0 };
    let aside_m = |beside: &Abreast| side * beside.lateral_m;
    let opposite = map.abreast(lane, station_m, 80.0).into_iter().filter(|beside| !beside.same_direction);
    let nearest =
        opposite.filter(|beside| aside_m(beside) > 0.0).min_by(|a, b| aside_m(a).total_cmp(&aside_m(b)))?;
    let same = map.abreast(lane, station_m, aside_m(&nearest) + 0.1).into_iter();
    let between = |beside: &Abreast| aside_m(beside) > 0.0 && aside_m(beside) < aside_m(&nearest);
    let edge_m = same
        .filter(|beside| beside.same_direction && between(beside))
        .map(|beside| aside_m(&beside) + beside.width_m / 2.0)
        .fold(own.width_at(station_m) / 2.0, f64::max);
    let gap_m = aside_m(&nearest) - nearest.width_m / 2.0 - edge_m;
    let median_m = if gap_m > 1e-3 { gap_m } else { 0.0 };
    let Abreast { lane, station_m, lateral_m, .. } = nearest;
    (median_m <= 40.0).then_some(Opposing { lane, station_m, lateral_m, median_m })
}

#[test]
fn the_opposing_lane_is_that_of_a_search_of_all_lanes() {
    let roads = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/roads");
    let shipped = ["residential", "corner", "crossroad", "boulevard"].map(|name| {
        let text = std::fs::read_to_string(format!("{roads}/{name}.xodr")).expect("it is shipped");
        RoadMap::from_opendrive(name, &text).expect("it is a map")
    });
    let (mut found, mut missing) = (0, 0);
    for map in shipped.into_iter().chain(["RHT", "LHT"].map(boulevard)) {
        for lane in (0..map.lanes.len()).map(LaneIndex) {
            for tenth in 0..=10 {
                let station_m = map.lane(lane).centre.length_m() * f64::from(tenth) / 10.0;
                let opposing = map.opposing(lane, station_m);
                assert_eq!(opposing, opposing_of_all(&map, lane, station_m), "{lane:?} at {station_m} m");
                *if opposing.is_some() { &mut found } else { &mut missing } += 1;
            }
        }
    }
    assert!(found > 500 && missing > 100, "{found} {missing}");
}
