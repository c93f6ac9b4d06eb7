//! The diagnostics of the compiler: a code, a message, the places it is about, and what to do.
//!
//! Every stage that reads source text reports through these types; only this file knows how they are drawn. Codes are never
//! reused or renumbered. The caller decides when to stop, and with which exit status.

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde::Serialize;

use crate::syntax::ast::{FileId, Span};
use avastra_base::outside::{in_line, on_terminal};

/// How severe a diagnostic is. Errors stop a compilation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    Error,
    Warning,
    Note,
}

/// A place that a diagnostic is about, and the text to show there.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    pub span: Span,
    /// May be empty: the place is then only underlined.
    pub text: String,
    /// Whether the mistake is here. The other labels show what it conflicts with.
    pub primary: bool,
}

/// One mistake, or one thing worth knowing.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// `AV0001` and so on; see `avastra explain`.
    pub code: &'static str,
    pub severity: Severity,
    /// Lower case, no full stop, the author's words in backticks.
    pub message: String,
    pub labels: Vec<Label>,
    /// Facts that belong to no place.
    pub notes: Vec<String>,
    /// Advice to the author.
    pub help: Option<String>,
    /// Changes that a tool may make: each of them alone removes the mistake.
    pub fixes: Vec<Fix>,
}

/// A change of one place of the source.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// The effect of the change, as a command: ``write `drive_ahead` ``.
    pub title: String,
    /// The replaced text; an empty span inserts.
    pub span: Span,
    pub text: String,
}

impl Diagnostic {
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        Diagnostic::new(code, Severity::Error, message)
    }

    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Diagnostic::new(code, Severity::Warning, message)
    }

    /// A remark: worth knowing, but it asks for no change.
    pub fn remark(code: &'static str, message: impl Into<String>) -> Self {
        Diagnostic::new(code, Severity::Note, message)
    }

    fn new(code: &'static str, severity: Severity, message: impl Into<String>) -> Self {
        Diagnostic {
            code,
            severity,
            message: message.into(),
            labels: Vec::new(),
            notes: Vec::new(),
            help: None,
            fixes: Vec::new(),
        }
    }

    /// Adds a place where the mistake is.
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: true });
        self
    }

    /// Adds a place that explains the mistake.
    pub fn beside(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: false });
        self
    }

    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Says what to do about it, where that is known.
    pub(crate) fn help_if(self, help: Option<String>) -> Self {
        match help {
            Some(help) => self.help(help),
            None => self,
        }
    }

    /// Adds a change of one place that removes the mistake.
    pub fn fix(mut self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.fixes.push(Fix { title: title.into(), span, text: text.into() });
        self
    }

    /// Names the word that the author probably meant, and offers to write it.
    pub fn meant(self, span: Span, word: &str) -> Self {
        self.help(format!("did you mean `{word}`?")).fix(format!("write `{word}`"), span, word)
    }

    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// The place to sort by and to show first: its first primary label, else its first label.
    pub fn place(&self) -> Option<Span> {
        let primary = self.labels.iter().find(|label| label.primary);
        primary.or(self.labels.first()).map(|label| label.span)
    }
}

/// The texts that spans point into.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    files: Vec<Source>,
}

#[derive(Debug, Clone)]
struct Source {
    name: String,
    text: String,
    /// First byte of each line, so that lines need not be counted anew for each of many mistakes.
    line_starts: Vec<usize>,
}

impl Sources {
    pub fn new() -> Self {
        Sources::default()
    }

    /// Adds a text, under the name that diagnostics show.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = u32::try_from(self.files.len()).expect("fewer than four thousand million files");
        let (name, text): (String, String) = (name.into(), text.into());
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        let line_starts = core::iter::once(0).chain(breaks).collect();
        self.files.push(Source { name, text, line_starts });
        FileId(id)
    }

    /// The name under which the file was added; empty for an unknown file.
    pub fn name(&self, file: FileId) -> &str {
        self.files.get(file.0 as usize).map_or("", |source| &source.name)
    }

    /// The text of the file; empty for an unknown file.
    pub fn text(&self, file: FileId) -> &str {
        self.files.get(file.0 as usize).map_or("", |source| &source.text)
    }

    /// Line and column of a byte, both from 1; columns count characters.
    pub fn line_column(&self, file: FileId, offset: usize) -> (usize, usize) {
        let Some(source) = self.files.get(file.0 as usize) else { return (1, 1) };
        let offset = floor_boundary(&source.text, offset);
        let line = source.line_starts.partition_point(|start| *start <= offset);
        (line, source.text[source.line_starts[line - 1]..offset].chars().count() + 1)
    }
}

/// How a diagnostic is drawn for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// With colours, for a terminal.
    Human,
    /// Without colours.
    Plain,
}

/// Width at which long source lines are cut, in characters.
const WIDTH: usize = 140;

/// Draws one diagnostic, without a line break at its end.
pub fn render(diagnostic: &Diagnostic, sources: &Sources, style: Style) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let title = level.primary_title(in_line(&diagnostic.message)).id(diagnostic.code);
    let mut group = Group::with_title(title);
    for file in files_in_order(diagnostic) {
        for labels in pieces(diagnostic, file) {
            group = match snippet(&labels, sources, file) {
                Some(snippet) => group.element(snippet),
                None => group.element(origin(&labels, sources, file)),
            };
        }
    }
    for note in &diagnostic.notes {
        group = group.element(Level::NOTE.no_name().message(on_terminal(note)));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(on_terminal(help)));
    }
    let renderer = match style {
        Style::Human => Renderer::styled(),
        Style::Plain => Renderer::plain(),
    };
    let drawn = renderer.term_width(WIDTH).render(&[group]);
    // The renderer does not replace the control characters of Latin-1 in source lines, and some terminals obey them.
    drawn.replace(|c: char| ('\u{80}'..='\u{9f}').contains(&c), "\u{fffd}")
}

/// The files that a diagnostic names: the one with the mistake first.
fn files_in_order(diagnostic: &Diagnostic) -> Vec<FileId> {
    let mut files: Vec<FileId> = diagnostic.place().map(|span| span.file).into_iter().collect();
    for label in &diagnostic.labels {
        if !files.contains(&label.span.file) {
            files.push(label.span.file);
        }
    }
    files
}

/// Longest piece of a text that is drawn, bytes: drawing takes time in proportion to it, for each diagnostic.
const DRAWN_MAX: usize = 20_000;

/// Most labels that are drawn of one diagnostic in one file.
const LABELS_MAX: usize = 40;

/// The labels of a diagnostic in one file, grouped by nearness. The group of the mistake comes first, the others in the
/// order of the text.
fn pieces(diagnostic: &Diagnostic, file: FileId) -> Vec<Vec<&Label>> {
    let of_file = diagnostic.labels.iter().filter(|label| label.span.file == file);
    let mut labels: Vec<&Label> = of_file.take(LABELS_MAX).collect();
    let (Some(first), Some(last)) =
        (labels.iter().map(|label| label.span.start).min(), labels.iter().map(|label| label.span.end).max())
    else {
        return Vec::new();
    };
    // Nearly always all are near each other. They are drawn in the order in which they were given.
    if last.saturating_sub(first) <= DRAWN_MAX {
        return vec![labels];
    }
    labels.sort_by_key(|label| label.span);
    let mut pieces: Vec<Vec<&Label>> = Vec::new();
    for label in labels {
        match pieces.last_mut() {
            Some(piece) if label.span.end.saturating_sub(piece[0].span.start) <= DRAWN_MAX => {
                piece.push(label)
            }
            _ => pieces.push(vec![label]),
        }
    }
    pieces.sort_by_key(|piece| !piece.iter().any(|label| label.primary));
    pieces
}

/// The name of a file with the line and column of a place that is not drawn.
fn origin<'a>(labels: &[&Label], sources: &'a Sources, file: FileId) -> Origin<'a> {
    let origin = Origin::path(in_line(sources.name(file)));
    match labels.first() {
        Some(label) if !sources.text(file).is_empty() => {
            let (line, column) = sources.line_column(file, label.span.start);
            origin.line(line).char_column(column)
        }
        _ => origin,
    }
}

/// The lines of one file that some labels touch; `None` where there is no text to draw, or too much.
fn snippet<'a>(
    labels: &[&'a Label],
    sources: &'a Sources,
    file: FileId,
) -> Option<Snippet<'a, Annotation<'a>>> {
    let text = sources.text(file);
    if text.is_empty() {
        return None;
    }
    let first = floor_boundary(text, labels.iter().map(|label| label.span.start).min()?);
    let last = floor_boundary(text, labels.iter().map(|label| label.span.end).max()?).max(first);
    // The renderer gets these lines alone, so that a mistake costs no more in a long file.
    let start = text[..first].rfind('\n').map_or(0, |newline| newline + 1);
    let end = text[last..].find('\n').map_or(text.len(), |newline| last + newline);
    if end - start > DRAWN_MAX {
        return None;
    }
    let line = sources.line_column(file, start).0;
    let annotations = labels.iter().map(|label| {
        let from = floor_boundary(text, label.span.start);
        let to = floor_boundary(text, label.span.end).max(from);
        let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
        let annotation = kind.span(from - start..to - start);
        if label.text.is_empty() { annotation } else { annotation.label(in_line(&label.text)) }
    });
    let snippet = Snippet::source(&text[start..end]).line_start(line).path(in_line(sources.name(file)));
    Some(snippet.annotations(annotations))
}

/// The nearest character boundary at or before `offset`.
fn floor_boundary(text: &str, offset: usize) -> usize {
    text.floor_char_boundary(offset.min(text.len()))
}

/// A list of the author's words: `` `a`, `b` and `c` ``.
pub fn listed<S: AsRef<str>>(words: &[S]) -> String {
    enumerated(&quoted(words), "and")
}

/// `a`, `b` or `c`.
pub(crate) fn one_of<S: AsRef<str>>(words: &[S]) -> String {
    enumerated(&quoted(words), "or")
}

fn quoted<S: AsRef<str>>(words: &[S]) -> Vec<String> {
    words.iter().map(|word| format!("`{}`", word.as_ref())).collect()
}

/// `a, b or c`, with the given conjunction.
pub(crate) fn enumerated<S: AsRef<str>>(words: &[S], conjunction: &str) -> String {
    let words: Vec<&str> = words.iter().map(S::as_ref).collect();
    match words.as_slice() {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [most @ .., last] => format!("{} {conjunction} {last}", most.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::record;

    #[test]
    fn nothing_acts_on_a_terminal() {
        let mut sources = Sources::new();
        let file = sources.add("\u{1b}]0;name\u{7}.ava", "let x = \u{1b}[31m \u{9b}3\n");
        let diagnostic = Diagnostic::error("AV0201", "an \u{1b}[2J odd one")
            .at(Span::new(file, 4, 5), "\u{1b}[8m here")
            .note("\u{1b}c")
            .help("\u{1b}c");
        assert!(render(&diagnostic, &sources, Style::Human).contains("\u{1b}["), "colours");
        let plain = render(&diagnostic, &sources, Style::Plain);
        assert!(!plain.contains(|c: char| c.is_control() && c != '\n'), "{plain:?}");
        for drawn in ["[2J odd", "]0;name", "[8m here", "[31m "] {
            assert!(plain.contains(drawn), "{plain}");
        }
    }

    #[test]
    fn bad_spans_draw_something() {
        let mut sources = Sources::new();
        let file = sources.add("ä.ava", "äöü");
        for span in [Span::new(file, 1, 3), Span::new(file, 90, 7), Span::new(FileId(9), 0, 4), Span::NONE] {
            let diagnostic = Diagnostic::warning("AV0001", "odd").at(span, "x");
            assert!(render(&diagnostic, &sources, Style::Plain).contains("odd"));
            assert_eq!(record(&diagnostic, &sources).message, "odd");
        }
    }
}
