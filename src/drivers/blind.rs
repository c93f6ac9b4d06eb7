//! Keeps its lane and its speed, and sees nothing: the most trivial driving system.
//!
//! It follows the route with its lane changes at the speed that it is allowed and wants, slows down for bends, and minds
//! neither road users nor lights nor signs. It shows whether a protocol asks for anything: if this driver passes the
//! protocol's rows, they demand nothing.

use std::sync::Arc;

use avastra_world::sim::{Control, Scene, Sensed};

use crate::driver::Ads;
use crate::kit::{Guide, Helm, SpeedRules, Steering, held_mps2, speed_mps2};
use crate::status::{Reason, Status};

/// The driver.
#[derive(Debug, Clone)]
pub struct Blind {
    guide: Guide,
    steering: Arc<Steering>,
    helm: Helm,
    status: Status,
}

impl Blind {
    pub fn new(scene: &Scene) -> Blind {
        let guide = Guide::new(scene, &SpeedRules::on(scene));
        let (helm, status) = (Helm::default(), Status { reason: Reason::Cruise, ..Status::default() });
        Blind { guide, steering: Steering::usual(), helm, status }
    }
}

impl Ads for Blind {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let (ego, pose) = (&sensed.ego, sensed.ego.rear_axle);
        let station_m = self.helm.locate(&self.guide, pose.position).station_m;
        let wanted_mps = self.guide.allowed_mps(station_m, ego.speed_mps);
        let acceleration_mps2 = held_mps2(ego.speed_mps, speed_mps2(ego.speed_mps, wanted_mps), 0.0);
        let steer_rad = self.steering.steer_rad(&self.guide, &pose, station_m, ego);
        self.status.localized = Some(pose);
        self.helm.command(Control::towards(acceleration_mps2, steer_rad), ego, &mut self.status)
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
