//! The world: ego vehicle, other road users, weather, light, signals, contacts.
//!
//! [`World`] is the whole state of an episode; its `Clone` is a snapshot. [`Scene`] is what stays the
//! same in all episodes of a road, and is shared. Time passes in ticks of [`DT_S`] (50 Hz). A tick does,
//! in this order (`World::tick`):
//!
//! 1. Every fifth tick it is noted who goes first (`right_of_way`); manoeuvres go on (`world/commands`).
//! 2. The ego vehicle moves by its pedals and wheel (`ego`), and its place beside the route is found.
//! 3. The other road users move one after another, each among the others as they stand at that moment
//!    (`road_user`, `around`). A driver looks around every fifth tick and then follows, stops or changes
//!    lanes (`npc`); a pedestrian walks or waits (`pedestrian`).
//! 4. A road user that would move into another shares its momentum with it (`incident`), and so does one that
//!    the ego vehicle touches (`contact`). Both come to rest by friction, and leave when out of sight.
//! 5. A light that was told to changes; twice a second, ambient traffic leaves and appears (`ambient`).
//! 6. Every fifth tick, water rises and drains (`environment`) and lines of sight are worked out (`sense`).
//!
//! Between ticks an action may change the sky or the time of day, or make a road user appear
//! (`World::apply`). `placement` decides where it appears, or why it cannot; `safety` says how much room a careful driver
//! would need. `moment` says what can be asked about a moment, `watched` and `encroachment` what requirements ask
//! beside it.
//!
//! Two modules stand below this one. `scene` has the map, the `way`s on it, where lanes cross and which goes first
//! (`junction`), and the manners that a run can change (`traffic`). `state` has the time, what is `sensed`, the colour of
//! every light at every tick (`signals`), and the digest over the states of all ticks (`trace`).

mod ambient;
mod around;
mod contact;
mod ego;
mod encroachment;
mod environment;
mod guided;
mod incident;
mod moment;
mod npc;
mod pedestrian;
mod placement;
mod right_of_way;
mod road_user;
mod safety;

mod sense;
mod stroller;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
mod tests;
mod watched;

mod world;

use avastra_lang::model::body;

pub use crate::scene::traffic::{TrafficError, TrafficProfile};
pub use crate::scene::{RANGE_M, Scene};
pub use crate::state::sensed::{Conditions, EgoMotion, Sensed, SensedObject, SignalColour};
pub use crate::state::time::{DT_S, FRAME_S, FRAME_TICKS};
pub use crate::state::trace::Trace;
pub use contact::Contact;
pub use ego::{Control, VehicleParameters, pedal_acceleration_mps2, pedals_for};
pub use encroachment::Encroachment;
pub use environment::friction_scale;
pub use guided::ASIDE_MPS;
pub use incident::Incident;
pub use moment::MomentParts;
pub use right_of_way::{Mover, Rule, Ruling, right_of_way};
pub use road_user::{Obstacle, PhaseCount};
pub use watched::{Watched, WatchedParts};
pub use world::{ENGINE, Start, World};
