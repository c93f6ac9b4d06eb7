//! Whether the ego vehicle keeps what the space requires, judged at every tick up to and including the first contact.
//!
//! A requirement with `within D` is breached at a tick if its condition failed at every tick of the D before it and at
//! itself; its margin there is the largest one of these ticks. One unbroken stretch of such ticks is one breach. Nothing
//! is asked where `when` does not hold. As long as a requirement is asked only since less than D, it cannot be breached. A
//! requirement `on` bodies is asked of each road user near, and all of this holds for each of them by itself. A requirement
//! with `after` is breached D after that began to hold, if its condition failed at every tick from then on: a breach of
//! that tick. Its margin is the largest one of these ticks.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use avastra_lang::model::expr::ExprKind;
use avastra_lang::model::vocabulary::{Fact, Part, Parts, WordFact};
use avastra_lang::model::{
    Asked, BodyWord, Facts, FnDef, Kept, Memory, NearFacts, NpcFacts, ReadyRequirement, RequirementDef,
    RequirementMemory, Sliding, SpawnFacts, WorldFacts,
};
use avastra_lang::prove::is_never_asked;
use avastra_world::sim::{DT_S, Encroachment, Obstacle, Watched, World};

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
    /// The past places of the ego vehicle and of all other road users, if a requirement asks for them.
    encroachment: Option<Encroachment>,
    /// The facts of the moment, filled anew at every tick.
    facts: WorldFacts,
    watches: Vec<Watch>,
    /// The requirements that nothing is asked of on this road, by index in `Space::requirements`.
    idle: Vec<usize>,
    /// The parts of the moment, and of the watched quantities, that the watched requirements ask for.
    parts: Parts,
    /// The road users that requirements name, by index in `Space::bearers`.
    bearers: Vec<usize>,
    /// The bodies of the road users near of which they ask, by bit.
    asks_of: u32,
    breaches: Vec<Breach>,
    /// The smallest margin of each requirement in the step that ended last, if rewards ask for it; else NaN.
    of_step: Vec<f64>,
}

/// A requirement with its answers up to now.
#[derive(Debug, Clone)]
struct Watch {
    required: Arc<Required>,
    /// About the ego vehicle alone, or about each of the road users near; then the first remembers what is the same for all.
    ego: Stretch,
    each: Vec<Stretch>,
    /// The smallest margin of the steps before this one, if rewards ask for that of each step.
    of_steps: Option<f64>,
    /// That of the road users that are gone: since the step began, if rewards ask, else since the episode did.
    of_gone: Option<f64>,
    /// Ticks in which it was asked.
    asked: u32,
}

/// The part of a requirement that is looked at in every tick.
#[derive(Debug)]
struct Required {
    /// By index in `Space::requirements`.
    index: usize,
    within_ticks: u32,
    on: Vec<BodyWord>,
    ready: ReadyRequirement,
    /// Whether it looks at ticks before, whether some of that is the same for all road users, and whether it has an `after`.
    remembers: bool,
    remembers_of_ego: bool,
    is_response: bool,
    /// Whether rewards ask for its margin of each step.
    is_paid: bool,
}

impl Required {
    fn new(index: usize, requirement: &RequirementDef, is_paid: bool) -> Required {
        let RequirementDef { within_ticks, ref on, ref after, .. } = *requirement;
        let ready = requirement.ready();
        Required {
            index,
            within_ticks,
            on: on.clone(),
            remembers: ready.remembers(),
            remembers_of_ego: !on.is_empty() && ready.remembers_of_ego(),
            is_response: after.is_some(),
            is_paid,
            ready,
        }
    }
}

/// A requirement, of one road user or of none.
#[derive(Debug, Clone, Default)]
struct Stretch {
    obstacle: Option<u32>,
    memory: RequirementMemory,
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
    /// The margin of the condition at the last tick, if `asked` is not 0.
    now: f64,
    window: Sliding,
    /// Ticks for which the window still holds a margin above the smallest one, which is not in it.
    above: u32,
    smallest: Option<f64>,
    /// For a requirement with `after`, the ticks at which that began to hold, by `asked`, if no answer is due yet. Also the
    /// last tick at which the condition held.
    begun: VecDeque<u32>,
    held: Option<u32>,
}

/// The quantities that the conditions of the watched requirements ask about.
struct Questions {
    facts: Vec<Fact>,
    words: Vec<WordFact>,
    /// The bodies that each question about others names; all if it names none.
    bodies: Vec<Vec<BodyWord>>,
}

impl Questions {
    fn by(setup: &Setup, watches: &[Watch]) -> Questions {
        let on = watches.iter().map(|watch| watch.required.on.clone()).filter(|on| !on.is_empty());
        let mut asked = Questions { facts: Vec::new(), words: Vec::new(), bodies: on.collect() };
        for watch in watches {
            for expr in setup.table.space().requirements[watch.required.index].conditions() {
                asked.facts.extend(expr.filter_map(|kind| match kind {
                    ExprKind::Fact(fact) => Some(*fact),
                    _ => None,
                }));
                asked.words.extend(expr.filter_map(|kind| match kind {
                    ExprKind::IsWord(word, _) => Some(*word),
                    _ => None,
                }));
                asked.bodies.extend(expr.filter_map(|kind| match kind {
                    ExprKind::Near(_, bodies, _) => Some(bodies.clone()),
                    _ => None,
                }));
            }
        }
        asked
    }

    /// A bit for each body that is asked about.
    fn all_bodies(&self) -> u32 {
        self.bodies.iter().fold(0, |all, bodies| match bodies.as_slice() {
            [] => u32::MAX,
            named => named.iter().fold(all, |all, body| all | 1 << body.like as u32),
        })
    }
}

impl Monitor {
    /// `None` where no requirement is in force.
    pub fn new(setup: &Setup) -> Option<Monitor> {
        let paid = setup.table.space().margins_paid();
        let watch = |index: usize| {
            let requirement = &setup.table.space().requirements[index];
            let required = Required::new(index, requirement, paid >> index & 1 == 1);
            Watch {
                required: Arc::new(required),
                ego: Stretch::default(),
                each: Vec::new(),
                of_steps: None,
                of_gone: None,
                asked: 0,
            }
        };
        // A requirement about stop signs costs nothing where there is none.
        let is_idle = |index: &usize| is_never_asked(setup.table.space(), *index, &setup.road().facts);
        let (idle, asked): (Vec<usize>, Vec<usize>) = setup.rules.required().partition(is_idle);
        let watches: Vec<Watch> = asked.into_iter().map(watch).collect();
        let of = |watch: &Watch| &setup.table.space().requirements[watch.required.index].bearers;
        let mut bearers: Vec<usize> = watches.iter().flat_map(|watch| of(watch).iter().copied()).collect();
        bearers.sort_unstable();
        bearers.dedup();
        let questions = Questions::by(setup, &watches);
        let parts = Parts::of(questions.facts.iter().copied(), questions.words.iter().copied());
        let monitor = Monitor {
            parts,
            watched: Watched::default(),
            encroachment: parts.has(Part::Encroachment).then(Encroachment::default),
            facts: WorldFacts::default(),
            watches,
            idle,
            bearers,
            asks_of: questions.all_bodies(),
            breaches: Vec::new(),
            of_step: vec![f64::NAN; setup.table.space().requirements.len()],
        };
        (!monitor.watches.is_empty() || !monitor.idle.is_empty()).then_some(monitor)
    }

    /// Judges the moment after a tick, up to and including the tick of the first contact. `step` is the one that is driven;
    /// `own_bodies` maps the numbers of road users to bodies that the space declares.
    pub fn judge(
        &mut self,
        setup: &Setup,
        (world, own_bodies): (&World, &BTreeMap<u32, usize>),
        memory: &Memory,
        step: usize,
    ) {
        self.facts.moment = world.moment_facts_of(self.parts);
        self.facts.step = step as u64;
        self.facts.tick = self.watched.look(world, self.parts);
        if !self.bearers.is_empty() {
            self.facts.bearers.clear();
            let there = self.bearers.iter().filter_map(|who| Some((*who, world.bearer_facts(*who)?)));
            self.facts.bearers.extend(there);
        }
        if self.asks_of != 0 {
            if let Some(encroachment) = &mut self.encroachment {
                encroachment.note(world);
            }
            self.facts.near.clear();
            self.facts.near.extend(near(world, own_bodies, self.asks_of));
        }
        let (watched, encroachment, parts) = (&self.watched, &self.encroachment, self.parts);
        let watched_of = |id: u32, npc: NpcFacts| {
            let pet_s = encroachment.as_ref().map_or(npc.pet_s, |encroachment| encroachment.pet_s(id));
            watched.of_near(world, id, NpcFacts { pet_s, ..npc }, parts)
        };
        for near in &mut self.facts.near {
            near.npc = watched_of(near.id, near.npc);
        }
        let facts =
            Facts { road: Some(&setup.road().facts), world: Some(&self.facts), ..Facts::new(&[], memory) };
        let functions = &setup.table.space().functions;
        let moment = Judged { functions, facts: &facts, time_s: world.time_s(), step };
        let far = |id: u32| world.npc_facts(id).map(|npc| watched_of(id, npc));
        for watch in &mut self.watches {
            let required = &watch.required;
            let is_asked = if required.on.is_empty() {
                watch.ego.ask(required, (&facts, None), &moment, &mut self.breaches)
            } else {
                watch.ask_of_each(&far, &self.facts.near, &moment, &mut self.breaches)
            };
            watch.asked += u32::from(is_asked);
        }
    }

    /// The requirements that were breached at some moment since a time, by bit.
    pub fn breached_since(&self, time_s: f64) -> u64 {
        let since = self.breaches.iter().filter(|breach| breach.until_s > time_s);
        since.fold(0, |set, breach| set | 1 << breach.requirement)
    }

    /// The requirements that it asks, by index in `Space::requirements`.
    pub fn asked(&self) -> impl Iterator<Item = usize> {
        self.watches.iter().map(|watch| watch.required.index)
    }

    /// The margin of a requirement's condition at the tick that was judged last, of the worst of several road users; `None` where
    /// nothing was asked, or nothing could fail.
    pub fn now(&self, requirement: usize) -> Option<f64> {
        let watch = self.watches.iter().find(|watch| watch.required.index == requirement)?;
        let asked = watch.each.iter().chain([&watch.ego]).filter(|stretch| stretch.tally.asked > 0);
        asked.map(|stretch| stretch.tally.now).filter(|margin| margin.is_finite()).reduce(f64::min)
    }

    /// Ends a step. Returns the smallest margin of each requirement, if rewards ask for it; else NaN.
    pub fn end_step(&mut self) -> &[f64] {
        for watch in self.watches.iter_mut().filter(|watch| watch.required.is_paid) {
            let of_gone = watch.of_gone.take();
            let stretches = watch.each.iter_mut().chain([&mut watch.ego]);
            let smallest = stretches.map(|stretch| stretch.tally.smallest.take()).fold(of_gone, smaller);
            watch.of_steps = smaller(watch.of_steps, smallest);
            let is_known = smallest.filter(|smallest| smallest.is_finite());
            self.of_step[watch.required.index] = is_known.unwrap_or(f64::NAN);
        }
        &self.of_step
    }

    /// The findings up to now, breaches by rising time.
    pub fn found(self) -> (Vec<Breach>, Vec<Margin>) {
        let margin = |watch: &Watch| {
            let all = watch.each.iter().chain([&watch.ego]);
            let past = smaller(watch.of_steps, watch.of_gone);
            let smallest = all.map(|stretch| stretch.tally.smallest).fold(past, smaller);
            // With no road user near, `some` was as far as can be from holding, and `not some` from failing.
            let smallest = smallest.filter(|smallest| smallest.is_finite());
            Margin { requirement: watch.required.index, smallest, asked_s: f64::from(watch.asked) * DT_S }
        };
        let idle = self.idle.iter().map(|&requirement| Margin { requirement, smallest: None, asked_s: 0.0 });
        let mut margins: Vec<Margin> = self.watches.iter().map(margin).chain(idle).collect();
        margins.sort_by_key(|margin| margin.requirement);
        (self.breaches, margins)
    }
}

/// The moment that is judged.
struct Judged<'a> {
    functions: &'a [FnDef],
    facts: &'a Facts<'a>,
    time_s: f64,
    step: usize,
}

/// The road users near that are like one of these bodies, by bit, with what may be asked of them.
fn near(world: &World, own_bodies: &BTreeMap<u32, usize>, asks_of: u32) -> impl Iterator<Item = NearFacts> {
    let is_meant = move |obstacle: &&Obstacle| {
        asks_of >> obstacle.body as u32 & 1 == 1 && obstacle.distance_m <= NEAR_M && !obstacle.is_apart
    };
    world.obstacles().filter(is_meant).filter_map(|obstacle| {
        let body = BodyWord { like: obstacle.body, own: own_bodies.get(&obstacle.id).copied() };
        Some(NearFacts { id: obstacle.id, body, npc: world.npc_facts(obstacle.id)? })
    })
}

impl Watch {
    /// Judges a requirement about each of the road users that are near, or that still have to do what it asks after
    /// something. Returns whether it is asked of any now.
    fn ask_of_each(
        &mut self,
        facts_of: &dyn Fn(u32) -> Option<NpcFacts>,
        near: &[NearFacts],
        moment: &Judged,
        breaches: &mut Vec<Breach>,
    ) -> bool {
        let required = &self.required;
        if required.remembers_of_ego {
            required.ready.next_of_ego(&mut self.ego.memory, moment.functions, moment.facts);
        }
        if near.is_empty() && self.each.is_empty() {
            return false;
        }
        let is_meant = |near: &&NearFacts| near.is_of(&self.required.on);
        let mut asked: Vec<(u32, NpcFacts)> =
            near.iter().filter(is_meant).map(|near| (near.id, near.npc)).collect();
        // A road user that is no longer near is asked nothing, and begins anew if it comes back.
        let of_gone = &mut self.of_gone;
        self.each.retain(|stretch| {
            let id = stretch.obstacle.expect("each is about a road user");
            let is_awaited = !stretch.tally.begun.is_empty();
            let is_near = asked.iter().any(|(known, _)| *known == id);
            let far = (!is_near && is_awaited).then(|| facts_of(id)).flatten();
            asked.extend(far.map(|npc| (id, npc)));
            let stays = is_near || far.is_some();
            if !stays {
                *of_gone = smaller(*of_gone, stretch.tally.smallest);
            }
            stays
        });
        let mut is_asked = false;
        for (id, npc) in asked {
            let known = self.each.iter().position(|stretch| stretch.obstacle == Some(id));
            let index = known.unwrap_or_else(|| {
                self.each.push(Stretch { obstacle: Some(id), ..Stretch::default() });
                self.each.len() - 1
            });
            let spawn = Some(SpawnFacts { npc, ..SpawnFacts::default() });
            let facts = Facts { spawn, ..*moment.facts };
            let of_ego = self.required.remembers_of_ego.then_some(&self.ego.memory);
            is_asked |= self.each[index].ask(&self.required, (&facts, of_ego), moment, breaches);
        }
        is_asked
    }
}

impl Stretch {
    /// Asks by these facts, and by what is remembered for all road users, and keeps what of `breaches` follows. Returns whether
    /// anything is asked.
    #[inline]
    fn ask(
        &mut self,
        required: &Required,
        (facts, of_ego): (&Facts, Option<&RequirementMemory>),
        moment: &Judged,
        breaches: &mut Vec<Breach>,
    ) -> bool {
        let Some((margin, is_breached, is_asked)) = (match required.remembers {
            false => self.answer(required, facts, moment),
            true => self.answer_next(required, (facts, of_ego), moment),
        }) else {
            self.tally.pause();
            self.open = None;
            return false;
        };
        if !is_breached {
            self.open = None;
            return is_asked;
        }
        let Judged { time_s, step, .. } = *moment;
        match self.open.and_then(|open| breaches.get_mut(open)) {
            Some(breach) => {
                breach.until_s = time_s;
                breach.margin = smaller(breach.margin, margin.filter(|margin| margin.is_finite()));
            }
            None => {
                self.open = Some(breaches.len());
                let margin = margin.filter(|margin| margin.is_finite());
                let (requirement, obstacle) = (required.index, self.obstacle);
                breaches.push(Breach { requirement, time_s, until_s: time_s, margin, step, obstacle });
            }
        }
        is_asked
    }
}

impl Stretch {
    /// For a requirement that does not remember: the margin, whether it is a breach, and whether anything is asked.
    #[inline]
    fn answer(
        &mut self,
        required: &Required,
        facts: &Facts,
        moment: &Judged,
    ) -> Option<(Option<f64>, bool, bool)> {
        let kept = required.ready.at(moment.functions, facts)?;
        let margin = self.tally.take(kept, required.within_ticks, required.is_paid);
        Some((margin, self.tally.failed > required.within_ticks, true))
    }

    /// The same for a requirement that remembers.
    #[inline(never)]
    fn answer_next(
        &mut self,
        required: &Required,
        (facts, of_ego): (&Facts, Option<&RequirementMemory>),
        moment: &Judged,
    ) -> Option<(Option<f64>, bool, bool)> {
        let is_awaited = !self.tally.begun.is_empty();
        let asked = required.ready.at_next(&mut self.memory, of_ego, is_awaited, moment.functions, facts)?;
        if !required.is_response {
            let margin = self.tally.take(asked.kept, required.within_ticks, required.is_paid);
            return Some((margin, self.tally.failed > required.within_ticks, true));
        }
        // A missed deadline is a breach of that moment.
        self.open = None;
        let (margin, is_breached) = self.tally.respond(asked, required.within_ticks);
        Some((margin, is_breached, is_awaited || asked.begins))
    }
}

impl Tally {
    /// Nothing is asked now.
    fn pause(&mut self) {
        if self.asked == 0 {
            return;
        }
        (self.asked, self.failed, self.above) = (0, 0, 0);
        self.window.clear();
        self.begun.clear();
        self.held = None;
    }

    /// Takes the answer of a tick of a requirement with `after`. Returns what of an answer that is due now its margin is, and
    /// whether it is a breach.
    fn respond(&mut self, asked: Asked, within_ticks: u32) -> (Option<f64>, bool) {
        self.asked += 1;
        if asked.begins {
            self.begun.push_back(self.asked);
        }
        if asked.kept.holds {
            self.held = Some(self.asked);
        }
        let margin = asked.kept.margin;
        self.now = margin;
        let largest = (!margin.is_nan()).then(|| self.window.largest(margin, within_ticks));
        let Some(&began) = self.begun.front().filter(|began| **began + within_ticks == self.asked) else {
            return (None, false);
        };
        self.begun.pop_front();
        self.smallest = smaller(self.smallest, largest);
        (largest, self.held.is_none_or(|held| held < began))
    }

    /// Takes the answer of a tick. Returns the margin of the time that `within` grants, if it can be that of a breach or
    /// smaller than all before; where each one is paid for, in any case.
    fn take(&mut self, kept: Kept, within_ticks: u32, is_paid: bool) -> Option<f64> {
        self.asked += 1;
        self.failed = if kept.holds { 0 } else { self.failed + 1 };
        self.now = kept.margin;
        if kept.margin.is_nan() {
            return None;
        }
        // As long as it is in the window, nothing there becomes the smallest, and nothing is breached: the usual case.
        if !is_paid && kept.holds && self.smallest.is_some_and(|smallest| kept.margin > smallest) {
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
                        watch.take(Kept { holds: *margin >= 0.0, margin: *margin }, within, false);
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

    /// The speed `v` and the limit `w` of each tick, both in m/s.
    type Trace = [(f64, f64)];

    /// A margin at a tick of a trace.
    type MarginAt = Box<dyn Fn(&Trace, usize) -> f64>;

    /// A condition that a seed makes up: its text, and what it means, once more and apart from the language.
    struct MadeUp {
        text: String,
        margin: MarginAt,
        /// The first tick at which it can be asked.
        known_from: usize,
    }

    impl MadeUp {
        fn holds(&self, trace: &Trace, tick: usize) -> bool {
            (self.margin)(trace, tick) >= 0.0
        }
    }

    /// A fact that is not known yet does not hold, where the condition does not await it: only its sign is looked at there.
    const UNKNOWN: f64 = -0.5;

    fn made_up(rng: &mut rng::Rng, depth: u32, is_awaited: bool) -> MadeUp {
        // No margin is 0: whether a condition holds is known by its sign.
        let number = f64::from(below(rng, 80)) / 4.0 + 0.1234;
        let side = |rng: &mut rng::Rng| -> (String, MarginAt, usize) {
            let part = f64::from(below(rng, 8)) / 4.0;
            let ticks = below(rng, 6) as usize + 1;
            match below(rng, if depth == 0 { 7 } else { 9 }) {
                0 => ("ego.speed".to_owned(), Box::new(|all, t| all[t].0), 0),
                1 => ("ego.limit".to_owned(), Box::new(|all, t| all[t].1), 0),
                2 => (format!("({part} * ego.speed)"), Box::new(move |all, t| part * all[t].0), 0),
                3 => ("-(ego.limit - ego.speed)".to_owned(), Box::new(|all, t| all[t].0 - all[t].1), 0),
                4 => (
                    format!("change(ego.speed, {} ms)", ticks * 20),
                    Box::new(move |all, t| {
                        all[t].0 - t.checked_sub(ticks).map_or(f64::NAN, |then| all[then].0)
                    }),
                    ticks,
                ),
                5 => (
                    format!("ago(ego.limit, {} ms)", ticks * 20),
                    Box::new(move |all, t| t.checked_sub(ticks).map_or(f64::NAN, |then| all[then].1)),
                    ticks,
                ),
                6 => (
                    format!("mean(ego.speed, {} ms)", ticks * 20),
                    Box::new(move |all, t| {
                        let last = &all[(t + 1).saturating_sub(ticks)..=t];
                        last.iter().map(|(v, _)| v).sum::<f64>() / last.len() as f64
                    }),
                    0,
                ),
                7 => {
                    let of = made_up(rng, depth - 1, is_awaited);
                    let (text, since) = (of.text.clone(), of.known_from);
                    let held = move |all: &Trace, t: usize| {
                        (t.saturating_sub(ticks - 1).max(of.known_from)..=t)
                            .filter(|at| of.holds(all, *at))
                            .count()
                    };
                    (
                        format!("(total({text}, {} ms) * 50 m/s^2)", ticks * 20),
                        Box::new(move |all, t| held(all, t) as f64),
                        since,
                    )
                }
                _ => {
                    let of = made_up(rng, depth - 1, is_awaited);
                    let (text, since) = (of.text.clone(), of.known_from);
                    let begins = move |all: &Trace, t: usize| {
                        of.holds(all, t) && (t == of.known_from || !of.holds(all, t - 1))
                    };
                    let begun = move |all: &Trace, t: usize| {
                        (t.saturating_sub(ticks - 1).max(since)..=t).filter(|at| begins(all, *at)).count()
                    };
                    (
                        format!("(times({text}, {} ms) * 1 m/s)", ticks * 20),
                        Box::new(move |all, t| begun(all, t) as f64),
                        since,
                    )
                }
            }
        };
        let (text, of, known) = side(rng);
        let kind = below(rng, if depth == 0 { 5 } else { 12 });
        let ticks = below(rng, 6) as usize + 1;
        let mut two = || {
            let mut one = || made_up(rng, depth.saturating_sub(1), is_awaited);
            (one(), one())
        };
        let (a, b) = if kind > 4 { two() } else { (never(), never()) };
        let mut known_from = match kind {
            0..=4 => known,
            6..=8 => a.known_from.max(b.known_from),
            _ => a.known_from,
        };
        let since = a.known_from;
        let first = move |tick: usize| tick.saturating_sub(ticks).max(since);
        let (text, margin): (String, MarginAt) = match kind {
            0 => (format!("{text} < {number} m/s"), Box::new(move |all, t| known_or(number - of(all, t)))),
            1 => (format!("{text} <= {number} m/s"), Box::new(move |all, t| known_or(number - of(all, t)))),
            2 => (format!("{text} > {number} m/s"), Box::new(move |all, t| known_or(of(all, t) - number))),
            3 => (format!("{text} >= {number} m/s"), Box::new(move |all, t| known_or(of(all, t) - number))),
            4 => (
                format!("{text} in {number} m/s .. {} m/s", number + 3.5),
                Box::new(move |all, t| known_or((of(all, t) - number).min(number + 3.5 - of(all, t)))),
            ),
            5 => (format!("not ({})", a.text), Box::new(move |all, t| -(a.margin)(all, t))),
            6 => {
                let text = format!("({}) and ({})", a.text, b.text);
                (text, Box::new(move |all, t| (a.margin)(all, t).min((b.margin)(all, t))))
            }
            7 => {
                let text = format!("({}) or ({})", a.text, b.text);
                (text, Box::new(move |all, t| (a.margin)(all, t).max((b.margin)(all, t))))
            }
            8 => {
                let text = format!("({}) implies ({})", a.text, b.text);
                (text, Box::new(move |all, t| (-(a.margin)(all, t)).max((b.margin)(all, t))))
            }
            9 => (
                format!("recently({}, {} ms)", a.text, ticks * 20),
                Box::new(move |all, t| {
                    (first(t)..=t).map(|at| (a.margin)(all, at)).fold(f64::NEG_INFINITY, f64::max)
                }),
            ),
            10 => {
                known_from += ticks;
                let text = format!("ago({}, {} ms)", a.text, ticks * 20);
                let margin = move |all: &Trace, t: usize| match t >= since + ticks {
                    true => (a.margin)(all, t - ticks),
                    false => UNKNOWN,
                };
                (text, Box::new(margin))
            }
            _ => {
                known_from += ticks;
                let text = format!("throughout({}, {} ms)", a.text, ticks * 20);
                let least = move |all: &Trace, t: usize| match t >= since + ticks {
                    true => (first(t)..=t).map(|at| (a.margin)(all, at)).fold(f64::INFINITY, f64::min),
                    false => UNKNOWN,
                };
                (text, Box::new(least))
            }
        };
        MadeUp { text, margin, known_from: if is_awaited { known_from } else { 0 } }
    }

    fn known_or(margin: f64) -> f64 {
        if margin.is_nan() { UNKNOWN } else { margin }
    }

    fn never() -> MadeUp {
        MadeUp { text: String::new(), margin: Box::new(|_, _| f64::NAN), known_from: 0 }
    }

    /// A requirement that a seed makes up.
    struct MadeUpRequirement {
        when: Option<MadeUp>,
        until: Option<MadeUp>,
        after: Option<MadeUp>,
        condition: MadeUp,
        unless: Option<MadeUp>,
        within: usize,
    }

    impl MadeUpRequirement {
        fn new(rng: &mut rng::Rng) -> MadeUpRequirement {
            let mut maybe =
                |share: u32, depth: u32| (below(rng, 4) < share).then(|| made_up(rng, depth, false));
            let when = maybe(2, 1);
            let until = maybe(2, 1).filter(|_| when.is_some());
            let after = maybe(2, 1);
            let unless = maybe(1, 1);
            MadeUpRequirement {
                when,
                until,
                after,
                unless,
                condition: made_up(rng, 3, true),
                within: below(rng, 5) as usize,
            }
        }

        fn parts(&self) -> impl Iterator<Item = &MadeUp> {
            self.when
                .iter()
                .chain(&self.until)
                .chain(&self.after)
                .chain([&self.condition])
                .chain(&self.unless)
        }

        fn text(&self) -> String {
            let part = |word: &str, part: &Option<MadeUp>| {
                part.as_ref().map_or(String::new(), |part| format!(" {word} {}", part.text))
            };
            let (when, until) = (part("when", &self.when), part("until", &self.until));
            let within = match self.within {
                0 => String::new(),
                ticks => format!(" within {} ms", ticks * 20),
            };
            let (after, unless) = (part("after", &self.after), part("unless", &self.unless));
            format!("{when}{until}{after}: {}{unless}{within}", self.condition.text)
        }

        /// By the definition: the smallest margin up to each tick, and whether there is a breach then.
        fn answers(&self, trace: &Trace) -> Vec<(Option<f64>, bool)> {
            let known_from = self.parts().map(|part| part.known_from).max().unwrap_or(0);
            let holds =
                |part: &Option<MadeUp>, tick: usize| part.as_ref().is_none_or(|part| part.holds(trace, tick));
            let mut asked = vec![false; trace.len()];
            for tick in 0..trace.len() {
                asked[tick] = match &self.until {
                    None => holds(&self.when, tick),
                    Some(until) => {
                        let is_latched = tick > 0 && asked[tick - 1];
                        !until.holds(trace, tick) && (is_latched || holds(&self.when, tick))
                    }
                };
            }
            let largest = |from: usize, to: usize| {
                let margin =
                    |at: usize| match self.unless.as_ref().is_some_and(|unless| unless.holds(trace, at)) {
                        true => f64::INFINITY,
                        false => (self.condition.margin)(trace, at),
                    };
                (from..=to).map(margin).fold(f64::NEG_INFINITY, f64::max)
            };
            let mut smallest = None;
            let answer = |tick: usize| {
                let from = tick.checked_sub(self.within).filter(|from| *from >= known_from);
                let margin = match &self.after {
                    None => from
                        .filter(|from| asked[*from..=tick].iter().all(|asked| *asked))
                        .map(|from| largest(from, tick)),
                    Some(after) => from
                        .filter(|from| asked[*from] && after.holds(trace, *from))
                        .filter(|from| *from == 0 || !after.holds(trace, from - 1))
                        .map(|from| largest(from, tick)),
                };
                smallest = smaller(smallest, margin);
                (smallest, margin.is_some_and(|margin| margin < 0.0))
            };
            (0..trace.len()).map(answer).collect()
        }
    }

    /// 10,000 requirements, each over a separate trace, against a monitor that follows the definition.
    #[test]
    fn breaches_and_margins_are_those_of_a_naive_monitor() {
        const AT_ONCE: usize = 50;
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        let mut breached = [0, 0];
        for part in 0..200 {
            let mut rng = stream(5, Stream::Episode, part);
            let all: Vec<MadeUpRequirement> =
                (0..AT_ONCE).map(|_| MadeUpRequirement::new(&mut rng)).collect();
            let mut text = "language 1\nuse \"roads.ava\"\nstate told: Bool = false\naction tell() { set told = true }\n\
                            rule at_last on tell: elapsed >= 6 s or told\n"
                .to_owned();
            for (index, one) in all.iter().enumerate() {
                text.push_str(&format!("require r{index}{}\n", one.text()));
            }
            let made_up = folder.join("made_up.ava");
            let read = |path: &Path| match path.ends_with("made_up.ava") {
                true => Ok(text.clone()),
                false => std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string())),
            };
            let loaded = load(&made_up, &read).expect("it can be read");
            let Some(space) = loaded.space else { panic!("{:?}", loaded.diagnostics) };
            let memory = space.initial_memory(1);
            for (index, (requirement, one)) in space.requirements.iter().zip(&all).enumerate() {
                let trace: Vec<(f64, f64)> = (0..40)
                    .map(|_| (f64::from(below(&mut rng, 60)) / 3.0, f64::from(below(&mut rng, 60)) / 3.0))
                    .collect();
                let required = Required::new(index, requirement, false);
                let (mut stretch, mut breaches) = (Stretch::default(), Vec::new());
                for (tick, (wanted, is_breached)) in one.answers(&trace).into_iter().enumerate() {
                    let mut world = WorldFacts::default();
                    (world.moment.ego_speed_mps, world.moment.ego_limit_mps) = trace[tick];
                    let facts = Facts { world: Some(&world), ..Facts::new(&[], &memory) };
                    let time_s = tick as f64;
                    let moment = Judged { functions: &space.functions, facts: &facts, time_s, step: 0 };
                    stretch.ask(&required, (&facts, None), &moment, &mut breaches);
                    let found = stretch.tally.smallest;
                    let same = match (found, wanted) {
                        (Some(found), Some(wanted)) => {
                            found == wanted || (found - wanted).abs() <= 1e-9 * (1.0 + wanted.abs())
                        }
                        (found, wanted) => found.is_none() && wanted.is_none(),
                    };
                    assert!(same, "{} at {tick}: {found:?} in place of {wanted:?}", one.text());
                    let until_s = breaches.last().map(|breach: &Breach| breach.until_s);
                    assert_eq!(until_s == Some(time_s), is_breached, "{} at {tick}", one.text());
                }
                breached[usize::from(one.after.is_some())] += usize::from(!breaches.is_empty());
            }
        }
        assert!(breached.iter().all(|count| *count > 1000), "{breached:?} are of both kinds");
    }
}
