//! A driving system that is told something else than what is so, or whose commands are carried out in another way.
//!
//! It is changed from a moment on, so that it meets the same hazard up to there. Any driving system can be changed, because nothing in
//! it is touched: only what it is told, and what becomes of its commands. Two uses follow. A *planted fault* is a change for good. A
//! *swap* is a change that shows what a failure hangs on (`oracle::swaps` of the crate `campaign`).

use std::collections::VecDeque;

use avastra_base::geometry::{OrientedBox, Pose, Vec2, distance_m, unit_vector, wrap_angle};
use avastra_lang::model::vocabulary::{Body, ShownLights};
use avastra_world::sim::{
    Control, DT_S, Sensed, SensedObject, SignalColour, VehicleParameters, pedal_acceleration_mps2,
};

use super::driver::Ads;
use super::external::{Conversation, Failure};
use super::status::Status;

/// The number of an object that is not there.
const PHANTOM_ID: u32 = 0x7FFF_0000;

/// A change of what a driving system is told, or of what becomes of its commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alteration {
    /// It is not told of one road user, by number.
    Without(u32),
    /// It is not told of pedestrians and cyclists.
    WithoutPeople,
    /// It is not told of anybody.
    WithoutAll,
    /// It is told that everybody stands.
    Standing,
    /// It is told that every light shows this.
    Lights(SignalColour),
    /// It is told what will be so long after, s, if others go straight on and it keeps its own turn. It makes up for a delay.
    Ahead(f64),
    /// It is told of others and of lights what was so long before, s.
    Late(f64),
    /// Others are told this many times as far from its front as they are.
    Distances(f64),
    /// Others are told wider and longer by so much on each side, m.
    Larger(f64),
    /// Left and right are exchanged.
    Mirrored,
    /// It is told of a road user that is not there, always at the same place.
    Phantom(SensedObject),
    /// Its commands are carried out so long after, s; until then, the first one holds.
    Delayed(f64),
    /// The brake acts this many times as strongly as it asks, as far as the vehicle can.
    Braking(f64),
    /// The wheels turn this much more to the left than it asks, rad.
    Steering(f64),
    /// A program of the user's is told the truth, where its profile has it told what is perceived. Others are not changed.
    Truth,
    /// A program of the user's is obeyed at once, without the latency of its profile. Others are not changed.
    Prompt,
}

impl Alteration {
    /// Changes what is told. `Late` needs the past, and changes nothing here.
    pub fn tell(&self, sensed: &mut Sensed) {
        let ego = sensed.ego;
        match *self {
            Alteration::Without(id) => sensed.objects.retain(|object| object.id != id),
            Alteration::WithoutPeople => {
                sensed.objects.retain(|object| !matches!(object.body, Body::Pedestrian | Body::Bicycle));
            }
            Alteration::WithoutAll => sensed.objects.clear(),
            Alteration::Standing => sensed.objects.iter_mut().for_each(|object| {
                object.velocity_mps = Vec2::zeros();
            }),
            Alteration::Lights(colour) => sensed.signals.fill(colour),
            Alteration::Ahead(by_s) => {
                let turned_rad = ego.yaw_rate_radps * by_s;
                let rear_axle = &mut sensed.ego.rear_axle;
                rear_axle.position +=
                    unit_vector(rear_axle.heading_rad + turned_rad / 2.0) * (ego.speed_mps * by_s);
                rear_axle.heading_rad = wrap_angle(rear_axle.heading_rad + turned_rad);
                sensed
                    .objects
                    .iter_mut()
                    .for_each(|object| object.pose.position += object.velocity_mps * by_s);
                measure(sensed);
            }
            Alteration::Distances(by) => {
                let front = ego.rear_axle.offset(VehicleParameters::MKZ.rear_axle_to_front_m, 0.0).position;
                for object in &mut sensed.objects {
                    object.pose.position = front + (object.pose.position - front) * by;
                }
                measure(sensed);
            }
            Alteration::Larger(by_m) => {
                for object in &mut sensed.objects {
                    object.length_m = (object.length_m + 2.0 * by_m).max(0.2);
                    object.width_m = (object.width_m + 2.0 * by_m).max(0.2);
                }
                measure(sensed);
            }
            Alteration::Mirrored => {
                let turn = |local: Vec2| Vec2::new(local.x, -local.y);
                let axis = Pose { position: Vec2::zeros(), ..ego.rear_axle };
                for object in &mut sensed.objects {
                    let place = turn(ego.rear_axle.to_local(object.pose.position));
                    object.pose.position = ego.rear_axle.to_world(place);
                    object.pose.heading_rad =
                        wrap_angle(2.0 * ego.rear_axle.heading_rad - object.pose.heading_rad);
                    object.velocity_mps = axis.to_world(turn(axis.to_local(object.velocity_mps)));
                    object.lights = match object.lights {
                        ShownLights::Left => ShownLights::Right,
                        ShownLights::Right => ShownLights::Left,
                        other => other,
                    };
                }
            }
            Alteration::Phantom(object) => {
                sensed.objects.push(SensedObject { id: PHANTOM_ID, ..object });
                measure(sensed);
            }
            Alteration::Late(_)
            | Alteration::Delayed(_)
            | Alteration::Braking(_)
            | Alteration::Steering(_)
            | Alteration::Truth
            | Alteration::Prompt => {}
        }
    }

    /// What becomes of a command. `Delayed` needs the past, and changes nothing here.
    fn carry_out(&self, asked: Control) -> Control {
        match *self {
            Alteration::Braking(by) => {
                let wanted_mps2 = pedal_acceleration_mps2(asked.throttle_pct, asked.brake_pct);
                if wanted_mps2 < 0.0 { Control::towards(wanted_mps2 * by, asked.steer_rad) } else { asked }
            }
            Alteration::Steering(by_rad) => Control { steer_rad: asked.steer_rad + by_rad, ..asked },
            _ => asked,
        }
    }
}

/// Distances between the outlines as they are told.
fn measure(sensed: &mut Sensed) {
    let car = VehicleParameters::MKZ;
    let centre = sensed.ego.rear_axle.offset(car.rear_axle_to_centre_m(), 0.0);
    let own = OrientedBox::new(centre, car.length_m, car.width_m);
    for object in &mut sensed.objects {
        object.distance_m = distance_m(&own, &OrientedBox::new(object.pose, object.length_m, object.width_m));
    }
}

/// A driving system behind a change.
#[derive(Clone)]
pub struct Altered {
    ads: Box<dyn Ads>,
    alteration: Alteration,
    /// From when on it is changed, s since the start of the episode.
    from_s: f64,
    /// What it was not yet told, and commands that were not yet carried out; the oldest first.
    told: VecDeque<Sensed>,
    asked: VecDeque<Control>,
}

impl Altered {
    pub fn new(ads: Box<dyn Ads>, alteration: Alteration, from_s: f64) -> Altered {
        Altered { ads, alteration, from_s, told: VecDeque::new(), asked: VecDeque::new() }
    }
}

impl Ads for Altered {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        // Times are sums of ticks: the least bit must not decide.
        if sensed.time_s < self.from_s - 1e-6 {
            return self.ads.drive(sensed);
        }
        let ticks = |by_s: f64| (by_s / DT_S).round() as usize;
        let asked = match self.alteration {
            Alteration::Late(by_s) => {
                self.told.push_back(sensed.clone());
                let is_due = self.told.len() > ticks(by_s);
                let past = if is_due { self.told.pop_front() } else { self.told.front().cloned() };
                let past = past.expect("one was just added");
                // Clock and own motion go on: only the picture of the others and of the lights is old.
                self.ads.drive(&Sensed { time_s: sensed.time_s, ego: sensed.ego, ..past })
            }
            _ => {
                let mut told = sensed.clone();
                self.alteration.tell(&mut told);
                self.ads.drive(&told)
            }
        };
        let Alteration::Delayed(by_s) = self.alteration else { return self.alteration.carry_out(asked) };
        self.asked.push_back(asked);
        let due = if self.asked.len() > ticks(by_s) { self.asked.pop_front() } else { None };
        due.unwrap_or_else(|| self.asked[0])
    }

    fn status(&self) -> &Status {
        self.ads.status()
    }

    fn braking_mps2(&self) -> f64 {
        self.ads.braking_mps2()
    }

    fn take_over(&mut self, sensed: &Sensed) {
        self.ads.take_over(sensed);
    }

    fn failure(&self) -> Option<&Failure> {
        self.ads.failure()
    }

    fn conversation(&self) -> Option<Conversation> {
        self.ads.conversation()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{object, sensed};

    #[test]
    fn what_is_mirrored_twice_is_as_it_was() {
        let other = object(3, Body::Sedan, Pose::new(9.0, 4.0, 0.3), 7.0);
        let sensed = sensed(Pose::new(1.0, 2.0, 0.5), 8.0, vec![other]);
        let mut told = sensed.clone();
        Alteration::Mirrored.tell(&mut told);
        assert!((told.objects[0].pose.position - other.pose.position).norm() > 1.0);
        Alteration::Mirrored.tell(&mut told);
        let twice = told.objects[0];
        assert!((twice.pose.position - other.pose.position).norm() < 1e-9);
        assert!((twice.velocity_mps - other.velocity_mps).norm() < 1e-9);
    }
}
