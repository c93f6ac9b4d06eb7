//! Settings of the last line: emergency braking.

use avastra_world::section;

section! {
    /// Emergency braking, independent of prediction and planning.
    pub struct EmergencyConfig {
        /// Whether there is any. Off is a fault to plant.
        enabled: bool = true;
        /// It begins to brake for vehicles from this speed on, m/s, in `[0, 20]`. UN R152, 5.2.1.3, demands it from 10 km/h on; below, the planner alone stops.
        speed_mps_min: f64 = 2.78, 0.0..=20.0;
        /// It begins to brake for pedestrians from this speed on, m/s, in `[0, 20]`. UN R152, 5.2.2.3, demands it from 20 km/h, Euro NCAP (AEB/LSS VRU 4.5.1) tests from 10 km/h: the latter.
        pedestrian_speed_mps_min: f64 = 2.78, 0.0..=20.0;
        /// It begins to brake up to this speed, m/s, in `[0, 60]`. UN R152 demands it to 60 km/h.
        speed_mps_max: f64 = 16.67, 0.0..=60.0;
        /// Longest time to collision at which it brakes, s, in `[0, 5]`. Ours.
        partial_s: f64 = 1.6, 0.0..=5.0;
        /// Time to collision from which it brakes fully, s, in `[0, 5]`. Ours.
        full_s: f64 = 1.0, 0.0..=5.0;
        /// It leaves to the planner what less braking avoids, m/s², in `[0, 10]`. Ours: between AASHTO's design deceleration of 3.4 and Apollo's hardest plan of 4.0.
        needed_mps2_min: f64 = 3.5, 0.0..=10.0;
        /// Partial braking, magnitude, m/s², in `[0.5, 10]`; full braking follows when it does not suffice. Ours.
        partial_mps2: f64 = 4.0, 0.5..=10.0;
        /// Full braking, magnitude, m/s², in `[0.5, 10]`. UN R152, 5.2.1.2, demands 5.0; the vehicle's limit is 6.0. Less is a fault to plant.
        full_mps2: f64 = 6.0, 0.5..=10.0;
        /// How fast the braking builds up, m/s³, in `[1, 100]`. From nothing to full in 0.4 s, as brakes with a pump do. Ours.
        jerk_mps3: f64 = 15.0, 1.0..=100.0;
        /// A threat must be seen for so long, s, in `[0, 5]`. Two frames, against false alarms. Ours.
        confirm_s: f64 = 0.2, 0.0..=5.0;
        /// It begins later by so long, s, in `[0, 5]`. A fault to plant: none by default.
        delay_s: f64 = 0.0, 0.0..=5.0;
        /// After a contact the vehicle brakes to rest and stays. NHTSA's recall 23E-086 (Cruise, 2023) is about one that drove on; multi-collision brakes of series cars brake likewise.
        stops_after_contact: bool = true;
    }
}
