//! Messages in orders that a run seldom or never has, for `avastra ads check`: what a program must take in its stride, and
//! what it may answer with `error` but not with a crash or with silence.

use std::sync::Arc;

use avastra_world::sim::{Scene, Sensed};

use super::finding::{Failure, Problem};
use super::follow::Follower;
use super::message::{Event, Question};
use super::program::Program;
use super::question;
use super::session::{Patience, Session};
use super::settings::Timeouts;

/// Tries each order with the first moment of an episode, until one fails. Returns what was tried, in words. No process may be
/// waiting for an episode, because the first order needs one that has seen none.
///
/// # Errors
/// The order that failed, and how.
pub fn odd_orders(
    program: &Arc<Program>,
    scene: &Arc<Scene>,
    sensed: &Sensed,
    seed: u64,
) -> Result<Vec<&'static str>, (&'static str, Box<Failure>)> {
    let lines = Lines::new(program, scene, sensed, seed);
    let mut tried = Vec::new();
    for (what, order) in ORDERS {
        let tried_out = program.session(None).and_then(|mut session| {
            order(&lines, &mut session)?;
            program.give_back(session);
            Ok(())
        });
        match tried_out {
            Ok(()) => {}
            // It is killed, and the next order gets a fresh one.
            Err(failure) if failure.problem == Problem::Reported => {}
            Err(failure) => return Err((what, Box::new(failure))),
        }
        tried.push(what);
    }
    Ok(tried)
}

/// An order in words, and how it goes.
type Order = (&'static str, fn(&Lines, &mut Session) -> Result<(), Failure>);

/// The first needs a process that was never reset; the others may share one.
const ORDERS: [Order; 7] = [
    ("a step before the first reset", |lines, session| {
        session.pass(&lines.step);
        lines.map(session)?;
        session.pass(&lines.step);
        lines.reset(session)
    }),
    ("the map twice", |lines, session| {
        lines.map(session)?;
        lines.map(session)
    }),
    ("a reset after a reset", |lines, session| {
        lines.map(session)?;
        lines.reset(session)?;
        lines.reset(session)?;
        lines.step(session, &lines.step)
    }),
    ("a reset in the middle of an episode", |lines, session| {
        lines.map(session)?;
        lines.reset(session)?;
        lines.step(session, &lines.step)?;
        lines.reset(session)?;
        lines.step(session, &lines.step)
    }),
    ("the end of an episode, twice", |lines, session| {
        lines.map(session)?;
        lines.reset(session)?;
        session.tell(&lines.end);
        session.tell(&lines.end);
        lines.reset(session)?;
        lines.step(session, &lines.step)
    }),
    ("an event and a field of a later version", |lines, session| {
        lines.map(session)?;
        lines.reset(session)?;
        session.tell(&lines.later_event);
        lines.step(session, &lines.later_step)
    }),
    ("a message of a later version", |lines, session| {
        lines.map(session)?;
        session.pass("{\"type\":\"news\",\"text\":\"nothing that this version knows\"}\n");
        lines.reset(session)
    }),
];

/// The lines that are sent, and the limits for their answers, s.
struct Lines {
    map: String,
    reset: String,
    step: String,
    later_step: String,
    end: String,
    later_event: String,
    limits: Timeouts,
}

impl Lines {
    fn new(program: &Arc<Program>, scene: &Arc<Scene>, sensed: &Sensed, seed: u64) -> Lines {
        let route_m = Follower::new(scene).locate(&sensed.ego.rear_axle);
        let step = Question::Step(Box::new(question::step(scene, sensed, None, (0, 0), route_m))).line();
        let event = |kind: &str| Question::Event(Event { kind: kind.to_owned(), t_us: 0 }).line();
        Lines {
            map: program.map_line(&scene.map).line.clone(),
            reset: Question::Reset(question::reset(scene, sensed, seed)).line(),
            later_step: format!(
                "{},\"later\":[{{\"type\":\"x\"}}]}}\n",
                step.strip_suffix("}\n").unwrap_or(&step)
            ),
            step,
            end: event("end"),
            later_event: event("something_later"),
            limits: program.settings().timeouts,
        }
    }

    fn map(&self, session: &mut Session) -> Result<(), Failure> {
        session.ready(&self.map, "map", self.limits.map_s)
    }

    fn reset(&self, session: &mut Session) -> Result<(), Failure> {
        session.ready(&self.reset, "reset", self.limits.reset_s)
    }

    fn step(&self, session: &mut Session, line: &str) -> Result<(), Failure> {
        let patience = Patience { limit_s: self.limits.step_s, waits_for_late: true };
        session.step(line, (0, 0), patience).map(drop)
    }
}
