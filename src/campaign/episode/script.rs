//! Scripts: the choices of a recorded episode, to be made again.

use std::sync::Arc;

use avastra_lang::model::{Scenario, Trigger, Value};
use avastra_world::action::{ActionTable, Draw, Refusal, Situation};

use super::log::{EpisodeLog, Outcome};
use super::run::{Choice, Moment};

/// The action of each step, from step 0; `None` is a step without an action.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Script {
    pub steps: Vec<Option<ScriptedAction>>,
}

/// A row, and how it is to be carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct ScriptedAction {
    pub row: usize,
    /// Values of the `any` parameters.
    pub values: Vec<(Arc<str>, Value)>,
    /// When within the step; `None`: at once.
    pub trigger: Option<Arc<Trigger>>,
}

impl ScriptedAction {
    /// The action under the rules of the run, or its refusals.
    pub(super) fn judged(&self, table: &ActionTable, situation: &Situation) -> Result<Draw, Vec<Refusal>> {
        table.check(situation, self.row, &self.values)
    }
}

impl Script {
    /// The choices that a log records.
    pub fn of_log(log: &EpisodeLog) -> Script {
        let step = |outcome: &Outcome| match outcome {
            Outcome::Done { draw, delay_ticks, .. } => {
                let trigger = Trigger { once: None, held_ticks: 0, after_ticks: *delay_ticks };
                let trigger = (*delay_ticks > 0).then(|| Arc::new(trigger));
                Some(ScriptedAction { row: draw.row, values: draw.values.clone(), trigger })
            }
            Outcome::Passed | Outcome::Refused { .. } => None,
        };
        Script { steps: log.steps.iter().map(|logged| step(&logged.outcome)).collect() }
    }

    /// The choices that a scenario lists; steps that it leaves out pass without an action.
    pub fn of_scenario(scenario: &Scenario) -> Script {
        let mut steps = Vec::new();
        for step in &scenario.steps {
            steps.resize(step.number as usize, None);
            steps.push(step.row.map(|row| ScriptedAction {
                row,
                values: step.drawn.clone(),
                trigger: step.trigger.clone(),
            }));
        }
        Script { steps }
    }

    /// The choice at a moment: the recorded action under the rules of the run, or its refusal. An action with a trigger is
    /// judged when the trigger says so.
    pub fn choose(&self, moment: &Moment) -> Choice {
        match self.steps.get(moment.step) {
            None => Choice::Stop,
            Some(None) => Choice::Pass,
            Some(Some(action)) if action.trigger.is_some() => Choice::Await(action.clone()),
            Some(Some(action)) => {
                Choice::judged(action.row, action.judged(&moment.setup().table, moment.situation))
            }
        }
    }
}
