//! Right of way: which of the ego vehicle and a road user has priority over the other.
//!
//! The rules are those of the Vienna Convention on Road Traffic (1968); Estonia has signed it, and California's
//! code says the same in other words. For two vehicles:
//!
//! | where | rule | article |
//! |---|---|---|
//! | lanes of a junction | an emergency vehicle under way | 34.1 |
//! | lanes of a junction | a red light or a late yellow one, a stop sign passed without standing | signs 23, 10 |
//! | lanes of a junction | signs, then turning left before oncoming traffic, then the right | 18, 16 |
//! | elsewhere | a vehicle that backs up, turns round, or comes from beside the road gives way | 14, 18 |
//! | elsewhere | a vehicle that leaves its lane gives way to one that keeps its own | 14, 11 |
//! | side by side into a junction | a vehicle that turns off gives way to one that goes straight on beside it | 16 |
//! | side by side into a junction | a vehicle does not overtake another where that turns across the road | 11 |
//! | one lane | a vehicle behind another keeps its distance | 13.5 |
//!
//! A vehicle is judged by its motion, whichever word told it so: a lane change, an offset, and a trajectory that lead
//! the same way get the same verdict. `Ruling` names the rule, its moment, and whose motion decided.
//!
//! To give way means not to make the other change its speed or direction *abruptly* (article 1). So the moment at
//! which the first of the two comes into the other's way is what counts. A vehicle that then leaves the other room to
//! brake gently has given way, and has from now on priority over it. A vehicle that is in a junction may clear it
//! (18.6), and a vehicle that follows keeps its distance (13.5). That both make a priority is ours. UN R79 says for
//! lane changes what is abrupt: more than 3 m/s² after 0.4 s, to stay the way of a second behind. So a vehicle that
//! cuts in and stops before the one behind it has its distance back, or could have stopped, has not given way. A
//! vehicle that waits in a junction beside the other's way and then sets out comes anew. A vehicle that passed red,
//! late yellow or its stop sign has not given way, however early it came. If that was the other vehicle, and the ego
//! vehicle had time to brake, neither has priority.
//!
//! A vehicle that stands has priority in two cases, wherever it stands and looks (13.1). Either the ego vehicle saw it
//! stand while the ego vehicle could still brake gently for it, or the standing vehicle came with room. If it then
//! moves by a step, neither has. An ego vehicle that stands has stopped already.
//!
//! A vehicle that has crashed is an obstacle: whoever drives must be able to stop for what can be foreseen (13.1).
//! It has priority, unless it came to lie in the ego vehicle's way too late to brake gently for it; then neither has.
//!
//! A pedestrian on a crosswalk has priority (21), unless the light for the ego vehicle is green. Elsewhere a pedestrian
//! may not step onto the road without regard to distance and speed of approaching vehicles (20.6). A driver must not
//! endanger pedestrians, and must be able to stop for what can be foreseen (21.1, 13.1). So the ego vehicle has
//! priority only over one that steps onto the carriageway too late for its brakes, and otherwise neither has. It loses
//! that priority once it sees the pedestrian and could still stop. It has none at walking pace, from which a driver can
//! stop for any pedestrian. A pedestrian who stays beside the road has priority over an ego vehicle that leaves the
//! road there.
//!
//! If two vehicles come towards each other outside junctions, the one beyond the middle of the road has to give way
//! (articles 10.3 and 12). Any part of its body counts, such as the rear of a bus that swings over the line. If both are
//! beyond it, neither has priority.
//!
//! The state is kept for each road user (`Rights`), looked at ten times a second, and read at a contact.

use crate::behave::right_of_way::on_foot::light_before;
use crate::behave::right_of_way::room::room_before_m;
use crate::state::obstacle::Obstacle;
use crate::state::road_user::RoadUser;
use crate::state::sensed::SignalColour;
use crate::state::world::World;

mod crossing;
mod on_foot;
pub mod order;
mod passed;
mod rights;
mod room;
mod side;
mod turning;
mod vehicle;

#[cfg(test)]
mod tests;

impl World {
    /// Whether a road user lies across the strip that the ego vehicle drives on, before its front.
    pub fn is_in_the_way(&self, obstacle: &Obstacle) -> bool {
        room_before_m(obstacle, &self.alone()).is_some()
    }

    /// The colour of the light that holds for a crosswalk of the route, which begins at a station.
    pub fn light_before(&self, crosswalk_m: f64) -> Option<SignalColour> {
        light_before(crosswalk_m, &self.alone())
    }

    /// Whether the road user with an id drives into a junction across the route of the ego vehicle, which goes first there.
    pub fn cuts_across_ego(&self, id: u32) -> bool {
        let around = self.alone();
        let user = self.user(id);
        user.is_some_and(|RoadUser { obstacle, mover }| {
            mover.rights.cuts_across_ego(obstacle, &mover.motion, &self.ego_passed, &around)
        })
    }
}
