//! Right of way in a junction by lights, signs and the order of the lanes.

use avastra_lang::model::vocabulary::Priority;
use avastra_road::{LaneIndex, RoadMap};

use crate::scene::junction::{Order, order};
use crate::state::ruling::Rule;
use crate::state::sensed::SignalColour;

/// The priority where two lanes of a junction are in each other's way, with the lights as they are now.
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
    by_lights(is_red(ego), is_red(other)).unwrap_or_else(|| by_order(map, ego, other)).0
}

/// The priority by the lights; `None` if both may go.
pub fn by_lights(ego_red: bool, other_red: bool) -> Option<(Priority, Rule)> {
    match (ego_red, other_red) {
        (true, true) => Some((Priority::None, Rule::BothLights)),
        (true, false) => Some((Priority::Other, Rule::Light)),
        (false, true) => Some((Priority::Ego, Rule::Light)),
        (false, false) => None,
    }
}

/// The priority by signs and by the order of lanes.
pub fn by_order(map: &RoadMap, ego: LaneIndex, other: LaneIndex) -> (Priority, Rule) {
    let (ego_first, order) = order(map, ego, other);
    let rule = match order {
        Order::Signs => Rule::Sign,
        Order::Turning => Rule::Turning,
        Order::FromTheRight => Rule::FromTheRight,
        Order::SameSide => Rule::SameSide,
    };
    (if ego_first { Priority::Ego } else { Priority::Other }, rule)
}
