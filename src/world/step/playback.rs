//! A world with another ego vehicle: everything else moves as it did in a recording, tick by tick,
//! whatever the ego vehicle does now.
//!
//! A recording is the worlds after each tick, in order. Impacts and priority are left out: a playback tells
//! whether there is a contact, not what comes of it.

use crate::state::contact::Contact;
use crate::state::ego::Ego;
use crate::state::road_user::RoadUser;
use crate::state::sensed::EgoMotion;
use crate::state::time::{DT_S, FRAME_TICKS};
use crate::state::world::World;
use crate::step::contact::{Party, meet};
use crate::step::ego::Control;
use avastra_base::geometry::{OrientedBox, Sweep};
use avastra_road::is_apart;

impl World {
    /// Advances by [`DT_S`]: the ego vehicle by its command, everything else to where it is in
    /// `recorded`, the recorded world one tick later. Returns the contacts of this tick; one that lasts
    /// is returned again in every tick.
    pub fn tick_recorded(&mut self, control: &Control, recorded: &World) -> &[Contact] {
        let friction = self.conditions.friction;
        self.play(|ego| ego.step(control, friction, DT_S), recorded)
    }

    /// As [`World::tick_recorded`], with an ego vehicle that moves as `motion` says, whatever moves it.
    pub fn tick_placed(&mut self, motion: EgoMotion, recorded: &World) -> &[Contact] {
        self.play(|ego| ego.place(motion), recorded)
    }

    fn play(&mut self, move_ego: impl FnOnce(&mut Ego), recorded: &World) -> &[Contact] {
        let before: Vec<(u32, OrientedBox)> =
            self.obstacles().map(|obstacle| (obstacle.id, obstacle.outline)).collect();
        let ego_before = self.ego.outline;
        move_ego(&mut self.ego);
        self.follow_route();
        *self = World {
            ego: self.ego.clone(),
            ego_station_m: self.ego_station_m,
            ego_offset_m: self.ego_offset_m,
            ego_elevation_m: self.ego_elevation_m,
            red_runs: self.red_runs,
            ego_passed: self.ego_passed,
            pushed_until: self.pushed_until,
            contacts: Vec::new(),
            ..recorded.clone()
        };
        self.measure();
        let ego_mps = self.ego.motion.speed_mps;
        let ego = Party {
            sweep: Sweep { start: ego_before, end: self.ego.outline.pose },
            velocity_mps: self.ego.velocity_mps(),
        };
        for RoadUser { obstacle, mover } in &self.users {
            if mover.touched || is_apart(self.ego_elevation_m, obstacle.elevation_m) {
                continue;
            }
            // An obstacle that was not there a tick ago has not come from anywhere.
            let known = before.iter().find(|(id, _)| *id == obstacle.id);
            let start = known.map_or(obstacle.outline, |(_, outline)| *outline);
            let other = Party {
                sweep: mover.sweep(start, obstacle.outline.pose),
                velocity_mps: obstacle.velocity_mps,
            };
            let tick = recorded.ticks - 1;
            let met = meet(&ego, ego_mps, &other, obstacle.id, tick);
            self.contacts.extend(met.map(|(contact, _)| contact));
        }
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.look();
        }
        &self.contacts
    }
}

#[cfg(test)]
mod tests {
    use crate::action::Effect;
    use crate::sim::testing;
    use avastra_lang::model::vocabulary::Verb;

    use super::*;

    #[test]
    fn the_same_commands_give_the_recording_again_and_others_another_ego_vehicle() {
        let mut world = testing::world(&testing::straight());
        let request = testing::request(Verb::DriveAhead, 30.0, 6.0);
        world.apply(&Effect::Spawn(request)).expect("there is room");
        let (mut same, mut braked) = (world.clone(), world.clone());
        let throttle = Control { throttle_pct: 40.0, ..Control::default() };
        for _ in 0..200 {
            assert!(world.tick(&throttle).is_empty());
            assert!(same.tick_recorded(&throttle, &world).is_empty());
            braked.tick_recorded(&Control { brake_pct: 100.0, ..Control::default() }, &world);
            assert_eq!(testing::digest(&same), testing::digest(&world));
        }
        assert_eq!(braked.ego().speed_mps, 0.0);
        let first = |world: &World| *world.obstacles().next().expect("it drives on");
        assert_eq!(first(&braked).outline, first(&world).outline);
        assert!(first(&braked).distance_m > first(&world).distance_m + 20.0);
    }
}
