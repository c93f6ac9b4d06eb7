//! The content that the digest of a file covers: its own declarations, and the declarations of every file that it uses.
//!
//! Covered are the declarations in force, each as the formatter prints it, and the bytes of every map. An `override`
//! replaces a declaration, and `use … without` leaves it out. Not covered are comments, documentation, line breaks, claims
//! (`expect`), how the declarations are spread over files, and the names of files and maps. So a suite of scenarios stays
//! valid when an author documents or tidies the space.
//!
//! Rows are numbered in the order of the actions, states are drawn in theirs, roads are driven in theirs, and the
//! first rule that refuses an action gives the reason. So their order is covered. That of enums, odds, constants,
//! functions, bodies, trajectories and groups has no effect; they are sorted by name.

use std::collections::BTreeSet;
use std::path::Path;

use crate::check::files::{LoadedFile, path_from, used_paths};
use crate::check::overriding;
use crate::model::Meaning;
use crate::syntax::ast::{self, ExprKind, ItemKind};
use crate::syntax::print_item;

/// The meaning of the file `root` among `files`; `None` if one that it needs was not read, or a map cannot be.
/// `map_digest` gives the digest of a map's bytes.
pub(super) fn meaning(
    files: &[LoadedFile],
    root: &Path,
    map_digest: &mut dyn FnMut(&Path) -> Option<String>,
) -> Option<Meaning> {
    let mut order = Vec::new();
    imports_first(files, root, &mut BTreeSet::new(), &mut order)?;
    let (standing, _) = overriding::resolve(files, &order);
    let mut declarations = Vec::new();
    for item in &standing {
        let kind = match item.kind.plain() {
            ItemKind::Language(_)
            | ItemKind::Use(_)
            | ItemKind::Expect(_)
            | ItemKind::Scenario(_)
            | ItemKind::Policy(_) => continue,
            ItemKind::Road(road) => {
                let file = files.get(item.span.file.0 as usize)?;
                ItemKind::Road(with_map_digest(road, file, map_digest)?)
            }
            kind => kind.clone(),
        };
        let title = title(&kind);
        let sorted_by = if has_free_order(&kind) { title.clone() } else { String::new() };
        declarations.push((sorted_by, (title, print_item(&kind))));
    }
    // Stable: declarations whose order counts keep it, before the others.
    declarations.sort_by(|(left, _), (right, _)| left.cmp(right));
    let declarations: Vec<(String, String)> =
        declarations.into_iter().map(|(_, declared)| declared).collect();
    Some(Meaning::new(declarations))
}

/// The name of a declaration in messages: ``rule `npc_gap` ``, `` `on vehicles also` ``.
fn title(kind: &ItemKind) -> String {
    let keyword = kind.keyword();
    match (kind, kind.name()) {
        (ItemKind::Also(also), _) => {
            let on: Vec<&str> = also.on.iter().map(|name| name.text.as_str()).collect();
            format!("`{keyword} {} also`", on.join(", "))
        }
        (_, Some(name)) => format!("{keyword} `{}`", name.text),
        (_, None) => format!("`{keyword}`"),
    }
}

/// Whether these declarations may stand in any order without any effect.
fn has_free_order(kind: &ItemKind) -> bool {
    matches!(
        kind,
        ItemKind::Enum(_)
            | ItemKind::Odds(_)
            | ItemKind::Let(_)
            | ItemKind::Fn(_)
            | ItemKind::Manoeuvre(_)
            | ItemKind::Body(_)
            | ItemKind::Trajectory(_)
            | ItemKind::Group(_)
            | ItemKind::Require(_)
    )
}

/// A road with the digest of its map in place of the map's path.
fn with_map_digest(
    road: &ast::Block,
    file: &LoadedFile,
    map_digest: &mut dyn FnMut(&Path) -> Option<String>,
) -> Option<ast::Block> {
    let mut road = road.clone();
    for field in road.fields.iter_mut().filter(|field| field.name.text == "map") {
        if let ExprKind::Text(path) = &mut field.value.kind {
            *path = map_digest(&path_from(file, path))?;
        }
    }
    Some(road)
}

/// Appends the indices of a file and of those that it uses, imports before the files that use them.
fn imports_first<'a>(
    files: &'a [LoadedFile],
    path: &Path,
    seen: &mut BTreeSet<&'a Path>,
    order: &mut Vec<usize>,
) -> Option<()> {
    let index = files.iter().position(|file| file.path == path)?;
    if seen.insert(&files[index].path) {
        for used in used_paths(&files[index]) {
            imports_first(files, &used, seen, order)?;
        }
        order.push(index);
    }
    Some(())
}
