//! Agents: what decides, step by step, what happens around the ego vehicle.
//!
//! An [`Agent`] is asked at each step of an episode for a row of the action table. It sees an
//! [`Observation`](crate::mdp::Observation) and the mask of rows that the rules allow, never the world.
//! [`REGISTRY`] has every agent by name.
//!
//! - `random` and `space-filling` need no training; `every-row` plays each row once.
//! - [`Trainable`] agents take in a [`Trajectory`] when an episode has ended and has been judged.
//! - The [`Learner`] is deep Q-learning; [`improve`] is one update. `exploration` says how often it chooses at random,
//!   `payment` what a step earns, `n_step` makes transitions of an episode, `replay` keeps them, `network` computes
//!   Q-values and gradients, `checkpoint` saves it all. `quirks` holds what only the published packages do.
//! - `shuffled` shows a policy states of other episodes, to tell whether it has learned when.
//! - A [`QPolicy`] acts by a trained network, or by the rules that `decision` distils from it; `features`
//!   says what a network sees.
//! - `search` has the searches: constant rows and a bandit.
//! - [`Settings`] are those of any trainable agent; each agent's own stand beside it. [`LearnerSettings`] are those of
//!   a learner, the settings of its parts included, and `presets` their values, by source.

mod acting;
mod checked;
mod checkpoint;
mod choice;
mod decision;
mod exploration;
mod features;
mod learner;
mod n_step;
mod network;
mod one_row;
mod payment;
mod presets;
mod q_policy;
mod quirks;
mod random;
mod registry;
mod replay;
mod search;
mod settings;
mod shuffled;
mod space_filling;
mod trainable;
mod trajectory;

pub use acting::{Agent, Mask};
pub use checked::SettingsError;
pub use choice::Rows;
pub use decision::{Visit, chosen_by, distilled};
pub use features::Features;
pub use learner::{Learner, LearnerSettings, Loss, improve};
pub use network::{Adam, Network, Shape};
pub use q_policy::{Face, QPolicy};
pub use registry::{Entry, Kind, REGISTRY, by_name};
pub use replay::Transition;
pub use settings::Settings;
pub use trainable::{Diverged, Trainable};
pub use trajectory::{Experience, Lesson, Trajectory};
