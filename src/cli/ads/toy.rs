//! `avastra ads toy`: a small driving system at the other end of the protocol, to try avastra with before one's own is
//! ready. It keeps to the route and brakes for what is ahead. On demand it does each of the things wrong for which
//! PROTOCOL.md has a name.

use std::io::{BufRead, Write, stdin, stdout};
use std::time::Duration;

use serde_json::{Value, json};

use crate::cli::arguments::{Misbehaviour, ToyAnswer, ToyArguments};
use crate::cli::error::Failure;

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
        let Ok(message) = serde_json::from_str::<Value>(&line) else {
            return Err(Failure::usage(
                "stdin has a line that is no JSON: `avastra ads toy` is started by avastra",
            ));
        };
        let kind = message["type"].as_str().unwrap_or_default();
        if kind == "close" {
            break;
        }
        if let Some(answer) = toy.answer(kind, &message)?
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
    /// The path of the route: x, y, heading, for each metre.
    path: Vec<[f64; 3]>,
    resets: u32,
    /// Steps in its whole life.
    steps: u64,
}

impl Toy<'_> {
    fn misbehaves(&self, how: Misbehaviour) -> bool {
        self.arguments.misbehave == Some(how)
    }

    /// The line that answers a message, if one is due.
    fn answer(&mut self, kind: &str, message: &Value) -> Result<Option<String>, Failure> {
        let crashed = || Err(Failure::usage("the toy crashes, as it was asked to"));
        match kind {
            "init" if self.misbehaves(Misbehaviour::CrashAtStart) => crashed(),
            "init" => Ok(Some(line(&json!({
                "type": "ready", "protocol": "avastra-ads/1", "name": "toy", "version": "1",
                "answer": self.kind(), "deterministic": true,
            })))),
            "map" => Ok(Some(line(&json!({ "type": "ready" })))),
            "reset" => {
                self.resets += 1;
                if self.resets > 1 && self.misbehaves(Misbehaviour::CrashAtReset) {
                    return crashed();
                }
                let numbers = |row: &Value| core::array::from_fn(|index| row[index].as_f64().unwrap_or(0.0));
                let path = message["route"]["path"].as_array();
                self.path = path.into_iter().flatten().map(numbers).collect();
                Ok(Some(line(&json!({ "type": "ready" }))))
            }
            "step" => {
                self.steps += 1;
                self.step(message)
            }
            _ => Ok(None),
        }
    }

    fn kind(&self) -> &'static str {
        match self.arguments.answer {
            ToyAnswer::Control | ToyAnswer::Pedals => "control",
            ToyAnswer::Trajectory => "trajectory",
            ToyAnswer::Acceleration => "acceleration",
        }
    }

    fn step(&self, message: &Value) -> Result<Option<String>, Failure> {
        let seq = message["seq"].as_u64().unwrap_or(0);
        let right = line(&self.drive(message, seq));
        let Some(how) = self.arguments.misbehave.filter(|_| seq >= WRONG_STEP) else {
            return Ok(Some(right));
        };
        Ok(Some(match how {
            Misbehaviour::CrashAtStart | Misbehaviour::CrashAtReset => right,
            Misbehaviour::CrashInEpisode => {
                return Err(Failure::usage("the toy crashes, as it was asked to"));
            }
            Misbehaviour::Hang => {
                std::thread::sleep(Duration::from_secs(3600));
                right
            }
            Misbehaviour::Garbage => "Traceback (most recent call last):\n".to_owned(),
            Misbehaviour::Nan => format!("{{\"type\":\"{}\",\"seq\":{seq},\"accel\":NaN}}\n", self.kind()),
            Misbehaviour::Late => {
                std::thread::sleep(Duration::from_secs_f64(self.arguments.late.clamp(0.0, 3600.0)));
                right
            }
            Misbehaviour::Twice => right.repeat(2),
            Misbehaviour::WrongSeq => line(&self.drive(message, seq + 7)),
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
            Misbehaviour::Error => line(&json!({ "type": "error", "message": "the toy cannot go on" })),
            // What it answers depends on its whole life, and not on the episode alone.
            Misbehaviour::Forgetful => {
                let accel = -0.01 * (self.steps % 97) as f64;
                line(&json!({ "type": "acceleration", "seq": seq, "accel": accel }))
            }
        }))
    }

    /// An answer as it should be.
    fn drive(&self, message: &Value, seq: u64) -> Value {
        let number = |name: &str| message["ego"][name].as_f64().unwrap_or(0.0);
        let (speed_mps, route_m) = (number("speed"), number("route_s"));
        let accel_mps2 = self.accel_mps2(message, speed_mps, route_m);
        let reason = if accel_mps2 < -1.0 { "something ahead" } else { "cruise" };
        let internal = json!({ "reason": reason });
        match self.arguments.answer {
            ToyAnswer::Acceleration => {
                json!({ "type": "acceleration", "seq": seq, "accel": accel_mps2, "internal": internal })
            }
            ToyAnswer::Control => {
                let steer = self.steer_rad(message, speed_mps, route_m);
                json!({ "type": "control", "seq": seq, "accel": accel_mps2, "steer": steer, "internal": internal })
            }
            ToyAnswer::Pedals => {
                let steer = self.steer_rad(message, speed_mps, route_m);
                let throttle = if accel_mps2 > 0.0 { 0.16 + 0.12 * accel_mps2 } else { 0.0 };
                let brake = if accel_mps2 < 0.0 { 0.15 - 0.09 * accel_mps2 } else { 0.0 };
                json!({ "type": "control", "seq": seq, "throttle": throttle.min(1.0), "brake": brake.min(1.0), "steer": steer })
            }
            ToyAnswer::Trajectory => {
                let t_us = message["t_us"].as_u64().unwrap_or(0);
                let (mut at_m, mut v_mps) = (route_m, speed_mps);
                let mut points = Vec::new();
                for index in 0..=(HORIZON_S / POINT_S) as u64 {
                    let [x, y, heading] = self.place(at_m);
                    points.push(json!({ "t_us": t_us + index * 100_000, "x": x, "y": y, "heading": heading, "v": v_mps }));
                    at_m += v_mps * POINT_S;
                    v_mps = (v_mps + accel_mps2 * POINT_S).clamp(0.0, CRUISE_MPS);
                }
                json!({ "type": "trajectory", "seq": seq, "points": points, "internal": internal })
            }
        }
    }

    /// It brakes for whatever lies near its path, within the way that it needs to stop.
    fn accel_mps2(&self, message: &Value, speed_mps: f64, route_m: f64) -> f64 {
        let reach_m = 10.0 + speed_mps * speed_mps / 4.0;
        let is_near = |object: &Value| {
            let place = ["x", "y"].map(|name| object[name].as_f64().unwrap_or(0.0));
            let from = route_m as usize + 3;
            let ahead = self.path.iter().skip(from).take(reach_m as usize);
            ahead.clone().any(|[x, y, _]| (x - place[0]).abs() < 2.0 && (y - place[1]).abs() < 2.0)
        };
        if !self.arguments.blind && message["objects"].as_array().into_iter().flatten().any(is_near) {
            return -4.0;
        }
        (CRUISE_MPS - speed_mps).clamp(-2.0, 1.5)
    }

    /// Pure pursuit of the path.
    fn steer_rad(&self, message: &Value, speed_mps: f64, route_m: f64) -> f64 {
        let ego = ["x", "y", "heading"].map(|name| message["ego"][name].as_f64().unwrap_or(0.0));
        let ahead_m = 4.0 + 0.5 * speed_mps;
        let [x, y, _] = self.place(route_m + ahead_m);
        let (dx, dy) = (x - ego[0], y - ego[1]);
        let (sin, cos) = (libm::sin(ego[2]), libm::cos(ego[2]));
        let left_m = cos * dy - sin * dx;
        let away_m2 = (dx * dx + dy * dy).max(1.0);
        libm::atan(2.837 * 2.0 * left_m / away_m2).clamp(-0.5, 0.5)
    }

    /// The path at a station, between its points.
    fn place(&self, station_m: f64) -> [f64; 3] {
        let Some(last) = self.path.len().checked_sub(2) else { return [0.0; 3] };
        let index = (station_m.max(0.0) as usize).min(last);
        let fraction = station_m - index as f64;
        let (a, b) = (self.path[index], self.path[index + 1]);
        [a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction, a[2]]
    }
}

fn line(message: &Value) -> String {
    format!("{message}\n")
}
