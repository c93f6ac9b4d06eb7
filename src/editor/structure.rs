//! Where a document folds, where its paths lead, and the declarations of the whole workspace.

use std::path::PathBuf;

use avastra_lang::check::Symbol;
use avastra_lang::syntax;
use avastra_lang::syntax::ast::{FileId, Span};

use super::diagnostics::Change;
use super::outline::{self, OutlineKind};
use super::position::{Lines, Place, Range};
use super::workspace::{Analysis, Workspace};

/// Symbols that a search lists, at most: nobody reads more.
const FOUND_MAX: usize = 256;

/// The first and the last line of what an editor can fold away, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fold {
    pub start: usize,
    pub end: usize,
    pub is_comment: bool,
}

/// A declaration of the workspace.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    pub name: String,
    pub kind: OutlineKind,
    pub place: Place,
}

/// Declarations of several lines, and runs of comment lines.
pub fn folds(analysis: &Analysis) -> Vec<Fold> {
    let text = analysis.text(Analysis::ROOT);
    let Some(lines) = analysis.lines(Analysis::ROOT) else { return Vec::new() };
    let line_of = |byte: usize| lines.point(text, byte).line;
    let fold =
        |start: usize, end: usize, is_comment: bool| (start < end).then_some(Fold { start, end, is_comment });
    let items = analysis.loaded.files[0].tree.items.iter();
    let mut found: Vec<Fold> =
        items.filter_map(|item| fold(line_of(item.span.start), line_of(item.span.end), false)).collect();
    let mut begun: Option<usize> = None;
    for (number, line) in text.lines().chain([""]).enumerate() {
        match (line.trim_start().starts_with("//"), begun) {
            (true, None) => begun = Some(number),
            (false, Some(start)) => {
                found.extend(fold(start, number - 1, true));
                begun = None;
            }
            _ => {}
        }
    }
    found
}

/// The paths of used files and maps, each with where it leads.
pub fn links(analysis: &Analysis) -> Vec<(Range, PathBuf)> {
    let occurrences = analysis.references().in_file(Analysis::ROOT);
    occurrences
        .filter_map(|occurrence| match occurrence.symbols.as_slice() {
            [Symbol::File(path)] => Some((analysis.range(occurrence.span), path.clone())),
            _ => None,
        })
        .collect()
}

/// Declarations whose name contains the query, in open documents and in the other files of the editor's folders.
pub fn search(workspace: &Workspace, query: &str) -> Vec<Found> {
    let query = query.to_lowercase();
    let mut files = workspace.below();
    files.extend(workspace.paths());
    let mut found = Vec::new();
    for path in files {
        let text = workspace.text(&path).unwrap_or_default();
        let lines = Lines::new(&text);
        for item in syntax::parse(FileId::default(), &text).0.items {
            let Some((name, kind)) = outline::named(&item) else { continue };
            if found.len() < FOUND_MAX && name.text.to_lowercase().contains(&query) {
                let place = Place { path: path.clone(), range: lines.range(&text, name.span) };
                found.push(Found { name: name.text.clone(), kind, place });
            }
        }
    }
    found
}

/// For a declaration that a used file has already: `override` before it, as a title and an edit of the document.
pub fn override_before(analysis: &Analysis, name: Span) -> Option<(String, Change)> {
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
    let range = analysis.range(Span::new(Analysis::ROOT, at, at));
    let change = Change { range, text: "override ".to_owned() };
    Some((format!("write `override` before `{keyword}`"), change))
}
