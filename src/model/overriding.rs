//! `override`: a declaration in place of the one of that kind and name in a used file.
//!
//! The new declaration stands where the old one stood, so that the rows of a table keep their
//! numbers. What used the old one uses the new one, in the used file too: it is checked anew.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::model::code;
use crate::model::load::LoadedFile;
use crate::model::load::used_paths;
use crate::syntax::Diagnostic;
use crate::syntax::ast::Item;
use crate::syntax::ast::ItemKind;
use crate::syntax::nearest;

/// A declaration that holds, and the file that it is from.
struct Standing<'a> {
    file: usize,
    item: Cow<'a, Item>,
}

/// Every declaration of the files in that order (imports first), overridden ones replaced.
pub(super) fn resolve<'a>(files: &'a [LoadedFile], order: &[usize]) -> (Vec<Cow<'a, Item>>, Vec<Diagnostic>) {
    let mut standing: Vec<Standing<'a>> = Vec::new();
    let mut diagnostics = Vec::new();
    for &file in order {
        for item in &files[file].tree.items {
            match &item.kind {
                ItemKind::Override(kind) => match find(files, &standing, file, item, kind) {
                    Ok(place) => {
                        let item = Item { docs: item.docs.clone(), kind: (**kind).clone(), span: item.span };
                        standing[place] = Standing { file, item: Cow::Owned(item) };
                    }
                    Err(error) => diagnostics.push(*error),
                },
                _ => standing.push(Standing { file, item: Cow::Borrowed(item) }),
            }
        }
    }
    (standing.into_iter().map(|standing| standing.item).collect(), diagnostics)
}

/// Where the declaration stands that is to be replaced.
fn find(
    files: &[LoadedFile],
    standing: &[Standing<'_>],
    file: usize,
    item: &Item,
    kind: &ItemKind,
) -> Result<usize, Box<Diagnostic>> {
    let name = |kind: &ItemKind| kind.name().map(|name| name.text.clone());
    let same_kind = |other: &ItemKind| core::mem::discriminant(other) == core::mem::discriminant(kind);
    let wanted = name(kind);
    let what = match &wanted {
        Some(name) => format!("{} `{name}`", kind.keyword()),
        None => format!("`{}`", kind.keyword()),
    };
    let span = kind.name().map_or(item.span, |name| name.span);
    let error = |message: String| Diagnostic::error(code::OVERRIDE, message);
    let place = standing
        .iter()
        .rposition(|standing| same_kind(&standing.item.kind) && name(&standing.item.kind) == wanted);
    let Some(place) = place else {
        let error = error(format!("there is no {what} to override")).at(span, "no used file declares it");
        let other = standing.iter().find(|standing| wanted.is_some() && name(&standing.item.kind) == wanted);
        if let Some(other) = other {
            let is = other.item.kind.keyword();
            let note = format!("this is of another kind: `{is}`");
            return Err(Box::new(error.beside(other.item.span, note)));
        }
        let alike = standing.iter().filter(|standing| same_kind(&standing.item.kind));
        let names: Vec<String> = alike.filter_map(|standing| name(&standing.item.kind)).collect();
        let near = wanted.as_deref().and_then(|wanted| nearest(wanted, names.iter().map(String::as_str)));
        return Err(Box::new(match near {
            Some(near) => error.meant(span, near),
            None => error.help("leave out `override`, or `use` the file that declares it"),
        }));
    };
    let old = &standing[place];
    let old_span = old.item.kind.name().map_or(old.item.span, |name| name.span);
    if old.file == file {
        let error = error(format!("{what} is declared in this very file")).at(span, "overridden here");
        return Err(Box::new(
            error
                .beside(old_span, "declared here")
                .help("change the declaration itself, and remove this one"),
        ));
    }
    if !uses(files, file, old.file) {
        let error = error(format!("{what} is overridden by two files that do not know each other"));
        let error = error.at(span, "overridden here").beside(old_span, "and here");
        return Err(Box::new(
            error.help("let one of the two `use` the other: then its override is the last"),
        ));
    }
    Ok(place)
}

/// Whether a file uses the other, by whatever way.
fn uses(files: &[LoadedFile], from: usize, to: usize) -> bool {
    let mut seen: BTreeSet<PathBuf> = BTreeSet::new();
    let mut open = vec![files[from].path.clone()];
    while let Some(path) = open.pop() {
        if path == files[to].path {
            return true;
        }
        if !seen.insert(path.clone()) {
            continue;
        }
        open.extend(files.iter().filter(|file| file.path == path).flat_map(used_paths));
    }
    false
}
