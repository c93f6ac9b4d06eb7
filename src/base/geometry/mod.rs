//! Plane geometry: poses, oriented boxes, paths, distances and swept contact.
//!
//! SI units, `f64`, x east and y north, headings in rad counter-clockwise from +x. Trigonometry is
//! `libm`'s, because the platform's differs in the last digit.

mod beside;
mod contact;
mod extreme;
mod path;
mod pose;
mod smooth_step;

pub use beside::{Beside, Span};
pub use contact::{FirstContact, Frame, Sweep, distance_m, first_contact};
pub use extreme::{larger, smaller};
pub use path::{Bounds, Chord, Path, PathPoint, Projection};
pub use pose::{OrientedBox, Pose, Vec2, extent_m, unit_vector, wrap_angle};
pub use smooth_step::{SMOOTH_STEP_BEND_MAX, SMOOTH_STEP_SLOPE_MAX, SmoothStep, smooth_step};
