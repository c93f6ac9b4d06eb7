//! Where a document folds, where its paths lead, and the declarations of the whole workspace.

use std::collections::BTreeSet;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::check::Symbol;
use crate::cli::load;
use crate::syntax;
use crate::syntax::ast::{FileId, Span};

use super::outline;
use super::position::Lines;
use super::workspace::{Analysis, Workspace};

/// Symbols that a search lists, at most: nobody reads more.
const FOUND_MAX: usize = 256;

/// Declarations of several lines, and runs of comment lines.
pub fn folds(analysis: &Analysis) -> Vec<Value> {
    let text = analysis.text(Analysis::ROOT);
    let Some(lines) = analysis.lines(Analysis::ROOT) else { return Vec::new() };
    let line_of = |byte: usize| lines.position(text, byte).0;
    let fold = |start: usize, end: usize, kind: &str| {
        (start < end).then(|| json!({ "startLine": start, "endLine": end, "kind": kind }))
    };
    let items = analysis.loaded.files[0].tree.items.iter();
    let mut found: Vec<Value> =
        items.filter_map(|item| fold(line_of(item.span.start), line_of(item.span.end), "region")).collect();
    let mut begun: Option<usize> = None;
    for (number, line) in text.lines().chain([""]).enumerate() {
        match (line.trim_start().starts_with("//"), begun) {
            (true, None) => begun = Some(number),
            (false, Some(start)) => {
                found.extend(fold(start, number - 1, "comment"));
                begun = None;
            }
            _ => {}
        }
    }
    found
}

/// The paths of used files and maps, each with where it leads.
pub fn links(analysis: &Analysis, workspace: &Workspace) -> Vec<Value> {
    let occurrences = analysis.references().in_file(Analysis::ROOT);
    occurrences
        .filter_map(|occurrence| match occurrence.symbols.as_slice() {
            [Symbol::File(path)] => {
                Some(json!({ "range": analysis.range(occurrence.span), "target": workspace.uri(path) }))
            }
            _ => None,
        })
        .collect()
}

/// Declarations whose name contains the query, in open documents and in the other files of the editor's folders.
pub fn search(workspace: &Workspace, query: &str) -> Vec<Value> {
    let query = query.to_lowercase();
    let below = workspace.folders.iter().flat_map(|folder| load::below(folder));
    let files: BTreeSet<PathBuf> = workspace.paths().into_iter().chain(below).collect();
    let mut found = Vec::new();
    for file in files {
        let text = match workspace.document(&file) {
            Some(document) => document.text.clone(),
            None => load::read(&file).unwrap_or_default(),
        };
        let (lines, uri) = (Lines::new(&text), workspace.uri(&file));
        for item in syntax::parse(FileId::default(), &text).0.items {
            let Some((name, kind)) = outline::named(&item) else { continue };
            if found.len() < FOUND_MAX && name.text.to_lowercase().contains(&query) {
                let location = json!({ "uri": uri, "range": lines.range(&text, name.span) });
                found.push(json!({ "name": name.text, "kind": kind, "location": location }));
            }
        }
    }
    found
}

/// For a declaration that a used file has already: `override` before it, as a title and an edit of the document.
pub fn override_before(analysis: &Analysis, name: Span) -> Option<(String, Value)> {
    let item = analysis.loaded.files[0]
        .tree
        .items
        .iter()
        .find(|item| item.kind.name().is_some_and(|declared| declared.span == name))?;
    let text = analysis.text(Analysis::ROOT);
    // The item begins with its documentation.
    let keyword = item.kind.plain().keyword();
    let header = text.get(item.span.start..name.start)?;
    let before = header[..header.rfind(keyword)?].trim_end();
    let at = item.span.start + header.rfind(keyword)?;
    let at = before.strip_suffix("optional").map_or(at, |docs| item.span.start + docs.len());
    let place = analysis.range(Span::new(Analysis::ROOT, at, at));
    Some((format!("write `override` before `{keyword}`"), json!({ "range": place, "newText": "override " })))
}
