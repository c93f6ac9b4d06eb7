//! Plane geometry: poses, oriented boxes, paths, distances and swept contact.
//!
//! SI units, `f64`, x east and y north, headings in rad counter-clockwise from +x. Trigonometry is
//! `libm`'s, because the platform's differs in the last digit. `contact` alone names `parry2d`.

mod contact;
mod path;
mod pose;
mod smooth_step;

pub use contact::Clearance;
pub use contact::FirstContact;
pub use contact::Frame;
pub use contact::Sweep;
pub use contact::clearance;
pub use contact::distance_m;
pub use contact::first_contact;
pub use contact::ray_hit_m;
pub use path::Path;
pub use path::PathPoint;
pub use path::Projection;
pub use pose::OrientedBox;
pub use pose::Pose;
pub use pose::Vec2;
pub use pose::unit_vector;
pub use pose::wrap_angle;
pub use smooth_step::SMOOTH_STEP_BEND_MAX;
pub use smooth_step::SMOOTH_STEP_SLOPE_MAX;
pub use smooth_step::SmoothStep;
pub use smooth_step::smooth_step;
