//! Ways on foot: where they begin and end.

use crate::RoadMap;
use crate::testing::{lanes, street};
use avastra_base::geometry::{OrientedBox, Pose, Vec2};

const LEFT: Vec2 = Vec2::new(0.0, 1.0);

/// A street along +x for 100 m with these lanes and objects.
fn map(cross_section: &[(i32, &str, f64, &str)], more: &str) -> RoadMap {
    let road = street("1", [0.0, 0.0, 0.0, 100.0], "-1", "", &lanes(cross_section), more);
    RoadMap::from_opendrive("test", &format!("<OpenDRIVE>{road}</OpenDRIVE>")).expect("the map is sound")
}

/// Where people stand on the left and on the right of (50, -1.75).
fn kerbs_m(map: &RoadMap) -> (f64, f64) {
    let way = map.foot_way(Vec2::new(50.0, -1.75), LEFT).expect("people cross here");
    assert!((way.left.place.x - 50.0).abs() < 1e-9 && (way.right.place.x - 50.0).abs() < 1e-9);
    (way.left.place.y, way.right.place.y)
}

fn is_near(found: (f64, f64), expected: (f64, f64)) -> bool {
    (found.0 - expected.0).abs() < 0.03 && (found.1 - expected.1).abs() < 0.03
}

#[test]
fn a_way_leads_over_all_lanes_to_the_kerbs() {
    let plain = [(1, "driving", 3.5, ""), (-1, "driving", 3.5, ""), (-2, "driving", 3.0, "")];
    let found = kerbs_m(&map(&plain, ""));
    assert!(is_near(found, (4.25, -7.25)), "{found:?}");
    let way = map(&plain, "").foot_way(Vec2::new(50.0, -1.75), LEFT).unwrap();
    assert!((way.left.edge_m - 5.25).abs() < 0.03 && (way.left.way_m - 6.0).abs() < 0.03, "{way:?}");
    assert_eq!(way.left.beyond_m, 8.0);
}

#[test]
fn parking_and_cycles_belong_to_the_carriageway_and_a_walkway_is_used() {
    let both = [
        (3, "sidewalk", 2.0, ""),
        (2, "none", 1.5, ""),
        (1, "driving", 3.5, ""),
        (-1, "driving", 3.5, ""),
        (-2, "parking", 2.5, ""),
        (-3, "sidewalk", 2.0, ""),
    ];
    let found = kerbs_m(&map(&both, ""));
    // On the left behind the verge, on the right behind the parking lane.
    assert!((5.0..5.8).contains(&found.0) && (found.1 + 6.75).abs() < 0.03, "{found:?}");
}

#[test]
fn a_median_holds_people_if_it_is_wide_enough() {
    let divided = |median_m: f64| {
        let lanes = [
            (2, "driving", 3.5, ""),
            (1, "median", median_m, ""),
            (-1, "driving", 3.5, ""),
            (-2, "driving", 3.5, ""),
        ];
        kerbs_m(&map(&lanes, ""))
    };
    assert!(is_near(divided(1.0), (5.25, -7.75)), "{:?}", divided(1.0));
    assert!(is_near(divided(3.0), (0.75, -7.75)), "{:?}", divided(3.0));
}

#[test]
fn nobody_walks_through_what_is_solid() {
    let plain = [(1, "driving", 3.5, ""), (-1, "driving", 3.5, "")];
    let building = |t: f64| {
        format!(
            r#"<objects><object type="building" s="50" t="{t}" hdg="0" length="20" width="4"/></objects>"#
        )
    };
    let beside = map(&plain, &building(6.5));
    assert_eq!(beside.foot_way(Vec2::new(50.0, -1.75), LEFT), Err("there is no room at the kerb"));
    assert!(beside.foot_way(Vec2::new(70.0, -1.75), LEFT).is_ok());
    // Farther away it only ends the walk earlier.
    let way = map(&plain, &building(9.0)).foot_way(Vec2::new(50.0, -1.75), LEFT).unwrap();
    assert!((2.0..2.5).contains(&way.left.beyond_m), "{way:?}");
    let wall = r#"<objects><object type="barrier" s="0" t="5"><repeat s="0" length="100" distance="0" tStart="5"
        tEnd="5" widthStart="0.2"/></object></objects>"#;
    let behind = map(&plain, wall).foot_way(Vec2::new(50.0, -1.75), LEFT);
    assert!(behind.is_ok_and(|way| way.left.beyond_m < 0.5));
}

#[test]
fn vehicles_park_beside_the_lanes() {
    let map = map(&[(1, "driving", 3.5, ""), (-1, "driving", 3.5, ""), (-2, "parking", 2.5, "")], "");
    let at = |y_m: f64| OrientedBox::new(Pose::new(50.0, y_m, 0.0), 4.8, 1.9);
    assert!(map.is_free_to_park(&at(-4.6)) && map.is_free_to_park(&at(5.0)));
    assert!(!map.is_free_to_park(&at(-3.0)) && !map.is_free_to_park(&at(4.0)));
}
