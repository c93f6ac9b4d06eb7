//! The errors of external driving systems, each under its own name. Never a collision.

use serde::{Deserialize, Serialize};

use avastra_base::outside::{acts_on_terminal, in_line};

use super::words::words;

words! {
    /// The kinds of findings; docs/reference/protocol.md, "What goes wrong". A name is also that of an episode's end.
    pub enum FailureKind {
        Crash = "ads_crash",
        Timeout = "ads_timeout",
        Protocol = "ads_protocol",
        Flood = "ads_flood",
        Error = "ads_error",
        Nondeterministic = "ads_nondeterministic",
        Absent = "ads_absent",
    }
}

/// Declares the problems: each with its name, its kind, and what the author of the driving
/// system can do about it.
macro_rules! problems {
    ($($problem:ident = $name:tt: $kind:ident, $advice:literal;)+) => {
        words! {
            /// The exact error.
            pub enum Problem { $($problem = $name,)+ }
        }

        impl Problem {
            pub fn kind(self) -> FailureKind {
                match self { $(Problem::$problem => FailureKind::$kind,)+ }
            }

            /// Advice to the author of the driving system.
            pub fn advice(self) -> &'static str {
                match self { $(Problem::$problem => $advice,)+ }
            }
        }
    };
}

problems! {
    Exited = "exited": Crash,
        "read its standard error; the program must run until `close` or the end of its input";
    Closed = "closed": Crash,
        "read its standard error; the program must run until `close` or the end of its input";
    NotStarted = "not_started": Crash,
        "try the command by hand in the same folder; there is no shell, so no `~`, `*`, `|` or variables";
    NotReached = "not_reached": Crash,
        "avastra connects and starts nothing: start the program that listens there first";
    NoAnswer = "no_answer": Timeout,
        "flush standard output after each line; if the program needs longer, or the machine is busy, raise `timeouts` in its profile";
    NotJson = "not_json": Protocol,
        "print nothing but messages on standard output: send prints, also those of libraries, to standard error";
    TooLong = "too_long": Protocol, "a line has at most 1 MiB: send fewer points";
    WrongType = "wrong_type": Protocol, "compare the message with `avastra ads schema`";
    WrongShape = "wrong_shape": Protocol, "compare the message with `avastra ads schema`";
    NotFinite = "not_finite": Protocol,
        "test for NaN before answering; in Python, `json.dumps(…, allow_nan=False)` finds the place";
    OutOfRange = "out_of_range": Protocol, "compare the message with `avastra ads schema`";
    WrongSeq = "wrong_seq": Protocol, "repeat the `seq` of the step in its answer";
    Twice = "twice": Protocol, "answer each step once, and no `event`";
    Unasked = "unasked": Protocol, "answer each question once, after it came, and no `event`";
    WrongProtocol = "wrong_protocol": Protocol, "this avastra speaks avastra-ads/1";
    Stderr = "stderr": Flood, "print less: 64 MiB in an episode are a flood";
    Reported = "reported": Error, "the program says so itself";
    OtherAnswer = "other_answer": Nondeterministic,
        "forget everything at `reset`, seed all that is random from it, and use no clock";
    NoProcess = "no_process": Absent, "answers are recorded for one way only: give the program with `--ads`";
    GivenUp = "given_up": Absent, "see that the program runs and answers `init`, then play what is left";
}

/// Characters of a line of standard error that a message shows.
const STDERR_CHARS_SHOWN: usize = 300;

/// One finding about an external driving system.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    pub problem: Problem,
    /// When: `start`, `init`, `map`, `reset`, `step 37`, `close`.
    pub stage: String,
    /// The event in words.
    pub detail: String,
    /// How the process ended, if it had ended by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exit: Option<String>,
    /// The end of its standard error.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub stderr: String,
}

impl Failure {
    pub fn new(problem: Problem, stage: impl Into<String>, detail: impl Into<String>) -> Failure {
        let detail = in_line(&detail.into()).into_owned();
        Failure { problem, stage: stage.into(), detail, exit: None, stderr: String::new() }
    }

    pub fn kind(&self) -> FailureKind {
        self.problem.kind()
    }

    /// In one line, for example `ads_crash (exited) at step 37: it ended with exit status 1`.
    pub fn in_words(&self) -> String {
        let stage = in_line(&self.stage);
        format!("{} ({}) at {stage}: {}", self.kind().name(), self.problem.name(), self.what())
    }

    /// The event, and how the process ended.
    pub fn what(&self) -> String {
        let exit = self.exit.as_ref().map_or(String::new(), |exit| format!("; it ended with {exit}"));
        // It may be read from a file that another program wrote.
        in_line(&format!("{}{exit}", self.detail)).into_owned()
    }

    /// The last lines of its standard error, at most so many, each cut to a length that can be read.
    pub fn stderr_lines(&self, at_most: usize) -> Vec<String> {
        let lines: Vec<&str> = self.stderr.lines().collect();
        let short = |line: &&str| match line.char_indices().nth(STDERR_CHARS_SHOWN) {
            Some((end, _)) => format!("{}…", in_line(&line[..end])),
            None => in_line(line).into_owned(),
        };
        lines[lines.len().saturating_sub(at_most)..].iter().map(short).collect()
    }
}

/// Lines of a program as they are kept in files, which other programs may print, too: characters that would act on a terminal
/// become U+FFFD, and a carriage return before a line feed is left out.
pub(super) fn harmless(text: &str) -> String {
    text.replace("\r\n", "\n").replace(acts_on_terminal, "\u{fffd}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_program_says_cannot_steer_a_terminal() {
        let failure = Failure::new(Problem::Reported, "step 1", "lost \u{1b}[2J\u{202e}\r\n\there\u{7}");
        assert_eq!(failure.detail, r"lost \u{1b}[2J\u{202e}\r\n\there\u{7}");
        assert_eq!(harmless("lost \u{1b}[2J\r\n\there"), "lost \u{fffd}[2J\n\there");
    }

    #[test]
    fn what_a_file_says_of_a_failure_stays_in_one_line() {
        let lines = "x\n::error::forged\u{2028}y".to_owned();
        let stderr = format!("##vso[task]\n{lines}");
        let (stage, detail, exit) = (lines.clone(), lines.clone(), Some(lines));
        let failure = Failure { problem: Problem::Reported, stage, detail, exit, stderr };
        assert_eq!(failure.in_words().lines().count(), 1, "{}", failure.in_words());
        let lines = [r"\u{23}#vso[task]", "x", r"\u{3a}:error::forged\u{2028}y"];
        assert_eq!(failure.stderr_lines(3), lines);
    }

    const PROTOCOL: &str = include_str!("../../../docs/reference/protocol.md");

    #[test]
    fn the_specification_names_every_finding_and_no_other() {
        for problem in Problem::ALL {
            assert!(PROTOCOL.contains(&format!("| `{}` |", problem.name())), "{problem:?}");
        }
        for kind in FailureKind::ALL {
            assert!(PROTOCOL.contains(&format!("`{}`", kind.name())), "{kind:?}");
            assert!(Problem::ALL.iter().any(|problem| problem.kind() == kind));
        }
        let table = PROTOCOL.split("| finding | problem | when |").nth(1).expect("the table of findings");
        let rows = table.lines().filter(|line| line.starts_with("| ")).count();
        assert_eq!(rows, Problem::ALL.len());
    }
}
