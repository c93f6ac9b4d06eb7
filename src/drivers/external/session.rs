//! One driving system that was started, spoken with in whole messages: asks, waits, reads and judges the answer.

use avastra_base::outside::in_line;
use serde_json::Value;

use super::finding::{Failure, Problem};
use super::link::{Broken, Deadline, Link};
use super::message::{Answer, AnswerKind, Close, ERROR_CHARS_MAX, Init, PROTOCOL, Question, Ready};
use super::schema::Schema;
use super::settings::ExternalSettings;

/// A late answer is waited for this many times the limit longer: a busy machine stops a sound program for a second now and
/// then, and what hangs never answers. Ours.
const GRACE_LIMITS: f64 = 5.0;
/// Late answers that are allowed in an episode. Ours.
const LATE_MAX: u32 = 3;

/// A trajectory reaches at least this far beyond its step, µs.
const REACH_US_MIN: u64 = 1_000_000;
/// The way of a trajectory is at most this long, m: it is sampled each half metre, in each step. Ours.
const WAY_M_MAX: f64 = 10_000.0;

/// The facts that a driving system states about itself.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Identity {
    pub name: String,
    pub version: String,
    pub answer: AnswerKind,
    pub deterministic: bool,
    /// Groups of fields that it is also sent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wants: Vec<String>,
}

impl Identity {
    /// Its name and version.
    pub fn text(&self) -> String {
        in_line(&format!("{} {}", self.name, self.version)).into_owned()
    }
}

/// A driving system that is ready.
pub struct Session {
    link: Link,
    pub identity: Identity,
    /// The map that it has, by the digest of its message.
    pub map: Option<[u8; 16]>,
    /// The step that was answered last, and whether one was missed in this episode.
    answered: Option<u64>,
    missed: bool,
    /// Answers of this episode that came after the limit.
    late: u32,
}

/// How long an answer is waited for.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    pub limit_s: f64,
    /// Whether a late answer is waited for.
    pub waits_for_late: bool,
}

impl Session {
    /// Starts a driving system, or connects to one, and asks it who it is.
    ///
    /// # Errors
    /// The failure, and the program's standard error.
    pub fn open(settings: &ExternalSettings, init: &Init) -> Result<Session, Failure> {
        let deadline = Deadline::after(settings.timeouts.init_s);
        let mut link =
            Link::open(settings).map_err(|broken| Failure::new(broken.problem, "start", broken.detail))?;
        link.send(&Question::Init(init.clone()).line());
        let line = link.line(deadline);
        let found = line.map_err(|broken| told(broken, "init", settings.timeouts.init_s)).and_then(|line| {
            let Answer::Ready(ready) = read(&line, "ready")? else { return Err(wrong_type(&line, "ready")) };
            identity(ready, init)
        });
        match found {
            Ok(identity) => Ok(Session { link, identity, map: None, answered: None, missed: false, late: 0 }),
            Err(mut broken) => {
                if broken.problem == Problem::NoAnswer && settings.command.is_socket() {
                    broken
                        .detail
                        .push_str("; a program that serves one connection at a time needs `--jobs 1`");
                }
                Err(failed(&mut link, broken, "init"))
            }
        }
    }

    /// Sends a message that wants no answer.
    pub fn tell(&mut self, line: &str) {
        self.link.send(line);
    }

    /// Sends a step whose answer is not waited for.
    pub fn pass(&mut self, line: &str) {
        self.missed = true;
        self.link.send(line);
    }

    /// Asks by a line that `ready` answers.
    ///
    /// # Errors
    /// The failure, after which the driving system is of no use.
    pub fn ready(&mut self, line: &str, stage: &'static str, limit_s: f64) -> Result<(), Failure> {
        if stage == "reset" {
            self.link.begin_episode();
        }
        let found = self.ask(line, "ready", limit_s);
        if stage == "reset" {
            (self.answered, self.missed, self.late) = (None, false, 0);
        }
        found.map(drop).map_err(|broken| failed(&mut self.link, told(broken, stage, limit_s), stage))
    }

    /// Asks a step; the answer, and how long it took, s. `None` is an answer that did not come in time, where that is no
    /// finding.
    ///
    /// # Errors
    /// Any other failure, after which the driving system is of no use.
    pub fn step(
        &mut self,
        line: &str,
        (seq, t_us): (u64, u64),
        Patience { limit_s, waits_for_late }: Patience,
    ) -> Result<Option<(Answer, f64)>, Failure> {
        let wanted = self.identity.answer.name();
        let asked = self.send(line, Some(seq));
        let deadline = Deadline::after(limit_s);
        let mut found = asked.and_then(|()| self.answer(wanted, Some(seq), deadline));
        if waits_for_late && matches!(found, Err(Broken { problem: Problem::NoAnswer, .. })) {
            found = self.late_answer(wanted, seq, limit_s);
        }
        let result = match found {
            Ok(answer) => {
                self.answered = Some(seq);
                judged(answer, t_us).map(|answer| Some((answer, deadline.elapsed_s())))
            }
            Err(Broken { problem: Problem::NoAnswer, .. }) if !waits_for_late => {
                self.missed = true;
                Ok(None)
            }
            Err(broken) => Err(broken),
        };
        result.map_err(|broken| failed(&mut self.link, broken, format!("step {seq}")))
    }

    /// Waits on for an answer that did not come within `limit_s`, if not too many of the episode were late.
    fn late_answer(&mut self, wanted: &str, seq: u64, limit_s: f64) -> Result<Answer, Broken> {
        self.late += 1;
        if self.late > LATE_MAX {
            return Err(no_answer(format!(
                "more than {LATE_MAX} answers of this episode came later than {limit_s} s (`timeouts.step`)"
            )));
        }
        let more_s = GRACE_LIMITS * limit_s;
        let answer = self.answer(wanted, Some(seq), Deadline::after(more_s));
        answer.map_err(|broken| match broken.problem {
            Problem::NoAnswer => {
                no_answer(format!("no answer within {limit_s} s (`timeouts.step`), nor in {more_s} s more"))
            }
            _ => broken,
        })
    }

    /// Sends a line that is no step and waits for its answer, that of a type.
    fn ask(&mut self, line: &str, wanted: &str, limit_s: f64) -> Result<Answer, Broken> {
        self.send(line, None)?;
        self.answer(wanted, None, Deadline::after(limit_s))
    }

    /// Sends a question; `seq` is that of a step. A line that came before it is a failure. After a step was missed, the late answers
    /// to it and to steps before it are none.
    fn send(&mut self, line: &str, seq: Option<u64>) -> Result<(), Broken> {
        while let Some(found) = self.link.unasked()? {
            let answered = match read(&found, "ready") {
                Ok(answer) => answer.seq(),
                Err(broken) if broken.problem == Problem::WrongType => None,
                Err(broken) => return Err(broken),
            };
            match answered {
                Some(found) if self.missed && seq.is_none_or(|seq| found < seq) => {}
                Some(seq) if Some(seq) == self.answered => return Err(twice(seq)),
                _ => {
                    let before = if seq.is_some() { "" } else { ", after the end of the episode before" };
                    let detail = format!("it wrote {} unasked{before}", shown(&found));
                    return Err(Broken { problem: Problem::Unasked, detail });
                }
            }
        }
        self.link.send(line);
        Ok(())
    }

    /// Waits for an answer: that of a type, and to the step `seq` if it is one.
    fn answer(&mut self, wanted: &str, seq: Option<u64>, deadline: Deadline) -> Result<Answer, Broken> {
        loop {
            let line = self.link.line(deadline)?;
            let answer = read(&line, wanted)?;
            match (answer.seq(), seq) {
                (found, asked) if found == asked => return Ok(answer),
                // The answer to a step that was missed.
                (Some(_), None) if self.missed => {}
                (Some(found), _) if Some(found) == self.answered => return Err(twice(found)),
                (Some(found), Some(asked)) if found < asked && self.missed => {}
                (Some(found), Some(asked)) => {
                    let detail = format!("`seq` is {found}, asked was {asked}");
                    return Err(Broken { problem: Problem::WrongSeq, detail });
                }
                _ => return Err(wrong_type(&line, wanted)),
            }
        }
    }

    /// The finding that an answer differs from the one to the same question; the driving system is killed.
    pub fn otherwise(&mut self, stage: String, detail: String) -> Failure {
        failed(&mut self.link, Broken { problem: Problem::OtherAnswer, detail }, stage)
    }

    /// What the program wrote to standard error since this was asked last.
    pub fn said(&mut self) -> String {
        self.link.said()
    }

    /// Says `close` and waits.
    ///
    /// # Errors
    /// How it ended, if not by itself with status 0.
    pub fn close(mut self, limit_s: f64) -> Result<(), String> {
        self.link.close(&Question::Close(Close {}).line(), limit_s)
    }
}

/// A finding with all that can be known; the process is killed.
fn failed(link: &mut Link, broken: Broken, stage: impl Into<String>) -> Failure {
    let exit = match broken.problem {
        Problem::Exited => link.exit_within(0.0),
        _ => None,
    };
    link.kill();
    let stderr = link.stderr();
    Failure { exit, stderr, ..Failure::new(broken.problem, stage, broken.detail) }
}

/// Adds the time limit to the finding that no answer came; `limit` is its name in the profile.
fn told(broken: Broken, limit: &str, limit_s: f64) -> Broken {
    match broken.problem {
        Problem::NoAnswer => Broken { detail: in_time(limit, limit_s), ..broken },
        _ => broken,
    }
}

fn in_time(limit: &str, limit_s: f64) -> String {
    format!("no answer within {limit_s} s (`timeouts.{limit}`)")
}

fn no_answer(detail: String) -> Broken {
    Broken { problem: Problem::NoAnswer, detail }
}

fn twice(seq: u64) -> Broken {
    Broken { problem: Problem::Twice, detail: format!("a second answer to step {seq}") }
}

fn wrong_type(line: &[u8], wanted: &str) -> Broken {
    Broken { problem: Problem::WrongType, detail: format!("expected `{wanted}`, got {}", shown(line)) }
}

/// The beginning of a line, for a message.
fn shown(line: &[u8]) -> String {
    let text = String::from_utf8_lossy(line);
    let short: String = text.chars().take(120).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if short.len() < text.len() { format!("`{short}…`") } else { format!("`{short}`") }
}

/// A line as a message; `error` is a finding, and so is whatever is no message.
pub(super) fn read(line: &[u8], wanted: &str) -> Result<Answer, Broken> {
    let value: Value = serde_json::from_slice(line).map_err(|error| {
        let text = String::from_utf8_lossy(line);
        let is_number = error.to_string().contains("number out of range")
            || (text.trim_start().starts_with('{')
                && ["NaN", "Infinity", "nan", "inf"].iter().any(|word| stands_for_a_number(&text, word)));
        let problem = if is_number { Problem::NotFinite } else { Problem::NotJson };
        Broken { problem, detail: format!("{error}: {}", shown(line)) }
    })?;
    let Value::Object(fields) = &value else {
        return Err(Broken { problem: Problem::NotJson, detail: format!("no object: {}", shown(line)) });
    };
    let Some(word) = fields.get("type").and_then(Value::as_str) else {
        let detail = format!("no `type`: {}", shown(line));
        return Err(Broken { problem: Problem::WrongShape, detail });
    };
    if !["ready", "control", "trajectory", "acceleration", "error"].contains(&word) {
        return Err(wrong_type(line, wanted));
    }
    // From the text and not from the value, which keeps only the last of a field that stands twice.
    let answer: Answer = serde_json::from_slice(line).map_err(|error| {
        let detail = format!("in `{word}`: {error}: {}", shown(line));
        Broken { problem: Problem::WrongShape, detail }
    })?;
    match answer {
        Answer::Error(error) => {
            let message = error.message.chars().take(ERROR_CHARS_MAX).collect();
            Err(Broken { problem: Problem::Reported, detail: message })
        }
        // An answer in place of `ready` may be a second answer to a step, or a late one: the caller tells by `seq`.
        _ if wanted != "ready" && word != wanted => Err(wrong_type(line, wanted)),
        answer => Ok(answer),
    }
}

/// Whether a word stands in a line of JSON in place of a number.
fn stands_for_a_number(text: &str, word: &str) -> bool {
    let is_letter = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    let mut is_string = false;
    let mut previous = ' ';
    for (at, c) in text.char_indices() {
        if c == '"' && previous != '\\' {
            is_string = !is_string;
        } else if !is_string
            && text[at..].starts_with(word)
            && !is_letter(Some(previous))
            && !is_letter(text[at + word.len()..].chars().next())
        {
            return true;
        }
        previous = c;
    }
    false
}

/// The identity of a driving system, by its first `ready`.
fn identity(ready: Ready, init: &Init) -> Result<Identity, Broken> {
    if let Some(broken) = ready.out_of_range("") {
        return Err(broken);
    }
    let missing = |name: &str| Broken {
        problem: Problem::WrongShape,
        detail: format!("the first `ready` has no `{name}`"),
    };
    let protocol = ready.protocol.ok_or_else(|| missing("protocol"))?;
    if protocol != PROTOCOL {
        let detail = format!("it speaks `{protocol}`");
        return Err(Broken { problem: Problem::WrongProtocol, detail });
    }
    let (name, version) =
        (ready.name.ok_or_else(|| missing("name"))?, ready.version.ok_or_else(|| missing("version"))?);
    if [&name, &version].into_iter().any(|text| *text != in_line(text)) {
        let detail = "`name` and `version` have no control characters".to_owned();
        return Err(Broken { problem: Problem::WrongShape, detail });
    }
    let answer = ready.answer.ok_or_else(|| missing("answer"))?;
    if let Some(wanted) = init.answer.filter(|wanted| *wanted != answer) {
        let detail = format!("asked for answers of kind `{}`, it gives `{}`", wanted.name(), answer.name());
        return Err(Broken { problem: Problem::WrongType, detail });
    }
    let deterministic = ready.deterministic.ok_or_else(|| missing("deterministic"))?;
    let wants = ready.wants.unwrap_or_default();
    if wants.iter().any(|word| *word != in_line(word) || word.chars().count() > 40) {
        let detail = "the words of `wants` have at most 40 characters, and no control characters".to_owned();
        return Err(Broken { problem: Problem::WrongShape, detail });
    }
    Ok(Identity { name, version, answer, deterministic, wants })
}

/// An answer to a step at `t_us`, if its values are possible.
fn judged(answer: Answer, t_us: u64) -> Result<Answer, Broken> {
    check_answer(&answer)?;
    if let Answer::Trajectory(trajectory) = &answer {
        let points = &trajectory.points;
        if points[0].t_us > t_us || points[points.len() - 1].t_us < t_us + REACH_US_MIN {
            let (first, last) = (points[0].t_us, points[points.len() - 1].t_us);
            let detail = format!(
                "the points reach from {first} to {last} µs; the step is at {t_us} µs, and they must reach 1 s beyond it"
            );
            return Err(Broken { problem: Problem::OutOfRange, detail });
        }
    }
    Ok(answer)
}

/// Whether an answer to a step can be carried out, at whatever time: a live one, or one that was recorded.
pub(super) fn check_answer(answer: &Answer) -> Result<(), Broken> {
    let wrong = |problem, detail: String| Err(Broken { problem, detail });
    let out_of_range = match answer {
        Answer::Control(control) => control.out_of_range(""),
        Answer::Trajectory(trajectory) => trajectory.out_of_range(""),
        Answer::Acceleration(acceleration) => acceleration.out_of_range(""),
        Answer::Ready(_) | Answer::Error(_) => {
            return wrong(Problem::WrongType, "no step is answered by this".to_owned());
        }
    };
    if let Some(broken) = out_of_range {
        return Err(broken);
    }
    if let Answer::Control(control) = answer {
        let pedals = (control.accel.is_some(), control.throttle.is_some(), control.brake.is_some());
        if !matches!(pedals, (true, false, false) | (false, true, true)) {
            let detail = "`control` has either `accel`, or `throttle` and `brake`".to_owned();
            return wrong(Problem::WrongShape, detail);
        }
    }
    if let Answer::Trajectory(trajectory) = answer {
        let points = &trajectory.points;
        if points.windows(2).any(|pair| pair[1].t_us <= pair[0].t_us) {
            return wrong(Problem::OutOfRange, "`t_us` of the points does not rise".to_owned());
        }
        let way_m: f64 =
            points.windows(2).map(|pair| libm::hypot(pair[1].x - pair[0].x, pair[1].y - pair[0].y)).sum();
        if way_m > WAY_M_MAX {
            let detail =
                format!("the points make a way of {way_m:.0} m; it may be {WAY_M_MAX:.0} m long at most");
            return wrong(Problem::OutOfRange, detail);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(line: &str, wanted: &str) -> Problem {
        match read(line.as_bytes(), wanted).and_then(|answer| judged(answer, 1_000_000)) {
            Ok(answer) => panic!("{line}: {answer:?}"),
            Err(broken) => broken.problem,
        }
    }

    #[test]
    fn every_wrong_line_has_its_problem() {
        for (line, wanted) in [
            ("hello", Problem::NotJson),
            ("[1, 2]", Problem::NotJson),
            (r#"{"type":"control","seq":1,"accel":NaN,"steer":0}"#, Problem::NotFinite),
            (r#"{"type":"control","seq":1,"accel":-Infinity,"steer":0}"#, Problem::NotFinite),
            (r#"{"type":"control","seq":1,"accel":1e999,"steer":0}"#, Problem::NotFinite),
            (r#"{"type":"control","seq":1,"name":"NaN","#, Problem::NotJson),
            (r#"{"seq":1}"#, Problem::WrongShape),
            (r#"{"type":"hello"}"#, Problem::WrongType),
            (r#"{"type":"acceleration","seq":1,"accel":0}"#, Problem::WrongType),
            (r#"{"type":"control","seq":-1,"accel":0,"steer":0}"#, Problem::WrongShape),
            (r#"{"type":"control","seq":1,"accel":"fast","steer":0}"#, Problem::WrongShape),
            (r#"{"type":"control","seq":1,"steer":0}"#, Problem::WrongShape),
            (r#"{"type":"control","seq":1,"steer":0,"accel":1,"brake":0}"#, Problem::WrongShape),
            (r#"{"type":"control","seq":1,"seq":2,"steer":0,"accel":1}"#, Problem::WrongShape),
            (r#"{"type":"control","type":"ready","seq":1,"steer":0,"accel":1}"#, Problem::WrongShape),
            (r#"{"type":"control","seq":1,"steer":0,"throttle":2,"brake":0}"#, Problem::OutOfRange),
            (r#"{"type":"control","seq":1,"steer":30,"accel":1}"#, Problem::OutOfRange),
            (r#"{"type":"control","seq":9007199254740992,"steer":0,"accel":1}"#, Problem::OutOfRange),
            (r#"{"type":"error","message":"lost"}"#, Problem::Reported),
        ] {
            assert_eq!(problem(line, "control"), wanted, "{line}");
        }
        let trajectory = |points: &str| {
            problem(&format!(r#"{{"type":"trajectory","seq":1,"points":[{points}]}}"#), "trajectory")
        };
        let point = |t_us: u64| format!(r#"{{"t_us":{t_us},"x":0,"y":0,"heading":0,"v":1}}"#);
        assert_eq!(trajectory(""), Problem::WrongShape);
        assert_eq!(trajectory(&format!("{},{}", point(1_000_000), point(1_000_000))), Problem::OutOfRange);
        assert_eq!(trajectory(&format!("{},{}", point(1_000_000), point(1_900_000))), Problem::OutOfRange);
        assert_eq!(trajectory(&format!("{},{}", point(1_100_000), point(2_900_000))), Problem::OutOfRange);
        // Far away is far to sample.
        let away = r#"{"t_us":2000000,"x":10000000,"y":0,"heading":0,"v":1}"#;
        assert_eq!(trajectory(&format!("{},{away}", point(900_000))), Problem::OutOfRange);
        let fine = format!(
            r#"{{"type":"trajectory","seq":1,"more":[],"points":[{},{}]}}"#,
            point(900_000),
            point(2_000_000)
        );
        assert!(read(fine.as_bytes(), "trajectory").and_then(|answer| judged(answer, 1_000_000)).is_ok());
        // An acceleration that no vehicle has is cut off, and no finding.
        let braking = br#"{"type":"control","seq":1,"steer":0,"accel":-1257.3}"#;
        let answer = read(braking, "control").and_then(|answer| judged(answer, 0)).expect("it is obeyed");
        assert!(answer.is_extreme());
    }
}
