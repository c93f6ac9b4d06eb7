//! Mistakes and quick fixes, as an editor takes them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::model;
use crate::syntax::ast::{FileId, Span};
use crate::syntax::{Diagnostic, Severity};

use super::structure;
use super::workspace::{Analysis, Workspace};

/// The mistakes of all open documents and of what they use, by file. Every open document has an
/// entry.
pub fn all(workspace: &mut Workspace) -> BTreeMap<PathBuf, Vec<Value>> {
    let paths = workspace.paths();
    let mut found: BTreeMap<PathBuf, Vec<Value>> =
        paths.iter().map(|path| (path.clone(), Vec::new())).collect();
    for path in &paths {
        workspace.analysis(path);
    }
    for path in &paths {
        let Some(analysis) = workspace.known(path) else { continue };
        for diagnostic in analysis.loaded.diagnostics.iter().chain(&analysis.loaded.remarks) {
            let file = diagnostic.place().map_or(Analysis::ROOT, |place| place.file);
            let of = analysis.path(file).unwrap_or(path);
            let shown = to_json(diagnostic, analysis, workspace);
            // A mistake in a file that several documents use is shown once.
            let list = found.entry(of.to_owned()).or_default();
            if !list.contains(&shown) {
                list.push(shown);
            }
        }
    }
    found
}

fn to_json(diagnostic: &Diagnostic, analysis: &Analysis, workspace: &Workspace) -> Value {
    let severity = match diagnostic.severity {
        Severity::Error => 1,
        Severity::Warning => 2,
        // 4 is a hint: a note asks for no change and should not look like a mistake.
        Severity::Note => 4,
    };
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
    let related: Vec<Value> = diagnostic
        .labels
        .iter()
        .filter(|label| Some(*label) != said)
        .filter_map(|label| {
            let location = location(label.span, analysis, workspace)?;
            let text = if label.text.is_empty() { "here" } else { &label.text };
            Some(json!({ "location": location, "message": text }))
        })
        .collect();
    let mut shown = json!({
        "range": analysis.range(place),
        "severity": severity,
        "code": diagnostic.code,
        "source": "avastra",
        "message": message,
        "relatedInformation": related,
    });
    if diagnostic.code == model::code::UNUSED {
        // 1 means unnecessary: editors show the text faded.
        shown["tags"] = json!([1]);
    }
    shown
}

/// The location of a span, for the editor; `None` if the span is in no file.
pub fn location(span: Span, analysis: &Analysis, workspace: &Workspace) -> Option<Value> {
    let path = analysis.path(span.file)?;
    Some(json!({ "uri": workspace.uri(path), "range": analysis.range(span) }))
}

/// The quick fixes of the mistakes between two bytes of the document.
pub fn fixes(analysis: &Analysis, workspace: &Workspace, from: usize, to: usize) -> Vec<Value> {
    let touches = |diagnostic: &&Diagnostic| {
        let of_root = diagnostic.labels.iter().filter(|label| label.span.file == Analysis::ROOT);
        of_root.clone().any(|label| label.span.start <= to && from <= label.span.end)
    };
    let mut actions = Vec::new();
    for diagnostic in analysis.loaded.diagnostics.iter().filter(touches) {
        let shown = to_json(diagnostic, analysis, workspace);
        'fixes: for fix in &diagnostic.fixes {
            let mut changes: BTreeMap<String, Vec<Value>> = BTreeMap::new();
            for edit in &fix.edits {
                let Some(path) = analysis.path(edit.span.file) else { continue 'fixes };
                let edit = json!({ "range": analysis.range(edit.span), "newText": edit.text });
                changes.entry(workspace.uri(path)).or_default().push(edit);
            }
            actions.push(json!({
                "title": fix.title,
                "kind": "quickfix",
                "diagnostics": [shown],
                "isPreferred": diagnostic.fixes.len() == 1,
                "edit": { "changes": changes },
            }));
        }
        actions.extend(replacement(diagnostic, analysis, workspace, &shown));
    }
    actions
}

/// For a name that a used file declares already, `override`. It is offered here and not by `check --fix`, because only
/// the author knows whether the other declaration is to be replaced.
fn replacement(
    diagnostic: &Diagnostic,
    analysis: &Analysis,
    workspace: &Workspace,
    shown: &Value,
) -> Option<Value> {
    let again = diagnostic.place().filter(|place| place.file == Analysis::ROOT)?;
    let is_elsewhere = diagnostic.labels.iter().any(|label| label.span.file != Analysis::ROOT);
    if diagnostic.code != model::code::DUPLICATE || !is_elsewhere {
        return None;
    }
    let (title, edit) = structure::override_before(analysis, again)?;
    let uri = workspace.uri(analysis.path(Analysis::ROOT)?);
    Some(json!({
        "title": title,
        "kind": "quickfix",
        "diagnostics": [shown],
        "edit": { "changes": { uri: [edit] } },
    }))
}

/// The file of an analysis with that path.
pub fn file_of(analysis: &Analysis, path: &Path) -> Option<FileId> {
    let index = analysis.loaded.files.iter().position(|file| file.path == path)?;
    u32::try_from(index).ok().map(FileId)
}
