//! Why a policy chooses as it does: which rows it prefers and when, which Q-values it expects in a state, and which
//! variables matter.

use crate::run::Arena;
use avastra_base::rng::Stream;
use avastra_lang::model::policy::{VARIABLES, VariableKind, variable_index};
use avastra_search::agent::{QPolicy, Visit};
use avastra_search::mdp::Observation;
use avastra_world::action::ActionTable;

use crate::train::importance::{Importance, importance, set};
use crate::train::visits::visits;

/// The result of [`insight`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Insight {
    /// Number of visited states.
    pub states: usize,
    /// Mean stake of the visited states: highest minus lowest Q-value of the open rows.
    pub stake: f64,
    /// The chosen rows, the most frequent first.
    pub rows: Vec<RowUse>,
    /// The state asked for; variables that were not given have their mean over the visited states.
    pub state: State,
    /// The variables, the most important first.
    pub importance: Vec<Importance>,
    /// Number of shuffles of each variable.
    pub repeats: u64,
}

/// How often and when a row is chosen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RowUse {
    pub row: usize,
    pub label: String,
    pub states: usize,
    /// Share of the states in which it was open.
    pub open: f64,
    /// Mean Q-value where it is chosen.
    pub q_value: f64,
    /// The variables that differ most between the states of this choice and all states: name, mean here, mean of
    /// all; means are text in the variable's unit.
    pub when: Vec<(&'static str, String, String)>,
}

/// One state and what the network expects in it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct State {
    /// Every variable that the network sees, with its value as text.
    pub variables: Vec<(&'static str, String)>,
    /// Index, name and Q-value of every row, the highest first. A state alone does not tell which rows are legal,
    /// so all are listed.
    pub q_values: Vec<(usize, String, f32)>,
}

/// Number of variables listed in [`RowUse::when`]. Ours.
const TELLING: usize = 3;
/// A variable whose mean differs by fewer standard deviations than this is not listed. Ours.
const TELLING_DEVIATIONS: f64 = 0.25;

/// Lets a policy drive so many episodes on each road, and says why it chooses as it does. `given` are values that
/// replace those of the mean state.
pub fn insight(
    arena: &Arena,
    policy: &QPolicy,
    given: &[(usize, f32)],
    (episodes, seed, repeats): (u64, u64, u64),
) -> Insight {
    let visits = visits(arena, policy, episodes, (seed, Stream::Evaluation, 0));
    let all: Vec<&Visit> = visits.iter().collect();
    let mut observation = mean(&all);
    for &(variable, value) in given {
        set(&mut observation, variable, value);
    }
    pack_weather(&mut observation);
    Insight {
        states: visits.len(),
        stake: visits.iter().map(Visit::stake).sum::<f64>() / visits.len().max(1) as f64,
        rows: rows(arena.table(), policy, &visits),
        state: state(arena.table(), policy, &observation),
        importance: importance(policy, &visits, repeats, seed),
        repeats,
    }
}

fn rows(table: &ActionTable, policy: &QPolicy, visits: &[Visit]) -> Vec<RowUse> {
    let all: Vec<&Visit> = visits.iter().collect();
    let everywhere = Spread::new(policy, &all);
    let mut rows: Vec<RowUse> = Vec::new();
    for row in table.rows() {
        let own: Vec<&Visit> = visits.iter().filter(|visit| visit.best == row.index).collect();
        if own.is_empty() {
            continue;
        }
        let open = visits.iter().filter(|visit| visit.open[row.index]).count();
        let q_values = own.iter().map(|visit| f64::from(visit.q_values[row.index]));
        rows.push(RowUse {
            row: row.index,
            label: row.label.clone(),
            states: own.len(),
            open: open as f64 / visits.len() as f64,
            q_value: q_values.sum::<f64>() / own.len() as f64,
            when: everywhere.telling(&own),
        });
    }
    rows.sort_by(|a, b| b.states.cmp(&a.states).then(a.row.cmp(&b.row)));
    rows
}

/// Means and deviations of the variables that a policy sees.
struct Spread {
    variables: Vec<usize>,
    mean: Observation,
    deviations: Vec<f64>,
}

impl Spread {
    fn new(policy: &QPolicy, visits: &[&Visit]) -> Spread {
        let variables = policy.variables().to_vec();
        let deviation = |&variable: &usize| {
            let mean = average(visits, variable);
            let squares = visits.iter().map(|visit| {
                let off = f64::from(visit.observation.get(variable)) - mean;
                off * off
            });
            libm::sqrt(squares.sum::<f64>() / visits.len().max(1) as f64)
        };
        let deviations = variables.iter().map(deviation).collect();
        Spread { variables, mean: mean(visits), deviations }
    }

    /// The variables whose mean over these visits differs from the mean over all by the most standard deviations.
    fn telling(&self, own: &[&Visit]) -> Vec<(&'static str, String, String)> {
        let here = mean(own);
        let mut telling: Vec<(f64, usize)> = self
            .variables
            .iter()
            .zip(&self.deviations)
            .filter(|(_, deviation)| **deviation > 0.0)
            .map(|(&variable, deviation)| {
                let off = f64::from(here.get(variable)) - f64::from(self.mean.get(variable));
                (off.abs() / deviation, variable)
            })
            .collect();
        telling.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let text = |&(_, variable): &(f64, usize)| {
            (VARIABLES[variable].name, show(&here, variable), show(&self.mean, variable))
        };
        telling.iter().filter(|(off, _)| *off >= TELLING_DEVIATIONS).take(TELLING).map(text).collect()
    }
}

fn average(visits: &[&Visit], variable: usize) -> f64 {
    let sum: f64 = visits.iter().map(|visit| f64::from(visit.observation.get(variable))).sum();
    sum / visits.len().max(1) as f64
}

/// The mean state: the mean of each quantity, the most frequent word of each variable with words.
fn mean(visits: &[&Visit]) -> Observation {
    let mut observation = Observation::zeros();
    for (variable, described) in VARIABLES.iter().enumerate() {
        let value = match described.kind {
            VariableKind::Quantity { .. } => average(visits, variable) as f32,
            VariableKind::Words { words, .. } => {
                let count = |value: f32| {
                    visits.iter().filter(|visit| visit.observation.get(variable) == value).count()
                };
                let most = |best: f32, value: f32| if count(value) > count(best) { value } else { best };
                words.iter().map(|(_, value)| *value).reduce(most).unwrap_or(0.0)
            }
        };
        set(&mut observation, variable, value);
    }
    observation
}

/// Computes the paper's one number for the weather from its three parts.
fn pack_weather(observation: &mut Observation) {
    let index = |name| variable_index(name).expect("it is a variable");
    let [rain, fog, wetness] = ["rain", "fog", "wetness"].map(|name| observation.get(index(name)));
    set(observation, index("weather"), 100.0 * rain + 10.0 * fog + wetness);
}

fn state(table: &ActionTable, policy: &QPolicy, observation: &Observation) -> State {
    let variables = policy.variables().iter();
    let q_values = policy.q_values(observation);
    let mut q_values: Vec<(usize, String, f32)> =
        table.rows().iter().zip(&q_values).map(|(row, &q)| (row.index, row.label.clone(), q)).collect();
    q_values.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)));
    State {
        variables: variables.map(|&one| (VARIABLES[one].name, show(observation, one))).collect(),
        q_values,
    }
}

/// A variable's value in its unit, to two decimals.
fn show(observation: &Observation, variable: usize) -> String {
    let value = observation.get(variable);
    match VARIABLES[variable].kind {
        VariableKind::Words { .. } => match VARIABLES[variable].word(value) {
            Some(word) => word.to_owned(),
            None => format!("{value:.2}"),
        },
        VariableKind::Quantity { unit, .. } => {
            // Avoids `-0.00`.
            let value = (f64::from(value) * 100.0).round() / 100.0 + 0.0;
            format!("{value:.2} {unit}").trim_end().to_owned()
        }
    }
}
