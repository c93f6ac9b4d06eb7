//! Maps that are large in one construct of OpenDRIVE each: the cost of reading must grow as the text does, or the map must be
//! refused in words. Shared by `tests/it/hostile.rs`, which runs the program on them and measures, and by
//! `tests/it/scaling_maps.rs`, which looks at the outcome.

use core::f64::consts::{FRAC_PI_2, PI};
use core::fmt::{Display, Write as _};

use avastra::geometry::unit_vector;

/// What becomes of a large map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comes {
    /// It is read, however large.
    Read,
    /// It is refused from some size on, with a message that has these words.
    Refused(&'static str),
}

/// A construct: its name, the text of a map that has it so many times, and what becomes of a large one.
pub type Construct = (&'static str, fn(usize) -> String, Comes);

pub const CONSTRUCTS: &[Construct] = &[
    ("roads beside each other", parallel, Comes::Read),
    ("roads on top of each other", stacked, Comes::Read),
    ("roads that cross without a junction", crossing, Comes::Read),
    ("roads in a chain", chain, Comes::Read),
    ("links to nothing", broken_links, Comes::Read),
    ("a city", city, Comes::Read),
    ("lane sections", |size| sections(size, "", ""), Comes::Read),
    ("lane sections and curves", sections_and_curves, Comes::Read),
    ("lane sections and offsets", sections_and_offsets, Comes::Read),
    ("lane sections and limits", sections_and_limits, Comes::Read),
    ("bends one after the other", bends, Comes::Read),
    ("spirals that curl", spirals, Comes::Refused("has no lane")),
    ("parametric cubics", cubics, Comes::Read),
    ("polynomials", polynomials, Comes::Read),
    ("widths of a lane", widths, Comes::Read),
    ("lanes beside each other with widths", lanes_with_widths, Comes::Refused("bend and widen too often")),
    ("lanes beside each other", lanes, Comes::Read),
    ("markings", markings, Comes::Read),
    ("limits of a lane", limits, Comes::Read),
    ("long straight roads", long_roads, Comes::Refused("its lanes are too long")),
    ("long bends", long_bends, Comes::Refused("its curved lanes are too long")),
    ("wide long roads", wide_long_roads, Comes::Refused("its lanes are too long")),
    ("heights", heights, Comes::Read),
    ("lights of a lane", |size| signals(size, r#"type="1000001" dynamic="yes""#, ""), Comes::Read),
    ("lights before a junction", lights_before_a_junction, Comes::Read),
    ("stop signs of a lane", |size| signals(size, r#"type="206""#, ""), Comes::Read),
    ("lights for many lanes", lights_for_many_lanes, Comes::Refused("hold for more than")),
    ("signals that mean nothing", unknown_signals, Comes::Read),
    ("priority roads", priority_roads, Comes::Refused("junction `J` is too large")),
    ("junctions with controllers", controllers, Comes::Read),
    ("groups of a junction", groups, Comes::Refused("junction `J` is too large")),
    ("ways from one lane to one", |size| fan(size, ""), Comes::Refused("junction `J` is too large")),
    ("priorities of a junction", priorities, Comes::Read),
    ("ways inside a junction that part and join", diamonds, Comes::Refused("too many ways through it")),
    ("a junction behind short sections", short_approach, Comes::Read),
    ("crosswalks", crosswalks, Comes::Read),
    ("long walls", walls, Comes::Refused("corners and copies")),
    ("copies of a building", copies, Comes::Refused("corners and copies")),
    ("elements within each other", nested, Comes::Refused("holds no `road`")),
    ("namespaces within each other", namespaces, Comes::Refused("declare namespaces")),
];

/// What stands in a road beside its curves and lane sections.
struct With<'a> {
    link: &'a str,
    junction: &'a str,
    head: &'a str,
    in_lanes: &'a str,
    more: &'a str,
}

const NONE: With<'static> = With { link: "", junction: "", head: "", in_lanes: "", more: "" };

/// A lane goes on where it is.
const THROUGH: &str = r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#;
const WIDTH: &str = r#"<width sOffset="0" a="3.5"/>"#;

fn map(body: &str) -> String {
    format!("<OpenDRIVE><header revMajor=\"1\" revMinor=\"6\"/>\n{body}</OpenDRIVE>\n")
}

fn all(size: usize, one: impl Fn(usize) -> String) -> String {
    (0..size).map(one).collect()
}

fn road(id: impl Display, length_m: f64, plan: &str, sections: &str, with: &With) -> String {
    let With { link, junction, head, in_lanes, more } = with;
    let junction = if junction.is_empty() { "-1" } else { *junction };
    format!(
        "<road id=\"{id}\" length=\"{length_m}\" junction=\"{junction}\"><link>{link}</link>{head}\
         <planView>{plan}</planView><lanes>{in_lanes}{sections}</lanes>{more}</road>\n"
    )
}

fn curve(s_m: f64, [x, y, heading, length]: [f64; 4], shape: &str) -> String {
    format!(r#"<geometry s="{s_m}" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}</geometry>"#)
}

fn line(x: f64, y: f64, heading: f64, length: f64) -> String {
    curve(0.0, [x, y, heading, length], "<line/>")
}

fn lane(id: i32, inner: &str) -> String {
    format!(r#"<lane id="{id}" type="driving">{inner}</lane>"#)
}

fn section(s_m: f64, right: &str) -> String {
    format!(r#"<laneSection s="{s_m}"><right>{right}</right></laneSection>"#)
}

fn single() -> String {
    section(0.0, &lane(-1, WIDTH))
}

fn parallel(size: usize) -> String {
    map(&all(size, |n| road(n, 100.0, &line(0.0, 10.0 * n as f64, 0.0, 100.0), &single(), &NONE)))
}

fn stacked(size: usize) -> String {
    map(&all(size, |n| road(n, 100.0, &line(0.0, 0.0, 0.0, 100.0), &single(), &NONE)))
}

/// Each of one half crosses each of the other.
fn crossing(size: usize) -> String {
    let half = size / 2;
    let long_m = 10.0 * half as f64 + 20.0;
    let across = |name: &str, place: &dyn Fn(f64) -> [f64; 3]| {
        all(half, |n| {
            let [x, y, heading] = place(10.0 * n as f64);
            road(format!("{name}{n}"), long_m, &line(x, y, heading, long_m), &single(), &NONE)
        })
    };
    map(&(across("h", &|at| [-10.0, at, 0.0]) + &across("v", &|at| [at, -10.0, FRAC_PI_2])))
}

fn end(word: &str, kind: &str, id: impl Display, contact: &str) -> String {
    format!(r#"<{word} elementType="{kind}" elementId="{id}" contactPoint="{contact}"/>"#)
}

fn chain(size: usize) -> String {
    let lanes = section(0.0, &lane(-1, &format!("{THROUGH}{WIDTH}")));
    map(&all(size, |n| {
        let before = if n > 0 { end("predecessor", "road", n - 1, "end") } else { String::new() };
        let after = if n + 1 < size { end("successor", "road", n + 1, "start") } else { String::new() };
        let link = before + &after;
        road(n, 20.0, &line(20.0 * n as f64, 0.0, 0.0, 20.0), &lanes, &With { link: &link, ..NONE })
    }))
}

fn broken_links(size: usize) -> String {
    map(&all(size, |n| {
        let link = end("successor", "road", format!("no{n}"), "start");
        road(n, 20.0, &line(0.0, 10.0 * n as f64, 0.0, 20.0), &single(), &With { link: &link, ..NONE })
    }))
}

/// An arm of a junction: the street, the end that it touches with, and the direction in which it leaves.
type Arm = (String, &'static str, (i32, i32));

/// Blocks of 100 m: streets of two lane sections with a lane each way, and junctions with all turns. About `size` streets.
fn city(size: usize) -> String {
    const BLOCK_M: f64 = 100.0;
    const CORNER_M: f64 = 15.0;
    let side = ((size as f64 / 2.0).sqrt() as i32).max(2);
    let street_m = BLOCK_M - 2.0 * CORNER_M;
    let mut text = String::new();
    let mut arms: Vec<Vec<Arm>> = vec![Vec::new(); (side * side) as usize];
    let place = |x: i32, y: i32| (y * side + x) as usize;
    let both = |from: &str, to: &str| {
        let link = |id: i32| {
            let one = |word: &str, id: i32| format!(r#"<{word} id="{id}"/>"#);
            let before = if from.is_empty() { String::new() } else { one(from, id) };
            let after = if to.is_empty() { String::new() } else { one(to, id) };
            format!("<link>{before}{after}</link>{WIDTH}")
        };
        format!("<left>{}</left><right>{}</right>", lane(1, &link(1)), lane(-1, &link(-1)))
    };
    let halves = format!(
        r#"<laneSection s="0">{}</laneSection><laneSection s="{}">{}</laneSection>"#,
        both("", "successor"),
        street_m / 2.0,
        both("predecessor", "")
    );
    for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
        for (to_x, to_y, heading) in [(1, 0, 0.0), (0, 1, FRAC_PI_2)] {
            if x + to_x >= side || y + to_y >= side {
                continue;
            }
            let id = format!("{x}-{y}-{to_x}");
            let (here, there) = (place(x, y), place(x + to_x, y + to_y));
            let link = end("predecessor", "junction", here, "") + &end("successor", "junction", there, "");
            let link = link.replace(r#" contactPoint="""#, "");
            let begin = |at: i32, to: i32| f64::from(at) * BLOCK_M + f64::from(to) * CORNER_M;
            let plan = line(begin(x, to_x), begin(y, to_y), heading, street_m);
            text += &road(&id, street_m, &plan, &halves, &With { link: &link, ..NONE });
            arms[here].push((id.clone(), "start", (to_x, to_y)));
            arms[there].push((id, "end", (-to_x, -to_y)));
        }
    }
    for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
        let junction = place(x, y);
        let mut connections = String::new();
        for (from, at, (from_x, from_y)) in &arms[junction] {
            for (to, leaves_at, (to_x, to_y)) in arms[junction].iter().filter(|(to, ..)| to != from) {
                let id = format!("{from}+{to}");
                let from_at = |block: i32, arm: i32| f64::from(block) * BLOCK_M + f64::from(arm) * CORNER_M;
                let heading = match (from_x, from_y) {
                    (-1, _) => 0.0,
                    (1, _) => PI,
                    (_, -1) => FRAC_PI_2,
                    _ => -FRAC_PI_2,
                };
                let turn = from_y * to_x - from_x * to_y;
                let (length_m, shape) = match turn {
                    0 => (2.0 * CORNER_M, "<line/>".to_owned()),
                    _ => {
                        let curvature = f64::from(turn) / CORNER_M;
                        (CORNER_M * FRAC_PI_2, format!(r#"<arc curvature="{curvature}"/>"#))
                    }
                };
                let plan = curve(0.0, [from_at(x, *from_x), from_at(y, *from_y), heading, length_m], &shape);
                let from_lane = if *at == "start" { 1 } else { -1 };
                let to_lane = if *leaves_at == "start" { -1 } else { 1 };
                let link = format!(
                    r#"<link><predecessor id="{from_lane}"/><successor id="{to_lane}"/></link>{WIDTH}"#
                );
                let ends = end("predecessor", "road", from, at) + &end("successor", "road", to, leaves_at);
                let inside = junction.to_string();
                let with = With { link: &ends, junction: &inside, ..NONE };
                text += &road(&id, length_m, &plan, &section(0.0, &lane(-1, &link)), &with);
                connections += &connection(from, &id, from_lane);
            }
        }
        let _ = writeln!(text, r#"<junction id="{junction}" name="">{connections}</junction>"#);
    }
    map(&text)
}

fn connection(from: impl Display, through: impl Display, from_lane: i32) -> String {
    format!(
        "<connection incomingRoad=\"{from}\" connectingRoad=\"{through}\" contactPoint=\"start\">\
         <laneLink from=\"{from_lane}\" to=\"-1\"/></connection>"
    )
}

/// One road with a lane section each metre, at most 90 km.
fn sections(size: usize, head: &str, in_lanes: &str) -> String {
    sections_along(size, &line(0.0, 0.0, 0.0, length_of(size)), head, in_lanes)
}

fn length_of(size: usize) -> f64 {
    (size as f64).clamp(1.0, 90_000.0)
}

fn sections_along(size: usize, plan: &str, head: &str, in_lanes: &str) -> String {
    let length_m = length_of(size);
    let inner = lane(-1, &format!("{THROUGH}{WIDTH}"));
    let sections = all(size, |n| section(length_m * n as f64 / size as f64, &inner));
    map(&road(1, length_m, plan, &sections, &With { head, in_lanes, ..NONE }))
}

fn sections_and_curves(size: usize) -> String {
    let step_m = length_of(size) / size as f64;
    let plan = all(size, |n| {
        let at_m = step_m * n as f64;
        curve(at_m, [at_m, 0.0, 0.0, step_m], "<line/>")
    });
    sections_along(size, &plan, "", "")
}

fn sections_and_offsets(size: usize) -> String {
    let step_m = length_of(size) / size as f64;
    sections(size, "", &all(size, |n| format!(r#"<laneOffset s="{}" a="0"/>"#, step_m * n as f64)))
}

fn sections_and_limits(size: usize) -> String {
    let step_m = length_of(size) / size as f64;
    let limit = |n: usize| format!(r#"<type s="{}" type="town"><speed max="10"/></type>"#, step_m * n as f64);
    sections(size, &all(size, limit), "")
}

fn bends(size: usize) -> String {
    let (mut plan, mut x, mut y, mut heading) = (String::new(), 0.0_f64, 0.0_f64, 0.0_f64);
    let size = size.min(40_000);
    for n in 0..size {
        let (curvature, length) = (if n % 2 == 0 { 0.3 } else { -0.3 }, 2.0);
        let shape = format!(r#"<arc curvature="{curvature}"/>"#);
        plan += &curve(2.0 * n as f64, [x, y, heading, length], &shape);
        let turn = curvature * length;
        let (turned, forward) = (unit_vector(turn), unit_vector(heading));
        let (ahead, aside) = (turned.y / curvature, (1.0 - turned.x) / curvature);
        x += ahead * forward.x - aside * forward.y;
        y += ahead * forward.y + aside * forward.x;
        heading += turn;
    }
    map(&road(1, 2.0 * size as f64, &plan, &single(), &NONE))
}

fn shapes(size: usize, shape: &str) -> String {
    map(&all(size, |n| {
        let plan = curve(0.0, [0.0, 10.0 * n as f64, 0.0, 100.0], shape);
        road(n, 100.0, &plan, &single(), &NONE)
    }))
}

fn spirals(size: usize) -> String {
    shapes(size, r#"<spiral curvStart="-2" curvEnd="2"/>"#)
}

fn cubics(size: usize) -> String {
    let shape =
        r#"<paramPoly3 pRange="normalized" aU="0" bU="100" cU="0" dU="0" aV="0" bV="0" cV="3" dV="-2"/>"#;
    shapes(size, shape)
}

fn polynomials(size: usize) -> String {
    shapes(size, r#"<poly3 a="0" b="0" c="0.0003" d="0"/>"#)
}

/// A straight road of 100 m with these lanes.
fn straight(lanes: &str, more: &str) -> String {
    let with = With { more, ..NONE };
    map(&road(1, 100.0, &line(0.0, 0.0, 0.0, 100.0), &section(0.0, lanes), &with))
}

/// So many elements along 100 m; each is made of its station.
fn along(size: usize, one: impl Fn(f64) -> String) -> String {
    all(size, |n| one(100.0 * n as f64 / size as f64))
}

fn widths(size: usize) -> String {
    straight(&lane(-1, &along(size, |at_m| format!(r#"<width sOffset="{at_m}" a="3.5"/>"#))), "")
}

fn lanes_with_widths(size: usize) -> String {
    let each = |id: usize| {
        let shift_m = id as f64 * 1e-3;
        let widths =
            along(size / 100 + 1, |at_m| format!(r#"<width sOffset="{}" a="0.1"/>"#, at_m + shift_m));
        lane(-(id as i32) - 1, &widths)
    };
    straight(&all(100, each), "")
}

fn lanes(size: usize) -> String {
    let inner = section(0.0, &all(100, |id| lane(-(id as i32) - 1, WIDTH)));
    map(&all(size / 100 + 1, |n| road(n, 100.0, &line(0.0, 400.0 * n as f64, 0.0, 100.0), &inner, &NONE)))
}

fn markings(size: usize) -> String {
    let marks = along(size, |at_m| format!(r#"<roadMark sOffset="{at_m}" type="broken"/>"#));
    straight(&(lane(-1, &format!("{WIDTH}{marks}")) + &lane(-2, WIDTH)), "")
}

fn limits(size: usize) -> String {
    let speeds = along(size, |at_m| format!(r#"<speed sOffset="{at_m}" max="10"/>"#));
    straight(&lane(-1, &format!("{WIDTH}{speeds}")), "")
}

fn long(size: usize, shape: &str, lanes: usize) -> String {
    let inner = section(0.0, &all(lanes, |id| lane(-(id as i32) - 1, WIDTH)));
    map(&all(size, |n| {
        let plan = curve(0.0, [0.0, 700.0 * n as f64, 0.0, 90_000.0], shape);
        road(n, 90_000.0, &plan, &inner, &NONE)
    }))
}

fn long_roads(size: usize) -> String {
    long(size, "<line/>", 2)
}

fn long_bends(size: usize) -> String {
    long(size, r#"<arc curvature="0.00001"/>"#, 2)
}

fn wide_long_roads(size: usize) -> String {
    long(size, "<line/>", 100)
}

fn heights(size: usize) -> String {
    let heights = along(size, |at_m| format!(r#"<elevation s="{at_m}" a="{at_m}" b="0"/>"#));
    let head = format!("<elevationProfile>{heights}</elevationProfile>");
    map(&road(1, 100.0, &line(0.0, 0.0, 0.0, 100.0), &single(), &With { head: &head, ..NONE }))
}

fn signal(id: impl Display, at_m: f64, kind: &str, inner: &str) -> String {
    format!(r#"<signal id="{id}" s="{at_m}" t="-4" orientation="+" {kind}>{inner}</signal>"#)
}

fn signals(size: usize, kind: &str, link: &str) -> String {
    let signals = all(size, |n| signal(n, 100.0 * n as f64 / size as f64, kind, ""));
    let more = format!("<signals>{signals}</signals>");
    let with = With { link, more: &more, ..NONE };
    map(&road(1, 100.0, &line(0.0, 0.0, 0.0, 100.0), &single(), &with))
}

const LIGHT: &str = r#"type="1000001" dynamic="yes""#;

fn lights_before_a_junction(size: usize) -> String {
    let link = r#"<successor elementType="junction" elementId="J"/>"#;
    signals(size, LIGHT, link).replace("</OpenDRIVE>", r#"<junction id="J" name=""/></OpenDRIVE>"#)
}

fn lights_for_many_lanes(size: usize) -> String {
    let valid = r#"<validity fromLane="-100" toLane="-1"/>"#;
    let lights = along(size, |at_m| signal(at_m, at_m, LIGHT, valid));
    straight(&all(100, |id| lane(-(id as i32) - 1, WIDTH)), &format!("<signals>{lights}</signals>"))
}

fn unknown_signals(size: usize) -> String {
    let signals = all(size, |n| signal(n, 0.0, &format!(r#"type="x{n}""#), ""));
    straight(&lane(-1, WIDTH), &format!("<signals>{signals}</signals>"))
}

/// A short road inside a junction, with signals.
fn inside(id: impl Display, n: usize, junction: &str, signals: &str) -> String {
    let more = format!("<signals>{signals}</signals>");
    let with = With { junction, more: &more, ..NONE };
    road(id, 20.0, &line(0.0, 30.0 * n as f64, 0.0, 20.0), &single(), &with)
}

fn priority_roads(size: usize) -> String {
    let roads = all(size, |n| inside(n, n, "J", &signal(n, 1.0, r#"type="306""#, "")));
    map(&(roads + r#"<junction id="J" name=""/>"#))
}

fn controllers(size: usize) -> String {
    let lights =
        |n: usize| signal(format!("a{n}"), 1.0, LIGHT, "") + &signal(format!("b{n}"), 3.0, LIGHT, "");
    let roads = all(size, |n| inside(n, n, &format!("J{n}"), &lights(n)));
    let switch = |n: usize| ["a", "b"].map(|side| controller(&format!("{side}{n}"))).concat();
    let junctions = all(size, |n| {
        format!(r#"<junction id="J{n}" name=""><controller id="a{n}"/><controller id="b{n}"/></junction>"#)
    });
    map(&(roads + &all(size, switch) + &junctions))
}

fn controller(id: &str) -> String {
    format!(r#"<controller id="{id}"><control signalId="{id}"/></controller>"#)
}

fn groups(size: usize) -> String {
    let roads = all(size, |n| inside(n, n, "J", &signal(format!("g{n}"), 1.0, LIGHT, "")));
    let switches = all(size, |n| controller(&format!("g{n}")));
    let named = all(size, |n| format!(r#"<controller id="g{n}"/>"#));
    map(&format!(r#"{roads}{switches}<junction id="J" name="">{named}</junction>"#))
}

/// So many roads inside a junction, all from one lane to one; `priorities` stand in the junction.
fn fan(size: usize, priorities: &str) -> String {
    fan_behind(size, priorities, 20.0, &single())
}

fn fan_behind(size: usize, priorities: &str, before_m: f64, before: &str) -> String {
    let to_junction = |word: &str| format!(r#"<{word} elementType="junction" elementId="J"/>"#);
    let (from_link, to_link) = (to_junction("successor"), to_junction("predecessor"));
    let plan = line(-before_m, 0.0, 0.0, before_m);
    let from = road("a", before_m, &plan, before, &With { link: &from_link, ..NONE });
    let to = road("b", 20.0, &line(30.0, 0.0, 0.0, 20.0), &single(), &With { link: &to_link, ..NONE });
    let ends = end("predecessor", "road", "a", "end") + &end("successor", "road", "b", "start");
    let lanes = section(0.0, &lane(-1, &format!("{THROUGH}{WIDTH}")));
    let ways = all(size, |n| {
        let with = With { link: &ends, junction: "J", ..NONE };
        road(format!("c{n}"), 30.0, &line(0.0, 0.0, 0.0, 30.0), &lanes, &with)
    });
    let connections = all(size, |n| connection("a", format!("c{n}"), -1));
    map(&format!(r#"{from}{to}{ways}<junction id="J" name="">{connections}{priorities}</junction>"#))
}

fn priorities(size: usize) -> String {
    fan(size.min(900), &all(size, |n| format!(r#"<priority high="x{n}" low="y{n}"/>"#)))
}

/// Layers of two roads inside a junction, each linked to both of the next layer: the ways double with each.
fn diamonds(size: usize) -> String {
    let link = r#"<successor elementType="junction" elementId="J"/>"#;
    let from = road("a0", 20.0, &line(-20.0, 0.0, 0.0, 20.0), &single(), &With { link, ..NONE });
    let to = road("z", 20.0, &line(10.0 * size as f64, 0.0, 0.0, 20.0), &single(), &NONE);
    let layers = all(size, |n| {
        let plan = line(10.0 * n as f64, 0.0, 0.0, 10.0);
        let one = |side: &str| {
            let with = With { link, junction: "J", ..NONE };
            road(format!("{side}{}", n + 1), 10.0, &plan, &single(), &with)
        };
        one("l") + &one("r")
    });
    let connections = all(size, |n| {
        let before: &[&str] = if n == 0 { &["a"] } else { &["l", "r"] };
        let pairs = before.iter().flat_map(|from| ["l", "r"].map(|to| (from, to)));
        pairs.map(|(from, to)| connection(format!("{from}{n}"), format!("{to}{}", n + 1), -1)).collect()
    });
    let last = ["l", "r"].map(|side| connection(format!("{side}{size}"), "z", -1)).concat();
    map(&format!(r#"{from}{to}{layers}<junction id="J" name="">{connections}{last}</junction>"#))
}

/// A junction of 900 ways behind sections of 0.4 mm.
fn short_approach(size: usize) -> String {
    let inner = lane(-1, &format!("{THROUGH}{WIDTH}"));
    let sections = all(size, |n| section(0.0004 * n as f64, &inner));
    fan_behind(900, "", 0.0004 * size.max(1) as f64, &sections)
}

fn objects(objects: &str, length_m: f64) -> String {
    let more = format!("<objects>{objects}</objects>");
    let with = With { more: &more, ..NONE };
    map(&road(1, length_m, &line(0.0, 0.0, 0.0, length_m), &single(), &with))
}

fn crosswalks(size: usize) -> String {
    let one = |at_m: f64| {
        format!(r#"<object type="crosswalk" id="{at_m}" s="{at_m}" t="0" length="3" width="7" hdg="0"/>"#)
    };
    objects(&along(size, one), 100.0)
}

fn walls(size: usize) -> String {
    let repeat = r#"<repeat s="0" length="90000" distance="0" tStart="9" tEnd="9"/>"#;
    let one = |n: usize| format!(r#"<object type="wall" id="{n}" s="0" t="9" width="0.3">{repeat}</object>"#);
    objects(&all(size, one), 90_000.0)
}

fn copies(size: usize) -> String {
    let repeat = r#"<repeat s="0" length="1000" distance="1" tStart="9" tEnd="9"/>"#.repeat(size);
    let corners = all(size.max(3), |n| {
        let corner = unit_vector(2.0 * PI * n as f64 / size.max(3) as f64);
        format!(r#"<cornerLocal u="{}" v="{}"/>"#, corner.x, corner.y)
    });
    let building = format!(
        r#"<object type="building" id="b" s="0" t="9">{repeat}<outline>{corners}</outline></object>"#
    );
    objects(&building, 2000.0)
}

fn nested(size: usize) -> String {
    format!("<OpenDRIVE>{}{}</OpenDRIVE>", "<a>".repeat(size), "</a>".repeat(size))
}

fn namespaces(size: usize) -> String {
    let open = all(size, |n| format!(r#"<a xmlns:n{n}="u{n}">"#));
    let street = road(1, 100.0, &line(0.0, 0.0, 0.0, 100.0), &single(), &NONE);
    map(&format!("{open}{}{street}", "</a>".repeat(size)))
}
