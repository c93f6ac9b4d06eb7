//! A missing `use`: names that are declared nowhere in what was read, but in a file nearby.

use std::path::Path;

use crate::check::load::Loaded;
use crate::model::code;
use crate::syntax::ast::{File, FileId, ItemKind, Span};
use crate::syntax::{Diagnostic, parse};

/// Says of every unknown name which of the files nearby declares it, and offers to use that file.
///
/// The files are given with their paths as the root would name them, and their texts.
pub fn suggest_uses(loaded: &mut Loaded, nearby: &[(String, String)]) {
    let trees: Vec<(&str, File)> =
        nearby.iter().map(|(path, text)| (path.as_str(), parse(FileId::default(), text).0)).collect();
    let root = &loaded.files[0];
    let place = insertion(&root.tree);
    for diagnostic in &mut loaded.diagnostics {
        if diagnostic.code != code::UNKNOWN && diagnostic.code != code::UNKNOWN_STATE {
            continue;
        }
        let Some(span) = diagnostic.place().filter(|span| span.file == FileId(0)) else { continue };
        let name = loaded.sources.text(span.file).get(span.start..span.end).unwrap_or_default().to_owned();
        let is_root = |path: &str| root.path.file_name() == Path::new(path).file_name();
        let declaring = trees.iter().find(|(path, tree)| !is_root(path) && declares(tree, &name));
        if let Some((path, _)) = declaring {
            suggest(diagnostic, &name, path, place);
        }
    }
}

fn suggest(diagnostic: &mut Diagnostic, name: &str, path: &str, place: Span) {
    let title = format!("add `use \"{path}\"`");
    // What is spelt exactly so is likelier than what is spelt alike.
    diagnostic.help = Some(format!("`{name}` is declared in `{path}`: {title}"));
    diagnostic.fixes.clear();
    let with_fix = diagnostic.clone().fix(title, place, format!("\nuse \"{path}\""));
    *diagnostic = with_fix;
}

/// Behind the last `use`, or behind `language`.
fn insertion(tree: &File) -> Span {
    let head = tree.items.iter().filter(|item| matches!(item.kind, ItemKind::Language(_) | ItemKind::Use(_)));
    let end = head.map(|item| item.span.end).max().unwrap_or(0);
    Span::new(FileId(0), end, end)
}

fn declares(tree: &File, name: &str) -> bool {
    tree.items.iter().any(|item| {
        let variants = item.kind.as_enum().map_or(&[][..], |declared| &declared.variants);
        item.kind.name().into_iter().chain(variants).any(|declared| declared.text == name)
    })
}
