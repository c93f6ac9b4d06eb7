//! Pedestrians who cross the road: wait, walk straight over, stay a moment, leave.
//!
//! They look at nothing and nobody, as in the published package; one who is hit stops (see `mover`).

use crate::geometry::Pose;

use super::mover::Moved;
use super::world::DT_S;

/// At the kerb before setting out, s (published package).
const WAIT_S: f64 = 1.0;

/// On the other side before leaving, s.
const STAY_S: f64 = 2.0;

#[derive(Debug, Clone)]
pub(super) struct Walker {
    /// Where the walk begins, facing its end.
    from: Pose,
    way_m: f64,
    speed_mps: f64,
    /// Tick of the first step.
    begins_tick: u64,
}

impl Walker {
    pub fn new(from: Pose, way_m: f64, speed_mps: f64, spawn_tick: u64) -> Walker {
        Walker { from, way_m, speed_mps, begins_tick: spawn_tick + (WAIT_S / DT_S + 0.5) as u64 }
    }

    /// Where it is at the end of a tick; `None` once it has left.
    pub fn step(&self, tick: u64) -> Option<Moved> {
        let walking_s = (tick + 1).saturating_sub(self.begins_tick) as f64 * DT_S;
        let walked_m = self.speed_mps * walking_s;
        if walked_m >= self.way_m + self.speed_mps * STAY_S {
            return None;
        }
        let walks = walked_m > 0.0 && walked_m < self.way_m;
        let rest = Moved::at_rest(self.from.offset(walked_m.min(self.way_m), 0.0));
        Some(if walks { Moved { velocity_mps: self.from.forward() * self.speed_mps, ..rest } } else { rest })
    }

    pub fn trace(&self, sink: &mut dyn FnMut(u64)) {
        for value in
            [self.from.position.x, self.from.position.y, self.from.heading_rad, self.way_m, self.speed_mps]
        {
            sink(value.to_bits());
        }
        sink(self.begins_tick);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;

    #[test]
    fn waits_walks_stays_and_leaves() {
        let walker = Walker::new(Pose::new(0.0, 0.0, 0.0), 10.0, 1.25, 100);
        let x_m = |time_s: f64| walker.step(100 + (time_s / DT_S) as u64).map(|moved| moved.pose.position.x);
        assert_eq!(x_m(0.9), Some(0.0));
        assert!((x_m(5.0).expect("on its way") - 5.0).abs() < 0.05);
        assert_eq!(x_m(10.9), Some(10.0));
        assert_eq!(x_m(11.1), None);
        let standing = walker.step(100).expect("it waits");
        assert_eq!(standing.velocity_mps, Vec2::zeros());
    }
}
