//! The documented weaknesses of the system modelled, each a switch. None is random.

use serde::{Deserialize, Serialize};

/// Weaknesses (a) to (i). With a switch off, the part does what its original should have done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Weaknesses {
    /// (a) Tracks are published only in their fourth frame, detection ends with the detector's grid, what is mostly hidden is not detected, and every second frame sees of a large vehicle only the part next to the ego vehicle and takes it for a car. Apollo `pub_track_time_thresh`; issues 14212 and AIasd/ADFuzz 5: unstable detection and tracking across frames. Off: the first frame publishes, the sensors' own range holds, any part in sight will do.
    pub a_late_unstable_tracks: bool,
    /// (b) A vehicle is predicted to keep its lane until its centre is over the edge or its lateral speed has lasted. Apollo issues 11118, 12798, 14212. Off: lateral speed is believed at once.
    pub b_lane_bound_prediction: bool,
    /// (c) The braking of a plan builds up at a bounded rate, in an emergency too. Apollo `longitudinal_jerk_lower_bound` -4. Off: at once.
    pub c_bounded_jerk: bool,
    /// (d) A vehicle that crosses and is on the way only briefly is not given way to. Apollo issue 14870. Off: it is.
    pub d_brief_yielding: bool,
    /// (e) Only the closest of all standing objects is kept clear of, even while it is being passed. Apollo's `STBoundsDecider`: one static obstacle. Off: all of them are.
    pub e_closest_static_only: bool,
    /// (f) A pedestrian who has stood for some time is ignored until moving again. Apollo's crosswalk `stop_timeout`; issue 11926: creeps into a pedestrian. Off: every pedestrian counts.
    pub f_standing_pedestrian_ignored: bool,
    /// (g) A red light that would need hard braking is passed. Apollo `max_stop_deceleration`. Off: it is braked for, however late.
    pub g_late_red_passed: bool,
    /// (h) Traffic beside and behind is not reacted to. Apollo issue 14633, `BACKSIDE_VEHICLE` off. Off: a vehicle that moves over from beside is let in.
    pub h_blind_to_side_and_rear: bool,
    /// (i) When no plan keeps clear, the fallback brakes at 4 m/s² and no harder. Apollo `slowdown_profile_deceleration`. Off: as hard as the vehicle can.
    pub i_gentle_fallback: bool,
}

impl Weaknesses {
    /// Their names, from (a) to (i).
    pub const NAMES: [&str; 9] = [
        "a_late_unstable_tracks",
        "b_lane_bound_prediction",
        "c_bounded_jerk",
        "d_brief_yielding",
        "e_closest_static_only",
        "f_standing_pedestrian_ignored",
        "g_late_red_passed",
        "h_blind_to_side_and_rear",
        "i_gentle_fallback",
    ];

    /// Every weakness that is switched on, by name, with what is left when it alone is switched off.
    pub fn each_off(&self) -> Vec<(&'static str, Weaknesses)> {
        let mut found = Vec::new();
        for (index, name) in Weaknesses::NAMES.into_iter().enumerate() {
            let mut less = *self;
            let switches = [
                &mut less.a_late_unstable_tracks,
                &mut less.b_lane_bound_prediction,
                &mut less.c_bounded_jerk,
                &mut less.d_brief_yielding,
                &mut less.e_closest_static_only,
                &mut less.f_standing_pedestrian_ignored,
                &mut less.g_late_red_passed,
                &mut less.h_blind_to_side_and_rear,
                &mut less.i_gentle_fallback,
            ];
            if core::mem::take(switches[index]) {
                found.push((name, less));
            }
        }
        found
    }

    /// Every weakness switched off.
    pub const NONE: Weaknesses = Weaknesses {
        a_late_unstable_tracks: false,
        b_lane_bound_prediction: false,
        c_bounded_jerk: false,
        d_brief_yielding: false,
        e_closest_static_only: false,
        f_standing_pedestrian_ignored: false,
        g_late_red_passed: false,
        h_blind_to_side_and_rear: false,
        i_gentle_fallback: false,
    };
}

impl Default for Weaknesses {
    fn default() -> Weaknesses {
        Weaknesses {
            a_late_unstable_tracks: true,
            b_lane_bound_prediction: true,
            c_bounded_jerk: true,
            d_brief_yielding: true,
            e_closest_static_only: true,
            f_standing_pedestrian_ignored: true,
            g_late_red_passed: true,
            h_blind_to_side_and_rear: true,
            i_gentle_fallback: true,
        }
    }
}
