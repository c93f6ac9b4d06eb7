//! UN R157's border between what a competent and careful driver avoids and what it does not (Annex 3, Appendix 3): found by
//! bisection in the world with the built-in driver `cc`, and held against the regulation's model, computed apart.

use std::sync::Arc;

use avastra::action::{ActionTable, Situation};
use avastra::ads;
use avastra::geometry::{SMOOTH_STEP_SLOPE_MAX, smooth_step};
use avastra::model::{RulesInForce, Value};
use avastra::sim::{Scene, Start, VehicleParameters, World};

use crate::wishes::row;
use crate::world::loaded;

/// The situations as manoeuvres. `gap` decides: between the bumpers as the other begins.
const SPACE: &str = "
language 1
use \"motorway.ava\"
enum Lane = Left | Current | Right
manoeuvre enter(gap: Length, aside: Speed) {
  once npc.rear - ego.front <= gap within 60 s { lane: Current, aside: aside }
}
manoeuvre leave(gap: Length, aside: Speed) {
  once obstacle.rear - npc.front <= gap within 60 s { lane: Right, aside: aside }
}
manoeuvre brake(rate: Accel) { { speed: 0 m/s, rate: rate } }
action cut_in(
  any gap: Length in 0 m .. 150 m, any other: Speed in 1 m/s .. 36 m/s, any aside: Speed in 0.1 m/s .. 4 m/s
) {
  spawn Sedan ahead gap + 10 m { does: DriveAhead, lane: Left, speed: other, then: enter(gap, aside) }
}
action cut_out(
  any gap: Length in 0 m .. 150 m, any other: Speed in 1 m/s .. 37 m/s, any aside: Speed in 0.1 m/s .. 4 m/s
) {
  spawn Sedan as obstacle ahead other * 4 s + gap { does: DriveAhead, lane: Current, speed: 0 m/s }
  spawn Sedan ahead other * 2 s { does: DriveAhead, lane: Current, speed: other, then: leave(gap, aside), ignores: [Others] }
}
action decelerate(any gap: Length in 0 m .. 150 m, any other: Speed in 1 m/s .. 37 m/s, any rate: Accel in 1 m/s^2 .. 9 m/s^2) {
  spawn Sedan ahead gap { does: DriveAhead, lane: Current, speed: other, then: brake(rate) }
}
";

/// Width and length of the others, m, and the distance between the middles of two lanes, m.
const WIDTH_M: f64 = 1.85;
const LANE_M: f64 = 3.75;

/// The regulation's careful driver.
const WANDER_M: f64 = 0.375;
const PERCEIVES_S: f64 = 0.4;
const REACTS_S: f64 = 0.75;
const JERK_MPS3: f64 = 12.65;
const BRAKES_MPS2: f64 = 0.774 * 9.81;

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// The other's speed, km/h, and its greatest speed to the side, m/s.
    CutIn(f64, f64),
    /// The greatest speed to the side with which the leader leaves, m/s.
    CutOut(f64),
    /// How hard the leader brakes, m/s².
    Decelerate(f64),
}

/// Whether `cc` touches anybody in the world.
fn touches(table: &ActionTable, scenes: &[Arc<Scene>], road: usize, kind: Kind, gap_m: f64) -> bool {
    let space = table.space();
    let (scene, road) = (&scenes[road], &space.roads[road]);
    let own_mps = road.ego_mps;
    let (label, values) = match kind {
        Kind::CutIn(other_kmph, aside_mps) => {
            ("cut_in()", [("gap", gap_m), ("other", other_kmph / 3.6), ("aside", aside_mps)])
        }
        Kind::CutOut(aside_mps) => ("cut_out()", [("gap", gap_m), ("other", own_mps), ("aside", aside_mps)]),
        Kind::Decelerate(rate_mps2) => {
            ("decelerate()", [("gap", gap_m), ("other", own_mps), ("rate", rate_mps2)])
        }
    };
    let memory = space.initial_memory(1);
    let rules = RulesInForce::by_default(space);
    let mut world = World::new(Arc::clone(scene), &Start::drawn(space, road, &memory, 1));
    let situation = Situation {
        memory: &memory,
        road,
        rules: &rules,
        surroundings: &world,
        seed: 1,
        step: 0,
        happened_s: &[],
    };
    let values = values.map(|(name, value)| (Arc::from(name), Value::Number(value)));
    let draw = table.check(&situation, row(table, label), &values).expect("it is legal");
    world.carry_out(&draw).expect("there is room");
    let mut driver = (ads::by_name("cc").expect("it is one of ours").build)(scene, 1);
    while world.time_s() < 25.0 && world.ego().speed_mps > 0.0 {
        let control = driver.drive(&world.sensed());
        if !world.tick(&control).is_empty() {
            return true;
        }
    }
    false
}

/// Whether the regulation's driver, which does nothing else, touches the other: by its times and slopes alone.
fn touches_by_the_text(own_mps: f64, kind: Kind, gap_m: f64) -> bool {
    const STEP_S: f64 = 0.001;
    let lateral = |aside_mps: f64, at_s: f64| {
        LANE_M * smooth_step(at_s / (SMOOTH_STEP_SLOPE_MAX * LANE_M / aside_mps)).value
    };
    let reach_m = (WIDTH_M + VehicleParameters::MKZ.width_m) / 2.0;
    let (mut gap_m, mut own, mut seen_s): (f64, f64, Option<f64>) = (gap_m, own_mps, None);
    if let Kind::CutOut(_) = kind {
        // Two seconds behind the leader, whose length lies between.
        gap_m += own_mps * 2.0 + 4.8;
    }
    let mut at_s = 0.0;
    while own > 0.0 && at_s < 25.0 {
        let (other, aside_m, is_seen) = match kind {
            Kind::CutIn(other_kmph, aside_mps) => {
                let moved_m = lateral(aside_mps, at_s);
                let other = other_kmph / 3.6;
                (other, LANE_M - moved_m, moved_m > WANDER_M)
            }
            Kind::CutOut(aside_mps) => (0.0, 0.0, lateral(aside_mps, at_s) > WANDER_M),
            Kind::Decelerate(rate_mps2) => ((own_mps - rate_mps2 * at_s).max(0.0), 0.0, true),
        };
        if gap_m <= 0.0 && aside_m < reach_m {
            return true;
        }
        if own <= other && gap_m > 0.0 && !matches!(kind, Kind::Decelerate(_)) {
            return false;
        }
        if is_seen {
            seen_s.get_or_insert(at_s);
        }
        let brakes_s = seen_s.map_or(0.0, |seen_s| at_s - seen_s - PERCEIVES_S - REACTS_S);
        own -= (JERK_MPS3 * brakes_s).clamp(0.0, BRAKES_MPS2) * STEP_S;
        gap_m += (other - own) * STEP_S;
        at_s += STEP_S;
    }
    false
}

/// The least gap that is avoided, m.
fn border_m(touches: impl Fn(f64) -> bool) -> f64 {
    let (mut low_m, mut high_m) = (0.5, 149.0);
    if touches(high_m) {
        return f64::INFINITY;
    }
    while high_m - low_m > 0.1 {
        let middle_m = (low_m + high_m) / 2.0;
        if touches(middle_m) { low_m = middle_m } else { high_m = middle_m }
    }
    high_m
}

/// How much the two borders may differ, s at the speed at which the gap closes. Later: `cc` looks ten times a second, believes
/// only what it has seen twice, and tyres grip less at speed (0.75 at 130 km/h). Sooner: beside the regulation's reaction it
/// brakes comfortably for what will be in its lane.
const LATER_S: f64 = 0.5;
const SOONER_S: f64 = 0.8;
/// Slower vehicles take longer to change lanes than their speed to the side says, km/h.
const SLOWEST_KMPH: f64 = 18.0;

#[test]
fn the_border_of_what_a_careful_driver_avoids_is_the_regulations() {
    let space = loaded("scenarios/r157_border.ava", SPACE).space.expect("it is sound");
    let table = ActionTable::new(space);
    let scenes: Vec<Arc<Scene>> = table.space().roads.iter().map(|road| Arc::new(Scene::of(road))).collect();
    let slower = |aside_mps: f64| [20.0, 30.0, 40.0, 50.0].map(|kmph| Kind::CutIn(kmph, aside_mps));
    let mut cases: Vec<Kind> = [1.0, 1.8, 3.0].into_iter().flat_map(slower).collect();
    cases.extend([1.0, 2.0, 3.0].map(Kind::CutOut));
    cases.extend([6.0, 7.0, 8.0].map(Kind::Decelerate));
    let (mut compared, mut sum_s) = (0, 0.0);
    for (road, own) in table.space().roads.iter().enumerate() {
        for kind in &cases {
            // How much slower the other is, as it is written above.
            let kind = match *kind {
                Kind::CutIn(slower_kmph, aside_mps) => {
                    Kind::CutIn(own.ego_mps * 3.6 - slower_kmph, aside_mps)
                }
                kind => kind,
            };
            if matches!(kind, Kind::CutIn(other_kmph, _) if other_kmph < SLOWEST_KMPH) {
                continue;
            }
            let closing_mps = match kind {
                Kind::CutIn(other_kmph, _) => own.ego_mps - other_kmph / 3.6,
                Kind::CutOut(_) | Kind::Decelerate(_) => own.ego_mps,
            };
            let text_m = border_m(|gap_m| touches_by_the_text(own.ego_mps, kind, gap_m));
            let found_m = border_m(|gap_m| touches(&table, &scenes, road, kind, gap_m));
            let later_s = (found_m - text_m) / closing_mps;
            let words = format!("{} {kind:?}: {found_m:.1} m, by the text {text_m:.1} m", own.name);
            assert!((-SOONER_S..=LATER_S).contains(&later_s), "{words}: {later_s:.2} s");
            (compared, sum_s) = (compared + 1, sum_s + later_s.abs());
        }
    }
    let mean_s = sum_s / f64::from(compared);
    assert!(compared == 51 && mean_s < 0.4, "{mean_s} s in {compared}");
}
