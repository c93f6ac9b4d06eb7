//! Settings of the parts that find out what is: localisation, perception, tracking.

use avastra_world::section;
use avastra_world::sim::{RANGE_M, Scene};

section! {
    /// Pose error of RTK and LiDAR map matching.
    pub struct LocalizationConfig {
        /// Standard deviation of the slowly moving position error per axis under open sky, m, in `[0, 5]`. Ours, of the size of an RTK fix.
        position_sigma_m: f64 = 0.04, 0.0..=5.0;
        /// Factor of that deviation in streets, where houses and trees hide part of the sky: outside junctions, in `[1, 50]`. Ours: with `position_sigma_m` 0.085 m over both axes; Apollo's MSF reaches 0.05 to 0.10 m RMS (Wan et al. 2018).
        street_factor: f64 = 1.5, 1.0..=50.0;
        /// Standard deviation of the heading error, rad, in `[0, 0.1]`. Ours.
        heading_sigma_rad: f64 = 0.0035, 0.0..=0.1;
        /// Correlation time of the errors of position and heading, s, in `[0.1, 100]`. Ours.
        correlation_s: f64 = 5.0, 0.1..=100.0;
        /// Age of a pose when it is used, s, in `[0, 0.1]`. Ours: one to two cycles of Apollo's localisation, which runs at 100 Hz.
        latency_s: f64 = 0.015, 0.0..=0.1;
        /// Factor of both deviations in a downpour (50 mm/h) or on a flooded road, in `[1, 10]`. Ours.
        rain_factor: f64 = 2.25, 1.0..=10.0;
        /// Constant error along the heading, m, in `[-5, 5]`. A fault to plant: none by default.
        bias_ahead_m: f64 = 0.0, -5.0..=5.0;
        /// Constant error to the left, m, in `[-5, 5]`. A fault to plant: none by default.
        bias_left_m: f64 = 0.0, -5.0..=5.0;
    }
}

section! {
    /// Detection of objects and of the colours of traffic lights.
    pub struct PerceptionConfig {
        /// Reach of the LiDAR in clear air, m, in `[0, 300]`: vehicles. Ours. `late_unstable_tracks` ends it at `grid_m`.
        lidar_vehicle_m: f64 = 120.0, 0.0..=300.0;
        /// Reach of the LiDAR in clear air, m, in `[0, 300]`: pedestrians. Ours: half of that. `late_unstable_tracks` ends it at `small_m`.
        lidar_pedestrian_m: f64 = 60.0, 0.0..=300.0;
        /// Where the detector's grid ends, m, in `[0, 300]`. Apollo's PointPillars: 74.88.
        grid_m: f64 = 74.88, 0.0..=300.0;
        /// How far the detector finds pedestrians, m, in `[0, 300]`. Ours; nuScenes scores them to 40.
        small_m: f64 = 40.0, 0.0..=300.0;
        /// Range of the cameras by day in clear air, m, in `[0, 300]`: vehicles. Ours: the LiDAR's.
        camera_vehicle_m: f64 = 120.0, 0.0..=300.0;
        /// Range of the cameras by day in clear air, m, in `[0, 300]`: pedestrians. Ours: the LiDAR's.
        camera_pedestrian_m: f64 = 60.0, 0.0..=300.0;
        /// Factor of the camera's range in full darkness, in `[0, 1]`: vehicles, which carry lamps. Ours.
        night_vehicle_factor: f64 = 0.7, 0.0..=1.0;
        /// Factor of the camera's range in full darkness, in `[0, 1]`: pedestrians. Ours: low beam, dark clothing.
        night_pedestrian_factor: f64 = 0.4, 0.0..=1.0;
        /// Part of the camera in the fused range, in `[0, 1]`; the LiDAR has the rest. Ours; BEVFusion on nuScenes loses 4.1 % of its mAP with soiled cameras and 26.8 % with a thinned LiDAR (arXiv 2511.04347).
        camera_weight: f64 = 0.2, 0.0..=1.0;
        /// Cameras alone begin a track only beyond this distance, m, in `[0, 300]`. Apollo `min_camera_publish_distance`: 50.
        camera_alone_m: f64 = 50.0, 0.0..=300.0;
        /// Cameras alone begin no track in less light than this, in `[0, 1]`. Ours; Apollo goes by the clock: none from 23:00 on.
        camera_alone_light: f64 = 0.5, 0.0..=1.0;
        /// Factor of all ranges, in `[0.05, 2]`. A fault to plant: 1 by default.
        range_factor: f64 = 1.0, 0.05..=2.0;
        /// Chance of detection in a frame far inside the range, in `[0, 1]`. Ours.
        detection_chance_max: f64 = 0.98, 0.0..=1.0;
        /// Nearer than this the share of missed frames falls with the square of the distance, as the number of LiDAR returns rises, m, in `[0, 100]`; 0: misses are as frequent near by. The law is ours; Waymo's nearest band of detection scores ends at 30.
        plenty_m: f64 = 30.0, 0.0..=100.0;
        /// Mean length of a run of missed frames, s, in `[0.1, 10]`. Ours; the share of missed frames does not depend on it.
        miss_run_s: f64 = 0.4, 0.1..=10.0;
        /// An object of which less is in sight is not detected under `late_unstable_tracks`, in `[0, 1]`. Ours.
        visible_fraction_min: f64 = 0.2, 0.0..=1.0;
        /// Ghosts that begin in a second in clear air, 1/s, in `[0, 10]`. Ours.
        ghosts_per_s: f64 = 0.002, 0.0..=10.0;
        /// Factor of that rate in a downpour (50 mm/h), in `[1, 1000]`. Ours.
        ghosts_rain_factor: f64 = 20.0, 1.0..=1000.0;
        /// Mean life of a ghost, s, in `[0.1, 10]`. As a run of missed frames; the figure is ours.
        ghost_s: f64 = 0.4, 0.1..=10.0;
        /// Frames of 0.1 s between the look and its use, in `[0, 20]`. Ours.
        latency_frames: u32 = 1, 0.0..=20.0;
        /// Position noise at distance 0, m, in `[0, 5]`. Ours.
        position_sigma_m: f64 = 0.10, 0.0..=5.0;
        /// Position noise per metre of distance, in `[0, 0.1]`. Ours.
        position_sigma_per_m: f64 = 0.002, 0.0..=0.1;
        /// Heading noise of a frame, rad, in `[0, 1]`. Ours: 3°.
        heading_sigma_rad: f64 = 0.052, 0.0..=1.0;
        /// Relative error of the size of an object, kept for its life, in `[0, 0.2]`. Ours.
        size_sigma: f64 = 0.05, 0.0..=0.2;
        /// Under `late_unstable_tracks` a vehicle longer than this flickers and splits, m, in `[0, 30]`. Ours.
        large_vehicle_m: f64 = 7.0, 0.0..=30.0;
        /// Length of the part then seen, m, in `[1, 30]`. Ours.
        flicker_length_m: f64 = 4.5, 1.0..=30.0;
        /// Share of the time in which such a vehicle is detected as two under `late_unstable_tracks`, in `[0, 0.9]`. Apollo issue 14212: inconsistent perception of a truck; the figure is ours.
        split_share: f64 = 0.05, 0.0..=0.9;
        /// Mean length of such a time, s, in `[0.1, 10]`. Ours: long enough for the parts to be published.
        split_run_s: f64 = 1.0, 0.1..=10.0;
        /// Colours of traffic lights are read from here on, m, in `[0, 300]`, or from the meteorological optical range. Ours: the cameras'.
        light_range_m: f64 = 120.0, 0.0..=300.0;
        /// A colour that goes out of sight is taken to hold for so long, s, in `[0, 10]`. Ours.
        light_memory_s: f64 = 1.5, 0.0..=10.0;
        /// No pedestrian is ever detected. A fault to plant.
        blind_to_pedestrians: bool = false;
        /// No vehicle longer than `large_vehicle_m` is ever detected. A fault to plant.
        blind_to_large_vehicles: bool = false;
        /// Every object that the sensors reach is detected as it is, hidden or not, without ghosts; and so is every light. An idealisation, to find causes with.
        perfect: bool = false;
    }
}

impl PerceptionConfig {
    /// The settings as they hold on a road: on a motorway every range for vehicles is multiplied by the ratio of the two
    /// sensing ranges, a profile's own among them. Ours: it stands in for the radar, which is not modelled.
    pub fn on(&self, scene: &Scene) -> PerceptionConfig {
        let farther = scene.range_m / RANGE_M;
        PerceptionConfig {
            lidar_vehicle_m: self.lidar_vehicle_m * farther,
            camera_vehicle_m: self.camera_vehicle_m * farther,
            grid_m: self.grid_m * farther,
            ..*self
        }
    }
}

section! {
    /// Tracks out of detections.
    pub struct TrackingConfig {
        /// Detections of a track, in a row or not, before it is published under `late_unstable_tracks`, in `[1, 100]`. Apollo `pub_track_time_thresh` 3: the fourth.
        frames_to_publish: u32 = 4, 1.0..=100.0;
        /// A track unseen for longer is dropped, s, in `[0, 5]`. Apollo's LiDAR tracker, `reserved_invisible_time`: 0.3.
        reserve_s: f64 = 0.3, 0.0..=5.0;
        /// A published track of what stands is held for so long instead, unless its place is seen empty, s, in `[0, 30]`; 0: no track is held. Ours: longer than nearly every run of misses, and than most that passes hides what it passes.
        hold_s: f64 = 5.0, 0.0..=30.0;
        /// No track is held farther away than this, m, in `[0, 100]`. Ours: the way to a stop from 11 m/s, and as much again.
        hold_m: f64 = 30.0, 0.0..=100.0;
        /// Only a track that was seen in this share of its frames is held, in `[0, 1]`. Apollo's earlier tracker, `track_visible_ratio_minimum`: 0.6.
        hold_seen_min: f64 = 0.6, 0.0..=1.0;
        /// What is slower than this stands, m/s, in `[0, 5]`. Apollo's prediction, `still_obstacle_speed_threshold`: 0.99.
        hold_mps_max: f64 = 0.99, 0.0..=5.0;
        /// A detection farther from where a track is expected does not belong to it, m, in `[0.1, 50]`. Apollo's fusion, `s_match_distance_thresh_`: 4.0.
        gate_m: f64 = 4.0, 0.1..=50.0;
        /// A track whose centre lies in the outline of an older one, grown by this on each side, is a duplicate and dropped, m, in `[0, 20]`. Ours; more is a fault to plant.
        duplicate_m: f64 = 0.0, 0.0..=20.0;
        /// Acceleration that the tracker expects of vehicles, standard deviation, m/s², in `[0.1, 20]`. Ours.
        vehicle_acceleration_sigma_mps2: f64 = 3.0, 0.1..=20.0;
        /// Acceleration that the tracker expects of pedestrians, standard deviation, m/s², in `[0.1, 20]`. Ours.
        pedestrian_acceleration_sigma_mps2: f64 = 2.0, 0.1..=20.0;
        /// Factor of the velocity that is reported, in `[0, 2]`. A fault to plant: 1 by default.
        velocity_factor: f64 = 1.0, 0.0..=2.0;
        /// A detected object is published at once with its true velocity and heading, and not forgotten for 5 s. An idealisation, to find causes with.
        perfect: bool = false;
    }
}
