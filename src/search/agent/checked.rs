//! Settings that are changed by name and checked, and why they are refused.

use core::fmt::Display;
use core::ops::Bound::{Excluded, Included};
use core::ops::RangeBounds;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use avastra_lang::syntax::{nearest, settings_mistake};

/// Why settings are refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    #[error("{0}")]
    Text(String),
    #[error("no preset `{name}` for this agent: it has {known}")]
    Preset { name: String, known: String },
    #[error("the settings say `preset: {own}`, and `--preset {asked}` was asked for: leave one of them out")]
    TwoPresets { own: String, asked: String },
    #[error("no setting `{name}`{hint}")]
    Unknown { name: String, hint: String },
    #[error("this agent has no setting `{name}`: it is one of {owners}")]
    Elsewhere { name: String, owners: String },
    #[error("`{name}` is {value}, but must be {wanted}")]
    Range { name: &'static str, value: String, wanted: &'static str },
}

/// The one of some names that is most like an unknown one, as the end of a message; empty if none is.
pub(super) fn hint<'a>(unknown: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(unknown, names).map_or(String::new(), |name| format!(": did you mean `{name}`?"))
}

/// Settings whose values have ranges.
pub(super) trait Checked: Serialize + DeserializeOwned {
    /// # Errors
    /// If a value is out of range.
    fn check(&self) -> Result<(), SettingsError>;
}

/// Settings with changes by name, checked.
pub(super) fn changed<T: Checked>(base: &T, changes: Map<String, Value>) -> Result<T, SettingsError> {
    let read = |record| {
        serde_json::from_value::<T>(Value::Object(record))
            .map_err(|error| settings_mistake(&error.to_string(), None))
    };
    let mut whole = record(base);
    for (name, value) in changes {
        if !whole.contains_key(&name) {
            let hint = hint(&name, whole.keys().map(String::as_str));
            return Err(SettingsError::Unknown { name, hint });
        }
        // Each change is tried alone, so that an error names the setting that is wrong.
        let mut alone = record(base);
        alone.insert(name.clone(), value.clone());
        read(alone).map_err(|mistake| SettingsError::Text(format!("`{name}`: {mistake}")))?;
        whole.insert(name, value);
    }
    let settings = read(whole).map_err(SettingsError::Text)?;
    settings.check()?;
    Ok(settings)
}

/// Every setting by name.
pub(super) fn record(settings: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(settings).expect("settings are plain data") {
        Value::Object(record) => record,
        _ => unreachable!("a struct is an object"),
    }
}

/// A requirement of a setting, and whether it is met.
pub(super) struct Requirement {
    pub name: &'static str,
    pub is_met: bool,
    pub value: String,
    pub wanted: &'static str,
}

/// The requirement that a value lies in a range; `wanted` is the range in words.
pub(super) fn within<T: PartialOrd + Display>(
    name: &'static str,
    value: T,
    range: impl RangeBounds<T>,
    wanted: &'static str,
) -> Requirement {
    Requirement { name, is_met: range.contains(&value), value: value.to_string(), wanted }
}

/// The requirement that a value is a share or a probability.
pub(super) fn unit(name: &'static str, value: f64) -> Requirement {
    within(name, value, 0.0..=1.0, "from 0 to 1")
}

pub(super) fn positive(name: &'static str, value: f64) -> Requirement {
    within(name, value, (Excluded(0.0), Included(1e6)), "above 0, and at most 1e6")
}

pub(super) fn count(name: &'static str, value: u64, most: u64) -> Requirement {
    within(name, value, 1..=most, "a whole number from 1, and not enormous")
}

/// Refuses settings by the first requirement that is not met.
pub(super) fn require(requirements: impl IntoIterator<Item = Requirement>) -> Result<(), SettingsError> {
    match requirements.into_iter().find(|requirement| !requirement.is_met) {
        Some(Requirement { name, value, wanted, .. }) => Err(SettingsError::Range { name, value, wanted }),
        None => Ok(()),
    }
}
