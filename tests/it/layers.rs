//! What the text of the sources shows: each module of a crate uses only those to its left (between crates the compiler keeps
//! that), one file alone names parry2d, `cli` alone touches files and the environment, and `campaign/files` alone writes.

use std::path::{Path, PathBuf};

use crate::cases::root;

/// The crates with several modules. Their `lib.rs` declares these from left to right.
const CRATES: [&str; 6] = ["base", "lang", "world", "search", "campaign", "exchange"];

/// The modules that the `lib.rs` of a crate declares, in order.
fn modules(name: &str) -> Vec<String> {
    let path = root().join("src").join(name).join("lib.rs");
    let text = std::fs::read_to_string(path).expect("a lib.rs is readable");
    text.lines()
        .filter_map(|line| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned()))
        .collect()
}

#[test]
fn modules_use_only_what_stands_to_their_left() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let (order, folder) = (modules(name), root().join("src").join(name));
        assert!(order.len() > 1, "{name} declares {order:?}");
        for path in sources(&folder) {
            let inside = path.strip_prefix(&folder).expect("it was found there");
            let module = inside.iter().next().and_then(|part| part.to_str()).unwrap_or_default();
            let Some(rank) = order.iter().position(|one| one == module.trim_end_matches(".rs")) else {
                continue;
            };
            let text = std::fs::read_to_string(&path).expect("a source file is readable");
            for (number, line) in text.lines().enumerate() {
                for used in line.split("crate::").skip(1) {
                    let used: String =
                        used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    // With `crate::{…}` this test would not see the modules that are used.
                    if order.iter().position(|one| *one == used).is_none_or(|other| other > rank) {
                        wrong.push(format!("{}:{}: {}", path.display(), number + 1, line.trim()));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "uses against the order of the modules:\n{}", wrong.join("\n"));
}

#[test]
fn one_file_alone_names_parry() {
    let naming: Vec<PathBuf> = sources(&root().join("src"))
        .into_iter()
        .filter(|path| std::fs::read_to_string(path).is_ok_and(|text| text.contains("parry2d::")))
        .collect();
    assert_eq!(naming, [root().join("src/base/geometry/contact.rs")]);
}

#[test]
fn cli_alone_touches_files_and_the_environment() {
    let outside = |path: &PathBuf| !path.starts_with(root().join("src/cli"));
    for path in sources(&root().join("src")).into_iter().filter(outside) {
        let text = std::fs::read_to_string(&path).expect("a source file is readable");
        // Tests at the end of a file may read what the repository ships.
        let text = without_tests(&text);
        // An example in a document stands for a program that uses the library.
        let text: String = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let is_test = path.components().any(|part| part.as_os_str().to_string_lossy().contains("test"));
        // Time limits of an external driving system are by the wall clock; in one place.
        let may_wait =
            path.ends_with("drivers/external/link.rs") && text.matches("Instant::now").count() == 1;
        // `cli` and databases write through this file.
        let may_write = path.ends_with("src/campaign/files.rs");
        for word in ["std::fs", "std::env::var", "Instant::now", "SystemTime"] {
            let may = (may_wait && word == "Instant::now") || (may_write && word == "std::fs");
            assert!(is_test || may || !text.contains(word), "{} names {word}", path.display());
        }
    }
}

/// Calls that make, replace, rename or remove files and folders.
const WRITING: [&str; 13] = [
    "File::create",
    "File::options",
    "OpenOptions",
    "fs::write",
    "fs::remove_",
    "fs::rename",
    "fs::copy",
    "fs::create_dir",
    "fs::hard_link",
    "fs::set_permissions",
    "fs::symlink(",
    "DirBuilder",
    "Connection::open(",
];

/// SQLite writes by itself. These files check the path first, or have it from `files`.
const WRITING_DATABASES: [&str; 2] = ["src/campaign/run/sealed.rs", "src/campaign/run/settled.rs"];

#[test]
fn files_alone_writes_and_removes() {
    let is_test = |path: &Path| {
        let name = path.strip_prefix(root()).expect("it is below").to_string_lossy().into_owned();
        name.contains("/tests") || name.ends_with("testing.rs")
    };
    for path in sources(&root().join("src")) {
        if path == root().join("src/campaign/files.rs") || is_test(&path) {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a source file is readable");
        let text = without_tests(&text);
        let is_database = WRITING_DATABASES.iter().any(|name| path.ends_with(name));
        for (number, line) in
            text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"))
        {
            for word in WRITING.iter().filter(|word| line.contains(**word)) {
                let may = is_database && *word == "Connection::open(";
                let place = format!("{}:{}", path.display(), number + 1);
                assert!(may, "{place} names `{word}`: `files` does that, and follows no link");
            }
        }
    }
}

/// A source text up to the tests at its end. A test function elsewhere, or a file of tests that is named, ends nothing.
fn without_tests(text: &str) -> &str {
    let mark = "#[cfg(test)]\nmod ";
    let at = text.match_indices(mark).find(|(at, _)| {
        let line = text[at + mark.len()..].lines().next();
        line.is_some_and(|line| line.ends_with('{'))
    });
    at.map_or(text, |(at, _)| &text[..at])
}

/// Every Rust file below a directory, sorted.
fn sources(directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(directory).expect("a source directory is readable").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}
