//! Evasive manoeuvres: from the first moment one pedal and one place beside the route, whatever
//! happens. The best of them bounds what any driver could have done.
//!
//! They are tried out against a recording, so they perceive nothing. The common lateral controller steers,
//! which is quick but not as quick as the tyres allow; a collision that none of them avoids could still be
//! avoided by a stunt.

use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::{Guide, Helm, SpeedRules, Steering};
use crate::status::{Reason, Status};
use avastra_world::sim::{Control, Scene, Sensed};

/// Pedals of the manoeuvres: full brake, half of it, none, full throttle.
const PEDALS: [Pedal; 4] = [Pedal::FullBrake, Pedal::Gentle(-3.0), Pedal::Gentle(0.0), Pedal::Gentle(2.0)];
/// Places beside the route that are steered for, m to the left.
const OFFSETS_M: [f64; 9] = [0.0, 0.6, -0.6, 1.2, -1.2, 2.0, -2.0, 3.5, -3.5];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Pedal {
    FullBrake,
    /// An acceleration, m/s².
    Gentle(f64),
}

/// One manoeuvre.
#[derive(Debug, Clone)]
pub struct Evasion {
    guide: Arc<Guide>,
    steering: Arc<Steering>,
    pedal: Pedal,
    offset_m: f64,
    helm: Helm,
    status: Status,
}

impl Evasion {
    /// Every manoeuvre on a route, full braking in the lane first.
    pub fn all(scene: &Scene) -> impl Iterator<Item = Evasion> {
        let (guide, steering) = (Arc::new(Guide::new(scene, &SpeedRules::NONE)), Steering::usual());
        OFFSETS_M.into_iter().flat_map(move |offset_m| {
            let (guide, steering) = (Arc::clone(&guide), Arc::clone(&steering));
            PEDALS.into_iter().map(move |pedal| Evasion {
                guide: Arc::clone(&guide),
                steering: Arc::clone(&steering),
                pedal,
                offset_m,
                helm: Helm::default(),
                status: Status { reason: Reason::Fallback, ..Status::default() },
            })
        })
    }

    /// The evasion in words.
    pub fn describe(&self) -> String {
        let pedal = match self.pedal {
            Pedal::FullBrake => "full brake".to_owned(),
            Pedal::Gentle(acceleration_mps2) => format!("{acceleration_mps2:+.1} m/s²"),
        };
        if self.offset_m == 0.0 { pedal } else { format!("{pedal}, {:+.1} m aside", self.offset_m) }
    }
}

impl Ads for Evasion {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let rear_axle = &sensed.ego.rear_axle;
        let station_m = self.helm.locate(&self.guide, rear_axle.position).station_m;
        // To steer for a place beside the route is to steer for the route from the other side of it.
        let as_if = rear_axle.offset(0.0, -self.offset_m);
        let steer_rad = self.steering.steer_rad(&self.guide, &as_if, station_m, &sensed.ego);
        let control = match self.pedal {
            Pedal::FullBrake => Control { throttle_pct: 0.0, brake_pct: 100.0, steer_rad },
            Pedal::Gentle(acceleration_mps2) => Control::towards(acceleration_mps2, steer_rad),
        };
        self.status.localized = Some(*rear_axle);
        self.status.control = control;
        control
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
