//! The loop: act, drive for one observation period, record what happened.

use std::sync::Arc;

use avastra_drivers::Ads;
use avastra_lang::model::expr::Expr;
use avastra_lang::model::{Facts, Memory, Trigger, WorldFacts, evaluate};
use avastra_search::mdp;
use avastra_search::mdp::{Danger, Observation};
use avastra_world::action::{Draw, Offer, Refusal, Situation};
use avastra_world::sim::{Contact, DT_S, Sensed, World};

use super::chronicle::{Chronicle, Near, Records};
use super::log::{Collision, End, EpisodeLog, Outcome, StepLog};
use super::script::ScriptedAction;
use super::setup::Setup;

/// A step with less progress than this counts as stalled, m. The published package: 3 m in five steps.
const PROGRESS_M_MIN: f64 = 1.0;

/// Called after every tick with the world, the driving system and the contacts that began.
pub type Watch<'a> = dyn FnMut(&World, &dyn Ads, &[Contact]) + 'a;

/// The facts that are known when an action is chosen.
pub struct Moment<'a> {
    pub step: usize,
    pub observation: &'a Observation,
    pub situation: &'a Situation<'a>,
    play: &'a Play,
}

impl<'a> Moment<'a> {
    /// The setup of the episode.
    pub fn setup(&self) -> &'a Setup {
        &self.play.setup
    }

    /// The log of the episode up to now.
    pub fn log(&self) -> EpisodeLog {
        self.play.clone().into_log(End::Script)
    }

    /// Number of collisions up to now.
    pub fn collisions(&self) -> usize {
        self.play.collisions().len()
    }

    /// Whether anything is still there that the action of a step made appear.
    pub fn is_around(&self, step: usize) -> bool {
        let spawned = self.play.steps.get(step).map_or(&[][..], |step| step.outcome.spawned());
        spawned.iter().any(|id| self.play.world.obstacle(*id).is_some())
    }

    /// Ticks since the start of the episode.
    pub fn ticks(&self) -> u64 {
        self.play.world.ticks()
    }

    /// A snapshot of this moment, for [`run_from`].
    pub fn snapshot(&self) -> Play {
        self.play.clone()
    }
}

/// The choice for a step.
pub enum Choice {
    Act(Draw),
    /// The action is judged and carried out when its trigger says so, if that comes within the step.
    Await(ScriptedAction),
    /// Nothing happens.
    Pass,
    /// A row was chosen that is not legal now: nothing happens.
    Refused {
        row: usize,
        rule: Option<String>,
        reason: String,
    },
    /// The script is at its end.
    Stop,
}

impl Choice {
    /// The choice of a row as it is offered.
    pub fn of(row: usize, offer: Offer) -> Choice {
        match offer {
            Ok(draw) => Choice::Act(draw),
            Err(Refusal { rule, reason }) => Choice::Refused { row, rule, reason },
        }
    }

    /// The choice of a row with given values. The first of several refusals counts.
    pub fn judged(row: usize, judged: Result<Draw, Vec<Refusal>>) -> Choice {
        Choice::of(row, first(judged))
    }
}

/// The offer, with the first of several refusals.
fn first(judged: Result<Draw, Vec<Refusal>>) -> Offer {
    judged.map_err(|mut refusals| refusals.swap_remove(0))
}

/// Plays one episode. `choose` is called once a step.
pub fn run(setup: &Setup, choose: &mut dyn FnMut(&Moment) -> Choice) -> EpisodeLog {
    run_watched(setup, choose, &mut |_, _, _| {})
}

/// As [`run`]; `watch` is called after every tick and once before the first.
pub fn run_watched(
    setup: &Setup,
    choose: &mut dyn FnMut(&Moment) -> Choice,
    watch: &mut Watch,
) -> EpisodeLog {
    run_from(Play::new(setup), choose, watch, &mut |_| {})
}

/// As [`run_watched`]; the log has the margins of each tick.
pub fn run_with_margins(
    setup: &Setup,
    choose: &mut dyn FnMut(&Moment) -> Choice,
    watch: &mut Watch,
) -> EpisodeLog {
    let mut play = Play::new(setup);
    play.chronicle.keep_series(setup);
    run_from(play, choose, watch, &mut |_| {})
}

/// As [`run_watched`], but from `play`, the start of an episode or a kept moment of one. The log covers the whole episode.
/// `last` gets the moment at which the next choice would have been due.
pub fn run_from(
    mut play: Play,
    choose: &mut dyn FnMut(&Moment) -> Choice,
    watch: &mut Watch,
    last: &mut dyn FnMut(&Moment),
) -> EpisodeLog {
    watch(&play.world, play.ads.as_ref(), &[]);
    let end = loop {
        let observation = match play.look() {
            Ok(observation) => observation,
            Err(end) => break end,
        };
        let choice = play.at(&observation, |moment| choose(moment));
        if let Some(end) = play.step(observation, choice, watch) {
            break end;
        }
    };
    let observation = play.observation();
    play.at(&observation, |moment| last(moment));
    play.into_log(end)
}

/// The outcome of the choice of a step when the step began.
enum Begun {
    With(Outcome),
    Waiting(Waiting),
}

/// An action whose moment has not come.
struct Waiting {
    action: ScriptedAction,
    /// Tick of the step since which the condition has held.
    held_since: Option<i64>,
    /// Tick of the step at which it had held for long enough.
    come_tick: Option<i64>,
}

impl Waiting {
    /// Whether the action happens before this tick of the step.
    fn is_due(&mut self, tick: i64, play: &Play) -> bool {
        let Some(trigger) = self.action.trigger.as_deref() else { return true };
        if self.come_tick.is_none() {
            let holds = trigger.once.as_ref().is_none_or(|once| play.holds(&once.expr, trigger));
            self.held_since = holds.then(|| self.held_since.unwrap_or(tick));
            let has_come = |since: &i64| tick - since >= i64::from(trigger.held_ticks);
            self.come_tick = self.held_since.filter(has_come).map(|_| tick);
        }
        self.come_tick.is_some_and(|come| tick - come >= i64::from(trigger.after_ticks))
    }

    /// The moment did not come.
    fn in_vain(self) -> Outcome {
        let text = self.action.trigger.as_deref().map(Trigger::text).unwrap_or_default();
        let reason = format!("`{text}` did not come within the step");
        Outcome::Refused { row: self.action.row, rule: None, reason }
    }
}

/// An episode under way. [`run`] is a loop over [`Play::look`] and [`Play::step`]; a caller that cannot be called back
/// from a loop uses these two itself. A clone is a snapshot, which can be played on as often as wanted.
#[derive(Clone)]
pub struct Play {
    setup: Arc<Setup>,
    world: World,
    ads: Box<dyn Ads>,
    sensed: Sensed,
    memory: Memory,
    /// Steps without progress up to now.
    stalled: u32,
    /// When each action last happened, s; empty if the space does not ask.
    happened_s: Vec<f64>,
    steps: Vec<StepLog>,
    chronicle: Chronicle,
}

impl Play {
    /// The world at this moment.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// An episode before its first step.
    pub fn new(setup: &Setup) -> Play {
        let world = World::new(setup.scene.clone(), &setup.start);
        let mut ads = setup.ads.build(&setup.scene, setup.seed);
        let mut sensed = world.sensed();
        // The driving system looks once before the first step, so that the first observation can show its state.
        ads.drive(&sensed);
        world.sense(&mut sensed);
        Play {
            chronicle: Chronicle::new(setup, &world),
            setup: Arc::new(setup.clone()),
            world,
            ads,
            sensed,
            memory: setup.memory.clone(),
            steps: Vec::new(),
            stalled: 0,
            happened_s: match setup.table.space().asks_when_actions_happened() {
                true => vec![f64::NEG_INFINITY; setup.table.space().actions.len()],
                false => Vec::new(),
            },
        }
    }

    /// The observation before the next choice.
    ///
    /// # Errors
    /// The end of the episode, if its driving system cannot drive any more.
    pub fn look(&self) -> Result<Observation, End> {
        if let Some(end) = self.failed() {
            return Err(end);
        }
        Ok(self.observation())
    }

    /// The observation now.
    pub fn observation(&self) -> Observation {
        Observation::new(&self.world, self.ads.status())
    }

    /// Calls `see` with this moment, in which a choice is due, and returns what it gives.
    pub fn at<T>(&self, observation: &Observation, see: impl FnOnce(&Moment) -> T) -> T {
        let situation = self.situation();
        see(&Moment { step: self.steps.len(), observation, situation: &situation, play: self })
    }

    /// Carries out a choice that was made on `observation`, then drives for one observation period. Returns how the
    /// episode ended, if it ended.
    pub fn step(&mut self, observation: Observation, choice: Choice, watch: &mut Watch) -> Option<End> {
        let begun = match choice {
            Choice::Act(draw) => Begun::With(self.carry_out(draw, 0)),
            Choice::Await(action) => Begun::Waiting(Waiting { action, held_since: None, come_tick: None }),
            Choice::Pass => Begun::With(Outcome::Passed),
            Choice::Refused { row, rule, reason } => Begun::With(Outcome::Refused { row, rule, reason }),
            Choice::Stop => return Some(End::Script),
        };
        self.observation_period(observation, begun, watch);
        self.end()
    }

    /// The setup of the episode.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The steps so far.
    pub fn steps(&self) -> &[StepLog] {
        &self.steps
    }

    /// The collisions so far.
    pub fn collisions(&self) -> &[Collision] {
        self.chronicle.collisions()
    }

    fn situation(&self) -> Situation<'_> {
        Situation {
            memory: &self.memory,
            road: self.setup.road(),
            rules: &self.setup.rules,
            surroundings: &self.world,
            seed: self.setup.seed,
            step: self.steps.len() as u64,
            happened_s: &self.happened_s,
        }
    }

    /// Carries out a whole action or nothing of it.
    fn carry_out(&mut self, draw: Draw, delay_ticks: u32) -> Outcome {
        let newcomers = match self.world.carry_out(&draw) {
            Ok(newcomers) => newcomers,
            Err((_, reason)) => return Outcome::Refused { row: draw.row, rule: None, reason },
        };
        let mut spawned = Vec::new();
        for (nth, id) in newcomers {
            let effect = &draw.effects[nth];
            spawned.extend(id..id + effect.newcomers());
            self.chronicle.appeared(effect, id);
        }
        self.memory = draw.memory_after.clone();
        if let Some(happened_s) = self.happened_s.get_mut(self.setup.table.rows()[draw.row].action) {
            *happened_s = self.world.time_s();
        }
        Outcome::Done { draw, spawned, delay_ticks }
    }

    /// Applies the effects that every step has, in a step without an action.
    fn wait(&mut self) {
        let (effects, memory) = self.setup.table.wait(&self.situation());
        for effect in effects {
            self.world.apply(&effect).expect("weather and time of day need no place");
        }
        self.memory = memory;
    }

    /// One observation period (OTP), and its line in the log.
    fn observation_period(&mut self, observation: Observation, begun: Begun, watch: &mut Watch) {
        // No space in which every step does something has actions that wait (AV0609).
        if matches!(&begun, Begun::With(Outcome::Passed | Outcome::Refused { .. })) {
            self.wait();
        }
        let (time_s, station_m) = (self.world.time_s(), self.world.ego_station_m());
        let before = self.chronicle.begin_step(time_s);
        let (outcome, near) = self.drive(begun, watch);
        self.count_stalled(self.world.ego_station_m() - station_m);
        let (facts, margins) = self.chronicle.end_step(before, near);
        let reward = self.setup.table.space().reward(facts, &self.memory, margins);
        let step = StepLog {
            time_s,
            state: observation.state,
            outcome,
            memory: self.memory.clone(),
            proc: near.probability,
            reward,
            perception: mdp::perception_counts(&self.world, self.ads.status()),
            trace: self.chronicle.digest(),
        };
        self.steps.push(step);
    }

    /// Drives for one observation period, or until the goal or the end of the map. Returns the outcome of the step's
    /// action, and how near a collision was at most.
    fn drive(&mut self, mut begun: Begun, watch: &mut Watch) -> (Outcome, Near) {
        let mut near: Option<Near> = None;
        let ticks = (self.setup.table.space().episode.step_s / DT_S).round() as i64;
        for tick in 0..ticks {
            if let Begun::Waiting(waiting) = &mut begun
                && waiting.is_due(tick, self)
            {
                begun = Begun::With(self.carry_out_awaited(waiting, tick));
            }
            let Some(now) = self.tick(watch) else { break };
            if near.is_none_or(|near| now.probability > near.probability) {
                near = Some(now);
            }
            if self.over().is_some() {
                break;
            }
        }
        let outcome = match begun {
            Begun::With(outcome) => outcome,
            Begun::Waiting(waiting) => waiting.in_vain(),
        };
        (outcome, near.unwrap_or(Near { probability: 0.0, body: None }))
    }

    /// An ego vehicle that waits for a light does not stall, and its wait does not end a stall. After a contact no wait counts.
    fn count_stalled(&mut self, progress_m: f64) {
        if progress_m.abs() >= PROGRESS_M_MIN {
            self.stalled = 0;
        } else if !self.collisions().is_empty() || !self.world.waits_for_light() {
            self.stalled += 1;
        }
    }

    /// Judges and carries out an action whose moment has come.
    fn carry_out_awaited(&mut self, waiting: &Waiting, tick: i64) -> Outcome {
        let judged = waiting.action.judged(&self.setup.table, &self.situation());
        match first(judged) {
            Ok(draw) => self.carry_out(draw, tick as u32),
            Err(Refusal { rule, reason }) => Outcome::Refused { row: waiting.action.row, rule, reason },
        }
    }

    /// One physics step. Returns the collision probability after it, 0 where none is computed, or `None` if the driving system failed
    /// and nothing moved. The probability is 1 at the tick of a contact. After that the obstacle is ignored: it stands against the
    /// ego vehicle for a while and is no danger any more.
    fn tick(&mut self, watch: &mut Watch) -> Option<Near> {
        self.world.sense(&mut self.sensed);
        let control = self.ads.drive(&self.sensed);
        if self.ads.failure().is_some() {
            return None;
        }
        self.chronicle.note_answer(&self.world, self.ads.as_ref());
        let contacts = self.world.tick(&control).to_vec();
        self.chronicle.note(&self.setup, self.steps.len(), &self.memory, &self.world, &contacts);
        watch(&self.world, self.ads.as_ref(), &contacts);
        let body = |id| self.chronicle.body(&self.world, id);
        if let Some(contact) = contacts.first() {
            return Some(Near { probability: 1.0, body: body(contact.obstacle) });
        }
        let now = self.setup.proc.danger(&self.world, &|id| self.chronicle.has_hit(id));
        let Danger { probability, nearest } = now.unwrap_or_default();
        Some(Near { probability, body: nearest.and_then(body) })
    }

    /// Whether the condition of a trigger holds now.
    fn holds(&self, condition: &Expr, trigger: &Trigger) -> bool {
        let users = trigger.road_users().into_iter();
        let bearers = trigger.bearers().into_iter();
        let world = WorldFacts {
            moment: self.world.moment_facts(),
            step: self.steps.len() as u64,
            road_users: users.filter_map(|id| Some((id, self.world.npc_facts(id)?))).collect(),
            bearers: bearers.filter_map(|who| Some((who, self.world.bearer_facts(who)?))).collect(),
            ..WorldFacts::default()
        };
        let facts = Facts {
            road: Some(&self.setup.road().facts),
            world: Some(&world),
            ..Facts::new(&[], &self.memory)
        };
        evaluate(condition, &self.setup.table.space().functions, &facts).truth()
    }

    /// The end of an episode whose driving system cannot drive any more.
    fn failed(&self) -> Option<End> {
        self.ads.failure().map(|failure| End::Failed(failure.kind()))
    }

    /// How the episode has ended, if no further tick is driven.
    fn over(&self) -> Option<End> {
        match () {
            () if self.setup.table.space().episode.stop_arrived && self.world.arrived() => Some(End::Arrived),
            () if self.world.left_the_map() => Some(End::LeftMap),
            () => self.failed(),
        }
    }

    /// How the episode has ended, if no further step is played.
    fn end(&self) -> Option<End> {
        let episode = &self.setup.table.space().episode;
        let is_stalled = || episode.stalled_steps.is_some_and(|limit| self.stalled >= limit);
        let stalled = || match () {
            () if self.world.is_blocked() => End::Blocked,
            () if self.world.is_astray() => End::Astray,
            () => End::Stalled,
        };
        let is_last = || self.steps.len() >= episode.step_limit as usize;
        self.over().or_else(|| is_stalled().then(stalled)).or_else(|| is_last().then_some(End::StepLimit))
    }

    /// The log of the episode, which ended so.
    pub fn into_log(self, end: End) -> EpisodeLog {
        let setup = &self.setup;
        let Records { held, collisions, incidents, breaches, margins, series, distance_m } =
            self.chronicle.into_records();
        EpisodeLog {
            road: setup.road().name.clone(),
            ads: setup.ads.name().to_owned(),
            profile: setup.ads.profile().copied(),
            conversation: self.ads.conversation().map(Arc::new),
            failure: self.ads.failure().cloned(),
            seed: setup.seed,
            start: setup.start,
            memory: setup.memory.clone(),
            collisions,
            incidents,
            breaches,
            margins,
            series,
            end,
            duration_s: self.world.time_s(),
            distance_m,
            red_runs: self.world.red_runs(),
            ticks: self.world.ticks(),
            steps: self.steps,
            held,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Mutex;

    use avastra_drivers::external::{Failure, Problem};
    use avastra_drivers::{Selected, Status, by_name};
    use avastra_lang::check::{ReadError, load};
    use avastra_lang::model::RulesInForce;
    use avastra_search::mdp::ProcKind;
    use avastra_world::action::ActionTable;
    use avastra_world::sim::{Control, Scene, Start};

    use super::*;

    /// The calls, in order.
    type Tape = Arc<Mutex<Vec<&'static str>>>;

    fn note(tape: &Tape, what: &'static str) {
        tape.lock().unwrap().push(what);
    }

    /// A driving system that notes when it is asked.
    #[derive(Clone)]
    struct Taped {
        driver: Box<dyn Ads>,
        tape: Tape,
        /// The call at which it gives up, and why.
        failure: Option<(usize, Failure)>,
    }

    impl Ads for Taped {
        fn drive(&mut self, sensed: &Sensed) -> Control {
            note(&self.tape, "drive");
            self.driver.drive(sensed)
        }

        fn status(&self) -> &Status {
            self.driver.status()
        }

        fn failure(&self) -> Option<&Failure> {
            let asked = self.tape.lock().unwrap().iter().filter(|call| **call == "drive").count();
            self.failure.as_ref().filter(|(call, _)| asked >= *call).map(|(_, failure)| failure)
        }
    }

    /// Row 0 is always legal, row 1 in effect never. An episode has three steps of five ticks.
    const SPACE: &str = r#"
language 1
use "../../scenarios/roads.ava"
episode { roads: [crossroad], step: 0.1 s, limit: 3 steps }
state wet: Bool = false
action pour() { set wet = true }
action dry() { set wet = false }
rule never on dry: ego.speed > 60 m/s
"#;

    fn setup() -> Setup {
        let read = |path: &Path| match path.ends_with("taped.ava") {
            true => Ok(SPACE.to_owned()),
            false => std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string())),
        };
        let loaded = load(Path::new("taped.ava"), &read).unwrap();
        let space = loaded.space.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
        let (rules, seed) = (RulesInForce::by_default(&space), 1);
        let road = &space.roads[0];
        let memory = space.memory_at_start(road, &rules, seed).unwrap();
        Setup {
            road_index: 0,
            scene: Arc::new(Scene::of(road)),
            rules: Arc::new(rules),
            ads: Selected::new(by_name("modular").unwrap()),
            seed,
            start: Start::drawn(&space, road, &memory, seed),
            memory,
            proc: ProcKind::default(),
            table: ActionTable::new(space),
        }
    }

    /// Plays an episode and notes every call; `choose` says what happens in which step.
    fn taped(choose: &dyn Fn(&Moment) -> Choice) -> (EpisodeLog, Vec<&'static str>) {
        taped_from(&setup(), None, choose)
    }

    /// As [`taped`], from another setup, or with a driving system that gives up at a call.
    fn taped_from(
        setup: &Setup,
        failure: Option<(usize, Failure)>,
        choose: &dyn Fn(&Moment) -> Choice,
    ) -> (EpisodeLog, Vec<&'static str>) {
        let tape = Tape::default();
        let mut play = Play::new(setup);
        play.ads = Box::new(Taped { driver: play.ads, tape: tape.clone(), failure });
        let log = run_from(
            play,
            &mut |moment| {
                note(&tape, "choose");
                choose(moment)
            },
            &mut |_, _, _| note(&tape, "watch"),
            &mut |_| note(&tape, "last"),
        );
        let calls = tape.lock().unwrap().clone();
        (log, calls)
    }

    fn pour(moment: &Moment) -> Choice {
        Choice::of(0, moment.setup().table.offer(moment.situation, 0))
    }

    #[test]
    fn each_step_is_chosen_and_each_of_its_ticks_driven_then_watched() {
        let (log, calls) = taped(&pour);
        let step = [&["choose"][..], &["drive", "watch"].repeat(5)].concat();
        assert_eq!(calls, [&["watch"][..], &step.repeat(3), &["last"]].concat());
        assert_eq!((log.end, log.steps.len(), log.ticks), (End::StepLimit, 3, 15));
    }

    #[test]
    fn the_end_of_a_script_plays_no_step_more() {
        let (log, calls) = taped(&|moment| if moment.step == 1 { Choice::Stop } else { pour(moment) });
        assert_eq!(calls.iter().filter(|call| **call == "drive").count(), 5);
        assert_eq!(calls[calls.len() - 2..], ["choose", "last"]);
        assert_eq!((log.end, log.steps.len()), (End::Script, 1));
    }

    #[test]
    fn who_gives_up_within_a_step_ends_the_episode_there() {
        let failure = Failure::new(Problem::Exited, "step 7", "it is gone");
        let (log, calls) = taped_from(&setup(), Some((8, failure.clone())), &pour);
        // Seven ticks are driven; at the eighth it answers nothing, and nothing moves.
        assert_eq!((log.end, log.steps.len(), log.ticks), (End::Failed(failure.kind()), 2, 7));
        assert_eq!(calls[calls.len() - 2..], ["drive", "last"]);
        assert_eq!(log.failure, Some(failure));
    }

    #[test]
    fn who_arrives_within_a_step_is_driven_no_further() {
        let mut near = setup();
        near.start.ego_mps = 10.0;
        let mut play = Play::new(&near);
        let goal_m = near.scene.route.goal_m;
        play.world = World::with_ego_at(near.scene.clone(), &near.start, goal_m - 5.5, 10.0);
        let log = run_from(play, &mut |moment| pour(moment), &mut |_, _, _| {}, &mut |_| {});
        assert_eq!((log.end, log.steps.len()), (End::Arrived, 1));
        assert!(log.ticks < 5, "{} ticks", log.ticks);
    }

    #[test]
    fn what_is_refused_or_passed_is_driven_all_the_same() {
        let never = |moment: &Moment| Choice::of(1, moment.setup().table.offer(moment.situation, 1));
        let (refused, _) = taped(&never);
        let (passed, _) = taped(&|_| Choice::Pass);
        for step in &refused.steps {
            assert!(
                matches!(&step.outcome, Outcome::Refused { row: 1, rule: Some(rule), .. } if rule == "never")
            );
        }
        assert_eq!(refused.trace(), passed.trace());
    }

    #[test]
    fn an_action_that_waits_happens_at_its_tick_or_in_vain() {
        let after = |ticks: u32| {
            let trigger = Some(Arc::new(Trigger { once: None, held_ticks: 0, after_ticks: ticks }));
            taped(&move |_| {
                Choice::Await(ScriptedAction { row: 0, values: Vec::new(), trigger: trigger.clone() })
            })
        };
        for ticks in 0..5 {
            let (log, _) = after(ticks);
            assert!(
                matches!(log.steps[0].outcome, Outcome::Done { delay_ticks, .. } if delay_ticks == ticks)
            );
        }
        let (late, _) = after(5);
        assert!(matches!(&late.steps[0].outcome, Outcome::Refused { row: 0, rule: None, .. }));
    }

    #[test]
    fn a_snapshot_leaves_the_episode_as_it_is_and_goes_on_as_it_does() {
        let (plain, _) = taped(&pour);
        let kept = Mutex::new(None);
        let (looked, _) = taped(&|moment| {
            if moment.step == 1 {
                *kept.lock().unwrap() = Some(moment.snapshot());
            }
            pour(moment)
        });
        assert_eq!(looked, plain);
        let kept = kept.into_inner().unwrap().expect("it was kept in step 1");
        assert_eq!(run_from(kept, &mut |moment| pour(moment), &mut |_, _, _| {}, &mut |_| {}), plain);
    }
}
