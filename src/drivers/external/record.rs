//! The answers of an episode, and their file: `NAME.answers.jsonl` beside a scenario.
//!
//! A question is known by a digest of the conversation up to it, so an answer is found again only where everything
//! before was the same. The file has no questions: they follow from the episode. [`Conversation::evidence`] tells both.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use avastra_lang::model::{digest, digest_text};

use super::finding::Failure;
use super::message::Answer;
use super::session::Identity;
use super::session::check_answer;
use super::settings::ExternalSettings;

/// The format of a file of evidence.
pub const EVIDENCE: &str = "avastra-evidence/1";

/// First words of a file of answers.
const FORMAT: &str = "avastra-answers/1";

/// A digest of a conversation up to a question, that question included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(pub [u8; 16]);

impl Key {
    /// The beginning of every conversation under these settings.
    pub fn new(parts: &[&[u8]]) -> Key {
        let mut sha = Sha256::new();
        for part in parts {
            sha.update((part.len() as u64).to_le_bytes());
            sha.update(part);
        }
        Key::of(sha)
    }

    /// The next question.
    pub fn then(self, question: &str) -> Key {
        let mut sha = Sha256::new();
        sha.update(self.0);
        sha.update(question.as_bytes());
        Key::of(sha)
    }

    fn of(sha: Sha256) -> Key {
        let whole: [u8; 32] = sha.finalize().into();
        Key(core::array::from_fn(|index| whole[index]))
    }

    fn text(self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn read(text: &str) -> Option<Key> {
        let mut bytes = [0; 16];
        if text.len() != 32 || !text.is_ascii() {
            return None;
        }
        for (index, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * index..2 * index + 2], 16).ok()?;
        }
        Some(Key(bytes))
    }
}

/// The outcome of a question.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Ready,
    Answer(Arc<Answer>),
    /// No answer in time, in mode `hold`.
    Missed,
    Failed(Arc<Failure>),
}

impl Outcome {
    /// An answer as it is kept: without the time that planning took.
    pub fn answered(mut answer: Answer) -> Outcome {
        if let Some(Some(internal)) = answer.internal_mut() {
            internal.plan_ms = None;
        }
        Outcome::Answer(Arc::new(answer))
    }

    /// Memory that it takes where it is kept, roughly, bytes.
    pub fn bytes(&self) -> usize {
        // Keys and the nodes of the maps that hold them included.
        const FIXED: usize = 256;
        let Outcome::Answer(answer) = self else { return FIXED };
        let points = match answer.as_ref() {
            Answer::Trajectory(trajectory) => size_of_val(&trajectory.points[..]),
            _ => 0,
        };
        let planned = answer.internal().and_then(|internal| internal.planned.as_ref());
        FIXED + points + planned.map_or(0, |planned| size_of_val(&planned[..]))
    }

    /// Whether it means the same: what a driving system says of its inside may differ.
    pub fn means(&self, other: &Outcome) -> bool {
        self.essence() == other.essence()
    }

    /// The part of the outcome that digests cover.
    pub fn essence(&self) -> Outcome {
        match self {
            Outcome::Answer(answer) => {
                let mut answer = answer.as_ref().clone();
                if let Some(internal) = answer.internal_mut() {
                    *internal = None;
                }
                Outcome::Answer(Arc::new(answer))
            }
            Outcome::Failed(failure) => {
                let Failure { problem, stage, .. } = failure.as_ref();
                Outcome::Failed(Arc::new(Failure::new(*problem, stage.clone(), "")))
            }
            other => other.clone(),
        }
    }
}

/// The identity of an external driving system and the settings it was asked with; scenarios have both in one line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attached {
    /// The identity that the program gave; `None` if the program never came so far.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub identity: Option<Identity>,
    pub settings: ExternalSettings,
    /// Whether the driving system must not be started, because nothing is left to play. It does not identify the driving
    /// system, and is never written.
    #[serde(skip)]
    pub is_recorded: bool,
}

impl Attached {
    /// As one line, for [`Attached::from_line`]. Where the program lay on a disk is left out: nothing is started from there.
    pub fn to_line(&self) -> String {
        let settings = ExternalSettings { working_directory: None, ..self.settings.clone() };
        let line = Attached { settings, ..self.clone() };
        serde_json::to_string(&line).expect("settings are plain data")
    }

    /// Whether asking it the same again leads to the same answers, as it says itself.
    pub fn is_deterministic(&self) -> bool {
        self.identity.as_ref().is_none_or(|identity| identity.deterministic)
    }

    /// # Errors
    /// The mistake in the line.
    pub fn from_line(line: &str) -> Result<Attached, String> {
        let attached: Attached = serde_json::from_str(line).map_err(|error| error.to_string())?;
        let settings = attached.settings.checked().map_err(|error| error.to_string())?;
        Ok(Attached { settings, ..attached })
    }

    /// Digest of all that bears on an episode: who it is and what it is shown, not where it lies on a disk.
    pub fn digest(&self) -> String {
        let ExternalSettings { observation, answer, period_s, latency_s, on_timeout, .. } = &self.settings;
        let essence =
            serde_json::json!([self.identity, observation, answer, period_s, latency_s, on_timeout]);
        digest(essence.to_string().as_bytes())
    }

    /// Its name without the version, or what was started.
    pub fn title(&self) -> String {
        match &self.identity {
            Some(identity) => identity.name.clone(),
            None => format!("`{}`", self.settings.command.text()),
        }
    }

    /// Its name and version, or what was started.
    pub fn name(&self) -> String {
        match &self.identity {
            Some(identity) => identity.text(),
            None => format!("`{}`", self.settings.command.text()),
        }
    }
}

/// The conversation of an episode, as far as it is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Conversation {
    pub attached: Attached,
    pub exchanges: Vec<(Key, Outcome)>,
    /// The same questions in full.
    pub transcript: Transcript,
}

/// The questions of a conversation, and what is known beside their answers. What a clock or a process said is no part of an
/// episode, so any two are equal.
#[derive(Debug, Clone, Default)]
pub struct Transcript(pub Vec<Arc<Told>>);

impl PartialEq for Transcript {
    fn eq(&self, _: &Transcript) -> bool {
        true
    }
}

/// One question of a conversation.
#[derive(Debug, Clone)]
pub struct Told {
    /// Its lines: of a step perhaps after an event.
    pub question: Arc<str>,
    /// Time of the step, µs; `None` of a reset.
    pub t_us: Option<u64>,
    /// How long the answer took, s; `None` if no process was asked, because the answer was known.
    pub took_s: Option<f64>,
    /// What the process wrote to standard error meanwhile.
    pub said: String,
    /// The tracks that it was told of, with the numbers of the road users that they are; `None` is a ghost.
    pub tracks: Vec<(u32, Option<u32>)>,
}

/// One line of [`Conversation::evidence`], without its question, which is JSON already.
#[derive(Serialize)]
struct Evidence<'a> {
    /// Time of the episode, s; absent of a reset.
    #[serde(skip_serializing_if = "Option::is_none")]
    t_s: Option<f64>,
    outcome: &'a Outcome,
    #[serde(skip_serializing_if = "Option::is_none")]
    took_ms: Option<f64>,
    #[serde(skip_serializing_if = "str::is_empty")]
    stderr: &'a str,
    /// By the ids of objects in the question; null is a ghost.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    npcs: BTreeMap<u32, Option<u32>>,
}

impl Conversation {
    /// All that was asked and answered, a line of JSON each after a head: for a reader, or for a planner's own tests.
    pub fn evidence(&self, scenario: &str) -> String {
        let head = serde_json::json!({
            "format": EVIDENCE, "scenario": scenario, "ads": self.attached.title(),
        });
        let mut text = line(&head);
        for ((_, outcome), told) in self.exchanges.iter().zip(&self.transcript.0) {
            let rest = line(&Evidence {
                t_s: told.t_us.map(|t_us| t_us as f64 / 1e6),
                outcome,
                took_ms: told.took_s.map(|took_s| (took_s * 1e6).round() / 1e3),
                stderr: &told.said,
                npcs: told.tracks.iter().copied().collect(),
            });
            // An event comes before its step.
            let mut lines = told.question.lines().rev();
            let question = lines.next().unwrap_or("null");
            let event = lines.next().map_or(String::new(), |event| format!("\"event\":{event},"));
            text.push_str(&format!("{{\"question\":{question},{event}{}", &rest[1..]));
        }
        text
    }

    /// What the program wrote to standard error in the episode, each line after the time of the step. Empty if it wrote nothing,
    /// or was not asked.
    pub fn stderr(&self) -> String {
        let mut text = String::new();
        for told in self.transcript.0.iter().filter(|told| !told.said.is_empty()) {
            let time = told.t_us.map_or("reset".to_owned(), |t_us| format!("{:.2} s", t_us as f64 / 1e6));
            for line in told.said.lines() {
                text.push_str(&format!("{time}: {line}\n"));
            }
        }
        text
    }

    /// The first step at which the same episode got another answer, and both answers in words.
    pub fn difference(&self, again: &Conversation) -> Option<(usize, String)> {
        let mut pairs = self.exchanges.iter().zip(&again.exchanges);
        let index = pairs.position(|((_, first), (_, second))| !first.means(second))?;
        let text = |(_, outcome): &(Key, Outcome)| match outcome {
            Outcome::Failed(failure) => failure.in_words(),
            other => serde_json::to_string(&other.essence()).unwrap_or_default(),
        };
        let (first, second) = (text(&self.exchanges[index]), text(&again.exchanges[index]));
        let step = index.saturating_sub(1);
        Some((step, format!("from step {step} on it answered {second} instead of {first}")))
    }

    /// Whether these recorded answers begin with the answers of this conversation, to the same questions.
    pub fn begins(&self, recorded: &[(Key, Outcome)]) -> bool {
        let mut pairs = self.exchanges.iter().zip(recorded);
        self.exchanges.len() <= recorded.len()
            && pairs.all(|(now, then)| now.0 == then.0 && now.1.means(&then.1))
    }
}

/// Why a file of answers cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    #[error("it does not begin with `{FORMAT}`: it is no file of recorded answers, or of another version")]
    Format,
    #[error("line {line}: {reason}")]
    Line { line: usize, reason: String },
    #[error("its answers are not those that the scenario was made with: one of the two was changed")]
    Digest,
}

#[derive(Serialize, Deserialize)]
struct Head {
    format: String,
}

#[derive(Serialize, Deserialize)]
struct Written {
    key: String,
    outcome: Outcome,
}

/// The text of a file of answers.
pub fn to_text(exchanges: &[(Key, Outcome)]) -> String {
    let mut text = line(&Head { format: FORMAT.to_owned() });
    for (key, outcome) in exchanges {
        text.push_str(&line(&Written { key: key.text(), outcome: outcome.clone() }));
    }
    text
}

fn line(value: &impl Serialize) -> String {
    let mut line = serde_json::to_string(value).expect("answers are plain data");
    line.push('\n');
    line
}

/// Answers from the text of a file; `digest` is the one that the scenario has.
///
/// # Errors
/// If it is no file of answers, or of others.
pub fn from_text(text: &str, digest: Option<&str>) -> Result<Vec<(Key, Outcome)>, RecordError> {
    let mut lines = text.lines().enumerate();
    let head = lines.next().and_then(|(_, line)| serde_json::from_str::<Head>(line).ok());
    if head.is_none_or(|head| head.format != FORMAT) {
        return Err(RecordError::Format);
    }
    let read = |(index, line): (usize, &str)| {
        let wrong = |reason: String| RecordError::Line { line: index + 1, reason };
        let written: Written = serde_json::from_str(line).map_err(|error| wrong(error.to_string()))?;
        let key = Key::read(&written.key).ok_or_else(|| wrong(format!("`{}` is no key", written.key)))?;
        if let Outcome::Answer(answer) = &written.outcome {
            check_answer(answer).map_err(|broken| wrong(broken.detail))?;
        }
        Ok((key, written.outcome))
    };
    let exchanges: Vec<(Key, Outcome)> = lines.map(read).collect::<Result<_, _>>()?;
    match digest {
        Some(digest) if digest_of(&exchanges) != digest => Err(RecordError::Digest),
        _ => Ok(exchanges),
    }
}

/// Digest of the answers.
pub fn digest_of(exchanges: &[(Key, Outcome)]) -> String {
    let mut sha = Sha256::new();
    for (key, outcome) in exchanges {
        sha.update(key.0);
        sha.update(serde_json::to_string(&outcome.essence()).expect("answers are plain data"));
    }
    digest_text(&sha.finalize().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::external::Target;
    use crate::external::finding::Problem;
    use crate::external::message::{AccelerationMessage, Internal};

    #[test]
    fn answers_go_through_their_file_and_changes_are_noticed() {
        let internal =
            Internal { reason: Some("follow 3".into()), planned: None, localized: None, plan_ms: Some(4.0) };
        let answer = AccelerationMessage { seq: 0, accel: -0.1, lane_change: None, internal: Some(internal) };
        let key = Key::new(&[b"a", b"b"]);
        let failure = Failure::new(Problem::Exited, "step 2", "the process ended");
        let exchanges = vec![
            (key, Outcome::Ready),
            (key.then("x"), Outcome::answered(Answer::Acceleration(answer))),
            (key.then("y"), Outcome::Missed),
            (key.then("z"), Outcome::Failed(failure.into())),
        ];
        let text = to_text(&exchanges);
        let digest = digest_of(&exchanges);
        assert_eq!(from_text(&text, Some(&digest)).unwrap(), exchanges);
        assert!(!text.contains("plan_ms"));
        assert_eq!(from_text(&text.replace("-0.1", "-0.2"), Some(&digest)), Err(RecordError::Digest));
        assert_eq!(digest_of(&from_text(&text.replace("follow 3", "follow 4"), None).unwrap()), digest);
        assert_eq!(from_text("", None), Err(RecordError::Format));
        // From somebody else: what no program may answer is not carried out either.
        for foreign in [
            r#"{"type":"ready"}"#,
            r#"{"type":"error","message":"lost"}"#,
            r#"{"type":"control","seq":0,"steer":0.0}"#,
            r#"{"type":"acceleration","seq":0,"accel":1e308,"internal":{"localized":{"x":1e308,"y":0,"heading":0}}}"#,
            r#"{"type":"trajectory","seq":0,"points":[]}"#,
            r#"{"type":"trajectory","seq":0,"points":[{"t_us":0,"x":0,"y":0,"heading":0,"v":1}]}"#,
        ] {
            let own = r#"{"type":"acceleration","seq":0,"accel":-0.1,"internal":{"reason":"follow 3"}}"#;
            assert!(text.contains(own), "{text}");
            let told = from_text(&text.replace(own, foreign), None);
            assert!(matches!(told, Err(RecordError::Line { line: 3, .. })), "{foreign}: {told:?}");
        }
        let part = |exchanges: &[(Key, Outcome)]| Conversation {
            transcript: Transcript::default(),
            attached: Attached {
                identity: None,
                settings: ExternalSettings::of(Target::from_text("./planner").unwrap()),
                is_recorded: false,
            },
            exchanges: exchanges.to_vec(),
        };
        assert!(part(&exchanges[..2]).begins(&exchanges) && part(&exchanges).begins(&exchanges));
        assert!(!part(&exchanges).begins(&exchanges[..2]) && !part(&exchanges[1..]).begins(&exchanges));
        assert!(matches!(
            from_text(&text.replace("\"missed\"", "\"lost\""), None),
            Err(RecordError::Line { line: 4, .. })
        ));
    }
}
