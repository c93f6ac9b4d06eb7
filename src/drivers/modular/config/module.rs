//! The modules of the system, and what each of them would be without error.

use avastra_lang::model::MODULES;

use super::ModularConfig;
use super::driving::{ControlConfig, PlanningConfig, PredictionConfig};
use super::safety::EmergencyConfig;
use super::sensing::{LocalizationConfig, PerceptionConfig, TrackingConfig};
use super::timing::LatencyConfig;
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
    /// Time between a look and its use, and what watches it.
    Latency,
    Control,
    /// Emergency braking.
    Emergency,
}

impl Module {
    /// In the order in which data passes through them.
    pub const ALL: [Module; 8] = [
        Module::Localization,
        Module::Perception,
        Module::Tracking,
        Module::Prediction,
        Module::Planning,
        Module::Latency,
        Module::Control,
        Module::Emergency,
    ];

    /// Its name in tables, files and the claims of scenarios.
    pub fn name(self) -> &'static str {
        MODULES[self as usize]
    }
}

impl ModularConfig {
    /// This system with one module without error: no noise, no planted fault, no weakness of its
    /// own. `late_unstable_tracks` belongs to perception (range, occlusion, flicker) and to tracking
    /// (publication): each of the two loses its share by its `perfect` switch.
    ///
    /// Planning keeps its way of driving (speeds, gaps) only as far as the default has it: a profile
    /// that follows too closely is a fault of planning, too.
    pub fn idealised(&self, module: Module) -> ModularConfig {
        let ideal = ModularConfig {
            localization: LocalizationConfig {
                position_sigma_m: 0.0,
                heading_sigma_rad: 0.0,
                latency_s: 0.0,
                ..LocalizationConfig::default()
            },
            perception: PerceptionConfig { latency_frames: 0, perfect: true, ..PerceptionConfig::default() },
            tracking: TrackingConfig { perfect: true, ..TrackingConfig::default() },
            prediction: PredictionConfig { perfect: true, ..PredictionConfig::default() },
            planning: PlanningConfig::default(),
            control: ControlConfig::default(),
            emergency: EmergencyConfig::default(),
            latency: LatencyConfig { per_object_s: 0.0, ..LatencyConfig::default() },
            weaknesses: Weaknesses {
                late_unstable_tracks: self.weaknesses.late_unstable_tracks,
                ..Weaknesses::NONE
            },
        };
        self.with_module_of(module, &ideal)
    }

    /// This system with one module as another profile has it. `late_unstable_tracks` goes with perception.
    pub fn with_module_of(&self, module: Module, other: &ModularConfig) -> ModularConfig {
        let mut config = *self;
        match module {
            Module::Localization => {
                config.localization =
                    LocalizationConfig { latency_s: self.localization.latency_s, ..other.localization };
            }
            Module::Perception => {
                config.perception =
                    PerceptionConfig { latency_frames: self.perception.latency_frames, ..other.perception };
                config.weaknesses.late_unstable_tracks = other.weaknesses.late_unstable_tracks;
            }
            Module::Tracking => config.tracking = other.tracking,
            Module::Prediction => {
                config.prediction = other.prediction;
                config.weaknesses.lane_bound_prediction = other.weaknesses.lane_bound_prediction;
            }
            Module::Planning => {
                config.planning = other.planning;
                config.weaknesses = Weaknesses {
                    late_unstable_tracks: self.weaknesses.late_unstable_tracks,
                    lane_bound_prediction: self.weaknesses.lane_bound_prediction,
                    ..other.weaknesses
                };
            }
            Module::Latency => {
                config.localization.latency_s = other.localization.latency_s;
                config.perception.latency_frames = other.perception.latency_frames;
                config.latency = other.latency;
            }
            Module::Control => config.control = other.control,
            Module::Emergency => config.emergency = other.emergency,
        }
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every shipped fault: its file's name begins with the module at fault.
    fn faults() -> Vec<(String, ModularConfig)> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/ads/faults");
        let mut files: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let read = |path: &std::path::PathBuf| {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            (name, ModularConfig::from_yaml(&std::fs::read_to_string(path).unwrap()).unwrap())
        };
        files.iter().map(read).collect()
    }

    #[test]
    fn a_fault_vanishes_with_its_own_module_and_with_no_other() {
        let healthy = ModularConfig::default();
        assert!(faults().len() >= 12);
        for (name, fault) in faults() {
            let mut swapped = fault;
            for module in Module::ALL {
                let is_own = name.starts_with(module.name());
                let is_cured = fault.idealised(module) == healthy.idealised(module);
                let is_restored = fault.with_module_of(module, &healthy) == healthy;
                assert_eq!((is_cured, is_restored), (is_own, is_own), "{name} by {}", module.name());
                swapped = swapped.with_module_of(module, &healthy);
            }
            assert_eq!(swapped, healthy, "all modules together are the whole profile");
        }
        for module in Module::ALL {
            assert!(faults().iter().any(|(name, _)| name.starts_with(module.name())), "{}", module.name());
        }
    }
}
