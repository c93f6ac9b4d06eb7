//! Text of made-up OpenDRIVE files, for tests here, in `sim`, `ads` and `oracle`.

use std::fmt::Write as _;

/// The lanes of a road of one section, each with its id, type and width (m), and what else stands in it.
pub fn lanes(lanes: &[(i32, &str, f64, &str)]) -> String {
    let side = |name: &str, left: bool| {
        let mut text = String::new();
        for (id, kind, width_m, more) in lanes.iter().filter(|(id, ..)| (*id > 0) == left) {
            write!(text, r#"<lane id="{id}" type="{kind}"><width a="{width_m}"/>{more}</lane>"#).unwrap();
        }
        if text.is_empty() { text } else { format!("<{name}>{text}</{name}>") }
    };
    format!(r#"<laneSection s="0">{}{}</laneSection>"#, side("left", true), side("right", false))
}

/// A straight road in a town; `at` is where it begins (x, y, heading) and its length.
pub fn street(id: &str, at: [f64; 4], junction: &str, links: &str, lanes: &str, more: &str) -> String {
    let [x, y, heading, length] = at;
    let plan =
        format!(r#"<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length}"><line/></geometry>"#);
    road(id, length, junction, links, &plan, lanes, more)
}

/// A road in a town along the curves of `plan`.
pub fn road(
    id: &str,
    length_m: f64,
    junction: &str,
    links: &str,
    plan: &str,
    lanes: &str,
    more: &str,
) -> String {
    format!(
        r#"<road id="{id}" length="{length_m}" junction="{junction}"><link>{links}</link>
        <type s="0" type="town"><speed max="50" unit="km/h"/></type>
        <planView>{plan}</planView><lanes>{lanes}</lanes>{more}</road>"#
    )
}
