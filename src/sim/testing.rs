//! Roads for the tests of this module and of `ads`, most of them made by hand.

use std::sync::Arc;

use crate::action::SpawnRequest;
use crate::geometry::Vec2;
use crate::model::vocabulary::{Body, Colour, LaneChoice, Level, Side, Then, TimeOfDay, Verb};
use crate::road::{RoadMap, Route};

use super::scene::Scene;
use super::world::{Start, World};

/// Two lanes each way along +x for 600 m, 3.5 m wide.
const STRAIGHT: &str = r#"<OpenDRIVE><header name="straight"/>
<road id="1" length="600" junction="-1"><link/><type s="0" type="town"><speed max="50" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="600"><line/></geometry></planView>
<lanes><laneSection s="0">
<left><lane id="2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>"#;

/// Noon, dry, signals at the beginning of their cycle.
pub fn start() -> Start {
    Start {
        time: TimeOfDay::Noon,
        rain: Level::None,
        fog: Level::None,
        wetness: Level::None,
        signal_phase_s: 0.0,
        seed: 7,
        ambient: 0,
    }
}

/// A road user that appears in the ego vehicle's lane, or from the right: on foot if the verb is.
pub fn request(verb: Verb, distance_m: f64, speed_mps: f64) -> SpawnRequest {
    let on_foot = matches!(verb, Verb::Walk | Verb::Stand);
    SpawnRequest {
        body: if on_foot { Body::Pedestrian } else { Body::Sedan },
        colour: Colour::Red,
        verb,
        lane: LaneChoice::Current,
        side: Side::Right,
        then: Then::Keep,
        speed_mps,
        distance_m,
    }
}

pub fn world(scene: &Arc<Scene>) -> World {
    World::new(Arc::clone(scene), &start())
}

/// The route runs on the inner lane (y = -1.75) from x = 100 to x = 500.
pub fn straight() -> Arc<Scene> {
    scene(STRAIGHT, ("1", -1, 100.0), ("1", -1, 500.0))
}

/// The way of the ego vehicle (y = -1.75, from x = 100 to x = 500) is crossed from the right by a
/// lane at x = 300, to the right of which a second lane ends at the junction. Signal 0 is the ego
/// vehicle's, signal 1 the other's; both stop lines are 15 m before the crossing.
pub fn crossing() -> Arc<Scene> {
    let road = |id: &str, [x, y, hdg, length]: [f64; 4], junction: i32, links: &str, more: &str| {
        let lane = |lane: i32| {
            let link = if junction < 0 {
                String::new()
            } else {
                r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#.into()
            };
            format!(
                r#"<lane id="{lane}" type="driving">{link}<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"#
            )
        };
        let second = if id == "4" { lane(-2) } else { String::new() };
        format!(
            r#"<road id="{id}" length="{length}" junction="{junction}"><link>{links}</link>
            <type s="0" type="town"><speed max="50" unit="km/h"/></type>
            <planView><geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}"><line/></geometry></planView>
            <lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
            <right>{}{second}</right></laneSection></lanes>{more}</road>"#,
            lane(-1)
        )
    };
    let joins = |from: &str, to: &str| {
        format!(
            r#"<predecessor elementType="road" elementId="{from}" contactPoint="end"/>
            <successor elementType="road" elementId="{to}" contactPoint="start"/>"#
        )
    };
    let into = r#"<successor elementType="junction" elementId="9"/>"#;
    let out = r#"<predecessor elementType="junction" elementId="9"/>"#;
    let light = |id: &str| {
        format!(
            r#"<signals><signal id="{id}" s="285" t="-5" orientation="+" dynamic="yes" type="1000001" subtype="-1"/></signals>"#
        )
    };
    let north = core::f64::consts::FRAC_PI_2;
    let roads = [
        road("1", [0.0, 0.0, 0.0, 290.0], -1, into, &light("ego")),
        road("2", [290.0, 0.0, 0.0, 20.0], 9, &joins("1", "3"), ""),
        road("3", [310.0, 0.0, 0.0, 290.0], -1, out, ""),
        road("4", [298.25, -300.0, north, 290.0], -1, into, &light("other")),
        road("5", [298.25, -10.0, north, 20.0], 9, &joins("4", "6"), ""),
        road("6", [298.25, 10.0, north, 290.0], -1, out, ""),
    ]
    .concat();
    let connection = |id: u32, incoming: &str, connecting: &str| {
        format!(
            r#"<connection id="{id}" incomingRoad="{incoming}" connectingRoad="{connecting}"
            contactPoint="start"><laneLink from="-1" to="-1"/></connection>"#
        )
    };
    let map = format!(
        r#"<OpenDRIVE><header name="crossing"/>{roads}
        <controller id="c0"><control signalId="ego"/></controller>
        <controller id="c1"><control signalId="other"/></controller>
        <junction id="9" name="crossing">{}{}<controller id="c0" sequence="0"/>
        <controller id="c1" sequence="1"/></junction></OpenDRIVE>"#,
        connection(0, "1", "2"),
        connection(1, "4", "5")
    );
    scene(&map, ("1", -1, 100.0), ("3", -1, 190.0))
}

/// Four one-lane streets through the origin, to the east, north, west and south, 200 m each way, that
/// cross without signals. The ego vehicle comes from the west and begins at x = -100.
pub fn four_arms() -> Arc<Scene> {
    let mut roads = String::new();
    let mut connections = String::new();
    for (arm, heading) in ["e", "n", "w", "s"].into_iter().zip(0..4) {
        let heading_rad = f64::from(heading) * core::f64::consts::FRAC_PI_2;
        let mut road = |id: &str, from_m: f64, length_m: f64, junction: i32, links: &str, lane_link: &str| {
            let (sin, cos) = libm::sincos(heading_rad);
            let (x, y) = (cos * from_m, sin * from_m);
            roads += &format!(
                r#"<road id="{id}-{arm}" length="{length_m}" junction="{junction}"><link>{links}</link>
                <type s="0" type="town"><speed max="50" unit="km/h"/></type>
                <planView><geometry s="0" x="{x}" y="{y}" hdg="{heading_rad}" length="{length_m}"><line/></geometry></planView>
                <lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
                <right><lane id="-1" type="driving">{lane_link}<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
                </laneSection></lanes></road>"#
            );
        };
        let joins = format!(
            r#"<predecessor elementType="road" elementId="in-{arm}" contactPoint="end"/>
            <successor elementType="road" elementId="out-{arm}" contactPoint="start"/>"#
        );
        let both = r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#;
        road("in", -210.0, 200.0, -1, r#"<successor elementType="junction" elementId="9"/>"#, "");
        road("through", -10.0, 20.0, 9, &joins, both);
        road("out", 10.0, 200.0, -1, r#"<predecessor elementType="junction" elementId="9"/>"#, "");
        connections += &format!(
            r#"<connection id="{heading}" incomingRoad="in-{arm}" connectingRoad="through-{arm}"
            contactPoint="start"><laneLink from="-1" to="-1"/></connection>"#
        );
    }
    let map = format!(
        r#"<OpenDRIVE><header name="four arms"/>{roads}<junction id="9" name="middle">{connections}</junction></OpenDRIVE>"#
    );
    scene(&map, ("in-e", -1, 110.0), ("out-e", -1, 150.0))
}

/// Two lanes to the east with a planted strip of 2 m between them; the route is on the left one.
pub fn divided() -> Arc<Scene> {
    let lane = |id: i32, kind: &str, width_m: f64| {
        format!(
            r#"<lane id="{id}" type="{kind}"><width sOffset="0" a="{width_m}" b="0" c="0" d="0"/></lane>"#
        )
    };
    let map = format!(
        r#"<OpenDRIVE><header name="divided"/><road id="1" length="600" junction="-1"><link/>
        <type s="0" type="town"><speed max="50" unit="km/h"/></type>
        <planView><geometry s="0" x="0" y="0" hdg="0" length="600"><line/></geometry></planView>
        <lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
        <right>{}{}{}</right></laneSection></lanes></road></OpenDRIVE>"#,
        lane(-1, "driving", 3.5),
        lane(-2, "median", 2.0),
        lane(-3, "driving", 3.5)
    );
    scene(&map, ("1", -1, 100.0), ("1", -1, 500.0))
}

/// Road 2, from its surveyed start to its goal.
pub fn corner() -> Arc<Scene> {
    let text = include_str!("../../scenarios/roads/corner.xodr");
    let map = RoadMap::from_opendrive("corner", text).expect("the map is sound");
    let nearest = |x_m, y_m, heading_rad| {
        map.nearest(Vec2::new(x_m, y_m), heading_rad, 1.0).expect("the survey lies on the map")
    };
    let route = Route::find(&map, nearest(0.0, 0.0, 2.377), nearest(-71.4, 145.5, -2.983));
    Arc::new(Scene::new(map.into(), route.expect("there is a way")))
}

/// A map with the way between two places on it.
pub fn scene(opendrive: &str, start: (&str, i32, f64), goal: (&str, i32, f64)) -> Arc<Scene> {
    let map = RoadMap::from_opendrive("test", opendrive).expect("the map is sound");
    let place = |(road, lane, s_m): (&str, i32, f64)| map.place(road, lane, s_m).expect("it is on the map");
    let route = Route::find(&map, place(start), place(goal)).expect("there is a way");
    Arc::new(Scene::new(map.into(), route))
}
