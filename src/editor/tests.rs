//! Questions to documents that are never finished, without a protocol and without files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_lang::check::ReadError;

use super::{Files, Workspace, complete, hover, navigate, rename};

/// The texts of files that are not open.
struct Closed(BTreeMap<PathBuf, &'static str>);

impl Files for Closed {
    fn read(&self, path: &Path) -> Result<String, ReadError> {
        let text = self.0.get(path).ok_or_else(|| ReadError("no such file".to_owned()));
        text.map(|text| (*text).to_owned())
    }

    fn below(&self, folder: &Path) -> Vec<PathBuf> {
        self.0.keys().filter(|path| path.starts_with(folder)).cloned().collect()
    }

    fn nearby(&self, _: &Path) -> Vec<(String, String)> {
        Vec::new()
    }

    fn entries(&self, folder: &Path) -> Vec<(String, bool)> {
        let names = self.below(folder).into_iter();
        names.map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), false)).collect()
    }
}

/// A document `/a/here.ava` with this text up to the mark `¦` and behind it, beside other files, and the byte of the
/// mark.
fn marked(text: &str, closed: &[(&str, &'static str)]) -> (Workspace, PathBuf, usize) {
    let files = closed.iter().map(|(path, text)| (PathBuf::from(path), *text)).collect();
    let mut workspace = Workspace::new(Closed(files));
    workspace.folders.push(PathBuf::from("/a"));
    let path = PathBuf::from("/a/here.ava");
    let byte = text.find('¦').expect("a place is marked");
    workspace.open(path.clone(), text.replace('¦', ""));
    (workspace, path, byte)
}

/// The labels that are proposed at the mark.
fn proposed(text: &str) -> Vec<String> {
    let (mut workspace, path, byte) = marked(text, &[("/a/base.ava", "language 1\n")]);
    workspace.analysis(&path).expect("it is open");
    let analysis = workspace.known(&path).expect("it is analysed");
    let found = complete::complete(&workspace, analysis, byte);
    found.list.into_iter().map(|proposal| proposal.label).collect()
}

#[test]
fn a_broken_document_answers() {
    let text = "language 1\nenum Side = Left | Right\ngroup g = = =\nfn f(s: Side) -> Side = Le¦ft\n";
    let (mut workspace, path, byte) = marked(text, &[]);
    let found = hover::hover(workspace.analysis(&path).unwrap(), byte).expect("it is a name");
    assert!(found.text.contains("variant 1 of 2"), "{}", found.text);
    assert_eq!((found.range.start.line, found.range.end.column), (3, 28));
}

#[test]
fn proposals_come_from_the_place() {
    assert_eq!(proposed("language 1\nuse \"¦"), ["base.ava"]);
    assert_eq!(proposed("language 1\naction a(¦"), ["each", "any"]);
    assert!(proposed("language 1\nlet far = 5 m // ¦").is_empty());
}

#[test]
fn closed_files_have_a_part_in_it() {
    let base = ("/a/base.ava", "language 1\nlet far = 9 m\n");
    let (mut workspace, path, byte) = marked("language 1\nuse \"base.ava\"\nlet twice = f¦ar * 2\n", &[base]);
    let found = navigate::definition(workspace.analysis(&path).unwrap(), byte).expect("it is a name");
    assert_eq!(found[0].path, Path::new(base.0));
    let found = navigate::references(&mut workspace, &path, byte, true);
    assert_eq!(found.len(), 2, "{found:?}");
    let found = rename::rename(&mut workspace, &path, byte, "away").expect("it can be renamed");
    assert_eq!(found.into_keys().collect::<Vec<_>>(), [PathBuf::from(base.0), path]);
}
