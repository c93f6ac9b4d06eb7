//! The modules of the system, and what each of them would be without error.

use super::ModularConfig;
use super::driving::ControlConfig;
use super::driving::PlanningConfig;
use super::driving::PredictionConfig;
use super::sensing::LocalizationConfig;
use super::sensing::PerceptionConfig;
use super::sensing::TrackingConfig;
use super::weaknesses::Weaknesses;

/// A part of the modular driving system that a failure can be blamed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Module {
    Localization,
    Perception,
    Tracking,
    Prediction,
    Planning,
    /// Time between a look and its use.
    Latency,
    Control,
}

impl Module {
    /// In the order of the data's way.
    pub const ALL: [Module; 7] = [
        Module::Localization,
        Module::Perception,
        Module::Tracking,
        Module::Prediction,
        Module::Planning,
        Module::Latency,
        Module::Control,
    ];

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Module::Localization => "localization",
            Module::Perception => "perception",
            Module::Tracking => "tracking",
            Module::Prediction => "prediction",
            Module::Planning => "planning",
            Module::Latency => "latency",
            Module::Control => "control",
        }
    }
}

impl ModularConfig {
    /// The same system with one module without error: no noise, no planted fault, no weakness of its
    /// own. Weakness (a) belongs to perception (range, occlusion, flicker) and to tracking
    /// (publication): each of the two loses its share by its `perfect` switch.
    ///
    /// Planning keeps its way of driving (speeds, gaps) only as far as the default has it: a profile
    /// that follows too closely is a fault of planning, too.
    pub fn idealised(&self, module: Module) -> ModularConfig {
        let mut config = *self;
        match module {
            Module::Localization => {
                config.localization = LocalizationConfig {
                    position_sigma_m: 0.0,
                    heading_sigma_rad: 0.0,
                    latency_s: self.localization.latency_s,
                    ..LocalizationConfig::default()
                };
            }
            Module::Perception => {
                config.perception = PerceptionConfig {
                    latency_frames: self.perception.latency_frames,
                    perfect: true,
                    ..PerceptionConfig::default()
                };
            }
            Module::Tracking => {
                config.tracking = TrackingConfig { perfect: true, ..TrackingConfig::default() }
            }
            Module::Prediction => {
                config.prediction = PredictionConfig { perfect: true, ..PredictionConfig::default() };
                config.weaknesses.b_lane_bound_prediction = false;
            }
            Module::Planning => {
                config.planning = PlanningConfig::default();
                config.weaknesses = Weaknesses {
                    a_late_unstable_tracks: self.weaknesses.a_late_unstable_tracks,
                    b_lane_bound_prediction: self.weaknesses.b_lane_bound_prediction,
                    ..Weaknesses::NONE
                };
            }
            Module::Latency => {
                config.localization.latency_s = 0.0;
                config.perception.latency_frames = 0;
            }
            Module::Control => config.control = ControlConfig::default(),
        }
        config
    }
}
