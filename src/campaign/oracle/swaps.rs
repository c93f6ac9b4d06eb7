//! What a failure of any driving system hangs on: what it is told, and what becomes of its commands.
//!
//! The ego vehicle drives as it did until the obstacle appears (before a breach, until 15 s before it). From then on one thing is
//! changed from outside ([`Alteration`]): one road user is left out, every light is said to be red, the brake acts twice as strongly.
//! Nothing in the driving system is touched, so a program of the user's is asked like any other. Two results count:
//!
//! - **The drive is the same to the bit.** Then the driving system does not use what was changed. No chance is in that.
//! - **The failure vanishes**, and it vanishes with other noise, too, more often than by chance. Then the failure hangs on it.
//!
//! That a failure vanishes is no proof of a fault: a brake that acts twice as strongly saves sound drivers, too. So a cause needs a second
//! sign, which is measured. A car that is not there is shown where the way was free ([`Response`]): how late does the first command
//! change, and how strongly does it brake? And how far beside its route did it drive? [`Swaps::conclude`] draws the conclusion.
//!
//! Left out: errors from before the obstacle appeared, and swaps of two things.

use crate::episode;
use crate::episode::{EpisodeLog, Setup};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_drivers::{Alteration, Selected};
use avastra_world::sim::{DT_S, EgoMotion, Sensed, SignalColour, Start, VehicleParameters};

use super::case::{Case, Fate, Found, What};
use super::cause::{AGAIN_MIN, again, unchanged};
use super::evidence::{Chance, Comparison, is_told_apart};

/// A road user must have been seen for so long before the failure, s, or nothing could have been done about it.
const SEEN_S: f64 = 1.0;
/// Part of an outline that must show for that.
const SEEN_PART: f64 = 0.2;
/// A first command that comes later than this is late, s. The careful drivers of UN R157 perceive a risk after 0.4 s.
const LATE_S: f64 = 0.4;
/// Braking with less than this part of what is needed is weak.
const WEAK: f64 = 0.75;
/// The phantom stands where so much braking is needed, m/s².
const NEEDED_MPS2: f64 = 5.0;
/// It is shown at this speed and above, m/s.
const FAST_MPS: f64 = 5.0;
/// For so long its effect is looked at, s.
const EFFECT_S: f64 = 4.0;
/// Where it is shown, the ego vehicle must not brake more than this, m/s².
const FREE_MPS2: f64 = 0.3;
/// A driver whose mean place beside its route is farther off than this, m, and varies less than half of it, steers to one side.
const BESIDE_M: f64 = 0.2;
/// For so long before the hazard that is looked at, s.
const BESIDE_S: f64 = 5.0;
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
    /// `None` if the way was nowhere free.
    pub response: Option<Response>,
    /// Its steady place to the left of its route before the hazard, m; 0 if it was not steady.
    pub beside_m: f64,
    /// Whether it passed a red light in the time that is looked at.
    pub passed_red: bool,
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
}

/// What a driving system did about a car that was not there.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Response {
    /// When it was shown, s.
    pub shown_s: f64,
    /// Until the drive changed, s; `None` if it never did.
    pub late_s: Option<f64>,
    /// The hardest braking after that, as a part of what was needed; `None` if it drove around it.
    pub braking: Option<f64>,
}

/// The cause of a failure, as far as it shows from outside.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HangsOn {
    /// It passed a red light, and drives the same if all lights are red.
    IgnoredLights,
    /// It drives the same without the road user.
    IgnoredRoadUser,
    /// It drives the same if it is told that others stand.
    IgnoredSpeeds,
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
        }
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
        }
    }
}

impl Swap {
    /// Whether the driving system does not use what was changed: it was told something else for long enough, and drove the same.
    pub fn is_ignored(&self, found_s: f64) -> bool {
        self.differs_s.is_none() && self.told_s.is_some_and(|told_s| told_s + SEEN_S <= found_s)
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

    fn is_late(&self) -> bool {
        self.response.and_then(|response| response.late_s).is_some_and(|late_s| late_s > LATE_S)
    }

    fn is_weak(&self) -> bool {
        self.response.and_then(|response| response.braking).is_some_and(|braking| braking < WEAK)
    }

    /// The first of these that holds. What is ignored comes before what would have made up for it.
    fn conclude(&self) -> Option<HangsOn> {
        let is_side = |change| change == Change::Mirrored;
        let is_room = |change| matches!(change, Change::Nearer | Change::Larger);
        let rules = [
            (self.passed_red && self.is_ignored(|change| change == Change::Red), HangsOn::IgnoredLights),
            (self.prevents(|change| matches!(change, Change::Steering(_))), HangsOn::Steering),
            (self.is_ignored(|change| matches!(change, Change::Without(_))), HangsOn::IgnoredRoadUser),
            (self.is_ignored(|change| change == Change::Standing), HangsOn::IgnoredSpeeds),
            (self.is_late() && self.prevents(|change| matches!(change, Change::Ahead(_))), HangsOn::Delay),
            (self.is_weak() && self.prevents(|change| matches!(change, Change::Braking(_))), HangsOn::Brakes),
            (self.prevents(is_side) && !self.prevents(is_room), HangsOn::Sides),
            (self.prevents(is_room) && !self.prevents(is_side), HangsOn::Room),
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
    beside_m: f64,
}

/// The failure, played once, and then with changes.
struct Asked<'a> {
    case: &'a Case<'a>,
    from_s: f64,
    found_s: f64,
    ticks: Vec<Tick>,
}

impl<'a> Asked<'a> {
    fn new(case: &'a Case<'a>) -> Asked<'a> {
        let mut ticks = Vec::new();
        let setup = case.setup;
        episode::run_watched(setup, &mut |moment| case.script.choose(moment), &mut |world, _, _| {
            let (station_m, beside_m) = (world.ego_station_m(), world.ego_offset_m());
            ticks.push(Tick { sensed: world.sensed(), station_m, beside_m });
        });
        Asked { case, from_s: case.begins_s(), found_s: case.time_s(), ticks }
    }

    fn swaps(&self, noun: &'static str) -> Swaps {
        let response = self.response();
        let beside_m = self.beside_m();
        let mut swaps: Vec<Swap> =
            self.changes(response, beside_m).into_iter().map(|change| self.swap(change)).collect();
        let asked = |swap: &&mut Swap| {
            let is_asked = matches!(
                swap.change,
                Change::Ahead(_)
                    | Change::Nearer
                    | Change::Larger
                    | Change::Mirrored
                    | Change::Braking(_)
                    | Change::Steering(_)
            );
            is_asked && swap.fate == Fate::Vanished
        };
        let tries = swaps.iter_mut().filter(asked).count();
        let mut chance = None;
        if tries > 0 {
            let plain = unchanged(|noise| self.vanishes(None, noise));
            chance = Some(Chance::of(&plain));
            if again(&plain) >= AGAIN_MIN {
                for swap in swaps.iter_mut().filter(asked) {
                    let changed =
                        (1..=plain.len() as u32).map(|noise| self.vanishes(Some(swap.change), noise));
                    swap.noise = Some(Comparison::of(plain.iter().copied().zip(changed), tries));
                }
            }
        }
        let passed_red = self.passed_red();
        let (found_s, from_s) = (self.found_s, self.from_s);
        let found =
            Swaps { noun, found_s, from_s, swaps, response, beside_m, passed_red, chance, hangs_on: None };
        Swaps { hangs_on: found.conclude(), ..found }
    }

    /// What is changed, one after the other.
    fn changes(&self, response: Option<Response>, beside_m: f64) -> Vec<Change> {
        let about = match self.case.what {
            What::Collision { collision, .. } => Some(collision.contact.obstacle),
            What::Breach(breach) => breach.obstacle,
        };
        let late_s = response.and_then(|response| response.late_s).unwrap_or(AHEAD_S);
        let ahead_s = (late_s.max(0.2) / DT_S).round() * DT_S;
        let weak =
            response.and_then(|response| response.braking).map_or(2.0, |part| (1.0 / part).clamp(1.5, 4.0));
        let mut changes: Vec<Change> = about.map(Change::Without).into_iter().collect();
        changes.extend([Change::WithoutAll, Change::Standing]);
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
        if beside_m != 0.0 {
            changes.extend([0.01, 0.02, 0.04].map(|by_rad| Change::Steering(-by_rad * beside_m.signum())));
        }
        changes
    }

    fn swap(&self, change: Change) -> Swap {
        let (log, motions) = self.play(self.changed(change.alteration(), self.from_s), None);
        let differs_s = self.differs_s(&motions).filter(|differs_s| *differs_s < self.found_s);
        Swap { change, fate: self.case.fate(&log), told_s: self.told_s(change), differs_s, noise: None }
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
        self.case.fate(&self.play(ads, Some(noise)).0) == Fate::Vanished
    }

    /// The scenario with a driving system; with a number also other reactions of others from the hazard on.
    fn play(&self, ads: Selected, noise: Option<u32>) -> (EpisodeLog, Vec<EgoMotion>) {
        let Setup { seed, start, .. } = self.case.setup;
        let start = match noise {
            None => *start,
            // Never 0, which is the usual order.
            Some(number) => Start {
                reactions: rng::child_seed(*seed, Stream::Noise, u64::from(number)) | 1,
                reactions_from_s: self.from_s,
                ..*start
            },
        };
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
        let is_within = |tick: &&Tick| tick.sensed.time_s >= self.from_s - 1e-6;
        self.ticks.iter().filter(is_within).find(tells).map(|tick| tick.sensed.time_s)
    }

    /// Shows a car that is not there, once, where the way was free.
    fn response(&self) -> Option<Response> {
        let car = VehicleParameters::MKZ;
        let route = &self.case.setup.scene.route;
        let away_m = |speed_mps: f64| speed_mps * speed_mps / (2.0 * NEEDED_MPS2) + 1.0;
        let free = self.ticks.iter().position(|tick| {
            let ego = &tick.sensed.ego;
            let look_m = 2.0 * away_m(ego.speed_mps) + 15.0;
            let is_before = |at: avastra_base::geometry::Vec2| {
                let local = ego.rear_axle.to_local(at);
                local.x > 0.0 && local.x < look_m && local.y.abs() < 6.0
            };
            let lines = route.stop_lines.iter().map(|line| line.station_m - tick.station_m);
            ego.speed_mps >= FAST_MPS
                && ego.acceleration_mps2 > -FREE_MPS2
                && tick.sensed.time_s + EFFECT_S < self.found_s
                && tick.station_m + look_m < route.path.length_m()
                && tick.beside_m.abs() < 1.0
                && !lines.into_iter().any(|ahead_m| ahead_m > 0.0 && ahead_m < look_m)
                && route.path.turned_rad(tick.station_m, tick.station_m + look_m).abs() < 0.2
                && !tick.sensed.objects.iter().any(|object| is_before(object.pose.position))
        })?;
        let tick = &self.ticks[free];
        let shown_s = tick.sensed.time_s;
        let station_m = tick.station_m + car.rear_axle_to_front_m + away_m(tick.sensed.ego.speed_mps) + 2.3;
        let phantom = Alteration::Phantom(route.path.pose_at(station_m));
        let (_, motions) = self.play(self.changed(phantom, shown_s), None);
        let Some(differs_s) = self.differs_s(&motions) else {
            return Some(Response { shown_s, late_s: None, braking: None });
        };
        // A command acts in the tick after it.
        let late_s = (differs_s - shown_s - DT_S).max(0.0);
        let after = motions.iter().skip(free).take((EFFECT_S / DT_S) as usize);
        let hardest_mps2 = after.clone().map(|motion| -motion.acceleration_mps2).fold(0.0, f64::max);
        let goes_around = after.clone().any(|motion| {
            let (_, beside_m) = route.path.beside(motion.rear_axle.position);
            (beside_m - tick.beside_m).abs() > 0.7
        });
        let needed_mps2 = NEEDED_MPS2.min(8.5 * tick.sensed.conditions.friction);
        let braking = (!goes_around).then_some(hardest_mps2 / needed_mps2);
        Some(Response { shown_s, late_s: Some(late_s), braking })
    }

    /// Its steady place to the left of its route before the hazard, m; 0 if it was not steady.
    fn beside_m(&self) -> f64 {
        let until_s = self.from_s.max(BESIDE_S);
        let is_in = |tick: &&Tick| {
            let ego = &tick.sensed.ego;
            (until_s - BESIDE_S..until_s.min(self.found_s)).contains(&ego_time(tick)) && ego.speed_mps > 2.0
        };
        let places: Vec<f64> = self.ticks.iter().filter(is_in).map(|tick| tick.beside_m).collect();
        if places.len() < (1.0 / DT_S) as usize {
            return 0.0;
        }
        let mean = places.iter().sum::<f64>() / places.len() as f64;
        let varies = places.iter().map(|place| (place - mean).abs()).fold(0.0, f64::max);
        if mean.abs() > BESIDE_M && varies < mean.abs() / 2.0 { mean } else { 0.0 }
    }

    /// Whether its front passed a line of the route while the light showed red, in the time that is looked at.
    fn passed_red(&self) -> bool {
        let front_m = VehicleParameters::MKZ.rear_axle_to_front_m;
        let is_within = |tick: &Tick| tick.sensed.time_s >= self.from_s && tick.sensed.time_s <= self.found_s;
        self.case.setup.scene.route.stop_lines.iter().any(|line| {
            self.ticks.windows(2).any(|pair| {
                let is_over = |tick: &Tick| tick.station_m + front_m > line.station_m;
                is_within(&pair[1])
                    && !is_over(&pair[0])
                    && is_over(&pair[1])
                    && pair[1].sensed.signals[line.signal] == SignalColour::Red
            })
        })
    }
}

fn ego_time(tick: &Tick) -> f64 {
    tick.sensed.time_s
}
