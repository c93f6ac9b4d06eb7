//! Importance sampling of rows, by trials beside the episode: rows that a pilot found dangerous are tried out more often
//! than chance would choose them, and weigh as much less.
//! An episode is played by chance. At each step some of the rows that were not chosen are tried out. Each is tried in a
//! copy of the moment, with the values that were drawn for it anyway, and then played on by chance. An event belongs to the
//! step in which the road user that was hit appeared (or was hit, if no action made it appear). A trial counts only
//! events of the trial's step. So each event is looked for in one step alone, and the steps add up to all events, without
//! bias, whatever the plan. A trial ends when the event came, or when nothing is left of what its row made appear.
//!
//! A trial shares all seeds with its episode, so it is an episode of the same seed with another script. Its findings are
//! written as scenarios like any other. `plan` says how rows are chosen for trials, and where the weights come from.

use std::sync::atomic::AtomicBool;

use crate::episode;
use crate::episode::{Choice, EpisodeLog, Moment, Play, Setup};
use crate::run::{Offers, choose, on_threads};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_search::agent::Agent;
use avastra_world::action::Draw;

use crate::estimate::part::{Event, Part, PartRecord};
use crate::estimate::plan::{Cell, Pilot, Plan, Situation, weight};
use crate::estimate::ready::{Estimate, EventPlace};

/// Rounds of a pilot. The first tries all rows equally often; each later one uses what the rounds before it found. Ours.
const ROUNDS: u32 = 3;
/// Trials at each moment of a pilot that are spread evenly over all rows: in the first round, and later. Ours.
const EVEN_FIRST: f64 = 1.0;
const EVEN_LATER: f64 = 0.25;
/// Episodes of a round on each road: this share of those that the estimate has, and at least so many. Ours.
const ROUND_SHARE: f64 = 0.03;
const ROUND_EPISODES_MIN: u32 = 10;

/// A step of an episode: what was chosen, and what else was tried.
struct Step {
    /// Nothing if no row was legal.
    chosen: Option<Considered>,
    /// The rows to try out, with the moment that they begin at.
    trials: Vec<(Considered, Draw)>,
    moment: Option<Play>,
}

/// A row, with the probabilities that it was up to.
#[derive(Clone, Copy)]
struct Considered {
    cell: Cell,
    weight: f64,
}

/// A pilot's observations, from which a plan follows; `None` if it was stopped.
pub fn pilot(estimate: &Estimate, threads: usize, stop: &AtomicBool) -> Option<Pilot> {
    let settings = estimate.settings();
    let episodes = f64::from(settings.parts) * f64::from(settings.run.episodes) * ROUND_SHARE;
    let episodes = (episodes as u32).max(ROUND_EPISODES_MIN);
    let mut all = Pilot::default();
    for round in 0..ROUNDS {
        let plan = match round {
            0 => Plan::even(EVEN_FIRST),
            _ => Plan::of(&all, EVEN_LATER),
        };
        // Numbers of parts that no estimate has.
        let number = u32::MAX - round;
        let roads = 0..settings.run.conditions.roads.len();
        let items: Vec<(Part, u32)> = roads
            .flat_map(|road| (0..episodes).map(move |episode| (Part { road, number }, episode)))
            .collect();
        let mut found = Vec::new();
        let work = |&(part, episode): &(Part, u32), tell: &mut dyn FnMut(_) -> bool| {
            let mut seen = Pilot::default();
            let mut record = PartRecord { part, ..PartRecord::default() };
            sampled(estimate, episode, &plan, &mut record, &mut |_, _, _| {}, Some(&mut seen));
            tell(((part, episode), seen));
        };
        let kept = on_threads(&items, threads, stop, work, &mut |news| {
            found.push(news);
            Ok::<_, core::convert::Infallible>(())
        });
        let Ok(()) = kept;
        if found.len() < items.len() {
            return None;
        }
        // The sums of seconds depend on their order.
        found.sort_by_key(|(item, _)| *item);
        found.iter().for_each(|(_, seen)| all.add(seen));
    }
    Some(all)
}

/// An episode of a part, with the trials beside it: their events.
pub fn probe(
    estimate: &Estimate,
    number: u32,
    plan: &Plan,
    record: &mut PartRecord,
) -> Vec<(Event, EpisodeLog)> {
    let mut events = Vec::new();
    let mut on = |considered: Option<Considered>, step: usize, log: EpisodeLog| {
        let weight = considered.map_or(1.0, |considered| considered.weight);
        let row = considered.map(|considered| considered.cell.row);
        events.push((Event { episode: number, step, row, weight }, log));
    };
    sampled(estimate, number, plan, record, &mut on, None);
    events
}

/// Plays an episode of a part and the trials beside it, and hands on each event with the row of the step that it belongs to.
fn sampled(
    estimate: &Estimate,
    number: u32,
    plan: &Plan,
    record: &mut PartRecord,
    on: &mut dyn FnMut(Option<Considered>, usize, EpisodeLog),
    mut seen: Option<&mut Pilot>,
) {
    let part = record.part;
    let setup = estimate.setup(part, number);
    let mut rng = rng::stream(setup.seed, Stream::Estimate, 0);
    let mut agent = estimate.run().agent();
    agent.begin(setup.seed);
    let mut steps = Vec::new();
    let heaviest = &mut record.weight_max;
    let mut choices = |moment: &Moment| {
        let (choice, step) =
            considered(agent.as_mut(), moment, part.road, plan, &mut rng, heaviest, seen.as_deref_mut());
        steps.push(step);
        choice
    };
    let log = episode::run(&setup, &mut choices);
    record.note_whole(&log);
    record.simulated_s += log.duration_s;
    let whole_s = log.duration_s;
    let own = estimate.event(&setup, &log);
    if let Some(pilot) = &mut seen {
        pilot.whole_s += whole_s;
        for (number, chosen) in steps.iter().enumerate().filter_map(|(at, step)| Some((at, step.chosen?))) {
            pilot.note(chosen.cell, own.is_some_and(|own| own.step == number));
        }
    }
    // A step that begins after the event has it behind itself already.
    let until = own.map_or(steps.len(), |own| own.hit_step + 1);
    if let Some(EventPlace { step, .. }) = own {
        on(steps.get(step).and_then(|step| step.chosen), step, log);
    }
    for (at, step) in steps.into_iter().enumerate().take(until) {
        for (row, draw) in step.trials {
            let moment = step.moment.clone().expect("a step with trials keeps its moment");
            let (log, tried_s) = tried(estimate, &setup, moment, at, draw);
            record.simulated_s += tried_s;
            let has_event = estimate.event(&setup, &log).is_some_and(|found| found.step == at);
            if let Some(pilot) = &mut seen {
                pilot.tried += 1;
                pilot.tried_s += tried_s;
                pilot.note(row.cell, has_event);
            }
            if has_event {
                on(Some(row), at, log);
            }
        }
    }
}

/// Lets the agent choose, and draws which of the other rows are tried out. `heaviest` is raised to the weight of any event that
/// may belong to this step.
fn considered(
    agent: &mut dyn Agent,
    moment: &Moment,
    road: usize,
    plan: &Plan,
    rng: &mut Rng,
    heaviest: &mut f64,
    seen: Option<&mut Pilot>,
) -> (Choice, Step) {
    let mut offers = Offers::of(agent, moment);
    let legal = offers.legal();
    let chances = agent.chances(legal.view()).expect("an estimate that tries rows out asked for them");
    let situation = Situation::of(&moment.situation.surroundings.moment());
    // Where nothing appears by itself, only what an action makes appear can be hit: no event belongs to other rows.
    let ambient = moment.setup().start.ambient;
    let may_matter = |draw: Option<&Draw>| draw.is_some_and(|draw| ambient > 0 || draw.makes_appear());
    let matters: Vec<bool> = offers.draws().map(may_matter).collect();
    let count = matters.iter().filter(|&&matters| matters).count();
    let weighed = |row: usize| {
        let cell = Cell { row, road, situation };
        let share = if matters[row] { plan.share(&cell, chances[row], count) } else { 0.0 };
        (Considered { cell, weight: weight(chances[row], share) }, share)
    };
    for row in (0..legal.len()).filter(|&row| matters[row]) {
        *heaviest = heaviest.max(weighed(row).0.weight);
    }
    let mut trials: Vec<(Considered, Draw)> = Vec::new();
    for (row, draw) in offers.draws().enumerate() {
        // Every row draws, so that the plan for one does not shift the draws of another.
        let ticket = rng::unit(rng);
        let (considered, share) = weighed(row);
        if let Some(draw) = draw.filter(|_| ticket < share) {
            trials.push((considered, draw.clone()));
        }
    }
    if let Some(pilot) = seen {
        for row in (0..legal.len()).filter(|&row| matters[row] && chances[row] > 0.0) {
            let seen = pilot.cells.entry(weighed(row).0.cell).or_default();
            seen.moments += 1;
            seen.chance += chances[row];
        }
    }
    let row = offers.chosen_by(agent);
    let choice = offers.choice(row);
    let chosen = match &choice {
        Choice::Act(draw) => Some(weighed(draw.row).0),
        _ => None,
    };
    // A trial of the chosen row would be the episode itself: it is seen already.
    trials.retain(|(row, _)| chosen.is_none_or(|chosen| chosen.cell != row.cell));
    let moment = (!trials.is_empty()).then(|| moment.snapshot());
    (choice, Step { chosen, trials, moment })
}

/// Tries a row out in a copy of a moment, until nothing that belongs to the step can happen any more. Returns the log,
/// and the simulated time, s.
fn tried(estimate: &Estimate, setup: &Setup, from: Play, step: usize, draw: Draw) -> (EpisodeLog, f64) {
    let mut agent = estimate.run().agent();
    agent.begin(setup.seed);
    let mut first = Some(draw);
    let (mut begun_ticks, mut judged) = (0, 0);
    let mut choices = |moment: &Moment| {
        if let Some(draw) = first.take() {
            begun_ticks = moment.ticks();
            judged = moment.collisions();
            return Choice::Act(draw);
        }
        if !moment.is_around(step) {
            return Choice::Stop;
        }
        if moment.collisions() > judged {
            judged = moment.collisions();
            if estimate.event(setup, &moment.log()).is_some() {
                return Choice::Stop;
            }
        }
        choose(agent.as_mut(), moment)
    };
    let log = episode::run_from(from, &mut choices, &mut |_, _, _| {}, &mut |_| {});
    let ticks = log.ticks - begun_ticks;
    (log, ticks as f64 * avastra_world::sim::DT_S)
}

impl Pilot {
    /// Takes in a row that was carried out, if an event could belong to it.
    fn note(&mut self, cell: Cell, has_event: bool) {
        // Where it could be chosen was noted before.
        if let Some(seen) = self.cells.get_mut(&cell) {
            seen.trials += 1;
            seen.events += u32::from(has_event);
        }
    }
}
