//! Which files of a crate use each other in a circle, however they name each other (`crate::`, `super::`, re-exports).
//!
//! A file uses another one if it names an item of it outside tests. A re-export alone (`pub use`) is no use.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, UseTree, Visibility};

use crate::cases::root;

/// A circle of more files than this is a knot.
const FILES_MAX: usize = 6;
/// How many circles there are. They may only become fewer.
const CIRCLES: usize = 29;

/// The name of a module within its crate: `["sim", "world"]`.
type Module = Vec<String>;

/// What the text of a crate says of its modules.
#[derive(Default)]
struct Sources {
    /// The file of each module; of one within a file, that file.
    files: BTreeMap<Module, PathBuf>,
    /// What a module calls an item of another one: the paths of its `use`, by the name that they give.
    names: BTreeMap<Module, BTreeMap<String, Module>>,
    /// The modules whose whole content a module takes over (`pub use x::*`).
    globs: BTreeMap<Module, Vec<Module>>,
    /// Paths that each module names.
    used: Vec<(Module, Module)>,
}

impl Sources {
    fn of(name: &str) -> Sources {
        let folder = root().join("src").join(name);
        let mut sources = Sources::default();
        sources.read(&folder.join("lib.rs"), Vec::new(), &folder);
        sources
    }

    /// Reads the file of a module; `folder` has the files of those that it declares.
    fn read(&mut self, file: &Path, module: Module, folder: &Path) {
        let text = std::fs::read_to_string(file).expect("a source file is readable");
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.items(&parsed.items, module, file, folder);
    }

    fn items(&mut self, items: &[Item], module: Module, file: &Path, folder: &Path) {
        self.files.insert(module.clone(), file.to_owned());
        for item in items {
            match item {
                Item::Mod(inner) if !is_test(&inner.attrs) => self.module(inner, &module, file, folder),
                Item::Mod(_) => {}
                Item::Use(item) if !is_test(&item.attrs) => {
                    let is_private = matches!(item.vis, Visibility::Inherited);
                    self.uses(&item.tree, Vec::new(), &module, is_private);
                }
                item => {
                    let mut paths = Paths { module: &module, found: Vec::new() };
                    paths.visit_item(item);
                    self.used.extend(paths.found);
                }
            }
        }
    }

    fn module(&mut self, inner: &ItemMod, module: &Module, file: &Path, folder: &Path) {
        let name = inner.ident.to_string();
        let path = [&module[..], std::slice::from_ref(&name)].concat();
        match &inner.content {
            Some((_, items)) => self.items(items, path, file, &folder.join(&name)),
            None => {
                let files = [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")];
                let file = files.iter().find(|file| file.is_file()).expect("a module has a file");
                self.read(file, path, &folder.join(&name));
            }
        }
    }

    /// Notes what a tree of a `use` names.
    fn uses(&mut self, tree: &UseTree, before: Module, module: &Module, is_private: bool) {
        let with = |name: String| [&before[..], &[name]].concat();
        let mut note = |path: Module, name: String| {
            if is_private {
                self.used.push((module.clone(), path.clone()));
            }
            self.names.entry(module.clone()).or_default().insert(name, path);
        };
        match tree {
            UseTree::Path(path) => self.uses(&path.tree, with(path.ident.to_string()), module, is_private),
            UseTree::Name(name) if name.ident == "self" => {
                let last = before.last().cloned().unwrap_or_default();
                note(before.clone(), last);
            }
            UseTree::Name(name) => note(with(name.ident.to_string()), name.ident.to_string()),
            UseTree::Rename(name) => note(with(name.ident.to_string()), name.rename.to_string()),
            UseTree::Glob(_) => {
                if is_private {
                    self.used.push((module.clone(), before.clone()));
                }
                self.globs.entry(module.clone()).or_default().push(before);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.uses(tree, before.clone(), module, is_private);
                }
            }
        }
    }

    /// The module that has what a path names, seen from a module; `None` if that is of another crate.
    fn found(&self, path: &[String], from: &Module, depth: usize) -> Option<Module> {
        let (first, rest) = path.split_first()?;
        let begin = match first.as_str() {
            "crate" => Vec::new(),
            "self" => from.clone(),
            "super" => from[..from.len().checked_sub(1)?].to_vec(),
            _ => return self.inside(from, path, depth),
        };
        if rest.first().is_some_and(|next| next == "super") {
            self.found(rest, &begin, depth)
        } else {
            self.inside(&begin, rest, depth).or(Some(begin))
        }
    }

    /// The module that has what a path names within a module; `None` if nothing there has its first name.
    fn inside(&self, module: &Module, path: &[String], depth: usize) -> Option<Module> {
        let Some((first, rest)) = path.split_first() else { return Some(module.clone()) };
        let child = [&module[..], std::slice::from_ref(first)].concat();
        if self.files.contains_key(&child) {
            return self.inside(&child, rest, depth).or(Some(child));
        }
        // A re-export that leads back to itself names an item of the module itself.
        if depth == 0 {
            return None;
        }
        if let Some(target) = self.names.get(module).and_then(|names| names.get(first)) {
            let whole = [&target[..], rest].concat();
            return self.found(&whole, module, depth - 1);
        }
        let globs = self.globs.get(module).into_iter().flatten();
        globs
            .filter_map(|glob| self.found(&[&glob[..], path].concat(), module, depth - 1))
            .find(|found| found != module)
    }

    /// The files that each file uses.
    fn edges(&self) -> BTreeMap<&Path, BTreeSet<&Path>> {
        let mut edges: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
        for (module, path) in &self.used {
            let Some(target) = self.found(path, module, 8) else { continue };
            let (from, to) = (self.files[module].as_path(), self.files[&target].as_path());
            if from != to {
                edges.entry(from).or_default().insert(to);
            }
        }
        edges
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_cfg = attribute.path().is_ident("cfg");
        attribute.path().is_ident("test")
            || is_cfg
                && attribute.meta.require_list().is_ok_and(|list| list.tokens.to_string().contains("test"))
    })
}

/// The paths that an item of a module names, but for those of its tests.
struct Paths<'a> {
    module: &'a Module,
    found: Vec<(Module, Module)>,
}

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.found.push((self.module.clone(), names));
        visit::visit_path(self, path);
    }

    /// `pub(super)` names no item.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let mut inner = Sources::default();
        inner.uses(&item.tree, Vec::new(), self.module, true);
        self.found.extend(inner.used);
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        if !is_test(&item.attrs) {
            visit::visit_item_impl(self, item);
        }
    }
}

/// The sets of files that reach each other (Tarjan would be faster; a crate has some hundred files).
fn circles<'a>(edges: &BTreeMap<&'a Path, BTreeSet<&'a Path>>) -> Vec<Vec<&'a Path>> {
    let reached = |from: &'a Path| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(next) = open.pop() {
            open.extend(edges.get(next).into_iter().flatten().copied().filter(|to| seen.insert(*to)));
        }
        seen
    };
    let all: BTreeMap<&Path, BTreeSet<&Path>> = edges.keys().map(|from| (*from, reached(from))).collect();
    let mut found = BTreeSet::new();
    for (from, reaches) in &all {
        let circle: Vec<&Path> = reaches
            .iter()
            .copied()
            .filter(|to| all.get(to).is_some_and(|back| back.contains(from)))
            .collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

#[test]
fn few_files_use_each_other_in_a_circle() {
    let source = root().join("src");
    let mut found: Vec<Vec<String>> = Vec::new();
    for name in ["base", "lang", "road", "world", "drivers", "search", "campaign", "exchange", "editor"] {
        let sources = Sources::of(name);
        let named = |path: &Path| path.strip_prefix(&source).expect("it is below").display().to_string();
        let circles = circles(&sources.edges()).into_iter();
        found.extend(circles.map(|circle| circle.into_iter().map(named).collect()));
    }
    let told: Vec<String> =
        found.iter().map(|circle| format!("{} files: {}", circle.len(), circle.join(", "))).collect();
    for (circle, told) in found.iter().zip(&told) {
        assert!(circle.len() <= FILES_MAX, "a new knot: {told}");
    }
    assert!(found.len() <= CIRCLES, "{} circles:\n{}", found.len(), told.join("\n"));
}
