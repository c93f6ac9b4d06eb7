//! What may be set of the modular driving system: unit, range and where it comes from.
//!
//! Constants that belong to a method rather than to the system modelled (step sizes, filter gains,
//! look-aheads) stand with their use in the parts. `scenarios/ads/default.yaml` is the default
//! written out, `scenarios/ads/faults/` holds faults to plant. "Apollo" is Apollo 7.0: its
//! sources, its configuration, and its calibration for LGSVL. "Ours" marks what no source gives, and what differs
//! from one.

mod driving;
mod module;
mod read;
mod safety;
mod sensing;
mod timing;
mod weaknesses;

use serde::{Deserialize, Serialize};

pub use driving::{ControlConfig, PlanningConfig, PredictionConfig};
pub use module::Module;
pub use read::ConfigError;
pub use safety::EmergencyConfig;
pub use sensing::{LocalizationConfig, PerceptionConfig, TrackingConfig};
pub use timing::{LOAD_FRAMES_MAX, LatencyConfig};
pub use weaknesses::Weaknesses;

/// Settings of [`Modular`](super::Modular). Keys that a file leaves out keep their default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModularConfig {
    pub localization: LocalizationConfig,
    pub perception: PerceptionConfig,
    pub tracking: TrackingConfig,
    pub prediction: PredictionConfig,
    pub planning: PlanningConfig,
    pub control: ControlConfig,
    pub emergency: EmergencyConfig,
    pub latency: LatencyConfig,
    pub weaknesses: Weaknesses,
}
