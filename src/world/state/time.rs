//! Time passes in ticks; what looks around does so once a frame.

use avastra_lang::model::TICK_MS;

/// One physics step, s: 50 Hz.
pub const DT_S: f64 = TICK_MS as f64 / 1000.0;

/// The ticks of a time, to the nearest.
pub(crate) const fn ticks(time_s: f64) -> u64 {
    (time_s / DT_S + 0.5) as u64
}

/// Ticks between two frames (10 Hz): once a frame, lines of sight are worked out, driving systems perceive
/// and other drivers react.
pub const FRAME_TICKS: u64 = 5;

/// Time between two frames, s.
pub const FRAME_S: f64 = FRAME_TICKS as f64 * DT_S;
