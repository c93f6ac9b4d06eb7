//! Right of way: which of the ego vehicle and a road user has priority over the other.
//!
//! The rules are those of the Vienna Convention on Road Traffic (1968), as Estonia and California have them,
//! too.

use crate::model::vocabulary::Priority;
use crate::road::{LaneIndex, RoadMap};

use super::junction::goes_first;
use super::sense::SignalColour;

/// Who has priority where two lanes of a junction are in each other's way, with the lights as they are now.
///
/// `ego` and `other` are the lanes inside the junction on which the two vehicles are or will be. A red light
/// decides first; where both or neither have one, signs do, and then the lanes' own order (see `junction`).
/// `None` if both have a red light.
pub fn right_of_way(
    map: &RoadMap,
    colour: impl Fn(usize) -> SignalColour,
    ego: LaneIndex,
    other: LaneIndex,
) -> Priority {
    let is_red =
        |lane: LaneIndex| map.stop_line_of(lane).is_some_and(|line| colour(line.signal) == SignalColour::Red);
    by_lanes(map, (ego, is_red(ego)), (other, is_red(other)))
}

/// As [`right_of_way`], for two lanes and whether each was entered at a red light.
fn by_lanes(
    map: &RoadMap,
    (ego, ego_red): (LaneIndex, bool),
    (other, other_red): (LaneIndex, bool),
) -> Priority {
    match (ego_red, other_red) {
        (true, true) => Priority::None,
        (true, false) => Priority::Other,
        (false, true) => Priority::Ego,
        (false, false) if goes_first(map, ego, other) => Priority::Ego,
        (false, false) => Priority::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;

    fn inside(map: &RoadMap, road: &str) -> LaneIndex {
        LaneIndex(map.lanes.iter().position(|lane| lane.key.road == road).expect("it is there"))
    }

    #[test]
    fn a_red_light_decides_before_the_right() {
        use SignalColour::{Green, Red};
        let map = testing::crossing().map.clone();
        let (east, north) = (inside(&map, "2"), inside(&map, "5"));
        let decided = |colours: [SignalColour; 2]| {
            [
                right_of_way(&map, |signal| colours[signal], east, north),
                right_of_way(&map, |signal| colours[signal], north, east),
            ]
        };
        // Signal 0 is that of the lane to the east.
        assert_eq!(decided([Green, Red]), [Priority::Ego, Priority::Other]);
        assert_eq!(decided([Red, Green]), [Priority::Other, Priority::Ego]);
        assert_eq!(decided([Red, Red]), [Priority::None, Priority::None]);
        assert_eq!(decided([Green, Green]), [Priority::Other, Priority::Ego], "the one from the right");
    }

    #[test]
    fn signs_decide_before_the_right_and_lights_before_signs() {
        let decided = |ego: &str, other: &str| {
            let map = testing::crossing_of(ego, other).map.clone();
            right_of_way(&map, |_| SignalColour::Green, inside(&map, "2"), inside(&map, "5"))
        };
        let (light, stop, yields, priority, none) = ("1000001", "206", "205", "306", "274");
        assert_eq!(decided(none, none), Priority::Other, "the one from the right");
        assert_eq!(decided(priority, none), Priority::Ego);
        assert_eq!(decided(none, yields), Priority::Ego);
        assert_eq!(decided(priority, stop), Priority::Ego);
        assert_eq!(decided(yields, priority), Priority::Other);
        assert_eq!(decided(stop, stop), Priority::Other, "both signs say the same");
        assert_eq!(decided(light, light), Priority::Other);
    }
}
