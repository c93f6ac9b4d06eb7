//! The input of the ego vehicle's sensors, as plain data.

use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::{Body, ShownLights};

/// The output of the sensors in one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Since the start of the episode, s.
    pub time_s: f64,
    pub ego: EgoMotion,
    pub objects: Vec<SensedObject>,
    /// State of every signal of the map, by index in `RoadMap::signals`.
    pub signals: Vec<SignalColour>,
    pub conditions: Conditions,
}

/// True motion of the ego vehicle. Its rear axle is the reference point, as in Apollo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoMotion {
    /// Pose of the rear axle's centre.
    pub rear_axle: Pose,
    pub speed_mps: f64,
    pub acceleration_mps2: f64,
    pub yaw_rate_radps: f64,
    /// Angle of the road wheels, rad, positive to the left.
    pub steer_rad: f64,
    /// Whether it has touched a road user, as its collision sensors tell.
    pub touched: bool,
}

impl EgoMotion {
    /// Rolling straight on at a constant speed.
    pub fn straight(rear_axle: Pose, speed_mps: f64) -> EgoMotion {
        EgoMotion {
            rear_axle,
            speed_mps,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            steer_rad: 0.0,
            touched: false,
        }
    }
}

/// A road user within sensor range, as it truly is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensedObject {
    /// From 1; it stays the same for the whole life of the object.
    pub id: u32,
    pub body: Body,
    /// Centre of the outline.
    pub pose: Pose,
    pub velocity_mps: Vec2,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// Part of its outline that nothing hides, in `[0, 1]`, by line of sight; at most 0.1 s old.
    pub visible_fraction: f64,
    /// Distance between the outlines, m.
    pub distance_m: f64,
    /// Whether it is a vehicle that drives without lights. By day that makes no difference.
    pub is_unlit: bool,
    /// Whether it is an emergency vehicle under way.
    pub has_siren: bool,
    /// The lights that a vehicle shows beside its headlights.
    pub lights: ShownLights,
}

/// Light and weather where the ego vehicle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// 1 by day, less in the dark: the light that a camera has.
    pub light: f64,
    /// Rain, mm/h.
    pub rain_mmph: f64,
    /// Meteorological optical range, m.
    pub visibility_m: f64,
    /// Water on the road, mm.
    pub water_mm: f64,
    /// Coefficient of tyre friction at the ego vehicle's speed, at most 0.1 s old.
    pub friction: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalColour {
    Red,
    Yellow,
    Green,
}

impl SignalColour {
    /// As other tools call it, too.
    pub fn name(self) -> &'static str {
        match self {
            SignalColour::Red => "red",
            SignalColour::Yellow => "yellow",
            SignalColour::Green => "green",
        }
    }
}
