//! Settings of the parts that decide and act: prediction, planning, control.

use serde::{Deserialize, Serialize};

use crate::kit::{PedalsConfig, SpeedRules, SteeringConfig};
use avastra_world::section;

section! {
    /// Where objects will be.
    pub struct PredictionConfig {
        /// Slower vehicles are taken to stand, m/s, in `[0, 5]`. Apollo `still_obstacle_speed_threshold`: 0.99.
        still_vehicle_mps: f64 = 0.99, 0.0..=5.0;
        /// Slower pedestrians are taken to stand, m/s, in `[0, 5]`. Apollo `still_pedestrian_speed_threshold`: 0.2.
        still_pedestrian_mps: f64 = 0.2, 0.0..=5.0;
        /// Lateral speed that counts as leaving the lane, m/s, in `[0, 5]`. Ours.
        lateral_speed_mps: f64 = 0.4, 0.0..=5.0;
        /// For how long that lateral speed must last before it is believed under `lane_bound_prediction`, s, in `[0, 10]`. Ours.
        lateral_persistence_s: f64 = 0.5, 0.0..=10.0;
        /// A vehicle turned further from every lane is taken to go straight on, rad, in `[0, 3.2]`. Ours.
        off_lane_rad: f64 = 0.6, 0.0..=3.2;
        /// Farther objects are taken to keep their velocity, m, in `[0, 300]`. Ours; Apollo looks for objects to be cautious of as far (`scan_length`: 80).
        reach_m: f64 = 80.0, 0.0..=300.0;
        /// Most futures that an object is given, in `[1, 3]`. Ours: straight on, left and right. One is a fault to plant.
        hypotheses_max: u32 = 3, 1.0..=3.0;
        /// Every object is predicted to stay where it is. A fault to plant.
        frozen: bool = false;
        /// The future is known where a recording of it is at hand (`ads::Foresight`); without one this is no more than `lane_bound_prediction` switched off. An idealisation, to find causes with.
        perfect: bool = false;
    }
}

section! {
    /// Path and speed along the route.
    pub struct PlanningConfig {
        /// Speed on a free road, m/s, in `[1, 40]`. Apollo's upstream `planning.conf`, `default_cruise_speed`: 11.18 (25 mph); the flag's own default is 5.0.
        cruise_mps: f64 = SpeedRules::TOWN.cruise_mps, 1.0..=40.0;
        /// Lateral acceleration in curves, m/s², in `[0.5, 6]`. Apollo's speed bounds, `max_centric_acceleration_limit`: 2.0.
        lateral_acceleration_mps2_max: f64 = SpeedRules::TOWN.lateral_acceleration_mps2_max, 0.5..=6.0;
        /// Slowing down for curves and limits ahead, magnitude, m/s², in `[0.5, 6]`. Ours.
        slowdown_mps2: f64 = SpeedRules::TOWN.slowdown_mps2, 0.5..=6.0;
        /// Hardest acceleration, m/s², in `[0.5, 4]`. Apollo's DP `max_acceleration`: 2.0.
        acceleration_mps2_max: f64 = 2.0, 0.5..=4.0;
        /// Hardest braking of a plan, magnitude, m/s², in `[1, 8]`. Apollo's DP `max_deceleration`: 4.0.
        deceleration_mps2_max: f64 = 4.0, 1.0..=8.0;
        /// Hardest braking when that does not suffice, magnitude, m/s², in `[1, 10]`. The vehicle's limit, Apollo `max_deceleration`: 6.0.
        emergency_mps2: f64 = 6.0, 1.0..=10.0;
        /// Braking for a planned stop, magnitude, m/s², in `[0.5, 4]`. Ours.
        comfortable_mps2: f64 = 2.0, 0.5..=4.0;
        /// Rate at which a plan may lower its acceleration under `bounded_jerk`, magnitude, m/s³, in `[0.5, 50]`. Apollo `longitudinal_jerk_lower_bound`: -4.0.
        jerk_mps3_down: f64 = 4.0, 0.5..=50.0;
        /// Rate at which a plan may raise its acceleration, m/s³, in `[0.5, 50]`. Apollo `longitudinal_jerk_upper_bound`: 2.0.
        jerk_mps3_up: f64 = 2.0, 0.5..=50.0;
        /// Room kept free on each side, also of what stands at the edge of the lane and is passed within it, m, in `[0, 2]`. Apollo's path bounds, `obstacle_lat_buffer`: 0.4.
        lateral_buffer_m: f64 = 0.4, 0.0..=2.0;
        /// Gap to what stands in the way, m, in `[0.5, 20]`. Apollo `min_stop_distance_obstacle`: 6.0.
        stop_gap_m: f64 = 6.0, 0.5..=20.0;
        /// Gap to a leader at rest, m, in `[0.5, 20]`. Ours: between Apollo's `follow_min_distance` 3.0 and the stop gap.
        follow_gap_m: f64 = 5.0, 0.5..=20.0;
        /// Time gap to a leader, s, in `[0.1, 5]`. Apollo `follow_time_buffer`: 2.5.
        follow_time_s: f64 = 2.5, 0.1..=5.0;
        /// Gap to the way of something that crosses, m, in `[0.5, 20]`. Apollo `yield_distance`: 5.0.
        yield_gap_m: f64 = 5.0, 0.5..=20.0;
        /// Two road users at one place closer in time than this are in conflict, s, in `[0, 5]`. Ours.
        conflict_buffer_s: f64 = 1.0, 0.0..=5.0;
        /// Safe distance to a road user's region of the station-time graph, m, in `[0, 100]`. Apollo's DP `safe_distance`: 20.
        dp_safe_distance_m: f64 = 20.0, 0.0..=100.0;
        /// Safe time before and after such a region, s, in `[0.1, 20]`. Ours; Apollo's DP has `safe_time_buffer` 3.0, but its cost does not read it.
        dp_safe_time_s: f64 = 3.0, 0.1..=20.0;
        /// A decision is left only if the cost without it is lower by this part, in `[0, 1]`. Ours.
        decision_margin: f64 = 0.3, 0.0..=1.0;
        /// Less probable hypotheses count in the cost alone, in `[0, 1]`. Ours.
        hypothesis_min: f64 = 0.1, 0.0..=1.0;
        /// The same for hypotheses that would take the ego vehicle's right of way, in `[0, 1]`. Ours.
        hypothesis_min_owing: f64 = 0.5, 0.0..=1.0;
        /// Under `creeps_to_standing_pedestrian`, a pedestrian who has stood for longer is crept towards, s, in `[0, 60]`. Apollo's crosswalk rule, `stop_timeout`: 4.0.
        standing_pedestrian_s: f64 = 4.0, 0.0..=60.0;
        /// Under `creeps_to_standing_pedestrian`, the speed of that, m/s, in `[0.1, 3]`. Apollo issue 11926: 3 km/h.
        creep_to_pedestrian_mps: f64 = 0.83, 0.1..=3.0;
        /// Gap from the front bumper to a stop line, m, in `[0, 5]`. Apollo `stop_distance`: 1.0.
        stop_line_gap_m: f64 = 1.0, 0.0..=5.0;
        /// Under `late_red_passed`, a red light that would need harder braking is passed, m/s², in `[1, 8]`. Apollo `max_stop_deceleration`: 4.0.
        red_light_mps2_max: f64 = 4.0, 1.0..=8.0;
        /// Gap from the front bumper to an occupied crosswalk, m, in `[0, 5]`. Apollo's crosswalk rule, `stop_distance`: 1.0.
        crosswalk_gap_m: f64 = 1.0, 0.0..=5.0;
        /// A crosswalk that would need harder braking is passed, m/s², in `[1, 8]`. Apollo's crosswalk rule, `max_stop_deceleration`: 6.0.
        crosswalk_mps2_max: f64 = 6.0, 1.0..=8.0;
        /// Pedestrians on a crosswalk nearer to the path than this are waited for, m, in `[0, 20]`. Apollo `stop_strict_l_distance`: 6.0.
        crosswalk_strict_m: f64 = 6.0, 0.0..=20.0;
        /// Pedestrians who come nearer are waited for up to this distance from the path, m, in `[0, 20]`. Apollo `stop_loose_l_distance`: 8.0.
        crosswalk_loose_m: f64 = 8.0, 0.0..=20.0;
        /// Slower objects are static, m/s, in `[0, 3]`. Apollo `static_obstacle_speed_threshold`: 0.5.
        static_mps: f64 = 0.5, 0.0..=3.0;
        /// A lane change needs at least this gap in front and behind in the target lane, m, in `[0, 50]`. Apollo's lane change decider: 10.
        change_gap_m: f64 = 10.0, 0.0..=50.0;
        /// It also needs this time gap at the difference of the speeds, s, in `[0, 20]`. Apollo's lane change decider: 3.
        change_time_s: f64 = 3.0, 0.0..=20.0;
        /// Gap to oncoming traffic in the target lane, m, in `[0, 200]`. Apollo's lane change decider: 50.
        change_oncoming_gap_m: f64 = 50.0, 0.0..=200.0;
        /// Time gap to oncoming traffic at the sum of the speeds, s, in `[0, 20]`. Apollo's lane change decider: 5.
        change_oncoming_time_s: f64 = 5.0, 0.0..=20.0;
        /// Braking when there is no plan, and under `gentle_fallback` when no plan keeps clear, magnitude, m/s², in `[1, 8]`. Apollo `slowdown_profile_deceleration`: 4.0.
        fallback_mps2: f64 = 4.0, 1.0..=8.0;
        /// Farther than this beside the route there is no plan, m, in `[1, 20]`. Ours.
        lost_offset_m: f64 = 3.0, 1.0..=20.0;
        /// Speed at which an unprotected turn is approached and crept into, m/s, in `[0.5, 10]`. Apollo's unprotected left turn, `approach_cruise_speed`: 2.78; that it also holds while creeping is ours.
        approach_mps: f64 = 2.78, 0.5..=10.0;
        /// The approach begins this far before the line, or as far as slowing down takes, m, in `[0, 100]`. Apollo's unprotected left turn, `start_traffic_light_scenario_distance`: 30.0; that it holds for signs as well is ours.
        approach_m: f64 = 30.0, 0.0..=100.0;
        /// Speed at which a junction without lights and signs is approached if others go first, m/s, in `[0.5, 20]`. Apollo's bare intersection, `approach_cruise_speed`: 6.7056 (15 mph).
        bare_approach_mps: f64 = 6.7, 0.5..=20.0;
        /// Creeping ends this far behind the line, m, in `[0, 20]`. Apollo's creep decider, `FindCreepDistance`: 2.0.
        creep_m: f64 = 2.0, 0.0..=20.0;
        /// Creeping goes on until nothing comes onto the way within so long, s, in `[0, 20]`. Apollo's creep decider, `min_boundary_t`: 6.0.
        creep_clear_s: f64 = 6.0, 0.0..=20.0;
        /// Under `creep_skipped_at_speed`, a faster vehicle does not creep, m/s, in `[0, 20]`. Apollo `max_adc_speed_before_creep`: 5.56.
        creep_skip_mps: f64 = 5.56, 0.0..=20.0;
        /// Time at rest before a stop sign, s, in `[0, 20]`. Apollo's stop sign scenario, `stop_duration_sec`: 1.0.
        stop_sign_s: f64 = 1.0, 0.0..=20.0;
        /// Reaction time of the sight distance, s, in `[0, 5]`: publication of a track, and half the time in which braking builds up. Ours; AASHTO's Green Book has 2.5 for people.
        sight_reaction_s: f64 = 1.0, 0.0..=5.0;
        /// Bounds the speed by what can be seen. Off is a fault to plant.
        sight_bounds_speed: bool = true;
        /// Takes the right of way of others for its own and the other way round. A fault to plant.
        priority_misread: bool = false;
        /// Never gives way to what crosses or joins. A fault to plant.
        never_yields: bool = false;
    }
}

impl PlanningConfig {
    pub(in crate::modular) fn speed_rules(&self) -> SpeedRules {
        SpeedRules {
            cruise_mps: self.cruise_mps,
            lateral_acceleration_mps2_max: self.lateral_acceleration_mps2_max,
            slowdown_mps2: self.slowdown_mps2,
        }
    }
}

/// Tracking of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ControlConfig {
    pub steering: SteeringConfig,
    pub pedals: PedalsConfig,
    pub actuators: ActuatorsConfig,
}

section! {
    /// What the commands may be, and how late they are.
    pub struct ActuatorsConfig {
        /// No harder braking is commanded, magnitude, m/s², in `[0.5, 10]`. The vehicle's full brake; Apollo's calibration table has 8.1 to 9.2. Less is a fault to plant.
        brake_mps2_max: f64 = 8.5, 0.5..=10.0;
        /// No more throttle is commanded than gives this, m/s², in `[0, 10]`. The vehicle at 80 %; Apollo's calibration table has 4.8 to 5.1 from 4.6 m/s on.
        throttle_mps2_max: f64 = 4.95, 0.0..=10.0;
        /// First-order lag of the commanded steering angle beside the actuator's own, s, in `[0, 5]`. A fault to plant: none by default.
        steer_lag_s: f64 = 0.0, 0.0..=5.0;
    }
}
