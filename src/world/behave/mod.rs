//! What road users do next: drivers, people, who follows a trajectory, manoeuvres, and who of two goes first.

pub mod guided;
pub mod manoeuvre;
pub mod npc;
pub mod pedestrian;
pub mod right_of_way;
pub mod road_user;
pub mod stroller;
