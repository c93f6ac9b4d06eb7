//! Maps that are large in one construct each (`fuzz/scaling_maps.rs`): what becomes of them. How long it takes is measured in
//! `hostile`.

#[path = "../../fuzz/scaling_maps.rs"]
pub mod constructs;

use std::collections::BTreeSet;

use avastra::road::{RoadError, RoadMap};

use constructs::{CONSTRUCTS, Comes};

/// Sizes from which on a construct is refused, and at which its text is still small. Constructs whose limit is on the work
/// itself are not here: `hostile` measures them.
const REFUSED_FROM: [(&str, usize); 13] = [
    ("spirals that curl", 1),
    ("long straight roads", 300),
    ("long bends", 40),
    ("wide long roads", 8),
    ("lights for many lanes", 11_000),
    ("priority roads", 1001),
    ("groups of a junction", 1001),
    ("ways from one lane to one", 1001),
    ("ways inside a junction that part and join", 40),
    ("long walls", 60),
    ("copies of a building", 60),
    ("elements within each other", 1),
    ("namespaces within each other", 40),
];

fn text(construct: &str, size: usize) -> String {
    let (_, map, _) = CONSTRUCTS.iter().find(|(name, ..)| *name == construct).expect("it is there");
    map(size)
}

fn read(construct: &str, size: usize) -> Result<RoadMap, RoadError> {
    RoadMap::from_opendrive("scaled", &text(construct, size))
}

#[test]
fn a_few_of_each_construct_are_read() {
    for (name, map, comes) in CONSTRUCTS {
        match (RoadMap::from_opendrive("scaled", &map(5)), comes) {
            (Ok(_), _) => {}
            (Err(error), Comes::Refused(part)) => {
                assert!(error.to_string().contains(part), "{name}: {error}")
            }
            (Err(error), Comes::Read) => panic!("{name}: {error}"),
        }
    }
}

#[test]
fn what_is_too_much_is_refused_in_words_that_name_it() {
    for (name, size) in REFUSED_FROM {
        let (_, _, comes) =
            CONSTRUCTS.iter().find(|(construct, ..)| *construct == name).expect("it is there");
        let Comes::Refused(part) = comes else { panic!("{name} is read, however many") };
        let error = read(name, size).expect_err(name).to_string();
        assert!(error.starts_with("line ") && error.contains(part), "{name}: {error}");
    }
}

#[test]
fn of_many_crossings_without_a_junction_a_thousand_are_told() {
    let told = |size| {
        let map = read("roads that cross without a junction", size).expect("it is a map");
        map.crossings_without_junction()
    };
    let few = told(20);
    assert_eq!(few.len(), 100);
    assert!(few.iter().all(|warning| warning.contains("without a junction: nobody gives way")));
    let many = told(80);
    assert_eq!(many.len(), 1001, "1600 cross");
    assert!(many[1000].starts_with("so many roads lie over each other"), "{}", many[1000]);
}

#[test]
fn lights_of_a_group_share_a_stop_line_within_a_metre() {
    let lines = |construct, size| {
        let map = read(construct, size).expect("it is a map");
        assert_eq!(map.signals.len(), size);
        map.lanes[0].stop_lines.len()
    };
    // 100 m of a lane; without a junction each light is its own group.
    assert_eq!(lines("lights of a lane", 400), 400);
    assert_eq!(lines("lights before a junction", 50), 50);
    let shared = lines("lights before a junction", 400);
    assert!((75..=101).contains(&shared), "{shared}");
}

#[test]
fn the_lanes_of_a_city_meet() {
    let map = read("a city", 60).expect("it is a map");
    let (streets, ways): (Vec<_>, Vec<_>) = map.lanes.iter().partition(|lane| lane.junction.is_none());
    // 5 by 5 junctions; 40 streets of two sections and two lanes.
    assert_eq!((streets.len(), map.junctions.len()), (160, 25));
    assert!(ways.iter().all(|lane| lane.successors.len() == 1 && lane.predecessors.len() == 1));
    assert!(map.warnings.iter().all(|warning| warning.contains("no speed limit")), "{:?}", map.warnings);
    assert!(map.crossings_without_junction().is_empty());
    for lane in &map.lanes {
        for next in &lane.successors {
            let end = lane.centre.pose_at(lane.centre.length_m()).position;
            assert!((map.lane(*next).centre.pose_at(0.0).position - end).norm() < 1e-6, "{:?}", lane.key);
        }
    }
}

/// Takes seconds with an optimised build and a minute without:
/// `cargo test --release --test it -- --ignored a_whole_city`
#[test]
#[ignore = "takes a minute"]
fn a_whole_city_is_read() {
    let map = read("a city", 14_000).expect("it is a map");
    let sections: BTreeSet<(&str, usize)> =
        map.lanes.iter().map(|lane| (lane.key.road.as_str(), lane.key.section)).collect();
    let roads: BTreeSet<&str> = sections.iter().map(|(road, _)| *road).collect();
    assert!(roads.len() >= 50_000, "{} roads", roads.len());
    assert!(sections.len() >= 100_000, "{} sections", sections.len());
    assert!(map.crossings_without_junction().is_empty());
}
