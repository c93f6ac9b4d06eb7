//! Suggests a missing `use`: an unknown name may be declared in a file of the same folder.

use std::path::Path;

use crate::check::load::Loaded;
use crate::model::code;
use crate::syntax::ast::{File, FileId, ItemKind, Span};
use crate::syntax::{Fix, parse};

/// Adds to the diagnostic of an unknown name which nearby file declares it, and a fix that uses that file.
///
/// `nearby` holds each file's path, as the root would write it, and its text.
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
        // A name that is declared in what the file uses needs no other `use`: it may not stand here.
        if loaded.files.iter().any(|file| declares(&file.tree, &name)) {
            continue;
        }
        let is_root = |path: &str| root.path.file_name() == Path::new(path).file_name();
        let meant = meant_by(&diagnostic.message);
        let declaring = trees.iter().find(|(path, tree)| !is_root(path) && declares_as(tree, &name, meant));
        if let Some((path, _)) = declaring {
            let title = format!("add `use \"{path}\"`");
            // A declaration with exactly this name is likelier to be meant than a similar name.
            diagnostic.help = Some(format!("`{name}` is declared in `{path}`: {title}"));
            diagnostic.fixes = vec![Fix { title, span: place, text: format!("\nuse \"{path}\"") }];
        }
    }
}

/// The place after the last `use`, or after `language`.
fn insertion(tree: &File) -> Span {
    let head = tree.items.iter().filter(|item| matches!(item.kind, ItemKind::Language(_) | ItemKind::Use(_)));
    let end = head.map(|item| item.span.end).max().unwrap_or(0);
    Span::new(FileId(0), end, end)
}

/// Stands in [`meant_by`] for the variants of an enum, which no keyword declares.
const VARIANT: &str = "variant";

/// The keywords of the declarations that an author can have meant by the unknown name in a message. For example, a name in
/// an expression cannot be an action, and no declaration adds a field to a spawn.
fn meant_by(message: &str) -> &'static [&'static str] {
    let kind = message.strip_prefix("unknown ").and_then(|rest| rest.split_once(" `")).map(|(kind, _)| kind);
    match kind {
        Some("name") => &["let", "state", "body", VARIANT],
        Some("action") => &["action", "group"],
        Some("action, group or rule") => &["action", "group", "rule"],
        Some("state" | "map" | "state or field") => &["state"],
        Some("type" | "enum") => &["enum"],
        Some("variant" | "key") => &[VARIANT],
        Some("function") => &["fn"],
        Some("rule") => &["rule"],
        Some("road") => &["road"],
        Some("body") => &["body"],
        _ => &[],
    }
}

fn declares(tree: &File, name: &str) -> bool {
    tree.items.iter().any(|item| {
        let variants = item.kind.as_enum().map_or(&[][..], |declared| &declared.variants);
        item.kind.name().into_iter().chain(variants).any(|declared| declared.text == name)
    })
}

/// Whether a file declares the name by one of these keywords.
fn declares_as(tree: &File, name: &str, keywords: &[&str]) -> bool {
    tree.items.iter().any(|item| {
        let kind = item.kind.plain();
        let variants = kind.as_enum().map_or(&[][..], |declared| &declared.variants);
        keywords.contains(&kind.keyword()) && kind.name().is_some_and(|declared| declared.text == name)
            || keywords.contains(&VARIANT) && variants.iter().any(|variant| variant.text == name)
    })
}
