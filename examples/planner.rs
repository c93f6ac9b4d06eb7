//! A planner under test in Rust: it follows the path of its route by trajectories, and stops for red lights and for what
//! stands on the path.
//!
//! ```sh
//! cargo build --example planner
//! avastra ads check --ads target/debug/examples/planner
//! ```
//!
//! docs/reference/protocol.md describes the messages. It needs serde_json, and nothing of avastra.

use std::io::{BufRead, Write, stdin, stdout};

use serde_json::{Value, json};

const CRUISE_MPS: f64 = 9.0;
const BRAKE_MPS2: f64 = 2.5;
/// From the rear axle to the front bumper, and room before what it stops for, m.
const FRONT_M: f64 = 3.705;
const ROOM_M: f64 = 3.0;
/// What lies within this of the path is on it, m.
const SIDE_M: f64 = 2.0;

/// The route of the episode.
#[derive(Default)]
struct Route {
    /// x, y, heading, for each metre.
    path: Vec<[f64; 3]>,
    /// Stations of stop lines, each with the id of its light.
    lines: Vec<(f64, String)>,
}

fn main() {
    let mut route = Route::default();
    for line in stdin().lock().lines().map_while(Result::ok) {
        let message: Value = serde_json::from_str(&line).expect("avastra writes JSON");
        let answer = match message["type"].as_str() {
            Some("init") => json!({
                "type": "ready", "protocol": "avastra-ads/1", "name": "example_rust", "version": "1",
                "answer": "trajectory", "deterministic": true,
            }),
            Some("map") => json!({ "type": "ready" }),
            Some("reset") => {
                route = Route::read(&message["route"]);
                json!({ "type": "ready" })
            }
            Some("step") => route.plan(&message),
            Some("close") => break,
            // Events want no answer.
            _ => continue,
        };
        writeln!(stdout(), "{answer}").expect("avastra reads");
    }
}

impl Route {
    fn read(route: &Value) -> Route {
        let rows = route["path"].as_array().into_iter().flatten();
        let lines = route["stop_lines"].as_array().into_iter().flatten();
        Route {
            path: rows.map(|row| core::array::from_fn(|index| row[index].as_f64().unwrap_or(0.0))).collect(),
            lines: lines
                .map(|line| {
                    (
                        line["route_s"].as_f64().unwrap_or(0.0),
                        line["signal"].as_str().unwrap_or("").to_owned(),
                    )
                })
                .collect(),
        }
    }

    /// A trajectory of 4 s along the path.
    fn plan(&self, step: &Value) -> Value {
        let ego = |name: &str| step["ego"][name].as_f64().unwrap_or(0.0);
        let (begin_m, mut speed_mps) = (ego("route_s"), ego("speed"));
        let stop_m = self.stop_m(step, begin_m, speed_mps);
        let mut station_m = begin_m;
        let now_us = step["t_us"].as_u64().unwrap_or(0);
        let points: Vec<Value> = (0..=40)
            .map(|index| {
                let [x, y, heading] = self.at(station_m);
                let point = json!({ "t_us": now_us + index * 100_000, "x": x, "y": y, "heading": heading, "v": speed_mps });
                // As fast as it can still stop from.
                let left_m = (stop_m - station_m).max(0.0);
                let wanted_mps = CRUISE_MPS.min((2.0 * BRAKE_MPS2 * left_m).sqrt());
                speed_mps += (wanted_mps - speed_mps).clamp(-0.6, 0.15);
                speed_mps = speed_mps.max(0.0);
                station_m += speed_mps * 0.1;
                point
            })
            .collect();
        let reason = if stop_m.is_finite() { "stop ahead" } else { "cruise" };
        json!({ "type": "trajectory", "seq": step["seq"], "points": points, "internal": { "reason": reason } })
    }

    /// Where its rear axle has to stop: before a light that is not green, or something on the path.
    fn stop_m(&self, step: &Value, begin_m: f64, speed_mps: f64) -> f64 {
        let is_green = |id: &str| {
            let mut lights = step["signals"].as_array().into_iter().flatten();
            lights.any(|light| light["id"] == id && light["state"] == "green")
        };
        // A line that it could not stop at any more is passed.
        let reach_m = speed_mps * speed_mps / (2.0 * 4.0);
        let lights =
            self.lines.iter().filter(|(line_m, id)| *line_m - FRONT_M > begin_m + reach_m && !is_green(id));
        let lights = lights.map(|(line_m, _)| line_m - FRONT_M - 1.0);
        let objects = step["objects"].as_array().into_iter().flatten().filter_map(|object| {
            let place = ["x", "y"].map(|name| object[name].as_f64().unwrap_or(0.0));
            let from = begin_m.max(0.0) as usize + 3;
            let near = |point: &&[f64; 3]| libm::hypot(point[0] - place[0], point[1] - place[1]) < SIDE_M;
            let ahead = self.path.iter().skip(from).take(60).position(|point| near(&point))?;
            let half_m = object["length"].as_f64().unwrap_or(0.0) / 2.0;
            Some((from + ahead) as f64 - half_m - FRONT_M - ROOM_M)
        });
        lights.chain(objects).fold(f64::INFINITY, f64::min)
    }

    /// The path at a station, between its points.
    fn at(&self, station_m: f64) -> [f64; 3] {
        let Some(last) = self.path.len().checked_sub(2) else { return [0.0; 3] };
        let index = (station_m.max(0.0) as usize).min(last);
        let part = station_m - index as f64;
        let (a, b) = (self.path[index], self.path[index + 1]);
        [a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part, a[2]]
    }
}
