//! Printing: results on stdout, everything else on stderr, in the form that was asked for.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;

use crate::syntax::{Diagnostic, DiagnosticRecord, Sources, Style};

use super::arguments::{Format, OutputArguments, When};
use super::error::Failure;
use super::sarif;

/// How this command prints.
pub struct Output {
    format: Format,
    colour: bool,
    pub quiet: bool,
    pub verbose: bool,
    /// Diagnostics for SARIF, which prints them in one piece at the end.
    collected: Mutex<Vec<DiagnosticRecord>>,
}

/// The result of a command in JSON: its last line on stdout.
#[derive(serde::Serialize)]
struct Line<'a, T> {
    /// Raised whenever a field changes its meaning or goes away.
    schema: u32,
    command: &'a str,
    #[serde(flatten)]
    result: T,
}

impl Output {
    pub fn new(arguments: &OutputArguments) -> Output {
        let colour = match arguments.color {
            When::Always => true,
            When::Never => false,
            When::Auto => {
                arguments.format == Format::Human
                    && std::io::stderr().is_terminal()
                    && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
                    && !is_dumb()
            }
        };
        let collected = Mutex::default();
        let (quiet, verbose) = (arguments.quiet, arguments.verbose);
        Output { format: arguments.format, colour, quiet, verbose, collected }
    }

    pub fn is_json(&self) -> bool {
        self.format == Format::Json
    }

    fn is_sarif(&self) -> bool {
        self.format == Format::Sarif
    }

    /// Ends the command's output.
    pub fn finish(&self) {
        if self.is_sarif() {
            let log = sarif::log(&self.collected());
            print(&serde_json::to_string_pretty(&log).expect("it is JSON already"));
        }
    }

    /// Text for people on stdout; nothing in JSON.
    pub fn say(&self, text: &str) {
        if !self.is_json() && !self.is_sarif() {
            print(text);
        }
    }

    /// Text that `--quiet` leaves out.
    pub fn tell(&self, text: &str) {
        if !self.quiet {
            self.say(text);
        }
    }

    /// The result in JSON; nothing in the other forms.
    pub fn result(&self, command: &str, result: impl serde::Serialize) {
        if self.is_json() {
            let line = Line { schema: 1, command, result };
            let line = serde_json::to_string(&line).expect("results have string keys only");
            print(&line);
        }
    }

    /// Diagnostics on stderr; in JSON one object a line.
    pub fn diagnostics(&self, sources: &Sources, diagnostics: &[Diagnostic]) {
        for diagnostic in diagnostics {
            if self.is_sarif() {
                self.collected().push(crate::syntax::record(diagnostic, sources));
            } else if self.is_json() {
                let record = crate::syntax::record(diagnostic, sources);
                let line = serde_json::to_string(&record).expect("records have string keys only");
                remark(&line);
            } else {
                let style = if self.colour { Style::Human } else { Style::Plain };
                remark(&format!("{}\n", crate::syntax::render(diagnostic, sources, style).trim_end()));
            }
        }
    }

    fn collected(&self) -> std::sync::MutexGuard<'_, Vec<DiagnosticRecord>> {
        self.collected.lock().expect("no thread panics while collecting")
    }

    pub fn failure(&self, failure: &Failure) {
        if self.is_json() {
            self.result(
                "error",
                serde_json::json!({ "status": failure.status(), "message": failure.to_string() }),
            );
        } else if self.colour {
            remark(&format!("\x1b[1;31merror\x1b[0m: {failure}"));
        } else {
            remark(&format!("error: {failure}"));
        }
    }
}

/// Prints the result object of a command line that could not be parsed, if it asks for JSON.
pub fn usage_in_json(failure: &Failure) {
    let arguments: Vec<String> = std::env::args().collect();
    let asks = |pair: &[String]| pair[0] == "--format" && pair[1] == "json";
    if arguments.windows(2).any(asks) || arguments.iter().any(|argument| argument == "--format=json") {
        Output {
            format: Format::Json,
            colour: false,
            quiet: false,
            verbose: false,
            collected: Mutex::default(),
        }
        .failure(failure);
    }
}

/// A line on stdout. A reader that has gone away (`| head`) is no error, here and on stderr.
fn print(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// A line on stderr.
pub fn remark(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Whether the terminal says that it can only print one line after another.
pub fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|name| name == "dumb")
}

/// What every terminal shows in a line; longer text is folded.
pub const COLUMNS: usize = 80;

/// A text in lines of at most `width` letters, cut between words; at least one line. A longer word has a line of
/// its own.
pub fn folded(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("there is always a line");
        if last.is_empty() {
            last.push_str(word);
        } else if last.chars().count() + 1 + word.chars().count() <= width {
            last.push(' ');
            last.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// `1 collision`, `2 collisions`.
pub fn plural(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
