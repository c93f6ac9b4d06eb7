//! The world: ego vehicle, other road users, weather, light, signals, contacts.

mod ambient;
mod body;
mod contact;
mod ego;
mod environment;
mod following;
mod junction;
mod mover;
mod npc;
mod pedestrian;
mod placement;
mod safety;
mod scene;
mod sense;
mod signals;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod way;
mod world;

pub use body::body_mass_t;
pub use ego::{Control, VehicleParameters, pedal_acceleration_mps2, pedals_for};
pub use following::Following;
pub use scene::Scene;
pub use sense::{Conditions, EgoMotion, FRAME_TICKS, Sensed, SensedObject, SignalColour};
pub use world::{Contact, DT_S, ENGINE, Incident, Obstacle, Start, World};
