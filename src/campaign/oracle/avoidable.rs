//! Could a careful driver have avoided this collision?
//!
//! The world is taken back to the *takeover*, by 8 s at most. The takeover is the onset of the hazard (see `hazard`). If the
//! ego vehicle had to give way, and the last moment at which it could still stop is earlier than the onset, the takeover is
//! that moment. All other road users then move as recorded until the recorded contact, and after it as they themselves
//! decide. The ego vehicle, the same car on the same road, is driven by each reference driver in turn, at most as fast as a
//! careful driver would have been there (`lawful`). A driver watches for 2 s before it takes over. It knows from the first
//! which lane changes of the route are begun or over, and which pedestrians the ego vehicle has seen at a crosswalk.
//!
//! 1. The careful drivers drive from the takeover.
//! 2. If none of them avoids the collision, and the ego vehicle slowed down to walking pace since, they drive from its
//!    slowest moment. A vehicle that has dealt with the hazard and then drives on into what stands in front of it
//!    could have stayed.
//! 3. If still none avoids it, evasive manoeuvres are tried, which begin at the takeover without any delay.
//!
//! **Shoves.** If a shove from another road user gave the ego vehicle most of its way to the contact, the takeover is when a
//! careful driver has reacted to the shove. Before the shove there was nothing to avoid.
//!
//! **Giving way.** Where the ego vehicle had to give way, a driver that takes over before it has begun a lane change begins
//! none without a look aside. The question is whether staying in the lane would have avoided the collision.
//!
//! **Hit from behind.** Where another vehicle ran into the rear of the ego vehicle, no driver goes faster than the ego
//! vehicle did, or leaves the way that it took. A vehicle need not flee from one behind it: keeping the distance
//! is the task of the one behind.
//!
//! Beside that, each careful driver is asked to the letter of UN R157 (`r157_letter`). From the first conflict of ways on,
//! the ego vehicle drives along its recorded path at its recorded speed until the model reacts. Then it only brakes. The
//! regulation speaks of a vehicle that keeps its lane and speed on a motorway. A careful driver in a town does more: it
//! slows down for bends and for road users that have priority before there is a risk. So the first replay counts, and the
//! letter is reported. Where only the first avoids a collision, foresight was missing rather than a reaction.
//!
//! A driver avoids the collision if, until 4 s after the recorded contact, it does not touch the obstacle and runs into no
//! other road user. If another road user runs into the ego vehicle, that contact does not count: recorded road users do not
//! give way to a car that is now elsewhere.

use std::collections::VecDeque;

use crate::episode;
use crate::episode::{Choice, EpisodeLog, Moment, Script, Setup};
use avastra_base::geometry::{OrientedBox, Pose, wrap_angle};
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, CAREFUL_REACTION_S, GRAVITY_MPS2, WALKING_MPS};
use avastra_drivers as ads;
use avastra_drivers::{Ads, Evasion};
use avastra_lang::model::vocabulary::Priority;
use avastra_lang::model::{Avoidability, EGO_ACCELERATION_MPS2_MAX};
use avastra_world::sim::{
    Contact, Control, DT_S, EgoMotion, FRAME_TICKS, VehicleParameters, World, pedals_for,
};

use super::hazard::{Onset, last_chance, onset, waiting_line_m};
use super::lawful::{COMFORTABLE_MPS2, Minded, careful_mps, lawful_mps, stops_within_mps};
use crate::episode::{run_into_from_behind, struck};

/// A driver that is held to a speed comes near to it in about this time, s. Ours: longer than the pedal's lag.
const CATCH_UP_S: f64 = 0.6;
/// A driver that gives way waits this far before the line, m, or at most this far beyond it. Ours.
const LINE_GAP_M: f64 = 1.0;
/// A vehicle that was run into from behind keeps its way if its middle stays this near to it, m. Ours.
const KEEPS_M: f64 = 1.0;
/// The careful drivers: a collision that one of them avoids is avoidable. UN R157's two performance models.
pub(super) const CAREFUL: [&str; 2] = ["cc", "fsm"];
/// Other drivers that are tried and reported.
const REPORTED: [&str; 2] = ["rss", "r157"];
/// No takeover is earlier than this before the contact, s. Ours: from 20 m/s a careful driver is at rest within 5 s.
const REWIND_S: f64 = 8.0;
/// Drivers watch for this long before they take over, s. Ours: longer than any reaction time.
const WATCH_S: f64 = 2.0;
/// How long after the recorded contact nothing must happen, s. Ours.
const AFTER_S: f64 = 4.0;

/// An ego vehicle that gains speed faster than this was shoved, m/s². Ours: twice what tyres give.
const SHOVE_MPS2: f64 = 2.0 * EGO_ACCELERATION_MPS2_MAX;

/// How verdicts are reached. Every run and study records it, so that one that was judged otherwise can be told apart; nothing
/// else is possible. All other constants of the judgement follow from the engine's number, which is recorded, too.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AvoidabilitySettings {
    careful: Vec<String>,
    reported: Vec<String>,
    rewind_s: f64,
    watch_s: f64,
    after_s: f64,
    shove_mps2: f64,
    creep_mps: f64,
}

impl Default for AvoidabilitySettings {
    fn default() -> AvoidabilitySettings {
        let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
        AvoidabilitySettings {
            careful: names(CAREFUL),
            reported: names(REPORTED),
            rewind_s: REWIND_S,
            watch_s: WATCH_S,
            after_s: AFTER_S,
            shove_mps2: SHOVE_MPS2,
            creep_mps: WALKING_MPS,
        }
    }
}

/// The verdict on one collision.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judgement {
    pub class: Avoidability,
    /// When the verdict's drivers take over, s.
    pub onset_s: f64,
    /// Reference drivers that avoid the collision.
    pub avoided_by: Vec<String>,
    /// Careful drivers that avoid it to the letter of UN R157, by braking alone.
    pub r157_letter: Vec<String>,
    /// The evasive manoeuvre that avoids it, looked for if no careful driver does.
    pub evasion: Option<String>,
}

/// Judges every collision of a log, in order, by playing its episode again up to the last of them. `setup` and `script`
/// are what the log was played from.
pub fn judge(setup: &Setup, script: &Script, log: &EpisodeLog) -> Vec<Judgement> {
    before_each(setup, script, log, judge_one)
}

/// As [`judge`], with the ways that the reference drivers took.
pub fn judge_with_drives(
    setup: &Setup,
    script: &Script,
    log: &EpisodeLog,
) -> Vec<(Judgement, Vec<ReferenceDrive>)> {
    before_each(setup, script, log, |recording, contact, met| {
        let judgement = judge_one(recording, contact, met);
        let from = recording.partition_point(|world| world.time_s() < judgement.onset_s);
        let case = Case::new(recording, from, contact);
        (judgement, case.drives())
    })
}

/// The last moment, s, at which a careful driver could have taken over and avoided the nth collision of a log; `None` if at no
/// moment of the last 8 s one could.
pub(super) fn avoidable_until(setup: &Setup, script: &Script, log: &EpisodeLog, index: usize) -> Option<f64> {
    let until_s = before_each(setup, script, log, |recording, contact, _| {
        if *contact != log.collisions[index].contact {
            return None;
        }
        let mut moments = (0..recording.len()).rev().step_by(FRAME_TICKS as usize);
        let last = moments.find(|from| !Case::new(recording, *from, contact).avoided_by(&CAREFUL).is_empty());
        last.map(|from| recording[from].time_s())
    });
    until_s.into_iter().flatten().next()
}

/// The drive of a reference driver from its takeover until it is clear, touches something, or leaves the way that it has
/// to keep.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceDrive {
    pub name: String,
    pub avoids: bool,
    /// Every 0.1 s.
    pub places: Vec<DrivenPlace>,
}

/// Where a reference driver has the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrivenPlace {
    pub time_s: f64,
    /// Centre of its outline.
    pub pose: Pose,
    pub speed_mps: f64,
}

/// Plays an episode again up to its last collision. Gives what `judge` makes of each: of the worlds before it, its contact,
/// and the outline of the ego vehicle there.
fn before_each<T>(
    setup: &Setup,
    script: &Script,
    log: &EpisodeLog,
    judge: impl Fn(&[World], &Contact, OrientedBox) -> T,
) -> Vec<T> {
    let mut judged = Vec::new();
    let Some(last) = log.collisions.last() else { return judged };
    let mut choose = |moment: &Moment<'_>| match moment.step > last.step {
        true => Choice::Stop,
        false => script.choose(moment),
    };
    let kept = ticks(REWIND_S) + ticks(WATCH_S);
    let mut recording: VecDeque<World> = VecDeque::with_capacity(kept);
    episode::run_watched(setup, &mut choose, &mut |world, _, contacts| {
        for contact in contacts {
            judged.push(judge(recording.make_contiguous(), contact, world.ego_outline()));
        }
        // Only the worlds before a contact are asked for.
        let next = log.collisions.get(judged.len());
        let is_soon = |time_s: f64| world.ticks() as usize + kept >= ticks(time_s);
        if next.is_some_and(|next| is_soon(next.contact.time_s - DT_S)) {
            if recording.len() == kept {
                recording.pop_front();
            }
            recording.push_back(world.clone());
        } else {
            recording.clear();
        }
    });
    assert_eq!(judged.len(), log.collisions.len(), "an episode played again is the same episode");
    judged
}

/// Judges one collision by the worlds before it.
pub fn judge_one(recording: &[World], contact: &Contact, met: OrientedBox) -> Judgement {
    let last = recording.len() - 1;
    // No driver can react to what was never in sight: it then takes over at the last moment.
    let onset = onset(recording, contact.obstacle, met).unwrap_or(Onset { first: last, conflict: last });
    let earliest = (last + 1).saturating_sub(ticks(REWIND_S));
    let reacts = shoved(recording, met).map(|shove| (shove + ticks(CAREFUL_REACTION_S)).min(last));
    let earliest = earliest.max(reacts.unwrap_or(0));
    let from = onset.first.min(last_chance(recording, contact, met).unwrap_or(last)).max(earliest);
    let mut case = Case::new(recording, from, contact);
    // The letter keeps the recorded path and speed, whoever had to give way.
    let to_the_letter = Case {
        from: onset.conflict.max(earliest),
        speed_mps_max: f64::INFINITY,
        looks_anew: false,
        ..case.clone()
    };
    let mut careful = case.avoided_by(&CAREFUL);
    if careful.is_empty()
        && let Some(slowest) = crept_from(recording, from)
    {
        let again = Case::new(recording, slowest, contact);
        careful = again.avoided_by(&CAREFUL);
        case = if careful.is_empty() { case } else { again };
    }
    let reported = case.avoided_by(&REPORTED);
    let brakes_in_time = |name: &&str| to_the_letter.brakes(reference(name, &recording[from]).as_mut());
    let r157_letter = names(CAREFUL.into_iter().filter(brakes_in_time));
    let evasion = if careful.is_empty() { case.evasion() } else { None };
    let class = if !careful.is_empty() {
        Avoidability::Avoidable
    } else if evasion.is_some() || !reported.is_empty() {
        Avoidability::BeyondReference
    } else {
        Avoidability::Unavoidable
    };
    let onset_s = recording[case.from].time_s();
    Judgement { class, onset_s, avoided_by: [careful, reported].concat(), r157_letter, evasion }
}

/// The last moment at which the ego vehicle was slowest since `from`, if it slowed down to walking pace.
fn crept_from(recording: &[World], from: usize) -> Option<usize> {
    let speed_mps = |index: &usize| recording[*index].ego().speed_mps;
    // The last of equal moments, because it is the nearest to what went wrong.
    let slowest = (from + 1..recording.len()).rev().min_by(|a, b| speed_mps(a).total_cmp(&speed_mps(b)))?;
    (speed_mps(&slowest) < WALKING_MPS).then_some(slowest)
}

/// The moment after the last shove from another road user, if that gave the ego vehicle more than half of its way to the contact;
/// `met` is its outline there. An earlier shove counts as the ego vehicle's own speed.
fn shoved(recording: &[World], met: OrientedBox) -> Option<usize> {
    let mut way_m = 0.0;
    let mut next = met.pose.position;
    for (index, pair) in recording.windows(2).enumerate().rev() {
        let here = pair[1].ego_outline().pose.position;
        way_m += (next - here).norm();
        next = here;
        let [before_mps, after_mps] = [&pair[0], &pair[1]].map(|world| world.ego().speed_mps);
        if after_mps - before_mps > SHOVE_MPS2 * DT_S {
            let own_m = before_mps * (recording.len() - index) as f64 * DT_S;
            return (own_m < way_m / 2.0).then_some(index + 1);
        }
    }
    None
}

/// The people at crosswalks who were in sight in these worlds.
fn minded(worlds: &[World]) -> Minded {
    let mut minded = Minded::default();
    if let Some(first) = worlds.first().filter(|world| !world.scene().route.crosswalks_m.is_empty()) {
        let mut sensed = first.sensed();
        for world in worlds.iter().rev().step_by(FRAME_TICKS as usize) {
            world.sense(&mut sensed);
            minded.notice(world, &sensed);
        }
    }
    minded
}

fn names<'a>(drivers: impl Iterator<Item = &'a str>) -> Vec<String> {
    drivers.map(str::to_owned).collect()
}

/// A fresh reference driver.
fn reference(name: &str, world: &World) -> Box<dyn Ads> {
    let entry = ads::by_name(name).expect("the reference drivers are in the registry");
    (entry.build)(world.scene(), 0)
}

/// A collision that is to be driven again.
#[derive(Clone)]
struct Case<'a> {
    recording: &'a [World],
    /// Index of the takeover.
    from: usize,
    obstacle: u32,
    /// Whether a driver that takes over decides anew about a lane change that has not begun: the ego vehicle had to give way.
    looks_anew: bool,
    /// No reference driver goes faster, m/s; infinite unless the ego vehicle was run into from behind.
    speed_mps_max: f64,
    /// The station of the line before which a careful driver waits, because it has to give way, m.
    waits_at_m: Option<f64>,
    /// Whether the drivers keep to the way that the ego vehicle took: it was run into from behind.
    keeps_way: bool,
    /// The people at crosswalks whom the ego vehicle has seen before the takeover.
    minded: Minded,
    /// Those of them for whom it should have slowed down by then: seen for as long as a driver watches.
    minded_before: Minded,
}

impl<'a> Case<'a> {
    fn new(recording: &'a [World], from: usize, contact: &Contact) -> Case<'a> {
        let keeps_way = run_into_from_behind(contact, &VehicleParameters::MKZ);
        let speed_mps_max = match keeps_way {
            true => recording[from..].iter().map(|world| world.ego().speed_mps).fold(0.0, f64::max),
            false => f64::INFINITY,
        };
        let looks_anew = contact.ruling.priority == Priority::Other;
        let is_before =
            |line_m: &f64| VehicleParameters::MKZ.front_m(recording[from].ego_station_m()) < *line_m;
        let line_m = recording.last().and_then(|world| waiting_line_m(world, contact));
        Case {
            recording,
            from,
            obstacle: contact.obstacle,
            looks_anew,
            speed_mps_max,
            waits_at_m: line_m.filter(is_before),
            keeps_way,
            minded: minded(&recording[..=from]),
            minded_before: minded(&recording[..from.saturating_sub(ticks(WATCH_S))]),
        }
    }

    /// Those of the reference drivers that avoid the collision.
    fn avoided_by(&self, drivers: &[&'static str]) -> Vec<String> {
        let avoids = |name: &&str| self.avoids(reference(name, &self.recording[self.from]).as_mut());
        names(drivers.iter().copied().filter(avoids))
    }

    /// Whether a driver that watches first avoids the collision.
    fn avoids(&self, driver: &mut dyn Ads) -> bool {
        self.show(driver);
        self.drive(driver, &mut |world| self.is_on_way(world))
    }

    /// Whether the ego vehicle is where it may be: anywhere, unless it has to keep to its way.
    fn is_on_way(&self, world: &World) -> bool {
        if !self.keeps_way {
            return true;
        }
        let here = world.ego_outline().pose.position;
        // Beyond the last place of the recording it goes on as it looks there.
        let [.., last] = self.recording else { return true };
        let ahead = last.ego_outline().pose.to_local(here);
        let is_near = |world: &World| (world.ego_outline().pose.position - here).norm() < KEEPS_M;
        (ahead.x > 0.0 && ahead.y.abs() < KEEPS_M) || self.recording[self.from..].iter().any(is_near)
    }

    /// The drives of all reference drivers.
    fn drives(&self) -> Vec<ReferenceDrive> {
        let drive = |name: &str| {
            let mut driver = reference(name, &self.recording[self.from]);
            let mut places = Vec::new();
            self.show(driver.as_mut());
            let avoids = self.drive(driver.as_mut(), &mut |world| {
                let (time_s, pose) = (world.time_s(), world.ego_outline().pose);
                places.push(DrivenPlace { time_s, pose, speed_mps: world.ego().speed_mps });
                self.is_on_way(world)
            });
            ReferenceDrive { name: name.to_owned(), avoids, places }
        };
        CAREFUL.into_iter().chain(REPORTED).map(drive).collect()
    }

    /// Shows a driver the time before the takeover.
    fn show(&self, driver: &mut dyn Ads) {
        let watched = self.from - self.from.min(ticks(WATCH_S));
        let mut sensed = self.recording[watched].sensed();
        for world in &self.recording[watched..self.from] {
            world.sense(&mut sensed);
            driver.drive(&sensed);
        }
    }

    /// Whether a driver's model avoids the collision to the letter of UN R157: by braking on the recorded path,
    /// from the recorded speed. After the recorded contact the driver drives on by itself.
    fn brakes(&self, driver: &mut dyn Ads) -> bool {
        self.show(driver);
        let recording = &self.recording[self.from..];
        let mut world = recording[0].clone();
        let mut sensed = world.sensed();
        let mut held = RecordedThenBraking::new(recording);
        let mut minded = self.minded.clone();
        for recorded in &recording[1..] {
            world.sense(&mut sensed);
            minded.notice(&world, &sensed);
            driver.drive(&sensed);
            let grip_mps2 = world.conditions().friction * GRAVITY_MPS2;
            let motion = held.step(recorded.ego(), driver.braking_mps2().min(grip_mps2));
            if self.is_hit(world.tick_placed(motion, recorded)) {
                return false;
            }
        }
        self.is_clear_after(&mut world, driver, minded, &mut |_| true)
    }

    /// The first manoeuvre that avoids the collision on the road, in words.
    fn evasion(&self) -> Option<String> {
        let start = &self.recording[self.from];
        let mut manoeuvres = Evasion::all(start.scene());
        let starts_on_road = is_on_road(start);
        let free = Case { speed_mps_max: f64::INFINITY, keeps_way: false, ..self.clone() };
        let found = manoeuvres.find(|manoeuvre| {
            let mut driver = manoeuvre.clone();
            free.drive(&mut driver, &mut |world| !starts_on_road || is_on_road(world))
        })?;
        Some(found.describe())
    }

    /// Drives from the takeover on; `false` if there is a collision, or a world is not `allowed`.
    fn drive(&self, driver: &mut dyn Ads, allowed: &mut dyn FnMut(&World) -> bool) -> bool {
        let start = &self.recording[self.from];
        let mut minded = self.minded.clone();
        let mut world = start.with_ego_at_most(lawful_mps(start, &self.minded_before));
        let mut sensed = world.sensed();
        if self.looks_anew {
            driver.take_over(&sensed);
        }
        for recorded in &self.recording[self.from + 1..] {
            world.sense(&mut sensed);
            minded.notice(&world, &sensed);
            let control = self.slowed(driver.drive(&sensed), &world, &minded);
            if self.is_hit(world.tick_recorded(&control, recorded)) || !self.is_fine(&world, allowed) {
                return false;
            }
        }
        self.is_clear_after(&mut world, driver, minded, allowed)
    }

    /// Whether nothing happens for some time after the recorded contact.
    fn is_clear_after(
        &self,
        world: &mut World,
        driver: &mut (impl Ads + ?Sized),
        mut minded: Minded,
        allowed: &mut dyn FnMut(&World) -> bool,
    ) -> bool {
        let mut sensed = world.sensed();
        for _ in 0..ticks(AFTER_S) {
            world.sense(&mut sensed);
            minded.notice(world, &sensed);
            let control = self.slowed(driver.drive(&sensed), world, &minded);
            if self.is_hit(world.tick(&control)) || !self.is_fine(world, allowed) {
                return false;
            }
        }
        true
    }

    /// A command with which the ego vehicle goes no faster than a careful driver does here.
    fn slowed(&self, control: Control, world: &World, minded: &Minded) -> Control {
        let front_m = VehicleParameters::MKZ.front_m(world.ego_station_m());
        // One that stops a little too late waits there.
        let waits = self.waits_at_m.filter(|line_m| *line_m + LINE_GAP_M > front_m);
        let waits_mps = waits.map_or(f64::INFINITY, |line_m| {
            stops_within_mps(line_m - front_m - LINE_GAP_M, 0.0, COMFORTABLE_MPS2)
        });
        let most_mps = self.speed_mps_max.min(careful_mps(world, minded)).min(waits_mps);
        // Harder than comfortably, where the line comes up too soon for that.
        let slows_mps2 = if waits_mps <= most_mps { CAREFUL_BRAKING_MPS2 } else { COMFORTABLE_MPS2 };
        let wanted_mps2 = (most_mps - world.ego().speed_mps) / CATCH_UP_S;
        if wanted_mps2 < -COMFORTABLE_MPS2 / 2.0 {
            let (_, brake_pct) = pedals_for(wanted_mps2.max(-slows_mps2));
            return Control { throttle_pct: 0.0, brake_pct: control.brake_pct.max(brake_pct), ..control };
        }
        let (throttle_pct, _) = pedals_for(wanted_mps2);
        Control { throttle_pct: control.throttle_pct.min(throttle_pct), ..control }
    }

    fn is_hit(&self, contacts: &[Contact]) -> bool {
        contacts
            .iter()
            .any(|contact| contact.obstacle == self.obstacle || !struck(contact, &VehicleParameters::MKZ))
    }

    fn is_fine(&self, world: &World, allowed: &mut dyn FnMut(&World) -> bool) -> bool {
        !world.ticks().is_multiple_of(FRAME_TICKS) || allowed(world)
    }
}

/// An ego vehicle that moves as recorded until a model brakes, and from then on only brakes, on the recorded path.
struct RecordedThenBraking<'a> {
    recording: &'a [World],
    /// Way to each recorded place, m.
    ways_m: Vec<f64>,
    tick: usize,
    /// Speed and way since the model brakes; `None` before.
    braked: Option<(f64, f64)>,
}

impl<'a> RecordedThenBraking<'a> {
    fn new(recording: &'a [World]) -> RecordedThenBraking<'a> {
        let mut ways_m = vec![0.0];
        for pair in recording.windows(2) {
            let step = pair[1].ego().rear_axle.position - pair[0].ego().rear_axle.position;
            ways_m.push(ways_m[ways_m.len() - 1] + step.norm());
        }
        RecordedThenBraking { recording, ways_m, tick: 0, braked: None }
    }

    /// The motion at the end of the next tick; `recorded` is the recorded one.
    fn step(&mut self, recorded: EgoMotion, braking_mps2: f64) -> EgoMotion {
        let before_mps =
            self.braked.map_or(self.recording[self.tick].ego().speed_mps, |(speed_mps, _)| speed_mps);
        let before_m = self.braked.map_or(self.ways_m[self.tick], |(_, way_m)| way_m);
        self.tick += 1;
        if self.braked.is_none() && braking_mps2 <= 0.0 {
            return recorded;
        }
        let speed_mps = (before_mps - braking_mps2 * DT_S).max(0.0);
        let way_m = before_m + (before_mps + speed_mps) / 2.0 * DT_S;
        self.braked = Some((speed_mps, way_m));
        let acceleration_mps2 = (speed_mps - before_mps) / DT_S;
        EgoMotion { speed_mps, acceleration_mps2, ..self.at(way_m) }
    }

    /// The recorded motion at a way; beyond the last place the path goes on straight.
    fn at(&self, way_m: f64) -> EgoMotion {
        let last = self.recording.len() - 1;
        let after = self.ways_m.partition_point(|at_m| *at_m <= way_m).clamp(1, last.max(1));
        let Some(next) = self.recording.get(after) else { return self.recording[last].ego() };
        let (here, next) = (self.recording[after - 1].ego(), next.ego());
        let length_m = self.ways_m[after] - self.ways_m[after - 1];
        let beyond_m = way_m - self.ways_m[after - 1];
        let fraction = if length_m > 1e-9 { beyond_m / length_m } else { 0.0 };
        let (a, b) = (here.rear_axle, next.rear_axle);
        let turn_rad = wrap_angle(b.heading_rad - a.heading_rad) * fraction.min(1.0);
        let position = a.position + (b.position - a.position) * fraction;
        EgoMotion { rear_axle: Pose { position, heading_rad: wrap_angle(a.heading_rad + turn_rad) }, ..here }
    }
}

/// Whether all corners of the ego vehicle are on driving lanes, of either direction.
fn is_on_road(world: &World) -> bool {
    let outline = world.ego_outline();
    let map = &world.scene().map;
    outline.corners().into_iter().all(|corner| map.nearest(corner, outline.pose.heading_rad, 1e-6).is_some())
}

fn ticks(duration_s: f64) -> usize {
    (duration_s / DT_S).round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::Vec2;
    use avastra_world::sim::testing;

    /// Worlds a tick apart in which the ego vehicle has these speeds along +x, m/s.
    fn moves(speeds_mps: &[f64]) -> Vec<World> {
        let mut world = testing::world(&testing::straight());
        let mut x_m = world.ego().rear_axle.position.x;
        let mut recording = Vec::new();
        for &speed_mps in speeds_mps {
            let y_m = world.ego().rear_axle.position.y;
            let motion = EgoMotion::straight(Pose::new(x_m, y_m, 0.0), speed_mps);
            let recorded = world.clone();
            world.tick_placed(motion, &recorded);
            recording.push(world.clone());
            x_m += speed_mps * DT_S;
        }
        recording
    }

    fn speeds(parts: &[(f64, usize)]) -> Vec<f64> {
        parts.iter().flat_map(|(speed_mps, count)| core::iter::repeat_n(*speed_mps, *count)).collect()
    }

    #[test]
    fn a_shove_counts_if_it_gave_more_than_half_of_the_way() {
        let found = |parts: &[(f64, usize)]| {
            let recording = moves(&speeds(parts));
            shoved(&recording, recording[recording.len() - 1].ego_outline())
        };
        // Its own 2 m/s would have led it 2 of 5 m, its own 3 m/s 3 of 5.
        assert_eq!(found(&[(2.0, 50), (5.0, 50)]), Some(50));
        assert_eq!(found(&[(3.0, 50), (5.0, 50)]), None);
        assert_eq!(found(&[(0.0, 50), (5.0, 50)]), Some(50));
        assert_eq!(found(&[(5.0, 100)]), None, "nobody shoved it");
        // As fast as tyres give is no shove.
        let tyres: Vec<f64> =
            (0..100).map(|tick| f64::from(tick) * EGO_ACCELERATION_MPS2_MAX * DT_S).collect();
        let recording = moves(&tyres);
        assert_eq!(shoved(&recording, recording[99].ego_outline()), None);
        // The last shove is the one that counts.
        assert_eq!(found(&[(0.0, 20), (3.0, 30), (7.0, 50)]), Some(50));
    }

    #[test]
    fn the_slowest_moment_counts_if_it_is_at_walking_pace() {
        let found = |parts: &[(f64, usize)], from: usize| crept_from(&moves(&speeds(parts)), from);
        assert_eq!(found(&[(8.0, 10), (1.0, 10), (8.0, 10)], 0), Some(19), "the last of equal ones");
        assert_eq!(found(&[(8.0, 10), (1.0, 10), (8.0, 10)], 25), None);
        assert_eq!(found(&[(8.0, 10), (5.0, 10), (8.0, 10)], 0), None);
    }

    #[test]
    fn a_driver_that_gives_way_slows_down_comfortably_before_its_line() {
        let world = moves(&[10.0]).remove(0);
        let front_m = VehicleParameters::MKZ.front_m(world.ego_station_m());
        let held = |line: Option<f64>, speed_mps_max: f64| {
            let case = Case {
                recording: &[],
                from: 0,
                obstacle: 0,
                looks_anew: true,
                speed_mps_max,
                waits_at_m: line.map(|ahead_m| front_m + ahead_m),
                keeps_way: false,
                minded: Minded::default(),
                minded_before: Minded::default(),
            };
            let control = Control { throttle_pct: 80.0, brake_pct: 0.0, steer_rad: 0.1 };
            case.slowed(control, &world, &Minded::default())
        };
        let free = held(None, f64::INFINITY);
        for tenth in 0..800 {
            let ahead_m = f64::from(tenth) / 10.0;
            let control = held(Some(ahead_m), f64::INFINITY);
            assert_eq!(control.steer_rad, 0.1);
            let may_mps = (2.0 * COMFORTABLE_MPS2 * (ahead_m - LINE_GAP_M).max(0.0)).sqrt();
            let wanted_mps2 = (may_mps.min(careful_mps(&world, &Minded::default())) - 10.0) / CATCH_UP_S;
            let is_braking = wanted_mps2 < -COMFORTABLE_MPS2 / 2.0;
            assert_eq!(control.brake_pct > 0.0, is_braking, "{ahead_m} m before the line: {control:?}");
            if is_braking {
                let (_, brake_pct) = pedals_for(wanted_mps2.max(-CAREFUL_BRAKING_MPS2));
                assert!(control.throttle_pct == 0.0 && (control.brake_pct - brake_pct).abs() < 1e-9);
            } else {
                assert!((control.throttle_pct - pedals_for(wanted_mps2).0.min(80.0)).abs() < 1e-9);
            }
        }
        assert_eq!(held(Some(-1.0), f64::INFINITY), free, "a line that it has passed");
        // Where it is run into from behind it goes no faster than it went, and slows down comfortably.
        let slower = held(None, 5.0);
        assert!(
            slower.throttle_pct == 0.0 && (slower.brake_pct - pedals_for(-COMFORTABLE_MPS2).1).abs() < 1e-9
        );
        // A driver that brakes harder by itself is left alone.
        let brakes = Case::slowed(
            &Case {
                recording: &[],
                from: 0,
                obstacle: 0,
                looks_anew: true,
                speed_mps_max: 5.0,
                waits_at_m: None,
                keeps_way: false,
                minded: Minded::default(),
                minded_before: Minded::default(),
            },
            Control { throttle_pct: 0.0, brake_pct: 90.0, steer_rad: 0.0 },
            &world,
            &Minded::default(),
        );
        assert_eq!(brakes.brake_pct, 90.0);
    }

    #[test]
    fn who_brakes_on_the_recorded_path_moves_as_it_was_recorded_until_then() {
        let recording = moves(&speeds(&[(10.0, 100)]));
        let begin_m = recording[0].ego().rear_axle.position.x;
        let mut held = RecordedThenBraking::new(&recording);
        for recorded in &recording[1..21] {
            assert_eq!(held.step(recorded.ego(), 0.0), recorded.ego());
        }
        // 20 ticks at 10 m/s, then 4 m/s² for a second.
        let mut motion = recording[20].ego();
        for recorded in &recording[21..71] {
            motion = held.step(recorded.ego(), 4.0);
        }
        assert!(
            (motion.speed_mps - 6.0).abs() < 1e-9 && (motion.acceleration_mps2 + 4.0).abs() < 1e-9,
            "{motion:?}"
        );
        let way_m = motion.rear_axle.position.x - begin_m;
        assert!((way_m - (4.0 + 8.0)).abs() < 1e-6, "{way_m}");
        // Once it brakes, its own speed counts; it does not roll back.
        let rolls = held.step(recording[71].ego(), 0.0);
        assert!((rolls.rear_axle.position.x - motion.rear_axle.position.x - 6.0 * DT_S).abs() < 1e-6);
        for recorded in &recording[72..] {
            motion = held.step(recorded.ego(), 40.0);
        }
        assert_eq!(motion.speed_mps, 0.0);
        assert!((motion.rear_axle.position - Vec2::new(motion.rear_axle.position.x, -1.75)).norm() < 1e-6);
    }
}
