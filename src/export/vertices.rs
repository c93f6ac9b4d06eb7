//! A recorded way with as few vertices as it needs.

use crate::geometry::{Pose, wrap_angle};
use crate::sim::DT_S;

use super::recording::Actor;

/// A player that goes straight from vertex to vertex at constant speed is nowhere farther than this from the recorded
/// place, m.
const STRAY_M: f64 = 0.01;
/// Nor turned farther from the recorded heading, rad: 2 cm at the front of a bus.
const STRAY_RAD: f64 = 0.002;
/// The longest time between two vertices, in ticks: 5 s. It bounds the search.
const STRIDE_TICKS_MAX: usize = 250;

/// Where a road user is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    pub time_s: f64,
    pub pose: Pose,
}

/// The way of a point of a road user that lies `ahead_m` before the middle of its outline. First and last sample are
/// always there.
pub fn vertices(actor: &Actor, ahead_m: f64) -> Vec<Vertex> {
    let all: Vec<Vertex> = actor
        .samples
        .iter()
        .map(|sample| Vertex { time_s: sample.tick as f64 * DT_S, pose: sample.pose.offset(ahead_m, 0.0) })
        .collect();
    let mut kept: Vec<Vertex> = all.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < all.len() {
        let farthest = (from + STRIDE_TICKS_MAX).min(all.len() - 1);
        let fits =
            |to: &usize| all[from + 1..*to].iter().all(|between| is_near(between, &all[from], &all[*to]));
        from = (from + 2..=farthest).take_while(fits).last().unwrap_or(from + 1);
        kept.push(all[from]);
    }
    kept
}

/// Whether a vertex lies near enough to the straight way from one vertex to another.
fn is_near(vertex: &Vertex, from: &Vertex, to: &Vertex) -> bool {
    let part = (vertex.time_s - from.time_s) / (to.time_s - from.time_s);
    let place = from.pose.position + (to.pose.position - from.pose.position) * part;
    let turn_rad = wrap_angle(to.pose.heading_rad - from.pose.heading_rad);
    let heading_rad = from.pose.heading_rad + turn_rad * part;
    (place - vertex.pose.position).norm() <= STRAY_M
        && wrap_angle(heading_rad - vertex.pose.heading_rad).abs() <= STRAY_RAD
}
