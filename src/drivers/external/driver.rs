//! An external driving system behind the [`Ads`] trait: one episode of it.
//!
//! Answers come from what is known of earlier, equal conversations, and otherwise from a process. A process cannot be
//! rewound: a copy of this driver takes another one and shows it the episode from the start, as soon as the copy is asked
//! something new. Whether the answers are the same then is checked.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::altered::Alteration;
use crate::driver::Ads;
use crate::modular::{Modular, ModularConfig};
use crate::status::{PerceivedObject, Reason, Status};
use avastra_base::geometry::{Pose, Vec2, wrap_angle};
use avastra_base::outside::in_line;
use avastra_world::sim::{Control, DT_S, Scene, Sensed};

use super::finding::{Failure, FailureKind, Problem};
use super::follow::Follower;
use super::message::{Answer, Event, ObjectMessage, Question};
use super::program::{MapLine, Program};
use super::question;
use super::record::{Conversation, Key, Outcome, Told, Transcript};
use super::session::{Patience, Session};
use super::settings::OnTimeout;

/// After this simulated time without an answer the vehicle brakes, s: Apollo's 20 planning cycles.
const LOST_S: f64 = 2.0;

/// Numbers of objects that no track follows begin here, where the truth is shown in place of what is perceived.
const UNTRACKED_ID_MIN: u64 = 0x6000_0000;

/// An external driving system in one episode.
#[derive(Clone)]
pub struct External {
    program: Arc<Program>,
    scene: Arc<Scene>,
    seed: u64,
    map: Arc<MapLine>,
    /// The modular system whose perception the program is shown; `None` if it is shown the truth.
    observer: Option<Box<Modular>>,
    /// From when on it is told the truth all the same, and obeyed at once, s.
    truth_from_s: f64,
    prompt_from_s: f64,
    wants: Wants,
    /// The objects of the step before, by number, for what is derived from two steps.
    before: Vec<Known>,
    follower: Follower,
    /// The questions so far, the `reset` first, each with its outcome.
    exchanges: Vec<Exchange>,
    live: Live,
    /// Answers that are not yet obeyed, with the tick from which on they are.
    coming: VecDeque<(u64, Arc<Answer>)>,
    obeyed: Option<Arc<Answer>>,
    /// Tick of the last step that was asked, and of the last answer.
    asked_tick: Option<u64>,
    answered_tick: u64,
    touched: bool,
    failure: Option<Arc<Failure>>,
    status: Status,
}

#[derive(Clone)]
struct Exchange {
    key: Key,
    /// Number and time, µs, of the step that it asks; `None` of a reset.
    step: Option<(u64, u64)>,
    outcome: Outcome,
    told: Arc<Told>,
}

/// The groups of fields that the program asked for.
#[derive(Debug, Clone, Copy)]
struct Wants {
    motion: bool,
    conflicts: bool,
    names: bool,
}

impl Wants {
    fn of(program: &Program) -> Wants {
        let words = program.identify().map_or(&[][..], |identity| &identity.wants);
        let wants = |group: &str| words.iter().any(|word| word == group);
        Wants { motion: wants("motion"), conflicts: wants("conflicts"), names: wants("names") }
    }
}

/// What was told of an object.
#[derive(Debug, Clone, Copy)]
struct Known {
    id: u64,
    /// When it was first told without a gap since, and now, µs.
    first_us: u64,
    now_us: u64,
    velocity_mps: Vec2,
    heading_rad: f64,
}

/// Adds what follows from the step before: accelerations, turns and ages. Returns what is known now.
fn moved(objects: &mut [ObjectMessage], before: &[Known], now_us: u64) -> Vec<Known> {
    let known = objects.iter_mut().map(|object| {
        let id = object.id;
        let now = Known {
            id,
            first_us: now_us,
            now_us,
            velocity_mps: Vec2::new(object.vx, object.vy),
            heading_rad: object.heading,
        };
        let last = before.iter().find(|known| known.id == id).copied();
        let now = Known { first_us: last.map_or(now_us, |last| last.first_us), ..now };
        let last = last.unwrap_or(now);
        let passed_s = ((now_us - last.now_us) as f64 / 1e6).max(DT_S);
        let acceleration = (now.velocity_mps - last.velocity_mps) / passed_s;
        object.ax = Some(question::number(acceleration.x));
        object.ay = Some(question::number(acceleration.y));
        object.yaw_rate = Some(question::number(wrap_angle(now.heading_rad - last.heading_rad) / passed_s));
        object.age = Some(question::number((now_us - now.first_us) as f64 / 1e6));
        now
    });
    known.collect()
}

/// What a process answered.
struct Answered {
    outcome: Outcome,
    took_s: Option<f64>,
    said: String,
}

/// The process that answers, with the number of exchanges that it took part in. A copy has none.
#[derive(Default)]
struct Live(Option<(Session, usize)>);

impl Clone for Live {
    fn clone(&self) -> Live {
        Live(None)
    }
}

impl External {
    pub fn new(program: &Arc<Program>, scene: &Arc<Scene>, seed: u64) -> External {
        let observer = || Box::new(Modular::new(scene, &ModularConfig::default(), seed, None));
        External {
            program: Arc::clone(program),
            scene: Arc::clone(scene),
            seed,
            map: program.map_line(&scene.map),
            observer: program.settings().shows_perceived().then(observer),
            truth_from_s: f64::INFINITY,
            prompt_from_s: f64::INFINITY,
            wants: Wants::of(program),
            before: Vec::new(),
            follower: Follower::new(scene),
            exchanges: Vec::new(),
            live: Live::default(),
            coming: VecDeque::new(),
            obeyed: None,
            asked_tick: None,
            answered_tick: 0,
            touched: false,
            failure: None,
            status: Status::default(),
        }
    }

    /// Takes over from a moment on, s, the changes that are within: the truth, and no latency.
    pub fn mend(&mut self, alteration: Alteration, from_s: f64) {
        match alteration {
            Alteration::Truth => self.truth_from_s = from_s,
            Alteration::Prompt => self.prompt_from_s = from_s,
            _ => {}
        }
    }

    /// The system whose perception is shown at this time; `None` if the truth is shown.
    fn perceives(&self, time_s: f64) -> Option<&Modular> {
        self.observer.as_deref().filter(|_| time_s < self.truth_from_s - 1e-6)
    }

    /// Asks what to do, at this tick.
    fn ask(&mut self, sensed: &Sensed, tick: u64, route_m: (f64, f64)) {
        if self.exchanges.is_empty() {
            let mut reset = question::reset(&self.scene, sensed, self.seed);
            if self.wants.conflicts {
                reset.route.conflicts = Some(question::conflicts(&self.scene));
            }
            if self.wants.names {
                reset.episode_seed = Some(self.seed.to_string());
            }
            let line = Question::Reset(reset).line().into();
            if let Some(outcome) = self.exchange(line, self.map.key, None, Vec::new()) {
                debug_assert_eq!(outcome, Outcome::Ready);
            }
            if self.failure.is_some() {
                return;
            }
        }
        let (seq, t_us) = (self.exchanges.len() as u64 - 1, question::micros(tick as f64 * DT_S));
        let perceives = self.perceives(sensed.time_s);
        let mut step = question::step(&self.scene, sensed, perceives, (seq, t_us), route_m);
        if perceives.is_none()
            && let Some(observer) = &self.observer
        {
            // Who was perceived keeps the number of the track.
            for object in &mut step.objects {
                let mut known = observer.status().perceived.iter();
                let known = known.find(|known| known.id.map(u64::from) == Some(object.id));
                object.id = known.map_or(UNTRACKED_ID_MIN + object.id, |known| known.track.into());
            }
        }
        let perceived = perceives.map(|observer| &observer.status().perceived);
        let tracks: Vec<(u32, Option<u32>)> = match perceived {
            Some(perceived) => perceived.iter().map(|object| (object.track, object.id)).collect(),
            None => sensed.objects.iter().map(|object| (object.id, Some(object.id))).collect(),
        };
        if self.wants.names {
            for (object, (_, npc)) in step.objects.iter_mut().zip(&tracks) {
                object.npc = npc.map(u64::from);
            }
        }
        if self.wants.motion {
            self.before = moved(&mut step.objects, &self.before, t_us);
        }
        let mut lines = String::new();
        if sensed.ego.touched && !self.touched {
            lines = Question::Event(Event { kind: "collision".to_owned(), t_us }).line();
        }
        self.touched = sensed.ego.touched;
        lines.push_str(&Question::Step(Box::new(step)).line());
        let before = self.exchanges[self.exchanges.len() - 1].key;
        if let Some(Outcome::Answer(answer)) = self.exchange(lines.into(), before, Some((seq, t_us)), tracks)
        {
            let (_, mut latency) = self.program.settings().ticks();
            if sensed.time_s >= self.prompt_from_s - 1e-6 {
                // Answers that are still due would hold back the new ones.
                self.coming.clear();
                latency = 0;
            }
            self.coming.push_back((tick + latency, answer));
            self.answered_tick = tick;
        }
    }

    /// One question, answered from what is known or by a process. `None` after a failure.
    fn exchange(
        &mut self,
        question: Arc<str>,
        before: Key,
        step: Option<(u64, u64)>,
        tracks: Vec<(u32, Option<u32>)>,
    ) -> Option<Outcome> {
        let key = before.then(&question);
        let (mut took_s, mut said) = (None, String::new());
        let outcome = self.program.known(key).unwrap_or_else(|| {
            let outcome = match self.asked(&question, step) {
                Ok(answered) => {
                    (took_s, said) = (answered.took_s, answered.said);
                    answered.outcome
                }
                Err(failure) => Outcome::Failed(failure.into()),
            };
            if matches!(&outcome, Outcome::Answer(answer) if answer.is_extreme()) {
                self.program.cut_off();
            }
            match &outcome {
                // That no process may be started is no answer.
                Outcome::Failed(found) if found.kind() == FailureKind::Absent => return outcome,
                Outcome::Failed(failure) => self.program.fail(failure),
                _ => {}
            }
            self.program.learn(key, outcome.clone());
            outcome
        });
        if let Outcome::Failed(failure) = &outcome {
            self.failure = Some(Arc::clone(failure));
            self.live = Live::default();
        }
        let told = Told { question, t_us: step.map(|(_, t_us)| t_us), took_s, said, tracks };
        self.exchanges.push(Exchange { key, step, outcome: outcome.clone(), told: Arc::new(told) });
        self.failure.is_none().then_some(outcome)
    }

    /// Asks a process, which first is shown all that it has missed of the episode.
    fn asked(&mut self, question: &str, step: Option<(u64, u64)>) -> Result<Answered, Failure> {
        let up_to_date = self.live.0.take().filter(|(_, seen)| *seen == self.exchanges.len());
        let mut session = match up_to_date {
            Some((session, _)) => session,
            None => self.caught_up()?,
        };
        let answered = self.answer(&mut session, question, step)?;
        self.live = Live(Some((session, self.exchanges.len() + 1)));
        Ok(answered)
    }

    /// A process that has the map and was shown this episode so far.
    fn caught_up(&self) -> Result<Session, Failure> {
        if !self.program.can_start() {
            let stage = match self.exchanges.len() {
                0 => "reset".to_owned(),
                count => format!("step {}", count - 1),
            };
            let detail = "the recorded answers do not go on here".to_owned();
            return Err(Failure::new(Problem::NoProcess, stage, detail));
        }
        let mut session = self.program.session(Some(self.map.key))?;
        if session.map != Some(self.map.key.0) {
            session.ready(&self.map.line, "map", self.program.settings().timeouts.map_s)?;
            session.map = Some(self.map.key.0);
        }
        for exchange in &self.exchanges {
            let question = &exchange.told.question;
            if matches!(exchange.outcome, Outcome::Missed) {
                session.pass(question);
                continue;
            }
            let again = self.answer(&mut session, question, exchange.step)?.outcome;
            // A program that says it may answer otherwise is not at fault when it does.
            if self.program.is_deterministic() && !again.means(&exchange.outcome) {
                let stage = exchange.step.map_or("reset".to_owned(), |(seq, _)| format!("step {seq}"));
                let text = |outcome: &Outcome| serde_json::to_string(&outcome.essence()).unwrap_or_default();
                let detail = format!(
                    "shown the same again after a reset, it answered {} instead of {}",
                    text(&again),
                    text(&exchange.outcome)
                );
                return Err(session.otherwise(stage, detail));
            }
        }
        Ok(session)
    }

    fn answer(
        &self,
        session: &mut Session,
        question: &str,
        step: Option<(u64, u64)>,
    ) -> Result<Answered, Failure> {
        let settings = self.program.settings();
        let Some((seq, t_us)) = step else {
            session.ready(question, "reset", settings.timeouts.reset_s)?;
            return Ok(Answered { outcome: Outcome::Ready, took_s: None, said: session.said() });
        };
        let waits_for_late = settings.on_timeout == OnTimeout::Strict;
        let patience = Patience { limit_s: settings.timeouts.step_s, waits_for_late };
        let (outcome, took_s) = match session.step(question, (seq, t_us), patience)? {
            Some((answer, took_s)) => {
                self.program.thought(took_s);
                (Outcome::answered(answer), Some(took_s))
            }
            None => {
                self.program.miss();
                (Outcome::Missed, None)
            }
        };
        Ok(Answered { outcome, took_s, said: session.said() })
    }

    /// Pedals and wheel for this tick.
    fn control(&mut self, sensed: &Sensed, tick: u64, pose: &Pose) -> Control {
        while let Some((_, answer)) = self.coming.pop_front_if(|(from, _)| *from <= tick) {
            self.follower.begin(&answer);
            self.report(&answer);
            self.obeyed = Some(answer);
        }
        let lost_ticks = (LOST_S / DT_S).round() as u64;
        let is_lost = tick - self.answered_tick.min(tick) >= lost_ticks;
        let time_s = tick as f64 * DT_S;
        match self.obeyed.clone() {
            last if is_lost => self.follower.lost(last.as_deref(), pose, &sensed.ego),
            Some(answer) => self.follower.obey(&answer, time_s, pose, sensed),
            // Nothing was answered yet: it rolls.
            None => Control { steer_rad: sensed.ego.steer_rad, ..Control::default() },
        }
    }

    /// Takes over the internal state that the driving system reports.
    fn report(&mut self, answer: &Answer) {
        self.status.planned.clear();
        let internal = answer.internal();
        if let Some(plan) = internal.and_then(|internal| internal.planned.as_ref()) {
            self.status.planned.extend(plan.iter().map(|[x, y]| Vec2::new(*x, *y)));
        } else if let Answer::Trajectory(trajectory) = answer {
            let points = trajectory.points.iter().map(|point| Vec2::new(point.x, point.y));
            self.status.planned.extend(points);
        }
        self.status.reason = Reason::Reported;
        let reason = internal.and_then(|internal| internal.reason.as_deref());
        self.status.reported = reason.map(|reason| in_line(reason).into());
        if let Some(at) = internal.and_then(|internal| internal.localized.as_ref()) {
            self.status.localized = Some(Pose { position: Vec2::new(at.x, at.y), heading_rad: at.heading });
        }
    }

    /// Takes over what is perceived, for those who look on.
    fn note(&mut self, sensed: &Sensed, pose: &Pose, is_asked: bool) {
        let says_where = self
            .obeyed
            .as_ref()
            .and_then(|answer| answer.internal())
            .is_some_and(|own| own.localized.is_some());
        if !says_where {
            self.status.localized = Some(*pose);
        }
        match &self.observer {
            Some(observer) if is_asked => {
                self.status.perceived.clone_from(&observer.status().perceived);
                self.status.detected.clone_from(&observer.status().detected);
            }
            Some(_) => {}
            None => self.status.perceive(sensed.objects.iter().map(PerceivedObject::as_it_is)),
        }
    }
}

impl Ads for External {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        if self.failure.is_some() {
            return self.status.control;
        }
        if let Some(observer) = &mut self.observer {
            observer.drive(sensed);
        }
        let pose = question::pose(sensed, self.perceives(sensed.time_s));
        let route_m = self.follower.locate(&pose);
        let tick = (sensed.time_s / DT_S).round() as u64;
        let (period, _) = self.program.settings().ticks();
        let is_asked = tick.is_multiple_of(period) && self.asked_tick != Some(tick);
        if is_asked {
            self.asked_tick = Some(tick);
            self.ask(sensed, tick, route_m);
        }
        self.note(sensed, &pose, is_asked);
        let control = self.control(sensed, tick, &pose);
        self.follower.helm.command(control, &sensed.ego, &mut self.status)
    }

    fn status(&self) -> &Status {
        &self.status
    }

    fn failure(&self) -> Option<&Failure> {
        self.failure.as_deref()
    }

    fn conversation(&self) -> Option<Conversation> {
        let exchanges = self.exchanges.iter().map(|exchange| (exchange.key, exchange.outcome.clone()));
        let transcript =
            Transcript(self.exchanges.iter().map(|exchange| Arc::clone(&exchange.told)).collect());
        Some(Conversation { attached: self.program.attached(), exchanges: exchanges.collect(), transcript })
    }
}

impl Drop for External {
    fn drop(&mut self) {
        if let Some((mut session, _)) = self.live.0.take() {
            let t_us = question::micros(self.asked_tick.unwrap_or(0) as f64 * DT_S);
            session.tell(&Question::Event(Event { kind: "end".to_owned(), t_us }).line());
            self.program.give_back(session);
        }
    }
}
