//! Bounds on the numbers that reach the world, whichever file they come from: a space, a scenario, a draw.
//!
//! `prove::spawn_bounds` proves them for every row; the action table holds every draw to them again.

use core::ops::RangeInclusive;

/// The tick of physics, ms: an observation period is a whole number of ticks.
pub const TICK_MS: u32 = 20;

/// Speeds at which anything may be spawned, m/s.
pub const SPAWN_SPEED_MPS: RangeInclusive<f64> = 0.0..=70.0;

/// Distances from the ego vehicle at which anything may be spawned, m.
pub const SPAWN_DISTANCE_M: RangeInclusive<f64> = 0.0..=1000.0;

/// Where the cycle of the signals may begin, s.
pub const SIGNAL_PHASE_S: RangeInclusive<f64> = 0.0..=3600.0;

/// Most ambient vehicles around the ego vehicle.
pub const AMBIENT_MAX: u32 = 20;
