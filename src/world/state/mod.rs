//! Plain data of a moment, each with what follows from it alone. Its parts are the world, the ego vehicle, road users
//! and what moves them, weather, lights, time, what is sensed, and the digest over all of it.

pub mod ambient;
pub mod change;
pub mod contact;
pub mod driver;
pub mod ego;
pub mod environment;
pub mod guided;
pub mod manoeuvre;
pub mod obstacle;
pub mod passed;
pub mod pedestrian;
pub mod pursuit;
pub mod rights;
pub mod road_user;
pub mod ruling;
pub mod sensed;
pub mod signals;
pub mod stroller;
pub mod time;
pub mod trace;
pub mod world;
