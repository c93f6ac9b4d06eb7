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
mod rules;
mod search;
mod settings;
mod trainable;
mod trajectory;

pub use branch::Branch;
pub use branch::Trial;
pub use features::Features;
pub use hyperparameters::Encoding;
pub use hyperparameters::Exploration;
pub use hyperparameters::Hyperparameters;
pub use hyperparameters::Loss;
pub use hyperparameters::RewardSource;
pub use hyperparameters::SettingsError;
pub use hyperparameters::StateSet;
pub use learner::Learner;
pub use learner::improve;
pub use network::Adam;
pub use network::Initialization;
pub use network::Network;
pub use network::Shape;
pub use presets::Preset;
pub use q_policy::Face;
pub use q_policy::QPolicy;
pub use q_policy::Rows;
pub use registry::Agent;
pub use registry::Entry;
pub use registry::Kind;
pub use registry::REGISTRY;
pub use registry::by_name;
pub use replay::Priorities;
pub use replay::Replay;
pub use replay::Sample;
pub use replay::Transition;
pub use rules::Visit;
pub use rules::chosen_by;
pub use rules::distilled;
pub use search::AvFuzzerSettings;
pub use search::GoExploreSettings;
pub use settings::Settings;
pub use trainable::Beginning;
pub use trainable::Trainable;
pub use trajectory::Experience;
pub use trajectory::Lesson;
pub use trajectory::Trajectory;
