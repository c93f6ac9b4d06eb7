//! `avastra ads toy`: a small driving system at the other end of the protocol, to try avastra with before one's own is
//! ready. It keeps to the route and brakes for what is ahead. On demand it does each of the things wrong for which
//! docs/reference/protocol.md has a name.

use std::io::{BufRead, Write, stdin, stdout};
use std::time::Duration;

use crate::cli::arguments::{Misbehaviour, ToyAnswer, ToyArguments};
use crate::cli::error::Failure;
use avastra_drivers::external::message::{
    AccelerationMessage, Answer, AnswerKind, ControlMessage, ErrorMessage, Internal, PROTOCOL, Point,
    Question, Ready, Step, TrajectoryMessage, TrajectoryPoint,
};

/// Its speed on a free road, m/s.
const CRUISE_MPS: f64 = 8.0;
/// It misbehaves from this step on.
const WRONG_STEP: u64 = 20;
/// Points of its trajectories are this far apart, s, and reach this far, s.
const POINT_S: f64 = 0.1;
const HORIZON_S: f64 = 3.0;

/// Speaks the protocol over stdin and stdout until `close`, or the end of the input.
pub fn toy(arguments: &ToyArguments) -> Result<(), Failure> {
    let mut toy = Toy { arguments, path: Vec::new(), resets: 0, steps: 0 };
    for line in stdin().lock().lines() {
        let Ok(line) = line else { break };
        let message = match serde_json::from_str::<Question>(&line) {
            Ok(message) => message,
            // A message of a later version.
            Err(_)
                if serde_json::from_str::<serde_json::Value>(&line).is_ok_and(|value| value.is_object()) =>
            {
                continue;
            }
            Err(_) => {
                return Err(Failure::usage(
                    "stdin has a line that is no message: `avastra ads toy` is started by avastra",
                ));
            }
        };
        if matches!(message, Question::Close(_)) {
            break;
        }
        if let Some(answer) = toy.answer(message)?
            && stdout().lock().write_all(answer.as_bytes()).and_then(|()| stdout().flush()).is_err()
        {
            // The other side has gone.
            break;
        }
    }
    Ok(())
}

struct Toy<'a> {
    arguments: &'a ToyArguments,
    /// The path of the route: x, y, heading, curvature and limit, for each metre.
    path: Vec<[f64; 5]>,
    resets: u32,
    /// Steps in its whole life.
    steps: u64,
}

impl Toy<'_> {
    fn misbehaves(&self, how: Misbehaviour) -> bool {
        self.arguments.misbehave == Some(how)
    }

    /// The line that answers a message, if one is due.
    fn answer(&mut self, message: Question) -> Result<Option<String>, Failure> {
        let ready = Ready {
            protocol: None,
            name: None,
            version: None,
            answer: None,
            deterministic: None,
            wants: None,
        };
        let answer = match message {
            Question::Init(_) if self.misbehaves(Misbehaviour::CrashAtStart) => return Err(crashed()),
            Question::Init(_) => Answer::Ready(Ready {
                protocol: Some(PROTOCOL.to_owned()),
                name: Some("toy".to_owned()),
                version: Some(self.arguments.as_version.clone()),
                answer: Some(self.kind()),
                deterministic: Some(!self.arguments.not_deterministic),
                wants: (!self.arguments.wants.is_empty()).then(|| self.arguments.wants.clone()),
            }),
            Question::Map(_) => Answer::Ready(ready),
            Question::Reset(reset) => {
                self.resets += 1;
                if self.resets > 1 && self.misbehaves(Misbehaviour::CrashAtReset) {
                    return Err(crashed());
                }
                self.path = reset.route.path;
                Answer::Ready(ready)
            }
            Question::Step(step) => {
                self.steps += 1;
                if self.resets == 0 && self.misbehaves(Misbehaviour::CrashBeforeReset) {
                    return Err(crashed());
                }
                return self.step(&step);
            }
            Question::Event(_) | Question::Close(_) => return Ok(None),
        };
        Ok(Some(line(&answer)))
    }

    fn kind(&self) -> AnswerKind {
        match self.arguments.answer {
            ToyAnswer::Control | ToyAnswer::Pedals => AnswerKind::Control,
            ToyAnswer::Trajectory => AnswerKind::Trajectory,
            ToyAnswer::Acceleration => AnswerKind::Acceleration,
        }
    }

    fn step(&self, step: &Step) -> Result<Option<String>, Failure> {
        let seq = step.seq;
        let right = line(&self.drive(step, seq));
        let Some(how) = self.arguments.misbehave.filter(|_| seq >= WRONG_STEP) else {
            return Ok(Some(right));
        };
        Ok(Some(match how {
            Misbehaviour::CrashAtStart | Misbehaviour::CrashAtReset | Misbehaviour::CrashBeforeReset => right,
            Misbehaviour::CrashInEpisode => return Err(crashed()),
            Misbehaviour::Hang => {
                std::thread::sleep(Duration::from_secs(3600));
                right
            }
            Misbehaviour::Garbage => "Traceback (most recent call last):\n".to_owned(),
            Misbehaviour::Nan => {
                format!("{{\"type\":\"{}\",\"seq\":{seq},\"accel\":NaN}}\n", self.kind().name())
            }
            Misbehaviour::LateOnce if seq > WRONG_STEP => right,
            Misbehaviour::Late | Misbehaviour::LateOnce => {
                std::thread::sleep(Duration::from_secs_f64(self.arguments.late.clamp(0.0, 3600.0)));
                right
            }
            Misbehaviour::Twice => right.repeat(2),
            Misbehaviour::Early => right + &line(&self.drive(step, seq + 1)),
            Misbehaviour::WrongSeq => line(&self.drive(step, seq + 7)),
            Misbehaviour::HugeLine => {
                let mut huge = "{\"type\":\"".to_owned();
                huge.push_str(&"x".repeat(8 << 20));
                huge
            }
            Misbehaviour::CloseStdout => {
                // The standard library has no way to close it: the descriptor is closed by its number.
                nix::unistd::close(1).map_err(Failure::usage)?;
                std::thread::sleep(Duration::from_secs(3600));
                return Ok(None);
            }
            Misbehaviour::FloodStderr => {
                let chunk = vec![b'.'; 1 << 20];
                for _ in 0..1024 {
                    if std::io::stderr().write_all(&chunk).is_err() {
                        break;
                    }
                }
                right
            }
            Misbehaviour::Error => {
                line(&Answer::Error(ErrorMessage { message: "the toy cannot go on".to_owned() }))
            }
            Misbehaviour::Fickle if !self.resets.is_multiple_of(3) => right,
            // The answer depends on the process's whole life, not on the episode alone: in each episode, or in every third.
            Misbehaviour::Forgetful | Misbehaviour::Fickle => {
                let accel = -0.01 * (self.steps % 97) as f64;
                line(&Answer::Acceleration(AccelerationMessage {
                    seq,
                    accel,
                    lane_change: None,
                    internal: None,
                }))
            }
        }))
    }

    /// An answer as it should be.
    fn drive(&self, step: &Step, seq: u64) -> Answer {
        let (speed_mps, route_m) = (step.ego.speed, step.ego.route_s);
        let accel_mps2 = self.accel_mps2(step);
        let reason = if accel_mps2 < -1.0 { "something ahead" } else { "cruise" };
        let reason = Some(reason.to_owned());
        let internal = Some(Internal { reason, planned: None, localized: None, plan_ms: None });
        let control = ControlMessage {
            seq,
            steer: self.steer_rad(step),
            accel: None,
            throttle: None,
            brake: None,
            internal: None,
        };
        match self.arguments.answer {
            ToyAnswer::Acceleration => Answer::Acceleration(AccelerationMessage {
                seq,
                accel: accel_mps2,
                lane_change: None,
                internal,
            }),
            ToyAnswer::Control => {
                Answer::Control(ControlMessage { accel: Some(accel_mps2), internal, ..control })
            }
            ToyAnswer::Pedals => {
                let throttle = if accel_mps2 > 0.0 { 0.16 + 0.12 * accel_mps2 } else { 0.0 };
                let brake = if accel_mps2 < 0.0 { 0.15 - 0.09 * accel_mps2 } else { 0.0 };
                let (throttle, brake) = (Some(throttle.min(1.0)), Some(brake.min(1.0)));
                Answer::Control(ControlMessage { throttle, brake, ..control })
            }
            ToyAnswer::Trajectory => {
                let (mut at_m, mut v_mps) = (route_m, speed_mps.max(0.0));
                let mut points = Vec::new();
                for index in 0..=(HORIZON_S / POINT_S) as u64 {
                    let ([x, y], heading) = self.place(at_m);
                    let t_us = step.t_us + index * 100_000;
                    points.push(TrajectoryPoint { t_us, x, y, heading, v: v_mps, a: None });
                    at_m += v_mps * POINT_S;
                    v_mps = (v_mps + accel_mps2 * POINT_S).clamp(0.0, CRUISE_MPS);
                }
                Answer::Trajectory(TrajectoryMessage { seq, points, internal })
            }
        }
    }

    /// It brakes for whatever lies near its path, within the way that it needs to stop.
    fn accel_mps2(&self, step: &Step) -> f64 {
        let (speed_mps, route_m) = (step.ego.speed, step.ego.route_s);
        let reach_m = 10.0 + speed_mps * speed_mps / 4.0;
        let ahead = || self.path.iter().skip(route_m as usize + 3).take(reach_m as usize);
        let is_near =
            |x: f64, y: f64| ahead().any(|place| (place[0] - x).abs() < 2.0 && (place[1] - y).abs() < 2.0);
        if !self.arguments.blind && step.objects.iter().any(|object| is_near(object.x, object.y)) {
            return -4.0;
        }
        (CRUISE_MPS - speed_mps).clamp(-2.0, 1.5)
    }

    /// Pure pursuit of the path.
    fn steer_rad(&self, step: &Step) -> f64 {
        let ego = &step.ego;
        let ahead_m = 4.0 + 0.5 * ego.speed;
        let ([x, y], _) = self.place(ego.route_s + ahead_m);
        let (dx, dy) = (x - ego.x, y - ego.y);
        let left_m = libm::cos(ego.heading) * dy - libm::sin(ego.heading) * dx;
        let away_m2 = (dx * dx + dy * dy).max(1.0);
        libm::atan(2.837 * 2.0 * left_m / away_m2).clamp(-0.5, 0.5)
    }

    /// The path at a station, between its points: the place, and the heading in rad.
    fn place(&self, station_m: f64) -> (Point, f64) {
        let Some(last) = self.path.len().checked_sub(2) else { return ([0.0; 2], 0.0) };
        let index = (station_m.max(0.0) as usize).min(last);
        let fraction = station_m - index as f64;
        let (a, b) = (self.path[index], self.path[index + 1]);
        ([a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction], a[2])
    }
}

fn crashed() -> Failure {
    Failure::usage("the toy crashes, as it was asked to")
}

fn line(answer: &Answer) -> String {
    let mut line = serde_json::to_string(answer).expect("messages are plain data");
    line.push('\n');
    line
}
