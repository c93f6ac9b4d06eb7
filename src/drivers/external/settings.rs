//! How a driving system outside this program is reached and asked: the `ads` block of a profile.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use avastra_lang::syntax::read_yaml;
use avastra_world::sim::{DT_S, FRAME_S};

use super::message::{AnswerKind, Observation};

/// The settings of an external driving system; docs/reference/protocol.md, "The profile".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExternalSettings {
    /// The program to start, or the address to connect to.
    pub command: Target,
    /// Where a program is started; where avastra runs if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub working_directory: Option<PathBuf>,
    /// Variables of the environment that the program gets besides avastra's own.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub env: BTreeMap<String, String>,
    #[serde(default)]
    pub observation: Observation,
    /// The kind of answer that is asked for; the program's choice if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<AnswerKind>,
    /// Simulated time between two steps, s, in `[0.02, 1]`.
    #[serde(default = "usual_period", rename = "period")]
    pub period_s: f64,
    /// Simulated time until an answer is obeyed, s, in `[0, 2]`.
    #[serde(default, rename = "latency")]
    pub latency_s: f64,
    #[serde(default)]
    pub on_timeout: OnTimeout,
    #[serde(default)]
    pub timeouts: Timeouts,
}

fn usual_period() -> f64 {
    FRAME_S
}

/// The effect of a missed step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnTimeout {
    /// A finding; the episode ends.
    #[default]
    Strict,
    /// The last answer holds on, for a while.
    Hold,
}

/// Limits by the wall clock, s, each in `[0.001, 3600]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Timeouts {
    #[serde(rename = "init")]
    pub init_s: f64,
    #[serde(rename = "map")]
    pub map_s: f64,
    #[serde(rename = "reset")]
    pub reset_s: f64,
    #[serde(rename = "step")]
    pub step_s: f64,
    #[serde(rename = "close")]
    pub close_s: f64,
}

impl Default for Timeouts {
    fn default() -> Timeouts {
        Timeouts { init_s: 60.0, map_s: 60.0, reset_s: 10.0, step_s: 1.0, close_s: 5.0 }
    }
}

/// Where a driving system is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub enum Target {
    /// A program, and its arguments; started without a shell.
    Program(Vec<String>),
    /// A host and port that listens.
    Tcp(String),
    /// A Unix socket that listens.
    Unix(PathBuf),
}

/// A target as a profile has it: one string, or a list of arguments.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "write one string, or a list of strings: the program and its arguments")]
enum Written {
    Text(String),
    List(Vec<String>),
}

impl TryFrom<Written> for Target {
    type Error = String;

    fn try_from(written: Written) -> Result<Target, String> {
        match written {
            Written::Text(text) => Target::from_text(&text),
            Written::List(words) if words.first().is_none_or(String::is_empty) => {
                Err("`command` is empty: write the program and its arguments".to_owned())
            }
            Written::List(words) => Ok(Target::Program(words)),
        }
    }
}

impl From<Target> for Written {
    fn from(target: Target) -> Written {
        match target {
            Target::Program(words) => Written::List(words),
            Target::Tcp(_) | Target::Unix(_) => Written::Text(target.text()),
        }
    }
}

impl Target {
    /// From a command line: words are parted at blanks, quotes hold them together; or `tcp:HOST:PORT`, `unix:PATH`.
    ///
    /// # Errors
    /// The mistake, in words.
    pub fn from_text(text: &str) -> Result<Target, String> {
        if let Some(address) = text.strip_prefix("tcp:") {
            let has_port = address.rsplit_once(':').is_some_and(|(host, port)| {
                !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0)
            });
            let wrong = || format!("`{text}` is no address: write `tcp:HOST:PORT`");
            return if has_port { Ok(Target::Tcp(address.to_owned())) } else { Err(wrong()) };
        }
        if let Some(path) = text.strip_prefix("unix:") {
            let wrong = || "`unix:` needs the path of a socket: write `unix:PATH`".to_owned();
            return if path.is_empty() { Err(wrong()) } else { Ok(Target::Unix(PathBuf::from(path))) };
        }
        let words = words(text)?;
        if words.first().is_none_or(String::is_empty) {
            return Err("the command is empty: write the program and its arguments".to_owned());
        }
        Ok(Target::Program(words))
    }

    /// Whether it is connected to and not started.
    pub fn is_socket(&self) -> bool {
        matches!(self, Target::Tcp(_) | Target::Unix(_))
    }

    /// As a person would write it.
    pub fn text(&self) -> String {
        match self {
            Target::Program(words) => {
                let plain = |word: &String| {
                    !word.is_empty() && !word.chars().any(|c| c.is_whitespace() || c == '\'' || c == '"')
                };
                let quoted = |word: &String| match word.contains('\'') {
                    true => format!("\"{word}\""),
                    false => format!("'{word}'"),
                };
                let words = words.iter().map(|word| if plain(word) { word.clone() } else { quoted(word) });
                words.collect::<Vec<_>>().join(" ")
            }
            Target::Tcp(address) => format!("tcp:{address}"),
            Target::Unix(path) => format!("unix:{}", path.to_string_lossy()),
        }
    }
}

/// The words of a command line. There is no escape, no variable and no pattern: what is written is what is passed.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote: Option<char> = None;
    for c in text.chars() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), c) => word.get_or_insert_default().push(c),
            (None, '\'' | '"') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, c) if c.is_whitespace() => words.extend(word.take()),
            (None, c) => word.get_or_insert_default().push(c),
        }
    }
    match quote {
        Some(open) => Err(format!("the quote {open} in `{text}` is not closed")),
        None => {
            words.extend(word);
            Ok(words)
        }
    }
}

/// Why an `ads` block cannot be used. The message does not name the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExternalError {
    #[error("{0}")]
    Yaml(String),
    #[error("`ads` is a block: write `ads: {{ command: … }}`")]
    NoBlock,
    #[error("`ads.{name}` is {found}; write a value from {low} to {high}, in s{more}")]
    Range { name: &'static str, found: String, low: f64, high: f64, more: &'static str },
}

/// A profile with an `ads` block.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Profile {
    ads: ExternalSettings,
}

impl ExternalSettings {
    /// A command with nothing else said.
    pub fn of(command: Target) -> ExternalSettings {
        ExternalSettings {
            command,
            working_directory: None,
            env: BTreeMap::new(),
            observation: Observation::default(),
            answer: None,
            period_s: usual_period(),
            latency_s: 0.0,
            on_timeout: OnTimeout::default(),
            timeouts: Timeouts::default(),
        }
    }

    /// The `ads` block of a profile; `None` if the text has none and so is a profile of `modular`. A relative working
    /// directory is one of `folder`, where the profile lies.
    ///
    /// # Errors
    /// The mistake in the block, or in the text as YAML.
    pub fn from_yaml(text: &str, folder: &Path) -> Option<Result<ExternalSettings, ExternalError>> {
        let whole: serde_json::Value = match read_yaml(text) {
            Ok(whole) => whole,
            Err(error) => return Some(Err(ExternalError::Yaml(error))),
        };
        whole.get("ads").map(|block| {
            if !block.is_object() {
                return Err(ExternalError::NoBlock);
            }
            let profile: Profile = read_yaml(text).map_err(ExternalError::Yaml)?;
            let mut settings = profile.ads;
            settings.working_directory = settings.working_directory.map(|directory| folder.join(directory));
            settings.checked()
        })
    }

    /// These settings, if every time is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn checked(self) -> Result<ExternalSettings, ExternalError> {
        let wrong = |name, found: f64, low, high, more| {
            Err(ExternalError::Range { name, found: found.to_string(), low, high, more })
        };
        let in_ticks = [("period", self.period_s, DT_S, 1.0), ("latency", self.latency_s, 0.0, 2.0)];
        for (name, found, low, high) in in_ticks {
            let ticks = found / DT_S;
            if !(low..=high).contains(&found) || (ticks - ticks.round()).abs() >= 1e-6 {
                return wrong(name, found, low, high, ", in whole ticks of 0.02");
            }
        }
        let Timeouts { init_s, map_s, reset_s, step_s, close_s } = self.timeouts;
        let limits = [
            ("timeouts.init", init_s),
            ("timeouts.map", map_s),
            ("timeouts.reset", reset_s),
            ("timeouts.step", step_s),
            ("timeouts.close", close_s),
        ];
        for (name, found) in limits {
            if !(0.001..=3600.0).contains(&found) {
                return wrong(name, found, 0.001, 3600.0, "");
            }
        }
        Ok(self)
    }

    /// Whether it is told what is perceived, and not the truth.
    pub fn shows_perceived(&self) -> bool {
        self.observation == Observation::Perceived
    }

    /// Ticks between two steps, and until an answer is obeyed.
    pub fn ticks(&self) -> (u64, u64) {
        ((self.period_s / DT_S).round() as u64, (self.latency_s / DT_S).round() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_has_words_and_no_shell() {
        let program = |text| match Target::from_text(text) {
            Ok(Target::Program(words)) => words,
            other => panic!("{other:?}"),
        };
        assert_eq!(program("a  b\tc"), ["a", "b", "c"]);
        assert_eq!(program("'my planner' --name \"it's\" ''"), ["my planner", "--name", "it's", ""]);
        assert_eq!(program("a $HOME *.py; b | c"), ["a", "$HOME", "*.py;", "b", "|", "c"]);
        assert_eq!(Target::from_text("tcp:localhost:5555"), Ok(Target::Tcp("localhost:5555".into())));
        assert_eq!(Target::from_text("unix:run/ads"), Ok(Target::Unix("run/ads".into())));
        for wrong in ["", "  ", "'a", "tcp:localhost", "tcp::99999", "unix:"] {
            assert!(Target::from_text(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_profile_is_read_and_its_mistakes_are_named() {
        let read = |text: &str| ExternalSettings::from_yaml(text, Path::new("folder"));
        assert!(read("planning: {}").is_none());
        let text = "ads:\n  command: [python3, -m, planner]\n  working_directory: there\n  observation: truth\n  \
                    latency: 0.1\n  on_timeout: hold\n  timeouts: { step: 5 }";
        let settings = read(text).unwrap().unwrap();
        assert_eq!(settings.working_directory, Some(PathBuf::from("folder/there")));
        assert_eq!((settings.ticks(), settings.timeouts.step_s), ((5, 5), 5.0));
        let line = serde_json::to_string(&settings).unwrap();
        assert_eq!(serde_json::from_str::<ExternalSettings>(&line).unwrap(), settings);
        for (wrong, word) in [
            ("ads: {}", "command"),
            ("ads: { command: [] }", "empty"),
            ("ads: { command: a, speed: 1 }", "speed"),
            ("ads: { command: a, period: 0.03 }", "whole ticks"),
            ("ads: { command: a, timeouts: { step: 0 } }", "timeouts.step"),
            ("ads: { command: a, answer: steering }", "steering"),
        ] {
            let error = read(wrong).unwrap().unwrap_err().to_string();
            assert!(error.contains(word), "{wrong}: {error}");
        }
    }
}
