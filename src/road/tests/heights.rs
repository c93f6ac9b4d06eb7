//! Heights: what lies on another level is neither beside a lane nor in its way.

use crate::testing::{lanes, road, street};
use crate::{RoadMap, Route};

fn read(roads: &str) -> RoadMap {
    RoadMap::from_opendrive("test", &format!("<OpenDRIVE>{roads}</OpenDRIVE>")).unwrap()
}

fn height(height_m: f64) -> String {
    format!(r#"<elevationProfile><elevation s="0" a="{height_m}" b="0" c="0" d="0"/></elevationProfile>"#)
}

#[test]
fn heights_follow_the_profile_along_either_direction() {
    let both = lanes(&[(1, "driving", 3.0, ""), (-1, "driving", 3.0, "")]);
    let profile = r#"<elevationProfile><elevation s="0" a="2" b="0.1" c="0" d="0"/>
        <elevation s="50" a="7" b="0.1" c="-0.001" d="0"/></elevationProfile>"#;
    let map = read(&street("1", [0.0, 0.0, 0.0, 100.0], "-1", "", &both, profile));
    for (lane, station_m, expected_m) in [(-1, 30.0, 5.0), (-1, 60.0, 7.9), (1, 70.0, 5.0), (1, 40.0, 7.9)] {
        let lane = map.lane(map.place("1", lane, 0.0).unwrap().lane);
        assert!((lane.height_at(station_m) - expected_m).abs() < 0.005, "{}", lane.height_at(station_m));
    }
    assert!(map.has_levels);
    assert!(!read(&street("1", [0.0, 0.0, 0.0, 100.0], "-1", "", &both, &height(300.0))).has_levels);
}

#[test]
fn a_profile_that_cannot_be_read_is_left_out() {
    let one = lanes(&[(-1, "driving", 3.0, "")]);
    let broken = r#"<elevationProfile><elevation s="0" a="high"/></elevationProfile>"#;
    let map = read(&street("1", [0.0, 0.0, 0.0, 100.0], "-1", "", &one, broken));
    assert_eq!(map.lanes[0].height_at(50.0), 0.0);
    assert!(map.warnings.iter().any(|warning| warning.contains("left out")), "{:?}", map.warnings);
}

#[test]
fn a_deck_above_is_no_opposing_lane() {
    let opposing = |height_m: f64| {
        let one = lanes(&[(-1, "driving", 3.5, "")]);
        let back = [200.0, 6.0, core::f64::consts::PI, 200.0];
        let map = read(
            &[
                street("1", [0.0, 0.0, 0.0, 200.0], "-1", "", &one, ""),
                street("2", back, "-1", "", &one, &height(height_m)),
            ]
            .concat(),
        );
        let place = map.place("1", -1, 100.0).unwrap();
        map.opposing(place.lane, place.station_m).is_some()
    };
    assert!(opposing(0.0) && opposing(3.0) && !opposing(5.0) && !opposing(-5.0));
}

#[test]
fn lanes_of_a_junction_that_pass_over_each_other_are_no_conflict() {
    // A crossing whose second street passes over the first inside the junction, and a crosswalk under the bridge.
    let conflicts = |height_m: f64| {
        let one = lanes(&[(-1, "driving", 3.5, "")]);
        let through =
            lanes(&[(-1, "driving", 3.5, r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#)]);
        let ends = |from: &str, to: &str| {
            format!(
                r#"<predecessor elementType="road" elementId="{from}" contactPoint="end"/>
                <successor elementType="road" elementId="{to}" contactPoint="start"/>"#
            )
        };
        let (into, out) = (
            r#"<successor elementType="junction" elementId="9"/>"#,
            r#"<predecessor elementType="junction" elementId="9"/>"#,
        );
        let line = |x: f64, y: f64, hdg: f64, m: f64| {
            format!(r#"<geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{m}"><line/></geometry>"#)
        };
        let north = core::f64::consts::FRAC_PI_2;
        let crosswalk = r#"<objects><object type="crosswalk" id="z" s="7" t="0" length="4" width="8" hdg="0"/></objects>"#;
        let above = height(height_m);
        let connection = |id: &str, connecting: &str| {
            format!(
                r#"<connection id="{id}" incomingRoad="{id}" connectingRoad="{connecting}" contactPoint="start">
                <laneLink from="-1" to="-1"/></connection>"#
            )
        };
        let map = read(&format!(
            r#"{}{}{}{}{}{}<junction id="9" name="">{}{}</junction>"#,
            road("1", 90.0, "-1", into, &line(0.0, 0.0, 0.0, 90.0), &one, ""),
            road("2", 20.0, "9", &ends("1", "3"), &line(90.0, 0.0, 0.0, 20.0), &through, crosswalk),
            road("3", 90.0, "-1", out, &line(110.0, 0.0, 0.0, 90.0), &one, ""),
            road("4", 90.0, "-1", into, &line(96.0, -100.0, north, 90.0), &one, &above),
            road("5", 20.0, "9", &ends("4", "6"), &line(96.0, -10.0, north, 20.0), &through, &above),
            road("6", 90.0, "-1", out, &line(96.0, 10.0, north, 90.0), &one, &above),
            connection("1", "2"),
            connection("4", "5")
        ));
        let place = |road: &str| map.place(road, -1, 50.0).unwrap();
        let along = Route::find(&map, place("1"), place("3")).unwrap();
        let over = Route::find(&map, place("4"), place("6")).unwrap();
        let counts = [along.conflicts.len(), over.conflicts.len()];
        (counts, along.crosswalks_m.len(), over.crosswalks_m.len())
    };
    assert_eq!(conflicts(0.0), ([1, 1], 1, 1));
    assert_eq!(conflicts(5.0), ([0, 0], 1, 0));
}
