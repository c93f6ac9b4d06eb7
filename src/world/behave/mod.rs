//! The next moves of road users: drivers, pedestrians and animals, followers of a trajectory, manoeuvres, and the
//! right of way.

pub mod guided;
pub mod manoeuvre;
pub mod npc;
pub mod pedestrian;
pub mod right_of_way;
pub mod road_user;
pub mod stroller;
