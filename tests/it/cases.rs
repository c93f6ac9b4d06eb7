//! Cases: each file of a directory is rendered, and the result is compared with its snapshot.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZero;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// What is in a folder, sorted.
pub fn entries(folder: impl AsRef<Path>) -> Vec<PathBuf> {
    let folder = folder.as_ref();
    let found = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = found.map(|entry| entry.expect("it is readable").path()).collect();
    paths.sort();
    paths
}

/// The files of a folder with an extension, sorted.
pub fn files(folder: impl AsRef<Path>, extension: &str) -> Vec<PathBuf> {
    let mut paths = entries(folder);
    paths.retain(|path| path.extension().is_some_and(|found| found == extension));
    paths
}

/// The names of the files in a folder, and their texts.
pub fn texts(folder: impl AsRef<Path>) -> BTreeMap<String, String> {
    let text = |path: PathBuf| (name(&path), std::fs::read_to_string(path).expect("it is text"));
    entries(folder).into_iter().map(text).collect()
}

/// The name of a file.
pub fn name(path: &Path) -> String {
    path.file_name().expect("it has a name").to_string_lossy().into_owned()
}

/// The name of a file without its extension.
pub fn stem(path: &Path) -> String {
    path.file_stem().expect("it has a name").to_string_lossy().into_owned()
}

/// Copies the shipped space, with its roads and their maps, into a folder.
pub fn copy_space(folder: &Path) {
    std::fs::create_dir_all(folder.join("roads")).expect("it is writable");
    let roads = ["corner", "residential", "boulevard", "crossroad"].map(|road| format!("roads/{road}.xodr"));
    for name in
        ["avastra45.ava", "roads.ava", "lanes.ava"].into_iter().chain(roads.iter().map(String::as_str))
    {
        std::fs::copy(root().join("scenarios").join(name), folder.join(name)).expect("it is shipped");
    }
}

/// The files below a folder with an extension, sorted.
pub fn files_below(folder: impl AsRef<Path>, extension: &str) -> Vec<PathBuf> {
    let folder = folder.as_ref();
    let inner = entries(folder).into_iter().filter(|path| path.is_dir());
    let mut paths: Vec<PathBuf> = inner.flat_map(|inner| files_below(inner, extension)).collect();
    paths.extend(files(folder, extension));
    paths.sort();
    paths
}

/// Name and path of every case of an area, sorted. The name is the path within the area, without the extension.
pub fn cases(area: &str) -> Vec<(String, PathBuf)> {
    let folder = root().join("tests/cases").join(area);
    let found = match area {
        // What is imported is no file of ours; in its folders stand catalogues.
        "imports" | "imported" => files(&folder, "xosc"),
        // Beside the folders stands what all situations use.
        "verdicts" => {
            entries(&folder).iter().filter(|path| path.is_dir()).flat_map(|path| files(path, "ava")).collect()
        }
        // By subject.
        "diagnostics" => files_below(&folder, "ava"),
        _ => files(&folder, "ava"),
    };
    assert!(!found.is_empty(), "no case in {area}");
    let name = |path: &PathBuf| {
        path.with_extension("").strip_prefix(&folder).expect("it is there").display().to_string()
    };
    found.into_iter().map(|path| (name(&path), path)).collect()
}

/// The path of a case within the repository.
pub fn case(area: &str, wanted: &str) -> String {
    let found = cases(area).into_iter().find(|(_, path)| stem(path) == wanted);
    let (_, path) = found.unwrap_or_else(|| panic!("no case {wanted} in {area}"));
    path.strip_prefix(root()).expect("it is a case").display().to_string()
}

/// Compares a text with `snapshots/<area>/<stem>.snap`. What is not wanted is neither compared nor written anew.
pub fn expect_snapshot(area: &str, stem: &str, text: &str) {
    if !is_wanted(&format!("{area}/{stem}")) {
        return;
    }
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(root().join("snapshots").join(area));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(stem, text));
}

/// Whether a case is to be tried, by `area/name`: all are, or with `AVASTRA_CASE` in the environment those that hold it.
#[expect(clippy::disallowed_methods, reason = "who runs the tests says which cases")]
fn is_wanted(case: &str) -> bool {
    std::env::var("AVASTRA_CASE").map_or(true, |wanted| case.contains(&wanted))
}

/// Whether any case of any area is wanted: with a misspelt `AVASTRA_CASE` none would be tried, and every test would pass.
fn is_any_wanted() -> bool {
    let folders = ["tests/cases", "snapshots"].map(|folder| root().join(folder));
    let [cases, snapshots] = &folders;
    let mut paths = [files_below(cases, "ava"), files_below(cases, "xosc"), files_below(snapshots, "snap")]
        .concat()
        .into_iter();
    paths.any(|path| {
        let path =
            folders.iter().find_map(|folder| path.strip_prefix(folder).ok()).expect("it is in one of them");
        is_wanted(&path.with_extension("").display().to_string())
    })
}

/// Tries every case of an area that is wanted, on all cores. Each that fails says why under its own name, and all are named at
/// the end.
pub fn try_each(area: &str, try_one: impl Fn(&str, &Path) + Sync) {
    assert!(is_any_wanted(), "no case holds what AVASTRA_CASE asks for");
    let all = cases(area).into_iter().filter(|(name, _)| is_wanted(&format!("{area}/{name}")));
    let waiting = Mutex::new(all);
    let next = || waiting.lock().expect("no case is tried while it is held").next();
    let failed = Mutex::new(BTreeSet::new());
    let try_all = || {
        while let Some((stem, path)) = next() {
            if let Err(cause) = std::panic::catch_unwind(AssertUnwindSafe(|| try_one(&stem, &path))) {
                let text = cause.downcast_ref::<String>().map(String::as_str);
                let cause = text.or(cause.downcast_ref::<&str>().copied()).unwrap_or("see above");
                println!("case {area}/{stem} failed: {cause}");
                failed.lock().expect("no case is tried while it is held").insert(stem);
            }
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    std::thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(try_all))));
    let failed: Vec<String> = failed.into_inner().expect("no thread holds it").into_iter().collect();
    assert!(failed.is_empty(), "{} cases of {area} failed: {}", failed.len(), failed.join(", "));
}

/// Renders every case of an area; input and output stand together in the snapshot.
pub fn each_case(area: &str, render: impl Fn(&Path) -> String + Sync) {
    try_each(area, |_, path| {
        let source = std::fs::read(path).expect("a case is readable");
        let source = String::from_utf8_lossy(&source);
        let folder = path.strip_prefix(root().join("tests/cases")).expect("it is a case").parent();
        let folder = folder.expect("a case is in its area").display().to_string();
        expect_snapshot(&folder, &stem(path), &format!("{source}\n----\n{}", render(path)));
    });
}
