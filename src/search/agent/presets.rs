//! The presets: what the papers print, what their authors published, and ours.

use serde_json::{Map, Value};

use crate::mdp::ProcKind;

use super::checked::{SettingsError, changed};
use super::choice::ChoiceSettings;
use super::decision::RulesSettings;
use super::exploration::{Exploration, ExplorationSettings};
use super::features::{Encoding, StateSet};
use super::learner::{LearnerSettings, Loss};
use super::network::{Initialization, NetworkSettings};
use super::payment::{PaymentSettings, RewardSource};
use super::replay::ReplaySettings;

/// Settings with a name.
pub struct Preset {
    pub name: &'static str,
    pub settings: fn() -> LearnerSettings,
}

/// Presets of the agent `ddqn`, the default first.
pub const DDQN: &[Preset] = &[
    Preset { name: "avastra", settings: avastra },
    Preset { name: "paper", settings: paper },
    Preset { name: "released", settings: released },
];

/// Presets of the agent `deep_collision`, the default first.
pub const DEEP_COLLISION: &[Preset] = &[
    Preset { name: "paper", settings: deep_collision },
    Preset { name: "released", settings: deep_collision_released },
];

/// Settings as a policy file records them.
///
/// # Errors
/// An unknown setting, a value of the wrong kind or out of range, and if one is missing.
pub(super) fn of_record(recorded: &Map<String, Value>) -> Result<LearnerSettings, SettingsError> {
    let base = paper();
    if let Some(missing) = base.record().keys().find(|name| !recorded.contains_key(*name)) {
        return Err(SettingsError::Text(format!("the setting `{missing}` is missing")));
    }
    changed(&base, recorded.clone())
}

/// The paper as printed. Settings that it leaves open are as in its published package, but for that package's
/// faults. How long ε falls is DeepCollision's, which the paper refers to.
pub(super) fn paper() -> LearnerSettings {
    LearnerSettings {
        preset: "paper".to_owned(),
        choice: ChoiceSettings {
            state: StateSet::Full,
            encoding: Encoding::Raw,
            actions: Vec::new(),
            masks_choice: true,
            masks_target: true,
            environment_gate_steps: 0,
        },
        payment: PaymentSettings {
            observation_period_s: None,
            proc: ProcKind::Paper,
            reward: RewardSource::Equation,
            collision_reward: 7.5,
            // The paper's reward does not depend on the verdict.
            uncounted_reward: 7.5,
            safe_proc_max: 0.2,
            bound_is_safe: true,
            safe_reward: -1.0,
            delayed_credit: false,
            pays_maker: false,
        },
        network: NetworkSettings {
            hidden_units: vec![1024, 512],
            dueling: false,
            initialization: Initialization::Normal(0.01),
        },
        learning_rate: 3e-3,
        loss: Loss::Squared,
        gradient_norm_max: None,
        batch_len: 64,
        // "When the Replay Buffer reaches its capacity".
        learning_starts: 3000,
        updates_per_step: 1,
        target_period_updates: 100,
        average_decay: 0.0,
        double: true,
        discount: 0.9,
        n_step: 1,
        arrival_is_terminal: true,
        replay: ReplaySettings {
            replay_capacity: 3000,
            priority_exponent: 0.7,
            priority_floor: 0.01,
            priority_first: 0.01,
            importance_begin: 0.4,
            importance_end: 0.4,
            importance_updates: 1,
        },
        exploration: ExplorationSettings {
            exploration: Exploration::Linear,
            exploration_begin: 1.0,
            exploration_end: 0.1,
            exploration_steps: 6000,
            exploration_share: None,
            random_steps: 0,
            exploration_inverted: false,
            random_decay: 0.0,
            evaluation_epsilon: 0.1,
        },
        rules: RulesSettings { rules_leaves: 16, rules_depth: 8, rules_rounds: 5, rules_episodes: 40 },
    }
}

/// The published package with its faults: it bootstraps through arrival, knows no rule but a gate for
/// weather and time, and pays for a collision at the step that made the obstacle appear. The package has a
/// second table of weights for the traffic rows; here there is one table for all rows.
pub(super) fn released() -> LearnerSettings {
    let mut settings = LearnerSettings { preset: "released".to_owned(), ..paper() };
    settings.choice.masks_choice = false;
    settings.choice.masks_target = false;
    settings.choice.environment_gate_steps = 5;
    settings.payment.proc = ProcKind::Released;
    settings.payment.bound_is_safe = false;
    settings.payment.delayed_credit = true;
    settings.arrival_is_terminal = false;
    settings.exploration.exploration = Exploration::ExponentialThenEnd;
    settings.exploration.exploration_steps = 8500;
    settings.exploration.random_steps = 3000;
    settings.exploration.random_decay = 0.05;
    settings.exploration.evaluation_epsilon = 0.2;
    settings
}

/// Ours: scaled variables, learning from the first few hundred transitions, a dueling head, and R_col only for
/// collisions that count, paid where their obstacles were made. R_col, discount, averaging and how ε falls were chosen
/// by trainings on the crossroad against `planning_never_yields`, on an engine that is gone, with seeds that no study uses.
pub(super) fn avastra() -> LearnerSettings {
    let mut settings = LearnerSettings { preset: "avastra".to_owned(), ..paper() };
    settings.choice.state = StateSet::Extended;
    settings.choice.encoding = Encoding::Scaled;
    settings.payment.proc = ProcKind::Avastra;
    settings.payment.collision_reward = 20.0;
    settings.payment.uncounted_reward = 0.0;
    settings.payment.pays_maker = true;
    settings.network.hidden_units = vec![64, 64];
    settings.network.dueling = true;
    settings.network.initialization = Initialization::He;
    settings.learning_rate = 5e-4;
    settings.gradient_norm_max = Some(10.0);
    settings.learning_starts = 300;
    settings.target_period_updates = 200;
    settings.average_decay = 0.998;
    settings.discount = 0.3;
    settings.replay.replay_capacity = 20_000;
    settings.replay.priority_exponent = 0.6;
    settings.replay.priority_floor = 1e-3;
    settings.replay.priority_first = 1.0;
    settings.replay.importance_end = 1.0;
    settings.replay.importance_updates = 30_000;
    settings.exploration.exploration_end = 0.05;
    settings.exploration.exploration_steps = 3000;
    settings.exploration.exploration_share = Some(0.5);
    settings.exploration.evaluation_epsilon = 0.05;
    settings
}

/// DeepCollision as described: plain DQN over 12 raw variables, evenly drawn replay.
fn deep_collision() -> LearnerSettings {
    let mut settings = paper();
    // Its lateral safety distance has a margin, as ours has; the later paper left it out.
    settings.payment.proc = ProcKind::Avastra;
    settings.choice.state = StateSet::DeepCollision;
    settings.payment.collision_reward = 1.0;
    settings.payment.uncounted_reward = 1.0;
    settings.payment.bound_is_safe = false;
    settings.network.hidden_units = vec![200, 200];
    settings.network.initialization = Initialization::Normal(0.1);
    settings.learning_rate = 0.01;
    settings.batch_len = 32;
    settings.learning_starts = 2000;
    settings.double = false;
    settings.replay.replay_capacity = 2000;
    settings.replay.priority_exponent = 0.0;
    settings.replay.priority_first = 1.0;
    settings.replay.importance_begin = 0.0;
    settings.replay.importance_end = 0.0;
    settings
}

/// DeepCollision's published code: ε is the share of greedy choices, and falls; no rule is known, and
/// arrival ends nothing.
fn deep_collision_released() -> LearnerSettings {
    let mut settings = LearnerSettings { preset: "released".to_owned(), ..deep_collision() };
    settings.payment.proc = ProcKind::Released;
    settings.choice.masks_choice = false;
    settings.choice.masks_target = false;
    settings.arrival_is_terminal = false;
    settings.exploration.exploration = Exploration::Exponential;
    settings.exploration.exploration_inverted = true;
    settings.exploration.evaluation_epsilon = 0.2;
    settings
}
