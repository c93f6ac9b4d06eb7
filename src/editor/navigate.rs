//! Where a name is declared, and where else it stands.

use std::collections::BTreeSet;
use std::path::Path;

use avastra_lang::check::Symbol;

use super::position::{Place, Range};
use super::rename::home;
use super::workspace::{Analysis, Workspace};

/// Where the name at a byte of the document is declared; at an `override`, the declaration that it replaces. `None` if
/// there is no name.
pub fn definition(analysis: &Analysis, byte: usize) -> Option<Vec<Place>> {
    let occurrence = analysis.references().at(Analysis::ROOT, byte)?;
    if let [Symbol::File(file)] = occurrence.symbols.as_slice() {
        return Some(vec![Place { path: file.clone(), range: Range::default() }]);
    }
    let mut spans = analysis.references().declarations_of(&occurrence.symbols);
    spans.retain(|span| !occurrence.declares || *span != occurrence.span);
    if spans.is_empty() && occurrence.declares {
        spans.push(occurrence.span);
    }
    Some(spans.into_iter().filter_map(|span| analysis.place(span)).collect())
}

/// Every place of the name at a byte of a document. The document's own places come first, then the places in other
/// documents that use the same declaration. These documents are open or lie below the editor's folders.
pub fn references(
    workspace: &mut Workspace,
    path: &Path,
    byte: usize,
    with_declarations: bool,
) -> Vec<Place> {
    for path in workspace.paths() {
        workspace.analysis(&path);
    }
    let Some(analysis) = workspace.known(path) else { return Vec::new() };
    let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else { return Vec::new() };
    let symbols: BTreeSet<Symbol> = occurrence.symbols.iter().cloned().collect();
    let declaring = home(analysis, &symbols);
    let closed = workspace.closed_users(&declaring);
    let others = workspace.paths().into_iter().filter(|other| other != path);
    let open = std::iter::once(path.to_owned()).chain(others);
    let mut found: Vec<Place> = Vec::new();
    for known in open.filter_map(|path| workspace.known(&path)).chain(&closed) {
        let is_same = known.path(Analysis::ROOT) == Some(path)
            || home(known, &symbols).iter().any(|file| declaring.contains(file));
        if !is_same {
            continue;
        }
        for occurrence in known.references().of(&symbols).filter(|o| with_declarations || !o.declares) {
            let place = known.place(occurrence.span);
            found.extend(place.filter(|place| !found.contains(place)));
        }
    }
    found
}

/// Every place of the name at a byte of the document, in the document alone.
pub fn highlights(analysis: &Analysis, byte: usize) -> Vec<Range> {
    let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else { return Vec::new() };
    let symbols: BTreeSet<Symbol> = occurrence.symbols.iter().cloned().collect();
    let here = analysis.references().of(&symbols).filter(|o| o.span.file == Analysis::ROOT);
    here.map(|o| analysis.range(o.span)).collect()
}
