//! Places of a map, texts and names as a source spells them.

use avastra_lang::syntax::keyword;
use avastra_lang::syntax::print_expr;
use avastra_road::{LanePlace, RoadMap};

use super::tree;

/// A place as a `road` names it: `lane 7/-1 at 80.25 m`, to the millimetre.
pub fn lane_point(map: &RoadMap, place: LanePlace) -> String {
    let lane = map.lane(place.lane);
    let road = &lane.key.road;
    let is_whole = !road.is_empty() && road.bytes().all(|byte| byte.is_ascii_digit());
    let road = if is_whole { road.clone() } else { quoted(road) };
    // Minus zero is zero.
    let s_m = lane.road_station_m(place.station_m).max(0.0) + 0.0;
    let s_m = format!("{s_m:.3}");
    format!("lane {road}/{} at {} m", lane.key.lane, s_m.trim_end_matches('0').trim_end_matches('.'))
}

/// A text in quotes.
pub fn quoted(text: &str) -> String {
    print_expr(&tree::text(text))
}

/// A text as a name of the language: letters, digits and `_`, with a letter in front, and no keyword.
pub fn identifier(text: &str) -> String {
    let kept: String =
        text.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
    let kept = kept.trim_matches('_');
    let is_name = kept.starts_with(|letter: char| letter.is_ascii_alphabetic());
    let name = if is_name { kept.to_owned() } else { format!("s_{kept}") };
    let is_keyword = keyword::DECLARATIONS.iter().chain(keyword::CLAUSES).any(|(word, _)| *word == name);
    if is_keyword { format!("{name}_") } else { name }
}
