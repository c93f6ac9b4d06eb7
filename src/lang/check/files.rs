//! The files that are read, and how they name each other.

use std::path::{Component, Path, PathBuf};

use crate::syntax::ast;
use crate::syntax::ast::Span;

/// Why a file cannot be read, in a few words: `no such file`, `a directory`, `not text`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct ReadError {
    reason: String,
    is_missing: bool,
}

impl ReadError {
    pub fn new(reason: impl Into<String>) -> ReadError {
        ReadError { reason: reason.into(), is_missing: false }
    }

    /// Whether nothing is there.
    pub fn is_missing(&self) -> bool {
        self.is_missing
    }

    /// The error of a path at which nothing is.
    pub fn missing(reason: impl Into<String>) -> ReadError {
        ReadError { reason: reason.into(), is_missing: true }
    }
}

/// Files that avastra has within itself: `use "law.ava"` finds them where no file of that name is.
const BUILT_IN: [(&str, &str); 2] = [
    ("law.ava", include_str!("../shipped/law.ava")),
    ("comfort.ava", include_str!("../shipped/comfort.ava")),
];

/// The text of a file that is built in, by its path as a `use` writes it.
pub fn built_in(written: &str) -> Option<&'static str> {
    BUILT_IN.iter().find(|(name, _)| *name == written).map(|(_, text)| *text)
}

/// Gives the text of a file.
pub type ReadFile<'a> = dyn Fn(&Path) -> Result<String, ReadError> + 'a;

/// One file that was read.
#[derive(Debug, Clone)]
pub struct LoadedFile {
    pub path: PathBuf,
    pub tree: ast::File,
}

pub(super) fn uses(file: &LoadedFile) -> impl Iterator<Item = &ast::Use> {
    file.tree.items.iter().filter_map(|item| item.kind.as_use())
}

/// The paths of the files that a file uses.
pub(super) fn used_paths(file: &LoadedFile) -> impl Iterator<Item = PathBuf> {
    uses(file).map(|used| used_path(file, used))
}

/// The path of the file that a `use` names.
pub(super) fn used_path(file: &LoadedFile, used: &ast::Use) -> PathBuf {
    path_from(file, &used.path.value)
}

/// The path that a file means by a text.
pub(super) fn path_from(file: &LoadedFile, written: &str) -> PathBuf {
    normal(&folder(&file.path).join(written))
}

/// The maps that a file's roads name, as written, and where.
pub(super) fn maps_named(file: &LoadedFile) -> impl Iterator<Item = (&str, Span)> {
    let roads = file.tree.items.iter().filter_map(|item| item.kind.plain().as_road());
    let fields = roads.flat_map(|block| block.fields.iter().filter(|field| field.name.text == "map"));
    fields.filter_map(|field| match &field.value.kind {
        ast::ExprKind::Text(path) => Some((path.as_str(), field.value.span)),
        _ => None,
    })
}

pub(super) fn folder(path: &Path) -> PathBuf {
    path.parent().map(Path::to_owned).unwrap_or_default()
}

/// The path without `.` and, where possible, without `..`, so that a file has one path.
pub fn normal(path: &Path) -> PathBuf {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.iter().collect()
}
