//! The loop: act, drive for one observation period, look what happened.

use sha2::Digest;
use sha2::Sha256;

use crate::action::Draw;
use crate::action::Situation;
use crate::ads::Ads;
use crate::mdp;
use crate::mdp::Observation;
use crate::mdp::ProcSettings;
use crate::model::Memory;
use crate::model::OutcomeFacts;
use crate::sim::Contact;
use crate::sim::DT_S;
use crate::sim::Incident;
use crate::sim::Sensed;
use crate::sim::World;

use super::log::Collision;
use super::log::End;
use super::log::EpisodeLog;
use super::log::Outcome;
use super::log::StepLog;
use super::setup::Setup;

/// Less progress than this in a step is none, m. The published package: 3 m in five steps.
const PROGRESS_M_MIN: f64 = 1.0;

/// Sees the world, the driving system and the contacts that began, after every tick.
pub type Watch<'a> = dyn FnMut(&World, &dyn Ads, &[Contact]) + 'a;

/// What whoever acts may look at.
pub struct Moment<'a> {
    pub step: usize,
    pub observation: &'a Observation,
    pub situation: &'a Situation<'a>,
}

/// What is to happen in a step.
pub enum Choice {
    Act(Draw),
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

/// Plays one episode. `choose` acts once a step; `watch` sees the world after every tick, and once
/// before the first.
pub fn run(setup: &Setup, choose: &mut dyn FnMut(&Moment) -> Choice, watch: &mut Watch) -> EpisodeLog {
    run_to_last(setup, choose, watch, &mut |_| {})
}

/// The same; `last` looks at the moment at which the next choice would have been due.
pub fn run_to_last(
    setup: &Setup,
    choose: &mut dyn FnMut(&Moment) -> Choice,
    watch: &mut Watch,
    last: &mut dyn FnMut(&Moment),
) -> EpisodeLog {
    let mut play = Play::new(setup);
    watch(&play.world, play.ads.as_ref(), &[]);
    let end = loop {
        let observation = Observation::new(&play.world, play.ads.status());
        let choice = choose(&play.moment(&observation, &play.situation()));
        let outcome = match choice {
            Choice::Act(draw) => play.carry_out(draw),
            Choice::Pass => Outcome::Passed,
            Choice::Refused { row, rule, reason } => Outcome::Refused { row, rule, reason },
            Choice::Stop => break End::Script,
        };
        play.observation_period(observation, outcome, watch);
        if let Some(end) = play.end() {
            break end;
        }
    };
    last(&play.moment(&Observation::new(&play.world, play.ads.status()), &play.situation()));
    play.into_log(end)
}

/// An episode under way.
struct Play<'a> {
    setup: &'a Setup<'a>,
    world: World,
    ads: Box<dyn Ads>,
    sensed: Sensed,
    memory: Memory,
    steps: Vec<StepLog>,
    collisions: Vec<Collision>,
    incidents: Vec<Incident>,
    trace: Sha256,
    distance_m: f64,
    /// Steps without progress up to now.
    stalled: u32,
    proc: ProcSettings,
}

impl<'a> Play<'a> {
    fn new(setup: &'a Setup<'a>) -> Play<'a> {
        let world = World::new(setup.scene.clone(), &setup.start);
        let mut ads = setup.ads.build(&setup.scene, setup.seed);
        let mut sensed = world.sensed();
        // One look before the first step, so that its state has an inside.
        ads.drive(&sensed);
        world.sense(&mut sensed);
        Play {
            setup,
            world,
            ads,
            sensed,
            memory: setup.memory.clone(),
            steps: Vec::new(),
            collisions: Vec::new(),
            incidents: Vec::new(),
            trace: Sha256::new(),
            distance_m: 0.0,
            stalled: 0,
            proc: ProcSettings::default(),
        }
    }

    fn situation(&self) -> Situation<'_> {
        Situation {
            memory: &self.memory,
            road: self.setup.road,
            rules: self.setup.rules,
            surroundings: &self.world,
            seed: self.setup.seed,
            step: self.steps.len() as u64,
        }
    }

    fn moment<'m>(&self, observation: &'m Observation, situation: &'m Situation<'m>) -> Moment<'m> {
        Moment { step: self.steps.len(), observation, situation }
    }

    /// All of an action or nothing of it: its second spawn may find its first in the way.
    fn carry_out(&mut self, draw: Draw) -> Outcome {
        let before = self.world.clone();
        let mut spawned = Vec::new();
        for effect in &draw.effects {
            match self.world.apply(effect) {
                Ok(newcomer) => spawned.extend(newcomer),
                Err(reason) => {
                    self.world = before;
                    return Outcome::Refused { row: draw.row, rule: None, reason };
                }
            }
        }
        self.memory = draw.memory_after.clone();
        Outcome::Done { draw, spawned }
    }

    /// Drives for one observation period (OTP), or until the goal.
    fn observation_period(&mut self, observation: Observation, outcome: Outcome, watch: &mut Watch) {
        let time_s = self.world.time_s();
        let station_m = self.world.ego_station_m();
        let (mut proc, mut collided) = (0.0_f64, false);
        let shift = self.setup.period_shifts.get(self.steps.len()).copied().unwrap_or(0);
        let ticks = (self.setup.table.space().episode.step_s / DT_S).round() as i64 + i64::from(shift);
        for _ in 0..ticks {
            proc = proc.max(self.tick(watch, &mut collided));
            if self.setup.table.space().episode.stop_arrived && self.world.arrived() {
                break;
            }
        }
        let progress_m = self.world.ego_station_m() - station_m;
        self.stalled = if progress_m.abs() < PROGRESS_M_MIN { self.stalled + 1 } else { 0 };
        let reward = self.setup.table.space().reward(OutcomeFacts {
            collision: collided,
            proc,
            ..OutcomeFacts::default()
        });
        let trace = self.trace.clone().finalize().into();
        let state = observation.state;
        let perception = mdp::perception_counts(&self.world, self.ads.status());
        self.steps.push(StepLog { time_s, state, outcome, proc, reward, perception, trace });
    }

    /// One physics step; the collision probability after it. Contact is certainty, once: who has been
    /// hit stands against the ego vehicle for a while, and is no danger any more.
    fn tick(&mut self, watch: &mut Watch, collided: &mut bool) -> f64 {
        self.world.sense(&mut self.sensed);
        let control = self.ads.drive(&self.sensed);
        let contacts = self.world.tick(&control).to_vec();
        for &contact in &contacts {
            self.collisions.push(self.collision(contact));
        }
        self.incidents.extend_from_slice(self.world.incidents());
        self.distance_m += self.world.ego().speed_mps * DT_S;
        self.world.trace(&mut |bits| self.trace.update(bits.to_le_bytes()));
        watch(&self.world, self.ads.as_ref(), &contacts);
        *collided |= !contacts.is_empty();
        if !contacts.is_empty() {
            return 1.0;
        }
        let is_hit = |id| self.collisions.iter().any(|collision| collision.contact.obstacle == id);
        mdp::collision_probability(&self.world, &self.proc, &is_hit)
    }

    fn collision(&self, contact: Contact) -> Collision {
        let obstacles = self.world.obstacles();
        let obstacle = obstacles
            .iter()
            .find(|obstacle| obstacle.id == contact.obstacle)
            .expect("an obstacle stays for some time after it is hit");
        Collision {
            contact,
            step: self.steps.len(),
            body: obstacle.body,
            verb: obstacle.verb,
            spawned_s: obstacle.spawned_tick as f64 * DT_S,
        }
    }

    fn end(&self) -> Option<End> {
        let episode = &self.setup.table.space().episode;
        if episode.stop_arrived && self.world.arrived() {
            Some(End::Arrived)
        } else if episode.stalled_steps.is_some_and(|limit| self.stalled >= limit) {
            Some(End::Stalled)
        } else if self.steps.len() >= episode.step_limit as usize {
            Some(End::StepLimit)
        } else {
            None
        }
    }

    fn into_log(self, end: End) -> EpisodeLog {
        EpisodeLog {
            road: self.setup.road.name.clone(),
            ads: self.setup.ads.name().to_owned(),
            profile: self.setup.ads.profile().copied(),
            seed: self.setup.seed,
            start: self.setup.start,
            memory: self.setup.memory.clone(),
            collisions: self.collisions,
            incidents: self.incidents,
            end,
            duration_s: self.world.time_s(),
            distance_m: self.distance_m,
            red_runs: self.world.red_runs(),
            ticks: self.world.ticks(),
            steps: self.steps,
        }
    }
}
