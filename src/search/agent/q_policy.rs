//! A policy that acts: ε-greedy over the rows that are open to it, by its network or by its rules.

use std::sync::Arc;

use ndarray::{Array1, ArrayView1, ArrayView2, Axis};

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_lang::model::Policy;
use avastra_lang::model::policy::PolicyRule;
use avastra_world::action::ActionTable;

use super::acting::{Agent, Mask};
use super::checked::SettingsError;
use super::choice::Rows;
use super::decision::chosen_by;
use super::features::Features;
use super::learner::LearnerSettings;
use super::network::{Network, Shape};
use super::presets::of_record;
use super::quirks::Quirks;
use super::random::any;
use super::trajectory::Trajectory;

/// Which of the two faces of a policy chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// The exact network.
    #[default]
    Network,
    /// The readable rules that were distilled from it.
    Rules,
}

/// A Q-network with everything that it takes to act.
#[derive(Debug, Clone)]
pub struct QPolicy {
    pub(super) settings: Arc<LearnerSettings>,
    pub(super) features: Features,
    pub(super) rows: Arc<Rows>,
    pub(super) network: Network,
    /// Rules that choose in place of the network.
    rules: Option<Arc<Vec<PolicyRule>>>,
    pub(super) quirks: Quirks,
}

impl QPolicy {
    /// Shape of the network that these settings need for a table of `rows` rows.
    pub fn shape(settings: &LearnerSettings, rows: usize) -> Shape {
        let inputs = Features::new(settings.choice.state, settings.choice.encoding).len();
        let hidden = settings.network.hidden_units.iter().copied();
        let layers = core::iter::once(inputs).chain(hidden).chain([rows]).collect();
        Shape { layers, dueling: settings.network.dueling }
    }

    /// The network must have the [`QPolicy::shape`] of the settings.
    pub fn new(settings: Arc<LearnerSettings>, rows: Arc<Rows>, network: Network) -> QPolicy {
        assert_eq!(*network.shape(), QPolicy::shape(&settings, rows.allowed.len()), "the network fits");
        let features = Features::new(settings.choice.state, settings.choice.encoding);
        let quirks = Quirks::new(&settings, rows.allowed.len());
        QPolicy { settings, features, rows, network, rules: None, quirks }
    }

    /// The policy that a file describes, for the table that it is to choose from.
    ///
    /// # Errors
    /// If its settings cannot be read, or describe another network than it has.
    pub fn read(file: &Policy, table: &ActionTable) -> Result<QPolicy, SettingsError> {
        let settings = of_record(&file.hyperparameters)?;
        let rows = Rows::new(table, &settings.choice.actions)?;
        let shape = Shape { layers: file.layers.clone(), dueling: file.dueling };
        if shape != QPolicy::shape(&settings, rows.allowed.len()) {
            let message = "the network is not the one that its settings describe";
            return Err(SettingsError::Text(message.to_owned()));
        }
        // The checker has counted the weights.
        let network = Network::from_parameters(shape, file.parameters.clone());
        Ok(QPolicy::new(Arc::new(settings), Arc::new(rows), network))
    }

    /// This policy with rules in place of the network; exploration, gate and masks stay.
    pub fn with_rules(&self, rules: Arc<Vec<PolicyRule>>) -> QPolicy {
        QPolicy { rules: Some(rules), ..self.clone() }
    }

    pub fn settings(&self) -> &LearnerSettings {
        &self.settings
    }

    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The variables that the network sees, by index.
    pub fn variables(&self) -> &[usize] {
        &self.features.variables
    }

    /// Q-values of a state, shape `(rows,)`.
    pub fn q_values(&self, observation: &Observation) -> Array1<f32> {
        self.values(&self.features.encode(observation))
    }

    /// Q-values of a state that is encoded already, shape `(rows,)`.
    pub(super) fn values(&self, inputs: &[f32]) -> Array1<f32> {
        let inputs = ArrayView2::from_shape((1, inputs.len()), inputs).expect("one row of its length");
        self.network.q_values(inputs).index_axis_move(Axis(0), 0)
    }

    /// Rows to choose from, shape `(rows,)`; `None` if no row is legal. Rules choose among legal rows whatever the settings
    /// say.
    pub(super) fn open(&self, legal: &mut dyn Mask) -> Option<Vec<bool>> {
        match self.looks_at_mask() {
            true => Some(self.legal_rows(legal.all()?.view())),
            false => legal.any().then(|| self.allowed_now(core::iter::repeat_n(true, legal.rows()))),
        }
    }

    /// Rows to choose from that are legal, shape `(rows,)`.
    pub fn legal_rows(&self, legal: ArrayView1<bool>) -> Vec<bool> {
        self.allowed_now(legal.iter().copied())
    }

    fn allowed_now(&self, candidates: impl Iterator<Item = bool>) -> Vec<bool> {
        let rows = self.rows.allowed.iter().zip(candidates).enumerate();
        let passes = |row: usize| self.quirks.lets_pass(row, self.rows.environment[row]);
        rows.map(|(row, (&allowed, candidate))| allowed && candidate && passes(row)).collect()
    }

    /// The reward of each step of an episode by the settings, shape `(steps,)`.
    pub(super) fn rewards(&self, episode: &Trajectory) -> Vec<f64> {
        let payment = &self.settings.payment;
        match payment.pays_maker {
            true => payment.paid_to_makers(episode),
            false => self.quirks.rewards(episode),
        }
    }

    /// Takes note of the row that was chosen.
    pub(super) fn chosen(&mut self, row: usize) {
        self.quirks.chosen(row, self.rows.environment[row]);
    }

    /// The open row of the highest Q-value, the first of equals.
    pub fn greedy(&self, observation: &Observation, open: &[bool]) -> Option<usize> {
        best(self.q_values(observation).view(), open)
    }
}

/// The trained policy.
impl Agent for QPolicy {
    fn begin(&mut self, _: u64) {
        self.quirks.begin();
    }

    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let open = self.open(legal)?;
        let explores = rng::unit(rng) < self.settings.exploration.evaluation_epsilon;
        let row = match &self.rules {
            _ if explores => any(&open, rng),
            Some(rules) => chosen_by(rules, observation, &open),
            None => self.greedy(observation, &open),
        }?;
        self.chosen(row);
        Some(row)
    }

    fn looks_at_mask(&self) -> bool {
        self.settings.choice.masks_choice || self.rules.is_some()
    }
}

/// The open row of the largest value, the first of equals.
pub(super) fn best(values: ArrayView1<f32>, open: &[bool]) -> Option<usize> {
    let rows = values.iter().zip(open).enumerate().filter(|(_, (_, is_open))| **is_open);
    let better = |best: Option<(usize, f32)>, (row, value): (usize, f32)| match best {
        Some((_, most)) if most >= value => best,
        _ => Some((row, value)),
    };
    rows.map(|(row, (&value, _))| (row, value)).fold(None, better).map(|(row, _)| row)
}
