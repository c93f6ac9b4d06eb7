//! `avastra ads check --drive`: how a driving system drives each road alone and in light traffic, under the law.
//!
//! A program that follows the protocol may still be unfit to be tested. Its adapter may drop the lights, take the vehicle's centre
//! for its rear axle, or turn nowhere. Alone on the road nothing excuses that, so it fails the check there. In traffic a fault may be
//! the driver's own, so it is told and no more. A program that crashes or hangs fails the check anywhere.

use std::collections::{BTreeMap, BTreeSet};

use avastra_campaign::episode::{self, Choice, End, EpisodeLog};
use avastra_campaign::run::{Arena, EpisodeSummary};
use avastra_drivers::external::message::{Answer, TrajectoryMessage};
use avastra_drivers::external::{ExternalSettings, Failure, Outcome};
use avastra_world::sim::{DT_S, EgoMotion, VehicleParameters, World};
use serde::Serialize;

use super::check::{Checks, Part, STDERR_LINES};
use crate::cli::output::plural;

/// Vehicles of light traffic.
const LIGHT: u32 = 6;
/// What was asked is compared with what was done after so long, s: long enough for the lags of pedals and wheel.
const AFTER_S: f64 = 1.0;

/// Farther beside the route at the median it drives beside its lane's middle, m: the next lane begins 0.7 m farther. Ours.
const BESIDE_M: f64 = 0.5;
/// Farther at the median from where its trajectories want it, it plans from another place, m. Sound planners have 0.2. Ours.
const ASTRAY_M: f64 = 0.5;
/// Where an adapter's author looks if the vehicle stands, and if it is elsewhere.
const WAITS: &str = "what it waits for: `internal.reason` in an answer shows on the page";
const REFERENCE: &str = "the route's `path` and `changes`, and whether the rear axle is its reference point";

/// All drives alone, or all in light traffic.
#[derive(Debug, Default, Serialize)]
pub(super) struct Drives {
    /// Vehicles of ordinary traffic.
    ambient: u32,
    drives: usize,
    arrived: usize,
    /// Drives that did not arrive, by how they ended.
    ended: BTreeMap<&'static str, usize>,
    /// Collisions that count, and all.
    counted: usize,
    collisions: usize,
    /// The first failure of the program.
    #[serde(skip)]
    failure: Option<Failure>,
    /// How often each requirement is breached, with the first place.
    breaches: BTreeMap<String, Breached>,
    /// How far the rear axle is beside the route, outside of lane changes, m.
    beside_m: Option<Spread>,
    /// How far the vehicle is after 1 s from where a trajectory wanted it, m.
    astray_m: Option<Spread>,
    /// How far the speed is after 1 s from what accelerations asked for, m/s.
    off_mps: Option<Spread>,
}

#[derive(Debug, Serialize)]
struct Breached {
    times: usize,
    road: String,
    seed: u64,
    first_s: f64,
}

/// The middle and the far end of some figures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Spread {
    median: f64,
    most_of_99: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Option<Spread> {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((values.len() as f64 * share) as usize);
        Some(Spread { median: *at(0.5)?, most_of_99: *at(0.99)? })
    }
}

/// Drives each road of the arena so often alone, and as often in light traffic, and says what is unfit.
pub(super) fn drive(
    checks: &mut Checks,
    arena: &Arena,
    settings: &ExternalSettings,
    times: u32,
) -> Vec<Drives> {
    let roads = plural(arena.roads(), "road");
    let mut found = Vec::new();
    for (stage, ambient) in [("alone", 0), ("traffic", LIGHT)] {
        let drives = Drives::of(arena, settings, (checks.seed, times), ambient);
        let place = match ambient {
            0 => format!("on {roads}"),
            _ => format!("on {roads} among {ambient} vehicles"),
        };
        let text = drives.in_words(&place);
        // Nothing excuses a failure of the program.
        let excuses = ambient > 0 && drives.failure.is_none();
        let word = match drives.faults() {
            0 => "ok",
            _ if excuses => "look",
            _ => "FAILS",
        };
        let failure = drives.failure.clone();
        let part = Part { stage, passed: word != "FAILS", found: text + &drives.advice(), failure };
        checks.note(word, part);
        found.push(drives);
    }
    found
}

/// The drive of an episode, as far as it is compared.
struct Drive {
    log: EpisodeLog,
    counted: usize,
    /// The ego vehicle after each tick.
    motions: Vec<EgoMotion>,
    /// Its offset from the route, outside of lane changes, m.
    beside_m: Vec<f64>,
}

impl Drive {
    /// Nobody does anything in it but ordinary traffic.
    fn new(arena: &Arena, road: usize, seed: u64, ambient: u32) -> Drive {
        let mut setup = arena.setup(road, seed);
        setup.start.ambient = ambient;
        let (mut motions, mut beside_m) = (Vec::new(), Vec::new());
        let log = episode::run_watched(&setup, &mut |_| Choice::Pass, &mut |world: &World, _, _| {
            motions.push(world.ego());
            let station_m = world.ego_station_m();
            let changes = &world.scene().route.changes;
            if !changes.iter().any(|change| (change.begin_m..change.latest_m).contains(&station_m)) {
                beside_m.push(world.ego_offset_m().abs());
            }
        });
        let summary = EpisodeSummary::judged(&setup, 0, &log);
        let counted = summary.collisions.iter().filter(|found| found.counted).count();
        Drive { log, counted, motions, beside_m }
    }

    /// The ego vehicle at a time of the episode, if it drove so long.
    fn at(&self, time_s: f64) -> Option<&EgoMotion> {
        self.motions.get(((time_s / DT_S).round() as usize).checked_sub(1)?)
    }

    /// What each second of answers asked for against what was done: places of trajectories in m, speeds in m/s.
    fn asked(&self, settings: &ExternalSettings) -> (Vec<f64>, Vec<f64>) {
        let (mut places_m, mut speeds_mps) = (Vec::new(), Vec::new());
        let Some(conversation) = &self.log.conversation else { return (places_m, speeds_mps) };
        let answers: Vec<&Answer> = conversation
            .exchanges
            .iter()
            .filter_map(|(_, outcome)| match outcome {
                Outcome::Answer(answer) if !matches!(**answer, Answer::Ready(_)) => Some(answer.as_ref()),
                _ => None,
            })
            .collect();
        let a_second = (AFTER_S / settings.period_s).round().max(1.0) as usize;
        for (number, second) in answers.chunks_exact(a_second).enumerate() {
            let asked_s = (number * a_second) as f64 * settings.period_s;
            let begin_s = asked_s + settings.latency_s;
            let (Some(before), Some(after)) = (self.at(begin_s), self.at(begin_s + AFTER_S)) else {
                continue;
            };
            if let Answer::Trajectory(wanted) = second[0] {
                let [x, y] = place_at(wanted, asked_s + AFTER_S);
                // The answer was obeyed late, so the vehicle is compared at the time that the trajectory names.
                let Some(there) = self.at(asked_s + AFTER_S) else { continue };
                places_m.push(libm::hypot(there.rear_axle.position.x - x, there.rear_axle.position.y - y));
            }
            let wanted: Option<Vec<f64>> = second.iter().map(|answer| acceleration(answer)).collect();
            if let Some(wanted) = wanted {
                let car = VehicleParameters::MKZ;
                let speed_mps = wanted.into_iter().fold(before.speed_mps, |speed_mps, accel_mps2| {
                    let possible = accel_mps2.clamp(-car.deceleration_mps2_max, car.acceleration_mps2_max);
                    (speed_mps + possible * settings.period_s).max(0.0)
                });
                speeds_mps.push((after.speed_mps - speed_mps).abs());
            }
        }
        (places_m, speeds_mps)
    }
}

/// The acceleration that an answer asks for, m/s²; `None` for a trajectory, and for pedals.
fn acceleration(answer: &Answer) -> Option<f64> {
    match answer {
        Answer::Acceleration(wanted) => Some(wanted.accel),
        Answer::Control(wanted) => wanted.accel,
        Answer::Trajectory(_) | Answer::Ready(_) | Answer::Error(_) => None,
    }
}

/// Where a trajectory wants the rear axle at a time of the episode.
fn place_at(wanted: &TrajectoryMessage, time_s: f64) -> [f64; 2] {
    let time_us = time_s * 1e6;
    let points = &wanted.points;
    let next = points.partition_point(|point| (point.t_us as f64) < time_us).clamp(1, points.len() - 1);
    let (from, to) = (&points[next - 1], &points[next]);
    let share = ((time_us - from.t_us as f64) / (to.t_us - from.t_us) as f64).clamp(0.0, 1.0);
    [from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)]
}

impl Drives {
    fn of(arena: &Arena, settings: &ExternalSettings, (seed, times): (u64, u32), ambient: u32) -> Drives {
        let mut all = Drives { ambient, ..Drives::default() };
        let (mut beside_m, mut places_m, mut speeds_mps) = (Vec::new(), Vec::new(), Vec::new());
        for road in 0..arena.roads() {
            for time in 0..times {
                let seed = seed.wrapping_add(u64::from(time));
                let drive = Drive::new(arena, road, seed, ambient);
                all.add(arena, &drive, seed);
                let (places, speeds) = drive.asked(settings);
                places_m.extend(places);
                speeds_mps.extend(speeds);
                beside_m.extend(drive.beside_m);
            }
        }
        let [beside_m, astray_m, off_mps] = [beside_m, places_m, speeds_mps].map(Spread::of);
        Drives { beside_m, astray_m, off_mps, ..all }
    }

    fn add(&mut self, arena: &Arena, drive: &Drive, seed: u64) {
        let log = &drive.log;
        self.drives += 1;
        self.counted += drive.counted;
        self.collisions += log.collisions.len();
        if self.failure.is_none() {
            self.failure.clone_from(&log.failure);
        }
        match log.end {
            End::Arrived => self.arrived += 1,
            end => *self.ended.entry(end.name()).or_default() += 1,
        }
        for breach in &log.breaches {
            let name = &arena.table().space().requirements[breach.requirement].name;
            let (road, first_s) = (log.road.clone(), breach.time_s);
            let known = self.breaches.entry(name.to_string());
            known.or_insert(Breached { times: 0, road, seed, first_s }).times += 1;
        }
    }

    /// How much should not be.
    fn faults(&self) -> usize {
        let breaches: usize = self.breaches.values().map(|breached| breached.times).sum();
        self.ended.values().sum::<usize>() + self.counted + breaches + usize::from(self.is_beside())
    }

    /// Whether it drives beside the route all along.
    fn is_beside(&self) -> bool {
        self.beside_m.is_some_and(|beside| beside.median > BESIDE_M)
    }

    fn in_words(&self, place: &str) -> String {
        let Drives { drives, arrived, counted, collisions, .. } = self;
        let ended = self.ended.iter().map(|(how, count)| format!(", {count} ended `{how}`"));
        let ended: String = ended.collect();
        let hit = match collisions {
            0 => "no collision".to_owned(),
            _ => format!("{}, {counted} counted", plural(*collisions, "collision")),
        };
        let breaches = self.breaches.iter().map(|(name, Breached { times, road, seed, first_s })| {
            format!(", {times} × `{name}` (first on {road} at {first_s:.1} s, seed {seed})")
        });
        let breaches: String = breaches.collect();
        let spread = |of: Option<Spread>, what: &str, unit: &str| {
            of.map_or_else(String::new, |Spread { median, most_of_99 }| {
                format!("\n{what}: {median:.2} {unit} at the median, {most_of_99:.2} in 99 of 100")
            })
        };
        let figures = [
            spread(self.beside_m, "beside the route", "m"),
            spread(self.astray_m, "after 1 s, from where the trajectory wants it", "m"),
            spread(self.off_mps, "after 1 s, from the speed that was asked for", "m/s"),
        ];
        let failure = self.failure.as_ref().map_or_else(String::new, |failure| {
            let lines = failure.stderr_lines(STDERR_LINES);
            let lines = lines.iter().map(|line| format!("\n| {line}"));
            format!("\n{}{}", failure.in_words(), lines.collect::<String>())
        });
        let figures = figures.concat() + &failure;
        format!(
            "{arrived} of {} {place} arrived{ended}; {hit}{breaches}{}",
            plural(*drives, "drive"),
            figures
        )
    }

    /// Where an adapter's author looks first.
    fn advice(&self) -> String {
        let ends = self.ended.keys().filter_map(|end| match *end {
            "left_the_map" | "astray" => Some(REFERENCE),
            "stalled" | "limit" => Some(WAITS),
            _ => None,
        });
        let breaches = self.breaches.keys().filter_map(|name| match name.as_str() {
            "stops_at_red" | "stops_at_yellow" => Some(
                "`signals` of `step`, and `stop_lines` of the route: `Way.stop` of the clients reads both",
            ),
            "stops_at_signs" => Some("`signs` of the route: `Way.stop` of the clients reads them"),
            "keeps_the_limit" => Some("the speed limit in each point of the route's `path`"),
            "drives_by_sight" => Some("`conditions.visibility` of `step`"),
            "keeps_to_its_side" | "stays_on_the_road" | "takes_its_turns" => Some(REFERENCE),
            "goes_on" | "goes_at_green" | "lets_traffic_flow" => Some(WAITS),
            _ => None,
        });
        let collisions = (self.counted > 0)
            .then_some("the place of `objects`: the middle of their outline, not its front or the rear axle");
        let is_elsewhere = self.is_beside() || self.astray_m.is_some_and(|astray| astray.median > ASTRAY_M);
        let elsewhere = is_elsewhere.then_some(REFERENCE);
        let advice: BTreeSet<&str> = ends.chain(breaches).chain(collisions).chain(elsewhere).collect();
        advice.iter().map(|text| format!("\nlook at {text}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_drivers::external::message::TrajectoryPoint;

    #[test]
    fn the_place_that_is_wanted_lies_between_the_points() {
        let point = |t_us, x| TrajectoryPoint { t_us, x, y: 0.0, heading: 0.0, v: 1.0, a: None };
        let points = vec![point(1_000_000, 0.0), point(2_000_000, 10.0), point(4_000_000, 30.0)];
        let wanted = TrajectoryMessage { seq: 0, points, internal: None };
        let at = |time_s| place_at(&wanted, time_s)[0];
        assert_eq!([at(0.5), at(1.5), at(2.0), at(3.0), at(9.0)], [0.0, 5.0, 10.0, 20.0, 30.0]);
    }

    #[test]
    fn a_spread_has_the_middle_and_the_far_end() {
        assert_eq!(Spread::of(Vec::new()), None);
        let found = Spread::of((0..200).map(f64::from).collect()).expect("there are values");
        assert_eq!((found.median, found.most_of_99), (100.0, 198.0));
        assert_eq!(Spread::of(vec![3.0]), Some(Spread { median: 3.0, most_of_99: 3.0 }));
    }
}
