//! Emergency braking: the last line, independent of prediction and planning.
//!
//! It takes the published tracks, the motion of the ego vehicle and the path to be driven, extrapolates both
//! at constant speed along that path, and brakes when a contact of the front is so near that comfortable
//! braking no longer prevents it. It never does less than control asks. Limits are those of UN R152 and of
//! Euro NCAP's tests; there is no warning, because no driver is there to be warned. After a contact the vehicle
//! is braked to rest and stays there. Left out: steering,
//! junction assistance that guesses at turns of others, and braking for what will strike from the side or
//! from behind.

use crate::kit::Guide;
use avastra_base::geometry::extent_m;
use avastra_world::sim::{
    Control, DT_S, EgoMotion, FRAME_S, VehicleParameters, pedal_acceleration_mps2, pedals_for,
};

use super::config::EmergencyConfig;
use super::planning::LateralPlan;
use super::tracking::Track;

/// Contacts farther ahead in time are of no interest, s.
const HORIZON_S: f64 = 3.0;
/// Part of the vehicle's half width that a contact must reach into, m: what is only grazed is left to the
/// planner, which passes standing vehicles at 0.4 m. Ours; tests begin at an overlap of a quarter.
const OVERLAP_M: f64 = 0.25;
/// A road user that enters the path from the side is braked for only if the vehicle's front would hit it: at most this
/// far behind the front, m.
const FLANK_M: f64 = 1.5;
/// Time until a command has become braking: the next frame and the brake's own lag, s.
const RESPONSE_S: f64 = 0.25;
/// Braking ends when the threat has been gone for so long, s, or at this speed, m/s. Ours.
const RELEASE_S: f64 = 0.3;
const STOPPED_MPS: f64 = 0.05;

#[derive(Debug, Clone)]
pub struct Emergency {
    config: EmergencyConfig,
    /// For how long the present threat has been seen, s; and what it demands.
    seen_s: f64,
    demand: Option<Threat>,
    /// Since the last threat, s.
    clear_s: f64,
    /// The braking that is commanded now, magnitude, m/s².
    braking_mps2: f64,
}

/// A contact to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threat {
    pub id: u32,
    /// Time to collision at constant speeds, s.
    pub contact_s: f64,
    /// Braking that just avoids it, from when it works, m/s².
    pub needed_mps2: f64,
}

impl Emergency {
    pub fn new(config: &EmergencyConfig) -> Emergency {
        Emergency { config: *config, seen_s: 0.0, demand: None, clear_s: f64::INFINITY, braking_mps2: 0.0 }
    }

    /// The object that is braked for now.
    pub fn braking_for(&self) -> Option<u32> {
        self.demand.filter(|_| self.braking_mps2 > 0.0).map(|threat| threat.id)
    }

    /// One frame: looks for the most pressing threat among tracks that are `age_s` old.
    pub fn look(
        &mut self,
        tracks: &[Track],
        age_s: f64,
        guide: &Guide,
        lateral: &LateralPlan,
        station_m: f64,
        motion: &EgoMotion,
    ) {
        if !self.config.enabled {
            return;
        }
        let speed_mps = motion.speed_mps;
        let braking = self.braking_mps2 > 0.0;
        // Emergency braking is carried through to rest, unless the way becomes free. The slower the vehicle,
        // the later it would get there, and that is no reason to let go.
        let judged_mps = if braking { speed_mps.max(self.config.speed_mps_min) } else { speed_mps };
        let found = tracks
            .iter()
            .filter_map(|track| {
                let least_mps = if track.body.is_vehicle() {
                    self.config.speed_mps_min
                } else {
                    self.config.pedestrian_speed_mps_min
                };
                let acts = braking || (least_mps..=self.config.speed_mps_max).contains(&speed_mps);
                acts.then(|| threat(track, age_s, guide, lateral, station_m, judged_mps)).flatten()
            })
            .filter(|threat| braking || self.asks_mps2(threat) > 0.0)
            .max_by(|a, b| a.needed_mps2.total_cmp(&b.needed_mps2));
        match found {
            Some(threat) => {
                self.seen_s += FRAME_S;
                self.clear_s = 0.0;
                self.demand = Some(threat);
            }
            None => {
                self.clear_s += FRAME_S;
                if self.clear_s >= RELEASE_S - 1e-9 || speed_mps <= STOPPED_MPS {
                    self.seen_s = 0.0;
                    self.demand = None;
                }
            }
        }
    }

    /// The command of control, or harder braking; no harder than `brake_mps2_max`, which the brakes give.
    pub fn brake(&mut self, control: Control, speed_mps: f64, brake_mps2_max: f64) -> Control {
        let due = self.seen_s >= self.config.confirm_s + self.config.delay_s - 1e-9;
        let wanted_mps2 = match self.demand {
            Some(threat) if due && speed_mps > STOPPED_MPS => self.asks_mps2(&threat).max(self.braking_mps2),
            _ => 0.0,
        };
        let change_mps2 = self.config.jerk_mps3 * DT_S;
        self.braking_mps2 = if wanted_mps2 > 0.0 {
            // It builds up from what control already gives.
            let given_mps2 = -pedal_acceleration_mps2(control.throttle_pct, control.brake_pct);
            (self.braking_mps2.max(given_mps2.max(0.0)) + change_mps2).min(wanted_mps2)
        } else {
            0.0
        };
        if self.braking_mps2 <= 0.0 {
            return control;
        }
        let (_, brake_pct) = pedals_for(-self.braking_mps2.min(brake_mps2_max));
        Control { throttle_pct: 0.0, brake_pct: brake_pct.max(control.brake_pct), ..control }
    }

    /// The command after a contact: full braking to rest, and the brake held.
    pub fn after_contact(&self, control: Control, brake_mps2_max: f64) -> Control {
        let (_, brake_pct) = pedals_for(-self.config.full_mps2.min(brake_mps2_max));
        Control { throttle_pct: 0.0, brake_pct: brake_pct.max(control.brake_pct), ..control }
    }

    /// Whether the vehicle stops for good after a contact.
    pub fn stops_after_contact(&self) -> bool {
        self.config.stops_after_contact
    }

    /// The braking that a threat calls for, magnitude, m/s²; 0 if it can be left to the planner.
    fn asks_mps2(&self, threat: &Threat) -> f64 {
        let config = &self.config;
        if threat.contact_s > config.partial_s || threat.needed_mps2 < config.needed_mps2_min {
            0.0
        } else if threat.contact_s <= config.full_s || threat.needed_mps2 >= config.partial_mps2 {
            config.full_mps2
        } else {
            config.partial_mps2
        }
    }
}

/// The contact of the ego vehicle's front with a track, both at constant speed along and across the path.
fn threat(
    track: &Track,
    age_s: f64,
    guide: &Guide,
    lateral: &LateralPlan,
    station_m: f64,
    speed_mps: f64,
) -> Option<Threat> {
    let vehicle = VehicleParameters::MKZ;
    let (front_m, rear_m) = (vehicle.front_m(station_m), vehicle.rear_m(station_m));
    let position = track.centre() + track.velocity_mps * age_s;
    let reach_m = (speed_mps + track.velocity_mps.norm()) * HORIZON_S + track.length_m;
    let beside = guide.project(position, station_m - reach_m, station_m + reach_m);
    let offset_m = beside.offset_m - lateral.aside(beside.station_m).offset_m;
    // Far beside the path the projection may jump; nothing there is near in time.
    if offset_m.abs() > reach_m {
        return None;
    }
    let along = beside.forward;
    let (along_mps, across_mps) = (track.velocity_mps.dot(&along), along.perp(&track.velocity_mps));
    let half_m = (track.length_m / 2.0, track.width_m / 2.0);
    let (half_along_m, half_across_m) = extent_m(track.forward(), along, half_m);
    let overlap_m = if track.body.is_vehicle() { OVERLAP_M } else { 0.0 };
    let half_way_m = vehicle.width_m / 2.0 + half_across_m - overlap_m;
    // When both are at one place across the path, and when along it.
    let abreast_s = within(offset_m, across_mps, half_way_m)?;
    let closing_mps = speed_mps - along_mps;
    let (centre_m, half_m) = ((front_m + rear_m) / 2.0, (front_m - rear_m) / 2.0 + half_along_m);
    let level_s = within(beside.station_m - centre_m, -closing_mps, half_m)?;
    let contact_s = abreast_s.0.max(level_s.0).max(0.0);
    if contact_s > abreast_s.1.min(level_s.1) || contact_s > HORIZON_S || closing_mps <= 0.0 {
        return None;
    }
    let gap_m = beside.station_m - half_along_m - front_m - closing_mps * contact_s;
    if gap_m < -FLANK_M {
        return None;
    }
    // Braking takes away speed against what moves along; against the rest, all of it.
    let excess_mps = speed_mps - along_mps.max(0.0);
    let needed_mps2 = excess_mps / (2.0 * (contact_s - RESPONSE_S).max(0.05));
    Some(Threat { id: track.id, contact_s, needed_mps2 })
}

/// From when until when a value that begins at `at` and changes by `rate` a second is within ± `half`, s from
/// now; `None` if never.
fn within(at: f64, rate: f64, half: f64) -> Option<(f64, f64)> {
    if rate.abs() < 1e-6 {
        return (at.abs() < half).then_some((0.0, f64::INFINITY));
    }
    let (a, b) = ((-half - at) / rate, (half - at) / rate);
    let (begin, end) = (a.min(b), a.max(b));
    (end >= 0.0).then_some((begin.max(0.0), end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::SpeedRules;
    use crate::testing::{straight, winding};
    use avastra_base::geometry::{Pose, Vec2};
    use avastra_lang::model::vocabulary::Body;
    use avastra_world::sim::Scene;

    /// Speed and gap at the end of a drive at `speed_mps` along a road, from `station_m` on, towards an
    /// object with a velocity, with nothing but emergency braking. The gap is along x.
    fn drive(
        config: &EmergencyConfig,
        speed_mps: f64,
        body: Body,
        at: Pose,
        velocity_mps: Vec2,
    ) -> (f64, f64) {
        let guide = Guide::new(&straight(), &SpeedRules::TOWN);
        let mut emergency = Emergency::new(config);
        let mut motion = EgoMotion::straight(Pose::new(20.0, -1.75, 0.0), speed_mps);
        let mut object = at;
        let (length_m, mut gap_m_min) = (4.7, f64::INFINITY);
        for tick in 0..1000_u32 {
            let station_m = motion.rear_axle.position.x;
            let track = Track::for_tests(1, body, object, velocity_mps);
            if tick % 5 == 0 {
                emergency.look(&[track], 0.0, &guide, &LateralPlan::default(), station_m, &motion);
            }
            let control = emergency.brake(Control::default(), motion.speed_mps, 8.5);
            motion.speed_mps =
                (motion.speed_mps + pedal_acceleration_mps2(0.0, control.brake_pct) * DT_S).max(0.0);
            motion.rear_axle.position.x += motion.speed_mps * DT_S;
            object.position += velocity_mps * DT_S;
            let beside = (object.position.y + 1.75).abs() < 1.9;
            if beside {
                let gap_m = object.position.x - length_m / 2.0 - (motion.rear_axle.position.x + 3.705);
                gap_m_min = gap_m_min.min(gap_m);
            }
        }
        (motion.speed_mps, gap_m_min)
    }

    fn ahead(gap_m: f64) -> Pose {
        Pose::new(20.0 + 3.705 + gap_m + 2.35, -1.75, 0.0)
    }

    #[test]
    fn it_stops_before_what_stands_up_to_its_highest_speed() {
        let config = EmergencyConfig::default();
        for speed_mps in [3.0, 6.0, 9.0, 11.0] {
            let (end_mps, gap_m) = drive(&config, speed_mps, Body::Sedan, ahead(40.0), Vec2::zeros());
            assert!(end_mps < 0.06 && gap_m > 0.0 && gap_m < 8.0, "{speed_mps}: {end_mps} m/s, {gap_m} m");
        }
    }

    #[test]
    fn off_late_weak_or_out_of_range_it_does_less() {
        let default = EmergencyConfig::default();
        let gap_m = |config: &EmergencyConfig, speed_mps: f64| {
            drive(config, speed_mps, Body::Sedan, ahead(30.0), Vec2::zeros()).1
        };
        assert!(gap_m(&default, 10.0) > 0.0);
        assert!(gap_m(&EmergencyConfig { enabled: false, ..default }, 10.0) < -10.0);
        assert!(gap_m(&EmergencyConfig { delay_s: 0.8, ..default }, 10.0) < 0.0);
        assert!(gap_m(&EmergencyConfig { full_mps2: 2.0, partial_mps2: 2.0, ..default }, 10.0) < 0.0);
        assert!(gap_m(&default, 2.0) < 0.0, "below its speed range");
        assert!(gap_m(&default, 18.0) < 0.0, "above its speed range");
    }

    #[test]
    fn it_brakes_for_a_crossing_pedestrian_and_a_braking_leader() {
        let config = EmergencyConfig::default();
        let walker = Pose::new(60.0, -8.0, 0.0);
        let (_, gap_m) = drive(&config, 10.0, Body::Pedestrian, walker, Vec2::new(0.0, 1.5));
        assert!(gap_m > 0.0, "{gap_m}");
        let (end_mps, gap_m) = drive(&config, 11.0, Body::Sedan, ahead(20.0), Vec2::new(3.0, 0.0));
        assert!((1.5..=3.2).contains(&end_mps) && gap_m > 0.0, "{end_mps} m/s, {gap_m} m");
    }

    /// Whether anything is asked for within a look at one track.
    fn triggers(
        scene: &Scene,
        station_m: f64,
        speed_mps: f64,
        body: Body,
        at: Pose,
        velocity_mps: Vec2,
    ) -> bool {
        let guide = Guide::new(scene, &SpeedRules::TOWN);
        let mut emergency = Emergency::new(&EmergencyConfig { confirm_s: 0.0, ..EmergencyConfig::default() });
        let motion = EgoMotion::straight(scene.route.path.pose_at(station_m), speed_mps);
        let track = Track::for_tests(1, body, at, velocity_mps);
        emergency.look(&[track], 0.0, &guide, &LateralPlan::default(), station_m, &motion);
        emergency.brake(Control::default(), speed_mps, 8.5).brake_pct > 0.0
    }

    #[test]
    fn it_leaves_alone_what_is_beside_or_will_be() {
        let scene = straight();
        let at = |x_m: f64, y_m: f64, heading_rad: f64| Pose::new(x_m, y_m, heading_rad);
        let back_rad = core::f64::consts::PI;
        for (why, body, pose, velocity_mps) in [
            ("oncoming in its lane", Body::Sedan, at(50.0, 1.75, back_rad), Vec2::new(-12.0, 0.0)),
            ("parked at the edge", Body::Sedan, at(40.0, -4.0, 0.0), Vec2::zeros()),
            ("a leader of equal speed", Body::Sedan, at(32.0, -1.75, 0.0), Vec2::new(10.0, 0.0)),
            ("a leader turning off", Body::Sedan, at(38.0, -3.0, -0.5), Vec2::new(6.0, -3.5)),
            ("a crosser who is past", Body::Sedan, at(45.0, 0.5, 1.57), Vec2::new(0.0, 8.0)),
            ("a walker on the kerb", Body::Pedestrian, at(35.0, -4.1, 0.0), Vec2::zeros()),
            ("a car behind", Body::Sedan, at(15.0, -1.75, 0.0), Vec2::new(14.0, 0.0)),
        ] {
            assert!(!triggers(&scene, 20.0, 10.0, body, pose, velocity_mps), "{why}");
        }
        assert!(triggers(&scene, 20.0, 10.0, Body::Sedan, at(38.0, -1.75, 0.0), Vec2::zeros()));
        // Round a bend, oncoming traffic heads for the ego vehicle's lane and will not be there.
        let scene = winding();
        let path = &scene.route.path;
        for ahead_m in [10.0, 14.0, 18.0] {
            let pose = path.pose_at(124.0 + ahead_m).offset(0.0, 3.5);
            let oncoming = Pose { heading_rad: pose.heading_rad + back_rad, ..pose };
            let velocity_mps = oncoming.forward() * 7.0;
            assert!(!triggers(&scene, 124.0, 7.0, Body::Sedan, oncoming, velocity_mps), "{ahead_m}");
        }
    }
}
