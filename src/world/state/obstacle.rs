//! A road user other than the ego vehicle, as others may see it.

use avastra_base::geometry::{OrientedBox, Pose, Vec2, unit_vector};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::vocabulary::{Body, Colour, ShownLights, Verb};

use crate::state::ambient::COMMANDED_MAX;

/// A vehicle that moves faster than this to its side comes into another lane, m/s. Ours: less than any lane
/// change, more than any wandering.
pub const SIDEWAYS_MPS: f64 = 0.15;

/// A road user other than the ego vehicle, as others may see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// From 1, in order of appearance; ambient traffic has separate numbers.
    pub id: u32,
    pub body: Body,
    pub colour: Colour,
    pub verb: Verb,
    pub outline: OrientedBox,
    /// Unit vector along the outline's heading, kept because it is asked for so often.
    pub forward: Vec2,
    pub height_m: f64,
    /// Heading of the lane that it drives in; a pedestrian's own heading.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
    /// Along its heading, over the last tick; negative when it brakes.
    pub acceleration_mps2: f64,
    /// Height of the road under it, m.
    pub elevation_m: f64,
    /// Whether its road passes over or under that of the ego vehicle, which then neither sees nor meets it; at
    /// most 0.1 s old.
    pub is_apart: bool,
    /// Gap between its outline and the ego vehicle's, m; 0 if they touch.
    pub distance_m: f64,
    pub spawned_tick: u64,
    /// The lights that it was told to show.
    pub lights: ShownLights,
}

impl Obstacle {
    /// Whether it is ambient traffic, which no action made appear.
    pub fn is_ambient(&self) -> bool {
        self.id > COMMANDED_MAX
    }

    /// Whether a vehicle comes out of its lane sideways, as in a lane change.
    pub fn moves_aside(&self) -> bool {
        let lane = unit_vector(self.lane_heading_rad);
        self.body.is_vehicle() && lane.perp(&self.velocity_mps).abs() > SIDEWAYS_MPS
    }
}

/// Where a road user is after a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// Centre of the outline.
    pub pose: Pose,
    /// Unit vector along its heading.
    pub forward: Vec2,
    /// Heading of the lane that it drives in; a pedestrian's own heading.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
}

impl Moved {
    /// Standing where it was.
    pub fn at_rest(this: &Obstacle) -> Moved {
        Moved {
            pose: this.outline.pose,
            forward: this.forward,
            lane_heading_rad: this.lane_heading_rad,
            velocity_mps: Vec2::zeros(),
        }
    }
}

/// The stream of one choice of one road user.
pub fn choices(seed: u64, id: u32, draw: u32) -> Rng {
    rng::stream(seed, Stream::Traffic, u64::from(id) << 32 | u64::from(draw))
}
