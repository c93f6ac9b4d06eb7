//! The values that rules leave to a number: ranges and single points.

/// Drawn numbers are multiples of this where the rules allow it, SI: short in text and exact in binary.
const GRID: f64 = 1.0 / 64.0;

/// In a part that holds fewer steps of the grid than this, the grid is finer: `any wait: Duration in 0 ms .. 40 ms` would
/// else have three values.
const FEWEST_STEPS: f64 = 8.0;

/// The parts of a range that are left, in rising order; they do not touch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Room {
    parts: Vec<Part>,
}

/// All numbers between two ends; a single one if they are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    low: f64,
    high: f64,
    low_in: bool,
    high_in: bool,
}

impl Room {
    /// Nothing but this number.
    pub fn of(number: f64) -> Room {
        Room { parts: vec![Part { low: number, high: number, low_in: true, high_in: true }] }
    }

    /// The parts of a range for which `holds`, given the numbers in it where that may change. `holds` is asked at
    /// each of these numbers, and once between each two.
    pub fn where_holds(
        low: f64,
        high: f64,
        mut changes: Vec<f64>,
        mut holds: impl FnMut(f64) -> bool,
    ) -> Room {
        changes.extend([low, high]);
        changes.retain(|number| (low..=high).contains(number));
        changes.sort_unstable_by(f64::total_cmp);
        // Also 0 and -0 are one place.
        changes.dedup_by(|a, b| a == b);
        let mut room = Room::default();
        for (index, number) in changes.iter().enumerate() {
            if holds(*number) {
                room.add(Part { low: *number, high: *number, low_in: true, high_in: true });
            }
            let Some(next) = changes.get(index + 1) else { continue };
            let between = Part { low: *number, high: *next, low_in: false, high_in: false };
            let sample = between.on_grid(between.middle());
            if between.contains(sample) && holds(sample) {
                room.add(between);
            }
        }
        room
    }

    /// Adds a part that begins where the last one ends, or later.
    fn add(&mut self, part: Part) {
        match self.parts.last_mut() {
            Some(last) if last.high == part.low && (last.high_in || part.low_in) => {
                (last.high, last.high_in) = (part.high, part.high_in);
            }
            _ => self.parts.push(part),
        }
    }

    pub fn contains(&self, value: f64) -> bool {
        self.parts.iter().any(|part| part.contains(value))
    }

    /// The number at a share of the room, from 0 (included) to 1, on the grid where the part has a point of it. Each
    /// part counts by its length, and a single number as one step of the grid. `None` if the room is empty.
    pub fn at(&self, share: f64) -> Option<f64> {
        let last = self.parts.last()?;
        let total: f64 = self.parts.iter().map(Part::weight).sum();
        let mut rest = share * total;
        for part in &self.parts {
            if rest < part.weight() {
                let share = if self.parts.len() == 1 { share } else { rest / part.weight() };
                return Some(part.on_grid(part.low + (part.high - part.low) * share));
            }
            rest -= part.weight();
        }
        Some(last.on_grid(last.high))
    }

    /// The number of the room nearest to another, on the grid if the other does not lie in the room; a number in the
    /// middle for NaN. `None` if the room is empty.
    pub fn nearest(&self, wanted: f64) -> Option<f64> {
        if self.contains(wanted) {
            return Some(wanted);
        }
        let off = |part: &&Part| (part.low - wanted).max(wanted - part.high);
        let nearest = self.parts.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some(match wanted.is_nan() {
            true => nearest.on_grid(nearest.middle()),
            false => nearest.on_grid(wanted.max(nearest.low).min(nearest.high)),
        })
    }
}

impl Part {
    fn contains(&self, value: f64) -> bool {
        (value > self.low || value == self.low && self.low_in)
            && (value < self.high || value == self.high && self.high_in)
    }

    fn weight(&self) -> f64 {
        (self.high - self.low).max(GRID)
    }

    fn middle(&self) -> f64 {
        self.low + (self.high - self.low) / 2.0
    }

    /// A number of the part near `wanted`, on the grid where the part holds a point of it. In a part of one number,
    /// or between two neighbours, it is the middle.
    fn on_grid(&self, wanted: f64) -> f64 {
        let mut grid = GRID;
        while self.high > self.low && self.high - self.low < FEWEST_STEPS * grid && grid > f64::EPSILON {
            grid /= 2.0;
        }
        let down = (wanted / grid).floor() * grid;
        let near = [down, down + grid, wanted];
        near.into_iter().find(|number| self.contains(*number)).unwrap_or_else(|| self.middle())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_ranges_are_left() {
        let room = Room::where_holds(0.0, 10.0, vec![2.0, 4.0, 6.0], |x| x == 2.0 || x > 4.0 && x <= 6.0);
        assert!(room.contains(2.0) && !room.contains(2.1) && !room.contains(4.0) && room.contains(6.0));
        assert_eq!(room.at(0.0), Some(2.0));
        assert_eq!(room.at(0.5), Some(4.984375));
        assert_eq!(room.nearest(3.0), Some(2.0));
        assert_eq!(room.nearest(3.9), Some(4.015625));
        assert_eq!(room.nearest(8.0), Some(6.0));
    }

    #[test]
    fn where_one_range_ends_the_next_begins() {
        let room = Room::where_holds(0.0, 3.0, vec![1.0, 2.0], |x| x <= 1.0 || x >= 2.0);
        assert_eq!([0.0, 0.25, 0.5, 0.75].map(|share| room.at(share)), [0.0, 0.5, 2.0, 2.5].map(Some));
    }

    #[test]
    fn a_narrow_room_has_more_than_its_ends() {
        let room = Room::where_holds(0.02, 0.04, Vec::new(), |_| true);
        let drawn: Vec<f64> = (0..100).filter_map(|share| room.at(f64::from(share) / 100.0)).collect();
        let mut different = drawn.clone();
        different.dedup();
        assert!(different.len() >= 8 && drawn.iter().all(|number| room.contains(*number)), "{different:?}");
    }

    #[test]
    fn an_empty_room_has_no_number() {
        let room = Room::where_holds(0.0, 10.0, Vec::new(), |_| false);
        assert!(room.at(0.5).is_none() && room.nearest(0.5).is_none());
    }
}
