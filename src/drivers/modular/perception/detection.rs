//! One object as a detector reports it in one frame.

use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::Body;

/// One object in one frame, on the map.
#[derive(Debug, Clone, Copy)]
pub struct Detection {
    /// Id of what it shows: an annotation that no tracker is given, except an idealised one.
    pub truth: u32,
    pub body: Body,
    /// Pose as measured: centre of the whole object, see `shift_m`.
    pub pose: Pose,
    /// From the centre of `pose` to the centre of the part that was seen, along the heading, m.
    pub shift_m: f64,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// Standard deviation of the position, m.
    pub sigma_m: f64,
    /// The true motion, which no sensor measures at once; only an idealised tracker uses it.
    pub true_velocity_mps: Vec2,
    pub true_heading_rad: f64,
}
