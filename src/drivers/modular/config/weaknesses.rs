//! The documented weaknesses of the system modelled, each a switch. None is random.

use serde::{Deserialize, Serialize};

/// Declares the switches, all of them on by default.
macro_rules! weaknesses {
    ($($(#[$about:meta])* $name:ident,)*) => {
        /// The weaknesses. With a switch off, the part does what its original should have done.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct Weaknesses {
            $($(#[$about])* pub $name: bool,)*
        }

        impl Weaknesses {
            /// Their names, in the order of the modules that have them.
            pub const NAMES: &[&str] = &[$(stringify!($name)),*];

            /// Every weakness switched off.
            pub const NONE: Weaknesses = Weaknesses { $($name: false),* };

            /// Every weakness that is switched on, by name, with what is left when it alone is switched off.
            pub fn each_off(&self) -> Vec<(&'static str, Weaknesses)> {
                let mut found = Vec::new();
                $(if self.$name {
                    found.push((stringify!($name), Weaknesses { $name: false, ..*self }));
                })*
                found
            }
        }

        impl Default for Weaknesses {
            fn default() -> Weaknesses {
                Weaknesses { $($name: true),* }
            }
        }
    };
}

weaknesses! {
    /// Tracks are published only after their fourth detection, detection ends with the detector's grid, what is mostly hidden is not detected, every second frame sees of a large vehicle only the part next to the ego vehicle and takes it for a car, and at times it is detected as two. Apollo `pub_track_time_thresh`; issues 14212 and AIasd/ADFuzz 5: unstable detection and tracking across frames. Off: the first frame publishes, the sensors' own range holds, any part in sight will do.
    late_unstable_tracks,
    /// A vehicle is predicted to keep its lane until its centre is over the edge or its lateral speed has lasted. Apollo issues 11118, 12798, 14212. Off: lateral speed is believed at once.
    lane_bound_prediction,
    /// The braking of a plan builds up at a bounded rate, in an emergency too. Apollo `longitudinal_jerk_lower_bound` -4. Off: at once.
    bounded_jerk,
    /// Only the closest of all standing objects is kept clear of. Apollo's `STObstaclesProcessor`: one static obstacle. That it may be the one that is just being passed is ours. Off: all of them are.
    closest_static_only,
    /// A pedestrian who has stood on the way for some time is crept towards. Apollo issue 11926: creeps at 3 km/h into a pedestrian; that it begins with the crosswalk rule's `stop_timeout` is ours. Off: every pedestrian is stopped for.
    creeps_to_standing_pedestrian,
    /// A red light that would need hard braking is passed. Apollo `max_stop_deceleration`. Off: it is braked for, however late.
    late_red_passed,
    /// What will come onto the way at the front bumper or behind it does not count until it is there. Apollo issue 14633: `STObstaclesProcessor` drops what begins below 0.01 m and after 0.1 s. Off: it counts.
    blind_to_side_and_rear,
    /// When not even the hardest braking of a plan keeps clear, the fallback brakes at 4 m/s² at once, and no harder. Apollo `slowdown_profile_deceleration`, `GenerateStopProfile`. Off: as hard as the vehicle can.
    gentle_fallback,
    /// Decisions about road users are taken anew in every cycle, so that a small change flips them. Apollo issue 14870: yields only briefly; that its cause lies here is ours. Off: a decision is kept until the other is much cheaper.
    decides_anew,
    /// A vehicle that is still fast at the line of a junction where others may go first goes on without creeping. Apollo `max_adc_speed_before_creep`; that it also holds at junctions without lights is ours. Off: it always creeps.
    creep_skipped_at_speed,
}
