//! Cases: each file of a directory is rendered, and the result is compared with its snapshot.

use std::path::{Path, PathBuf};

/// The repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Stem and path of every case of an area, sorted.
pub fn cases(area: &str) -> Vec<(String, PathBuf)> {
    let directory = root().join("tests/cases").join(area);
    let mut found: Vec<(String, PathBuf)> = std::fs::read_dir(&directory)
        .unwrap_or_else(|error| panic!("{}: {error}", directory.display()))
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ava"))
        .map(|path| (path.file_stem().expect("it has a name").to_string_lossy().into_owned(), path))
        .collect();
    found.sort();
    assert!(!found.is_empty(), "no case in {}", directory.display());
    found
}

/// Compares a text with `snapshots/<area>/<stem>.snap`.
pub fn expect_snapshot(area: &str, stem: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(root().join("snapshots").join(area));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(stem, text));
}

/// Renders every case of an area; input and output stand together in the snapshot.
pub fn each_case(area: &str, render: impl Fn(&Path) -> String) {
    for (stem, path) in cases(area) {
        let source = std::fs::read(&path).expect("a case is readable");
        let source = String::from_utf8_lossy(&source);
        expect_snapshot(area, &stem, &format!("{source}\n----\n{}", render(&path)));
    }
}
