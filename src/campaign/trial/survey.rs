//! Trials: every row on every road, at moments of undisturbed drives at which it is legal.
//! On each road some drives go by without an action. At each of their steps every row is offered, as to an agent; this
//! counts how often the row is legal, and which reasons refuse it otherwise. From some of the legal moments, spread
//! over all of them, the row is carried out and what happens is judged. So a row on a road is realised, or not realised
//! (with the reason), or masked (with the reasons). A row may be legal at no moment because the road
//! user that it is about must be there first. It is then offered after a row that makes this road user appear: the first
//! after which it is legal.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::episode;
use crate::episode::{Choice, EpisodeLog};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_base::threads::in_order;
use avastra_drivers::Ads;
use avastra_lang::model::Row;
use avastra_lang::model::vocabulary::{Field, Phenomenon};
use avastra_world::action::{ActionTable, Count, Draw, Effect, Offer, SpawnRequest};
use avastra_world::sim::{Sensed, World};

use crate::run::Arena;
use crate::trial::{fairness, judge, sighting};

/// How much is tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct TrialSettings {
    /// Undisturbed drives of each road.
    pub drives: u32,
    /// Tries of each row on each road, at most.
    pub tries: u32,
    pub seed: u64,
}

/// Roads that are tried at the same time, at most. Ours: it bounds the threads.
const ROADS_AT_ONCE: usize = 64;

/// The verdict of the trials on a row on a road.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Every try did what the row says.
    Realised,
    /// Some tries did what the row says.
    Partly,
    /// No try did what the row says, though the row was legal.
    NotRealised,
    /// It was legal at no moment.
    Masked,
}

/// One row on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Cell {
    pub row: usize,
    pub label: String,
    pub road: String,
    /// The rows that were carried out before, because this one is about those whom they make appear.
    pub after: Option<String>,
    #[serde(skip)]
    before: Vec<usize>,
    pub outcome: Outcome,
    /// Moments at which it was offered, and those of them at which it was legal.
    pub moments: usize,
    pub legal: usize,
    pub tried: usize,
    pub realised: usize,
    /// Why tries failed.
    pub failures: Vec<Count>,
    /// Why it was refused.
    pub refusals: Vec<Count>,
    /// Spawns that were unfair, and why.
    pub unfair: Vec<Count>,
    /// Smallest gap between the ego vehicle and the road user, the median of the tries, m.
    pub nearest_m: Option<f64>,
    /// The tries, so that they can be played again.
    pub samples: Vec<Sample>,
}

/// One try.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Sample {
    /// Seed of the drive.
    pub seed: u64,
    pub step: usize,
    /// Why it failed; `None` if it did what the row says.
    pub failure: Option<String>,
}

/// Trials that are ready to be made.
pub struct Trials<'a> {
    arena: &'a Arena,
    settings: TrialSettings,
}

/// A moment of an undisturbed drive, and what every row would do then.
struct Moment {
    seed: u64,
    step: usize,
    world: World,
    ads: Box<dyn Ads>,
    offers: Vec<Offer>,
}

/// The outcome of one try.
struct Try {
    failure: Option<String>,
    unfair: Option<String>,
    nearest_m: Option<f64>,
}

impl<'a> Trials<'a> {
    pub fn new(arena: &'a Arena, settings: TrialSettings) -> Trials<'a> {
        Trials { arena, settings }
    }

    /// All cells, by row and then by road; some roads are tried at the same time. `judged` is called after each.
    pub fn cells(&self, judged: &(dyn Fn() + Sync)) -> Vec<Cell> {
        let roads: Vec<usize> = (0..self.arena.roads()).collect();
        let by_road = in_order(&roads, ROADS_AT_ONCE, |&road| self.road(road, judged));
        let rows = 0..self.arena.table().rows().len();
        rows.flat_map(|row| by_road.iter().map(move |cells| cells[row].clone())).collect()
    }

    /// The cells of the nth road of the arena, by row.
    fn road(&self, road: usize, judged: &(dyn Fn() + Sync)) -> Vec<Cell> {
        let alone = self.moments(road, &[]);
        let mut later: BTreeMap<Vec<usize>, Vec<Moment>> = BTreeMap::new();
        let rows = self.arena.table().rows();
        let judge = |row: &Row| {
            let is_legal = |moments: &[Moment]| moments.iter().any(|moment| moment.offers[row.index].is_ok());
            let mut before = None;
            if !is_legal(&alone) {
                for rows in self.arena.table().space().choices_before(row) {
                    let after = later.entry(rows.clone()).or_insert_with(|| self.moments(road, &rows));
                    if is_legal(after) {
                        before = Some(rows);
                        break;
                    }
                    before = before.or((!after.is_empty()).then_some(rows));
                }
            }
            let moments = before.as_ref().map_or(&alone, |rows| &later[rows]);
            let cell = self.cell(road, row.index, before.unwrap_or_default(), moments);
            judged();
            cell
        };
        rows.iter().map(judge).collect()
    }

    /// A try again, as an episode that ends when the judge has seen enough.
    pub fn again(&self, road: usize, cell: &Cell, sample: &Sample) -> EpisodeLog {
        let row = cell.row;
        let setup = self.arena.setup(road, sample.seed);
        let table = self.arena.table();
        let space = table.space();
        let action = &space.actions[space.rows[row].action];
        let seen_s = judge::horizon_s(action.manoeuvres().next().is_some());
        let steps = (seen_s / space.episode.step_s).ceil() as usize;
        let mut before = VecDeque::from(cell.before.clone());
        let mut choose = |moment: &episode::Moment| {
            if moment.step >= sample.step + steps {
                return Choice::Stop;
            }
            if moment.step != sample.step {
                return carry_out_next(table, &mut before, moment);
            }
            Choice::of(row, table.offer(moment.situation, row))
        };
        episode::run(&setup, &mut choose)
    }

    /// The moments of undisturbed drives; those after some rows were carried out, if some are given.
    fn moments(&self, road: usize, before: &[usize]) -> Vec<Moment> {
        let table = self.arena.table();
        let mut moments = Vec::new();
        for drive in 0..u64::from(self.settings.drives) {
            let seed = rng::child_seed(self.settings.seed, Stream::Episode, drive);
            let setup = self.arena.setup(road, seed);
            let step_ticks = (table.space().episode.step_s / avastra_world::sim::DT_S).round() as u64;
            let mut open: VecDeque<usize> = before.iter().copied().collect();
            let mut offered = Vec::new();
            let mut snapshots: Vec<(World, Box<dyn Ads>)> = Vec::new();
            let log = episode::run_watched(
                &setup,
                &mut |moment| {
                    offered.push(open.is_empty().then(|| table.offers(moment.situation)));
                    carry_out_next(table, &mut open, moment)
                },
                &mut |world, ads, _| {
                    if world.ticks().is_multiple_of(step_ticks) {
                        snapshots.push((world.clone(), ads.clone_box()));
                    }
                },
            );
            debug_assert!(snapshots.len() >= log.steps.len());
            let at_steps = snapshots.into_iter().zip(offered).enumerate();
            moments.extend(at_steps.filter_map(|(step, ((world, ads), offers))| {
                Some(Moment { seed, step, world, ads, offers: offers? })
            }));
        }
        moments
    }

    fn cell(&self, road: usize, row: usize, before: Vec<usize>, moments: &[Moment]) -> Cell {
        let legal: Vec<(&Moment, &Draw)> =
            moments.iter().filter_map(|moment| Some((moment, moment.offers[row].as_ref().ok()?))).collect();
        let mut refusals = Vec::new();
        for moment in moments {
            if let Err(refusal) = &moment.offers[row] {
                Count::add(&mut refusals, &refusal.in_words());
            }
        }
        let tries = legal.len().min(self.settings.tries as usize);
        let (mut failures, mut unfair, mut samples) = (Vec::new(), Vec::new(), Vec::new());
        let mut nearest_m = Vec::new();
        for number in 0..tries {
            let (moment, draw) = legal[number * legal.len() / tries];
            let found = attempt(moment, draw, &self.arena.table().space().bearers);
            found.failure.iter().for_each(|why| Count::add(&mut failures, why));
            found.unfair.iter().for_each(|why| Count::add(&mut unfair, why));
            nearest_m.extend(found.nearest_m);
            samples.push(Sample { seed: moment.seed, step: moment.step, failure: found.failure });
        }
        let realised = samples.iter().filter(|sample| sample.failure.is_none()).count();
        nearest_m.sort_by(f64::total_cmp);
        let table = self.arena.table();
        let labels = |rows: &[usize]| rows.iter().map(|row| &*table.rows()[*row].label).collect::<Vec<_>>();
        Cell {
            row,
            label: table.rows()[row].label.clone(),
            road: self.arena.road(road).name.clone(),
            after: (!before.is_empty()).then(|| labels(&before).join(" and ")),
            before,
            outcome: match (tries, realised) {
                (0, _) => Outcome::Masked,
                (_, 0) => Outcome::NotRealised,
                (tries, realised) if realised < tries => Outcome::Partly,
                _ => Outcome::Realised,
            },
            moments: moments.len(),
            legal: legal.len(),
            tried: tries,
            realised,
            failures,
            refusals,
            unfair,
            nearest_m: nearest_m.get(nearest_m.len() / 2).copied(),
            samples,
        }
    }
}

/// Carries rows out one after another, each as soon as it is legal, and then lets time pass.
fn carry_out_next(table: &ActionTable, open: &mut VecDeque<usize>, moment: &episode::Moment) -> Choice {
    let Some(draw) = open.front().and_then(|row| table.offer(moment.situation, *row).ok()) else {
        return Choice::Pass;
    };
    open.pop_front();
    Choice::Act(draw)
}

/// Carries a draw out and judges everything that it does. `bearers` are the names that road users bear.
fn attempt(moment: &Moment, draw: &Draw, bearers: &[String]) -> Try {
    let mut world = moment.world.clone();
    let mut found = Try { failure: None, unfair: None, nearest_m: None };
    let newcomers = match world.carry_out(draw) {
        Ok(newcomers) => newcomers,
        Err((nth, reason)) => {
            let is_order = matches!(draw.effects[nth], Effect::Order(_) | Effect::Light(_));
            let verb = if is_order { "order" } else { "spawn" };
            found.failure = Some(format!("cannot {verb}: {reason}"));
            return found;
        }
    };
    found.failure = unmet(&world, &draw.effects);
    let scene = Arc::clone(world.scene());
    let ordered = draw.effects.iter().enumerate().filter_map(|(nth, effect)| match effect {
        Effect::Order(order) => Some((nth, world.bearer_id(order.bearer)?)),
        Effect::Time(_) | Effect::Sky(..) | Effect::Spawn(_) | Effect::Light(_) => None,
    });
    let is_told = |request: &SpawnRequest| {
        let is_for_it =
            |effect: &Effect| matches!(effect, Effect::Order(order) if Some(order.bearer) == request.bearer);
        draw.effects.iter().any(is_for_it)
    };
    let watched: Vec<(usize, u32)> = newcomers.into_iter().chain(ordered).collect();
    // Whom a failure is about, where it may be several.
    let named = |effect: &Effect| match effect {
        _ if watched.len() < 2 => None,
        Effect::Spawn(request) => Some(&bearers[request.bearer?]),
        Effect::Order(order) => Some(&bearers[order.bearer]),
        Effect::Time(_) | Effect::Sky(..) | Effect::Light(_) => None,
    };
    for (nth, id) in watched.iter().copied() {
        let (request, told) = match &draw.effects[nth] {
            Effect::Spawn(request) => (Some(request), request.told.only(&[Field::Turn])),
            Effect::Order(order) => (None, order.command),
            Effect::Time(_) | Effect::Sky(..) | Effect::Light(_) => continue,
        };
        let complaint = || request.and_then(|request| fairness::complaint(&world, request, id));
        found.unfair = found.unfair.or_else(complaint);
        let mut ads = moment.ads.clone();
        let mut sensed: Sensed = world.sensed();
        let has_phases = draw.course(nth).is_some();
        let horizon_s = judge::horizon_s(has_phases);
        let Some(seen) = sighting::watch(world.clone(), ads.as_mut(), &mut sensed, id, &told, horizon_s)
        else {
            found.failure = Some("it is gone at once".to_owned());
            continue;
        };
        let nearest_m = seen.frames.iter().map(|frame| frame.gap_m).fold(f64::INFINITY, f64::min);
        found.nearest_m = Some(found.nearest_m.map_or(nearest_m, |other| other.min(nearest_m)));
        let verdict = match request {
            // Orders of the same action to it are judged separately.
            Some(request) if is_told(request) => judge::appears(&scene, request, &seen),
            Some(request) => judge::verdict(&scene, request, has_phases, &seen),
            None => judge::obeys(has_phases, &seen),
        };
        if let Err(why) = verdict.and_then(|()| judge::keeps_clear_and_time(&seen)) {
            let name = named(&draw.effects[nth]).map_or_else(String::new, |name| format!("`{name}`: "));
            found.failure.get_or_insert(format!("{name}{why}"));
        }
    }
    found
}

/// The first effect on weather or time that the world does not show.
fn unmet(world: &World, effects: &[Effect]) -> Option<String> {
    let last = |wanted: Phenomenon| {
        effects.iter().rev().find_map(|effect| match effect {
            Effect::Sky(phenomenon, level) if *phenomenon == wanted => Some(*level),
            _ => None,
        })
    };
    for (phenomenon, found) in
        [Phenomenon::Rain, Phenomenon::Fog, Phenomenon::Wetness].into_iter().zip(world.sky())
    {
        if last(phenomenon).is_some_and(|level| level != found) {
            return Some("the weather is not what was asked for".to_owned());
        }
    }
    let time = effects.iter().rev().find_map(|effect| match effect {
        Effect::Time(time) => Some(*time),
        _ => None,
    });
    time.filter(|time| *time != world.time_of_day()).map(|_| "the time is not what was asked for".to_owned())
}
