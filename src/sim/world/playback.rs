//! A world with another ego vehicle: everybody else moves as they did in a recording, tick by tick,
//! whatever the ego vehicle does now.
//!
//! A recording is the worlds after each tick, in order. Impacts are left out: who plays a recording
//! back asks whether there is a contact, not what comes of it.

use crate::geometry::{Frame, OrientedBox, Sweep};
use crate::sim::contact::{Party, meet};
use crate::sim::ego::Control;

use super::{Contact, DT_S, FRAME_TICKS, World};

impl World {
    /// Advances by [`DT_S`]: the ego vehicle by its command, everything else to where `recorded`, the
    /// world one tick later, has it. Returns the contacts of this tick; one that lasts is returned
    /// again in every tick.
    pub fn tick_recorded(&mut self, control: &Control, recorded: &World) -> &[Contact] {
        let before: Vec<(u32, OrientedBox)> =
            self.obstacles.iter().map(|obstacle| (obstacle.id, obstacle.outline)).collect();
        let ego_before = self.ego_outline;
        self.ego.step(control, self.conditions.friction, DT_S);
        self.ego_outline = self.ego.outline();
        self.ego_frame = Frame::of(&self.ego_outline);
        self.follow_route();
        let own = self.clone();
        *self = World {
            ego: own.ego,
            ego_outline: own.ego_outline,
            ego_frame: own.ego_frame,
            ego_station_m: own.ego_station_m,
            ego_offset_m: own.ego_offset_m,
            red_runs: own.red_runs,
            contacts: Vec::new(),
            ..recorded.clone()
        };
        let ego_mps = self.ego.motion.speed_mps;
        let ego = Party {
            sweep: Sweep { start: ego_before, end: self.ego_outline.pose },
            velocity_mps: self.ego_frame.forward() * ego_mps,
        };
        for (obstacle, mover) in self.obstacles.iter_mut().zip(&self.movers) {
            let outline = Frame::along(&obstacle.outline, obstacle.forward);
            obstacle.distance_m = self.ego_frame.distance_m(&outline);
            if mover.touched {
                continue;
            }
            // Who was not there a tick ago has not come from anywhere.
            let known = before.iter().find(|(id, _)| *id == obstacle.id);
            let start = known.map_or(obstacle.outline, |(_, outline)| *outline);
            let other = Party {
                sweep: Sweep { start, end: obstacle.outline.pose },
                velocity_mps: obstacle.velocity_mps,
            };
            let tick = recorded.ticks - 1;
            self.contacts.extend(meet(&ego, ego_mps, &other, obstacle.id, tick));
        }
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.look();
        }
        &self.contacts
    }
}

#[cfg(test)]
mod tests {
    use crate::action::{Effect, SpawnRequest};
    use crate::model::vocabulary::{Body, Colour, LaneChoice, Side, Then, Verb};
    use crate::sim::testing;

    use super::*;

    #[test]
    fn the_same_commands_give_the_recording_again_and_others_another_ego_vehicle() {
        let mut world = testing::world(&testing::straight());
        let request = SpawnRequest {
            body: Body::Sedan,
            colour: Colour::Red,
            verb: Verb::DriveAhead,
            lane: LaneChoice::Current,
            side: Side::Right,
            then: Then::Keep,
            speed_mps: 6.0,
            distance_m: 30.0,
        };
        world.apply(&Effect::Spawn(request)).expect("there is room");
        let (mut same, mut braked) = (world.clone(), world.clone());
        let throttle = Control { throttle_pct: 40.0, ..Control::default() };
        let bits = |world: &World| {
            let mut bits = Vec::new();
            world.trace(&mut |word| bits.push(word));
            bits
        };
        for _ in 0..200 {
            assert!(world.tick(&throttle).is_empty());
            assert!(same.tick_recorded(&throttle, &world).is_empty());
            braked.tick_recorded(&Control { brake_pct: 100.0, ..Control::default() }, &world);
            assert_eq!(bits(&same), bits(&world));
        }
        assert_eq!(braked.ego().speed_mps, 0.0);
        assert_eq!(braked.obstacles()[0].outline, world.obstacles()[0].outline);
        assert!(braked.obstacles()[0].distance_m > world.obstacles()[0].distance_m + 20.0);
    }
}
