//! The observation and the choices of an agent.

use avastra_lang::model::EffectDef;
use avastra_world::action::ActionTable;

use super::checked::{SettingsError, hint};
use super::features::{Encoding, StateSet};

/// The state variables and actions of the agent.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChoiceSettings {
    /// State variables that the agent sees (RQ2).
    pub state: StateSet,
    /// How these variables go into the network.
    pub encoding: Encoding,
    /// Names of the actions and groups that the agent may choose from (RQ2); empty: all.
    pub actions: Vec<String>,
    /// Whether the agent chooses only among rows that the rules allow. If not, a forbidden choice loses
    /// the step.
    pub masks_choice: bool,
    /// Whether the learning target considers only rows that the rules allow.
    pub masks_target: bool,
    /// Steps that must pass between two changes of weather or time; 0: no gate. Published package: 5. A
    /// quirk (see `quirks`).
    pub environment_gate_steps: u32,
}

/// An agent's knowledge of the rows before any episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Whether the agent may choose the row at all, shape `(rows,)`.
    pub allowed: Vec<bool>,
    /// Whether the row changes weather or time alone, and makes no road user appear, shape `(rows,)`.
    pub environment: Vec<bool>,
}

impl Rows {
    /// The rows of a table; `actions` names the actions and groups that are allowed, empty: all.
    ///
    /// # Errors
    /// If the space has no action or group of such a name.
    pub fn new(table: &ActionTable, actions: &[String]) -> Result<Rows, SettingsError> {
        let space = table.space();
        let mut allowed = vec![actions.is_empty(); space.actions.len()];
        for name in actions {
            let action = space.actions.iter().position(|action| action.name == *name);
            let group = space.groups.iter().find(|group| group.name == *name);
            match (action, group) {
                (Some(action), _) => allowed[action] = true,
                (None, Some(group)) => group.actions.iter().for_each(|&action| allowed[action] = true),
                (None, None) => {
                    let actions = space.actions.iter().map(|action| action.name.as_str());
                    let groups = space.groups.iter().map(|group| group.name.as_str());
                    let hint = hint(name, actions.chain(groups));
                    let message = format!("`actions`: the space has no action or group `{name}`{hint}");
                    return Err(SettingsError::Text(message));
                }
            }
        }
        let is_environment = |action: usize| {
            !space.actions[action].effects.iter().any(|effect| matches!(effect, EffectDef::Spawn(_)))
        };
        Ok(Rows {
            allowed: table.rows().iter().map(|row| allowed[row.action]).collect(),
            environment: table.rows().iter().map(|row| is_environment(row.action)).collect(),
        })
    }
}
