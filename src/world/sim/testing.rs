//! Roads for the tests of this module and of `ads`, most of them made by hand.

use std::sync::Arc;

use crate::action::SpawnRequest;
use avastra_base::geometry::Vec2;
use avastra_lang::model::START_MPS;
use avastra_lang::model::field::Said;
use avastra_lang::model::vocabulary::{Field, Level, TimeOfDay, Verb};
use avastra_road::testing::{lanes, road, street};
use avastra_road::{RoadMap, Route};

use crate::scene::Scene;
use crate::scene::traffic::TrafficProfile;
use crate::state::trace::{Trace, Traced};
use crate::state::world::{Start, World};

/// A driving lane without links.
fn plain(id: i32) -> (i32, &'static str, f64, &'static str) {
    (id, "driving", 3.5, "")
}

/// The lane of a road inside a junction, linked at both ends.
const THROUGH: (i32, &str, f64, &str) =
    (-1, "driving", 3.5, r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#);

/// Links of a road that leads into junction 9, and of one that leads out of it.
const INTO: &str = r#"<successor elementType="junction" elementId="9"/>"#;
const OUT: &str = r#"<predecessor elementType="junction" elementId="9"/>"#;

/// Links of a lane inside a junction.
fn link(from: i32, to: i32) -> String {
    format!(r#"<link><predecessor id="{from}"/><successor id="{to}"/></link>"#)
}

/// Links of a road inside a junction: from an end of one road to the start of another.
fn joins((from, contact): (&str, &str), to: &str) -> String {
    format!(
        r#"<predecessor elementType="road" elementId="{from}" contactPoint="{contact}"/>
        <successor elementType="road" elementId="{to}" contactPoint="start"/>"#
    )
}

/// A way from a road into a junction: through which road, entered at which end, and from which lane to which.
fn connection(incoming: &str, connecting: &str, contact: &str, (from, to): (i32, i32)) -> String {
    format!(
        r#"<connection id="{incoming}-{connecting}" incomingRoad="{incoming}" connectingRoad="{connecting}"
        contactPoint="{contact}"><laneLink from="{from}" to="{to}"/></connection>"#
    )
}

/// Noon, dry, signals at the beginning of their cycle.
pub fn start() -> Start {
    Start {
        ego_mps: START_MPS,
        time: TimeOfDay::Noon,
        sky: [Level::None; 3],
        signal_phase_s: 0.0,
        seed: 7,
        reactions: 0,
        reactions_from_s: 0.0,
        ambient: 0,
        traffic: TrafficProfile::default(),
    }
}

/// The digest of every bit that later ticks depend on.
pub fn digest(world: &World) -> [u8; 32] {
    let mut trace = Trace::default();
    world.trace(&mut trace);
    trace.digest()
}

pub fn request(verb: Verb, distance_m: f64, speed_mps: f64) -> SpawnRequest {
    SpawnRequest::new(verb, distance_m, speed_mps)
}

/// The same, told this as well.
pub fn told(request: SpawnRequest, field: Field, said: impl Into<Said>) -> SpawnRequest {
    SpawnRequest { told: request.told.with(field, said), ..request }
}

pub fn world(scene: &Arc<Scene>) -> World {
    World::new(Arc::clone(scene), &start())
}

/// Two lanes each way along +x for 600 m. The route runs on the inner one (y = -1.75) from x = 100 to x = 500.
pub fn straight() -> Arc<Scene> {
    along_x(&[2, 1, -1, -2].map(plain), "")
}

/// As [`straight`], with a route that begins on the outer lane (y = -5.25) and changes to the inner one.
pub fn changing() -> Arc<Scene> {
    let of = lanes(&[2, 1, -1, -2].map(plain));
    scene(&street("1", [0.0, 0.0, 0.0, 600.0], "-1", "", &of, ""), ("1", -2, 100.0), ("1", -1, 500.0))
}

/// A street of 600 m along +x with these lanes and other objects in it. The route leads from x = 100 to x = 500.
fn along_x(of: &[(i32, &str, f64, &str)], more: &str) -> Arc<Scene> {
    let road = street("1", [0.0, 0.0, 0.0, 600.0], "-1", "", &lanes(of), more);
    scene(&road, ("1", -1, 100.0), ("1", -1, 500.0))
}

/// The way of the ego vehicle (y = -1.75, from x = 100 to x = 500) is crossed from the right by a lane at x = 300. To
/// the right of that lane, a second lane ends at the junction. Signal 0 is the ego vehicle's, signal 1 the other's;
/// both stop lines are 15 m before the crossing.
pub fn crossing() -> Arc<Scene> {
    crossing_of("1000001", "1000001")
}

/// As [`crossing`], with signals of other types at the ego vehicle's street and at the other: lights or signs.
pub fn crossing_of(ego: &str, other: &str) -> Arc<Scene> {
    let signal = |id: &str, kind: &str| {
        format!(
            r#"<signals><signal id="{id}" s="285" t="-5" orientation="+" dynamic="yes" type="{kind}" subtype="-1"/></signals>"#
        )
    };
    let (ego, other) = (signal("ego", ego), signal("other", other));
    let (one, two, through) = (lanes(&[plain(-1)]), lanes(&[plain(-1), plain(-2)]), lanes(&[THROUGH]));
    let north = core::f64::consts::FRAC_PI_2;
    let roads = [
        street("1", [0.0, 0.0, 0.0, 290.0], "-1", INTO, &one, &ego),
        street("2", [290.0, 0.0, 0.0, 20.0], "9", &joins(("1", "end"), "3"), &through, ""),
        street("3", [310.0, 0.0, 0.0, 290.0], "-1", OUT, &one, ""),
        street("4", [298.25, -300.0, north, 290.0], "-1", INTO, &two, &other),
        street("5", [298.25, -10.0, north, 20.0], "9", &joins(("4", "end"), "6"), &through, ""),
        street("6", [298.25, 10.0, north, 290.0], "-1", OUT, &one, ""),
    ]
    .concat();
    let map = format!(
        r#"{roads}<controller id="c0"><control signalId="ego"/></controller>
        <controller id="c1"><control signalId="other"/></controller>
        <junction id="9" name="crossing">{}{}<controller id="c0" sequence="0"/>
        <controller id="c1" sequence="1"/></junction>"#,
        connection("1", "2", "start", (-1, -1)),
        connection("4", "5", "start", (-1, -1))
    );
    scene(&map, ("1", -1, 100.0), ("3", -1, 190.0))
}

/// Where the route of [`oncoming`] leads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    Straight,
    Left,
}

/// The way of the ego vehicle (from x = 100 to x = 500, with a lane each way) leads along +x at height 0. At x = 300
/// road 2, with one lane to the north, crosses it without a junction. Its ramps climb at 4 % to `height_m`.
pub fn overpass(height_m: f64) -> Arc<Scene> {
    let (both, one) = (lanes(&[plain(1), plain(-1)]), lanes(&[plain(-1)]));
    let ramp_m = height_m / 0.04;
    let (up_m, down_m) = (280.0 - ramp_m, 320.0);
    let heights = format!(
        r#"<elevationProfile><elevation s="0" a="0"/><elevation s="{up_m}" a="0" b="0.04"/>
        <elevation s="280" a="{height_m}"/><elevation s="{down_m}" a="{height_m}" b="-0.04"/>
        <elevation s="{}" a="0"/></elevationProfile>"#,
        down_m + ramp_m
    );
    let north = core::f64::consts::FRAC_PI_2;
    let roads = [
        street("1", [0.0, 0.0, 0.0, 600.0], "-1", "", &both, ""),
        street("2", [300.0, -300.0, north, 600.0], "-1", "", &one, &heights),
    ];
    scene(&roads.concat(), ("1", -1, 100.0), ("1", -1, 500.0))
}

/// A street of 600 m along +x with a lane each way that climbs at 10 %. The route leads from x = 100 to x = 500.
pub fn hill() -> Arc<Scene> {
    let climbs = r#"<elevationProfile><elevation s="0" a="20" b="0.1"/></elevationProfile>"#;
    along_x(&[1, -1].map(plain), climbs)
}

/// A street from west (road 1) to east (road 3) through a junction at the origin. It has a lane each way, 200 m to each
/// side. The ego vehicle comes from the west, 100 m before the junction. It goes straight on (through road 2) or turns
/// left to the north (road 5). A vehicle from the east goes straight on or turns left to the south (through road 8).
/// All have the same light.
pub fn oncoming(heading: Heading) -> Arc<Scene> {
    let (both, one) = (lanes(&[plain(1), plain(-1)]), lanes(&[plain(-1)]));
    let through = lanes(&[(1, "driving", 3.5, link(1, 1).as_str()), THROUGH]);
    let turn = |from: i32| lanes(&[(-1, "driving", 3.5, link(from, -1).as_str())]);
    let (pi, turned_m) = (core::f64::consts::PI, 5.0 * core::f64::consts::PI);
    let arc = |x_m: f64, heading_rad: f64| {
        format!(
            r#"<geometry s="0" x="{x_m}" y="0" hdg="{heading_rad}" length="{turned_m}"><arc curvature="0.1"/></geometry>"#
        )
    };
    let light = |id: &str, s_m: f64, orientation: &str| {
        format!(
            r#"<signals><signal id="{id}" s="{s_m}" t="0" orientation="{orientation}" dynamic="yes" type="1000001"/></signals>"#
        )
    };
    let (north, south) = (pi / 2.0, -pi / 2.0);
    let roads = [
        street("1", [-210.0, 0.0, 0.0, 200.0], "-1", INTO, &both, &light("west", 198.0, "+")),
        street("3", [10.0, 0.0, 0.0, 200.0], "-1", OUT, &both, &light("east", 2.0, "-")),
        street("5", [0.0, 10.0, north, 190.0], "-1", OUT, &one, ""),
        street("6", [0.0, -10.0, south, 190.0], "-1", OUT, &one, ""),
        street("2", [-10.0, 0.0, 0.0, 20.0], "9", &joins(("1", "end"), "3"), &through, ""),
        road("7", turned_m, "9", &joins(("1", "end"), "5"), &arc(-10.0, 0.0), &turn(-1), ""),
        road("8", turned_m, "9", &joins(("3", "start"), "6"), &arc(10.0, pi), &turn(1), ""),
    ]
    .concat();
    let connections = [
        connection("1", "2", "start", (-1, -1)),
        connection("3", "2", "end", (1, 1)),
        connection("1", "7", "start", (-1, -1)),
        connection("3", "8", "start", (1, -1)),
    ]
    .concat();
    let map = format!(
        r#"{roads}<controller id="c"><control signalId="west"/><control signalId="east"/></controller>
        <junction id="9" name="middle">{connections}<controller id="c" sequence="0"/></junction>"#
    );
    let goal = match heading {
        Heading::Straight => ("3", -1, 150.0),
        Heading::Left => ("5", -1, 150.0),
    };
    scene(&map, ("1", -1, 100.0), goal)
}

/// As [`straight`], with a zebra crossing 6 m wide where the ego vehicle's front is after 70 m.
pub fn zebra() -> Arc<Scene> {
    let zebra = r#"<objects><object type="crosswalk" id="zebra" s="172" t="0" length="6" width="16" hdg="0"/></objects>"#;
    along_x(&[2, 1, -1, -2].map(plain), zebra)
}

/// Four one-lane streets through the origin, to the east, north, west and south, 200 m each way, that
/// cross without signals. The ego vehicle comes from the west and begins at x = -100.
pub fn four_arms() -> Arc<Scene> {
    let (one, through) = (lanes(&[plain(-1)]), lanes(&[THROUGH]));
    let (mut roads, mut connections) = (String::new(), String::new());
    for (arm, heading) in ["e", "n", "w", "s"].into_iter().zip(0..4) {
        let heading_rad = f64::from(heading) * core::f64::consts::FRAC_PI_2;
        let (sin, cos) = libm::sincos(heading_rad);
        let at = |from_m: f64, length_m: f64| [cos * from_m, sin * from_m, heading_rad, length_m];
        let [into, inside, out] = ["in", "through", "out"].map(|part| format!("{part}-{arm}"));
        roads += &street(&into, at(-210.0, 200.0), "-1", INTO, &one, "");
        roads += &street(&inside, at(-10.0, 20.0), "9", &joins((into.as_str(), "end"), &out), &through, "");
        roads += &street(&out, at(10.0, 200.0), "-1", OUT, &one, "");
        connections += &connection(&into, &inside, "start", (-1, -1));
    }
    let map = format!(r#"{roads}<junction id="9" name="middle">{connections}</junction>"#);
    scene(&map, ("in-e", -1, 110.0), ("out-e", -1, 150.0))
}

/// Two lanes to the east with a planted strip of 2 m between them; the route is on the left one.
pub fn divided() -> Arc<Scene> {
    along_x(&[plain(-1), (-2, "median", 2.0, ""), plain(-3)], "")
}

/// Road 2, from its surveyed start to its goal.
pub fn corner() -> Arc<Scene> {
    let text = include_str!("../../../scenarios/roads/corner.xodr");
    let map = RoadMap::from_opendrive("corner", text).expect("the map is sound");
    let nearest = |x_m, y_m, heading_rad| {
        map.nearest(Vec2::new(x_m, y_m), heading_rad, 1.0).expect("the survey lies on the map")
    };
    let route = Route::find(&map, nearest(0.0, 0.0, 2.377), nearest(-71.4, 145.5, -2.983));
    Arc::new(Scene::new(map.into(), route.expect("there is a way")))
}

/// A map of these roads, with the route from a start to a goal: road, lane and station (m).
pub fn scene(roads: &str, start: (&str, i32, f64), goal: (&str, i32, f64)) -> Arc<Scene> {
    let text = format!(r#"<OpenDRIVE><header name="by hand"/>{roads}</OpenDRIVE>"#);
    let map = RoadMap::from_opendrive("test", &text).expect("the map is sound");
    let place = |(road, lane, s_m): (&str, i32, f64)| map.place(road, lane, s_m).expect("it is on the map");
    let route = Route::find(&map, place(start), place(goal)).expect("there is a way");
    Arc::new(Scene::new(map.into(), route))
}
