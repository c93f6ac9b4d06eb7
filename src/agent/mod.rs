//! Agents: who decides, step by step, what happens around the car.
//!
//! An agent sees an observation and which rows are legal; never the world. A learning agent is told
//! afterwards what its choices were worth.

mod branch;
mod checkpoint;
mod features;
mod greedy;
mod hyperparameters;
mod learner;
mod network;
mod presets;
mod q_policy;
mod random;
mod registry;
mod replay;
mod decision;
mod search;
mod settings;
mod trainable;
mod trajectory;

pub use branch::{Branch, Trial};
pub use decision::{Visit, chosen_by, distilled};
pub use features::Features;
pub use hyperparameters::{
    Encoding, Exploration, Hyperparameters, Loss, RewardSource, SettingsError, StateSet,
};
pub use learner::{Learner, improve};
pub use network::{Adam, Initialization, Network, Shape};
pub use presets::Preset;
pub use q_policy::{Face, QPolicy, Rows};
pub use registry::{Agent, Entry, Kind, REGISTRY, by_name};
pub use replay::{Priorities, Replay, Sample, Transition};
pub use search::{AvFuzzerSettings, GoExploreSettings};
pub use settings::Settings;
pub use trainable::{Beginning, Trainable};
pub use trajectory::{Experience, Lesson, Trajectory};
