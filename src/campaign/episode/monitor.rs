//! Whether the ego vehicle keeps what the space requires, judged at every tick up to the first contact.
//!
//! A requirement with `within D` is breached at a tick if its condition failed at every tick of the D before it and at
//! itself; its margin there is the largest one of these ticks. One unbroken stretch of such ticks is one breach. Nothing
//! is asked where `when` does not hold, and what is asked only since less than D cannot be breached yet. A requirement `on`
//! bodies is asked of each road user near, and all of this holds for each of them by itself.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use avastra_lang::model::expr::{Expr, ExprKind};
use avastra_lang::model::vocabulary::Fact;
use avastra_lang::model::{
    BodyWord, Facts, FnDef, Kept, Memory, NpcFacts, ReadyRequirement, RequirementDef, SpawnFacts, WorldFacts,
};
use avastra_world::sim::{DT_S, MomentParts, Obstacle, Watched, WatchedParts, World};

use super::setup::Setup;

/// A requirement `on` bodies is asked of road users at most this far away, m: as far as `nearest` looks.
const NEAR_M: f64 = 100.0;

/// A stretch of time in which the ego vehicle did not keep a requirement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breach {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// When it became a breach, s: at the end of the time that `within` grants.
    pub time_s: f64,
    /// The last moment of it, s.
    pub until_s: f64,
    /// The smallest margin of it, SI; `None` for a requirement without one.
    pub margin: Option<f64>,
    /// Index of the step in which it began.
    pub step: usize,
    /// The number of the road user that it is about, if the requirement is about some.
    pub obstacle: Option<u32>,
}

/// The smallest margin of a requirement over an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// SI; `None` if it was never asked for long enough, or has no margin.
    pub smallest: Option<f64>,
    /// For how long it was asked, s; of several road users at once only once.
    pub asked_s: f64,
}

/// Watches the requirements that are in force.
#[derive(Debug, Clone)]
pub(super) struct Monitor {
    watched: Watched,
    /// The facts of the moment, filled anew at every tick.
    facts: WorldFacts,
    watches: Vec<Watch>,
    /// What of the moment, and of what is watched, they ask for.
    moment: MomentParts,
    tick: WatchedParts,
    /// The road users that requirements name, by index in `Space::bearers`.
    bearers: Vec<usize>,
    breaches: Vec<Breach>,
}

/// A requirement with its answers up to now.
#[derive(Debug, Clone)]
struct Watch {
    required: Arc<Required>,
    /// About the ego vehicle alone, or about each of the road users near.
    ego: Stretch,
    each: Vec<Stretch>,
    /// The smallest margin of those that are over.
    smallest: Option<f64>,
    /// Ticks in which it was asked.
    asked: u32,
}

/// What of a requirement is looked at in every tick.
#[derive(Debug)]
struct Required {
    /// By index in `Space::requirements`.
    index: usize,
    within_ticks: u32,
    on: Vec<BodyWord>,
    ready: ReadyRequirement,
}

/// A requirement, of one road user or of none.
#[derive(Debug, Clone, Default)]
struct Stretch {
    obstacle: Option<u32>,
    tally: Tally,
    /// The breach that goes on, by index.
    open: Option<usize>,
}

/// The answers of a requirement up to now.
#[derive(Debug, Clone, Default)]
struct Tally {
    /// Ticks in which it was asked without a break, and in which it failed without a break.
    asked: u32,
    failed: u32,
    window: Window,
    /// Ticks for which the window still holds a margin above the smallest one, which is not in it.
    above: u32,
    smallest: Option<f64>,
}

impl Monitor {
    /// `None` where no requirement is in force.
    pub fn new(setup: &Setup) -> Option<Monitor> {
        let watch = |index: usize| {
            let requirement = &setup.table.space().requirements[index];
            let RequirementDef { within_ticks, ref on, .. } = *requirement;
            let required = Required { index, within_ticks, on: on.clone(), ready: requirement.ready() };
            Watch {
                required: Arc::new(required),
                ego: Stretch::default(),
                each: Vec::new(),
                smallest: None,
                asked: 0,
            }
        };
        let watches: Vec<Watch> = setup.rules.required().map(watch).collect();
        let of = |watch: &Watch| &setup.table.space().requirements[watch.required.index].bearers;
        let mut bearers: Vec<usize> = watches.iter().flat_map(|watch| of(watch).iter().copied()).collect();
        bearers.sort_unstable();
        bearers.dedup();
        let all = watches.iter().flat_map(|watch| {
            let RequirementDef { when, condition, .. } =
                &setup.table.space().requirements[watch.required.index];
            when.iter().chain([condition])
        });
        let all: Vec<&Expr> = all.collect();
        let facts = all.iter().flat_map(|expr| {
            expr.filter_map(|kind| match kind {
                ExprKind::Fact(fact) => Some(*fact),
                _ => None,
            })
        });
        let words = all.iter().flat_map(|expr| {
            expr.filter_map(|kind| match kind {
                ExprKind::IsWord(word, _) => Some(*word),
                _ => None,
            })
        });
        let facts: Vec<Fact> = facts.collect();
        let moment = MomentParts::of(facts.iter().copied(), words);
        let tick = WatchedParts::of(facts);
        let monitor = Monitor {
            moment,
            tick,
            watched: Watched::default(),
            facts: WorldFacts::default(),
            watches,
            bearers,
            breaches: Vec::new(),
        };
        (!monitor.watches.is_empty()).then_some(monitor)
    }

    /// Judges the moment after a tick without a contact; `step` is the one that is driven. Beside the world stand the own
    /// bodies of road users, by their numbers.
    pub fn judge(
        &mut self,
        setup: &Setup,
        (world, own_bodies): (&World, &BTreeMap<u32, usize>),
        memory: &Memory,
        step: usize,
    ) {
        self.facts.moment = world.moment_facts_of(self.moment);
        self.facts.step = step as u64;
        self.facts.tick = self.watched.look(world, self.tick);
        if !self.bearers.is_empty() {
            self.facts.bearers.clear();
            let there = self.bearers.iter().filter_map(|who| Some((*who, world.bearer_facts(*who)?)));
            self.facts.bearers.extend(there);
        }
        let facts =
            Facts { road: Some(&setup.road.facts), world: Some(&self.facts), ..Facts::new(&[], memory) };
        let functions = &setup.table.space().functions;
        let moment = Judged { functions, facts: &facts, time_s: world.time_s(), step };
        for watch in &mut self.watches {
            let required = &watch.required;
            let is_asked = if required.on.is_empty() {
                watch.ego.ask(required, &facts, &moment, &mut self.breaches)
            } else {
                let near = near(world, own_bodies, &required.on);
                watch.ask_of_each(&near, &moment, &mut self.breaches)
            };
            watch.asked += u32::from(is_asked);
        }
    }

    /// The requirements that were breached at some moment since a time, by bit.
    pub fn breached_since(&self, time_s: f64) -> u64 {
        let since = self.breaches.iter().filter(|breach| breach.until_s > time_s);
        since.fold(0, |set, breach| set | 1 << breach.requirement)
    }

    /// What was found up to now, breaches by rising time.
    pub fn found(self) -> (Vec<Breach>, Vec<Margin>) {
        let margin = |watch: &Watch| {
            let all = watch.each.iter().chain([&watch.ego]);
            let smallest = all.map(|stretch| stretch.tally.smallest).fold(watch.smallest, smaller);
            Margin { requirement: watch.required.index, smallest, asked_s: f64::from(watch.asked) * DT_S }
        };
        (self.breaches, self.watches.iter().map(margin).collect())
    }
}

/// The moment that is judged.
struct Judged<'a> {
    functions: &'a [FnDef],
    facts: &'a Facts<'a>,
    time_s: f64,
    step: usize,
}

/// The road users near that have one of these bodies, with what may be asked of them.
fn near(world: &World, own_bodies: &BTreeMap<u32, usize>, on: &[BodyWord]) -> Vec<(u32, NpcFacts)> {
    let is_meant = |obstacle: &&Obstacle| {
        let body = BodyWord { like: obstacle.body, own: own_bodies.get(&obstacle.id).copied() };
        obstacle.distance_m <= NEAR_M && !obstacle.is_apart && on.iter().any(|named| body.is(*named))
    };
    let near = world.obstacles().filter(is_meant).map(|obstacle| obstacle.id);
    near.filter_map(|id| Some((id, world.npc_facts(id)?))).collect()
}

impl Watch {
    /// Judges a requirement about each of the road users that are near. Returns whether it is asked of any now.
    fn ask_of_each(&mut self, near: &[(u32, NpcFacts)], moment: &Judged, breaches: &mut Vec<Breach>) -> bool {
        // Who is no longer near is asked nothing, and begins anew if it comes back.
        let smallest = &mut self.smallest;
        self.each.retain(|stretch| {
            let stays = near.iter().any(|(id, _)| stretch.obstacle == Some(*id));
            if !stays {
                *smallest = smaller(*smallest, stretch.tally.smallest);
            }
            stays
        });
        let mut is_asked = false;
        for (id, npc) in near {
            let known = self.each.iter().position(|stretch| stretch.obstacle == Some(*id));
            let index = known.unwrap_or_else(|| {
                self.each.push(Stretch { obstacle: Some(*id), ..Stretch::default() });
                self.each.len() - 1
            });
            let spawn = Some(SpawnFacts { npc: *npc, ..SpawnFacts::default() });
            let facts = Facts { spawn, ..*moment.facts };
            is_asked |= self.each[index].ask(&self.required, &facts, moment, breaches);
        }
        is_asked
    }
}

impl Stretch {
    /// Asks by these facts, and keeps what of `breaches` follows. Returns whether anything is asked.
    #[inline]
    fn ask(
        &mut self,
        required: &Required,
        facts: &Facts,
        moment: &Judged,
        breaches: &mut Vec<Breach>,
    ) -> bool {
        let Some(kept) = required.ready.at(moment.functions, facts) else {
            self.tally.pause();
            self.open = None;
            return false;
        };
        let margin = self.tally.take(kept, required.within_ticks);
        if self.tally.failed <= required.within_ticks {
            self.open = None;
            return true;
        }
        let Judged { time_s, step, .. } = *moment;
        match self.open.and_then(|open| breaches.get_mut(open)) {
            Some(breach) => {
                breach.until_s = time_s;
                breach.margin = smaller(breach.margin, margin);
            }
            None => {
                self.open = Some(breaches.len());
                let (requirement, obstacle) = (required.index, self.obstacle);
                breaches.push(Breach { requirement, time_s, until_s: time_s, margin, step, obstacle });
            }
        }
        true
    }
}

impl Tally {
    /// Nothing is asked now.
    fn pause(&mut self) {
        (self.asked, self.failed, self.above) = (0, 0, 0);
        self.window.clear();
    }

    /// Takes the answer of a tick. Returns the margin of the time that `within` grants, if it can be that of a breach or
    /// smaller than all before.
    fn take(&mut self, kept: Kept, within_ticks: u32) -> Option<f64> {
        self.asked += 1;
        self.failed = if kept.holds { 0 } else { self.failed + 1 };
        if kept.margin.is_nan() {
            return None;
        }
        // As long as it is in the window, nothing there becomes the smallest, and nothing is breached: the usual case.
        if kept.holds && self.smallest.is_some_and(|smallest| kept.margin > smallest) {
            self.window.clear();
            self.above = within_ticks;
            return None;
        }
        let largest = self.window.largest(kept.margin, within_ticks);
        if self.above > 0 {
            self.above -= 1;
            return None;
        }
        let margin = Some(largest).filter(|_| self.asked > within_ticks);
        self.smallest = smaller(self.smallest, margin);
        margin
    }
}

fn smaller(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

/// The largest of the last margins (Lemire 2006: those that a later, larger one outlives are dropped).
#[derive(Debug, Clone, Default)]
struct Window {
    tick: u32,
    /// Ticks with falling margins.
    falling: VecDeque<(u32, f64)>,
}

impl Window {
    fn clear(&mut self) {
        if !self.falling.is_empty() {
            self.falling.clear();
        }
    }

    /// Takes one more; the largest of it and so many before it.
    fn largest(&mut self, margin: f64, before: u32) -> f64 {
        // Without anything before it, it is the largest.
        if before == 0 {
            return margin;
        }
        self.tick += 1;
        while self.falling.back().is_some_and(|(_, last)| *last <= margin) {
            self.falling.pop_back();
        }
        self.falling.push_back((self.tick, margin));
        while self.falling.front().is_some_and(|(tick, _)| self.tick - tick > before) {
            self.falling.pop_front();
        }
        self.falling[0].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use avastra_base::rng::{self, Stream, below, stream};
    use avastra_lang::check::{ReadError, load};

    /// Breaches as (first tick, last tick) and the smallest margin, by the definition.
    fn naive(answers: &[Option<f64>], within: usize) -> (Vec<(usize, usize)>, Option<f64>) {
        let at = |tick: usize| -> Option<f64> {
            let window = &answers[tick.checked_sub(within)?..=tick];
            window
                .iter()
                .copied()
                .collect::<Option<Vec<f64>>>()
                .map(|all| all.into_iter().fold(f64::NEG_INFINITY, f64::max))
        };
        let mut breaches: Vec<(usize, usize)> = Vec::new();
        for tick in (0..answers.len()).filter(|tick| at(*tick).is_some_and(|margin| margin < 0.0)) {
            match breaches.last_mut() {
                Some((_, last)) if *last + 1 == tick => *last = tick,
                _ => breaches.push((tick, tick)),
            }
        }
        let margins = (0..answers.len()).filter_map(at);
        (breaches, margins.reduce(f64::min))
    }

    #[test]
    fn breaches_and_margins_are_those_of_the_definition() {
        let mut rng = stream(11, Stream::Episode, 0);
        for _ in 0..10_000 {
            let within = below(&mut rng, 6);
            let answers: Vec<Option<f64>> = (0..=below(&mut rng, 39))
                .map(|_| (below(&mut rng, 8) > 0).then(|| f64::from(below(&mut rng, 8)) - 4.5))
                .collect();
            let mut watch = Tally::default();
            let mut breaches: Vec<(usize, usize)> = Vec::new();
            let mut is_open = false;
            for (tick, answer) in answers.iter().enumerate() {
                match answer {
                    None => {
                        watch.pause();
                        is_open = false;
                    }
                    Some(margin) => {
                        watch.take(Kept { holds: *margin >= 0.0, margin: *margin }, within);
                        let is_breached = watch.failed > within;
                        match breaches.last_mut() {
                            Some((_, last)) if is_breached && is_open => *last = tick,
                            _ if is_breached => breaches.push((tick, tick)),
                            _ => {}
                        }
                        is_open = is_breached;
                    }
                }
            }
            let expected = naive(&answers, within as usize);
            assert_eq!((breaches, watch.smallest), expected, "{answers:?} within {within}");
        }
    }

    /// A condition that a seed makes up: its text, and what it means, once more and apart from the language.
    struct MadeUp {
        text: String,
        margin: Box<dyn Fn(f64, f64) -> f64>,
    }

    /// Over the speed `v` and the limit `w` of a moment, both in m/s.
    fn made_up(rng: &mut rng::Rng, depth: u32) -> MadeUp {
        let number = f64::from(below(rng, 80)) / 4.0;
        let side = |rng: &mut rng::Rng| -> (String, Box<dyn Fn(f64, f64) -> f64>) {
            let part = f64::from(below(rng, 8)) / 4.0;
            match below(rng, 4) {
                0 => ("ego.speed".to_owned(), Box::new(|v, _| v)),
                1 => ("ego.limit".to_owned(), Box::new(|_, w| w)),
                2 => (format!("({part} * ego.speed)"), Box::new(move |v, _| part * v)),
                _ => ("(ego.limit - ego.speed)".to_owned(), Box::new(|v, w| w - v)),
            }
        };
        let (text, of) = side(rng);
        let kind = below(rng, if depth == 0 { 5 } else { 9 });
        let mut two = || (made_up(rng, depth.saturating_sub(1)), made_up(rng, depth.saturating_sub(1)));
        let (text, margin): (String, Box<dyn Fn(f64, f64) -> f64>) = match kind {
            0 => (format!("{text} < {number} m/s"), Box::new(move |v, w| number - of(v, w))),
            1 => (format!("{text} <= {number} m/s"), Box::new(move |v, w| number - of(v, w))),
            2 => (format!("{text} > {number} m/s"), Box::new(move |v, w| of(v, w) - number)),
            3 => (format!("{text} >= {number} m/s"), Box::new(move |v, w| of(v, w) - number)),
            4 => (
                format!("{text} in {number} m/s .. {} m/s", number + 3.5),
                Box::new(move |v, w| (of(v, w) - number).min(number + 3.5 - of(v, w))),
            ),
            5 => {
                let (one, _) = two();
                (format!("not ({})", one.text), Box::new(move |v, w| -(one.margin)(v, w)))
            }
            6 => {
                let (a, b) = two();
                let text = format!("({}) and ({})", a.text, b.text);
                (text, Box::new(move |v, w| (a.margin)(v, w).min((b.margin)(v, w))))
            }
            7 => {
                let (a, b) = two();
                let text = format!("({}) or ({})", a.text, b.text);
                (text, Box::new(move |v, w| (a.margin)(v, w).max((b.margin)(v, w))))
            }
            _ => {
                let (a, b) = two();
                let text = format!("({}) implies ({})", a.text, b.text);
                (text, Box::new(move |v, w| (-(a.margin)(v, w)).max((b.margin)(v, w))))
            }
        };
        MadeUp { text, margin }
    }

    /// 10,000 conditions, each over a trace of its own, against a monitor that follows the definition.
    #[test]
    fn margins_are_those_of_a_naive_monitor() {
        const AT_ONCE: usize = 50;
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        for part in 0..200 {
            let mut rng = stream(5, Stream::Episode, part);
            let all: Vec<(MadeUp, u32)> =
                (0..AT_ONCE).map(|_| (made_up(&mut rng, 3), below(&mut rng, 5))).collect();
            let mut text = "language 1\nuse \"roads.ava\"\nstate told: Bool = false\naction tell() { set told = true }\n\
                            rule at_last on tell: elapsed >= 6 s or told\n"
                .to_owned();
            for (index, (one, within)) in all.iter().enumerate() {
                let within = if *within == 0 { String::new() } else { format!(" within {} ms", within * 20) };
                text.push_str(&format!("require r{index}: {}{within}\n", one.text));
            }
            let made_up = folder.join("made_up.ava");
            let read = |path: &Path| match path.ends_with("made_up.ava") {
                true => Ok(text.clone()),
                false => std::fs::read_to_string(path).map_err(|error| ReadError(error.to_string())),
            };
            let loaded = load(&made_up, &read).expect("it can be read");
            let Some(space) = loaded.space else { panic!("{:?}", loaded.diagnostics) };
            let memory = space.initial_memory(1);
            for (required, (one, within)) in space.requirements.iter().zip(&all) {
                let trace: Vec<(f64, f64)> = (0..30)
                    .map(|_| (f64::from(below(&mut rng, 60)) / 3.0, f64::from(below(&mut rng, 60)) / 3.0))
                    .collect();
                let (mut watch, ready, mut smallest) = (Tally::default(), required.ready(), None);
                for (tick, (v, w)) in trace.iter().enumerate() {
                    let mut world = WorldFacts::default();
                    (world.moment.ego_speed_mps, world.moment.ego_limit_mps) = (*v, *w);
                    let facts = Facts { world: Some(&world), ..Facts::new(&[], &memory) };
                    let kept = ready.at(&space.functions, &facts).expect("it is always asked");
                    watch.take(kept, required.within_ticks);
                    let first = tick.checked_sub(*within as usize);
                    let window =
                        first.map(|first| trace[first..=tick].iter().map(|(v, w)| (one.margin)(*v, *w)));
                    let wanted = window.map(|margins| margins.fold(f64::NEG_INFINITY, f64::max));
                    smallest = smaller(smallest, wanted);
                    let same = match (watch.smallest, smallest) {
                        (Some(found), Some(wanted)) => (found - wanted).abs() <= 1e-9 * (1.0 + wanted.abs()),
                        (found, wanted) => found.is_none() && wanted.is_none(),
                    };
                    assert!(same, "{}: {:?} in place of {smallest:?}", one.text, watch.smallest);
                    let is_breached = watch.failed > *within;
                    let is_clear = wanted.is_none_or(|wanted| wanted.abs() > 1e-6);
                    assert!(
                        !is_clear || is_breached == wanted.is_some_and(|wanted| wanted < 0.0),
                        "{}",
                        one.text
                    );
                }
            }
        }
    }
}
