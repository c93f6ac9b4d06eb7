//! Ghosts: detections of what is not there, as spray and clutter give them.
//!
//! They begin at random, more often in rain, stand still and live for some frames. Where they stand
//! and how large they are is ours: in front of the vehicle, where they matter.

use crate::status::GHOST_ID_MIN;
use avastra_base::geometry::{Pose, Vec2};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::{Conditions, FRAME_S};

use super::super::config::PerceptionConfig;
use super::detection::Detection;
use super::ranges::RAIN_HIGH_MMPH;

/// Where ghosts begin: least and greatest distance ahead of the rear axle, and greatest to each side, m.
const AHEAD_M: (f64, f64) = (8.0, 50.0);
const ASIDE_M: f64 = 5.0;
/// Edge of the cube that a ghost looks like, m.
const EDGE_M: f64 = 1.5;

#[derive(Debug, Clone)]
pub struct Ghosts {
    rng: Rng,
    begun: u32,
    alive: Vec<Ghost>,
}

#[derive(Debug, Clone, Copy)]
struct Ghost {
    id: u32,
    position: Vec2,
    rest_s: f64,
}

impl Ghosts {
    pub fn new(seed: u64) -> Ghosts {
        // No object has the id 0, so nothing else draws from this stream.
        Ghosts { rng: rng::stream(seed, Stream::Perception, 0), begun: 0, alive: Vec::new() }
    }

    /// Moves on by a frame; adds a detection of each ghost to `detections`.
    pub fn haunt(
        &mut self,
        config: &PerceptionConfig,
        conditions: &Conditions,
        localized: &Pose,
        detections: &mut Vec<Detection>,
    ) {
        for ghost in &mut self.alive {
            ghost.rest_s -= FRAME_S;
        }
        self.alive.retain(|ghost| ghost.rest_s > 0.0);
        let rain = (conditions.rain_mmph / RAIN_HIGH_MMPH).clamp(0.0, 1.0);
        let rate_per_s = config.ghosts_per_s * (1.0 + (config.ghosts_rain_factor - 1.0) * rain);
        if rng::unit(&mut self.rng) < rate_per_s * FRAME_S {
            let ahead_m = rng::between(&mut self.rng, AHEAD_M.0, AHEAD_M.1);
            let left_m = rng::between(&mut self.rng, -ASIDE_M, ASIDE_M);
            let rest_s = -config.ghost_s * libm::log(1.0 - rng::unit(&mut self.rng));
            let id = GHOST_ID_MIN + self.begun;
            self.begun += 1;
            self.alive.push(Ghost { id, position: localized.offset(ahead_m, left_m).position, rest_s });
        }
        detections.extend(self.alive.iter().map(|ghost| Detection {
            truth: ghost.id,
            body: Body::Hatchback,
            pose: Pose { position: ghost.position, heading_rad: localized.heading_rad },
            shift_m: 0.0,
            length_m: EDGE_M,
            width_m: EDGE_M,
            height_m: EDGE_M,
            sigma_m: config.position_sigma_m.max(1e-3),
            true_velocity_mps: Vec2::zeros(),
            true_heading_rad: localized.heading_rad,
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::CLEAR_DAY;

    #[test]
    fn ghosts_come_at_the_documented_rate_and_more_often_in_rain() {
        let config = PerceptionConfig { ghosts_per_s: 0.02, ..PerceptionConfig::default() };
        let begun = |conditions: &Conditions| {
            let mut ghosts = Ghosts::new(3);
            let mut detections = Vec::new();
            for _ in 0..200_000 {
                detections.clear();
                ghosts.haunt(&config, conditions, &Pose::new(0.0, 0.0, 0.0), &mut detections);
            }
            f64::from(ghosts.begun)
        };
        // 20 000 s: 400 in clear air, 8 000 in a downpour.
        let clear = begun(&CLEAR_DAY);
        let rain = begun(&Conditions { rain_mmph: 50.0, ..CLEAR_DAY });
        assert!((clear - 400.0).abs() < 80.0 && (rain - 8000.0).abs() < 400.0, "{clear}, {rain}");
    }
}
