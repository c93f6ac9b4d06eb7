//! What a failure of any driving system hangs on: what it is told, and what becomes of its commands.
//!
//! The ego vehicle drives as it did until the obstacle appears, but at most until 15 s before the failure. From then on one thing is
//! changed from outside ([`Alteration`]): one road user is left out, every light is said to be red, the brake acts twice as strongly.
//! Nothing in the driving system is touched, so a program of the user's is asked like any other. Two results count:
//!
//! - **The drive is the same to the bit.** Then the driving system does not use what was changed. No chance is in that.
//! - **The failure vanishes**, and it vanishes with other noise, too, more often than by chance. Then the failure hangs on it.
//!
//! That a failure vanishes is no proof of a fault: a brake that acts twice as strongly saves sound drivers, too. So a cause needs a second
//! sign, which is measured. A car that is not there is shown where the way was free ([`Response`]): how late does the first command
//! change, and how strongly does it brake? And how far beside its route did it drive? Perception alone has no second sign.
//! [`Swaps::conclude`] draws the conclusion.
//!
//! Left out: errors from before the obstacle appeared, and swaps of two things.

use core::cell::Cell;

use crate::episode;
use crate::episode::{EpisodeLog, Setup};
use avastra_base::geometry::Vec2;
use avastra_drivers::external::AnswerKind;
use avastra_drivers::{Alteration, Selected};
use avastra_lang::model::vocabulary::{Body, ShownLights};
use avastra_world::sim::{
    DT_S, EgoMotion, Sensed, SensedObject, SignalColour, VehicleParameters, pedal_acceleration_mps2,
};

use super::case::{Case, Fate, Found, LOOK_BACK_S, What};
use super::cause::{AGAIN_MIN, again, unchanged};
use super::evidence::{Chance, Comparison, is_told_apart};
use super::recurrence::other_reactions;

/// A road user must have been seen for so long before the failure, s, or nothing could have been done about it.
const SEEN_S: f64 = 1.0;
/// Part of an outline that must show for that.
const SEEN_PART: f64 = 0.2;
/// A first command that comes later than this is late, s. The careful drivers of UN R157 perceive a risk after 0.4 s.
const LATE_S: f64 = 0.4;
/// A driving system that perceives and tracks others may take so much longer, s: `modular` first reacts after 0.4 to 0.5 s.
const PERCEIVES_S: f64 = 0.3;
/// Braking with less than this part of what is needed is weak.
const WEAK: f64 = 0.75;
/// The phantom, a car of this length, m, stands a metre beyond where so much braking is needed, m/s².
const PHANTOM_M: f64 = 4.6;
const NEEDED_MPS2: f64 = 5.0;
/// It is shown at this speed and above, m/s.
const FAST_MPS: f64 = 5.0;
/// For so long its effect is looked at, s.
const EFFECT_S: f64 = 4.0;
/// Where it is shown, the ego vehicle must not brake more than this, m/s².
const FREE_MPS2: f64 = 0.3;
/// A driver steers to one side if its median place is farther from its route than this, m, and its quartiles are nearer together
/// than that distance.
const BESIDE_M: f64 = 0.15;
/// Farther off, it is in another lane, m.
const BESIDE_M_MAX: f64 = 1.5;
/// Its place counts where it drove for at least this long, s, faster than this, m/s, and the route goes straight for this far, m.
const BESIDE_S: f64 = 3.0;
const BESIDE_MPS: f64 = 3.0;
const STRAIGHT_M: f64 = 20.0;
/// A crash because of a light happens at most so long after the light was passed, s.
const JUNCTION_S: f64 = 6.0;
/// What makes up for a delay that could not be measured, s.
const AHEAD_S: f64 = 0.5;

/// What a failure hangs on.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Swaps {
    /// The noun of the explained finding: `crash` or `breach`.
    pub noun: &'static str,
    pub found_s: f64,
    /// From when on things were changed, s.
    pub from_s: f64,
    pub swaps: Vec<Swap>,
    /// `None` if the way was nowhere free, or the driving system failed at the sight.
    pub response: Option<Response>,
    /// Its steady place to the left of its route where that is straight, m; 0 if it was not steady.
    pub offset_m: f64,
    /// Whether it passed a light that was not green in the time that is looked at.
    pub passed_light: bool,
    /// Replays with other noise and nothing changed; `None` if none were needed.
    pub chance: Option<Chance>,
    /// What it hangs on; `None` if nothing is told apart.
    pub hangs_on: Option<HangsOn>,
}

/// One change, and what became of the failure.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Swap {
    pub change: Change,
    pub fate: Fate,
    /// From when on it was changed, s.
    pub from_s: f64,
    /// From when on it was told something else, s; `None` if it never was. The time counts in which it could see.
    pub told_s: Option<f64>,
    /// From when on it drove in another way, s; `None` if the drive was the same to the bit until the failure.
    pub differs_s: Option<f64>,
    /// Replays with other noise; `None` if the failure did not vanish or no cause asks for it.
    pub noise: Option<Comparison>,
}

/// The things that are changed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// It is not told of the road user that the failure is about.
    Without(u32),
    WithoutAll,
    Standing,
    Red,
    Green,
    /// It is told what will be so long after, s.
    Ahead(f64),
    Nearer,
    Larger,
    Mirrored,
    /// The brake acts this many times as strongly.
    Braking(f64),
    /// The wheels are turned this much more to the left, rad.
    Steering(f64),
    /// It is told what is so, in place of what is perceived.
    Truth,
    /// It is obeyed at once, in place of after the latency of its profile.
    Prompt,
}

/// What a driving system did about road users that were not there, in its way.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Response {
    /// When they were shown, each in a drive of its own, s.
    pub shown_s: f64,
    /// Until the drive changed because of a standing car, s; `None` if it did not within 4 s.
    pub late_s: Option<f64>,
    /// More than this is late, s: one that perceives others itself may take longer.
    pub late_s_max: f64,
    /// The hardest braking after that, as a part of what was needed; `None` if it drove around the car.
    pub braking: Option<f64>,
    /// Whether the drive changed because of one like the road user that the failure is about; `None` if it is about none.
    pub minds_its_like: Option<bool>,
    /// Whether it drove otherwise for a car that is as fast as itself than for a standing one; `None` if it is told no speeds, but
    /// sees places.
    pub minds_speed: Option<bool>,
}

/// The cause of a failure, as far as it shows from outside.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HangsOn {
    /// It passed a light that was not green, and drives the same whatever lights show.
    IgnoredLights,
    /// It drives the same without the road user.
    IgnoredRoadUser,
    /// It drives the same if it is told that others stand.
    IgnoredSpeeds,
    /// Told what is so, in place of what is perceived, it does not fail.
    Perception,
    /// Obeyed at once, in place of after the latency of its profile, it does not fail.
    Latency,
    /// Its commands come late, and told of things so long before, it does not fail.
    Delay,
    /// It brakes weakly, and with stronger brakes it does not fail.
    Brakes,
    /// It drives beside its route, and turned back it does not fail.
    Steering,
    /// With left and right exchanged it does not fail.
    Sides,
    /// Told of others nearer or larger, it does not fail.
    Room,
}

impl HangsOn {
    /// In a word or two, to count by.
    pub fn name(self) -> &'static str {
        match self {
            HangsOn::IgnoredLights => "ignored lights",
            HangsOn::IgnoredRoadUser => "ignored road user",
            HangsOn::IgnoredSpeeds => "ignored speeds",
            HangsOn::Perception => "perception",
            HangsOn::Latency => "latency",
            HangsOn::Delay => "delay",
            HangsOn::Brakes => "brakes",
            HangsOn::Steering => "steering",
            HangsOn::Sides => "left and right",
            HangsOn::Room => "room",
        }
    }
}

impl Change {
    fn alteration(self) -> Alteration {
        match self {
            Change::Without(id) => Alteration::Without(id),
            Change::WithoutAll => Alteration::WithoutAll,
            Change::Standing => Alteration::Standing,
            Change::Red => Alteration::Lights(SignalColour::Red),
            Change::Green => Alteration::Lights(SignalColour::Green),
            Change::Ahead(by_s) => Alteration::Ahead(by_s),
            Change::Nearer => Alteration::Distances(0.67),
            Change::Larger => Alteration::Larger(0.6),
            Change::Mirrored => Alteration::Mirrored,
            Change::Braking(by) => Alteration::Braking(by),
            Change::Steering(by_rad) => Alteration::Steering(by_rad),
            Change::Truth => Alteration::Truth,
            Change::Prompt => Alteration::Prompt,
        }
    }

    /// Whether something else is told, and not only its commands are carried out otherwise.
    pub fn is_told(self) -> bool {
        !matches!(self, Change::Braking(_) | Change::Steering(_) | Change::Truth | Change::Prompt)
    }

    /// In words: what holds from a moment on.
    pub fn in_words(self) -> String {
        match self {
            Change::Without(id) => format!("it is not told of npc#{id}"),
            Change::WithoutAll => "it is told of nobody".to_owned(),
            Change::Standing => "it is told that others stand".to_owned(),
            Change::Red => "it is told that lights are red".to_owned(),
            Change::Green => "it is told that lights are green".to_owned(),
            Change::Ahead(by_s) => format!("it is told what will be {by_s:.2} s later"),
            Change::Nearer => "it is told others a third nearer".to_owned(),
            Change::Larger => "it is told others 0.6 m larger on each side".to_owned(),
            Change::Mirrored => "left and right are exchanged".to_owned(),
            Change::Braking(by) => format!("its brake acts {by:.1} times as strongly"),
            Change::Steering(by_rad) => format!("its wheels are turned by {by_rad:+.3} rad"),
            Change::Truth => "it is told the truth".to_owned(),
            Change::Prompt => "it is obeyed at once".to_owned(),
        }
    }
}

impl Swap {
    /// Whether the driving system does not use what was changed: it was told something else for long enough, and drove the same.
    pub fn is_ignored(&self, found_s: f64) -> bool {
        self.fate == Fate::Same
            && self.differs_s.is_none()
            && self.told_s.is_some_and(|told_s| told_s + SEEN_S <= found_s)
    }
}

impl Swaps {
    fn swap(&self, is_meant: impl Fn(Change) -> bool) -> Option<&Swap> {
        self.swaps.iter().find(|swap| is_meant(swap.change))
    }

    /// Whether a change was told and not used.
    fn is_ignored(&self, is_meant: impl Fn(Change) -> bool) -> bool {
        self.swap(is_meant).is_some_and(|swap| swap.is_ignored(self.found_s))
    }

    /// Whether a change of this kind prevents the failure, told apart from chance.
    fn prevents(&self, is_meant: impl Fn(Change) -> bool) -> bool {
        self.swaps.iter().any(|swap| is_meant(swap.change) && is_told_apart(swap.noise))
    }

    /// Whether it drives the same whatever the lights show.
    fn minds_no_light(&self) -> bool {
        let both = [Change::Red, Change::Green].map(|colour| self.swap(|change| change == colour));
        let is_ignored = |swap: Option<&Swap>| {
            swap.is_some_and(|swap| swap.fate == Fate::Same && swap.differs_s.is_none())
        };
        both.into_iter().all(is_ignored)
            && both.into_iter().any(|swap| swap.is_some_and(|swap| swap.told_s.is_some()))
    }

    /// Whether it drives the same without the road user, and did not mind one like it in its way.
    fn minds_none_like_it(&self) -> bool {
        let minds = self.response.and_then(|response| response.minds_its_like);
        minds == Some(false) && self.is_ignored(|change| matches!(change, Change::Without(_)))
    }

    /// Whether it drives the same if others stand, and did not mind the speed of a car in its way.
    fn minds_no_speed(&self) -> bool {
        let ignores = |response: Response| response.late_s.is_some() && response.minds_speed == Some(false);
        self.response.is_some_and(ignores) && self.is_ignored(|change| change == Change::Standing)
    }

    fn is_late(&self) -> bool {
        let is_late = |response: Response| response.late_s.is_some_and(|late_s| late_s > response.late_s_max);
        self.response.is_some_and(is_late)
    }

    fn is_weak(&self) -> bool {
        self.response.and_then(|response| response.braking).is_some_and(|braking| braking < WEAK)
    }

    /// The first of these that holds. What is ignored comes before what would have made up for it.
    fn conclude(&self) -> Option<HangsOn> {
        let is_side = |change| change == Change::Mirrored;
        let is_room = |change| matches!(change, Change::Nearer | Change::Larger);
        // Without a road user that it is about, more room only slows it down.
        let is_about_one = self.swap(|change| matches!(change, Change::Without(_))).is_some();
        // A reaction that was not measured may be late or weak.
        let is_measured = |response: Response| response.late_s.is_some() && response.braking.is_some();
        let is_sound =
            is_about_one && self.response.is_some_and(is_measured) && !self.is_late() && !self.is_weak();
        let rules = [
            (self.minds_none_like_it(), HangsOn::IgnoredRoadUser),
            (self.passed_light && self.minds_no_light(), HangsOn::IgnoredLights),
            (self.prevents(|change| matches!(change, Change::Steering(_))), HangsOn::Steering),
            (self.minds_no_speed(), HangsOn::IgnoredSpeeds),
            (self.is_late() && self.prevents(|change| change == Change::Prompt), HangsOn::Latency),
            (self.prevents(|change| change == Change::Truth), HangsOn::Perception),
            (self.is_late() && self.prevents(|change| matches!(change, Change::Ahead(_))), HangsOn::Delay),
            (self.is_weak() && self.prevents(|change| matches!(change, Change::Braking(_))), HangsOn::Brakes),
            (is_sound && self.prevents(is_side) && !self.prevents(is_room), HangsOn::Sides),
            (is_sound && self.prevents(is_room) && !self.prevents(is_side), HangsOn::Room),
        ];
        rules.into_iter().find_map(|(holds, hangs_on)| holds.then_some(hangs_on))
    }
}

/// What a finding of a log that was played from `setup` hangs on.
pub fn swaps(setup: &Setup, log: &EpisodeLog, found: Found) -> Swaps {
    Asked::new(&Case::new(setup, log, found)).swaps(found.noun())
}

/// One moment of the drive that is asked about.
struct Tick {
    sensed: Sensed,
    station_m: f64,
    offset_m: f64,
}

/// The failure, played once, and then with changes.
struct Asked<'a> {
    case: &'a Case<'a>,
    from_s: f64,
    found_s: f64,
    ticks: Vec<Tick>,
    /// Whether an external driving system failed in a play with other noise.
    has_failed: Cell<bool>,
}

impl<'a> Asked<'a> {
    fn new(case: &'a Case<'a>) -> Asked<'a> {
        let mut ticks = Vec::new();
        let setup = case.setup;
        episode::run_watched(setup, &mut |moment| case.script.choose(moment), &mut |world, _, _| {
            let (station_m, offset_m) = (world.ego_station_m(), world.ego_offset_m());
            ticks.push(Tick { sensed: world.sensed(), station_m, offset_m });
        });
        let (from_s, found_s) = (case.begins_s(), case.time_s());
        Asked { case, from_s, found_s, ticks, has_failed: Cell::new(false) }
    }

    fn swaps(&self, noun: &'static str) -> Swaps {
        let response = self.response();
        let offset_m = self.offset_m();
        let mut swaps: Vec<Swap> =
            self.changes(response, offset_m).into_iter().map(|change| self.swap(change)).collect();
        // Only what could make up for a fault is asked again with other noise.
        let asked = |swap: &&mut Swap| {
            let makes_up = !matches!(
                swap.change,
                Change::Without(_) | Change::WithoutAll | Change::Standing | Change::Red | Change::Green
            );
            makes_up && swap.fate == Fate::Vanished
        };
        let tries = swaps.iter_mut().filter(asked).count();
        let mut chance = None;
        if tries > 0 {
            let plain = unchanged(|noise| self.vanishes(None, noise));
            chance = Some(Chance::of(&plain));
            // Where a program fails, a play says nothing, so that nothing can be told apart.
            if again(&plain) >= AGAIN_MIN && !self.has_failed.get() {
                for swap in swaps.iter_mut().filter(asked) {
                    let changed =
                        (1..=plain.len() as u32).map(|noise| self.vanishes(Some(swap.change), noise));
                    swap.noise = Some(Comparison::of(plain.iter().copied().zip(changed), tries));
                }
            }
        }
        let passed_light = self.passed_light();
        let (found_s, from_s) = (self.found_s, self.from_s);
        let found =
            Swaps { noun, found_s, from_s, swaps, response, offset_m, passed_light, chance, hangs_on: None };
        Swaps { hangs_on: found.conclude(), ..found }
    }

    /// The number of the road user that the failure is about.
    fn about(&self) -> Option<u32> {
        match self.case.what {
            What::Collision { collision, .. } => Some(collision.contact.obstacle),
            What::Breach(breach) => breach.obstacle,
        }
    }

    /// Whether it steers itself: avastra does for programs that answer accelerations.
    fn steers(&self) -> bool {
        let identity = self.case.setup.ads.program().and_then(|program| program.attached().identity);
        identity.is_none_or(|identity| identity.answer != AnswerKind::Acceleration)
    }

    /// Whether it is told how fast others are. What perceives and tracks others works that out from their places.
    fn is_told_speeds(&self) -> bool {
        let ads = &self.case.setup.ads;
        ads.profile().is_none() && ads.program().is_none_or(|program| !program.settings().shows_perceived())
    }

    /// What is changed, one after the other.
    fn changes(&self, response: Option<Response>, offset_m: f64) -> Vec<Change> {
        let late_s = response.and_then(|response| response.late_s).unwrap_or(AHEAD_S);
        let ahead_s = (late_s.max(0.2) / DT_S).round() * DT_S;
        let weak =
            response.and_then(|response| response.braking).map_or(2.0, |part| (1.0 / part).clamp(1.5, 4.0));
        let mut changes: Vec<Change> = self.about().map(Change::Without).into_iter().collect();
        changes.push(Change::WithoutAll);
        changes.extend(self.is_told_speeds().then_some(Change::Standing));
        if self.ticks.first().is_some_and(|tick| !tick.sensed.signals.is_empty()) {
            changes.extend([Change::Red, Change::Green]);
        }
        changes.extend([
            Change::Ahead(ahead_s),
            Change::Nearer,
            Change::Larger,
            Change::Mirrored,
            Change::Braking(weak),
        ]);
        if let Some(program) = self.case.setup.ads.program() {
            let (_, latency) = program.settings().ticks();
            changes.extend(program.settings().shows_perceived().then_some(Change::Truth));
            changes.extend((latency > 0).then_some(Change::Prompt));
        }
        if offset_m != 0.0 && self.steers() {
            changes.extend([0.01, 0.02, 0.04].map(|by_rad| Change::Steering(-by_rad * offset_m.signum())));
        }
        changes
    }

    fn swap(&self, change: Change) -> Swap {
        let (log, motions) = self.play(self.changed(change.alteration(), self.begins_s(change)), None);
        let differs_s = self.differs_s(&motions).filter(|differs_s| *differs_s < self.found_s);
        let (fate, from_s, told_s) = (self.case.fate(&log), self.begins_s(change), self.told_s(change));
        Swap { change, fate, from_s, told_s, differs_s, noise: None }
    }

    /// From when on a thing is changed, s: a light may have been passed before its obstacle appeared.
    fn begins_s(&self, change: Change) -> f64 {
        match change {
            Change::Red | Change::Green => (self.found_s - LOOK_BACK_S).max(0.0),
            _ => self.from_s,
        }
    }

    fn changed(&self, alteration: Alteration, from_s: f64) -> Selected {
        self.case.setup.ads.clone().altered(alteration, from_s)
    }

    /// Whether the failure vanishes with other noise, which a number selects, and with a change.
    fn vanishes(&self, change: Option<Change>, noise: u32) -> bool {
        let ads = self.case.setup.ads.clone().with_other_noise(noise);
        let ads = match change {
            Some(change) => ads.altered(change.alteration(), self.from_s),
            None => ads,
        };
        let ads = self.case.setup.ads.clone().until(self.from_s, ads);
        let fate = self.case.fate(&self.play(ads, Some(noise)).0);
        self.has_failed.set(self.has_failed.get() || fate == Fate::Failed);
        fate == Fate::Vanished
    }

    /// The scenario with a driving system; with a number also other reactions of others from the hazard on.
    fn play(&self, ads: Selected, noise: Option<u32>) -> (EpisodeLog, Vec<EgoMotion>) {
        let usual = self.case.setup;
        let start = noise.map_or(usual.start, |number| other_reactions(usual, number, self.from_s));
        let setup = Setup { ads, start, ..self.case.setup.clone() };
        let mut motions = Vec::new();
        let log = episode::run_watched(
            &setup,
            &mut |moment| self.case.script.choose(moment),
            &mut |world, _, _| motions.push(world.ego()),
        );
        (log, motions)
    }

    /// When a drive first differs from the one that is asked about, s.
    fn differs_s(&self, motions: &[EgoMotion]) -> Option<f64> {
        let own = self.ticks.iter().map(|tick| tick.sensed.ego);
        let differs = own.zip(motions).position(|(own, other)| own != *other);
        // A play that ends sooner differs at its end.
        let differs = differs.or((motions.len() < self.ticks.len()).then_some(motions.len()));
        differs.map(|tick| self.ticks[tick].sensed.time_s)
    }

    /// From when on a change tells something else of what can be seen, s.
    fn told_s(&self, change: Change) -> Option<f64> {
        let alteration = change.alteration();
        let tells = |tick: &&Tick| {
            let mut seen = tick.sensed.clone();
            seen.objects.retain(|object| object.visible_fraction >= SEEN_PART);
            let mut told = seen.clone();
            alteration.tell(&mut told);
            told != seen
        };
        let is_within = |tick: &&Tick| tick.sensed.time_s >= self.begins_s(change) - 1e-6;
        let told = self.ticks.iter().filter(is_within).find(tells).map(|tick| tick.sensed.time_s);
        told.filter(|told_s| *told_s < self.found_s)
    }

    /// Shows a car that is not there, once, where the way was free.
    fn response(&self) -> Option<Response> {
        let car = VehicleParameters::MKZ;
        let route = &self.case.setup.scene.route;
        let away_m = |speed_mps: f64| speed_mps * speed_mps / (2.0 * NEEDED_MPS2) + 1.0;
        let free = self.ticks.iter().position(|tick| {
            let ego = &tick.sensed.ego;
            let look_m = 2.0 * away_m(ego.speed_mps) + 15.0;
            let is_before = |at: Vec2| {
                let local = ego.rear_axle.to_local(at);
                local.x > 0.0 && local.x < look_m && local.y.abs() < 6.0
            };
            let lines = route.stop_lines.iter().map(|line| line.station_m - tick.station_m);
            ego.speed_mps >= FAST_MPS
                && ego.acceleration_mps2 > -FREE_MPS2
                && tick.sensed.time_s + EFFECT_S < self.found_s
                && tick.station_m + look_m < route.path.length_m()
                && tick.offset_m.abs() < 1.0
                && !lines.into_iter().any(|ahead_m| ahead_m > 0.0 && ahead_m < look_m)
                && route.path.turned_rad(tick.station_m, tick.station_m + look_m).abs() < 0.2
                && !tick.sensed.objects.iter().any(|object| is_before(object.pose.position))
        })?;
        let tick = &self.ticks[free];
        let shown_s = tick.sensed.time_s;
        let speed_mps = tick.sensed.ego.speed_mps;
        let away_m = away_m(speed_mps);
        let station_m = tick.station_m + car.rear_axle_to_front_m + away_m + PHANTOM_M / 2.0;
        let car_there = SensedObject {
            id: 0,
            body: Body::Sedan,
            pose: route.path.pose_at(station_m),
            velocity_mps: Vec2::zeros(),
            length_m: PHANTOM_M,
            width_m: 1.9,
            height_m: 1.5,
            visible_fraction: 1.0,
            distance_m: 0.0,
            is_unlit: false,
            has_siren: false,
            lights: ShownLights::Off,
        };
        let shown = |object| self.play(self.changed(Alteration::Phantom(object), shown_s), None).1;
        let (log, motions) = self.play(self.changed(Alteration::Phantom(car_there), shown_s), None);
        // A program that cannot bear the sight has not ignored it.
        if log.failure.is_some() {
            return None;
        }
        // Nearer, some drivers brake as hard as they can for either.
        let farther = SensedObject { pose: route.path.pose_at(station_m + away_m), ..car_there };
        let velocity_mps = farther.pose.forward() * speed_mps;
        // What differs much later is no reaction.
        let reacts = |motions: &[EgoMotion]| {
            self.differs_s(motions).filter(|differs_s| differs_s - shown_s <= EFFECT_S)
        };
        let minds_speed =
            self.is_told_speeds().then(|| shown(SensedObject { velocity_mps, ..farther }) != shown(farther));
        let minds_its_like = self.about().and_then(|id| {
            let its_like =
                self.ticks.iter().flat_map(|tick| &tick.sensed.objects).find(|object| object.id == id)?;
            let SensedObject { pose, velocity_mps, visible_fraction, .. } = car_there;
            let there = SensedObject { pose, velocity_mps, visible_fraction, ..*its_like };
            Some(reacts(&shown(there)).is_some())
        });
        let late_s_max = if self.is_told_speeds() { LATE_S } else { LATE_S + PERCEIVES_S };
        let none = Response { shown_s, late_s: None, late_s_max, braking: None, minds_its_like, minds_speed };
        let Some(differs_s) = reacts(&motions) else { return Some(none) };
        // A command acts in the tick after it.
        let late_s = (differs_s - shown_s - DT_S).max(0.0);
        let after = motions.iter().skip(free).take((EFFECT_S / DT_S) as usize);
        let hardest_mps2 = after.clone().map(|motion| -motion.acceleration_mps2).fold(0.0, f64::max);
        let goes_around = after.clone().any(|motion| {
            let (_, offset_m) = route.path.beside(motion.rear_axle.position);
            (offset_m - tick.offset_m).abs() > 0.7
        });
        // It may stop just before the car.
        let needed_mps2 = speed_mps * speed_mps / (2.0 * away_m);
        let possible_mps2 = -pedal_acceleration_mps2(0.0, 100.0) * tick.sensed.conditions.friction;
        let needed_mps2 = needed_mps2.min(possible_mps2);
        let braking = (!goes_around).then_some(hardest_mps2 / needed_mps2);
        Some(Response { late_s: Some(late_s), braking, ..none })
    }

    /// Its steady place to the left of its route where that is straight, m; 0 if it was not steady.
    fn offset_m(&self) -> f64 {
        let path = &self.case.setup.scene.route.path;
        let is_straight = |tick: &&Tick| {
            let station_m = tick.station_m;
            tick.sensed.time_s < self.found_s
                && tick.sensed.ego.speed_mps > BESIDE_MPS
                && path.turned_rad(station_m, (station_m + STRAIGHT_M).min(path.length_m())).abs() < 0.02
        };
        let mut places: Vec<f64> = self.ticks.iter().filter(is_straight).map(|tick| tick.offset_m).collect();
        if places.len() < (BESIDE_S / DT_S) as usize {
            return 0.0;
        }
        places.sort_by(f64::total_cmp);
        let part = |of: f64| places[(of * (places.len() - 1) as f64) as usize];
        let (low, middle, high) = (part(0.25), part(0.5), part(0.75));
        let is_steady = (BESIDE_M..BESIDE_M_MAX).contains(&middle.abs()) && high - low < middle.abs();
        if is_steady { middle } else { 0.0 }
    }

    /// From when on a light that was passed may have led to the failure, s: a crash is in the junction.
    fn lights_from_s(&self) -> f64 {
        match self.case.what {
            What::Collision { .. } => self.found_s - JUNCTION_S,
            What::Breach(_) => self.begins_s(Change::Red),
        }
    }

    /// Whether its front passed a line of the route while the light was not green, in the time that is looked at.
    fn passed_light(&self) -> bool {
        let front_m = VehicleParameters::MKZ.rear_axle_to_front_m;
        let from_s = self.lights_from_s();
        let is_within = |tick: &Tick| (from_s..=self.found_s).contains(&tick.sensed.time_s);
        self.case.setup.scene.route.stop_lines.iter().any(|line| {
            self.ticks.windows(2).any(|pair| {
                let is_over = |tick: &Tick| tick.station_m + front_m > line.station_m;
                is_within(&pair[1])
                    && !is_over(&pair[0])
                    && is_over(&pair[1])
                    && pair[1].sensed.signals[line.signal] != SignalColour::Green
            })
        })
    }
}
