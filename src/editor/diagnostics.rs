//! Mistakes and quick fixes, as an editor shows them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_lang::model;
use avastra_lang::syntax::ast::{FileId, Span};
use avastra_lang::syntax::{Diagnostic, Severity};

use super::position::{Place, Range};
use super::structure;
use super::workspace::{Analysis, Workspace};

/// A mistake in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    pub range: Range,
    pub severity: Severity,
    pub code: &'static str,
    /// The message with its notes and its help, a line each.
    pub message: String,
    /// Other places that have to do with it, and what is there.
    pub related: Vec<(Place, String)>,
    /// Whether the text could go.
    pub is_unnecessary: bool,
}

/// A text in place of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    pub range: Range,
    pub text: String,
}

/// Changes of files.
pub type Changes = BTreeMap<PathBuf, Vec<Change>>;

/// A change that mends a mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remedy {
    pub title: String,
    pub mistake: Mistake,
    /// Whether it is the only one.
    pub is_preferred: bool,
    pub changes: Changes,
}

/// The mistakes of all open documents and of what they use, by file. Every open document has an
/// entry.
pub fn all(workspace: &mut Workspace) -> BTreeMap<PathBuf, Vec<Mistake>> {
    let paths = workspace.paths();
    let mut found: BTreeMap<PathBuf, Vec<Mistake>> =
        paths.iter().map(|path| (path.clone(), Vec::new())).collect();
    for path in &paths {
        workspace.analysis(path);
    }
    for path in &paths {
        let Some(analysis) = workspace.known(path) else { continue };
        for diagnostic in analysis.loaded.diagnostics.iter().chain(&analysis.loaded.remarks) {
            let file = diagnostic.place().map_or(Analysis::ROOT, |place| place.file);
            let of = analysis.path(file).unwrap_or(path);
            let shown = mistake(diagnostic, analysis);
            // A mistake in a file that several documents use is shown once.
            let list = found.entry(of.to_owned()).or_default();
            if !list.contains(&shown) {
                list.push(shown);
            }
        }
    }
    found
}

fn mistake(diagnostic: &Diagnostic, analysis: &Analysis) -> Mistake {
    let place = diagnostic.place().unwrap_or(Span::NONE);
    let mut message = diagnostic.message.clone();
    let mut add = |before: &str, text: &str| {
        if !text.is_empty() {
            message.push('\n');
            message.push_str(before);
            message.push_str(text);
        }
    };
    let said = diagnostic.labels.iter().find(|label| label.span == place);
    add("", said.map_or("", |label| &label.text));
    diagnostic.notes.iter().for_each(|note| add("note: ", note));
    add("help: ", diagnostic.help.as_deref().unwrap_or_default());
    let related = diagnostic.labels.iter().filter(|label| Some(*label) != said);
    let related = related.filter_map(|label| {
        let text = if label.text.is_empty() { "here" } else { &label.text };
        Some((analysis.place(label.span)?, text.to_owned()))
    });
    Mistake {
        range: analysis.range(place),
        severity: diagnostic.severity,
        code: diagnostic.code,
        related: related.collect(),
        message,
        is_unnecessary: diagnostic.code == model::code::UNUSED,
    }
}

/// The quick fixes of the mistakes between two bytes of the document.
pub fn fixes(analysis: &Analysis, from: usize, to: usize) -> Vec<Remedy> {
    let touches = |diagnostic: &&Diagnostic| {
        let mut of_root = diagnostic.labels.iter().filter(|label| label.span.file == Analysis::ROOT);
        of_root.any(|label| label.span.start <= to && from <= label.span.end)
    };
    let mut remedies = Vec::new();
    for diagnostic in analysis.loaded.diagnostics.iter().filter(touches) {
        let mistake = mistake(diagnostic, analysis);
        for fix in &diagnostic.fixes {
            let Some(path) = analysis.path(fix.span.file) else { continue };
            let change = Change { range: analysis.range(fix.span), text: fix.text.clone() };
            remedies.push(Remedy {
                title: fix.title.clone(),
                mistake: mistake.clone(),
                is_preferred: diagnostic.fixes.len() == 1,
                changes: Changes::from([(path.to_owned(), vec![change])]),
            });
        }
        remedies.extend(replacement(diagnostic, analysis, &mistake));
    }
    remedies
}

/// For a name that a used file declares already, `override`. It is offered here and not by `check --fix`, because only
/// the author knows whether the other declaration is to be replaced.
fn replacement(diagnostic: &Diagnostic, analysis: &Analysis, mistake: &Mistake) -> Option<Remedy> {
    let again = diagnostic.place().filter(|place| place.file == Analysis::ROOT)?;
    let is_elsewhere = diagnostic.labels.iter().any(|label| label.span.file != Analysis::ROOT);
    if diagnostic.code != model::code::DUPLICATE || !is_elsewhere {
        return None;
    }
    let (title, change) = structure::override_before(analysis, again)?;
    let changes = Changes::from([(analysis.path(Analysis::ROOT)?.to_owned(), vec![change])]);
    Some(Remedy { title, mistake: mistake.clone(), is_preferred: false, changes })
}

/// The file of an analysis with that path.
pub fn file_of(analysis: &Analysis, path: &Path) -> Option<FileId> {
    let index = analysis.loaded.files.iter().position(|file| file.path == path)?;
    u32::try_from(index).ok().map(FileId)
}
