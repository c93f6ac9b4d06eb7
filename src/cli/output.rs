//! Printing: results on stdout, everything else on stderr, in the form that was asked for.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use avastra_base::outside::{Shown, json_on_terminal, on_terminal};
use avastra_lang::syntax::{Diagnostic, DiagnosticRecord, Sources, Style};

use super::arguments::{Format, OutputArguments, When};
use super::error::Failure;
use super::{help, sarif};

/// How this command prints.
pub struct Output {
    format: Format,
    colour: bool,
    pub quiet: bool,
    pub verbose: bool,
    /// Diagnostics for SARIF, which prints them in one piece at the end.
    collected: Mutex<Vec<DiagnosticRecord>>,
    /// The diagnostics that were printed for people.
    told: Mutex<BTreeSet<String>>,
    /// The command's result for JSON, printed at the end.
    result: Mutex<Fields>,
    /// Why something that was printed is lost.
    lost: Mutex<Option<String>>,
}

type Fields = serde_json::Map<String, serde_json::Value>;

/// Raised whenever a field of a command's result changes its meaning or goes away.
pub const SCHEMA: u32 = 4;

/// The end of a command in JSON: its last line on stdout, whether it failed or not. `avastra explain json` says which
/// fields a result has (`schema`).
#[derive(serde::Serialize)]
struct Line<'a> {
    schema: u32,
    command: &'a str,
    status: u8,
    error: Option<String>,
    /// None if the command failed before it found anything.
    #[serde(flatten)]
    result: Fields,
}

/// How progress is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Telling {
    Bar,
    Lines,
    Nothing,
}

impl Output {
    #[expect(clippy::disallowed_methods, reason = "whether a user wants colours is said in the environment")]
    pub fn new(arguments: &OutputArguments) -> Output {
        let colour = match arguments.color {
            When::Always => true,
            When::Never => false,
            When::Auto => {
                arguments.format == Format::Human
                    && is_on_screen()
                    && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
            }
        };
        let (quiet, verbose) = (arguments.quiet, arguments.verbose);
        Output { colour, quiet, verbose, ..Output::of(arguments.format) }
    }

    /// Without colour.
    pub fn of(format: Format) -> Output {
        Output {
            format,
            colour: false,
            quiet: false,
            verbose: false,
            collected: Mutex::default(),
            told: Mutex::default(),
            result: Mutex::default(),
            lost: Mutex::default(),
        }
    }

    /// One for reading files about which nothing is to be told.
    pub fn silent() -> Output {
        Output::of(Format::Silent)
    }

    pub fn is_json(&self) -> bool {
        self.format == Format::Json
    }

    /// How progress is told, in this form and at this place.
    pub fn telling(&self) -> Telling {
        match self.format {
            _ if self.quiet => Telling::Nothing,
            Format::Human if is_on_screen() => Telling::Bar,
            Format::Human | Format::Plain => Telling::Lines,
            Format::Json | Format::Sarif | Format::Silent => Telling::Nothing,
        }
    }

    /// Whether the output is read by a program, or not at all.
    fn is_for_no_person(&self) -> bool {
        matches!(self.format, Format::Json | Format::Silent)
    }

    /// Ends the command's output: its result, and why it failed if it did.
    pub fn finish(&self, command: &str, failure: Option<&Failure>) {
        if self.is_json() {
            let (status, error) = (failure.map_or(0, Failure::status), failure.map(Failure::to_string));
            let result = std::mem::take(&mut *self.result.lock().expect("nothing panics while it holds it"));
            let line = Line { schema: SCHEMA, command, status, error, result };
            let json = serde_json::to_string(&line).expect("results have string keys only");
            self.print(&json_on_terminal(&json));
            return;
        }
        if self.format == Format::Sarif {
            let log = sarif::log(&self.collected());
            let json = serde_json::to_string_pretty(&log).expect("it is JSON already");
            self.print(&json_on_terminal(&json));
        }
        failure.iter().for_each(|failure| self.fault(failure));
    }

    /// One of several failures of a command, on stderr; JSON has it in the result.
    pub fn fault(&self, failure: &Failure) {
        self.head("error", "31", &failure.to_string());
    }

    /// Prints a warning to stderr, for something that does not make the command fail. JSON has it in the result.
    pub fn warn(&self, text: &str) {
        self.head("warning", "33", text);
    }

    /// A text after a word in a colour, on stderr.
    fn head(&self, word: &str, colour: &str, text: &str) {
        // A text from a file may hold line breaks. No line but ours begins without a blank.
        let lines: Vec<&str> = text.split('\n').collect();
        let (first, more) = lines.split_first().expect("there is always a line");
        let indent =
            |line: &&str| if line.starts_with(' ') { format!("\n{line}") } else { format!("\n  {line}") };
        let text = first.to_string() + &more.iter().map(indent).collect::<String>();
        let text = on_terminal(&text);
        match (self.is_for_no_person(), self.colour) {
            (true, _) => {}
            (false, true) => drawn(&format!("\x1b[1;{colour}m{word}\x1b[0m: {text}")),
            (false, false) => drawn(&format!("{word}: {text}")),
        }
    }

    /// Prints an explanation of what a command does to stderr.
    pub fn aside(&self, text: &str) {
        if !self.quiet && !self.is_for_no_person() {
            remark(text);
        }
    }

    /// Whether all that was printed reached its reader.
    ///
    /// # Errors
    /// If some of it did not, because a disk is full for example.
    pub fn arrived(&self) -> Result<(), Failure> {
        self.note(std::io::stdout().flush());
        let lost = self.lost.lock().expect("no thread panics while printing");
        lost.as_ref()
            .map_or(Ok(()), |reason| Err(Failure::file("write", Path::new("standard output"), reason)))
    }

    /// A line on stdout.
    fn print(&self, text: &str) {
        self.note(writeln!(std::io::stdout(), "{text}"));
    }

    /// Remembers the first failure to print. A reader that has gone away (`| head`) is none.
    fn note(&self, printed: std::io::Result<()>) {
        if let Err(error) = printed.or_else(unless_closed) {
            let mut lost = self.lost.lock().expect("no thread panics while printing");
            lost.get_or_insert(error.to_string());
        }
    }

    /// Text for people on stdout; nothing in JSON.
    pub fn say(&self, text: &str) {
        self.document(&on_terminal(text));
    }

    /// A text that a program may read, as it is: a source, a picture or JSON; nothing in JSON, whose result has it.
    pub fn document(&self, text: &str) {
        if matches!(self.format, Format::Human | Format::Plain) {
            self.print(text);
        }
    }

    /// Text that `--quiet` leaves out.
    pub fn tell(&self, text: &str) {
        if !self.quiet {
            self.say(text);
        }
    }

    /// Sets the command's result, an object. It is printed in JSON alone, at the end.
    pub fn result(&self, result: impl serde::Serialize) {
        if self.is_json() {
            let value = serde_json::to_value(result).expect("results have string keys only");
            let serde_json::Value::Object(fields) = value else { panic!("a result is an object: {value}") };
            *self.result.lock().expect("nothing panics while it holds it") = fields;
        }
    }

    /// Diagnostics on stderr; in JSON one object a line. For people each is there once, however many files use the file that it
    /// is about.
    pub fn diagnostics(&self, sources: &Sources, diagnostics: &[Diagnostic]) {
        for diagnostic in diagnostics {
            match self.format {
                Format::Silent => {}
                Format::Sarif => self.collected().push(avastra_lang::syntax::record(diagnostic, sources)),
                Format::Json => {
                    let record = avastra_lang::syntax::record(diagnostic, sources);
                    let json = serde_json::to_string(&record).expect("records have string keys only");
                    drawn(&json_on_terminal(&json));
                }
                Format::Human | Format::Plain => {
                    let style = if self.colour { Style::Human } else { Style::Plain };
                    let text = avastra_lang::syntax::render(diagnostic, sources, style);
                    if self.told.lock().expect("no thread panics while telling").insert(text.clone()) {
                        drawn(&format!("{}\n", text.trim_end()));
                    }
                }
            }
        }
    }

    fn collected(&self) -> std::sync::MutexGuard<'_, Vec<DiagnosticRecord>> {
        self.collected.lock().expect("no thread panics while collecting")
    }
}

/// The command line that is being carried out.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Keeps the words of the command line.
///
/// # Panics
/// If a command was begun before in this process.
pub fn begin(words: Vec<OsString>) -> &'static [OsString] {
    assert!(WORDS.set(words).is_ok(), "a process carries out one command");
    WORDS.get().expect("it was just set")
}

/// The words of the command line behind the program's name.
pub fn command_line() -> Vec<String> {
    let words = WORDS.get().into_iter().flatten().skip(1);
    words.map(|word| word.to_string_lossy().into_owned()).collect()
}

/// Whether a command line asks for JSON, also one that cannot be parsed.
pub fn asks_for_json() -> bool {
    let arguments = command_line();
    let asks = |pair: &[String]| pair[0] == "--format" && pair[1] == "json";
    arguments.windows(2).any(asks) || arguments.iter().any(|argument| argument == "--format=json")
}

/// Ends a command line that could not be parsed, and asks for JSON.
pub fn usage_in_json(failure: &Failure) {
    let (mut known, mut words) = (help::command(), Vec::new());
    for word in command_line() {
        if let Some(found) = known.find_subcommand(&word).cloned() {
            known = found;
            words.push(word);
        }
    }
    let name = if words.is_empty() { "avastra".to_owned() } else { words.join(" ") };
    Output::of(Format::Json).finish(&name, Some(failure));
}

/// A pipe that its reader has closed is no error.
pub fn unless_closed(error: std::io::Error) -> std::io::Result<()> {
    if error.kind() == std::io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) }
}

/// A line on stderr.
pub fn remark(text: &str) {
    drawn(&on_terminal(text));
}

/// A line on stderr whose colours, if any, are ours. If it is lost, there is no place left to say so; the exit status says
/// what is wrong.
fn drawn(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Whether stderr is a terminal that can do more than print one line after another.
#[expect(clippy::disallowed_methods, reason = "which terminal it is stands in the environment")]
fn is_on_screen() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|name| name != "dumb")
}

/// Columns that every terminal shows in a line; longer text is folded.
pub const COLUMNS: usize = 80;

/// A path as a shell takes it for one word, for commands that are printed to be copied.
pub fn for_shell(path: &Path) -> String {
    let text = path.shown().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+,:@%=".contains(letter);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    // Between single quotes every other letter stands for itself.
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// `1 collision`, `2 collisions`.
pub fn plural(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
