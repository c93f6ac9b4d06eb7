//! The driver kit: what our driving systems share, so that the file of a new one has only its own ideas.
//!
//! | file | what the author of a driver gets |
//! |---|---|
//! | `guide` | the route in even samples: places beside it, its bends, the speed that it allows here and soon |
//! | `helm` | where the vehicle is, when to look (every 0.1 s), and the note of what was commanded |
//! | `sight` | a simple perception: range, darkness, fog, confirmation and delay |
//! | `corridor` | who is in the vehicle's way or in a lane beside it, and what to call it |
//! | `stops` | where lights, stop signs and crosswalks make it stop |
//! | `lane_changes` | the route's lane changes and the guide along them: the next one, when it is due, where to wait for it |
//! | `speed` | towards an allowed speed, at rest, and at the limit of the brakes |
//! | `point`, `pedals` | a point of a plan, and Apollo's cascade from it to an acceleration |
//! | `steering` | a steering controller (LQR) along a guide or beside it |
//!
//! Laws that the world shares, such as the driver model of others (`Following`) and stopping distances, are in
//! `kinematics`. The outline of a box along a way is `geometry::extent_m`. Pedals for an acceleration are
//! `sim::Control::towards`. A new driver is these, its law, and one line in `ads::REGISTRY`. Constants here are those
//! on which our drivers agree, so that they can be compared; those in which they differ stand with each driver.

mod corridor;
mod guide;
mod helm;
mod lane_changes;
mod pedals;
mod point;
mod sight;
mod speed;
mod steering;
mod stops;

pub use corridor::{BESIDE_M, FOLLOWED_MPS, HALF_WAY_M, in_lane};
pub use guide::{Guide, SpeedRules};
pub use helm::Helm;
pub use lane_changes::RouteChanges;
pub use pedals::{Pedals, PedalsConfig};
pub use point::Point;
pub use sight::Sight;
pub use speed::{HARDEST_MPS2, HOLD_MPS2, PREVIEW_S, held_mps2, speed_mps2};
pub use steering::{Aside, Steering, SteeringConfig};
pub use stops::{LIGHT_MPS2, Signs, Stop, crosswalks, lights};
