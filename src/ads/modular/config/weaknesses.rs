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
    /// Tracks are published only in their fourth frame, detection ends with the detector's grid, what is mostly hidden is not detected, and every second frame sees of a large vehicle only the part next to the ego vehicle and takes it for a car. Apollo `pub_track_time_thresh`; issues 14212 and AIasd/ADFuzz 5: unstable detection and tracking across frames. Off: the first frame publishes, the sensors' own range holds, any part in sight will do.
    late_unstable_tracks,
    /// A vehicle is predicted to keep its lane until its centre is over the edge or its lateral speed has lasted. Apollo issues 11118, 12798, 14212. Off: lateral speed is believed at once.
    lane_bound_prediction,
    /// The braking of a plan builds up at a bounded rate, in an emergency too. Apollo `longitudinal_jerk_lower_bound` -4. Off: at once.
    bounded_jerk,
    /// Only the closest of all standing objects is kept clear of, even while it is being passed. Apollo's `STBoundsDecider`: one static obstacle. Off: all of them are.
    closest_static_only,
    /// A pedestrian who has stood for some time is ignored until moving again. Apollo's crosswalk `stop_timeout`; issue 11926: creeps into a pedestrian. Off: every pedestrian counts.
    standing_pedestrian_ignored,
    /// A red light that would need hard braking is passed. Apollo `max_stop_deceleration`. Off: it is braked for, however late.
    late_red_passed,
    /// Traffic beside and behind is not reacted to. Apollo issue 14633, `BACKSIDE_VEHICLE` off. Off: a vehicle that moves over from beside is let in.
    blind_to_side_and_rear,
    /// When no plan keeps clear, the fallback brakes at 4 m/s² and no harder. Apollo `slowdown_profile_deceleration`. Off: as hard as the vehicle can.
    gentle_fallback,
}
