//! Work that grows with the map. It is counted, because time would depend on the machine.

use std::fmt::Write as _;

use crate::RoadMap;
use crate::testing::{lanes, street};

/// Streets of 20 m in a row.
fn row(streets: u32) -> RoadMap {
    let both = lanes(&[(1, "driving", 3.0, ""), (-1, "driving", 3.0, "")]);
    let mut roads = String::new();
    for number in 0..streets {
        let at = [20.0 * f64::from(number), 0.0, 0.0, 20.0];
        write!(roads, "{}", street(&number.to_string(), at, "-1", "", &both, "")).unwrap();
    }
    RoadMap::from_opendrive("row", &format!("<OpenDRIVE>{roads}</OpenDRIVE>")).unwrap()
}

#[test]
fn lanes_are_held_against_those_nearby_alone() {
    let pairs = |streets: u32| {
        let map = row(streets);
        let (pairs, is_whole) = map.grid.sharing_cells(usize::MAX, |lane| Some(lane / 2));
        assert!(is_whole && pairs.is_sorted() && pairs.iter().all(|(a, b)| a / 2 < b / 2));
        // Each street at least against the next.
        assert!((1..map.lanes.len() / 2).all(|street| pairs.contains(&(2 * street - 2, 2 * street))));
        assert!(!map.grid.sharing_cells(pairs.len() / 2, |lane| Some(lane / 2)).1);
        pairs.len()
    };
    assert!(pairs(80) <= 2 * pairs(40) + 16, "{} and {}", pairs(40), pairs(80));
}

/// On a large map the lanes beside a place are looked up in cells; the result is the same as if every lane was tried.
#[test]
fn a_large_map_has_the_same_lanes_abreast() {
    let (large, small) = (row(400), row(40));
    for (index, lane) in small.lanes.iter().enumerate() {
        for station_m in [0.0, 3.0, 10.0, 20.0] {
            let abreast = |map: &RoadMap| {
                let at = map.place(&lane.key.road, lane.key.lane, 0.0).unwrap().lane;
                assert_eq!(at.0, index);
                format!("{:?} {:?}", map.abreast(at, station_m, 30.0), map.opposing(at, station_m))
            };
            // The last street of the small map has none behind it.
            assert!(abreast(&large) == abreast(&small) || index >= 78, "{index} at {station_m}");
        }
    }
}
