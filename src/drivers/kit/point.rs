//! A point of a plan.

/// Where the rear axle is to be on a guide, how fast, and how it is to accelerate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    pub station_m: f64,
    pub speed_mps: f64,
    pub acceleration_mps2: f64,
}

impl Point {
    /// The point that is a fraction, in `[0, 1]`, of the time to the next one later.
    pub fn mixed(&self, next: &Point, fraction: f64) -> Point {
        let mix = |a: f64, b: f64| a + (b - a) * fraction;
        Point {
            station_m: mix(self.station_m, next.station_m),
            speed_mps: mix(self.speed_mps, next.speed_mps),
            acceleration_mps2: mix(self.acceleration_mps2, next.acceleration_mps2),
        }
    }
}
