//! Diagnostics as data: what `--format json` and `--format sarif` are made of, and how a fix is
//! applied. The shape is public: a field that changes its meaning raises [`SCHEMA`].

use serde::Serialize;

use crate::syntax::ast::{FileId, Span};
use crate::syntax::{Diagnostic, Fix, Severity, Sources};

/// Version of the records' fields.
pub const SCHEMA: u32 = 1;

/// A diagnostic as data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagnosticRecord {
    pub schema: u32,
    pub code: &'static str,
    pub severity: Severity,
    pub message: String,
    pub labels: Vec<LabelRecord>,
    pub notes: Vec<String>,
    pub help: Option<String>,
    pub fixes: Vec<FixRecord>,
}

/// A place as data. Lines and columns count from 1, columns in characters, bytes from 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceRecord {
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub start_byte: usize,
    pub end_byte: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelRecord {
    #[serde(flatten)]
    pub place: PlaceRecord,
    pub text: String,
    pub primary: bool,
}

/// A change that a tool may make.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FixRecord {
    pub title: String,
    pub edits: Vec<EditRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EditRecord {
    #[serde(flatten)]
    pub place: PlaceRecord,
    /// The text that stands there after the change.
    pub text: String,
}

/// Turns a diagnostic into data.
pub fn record(diagnostic: &Diagnostic, sources: &Sources) -> DiagnosticRecord {
    let labels = diagnostic.labels.iter().map(|label| LabelRecord {
        place: place(label.span, sources),
        text: label.text.clone(),
        primary: label.primary,
    });
    let edit = |fix: &Fix| EditRecord { place: place(fix.span, sources), text: fix.text.clone() };
    let fixes =
        diagnostic.fixes.iter().map(|fix| FixRecord { title: fix.title.clone(), edits: vec![edit(fix)] });
    DiagnosticRecord {
        schema: SCHEMA,
        code: diagnostic.code,
        severity: diagnostic.severity,
        message: diagnostic.message.clone(),
        labels: labels.collect(),
        notes: diagnostic.notes.clone(),
        help: diagnostic.help.clone(),
        fixes: fixes.collect(),
    }
}

fn place(span: Span, sources: &Sources) -> PlaceRecord {
    let (line, column) = sources.line_column(span.file, span.start);
    let (end_line, end_column) = sources.line_column(span.file, span.end);
    PlaceRecord {
        file: sources.name(span.file).to_owned(),
        line,
        column,
        end_line,
        end_column,
        start_byte: span.start,
        end_byte: span.end,
    }
}

/// The text of a file after the first fix of each of its diagnostics, and how many fixes were made. A
/// fix that overlaps an earlier one is left for the next call.
pub fn apply_fixes(file: FileId, text: &str, diagnostics: &[Diagnostic]) -> (String, usize) {
    let mut fixes: Vec<&Fix> = Vec::new();
    let mut made = 0;
    for fix in diagnostics.iter().filter_map(|diagnostic| diagnostic.fixes.first()) {
        let Fix { span, .. } = fix;
        let is_same = |other: &&Fix| other.span == *span && other.text == fix.text;
        let apart = |other: &&Fix| span.end < other.span.start || other.span.end < span.start;
        let is_in_text = span.file == file && text.get(span.start..span.end).is_some();
        if !is_in_text || !fixes.iter().all(|other| apart(other) || is_same(other)) {
            continue;
        }
        made += 1;
        if !fixes.iter().any(is_same) {
            fixes.push(fix);
        }
    }
    fixes.sort_by_key(|fix| fix.span);
    let mut fixed = String::with_capacity(text.len());
    let mut at = 0;
    for fix in fixes {
        fixed.push_str(&text[at..fix.span.start]);
        fixed.push_str(&fix.text);
        at = fix.span.end;
    }
    fixed.push_str(&text[at..]);
    (fixed, made)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_from_one_and_fixes_are_made_once() {
        let mut sources = Sources::new();
        let text = "language 1\nlet x = 12 m + 3 s\n";
        let file = sources.add("a.ava", text);
        let mistake = Diagnostic::error("AV0201", "odd").at(Span::new(file, 24, 25), "here");
        let mistake = mistake.meant(Span::new(file, 28, 29), "m");
        let data = record(&mistake, &sources);
        assert_eq!((data.labels[0].place.line, data.labels[0].place.column), (2, 14));
        assert_eq!(data.fixes[0].edits[0].text, "m");
        let twice = [mistake.clone(), mistake];
        assert_eq!(apply_fixes(file, text, &twice), ("language 1\nlet x = 12 m + 3 m\n".to_owned(), 2));
        assert_eq!(apply_fixes(FileId(9), text, &twice).1, 0);
    }
}
