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
pub use ego::Control;
pub use ego::VehicleParameters;
pub use ego::pedal_acceleration_mps2;
pub use ego::pedals_for;
pub use following::Following;
pub use scene::Scene;
pub use sense::Conditions;
pub use sense::EgoMotion;
pub use sense::FRAME_TICKS;
pub use sense::Sensed;
pub use sense::SensedObject;
pub use sense::SignalColour;
pub use world::Contact;
pub use world::DT_S;
pub use world::ENGINE;
pub use world::Incident;
pub use world::Obstacle;
pub use world::Start;
pub use world::World;
