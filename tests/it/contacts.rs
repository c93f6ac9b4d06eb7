//! No contact is missed and none invented: first contacts are compared with those of a twin. The twin looks
//! at single moments, every hundredth of a millisecond, and then bisects the last step.
//!
//! The twin shares nothing with the code under test but the definition of the motion: between two
//! ticks boxes move straight and turn evenly. It has no broad phase, and it tells overlap from gap by
//! separating axes, where the code under test works with nearest points.

use avastra::ads::{Ads, ModularConfig};
use avastra::geometry::{OrientedBox, Pose, Sweep, Vec2, first_contact};
use avastra::rng;
use avastra::rng::{Rng, Stream};
use avastra::run::{Profile, Run};
use avastra::sim::{Contact, DT_S, Obstacle, World};

use crate::world::{run, under};

const CASES: u64 = 10_000;
/// Length of a case, ticks.
const TICKS: usize = 10;
/// Steps of the twin, s, and how many make a tick.
const FINE_S: f64 = 1e-5;
const FINE_PER_TICK: usize = 2000;
/// Boxes that never overlap by more than this only graze each other, m: such a contact may be found or not.
const GRAZE_M: f64 = 1e-3;
/// Largest gap between the boxes at a first contact, m.
const GAP_M: f64 = 1.1e-6;
/// Largest error of the time of a first contact, s.
const TIME_S: f64 = 1e-3;
/// Where the gap closes more slowly than this, m/s, the gap at the contact is compared and the time is not.
const CREEP_MPS: f64 = 0.005;

/// Two boxes and their poses at each tick.
struct Case {
    boxes: [OrientedBox; 2],
    poses: [Vec<Pose>; 2],
}

/// What the twin finds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Touch {
    /// Time of the first overlap, s.
    time_s: f64,
    /// Whether the boxes overlap by more than a graze later on.
    deep: bool,
}

/// What the code under test finds.
struct Found {
    time_s: f64,
    point: Vec2,
    normal: Vec2,
}

impl Case {
    fn ticks(&self) -> usize {
        self.poses[0].len() - 1
    }

    fn sweep(&self, which: usize, tick: usize) -> Sweep {
        let start = OrientedBox { pose: self.poses[which][tick], ..self.boxes[which] };
        Sweep { start, end: self.poses[which][tick + 1] }
    }

    /// The first contact as the world looks for it: tick by tick.
    fn found(&self) -> Option<Found> {
        (0..self.ticks()).find_map(|tick| {
            let first = first_contact(&self.sweep(0, tick), &self.sweep(1, tick))?;
            let time_s = (tick as f64 + first.fraction) * DT_S;
            Some(Found { time_s, point: first.point, normal: first.normal })
        })
    }

    /// A box at any time, straight and evenly from tick to tick.
    fn at(&self, which: usize, time_s: f64) -> OrientedBox {
        let place = (time_s / DT_S).clamp(0.0, self.ticks() as f64);
        let tick = (place as usize).min(self.ticks() - 1);
        let (from, to) = (&self.poses[which][tick], &self.poses[which][tick + 1]);
        let part = place - tick as f64;
        let pose = Pose {
            position: from.position * (1.0 - part) + to.position * part,
            heading_rad: from.heading_rad + turn_rad(from, to) * part,
        };
        OrientedBox { pose, ..self.boxes[which] }
    }

    fn separation_m(&self, time_s: f64) -> f64 {
        separation_m(&self.at(0, time_s), &self.at(1, time_s))
    }

    /// Distance between two boxes, m, from the corners of each to the other: boxes that are apart are nearest
    /// at a corner.
    fn distance_m(&self, time_s: f64) -> f64 {
        let [a, b] = [0, 1].map(|which| self.at(which, time_s));
        let from_corners = |of: &OrientedBox, to: &OrientedBox| {
            of.corners().iter().map(|corner| from_box_m(to, *corner)).fold(f64::INFINITY, f64::min)
        };
        from_corners(&a, &b).min(from_corners(&b, &a))
    }

    /// Looks at every fine step. If it may skip, it leaves out the steps in which the gap of the step before
    /// cannot have closed.
    fn twin(&self, skips: bool) -> Option<Touch> {
        let fastest_mps = (0..self.ticks())
            .map(|tick| (0..2).map(|which| self.corner_way_m(which, tick)).sum::<f64>() / DT_S)
            .fold(0.0, f64::max);
        let mut first = None;
        let mut step = 0;
        while step <= self.ticks() * FINE_PER_TICK {
            let gap_m = self.separation_m(step as f64 * FINE_S);
            if gap_m <= 0.0 {
                first.get_or_insert_with(|| self.halved(step));
            }
            if gap_m < -GRAZE_M {
                break;
            }
            let safe =
                if skips && gap_m > 0.0 { (gap_m / fastest_mps.max(1e-9) / FINE_S) as usize } else { 0 };
            step += safe.max(1);
        }
        first.map(|time_s| Touch { time_s, deep: step <= self.ticks() * FINE_PER_TICK })
    }

    /// The largest distance that a corner moves in a tick, m.
    fn corner_way_m(&self, which: usize, tick: usize) -> f64 {
        let (from, to) = (&self.poses[which][tick], &self.poses[which][tick + 1]);
        (to.position - from.position).norm() + turn_rad(from, to).abs() * self.boxes[which].radius_m()
    }

    /// The begin of the overlap that exists at a fine step, s.
    fn halved(&self, step: usize) -> f64 {
        let (mut apart_s, mut touching_s) = ((step as f64 - 1.0) * FINE_S, step as f64 * FINE_S);
        if apart_s < 0.0 {
            return 0.0;
        }
        for _ in 0..40 {
            let middle_s = (apart_s + touching_s) / 2.0;
            if self.separation_m(middle_s) <= 0.0 {
                touching_s = middle_s;
            } else {
                apart_s = middle_s;
            }
        }
        touching_s
    }
}

fn turn_rad(from: &Pose, to: &Pose) -> f64 {
    let turn_rad = to.heading_rad - from.heading_rad;
    turn_rad - core::f64::consts::TAU * (turn_rad / core::f64::consts::TAU).round()
}

/// Gap along the best separating axis, m; negative by the depth of an overlap.
fn separation_m(a: &OrientedBox, b: &OrientedBox) -> f64 {
    let between = b.pose.position - a.pose.position;
    let axes = [a, b].map(|shape| {
        let (sin, cos) = libm::sincos(shape.pose.heading_rad);
        [Vec2::new(cos, sin), Vec2::new(-sin, cos)]
    });
    let half_m = |shape: &OrientedBox, own: &[Vec2; 2], axis: &Vec2| {
        shape.half_length_m * own[0].dot(axis).abs() + shape.half_width_m * own[1].dot(axis).abs()
    };
    let along = |axis: &Vec2| between.dot(axis).abs() - half_m(a, &axes[0], axis) - half_m(b, &axes[1], axis);
    axes.iter().flatten().map(along).fold(f64::NEG_INFINITY, f64::max)
}

/// Distance from a point to a box, m.
fn from_box_m(shape: &OrientedBox, point: Vec2) -> f64 {
    let local = shape.pose.to_local(point);
    let outside_m = |at_m: f64, half_m: f64| (at_m.abs() - half_m).max(0.0);
    Vec2::new(outside_m(local.x, shape.half_length_m), outside_m(local.y, shape.half_width_m)).norm()
}

/// How far a line across `normal` lies between the boxes, m: not negative if it separates them.
fn between_m(a: &OrientedBox, b: &OrientedBox, normal: Vec2) -> f64 {
    let farthest_m = a.corners().iter().map(|corner| corner.dot(&normal)).fold(f64::NEG_INFINITY, f64::max);
    let nearest_m = b.corners().iter().map(|corner| corner.dot(&normal)).fold(f64::INFINITY, f64::min);
    nearest_m - farthest_m
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Crossing,
    Grazing,
    Fast,
    Corners,
    Turning,
    TouchAndLeave,
    FromContact,
    Sliding,
}

const KINDS: [Kind; 8] = [
    Kind::Crossing,
    Kind::Grazing,
    Kind::Fast,
    Kind::Corners,
    Kind::Turning,
    Kind::TouchAndLeave,
    Kind::FromContact,
    Kind::Sliding,
];

/// A case of a kind: two boxes touch, or nearly touch, at some moment; before and after it they move with
/// constant accelerations and yaw rates.
fn case(kind: Kind, rng: &mut Rng) -> Case {
    let mut between = |low: f64, high: f64| rng::between(rng, low, high);
    let half_turn = core::f64::consts::PI;
    let lengths_m = [between(0.4, 12.0), between(0.4, 12.0)];
    let widths_m = [between(0.4, 2.6), between(0.4, 2.6)];
    let place = Pose::new(between(-300.0, 300.0), between(-300.0, 300.0), between(-half_turn, half_turn));
    let first = OrientedBox::new(place, lengths_m[0], widths_m[0]);
    let heading_rad = match kind {
        Kind::Sliding => place.heading_rad,
        _ => between(-half_turn, half_turn),
    };
    let mut second = OrientedBox::new(
        Pose::new(place.position.x, place.position.y, heading_rad),
        lengths_m[1],
        widths_m[1],
    );
    let moment_s = if kind == Kind::FromContact { 0.0 } else { between(0.0, TICKS as f64 * DT_S) };
    // Direction from the first box to the second at that moment, and the gap between them.
    let towards = match kind {
        Kind::Sliding => place.left(),
        _ => avastra::geometry::unit_vector(between(-half_turn, half_turn)),
    };
    let gap_m = match kind {
        Kind::Grazing | Kind::Sliding => between(-0.005, 0.005),
        Kind::TouchAndLeave => between(-0.02, 0.002),
        Kind::FromContact => between(-0.1, 0.0),
        Kind::Turning => between(-0.3, 0.05),
        Kind::Crossing | Kind::Fast | Kind::Corners => between(-1.5, 0.5),
    };
    let (mut near_m, mut far_m) = (0.0, 20.0);
    for _ in 0..50 {
        let middle_m = (near_m + far_m) / 2.0;
        second.pose.position = place.position + towards * middle_m;
        if separation_m(&first, &second) < gap_m { near_m = middle_m } else { far_m = middle_m }
    }
    if kind == Kind::Corners {
        let (own, other) = (between(0.0, 4.0) as usize, between(0.0, 4.0) as usize);
        let apart = Vec2::new(between(-0.02, 0.02), between(-0.02, 0.02));
        second.pose.position += first.corners()[own] - second.corners()[other] + apart;
    }
    let aside = Vec2::new(-towards.y, towards.x);
    let velocity = match kind {
        Kind::Fast => avastra::geometry::unit_vector(between(-half_turn, half_turn)) * between(70.0, 150.0),
        Kind::Turning => Vec2::new(between(-3.0, 3.0), between(-3.0, 3.0)),
        Kind::Grazing => aside * between(-40.0, 40.0),
        Kind::Sliding => aside * between(-40.0, 40.0) + towards * between(-0.05, 0.05),
        Kind::TouchAndLeave => aside * between(-5.0, 5.0),
        _ => Vec2::new(between(-25.0, 25.0), between(-25.0, 25.0)),
    };
    let acceleration = match kind {
        Kind::TouchAndLeave => towards * between(5.0, 60.0),
        Kind::Sliding | Kind::Grazing => Vec2::zeros(),
        _ => Vec2::new(between(-8.0, 8.0), between(-8.0, 8.0)),
    };
    let yaw_radps = match kind {
        Kind::Turning => [between(-3.0, 3.0), between(-3.0, 3.0)],
        Kind::Sliding | Kind::Grazing | Kind::TouchAndLeave => [0.0, 0.0],
        _ => [between(-1.0, 1.0), between(-1.0, 1.0)],
    };
    // Both boxes move; what is left of the relative motion belongs to the second.
    let common = Vec2::new(between(-35.0, 35.0), between(-35.0, 35.0));
    let poses = |shape: &OrientedBox, velocity: Vec2, acceleration: Vec2, yaw_radps: f64| -> Vec<Pose> {
        let pose_at = |tick: usize| {
            let time_s = tick as f64 * DT_S - moment_s;
            let position = shape.pose.position + velocity * time_s + acceleration * (time_s * time_s / 2.0);
            let heading_rad = avastra::geometry::wrap_angle(shape.pose.heading_rad + yaw_radps * time_s);
            Pose { position, heading_rad }
        };
        (0..=TICKS).map(pose_at).collect()
    };
    Case {
        poses: [
            poses(&first, common, Vec2::zeros(), yaw_radps[0]),
            poses(&second, common + velocity, acceleration, yaw_radps[1]),
        ],
        boxes: [first, second],
    }
}

#[test]
fn ten_thousand_first_contacts_are_the_twins() {
    let (mut touching, mut grazing, mut missing) = (0, 0, 0);
    let mut worst_s = 0.0_f64;
    for number in 0..CASES {
        let kind = KINDS[(number % KINDS.len() as u64) as usize];
        let case = case(kind, &mut rng::stream(3, Stream::Traffic, number));
        let name = format!("case {number}, {kind:?}");
        let twin = case.twin(true);
        if number % 53 == 0 {
            assert_eq!(case.twin(false), twin, "{name}: the twin skips what it should have seen");
        }
        let Some(found) = case.found() else {
            assert!(twin.is_none_or(|touch| !touch.deep), "{name}: missed {twin:?}");
            missing += 1;
            continue;
        };
        let [a, b] = [0, 1].map(|which| case.at(which, found.time_s));
        // The reported place of the contact lies on both boxes.
        for shape in [&a, &b] {
            assert!(from_box_m(shape, found.point) <= GAP_M, "{name}: {} touches neither", found.point);
        }
        if twin.is_some_and(|touch| touch.time_s == 0.0) {
            assert_eq!((found.time_s, found.normal), (0.0, Vec2::zeros()), "{name}");
            touching += 1;
            continue;
        }
        // The reported side is right if a line across its normal still separates the boxes.
        assert!((found.normal.norm() - 1.0).abs() < 1e-9, "{name}: {}", found.normal);
        assert!(between_m(&a, &b, found.normal) >= -GAP_M, "{name}: {} separates nothing", found.normal);
        let closing_mps = closing_mps(&case, &found);
        match twin {
            Some(twin) if closing_mps > CREEP_MPS => {
                let error_s = (found.time_s - twin.time_s).abs();
                assert!(error_s < TIME_S, "{name}: {} s, {twin:?}", found.time_s);
                worst_s = worst_s.max(error_s);
                touching += 1;
            }
            _ => grazing += 1,
        }
    }
    println!("{touching} contacts, {grazing} grazes, {missing} misses; worst error {worst_s:e} s");
    // The kinds hold what their names say: most cases touch, and some do not.
    assert!(touching > CASES / 2 && grazing > 0 && missing > CASES / 20, "{touching} {grazing} {missing}");
}

/// How fast the gap closes just before a contact, by differences, m/s.
fn closing_mps(case: &Case, found: &Found) -> f64 {
    const BEFORE_S: f64 = 1e-6;
    let gap_m = |time_s: f64| between_m(&case.at(0, time_s), &case.at(1, time_s), found.normal);
    (gap_m(found.time_s - BEFORE_S) - gap_m(found.time_s)) / BEFORE_S
}

/// The obstacles and the ego vehicle after a tick.
type Before = (OrientedBox, Vec<Obstacle>);

/// A run against a driving system that sees almost nothing, so that there are contacts to find.
fn blind() -> Run {
    let usual = run(25, 5, &[]);
    let mut config = ModularConfig::default();
    config.perception.range_factor = 0.1;
    config.perception.blind_to_pedestrians = true;
    under(&usual, |conditions| conditions.profile = Some(Profile::new(&config)))
}

#[test]
fn the_contacts_of_whole_episodes_are_the_twins() {
    let run = blind();
    let (mut contacts, mut misses) = (0, 0);
    for number in 0..run.episodes() {
        let log = run.episode(number);
        let script = avastra::episode::Script::of_log(&log);
        let mut before: Option<Before> = None;
        let mut touched: Vec<u32> = Vec::new();
        let mut watch = |world: &World, _: &dyn Ads, found: &[Contact]| {
            if let Some((ego, obstacles)) = &before {
                // Every obstacle, near or far: brute force, with which the broad phase is compared.
                for was in obstacles.iter().filter(|was| !touched.contains(&was.id)) {
                    let Some(now) = world.obstacle(was.id) else { continue };
                    let case = Case {
                        poses: [
                            vec![ego.pose, world.ego_outline().pose],
                            vec![was.outline.pose, now.outline.pose],
                        ],
                        boxes: [*ego, was.outline],
                    };
                    let contact = found.iter().find(|contact| contact.obstacle == was.id);
                    match case.twin(true) {
                        Some(touch) => {
                            contacts += 1;
                            same(&case, &touch, contact.expect("a contact is missed"), world.ticks() - 1);
                        }
                        None => {
                            assert_eq!(contact, None, "episode {number}: invented");
                            misses += 1;
                        }
                    }
                }
            }
            touched.extend(found.iter().map(|contact| contact.obstacle));
            before = Some((world.ego_outline(), world.obstacles().copied().collect::<Vec<_>>()));
        };
        let again = run.play(number, &mut |moment| script.choose(moment), &mut watch);
        assert_eq!(again.collisions, log.collisions);
    }
    println!("{contacts} contacts and {misses} ticks without one");
    assert!(contacts >= 20 && misses > 10_000, "{contacts} {misses}");
}

/// Asserts that time, place, side and speed of a contact are those that the twin finds.
fn same(case: &Case, touch: &Touch, contact: &Contact, tick: u64) {
    let within_s = contact.time_s - tick as f64 * DT_S;
    assert!((within_s - touch.time_s).abs() < TIME_S, "{contact:?} {touch:?}");
    let [ego, other] = [0, 1].map(|which| case.at(which, within_s));
    for shape in [&ego, &other] {
        assert!(from_box_m(shape, contact.point) <= GAP_M, "{contact:?}");
    }
    assert!((ego.pose.to_world(contact.on_ego) - contact.point).norm() < 1e-9, "{contact:?}");
    // The closing speed is measured by differences of the distance just before. A fixed line would be wrong:
    // if the face that is met turns, the corner farthest out is not the corner that is met.
    let step_s = (within_s / 4.0).min(1e-5);
    if step_s > 0.0 {
        let gap_m = |steps: f64| case.distance_m(within_s - steps * step_s);
        let closing_mps = ((gap_m(2.0) - gap_m(1.0)) / step_s).max(0.0);
        assert!((contact.closing_speed_mps - closing_mps).abs() < 0.01, "{contact:?} {closing_mps}");
    }
}
