//! The recorded future of other road users, for a prediction without error.
//!
//! To find a cause, an episode is replayed, every obstacle's positions are recorded, and it is replayed
//! again with a driving system that knows the recording. Obstacles react to the ego vehicle, so if it
//! drives otherwise, they may leave the recorded way: it is right up to the first difference that matters.

use avastra_base::geometry::Vec2;
use avastra_world::sim::{FRAME_S, FRAME_TICKS, Obstacle};

/// Where every obstacle of an episode was, every 0.1 s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Foresight {
    courses: Vec<Course>,
}

#[derive(Debug, Clone, PartialEq)]
struct Course {
    id: u32,
    begin_s: f64,
    positions: Vec<Vec2>,
}

impl Foresight {
    /// Notes where every obstacle is; to be called after every tick, with its number.
    pub fn record<'a>(&mut self, tick: u64, obstacles: impl Iterator<Item = &'a Obstacle>) {
        if !tick.is_multiple_of(FRAME_TICKS) {
            return;
        }
        for obstacle in obstacles {
            self.note(obstacle.id, tick / FRAME_TICKS, obstacle.outline.pose.position);
        }
    }

    /// Notes where an obstacle is in a frame; its frames follow each other without a gap.
    pub(super) fn note(&mut self, id: u32, frame: u64, position: Vec2) {
        match self.courses.iter_mut().find(|course| course.id == id) {
            Some(course) => course.positions.push(position),
            None => {
                let begin_s = frame as f64 * FRAME_S;
                self.courses.push(Course { id, begin_s, positions: vec![position] });
            }
        }
    }

    /// Writes the future of one obstacle, every `step_s` from `time_s`, as displacements from `position`.
    /// `false` if the recording does not hold that moment.
    pub fn positions(
        &self,
        id: u32,
        time_s: f64,
        position: Vec2,
        step_s: f64,
        positions: &mut [Vec2],
    ) -> bool {
        let Some(course) = self.courses.iter().find(|course| course.id == id) else { return false };
        let Some(now) = course.at(time_s) else { return false };
        for (step, slot) in positions.iter_mut().enumerate() {
            // After the end of the recording it stays where it was last.
            let then = course.at(time_s + step as f64 * step_s);
            *slot = position + then.unwrap_or(course.positions[course.positions.len() - 1]) - now;
        }
        true
    }
}

impl Course {
    fn at(&self, time_s: f64) -> Option<Vec2> {
        let place = (time_s - self.begin_s) / FRAME_S + 1e-6;
        if place < 0.0 || place as usize + 1 >= self.positions.len() {
            return None;
        }
        let (index, fraction) = (place as usize, place - place.floor());
        Some(self.positions[index] * (1.0 - fraction) + self.positions[index + 1] * fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_recorded_is_foreseen() {
        let mut foresight = Foresight::default();
        for frame in 0..40_u64 {
            let time_s = frame as f64 * FRAME_S;
            foresight.note(4, frame, Vec2::new(time_s * time_s, 0.0));
        }
        let mut positions = [Vec2::zeros(); 4];
        assert!(foresight.positions(4, 1.0, Vec2::new(1.5, 7.0), 0.5, &mut positions));
        for (step, position) in positions.iter().enumerate() {
            let time_s = 1.0 + 0.5 * step as f64;
            let expected = Vec2::new(0.5 + time_s * time_s, 7.0);
            assert!((position - expected).norm() < 1e-3, "{position} for {expected}");
        }
        assert!(!foresight.positions(5, 1.0, Vec2::zeros(), 0.5, &mut positions));
        assert!(!foresight.positions(4, 9.0, Vec2::zeros(), 0.5, &mut positions));
    }
}
