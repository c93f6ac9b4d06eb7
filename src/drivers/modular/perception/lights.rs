//! The colours of traffic lights, as far as they can be read.
//!
//! A light is read within the camera's range and the meteorological optical range, where no tall vehicle
//! stands in the line of sight from the roof to the lamp. The colour last read is held for a while after the
//! light goes out of sight. A colour that is read is right: the facts at hand give no rate of confusion. Backlight
//! is left out because the world has no azimuth of the sun; darkness costs nothing because lamps shine.

use std::sync::Arc;

use avastra_base::geometry::{Frame, OrientedBox, Vec2};
use avastra_world::sim::{FRAME_S, Scene, Sensed, SensedObject, SignalColour, VehicleParameters};

use super::super::config::PerceptionConfig;
use super::ranges::sight_m;

/// Height of the camera and of the lamps, m. Ours: roof of the vehicle, arm over the lane.
const EYE_M: f64 = 1.6;
const LAMP_M: f64 = 5.0;
/// Lines farther behind the rear axle are not looked for, m.
const BEHIND_M: f64 = 5.0;

#[derive(Debug, Clone)]
pub struct LightReader {
    config: PerceptionConfig,
    scene: Arc<Scene>,
    /// For each stop line of the route: the colour last read and how long ago, s.
    read: Vec<(SignalColour, f64)>,
    /// The colours known now, by stop line; `None` is not known.
    known: Vec<Option<SignalColour>>,
}

impl LightReader {
    pub fn new(config: &PerceptionConfig, scene: &Arc<Scene>) -> LightReader {
        let lines = scene.route.stop_lines.len();
        LightReader {
            config: *config,
            scene: Arc::clone(scene),
            read: vec![(SignalColour::Red, f64::INFINITY); lines],
            known: vec![None; lines],
        }
    }

    /// One frame: the colour of the light of each stop line of the route, in their order.
    pub fn look(&mut self, sensed: &Sensed, station_m: f64) -> &[Option<SignalColour>] {
        let range_m = (self.config.light_range_m * self.config.range_factor).min(sight_m(&sensed.conditions));
        let eye = sensed.ego.rear_axle.offset(VehicleParameters::MKZ.rear_axle_to_centre_m(), 0.0).position;
        for (index, line) in self.scene.route.stop_lines.iter().enumerate() {
            let (colour, age_s) = &mut self.read[index];
            *age_s += FRAME_S;
            // Lights far off and lights passed cost no line of sight.
            let ahead_m = line.station_m - station_m;
            if (-BEHIND_M..range_m + BEHIND_M).contains(&ahead_m) {
                let lamp = self.scene.map.signals[line.signal].position;
                let distance_m = (lamp - eye).norm();
                let hidden = || sensed.objects.iter().any(|object| hides(object, eye, lamp, distance_m));
                if self.config.perfect || (distance_m <= range_m && !hidden()) {
                    (*colour, *age_s) = (sensed.signals[line.signal], 0.0);
                }
            }
            self.known[index] = (*age_s <= self.config.light_memory_s + 1e-9).then_some(*colour);
        }
        &self.known
    }
}

/// Whether an object stands tall enough in the line of sight to a lamp.
fn hides(object: &SensedObject, eye: Vec2, lamp: Vec2, distance_m: f64) -> bool {
    if object.height_m <= EYE_M || distance_m < 1e-6 {
        return false;
    }
    let outline = OrientedBox::new(object.pose, object.length_m, object.width_m);
    let direction = (lamp - eye) / distance_m;
    let hit_m = Frame::of(&outline).ray_hit_m(eye, direction, distance_m);
    hit_m.is_some_and(|hit_m| EYE_M + (LAMP_M - EYE_M) * hit_m / distance_m < object.height_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CLEAR_DAY, corner, object, sensed};
    use avastra_lang::model::vocabulary::Body;
    use avastra_world::sim::Conditions;

    /// The known colour of the corner's first light from `before_m` before its line.
    fn read(
        reader: &mut LightReader,
        before_m: f64,
        conditions: Conditions,
        truck_m: Option<f64>,
    ) -> Option<SignalColour> {
        let scene = Arc::clone(&reader.scene);
        let line = scene.route.stop_lines[0];
        let station_m = line.station_m - before_m;
        let rear_axle = scene.route.path.pose_at(station_m);
        let lamp = scene.map.signals[line.signal].position;
        let objects = truck_m.map(|away_m| {
            let mut pose = rear_axle;
            pose.position += (lamp - rear_axle.position).normalize() * away_m;
            object(1, Body::BoxTruck, pose, 0.0)
        });
        let signals = vec![SignalColour::Green; scene.map.signals.len()];
        let around = sensed(rear_axle, 0.0, objects.into_iter().collect());
        let sensed = Sensed { signals, conditions, ..around };
        reader.look(&sensed, station_m)[0]
    }

    fn reader() -> LightReader {
        LightReader::new(&PerceptionConfig::default(), &corner())
    }

    #[test]
    fn fog_and_trucks_hide_a_light_and_memory_bridges_a_moment() {
        let green = Some(SignalColour::Green);
        assert_eq!(read(&mut reader(), 30.0, CLEAR_DAY, None), green);
        let fog = Conditions { visibility_m: 20.0, ..CLEAR_DAY };
        assert_eq!(read(&mut reader(), 30.0, fog, None), None);
        let mut reader = reader();
        assert_eq!(read(&mut reader, 30.0, CLEAR_DAY, Some(12.0)), None);
        assert_eq!(read(&mut reader, 30.0, CLEAR_DAY, None), green);
        for frame in 1..=20 {
            let known = read(&mut reader, 30.0, CLEAR_DAY, Some(12.0));
            assert_eq!(known.is_some(), frame <= 15, "frame {frame}");
        }
    }
}
