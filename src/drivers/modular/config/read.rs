//! Profiles: a configuration from text, and its mistakes in the author's words.

use serde_json::{Map, Value};

use crate::kit::{PedalsConfig, SteeringConfig};
use avastra_lang::model::digest;
use avastra_lang::syntax::{nearest, read_yaml};

use super::ModularConfig;
use super::driving::{ActuatorsConfig, PlanningConfig, PredictionConfig};
use super::safety::EmergencyConfig;
use super::sensing::{LocalizationConfig, PerceptionConfig, TrackingConfig};
use super::timing::LatencyConfig;

/// Why a profile cannot be used. The message does not name the file: the caller puts the name before it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    #[error("no YAML: {reason}")]
    Yaml { reason: String },
    #[error("the profile is empty; write what differs from `scenarios/ads/default.yaml`, or `{{}}`")]
    Empty,
    #[error("{}`{key}` is no setting{hint}", at(*line))]
    Unknown { line: Option<usize>, key: String, hint: String },
    #[error("{}{key} is {found}; write {wanted}", at(*line))]
    Type { line: Option<usize>, key: String, found: String, wanted: &'static str },
    #[error("{}`{key}` is {value}; write a value from {low} to {high}", at(*line))]
    Range { line: Option<usize>, key: String, value: String, low: f64, high: f64 },
}

fn at(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!("line {line}: "))
}

/// Names of numbers, each with its least and greatest value.
type Ranges = &'static [(&'static str, f64, f64)];

/// Every section that has numbers, with their ranges.
const SECTIONS: &[(&str, Ranges)] = &[
    ("localization", LocalizationConfig::RANGES),
    ("perception", PerceptionConfig::RANGES),
    ("tracking", TrackingConfig::RANGES),
    ("prediction", PredictionConfig::RANGES),
    ("planning", PlanningConfig::RANGES),
    ("control.steering", SteeringConfig::RANGES),
    ("control.pedals", PedalsConfig::RANGES),
    ("control.actuators", ActuatorsConfig::RANGES),
    ("emergency", EmergencyConfig::RANGES),
    ("latency", LatencyConfig::RANGES),
];

impl ModularConfig {
    /// Reads a profile; see `scenarios/ads/default.yaml`. What it leaves out keeps its default.
    ///
    /// # Errors
    /// Text that is no YAML or says nothing at all, a key that does not exist, a value of the wrong type
    /// or out of its range.
    pub fn from_yaml(text: &str) -> Result<ModularConfig, ConfigError> {
        let file: Value = read_yaml(text).map_err(|reason| ConfigError::Yaml { reason })?;
        let mut whole =
            serde_json::to_value(ModularConfig::default()).expect("a configuration is plain data");
        // An empty file is more likely a slip, or was cut off, than a wish for the default.
        if file.is_null() {
            return Err(ConfigError::Empty);
        }
        overlay(text, "", &file, &mut whole)?;
        Ok(serde_json::from_value(whole).expect("every value has been checked against the default's"))
    }

    /// What differs from the default, as a profile in one line: `{planning: {cruise_mps: 8.0}}`. Empty
    /// for the default itself.
    pub fn to_line(&self) -> String {
        let [own, usual] = self.beside_default();
        difference(&own, &usual).unwrap_or_default()
    }

    /// What differs from the default, for a heading: the setting if it is one, else how many of which parts. Empty for the
    /// default itself.
    pub fn in_words(&self) -> String {
        let [own, usual] = self.beside_default();
        let changed = changed(&own, &usual, "");
        match changed.as_slice() {
            [] => String::new(),
            [(path, value)] => format!("{path}: {value}"),
            all => {
                // The settings of a part follow each other.
                let parts = all.iter().filter_map(|(path, _)| path.split('.').next());
                let mut parts: Vec<&str> = parts.collect();
                parts.dedup();
                format!("{} changed settings of {}", all.len(), parts.join(", "))
            }
        }
    }

    /// These settings and the default ones, as plain data.
    fn beside_default(&self) -> [Value; 2] {
        [self, &ModularConfig::default()]
            .map(|config| serde_json::to_value(config).expect("a configuration is plain data"))
    }

    /// Digest of all settings, `sha256:` and 64 digits. Profiles with equal settings have equal digests.
    pub fn digest(&self) -> String {
        let text = serde_json::to_string(self).expect("a configuration is plain data");
        digest(text.as_bytes())
    }
}

/// The settings that differ: paths such as `planning.cruise_mps`, and their values.
fn changed(own: &Value, usual: &Value, path: &str) -> Vec<(String, Value)> {
    match (own, usual) {
        (Value::Object(own), Value::Object(usual)) => {
            let of = |(key, value): (&String, &Value)| {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                changed(value, usual.get(key).unwrap_or(&Value::Null), &path)
            };
            own.iter().flat_map(of).collect()
        }
        _ if own == usual => Vec::new(),
        _ => vec![(path.to_owned(), own.clone())],
    }
}

/// Puts the values of a file, or of its section at `path`, over those of the default.
fn overlay(text: &str, path: &str, file: &Value, whole: &mut Value) -> Result<(), ConfigError> {
    let mistake = |wanted| ConfigError::Type {
        line: line_of(text, path),
        key: if path.is_empty() { "the profile".to_owned() } else { format!("`{path}`") },
        found: kind(file),
        wanted,
    };
    match whole {
        Value::Object(known) => {
            let Value::Object(file) = file else { return Err(mistake("a section of `key: value` lines")) };
            for (key, value) in file {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                match known.get_mut(key) {
                    Some(slot) => overlay(text, &path, value, slot)?,
                    None => return Err(unknown(text, &path, key, known)),
                }
            }
            return Ok(());
        }
        Value::Bool(_) if !file.is_boolean() => return Err(mistake("`true` or `false`")),
        Value::Number(usual) if usual.is_u64() && file.as_u64().is_none() => {
            return Err(mistake("a whole number"));
        }
        Value::Number(_) if !file.is_number() => return Err(mistake("a number")),
        _ => {}
    }
    if let Some(value) = file.as_f64() {
        let (low, high) = range(path);
        if !(low..=high).contains(&value) {
            let line = line_of(text, path);
            let value = line.and_then(|line| as_written(text, line, path, value));
            let value = value.unwrap_or_else(|| file.to_string());
            return Err(ConfigError::Range { line, key: path.to_owned(), value, low, high });
        }
        // `8` and `8.0` are one setting and must have one digest.
        if whole.is_f64() {
            *whole = Value::from(value);
            return Ok(());
        }
    }
    *whole = file.clone();
    Ok(())
}

fn unknown(text: &str, path: &str, key: &str, known: &Map<String, Value>) -> ConfigError {
    let hint = match nearest(key, known.keys().map(String::as_str)) {
        Some(near) => format!("; did you mean `{near}`?"),
        None => match place_of(key) {
            Some(place) => format!(" here; it belongs under `{place}`"),
            None => "; `scenarios/ads/default.yaml` lists them all".to_owned(),
        },
    };
    ConfigError::Unknown { line: line_of(text, path), key: path.to_owned(), hint }
}

/// The section that has a number of this name.
fn place_of(key: &str) -> Option<&'static str> {
    SECTIONS.iter().find(|(_, ranges)| ranges.iter().any(|(name, ..)| *name == key)).map(|(name, _)| *name)
}

fn range(path: &str) -> (f64, f64) {
    let (section, key) = path.rsplit_once('.').unwrap_or(("", path));
    let ranges = SECTIONS.iter().filter(|(name, _)| *name == section).flat_map(|(_, ranges)| ranges.iter());
    let found = ranges.into_iter().find(|(name, ..)| *name == key);
    found.map_or((f64::MIN, f64::MAX), |(_, low, high)| (*low, *high))
}

fn kind(value: &Value) -> String {
    match value {
        Value::Null => "empty".to_owned(),
        Value::String(text) => format!("the text `{text}`"),
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "a section".to_owned(),
        Value::Bool(_) | Value::Number(_) => format!("`{value}`"),
    }
}

/// The line (from 1) of the last key of a path. Each key is searched for from the line of the key before
/// it.
fn line_of(text: &str, path: &str) -> Option<usize> {
    let lines: Vec<&str> = text.lines().collect();
    let mut line = 0;
    for key in path.split('.').filter(|key| !key.is_empty()) {
        let holds = |line: &&str| {
            let code = line.split('#').next().unwrap_or_default();
            let mut words = code.split(|c: char| c.is_whitespace() || "{,\"'".contains(c));
            words.any(|word| word.strip_prefix(key).is_some_and(|rest| rest.starts_with(':')))
                || code.contains(&format!("{key}\":"))
                || code.contains(&format!("{key} :"))
        };
        line += lines[line..].iter().position(holds)?;
    }
    (!path.is_empty()).then_some(line + 1)
}

/// A number as the line of its key has it, `3.50`; `None` if it does not stand there in such a form.
fn as_written(text: &str, line: usize, path: &str, value: f64) -> Option<String> {
    let key = path.rsplit('.').next().unwrap_or(path);
    let (_, after) = text.lines().nth(line - 1)?.rsplit_once(key)?;
    let after = after.trim_start_matches(['"', '\'', ' ', ':']);
    let number = after.split(|c: char| c.is_whitespace() || ",}#".contains(c)).next()?;
    (number.parse::<f64>() == Ok(value)).then(|| number.to_owned())
}

/// The part of `own` that differs from `usual`, as flow YAML.
fn difference(own: &Value, usual: &Value) -> Option<String> {
    let (Value::Object(own), Value::Object(usual)) = (own, usual) else {
        return (own != usual).then(|| own.to_string());
    };
    let parts: Vec<String> = own
        .iter()
        .filter_map(|(key, value)| difference(value, &usual[key]).map(|text| format!("{key}: {text}")))
        .collect();
    (!parts.is_empty()).then(|| format!("{{{}}}", parts.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shipped(name: &str) -> String {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/ads").join(name);
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn the_file_is_the_default_and_every_setting_in_it_is_explained() {
        let text = shipped("default.yaml");
        assert_eq!(ModularConfig::from_yaml(&text).unwrap(), ModularConfig::default());
        let written: Value = read_yaml(&text).unwrap();
        assert_eq!(written, serde_json::to_value(ModularConfig::default()).unwrap(), "nothing is left out");
        let lines: Vec<&str> = text.lines().collect();
        for pair in lines.windows(2).filter(|pair| pair[1].contains(": ") && !pair[1].contains('#')) {
            assert!(pair[0].trim_start().starts_with("# "), "no comment above `{}`", pair[1]);
        }
    }

    #[test]
    fn every_number_has_a_range() {
        fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
            match value {
                Value::Object(map) => {
                    let dot = if at.is_empty() { "" } else { "." };
                    map.iter().for_each(|(key, value)| numbers(value, &format!("{at}{dot}{key}"), found));
                }
                Value::Number(_) => found.push(at.into()),
                _ => {}
            }
        }
        let mut found = Vec::new();
        numbers(&serde_json::to_value(ModularConfig::default()).unwrap(), "", &mut found);
        assert!(found.len() > 90);
        for path in found {
            assert!(range(&path).1 < f64::MAX, "{path}");
        }
    }

    #[test]
    fn mistakes_are_told_with_line_and_remedy() {
        let told = |text: &str| ModularConfig::from_yaml(text).unwrap_err().to_string();
        let cases = [
            (
                "planning:\n  reserve_s: 1\n",
                "line 2: `planning.reserve_s` is no setting here; it belongs under `tracking`",
            ),
            ("plan:\n  a: 1\n", "line 1: `plan` is no setting; `scenarios/ads/default.yaml` lists them all"),
            (
                "{planning: {cruise_mps: fast}}",
                "line 1: `planning.cruise_mps` is the text `fast`; write a number",
            ),
            ("planning: 7", "line 1: `planning` is `7`; write a section of `key: value` lines"),
            ("tracking: {perfect: 1}", "line 1: `tracking.perfect` is `1`; write `true` or `false`"),
            (
                "perception:\n  latency_frames: 1.5\n",
                "line 2: `perception.latency_frames` is `1.5`; write a whole number",
            ),
            (
                "perception:\n  range_factor: 3.50 # far\n",
                "line 2: `perception.range_factor` is 3.50; write a value from 0.05 to 2",
            ),
            ("- 1\n", "the profile is a list; write a section of `key: value` lines"),
        ];
        for (text, message) in cases {
            assert_eq!(told(text), message);
        }
        for text in ["~\n", "# nothing yet\n"] {
            assert!(told(text).starts_with("the profile is empty; write"), "{text}: {}", told(text));
        }
        assert!(told("planning: [").starts_with("no YAML: "), "{}", told("planning: ["));
        assert!(told("planning:\n  cruise_mps: .nan\n").contains("cruise_mps"));
    }

    #[test]
    fn a_profile_goes_through_a_line_and_keeps_its_digest() {
        let text = "planning: {cruise_mps: 8, stop_gap_m: 4.5}\nweaknesses: {bounded_jerk: false}";
        let config = ModularConfig::from_yaml(text).unwrap();
        let line = config.to_line();
        assert_eq!(line, "{planning: {cruise_mps: 8.0, stop_gap_m: 4.5}, weaknesses: {bounded_jerk: false}}");
        let again = ModularConfig::from_yaml(&line).unwrap();
        assert_eq!((again, again.digest()), (config, config.digest()));
        assert_ne!(config.digest(), ModularConfig::default().digest());
        assert_eq!(ModularConfig::default().to_line(), "");
        assert_eq!(ModularConfig::from_yaml("{}").unwrap(), ModularConfig::default());
    }
}
