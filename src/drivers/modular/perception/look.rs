//! A look around: which objects are detected in a frame (10 Hz), and how well.
//!
//! LiDAR and camera detect an object together with a chance that falls with distance and with what hides it; far
//! away by day the camera alone does. Near by, returns are plenty and misses rare. Misses come in runs, not one
//! by one: a chain of two states in which the share of misses is one minus that chance. Each object has a
//! separate random stream, so that a change of one object does not change the luck of the others. A large vehicle
//! is at times taken for its near part alone, and for runs of frames for two vehicles. Left out: confusion of
//! classes beside that, and headings turned round.

use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::{Conditions, FRAME_S, Sensed, SensedObject};

use super::super::config::PerceptionConfig;
use super::detection::Detection;
use super::ghosts::Ghosts;
use super::ranges::Ranges;

#[derive(Debug, Clone)]
pub struct Perception {
    config: PerceptionConfig,
    /// `late_unstable_tracks`: the detector's grid, occlusion, flicker.
    limited: bool,
    seed: u64,
    frame: u64,
    /// Ranges in the last conditions, kept because weather changes seldom.
    ranges: Option<(Conditions, Ranges)>,
    watched: Vec<Watched>,
    ghosts: Ghosts,
    detections: Vec<Detection>,
}

/// An object within reach of the sensors, with its luck so far.
#[derive(Debug, Clone)]
struct Watched {
    id: u32,
    rng: Rng,
    /// Whether it has been detected at all, and whether it was missed in the last frame.
    seen: bool,
    missed: bool,
    /// Whether it is detected as two vehicles now.
    split: bool,
    size_factor: f64,
    frame: u64,
}

impl Perception {
    pub fn new(config: &PerceptionConfig, limited: bool, seed: u64) -> Perception {
        Perception {
            config: *config,
            limited,
            seed,
            frame: 0,
            ranges: None,
            watched: Vec::new(),
            ghosts: Ghosts::new(seed),
            detections: Vec::new(),
        }
    }

    /// One frame. `localized` is where the vehicle believes its rear axle is: objects are measured
    /// from the vehicle and placed on the map from there.
    pub fn look(&mut self, sensed: &Sensed, localized: &Pose) -> &[Detection] {
        self.frame += 1;
        self.detections.clear();
        if self.config.perfect {
            let exact = |object| exactly(object, sensed, localized);
            self.detections.extend(sensed.objects.iter().map(exact));
            return &self.detections;
        }
        let ranges = self.ranges_in(&sensed.conditions);
        for object in &sensed.objects {
            let index = self.watch(object.id);
            let known = !self.watched[index].missed;
            let detection_chance = self.detection_chance(&ranges, object, known);
            let large =
                self.limited && object.length_m > self.config.large_vehicle_m && object.body.is_vehicle();
            let watched = &mut self.watched[index];
            watched.draw(detection_chance, self.config.miss_run_s);
            if watched.missed {
                continue;
            }
            if large {
                watched.draw_split(&self.config);
            }
            let noise: [f64; 3] = core::array::from_fn(|_| rng::normal(&mut watched.rng));
            let flickers = large && (self.frame + u64::from(object.id)).is_multiple_of(2);
            let detection =
                measure(&self.config, object, watched, flickers || watched.split, sensed, localized, &noise);
            if watched.split {
                self.detections.extend(parts(object, &detection));
            } else {
                self.detections.push(detection);
            }
        }
        let frame = self.frame;
        self.watched.retain(|watched| watched.frame == frame);
        self.ghosts.haunt(&self.config, &sensed.conditions, localized, &mut self.detections);
        &self.detections
    }

    fn ranges_in(&mut self, conditions: &Conditions) -> Ranges {
        match self.ranges {
            Some((of, ranges)) if of == *conditions => ranges,
            _ => {
                let ranges = Ranges::in_conditions(&self.config, self.limited, conditions);
                self.ranges = Some((*conditions, ranges));
                ranges
            }
        }
    }

    fn watch(&mut self, id: u32) -> usize {
        let index = self.watched.iter().position(|watched| watched.id == id).unwrap_or_else(|| {
            let mut rng = rng::stream(self.seed, Stream::Perception, u64::from(id));
            let size_factor = 1.0 + self.config.size_sigma * rng::normal(&mut rng).clamp(-3.0, 3.0);
            self.watched.push(Watched {
                id,
                rng,
                seen: false,
                missed: true,
                split: false,
                size_factor,
                frame: 0,
            });
            self.watched.len() - 1
        });
        self.watched[index].frame = self.frame;
        index
    }

    fn detection_chance(&self, ranges: &Ranges, object: &SensedObject, known: bool) -> f64 {
        let config = &self.config;
        let blind = (config.blind_to_pedestrians && !object.body.is_vehicle())
            || (config.blind_to_large_vehicles && object.length_m > config.large_vehicle_m);
        let hidden = self.limited && object.visible_fraction < config.visible_fraction_min;
        if blind || hidden || object.visible_fraction <= 0.0 {
            return 0.0;
        }
        ranges.detection_chance(config, object, known)
    }
}

impl Watched {
    /// Whether the next frame sees one large vehicle or two: a chain of two states, as for misses.
    fn draw_split(&mut self, config: &PerceptionConfig) {
        let luck = rng::unit(&mut self.rng);
        let ends = (FRAME_S / config.split_run_s).min(1.0);
        let begins = ends * config.split_share / (1.0 - config.split_share);
        self.split = if self.split { luck >= ends } else { luck < begins };
    }

    /// The next state of the chain, whose share of misses is one minus the chance. Before the first
    /// detection there is no run of misses to be in: frames are independent.
    fn draw(&mut self, detection_chance: f64, miss_run_s: f64) {
        let luck = rng::unit(&mut self.rng);
        if !self.seen {
            self.missed = luck >= detection_chance;
            self.seen = !self.missed;
            return;
        }
        if detection_chance <= 0.0 {
            self.missed = true;
            return;
        }
        let odds = (1.0 - detection_chance) / detection_chance;
        // Where misses are the rule, runs of hits get shorter rather than those of misses longer.
        let ends = (FRAME_S / miss_run_s).min(1.0 / odds.max(1e-9)).min(1.0);
        let begins = ends * odds;
        self.missed = if self.missed { luck >= ends } else { luck < begins };
    }
}

/// A large vehicle detected as two: the near part that was measured, which a tracker knows by its near end,
/// and the rest as a separate object.
fn parts(object: &SensedObject, near: &Detection) -> [Detection; 2] {
    let rest_m = (object.length_m - near.length_m).max(1.0);
    let towards = if near.shift_m < 0.0 { -1.0 } else { 1.0 };
    let ahead = unit_vector(near.pose.heading_rad) * (-towards * near.length_m / 2.0);
    let pose = Pose { position: near.pose.position + ahead, ..near.pose };
    [*near, Detection { pose, shift_m: 0.0, length_m: rest_m, ..*near }]
}

/// The object as it is, placed on the map from where the vehicle believes it is.
fn exactly(object: &SensedObject, sensed: &Sensed, localized: &Pose) -> Detection {
    let from_ego = sensed.ego.rear_axle.to_local(object.pose.position);
    let turned_rad = object.pose.heading_rad - sensed.ego.rear_axle.heading_rad;
    let heading_rad = wrap_angle(localized.heading_rad + turned_rad);
    Detection {
        truth: object.id,
        body: object.body,
        pose: Pose { position: localized.to_world(from_ego), heading_rad },
        shift_m: 0.0,
        length_m: object.length_m,
        width_m: object.width_m,
        height_m: object.height_m,
        sigma_m: 1e-3,
        true_velocity_mps: object.velocity_mps,
        true_heading_rad: heading_rad,
    }
}

fn measure(
    config: &PerceptionConfig,
    object: &SensedObject,
    watched: &Watched,
    flickers: bool,
    sensed: &Sensed,
    localized: &Pose,
    noise: &[f64; 3],
) -> Detection {
    let exact = exactly(object, sensed, localized);
    let (body, length_m, shift_m) = if flickers {
        // Only the near part is fitted: its centre lies towards the near end. Trackers measure
        // motion at an anchor that does not move with the size, so only size and class jump.
        let length_m = config.flicker_length_m.min(object.length_m);
        let forward = unit_vector(object.pose.heading_rad);
        let ahead_m = (sensed.ego.rear_axle.position - object.pose.position).dot(&forward);
        let room_m = (object.length_m - length_m) / 2.0;
        (Body::SUV, length_m, ahead_m.clamp(-room_m, room_m))
    } else {
        (object.body, object.length_m, 0.0)
    };
    let sigma_m = config.position_sigma_m + config.position_sigma_per_m * object.distance_m;
    Detection {
        body,
        pose: Pose {
            position: exact.pose.position + Vec2::new(noise[0], noise[1]) * sigma_m,
            heading_rad: wrap_angle(exact.pose.heading_rad + noise[2] * config.heading_sigma_rad),
        },
        shift_m,
        length_m: length_m * watched.size_factor,
        width_m: object.width_m * watched.size_factor,
        height_m: object.height_m * watched.size_factor,
        sigma_m: sigma_m.max(1e-3),
        ..exact
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use crate::testing::object;

    fn sensed(object: SensedObject) -> Sensed {
        testing::sensed(Pose::new(0.0, 0.0, 0.0), 0.0, vec![object])
    }

    fn at(body: Body, distance_m: f64) -> SensedObject {
        SensedObject { distance_m, ..object(1, body, Pose::new(distance_m + 4.0, 0.0, 0.0), 0.0) }
    }

    /// Detections in 400 frames.
    fn seen(config: &PerceptionConfig, limited: bool, object: SensedObject) -> Vec<Detection> {
        let config = PerceptionConfig { ghosts_per_s: 0.0, ..*config };
        let mut perception = Perception::new(&config, limited, 3);
        let sensed = sensed(object);
        (0..400).flat_map(|_| perception.look(&sensed, &sensed.ego.rear_axle).to_vec()).collect()
    }

    fn count(config: &PerceptionConfig, limited: bool, object: SensedObject) -> usize {
        seen(config, limited, object).len()
    }

    #[test]
    fn unstable_perception_hides_what_is_mostly_hidden_and_ends_with_the_grid() {
        let config = PerceptionConfig { camera_alone_light: 1.0, ..PerceptionConfig::default() };
        let night = |object| SensedObject { visible_fraction: 0.15, ..object };
        assert_eq!(count(&config, true, night(at(Body::Sedan, 20.0))), 0);
        assert!(count(&config, false, night(at(Body::Sedan, 20.0))) > 20);
        assert!(
            count(&config, true, at(Body::Pedestrian, 50.0))
                < count(&config, false, at(Body::Pedestrian, 50.0))
        );
        // An object of which nothing is in sight is never seen, weakness or not.
        let gone = SensedObject { visible_fraction: 0.0, ..at(Body::Sedan, 20.0) };
        assert_eq!(count(&config, false, gone), 0);
    }

    #[test]
    fn unstable_perception_lets_a_bus_flicker_in_size_and_class() {
        let config = PerceptionConfig::default();
        let bus = at(Body::SchoolBus, 20.0);
        let cars = |limited| seen(&config, limited, bus).iter().filter(|d| d.body == Body::SUV).count();
        assert!(cars(true) > 150, "{}", cars(true));
        assert_eq!(cars(false), 0);
        let car = seen(&config, true, bus).into_iter().find(|d| d.body == Body::SUV).unwrap();
        assert!(car.length_m < 6.0 && car.shift_m < -3.0, "{car:?}");
    }

    #[test]
    fn a_bus_is_at_times_detected_as_two() {
        let config = PerceptionConfig { split_share: 0.3, ..PerceptionConfig::default() };
        let bus = at(Body::SchoolBus, 20.0);
        let mut perception = Perception::new(&config, true, 3);
        let sensed = sensed(bus);
        let (mut twice, frames) = (0, 2000);
        for _ in 0..frames {
            let found = perception.look(&sensed, &sensed.ego.rear_axle);
            if let [near, far] = found {
                twice += 1;
                assert_eq!(near.truth, far.truth);
                // Together they are as long as the bus, bumper to bumper.
                let apart_m = far.pose.position.x - (near.pose.position.x + near.shift_m);
                assert!((apart_m - bus.length_m / 2.0).abs() < 0.7, "{apart_m}");
            }
        }
        let share = f64::from(twice) / f64::from(frames);
        assert!((share - 0.3).abs() < 0.12, "{share}");
        assert!(seen(&PerceptionConfig { split_share: 0.9, ..config }, false, bus).len() <= 400);
    }

    #[test]
    fn misses_have_their_share_and_their_runs() {
        for (miss_run_s, mean_low, mean_high) in [(0.1, 0.9, 1.2), (0.4, 3.0, 5.0)] {
            let config = PerceptionConfig {
                detection_chance_max: 0.9,
                plenty_m: 0.0,
                miss_run_s,
                ghosts_per_s: 0.0,
                ..PerceptionConfig::default()
            };
            let mut perception = Perception::new(&config, true, 5);
            let sensed = sensed(at(Body::Sedan, 5.0));
            let (mut misses, mut runs, mut before) = (0_u32, 0_u32, true);
            for _ in 0..20_000 {
                let found = !perception.look(&sensed, &sensed.ego.rear_axle).is_empty();
                misses += u32::from(!found);
                runs += u32::from(!found && before);
                before = found;
            }
            let (share, mean) = (f64::from(misses) / 20_000.0, f64::from(misses) / f64::from(runs));
            assert!((share - 0.1).abs() < 0.03, "{share}");
            assert!((mean_low..mean_high).contains(&mean), "{mean}");
        }
    }

    #[test]
    fn near_by_misses_are_rare_unless_a_fault_says_otherwise() {
        let misses = |plenty_m: f64, distance_m: f64| {
            let config =
                PerceptionConfig { detection_chance_max: 0.9, plenty_m, ..PerceptionConfig::default() };
            let frames = 50;
            let of_seed = |seed: u64| {
                let config = PerceptionConfig { ghosts_per_s: 0.0, ..config };
                let mut perception = Perception::new(&config, true, seed);
                let sensed = sensed(at(Body::Sedan, distance_m));
                let found = |_: &u32| perception.look(&sensed, &sensed.ego.rear_axle).is_empty();
                (0..frames).filter(found).count()
            };
            (0..200).map(of_seed).sum::<usize>() as f64 / (200.0 * f64::from(frames))
        };
        let (at_4_m, at_15_m, at_30_m) = (misses(30.0, 4.0), misses(30.0, 15.0), misses(30.0, 30.0));
        assert!(
            at_4_m < 0.005 && (0.01..0.05).contains(&at_15_m) && at_30_m > 0.06,
            "{at_4_m} {at_15_m} {at_30_m}"
        );
        assert!(misses(0.0, 4.0) > 0.06);
    }

    #[test]
    fn perfection_sees_through_walls() {
        let perfect = PerceptionConfig { perfect: true, ..PerceptionConfig::default() };
        let hidden = SensedObject { visible_fraction: 0.0, ..at(Body::SchoolBus, 100.0) };
        let found = seen(&perfect, true, hidden);
        assert_eq!(found.len(), 400);
        assert!(found.iter().all(|d| d.pose == hidden.pose && d.length_m == hidden.length_m));
    }
}
