//! The world: ego vehicle, other road users, weather, light, signals, contacts.
//!
//! [`World`] is the whole state of an episode; its `Clone` is a snapshot. [`Scene`] is what stays the
//! same in all episodes of a road, and is shared. Time passes in ticks of [`DT_S`] (50 Hz). A tick does,
//! in this order (`World::tick`):
//!
//! 1. Every fifth tick it is noted who goes first (`behave::right_of_way`); manoeuvres go on (`step::commands`).
//! 2. The ego vehicle moves by its pedals and wheel (`step::ego`), and its place beside the route is found.
//! 3. The other road users move one after another, each among the others as they stand at that moment
//!    (`behave::road_user`, `view::around`). A driver looks around every fifth tick and then follows, stops or changes
//!    lanes (`behave::npc`); a pedestrian walks or waits (`behave::pedestrian`).
//! 4. A road user that would move into another shares its momentum with it (`step::incident`), and so does one that
//!    the ego vehicle touches (`step::contact`). Both come to rest by friction, and leave when out of sight.
//! 5. A light that was told to changes; twice a second, ambient traffic leaves and appears (`place::ambient`).
//! 6. Every fifth tick, water rises and drains (`state::environment`) and lines of sight are worked out (`view::sense`).
//!
//! Between ticks an action may change the sky or the time of day, or make a road user appear (`World::apply`).
//!
//! The world is made of the modules before this one, which only gathers what the rest of avastra uses of them:
//!
//! | module | what it has |
//! |---|---|
//! | `scene` | the same in all episodes of a road: the map, the `way`s on it, where lanes cross and which goes first (`junction`), the route, and the traffic profile (`traffic`) |
//! | `state` | plain data of a moment, and what follows from one piece of it alone |
//! | `view` | read-only questions: the world as one road user sees it (`around`), facts (`moment`, `watched`, `encroachment`), lines of sight, a careful driver's room (`safety`) |
//! | `behave` | what a road user does next, by its view and its own memory; who of two goes first |
//! | `place` | where a newcomer appears, or why it cannot |
//! | `step` | how one moment becomes the next |

#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
pub(crate) mod tests;

pub use crate::behave::guided::ASIDE_MPS;
pub use crate::behave::right_of_way::order::right_of_way;
pub use crate::scene::traffic::{TrafficError, TrafficProfile};
pub use crate::scene::{RANGE_M, Scene};
pub use crate::state::contact::{Contact, Incident};
pub use crate::state::ego::VehicleParameters;
pub use crate::state::environment::friction_scale;
pub use crate::state::manoeuvre::PhaseCount;
pub use crate::state::obstacle::Obstacle;
pub use crate::state::ruling::{Mover, Rule, Ruling};
pub use crate::state::sensed::{Conditions, EgoMotion, Sensed, SensedObject, SignalColour};
pub use crate::state::time::{DT_S, FRAME_S, FRAME_TICKS};
pub use crate::state::trace::{Trace, Traced};
pub use crate::state::world::{ENGINE, Start, World};
pub use crate::step::ego::{Control, pedal_acceleration_mps2, pedals_for};
pub use crate::view::encroachment::Encroachment;
pub use crate::view::watched::Watched;
