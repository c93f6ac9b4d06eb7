//! A recorded speed as the changes of speed that a person would write.

use avastra_base::geometry::Vec2;
use avastra_world::sim::DT_S;

/// The written speed is nowhere farther than this from the recorded one, m/s.
pub const SPEED_MPS: f64 = 0.5;
/// And the way that it leads to nowhere farther from the recorded way, m.
pub const WAY_M: f64 = 0.25;
/// The longest piece, in ticks: 20 s. It bounds the search.
const PIECE_TICKS_MAX: usize = 1000;
/// A road user that is slower than this stands, m/s.
const REST_MPS: f64 = 0.05;
/// Speeds are written to this, m/s.
const ROUNDED_MPS: f64 = 0.01;

/// A speed at the beginning, and changes of it by rising time; between them it is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    pub first_mps: f64,
    pub changes: Vec<Change>,
}

/// The speed changes evenly from one sample to another, up to a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub from: usize,
    pub to: usize,
    pub target_mps: f64,
}

/// The places of a point at successive ticks, and what is kept of them: its speed, and how far it came.
struct Way {
    speeds_mps: Vec<f64>,
    /// From one sample to the next, m.
    steps_m: Vec<f64>,
}

/// A state of the written speed at a sample: the speed, and how far its way is ahead of the recorded one.
#[derive(Clone, Copy)]
struct Written {
    speed_mps: f64,
    ahead_m: f64,
}

impl Pace {
    /// The pace of a point that was here at successive ticks; one that keeps within [`SPEED_MPS`] and [`WAY_M`], but for
    /// jumps of speed within a tick. At least one place.
    pub fn of(places: &[Vec2]) -> Pace {
        let way = Way::of(places);
        let first_mps = rounded(way.speeds_mps[0]);
        let mut changes = Vec::new();
        let mut from = 0;
        let mut written = Written { speed_mps: first_mps, ahead_m: 0.0 };
        while from + 1 < places.len() {
            let (to, next) = way.longest(from, written);
            if (next.speed_mps - written.speed_mps).abs() >= ROUNDED_MPS / 2.0 {
                changes.push(Change { from, to, target_mps: next.speed_mps });
            }
            (from, written) = (to, next);
        }
        Pace { first_mps, changes }
    }
}

impl Way {
    fn of(places: &[Vec2]) -> Way {
        let steps_m: Vec<f64> = places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let last_m = steps_m.last().copied();
        let speeds_mps =
            steps_m.iter().copied().chain(Some(last_m.unwrap_or(0.0))).map(|step_m| step_m / DT_S);
        Way { speeds_mps: speeds_mps.collect(), steps_m }
    }

    /// The longest piece of even change from a sample on that keeps near the recording: where it ends, and how.
    fn longest(&self, from: usize, written: Written) -> (usize, Written) {
        let farthest = (from + PIECE_TICKS_MAX).min(self.steps_m.len());
        let fitting = (from + 2..=farthest).rev().find_map(|to| Some((to, self.piece(from, to, written)?)));
        fitting.unwrap_or_else(|| {
            let speed_mps = rounded(self.speeds_mps[from + 1]);
            let way_m = (written.speed_mps + speed_mps) / 2.0 * DT_S;
            (from + 1, Written { speed_mps, ahead_m: written.ahead_m + way_m - self.steps_m[from] })
        })
    }

    /// The end of an even change between two samples, if it keeps near the recording. The change ends at the recorded
    /// speed, or at one that makes up for some of the way that was gained or lost.
    fn piece(&self, from: usize, to: usize, written: Written) -> Option<Written> {
        let recorded_mps = self.speeds_mps[to];
        let plain = self.kept(from, to, written, rounded(recorded_mps));
        if recorded_mps < REST_MPS {
            return plain;
        }
        let way_m: f64 = self.steps_m[from..to].iter().sum();
        let time_s = (to - from) as f64 * DT_S;
        let level_mps = 2.0 * (way_m - written.ahead_m) / time_s - written.speed_mps;
        let most_mps = SPEED_MPS / 2.0;
        let mended_mps = rounded(level_mps.clamp(recorded_mps - most_mps, recorded_mps + most_mps).max(0.0));
        let keeps = (recorded_mps - written.speed_mps).abs() <= most_mps;
        let held = keeps.then(|| self.kept(from, to, written, written.speed_mps)).flatten();
        held.or_else(|| self.kept(from, to, written, mended_mps)).or(plain)
    }

    /// How an even change to a speed ends, if it keeps near the recording all along.
    fn kept(&self, from: usize, to: usize, written: Written, target_mps: f64) -> Option<Written> {
        let slope_mps = (target_mps - written.speed_mps) / (to - from) as f64;
        let mut now = written;
        for sample in from + 1..=to {
            let speed_mps = written.speed_mps + slope_mps * (sample - from) as f64;
            now.ahead_m += (now.speed_mps + speed_mps) / 2.0 * DT_S - self.steps_m[sample - 1];
            now.speed_mps = speed_mps;
            let strays = (speed_mps - self.speeds_mps[sample]).abs() > SPEED_MPS;
            // After a jump the way may be farther off; then it must come no farther.
            if strays || now.ahead_m.abs() > WAY_M.max(written.ahead_m.abs()) {
                return None;
            }
        }
        Some(Written { speed_mps: target_mps, ..now })
    }
}

fn rounded(speed_mps: f64) -> f64 {
    if speed_mps < REST_MPS { 0.0 } else { (speed_mps / ROUNDED_MPS).round() * ROUNDED_MPS }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Places at each tick of a speed that changes evenly between these, 50 ticks each.
    fn driven(speeds_mps: &[f64]) -> Vec<Vec2> {
        let mut x_m = 0.0;
        let mut places = vec![Vec2::new(x_m, 1.0)];
        for pair in speeds_mps.windows(2) {
            for tick in 0..50 {
                x_m += (pair[0] + (pair[1] - pair[0]) * f64::from(tick) / 50.0) * DT_S;
                places.push(Vec2::new(x_m, 1.0));
            }
        }
        places
    }

    /// The way of a pace, at each of so many ticks.
    fn way_m(pace: &Pace, ticks: usize) -> Vec<f64> {
        let mut from_mps = pace.first_mps;
        let mut speeds_mps = vec![pace.first_mps; ticks];
        for change in &pace.changes {
            let length = (change.to - change.from) as f64;
            for (tick, speed_mps) in speeds_mps.iter_mut().enumerate().skip(change.from) {
                let part = ((tick - change.from) as f64 / length).min(1.0);
                *speed_mps = from_mps + (change.target_mps - from_mps) * part;
            }
            from_mps = change.target_mps;
        }
        let steps_m = speeds_mps.windows(2).scan(0.0, |way_m, pair| {
            *way_m += (pair[0] + pair[1]) / 2.0 * DT_S;
            Some(*way_m)
        });
        core::iter::once(0.0).chain(steps_m).collect()
    }

    #[test]
    fn a_person_would_write_few_changes() {
        let steady = Pace::of(&driven(&[8.0; 40]));
        assert_eq!(steady, Pace { first_mps: 8.0, changes: Vec::new() });
        let stops = Pace::of(&driven(&[10.0, 10.0, 10.0, 5.0, 0.0, 0.0, 0.0]));
        assert_eq!(stops.first_mps, 10.0);
        assert!(stops.changes.len() <= 3, "{stops:?}");
        assert_eq!(stops.changes.last().map(|change| change.target_mps), Some(0.0), "{stops:?}");
        assert_eq!(Pace::of(&[Vec2::zeros()]), Pace { first_mps: 0.0, changes: Vec::new() });
    }

    #[test]
    fn a_jump_is_a_change_within_a_tick_or_two() {
        let mut places = driven(&[0.0, 0.0]);
        let begin = places.len();
        places.extend((1..100).map(|tick| Vec2::new(1.4 * DT_S * f64::from(tick), 1.0)));
        let pace = Pace::of(&places);
        let [jump] = pace.changes[..] else { panic!("{pace:?}") };
        assert!(jump.from + 2 >= begin - 1 && jump.to - jump.from <= 2, "{jump:?}, {begin}");
        assert!((jump.target_mps - 1.4).abs() < 0.011, "{jump:?}");
    }

    proptest! {
        #[test]
        fn the_written_way_stays_near_the_recorded_one(speeds_mps in prop::collection::vec(0.0..25.0_f64, 2..16)) {
            let places = driven(&speeds_mps);
            let pace = Pace::of(&places);
            prop_assert!(pace.changes.windows(2).all(|pair| pair[0].to <= pair[1].from), "{pace:?}");
            for (tick, (place, way_m)) in places.iter().zip(way_m(&pace, places.len())).enumerate() {
                // A tick's jump may stray by what lies within a tick.
                prop_assert!((place.x - way_m).abs() <= WAY_M + 0.5, "{tick}: {} and {way_m}: {pace:?}", place.x);
            }
        }
    }
}
