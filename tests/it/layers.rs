//! What the text of the sources shows: each module of a crate uses only those to its left (between crates the compiler keeps
//! that), one file alone names parry2d, `cli` alone touches files and the environment, `campaign/files` alone writes, `cli/load`
//! alone reads, one function opens databases, and what is from outside is written by the function of its place.

use std::path::{Path, PathBuf};

use crate::cases::root;

/// The crates with several modules. Their `lib.rs` declares these from left to right.
const CRATES: [&str; 6] = ["base", "lang", "world", "search", "campaign", "exchange"];

/// The modules that the `lib.rs` of a crate declares, in order.
fn modules(name: &str) -> Vec<String> {
    let path = root().join("src").join(name).join("lib.rs");
    let text = std::fs::read_to_string(path).expect("a lib.rs is readable");
    text.lines()
        .filter_map(|line| {
            let name = line.strip_prefix("pub ").unwrap_or(line).strip_prefix("mod ")?;
            Some(name.strip_suffix(';')?.to_owned())
        })
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
            if inside.file_stem().is_some_and(|stem| stem == "tests") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a source file is readable");
            // A test may make its world with what stands farther to the right.
            for (number, line) in without_tests(&text).lines().enumerate() {
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
const WRITING: [&str; 12] = [
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
];

/// Refuses words in the source, but for comments, tests and the files where each may stand.
fn stands_nowhere_else(words: &[&str], may: &dyn Fn(&Path, &str) -> bool, instead: &str) {
    let mut wrong = Vec::new();
    for path in sources(&root().join("src")) {
        let inside = path.strip_prefix(root()).expect("it is below");
        let name = inside.to_string_lossy();
        if name.contains("/tests") || name.ends_with("testing.rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a source file is readable");
        let lines = without_tests(&text).lines().enumerate();
        for (number, line) in lines.filter(|(_, line)| !line.trim_start().starts_with("//")) {
            let found = words.iter().filter(|word| line.contains(**word) && !may(inside, word));
            wrong.extend(found.map(|word| format!("{name}:{} names `{word}`", number + 1)));
        }
    }
    assert!(wrong.is_empty(), "{instead}:\n{}", wrong.join("\n"));
}

#[test]
fn files_alone_writes_and_removes() {
    let may = |path: &Path, _: &str| path == Path::new("src/campaign/files.rs");
    stands_nowhere_else(&WRITING, &may, "`files` does that, and follows no link");
}

#[test]
fn load_alone_reads() {
    let reading = ["fs::read(", "read_to_string(", "File::open", "read_to_end(", "io::stdin", " stdin()"];
    let may = |path: &Path, word: &str| match path.to_str() {
        Some("src/cli/load.rs" | "src/campaign/files.rs") => true,
        // These speak a protocol over standard input, whose messages have a limit.
        Some("src/cli/lsp.rs" | "src/cli/ads/toy.rs") => word.contains("stdin"),
        Some("src/cli/lsp/transport.rs") => word == "read_to_end(",
        _ => false,
    };
    stands_nowhere_else(&reading, &may, "`load` reads, which refuses pipes, devices and what is too large");
}

#[test]
fn one_function_opens_databases() {
    let may = |path: &Path, word: &str| match path.to_str() {
        Some("src/campaign/run/sealed.rs") => word != "ATTACH",
        Some("src/campaign/run/settled.rs") => word == "ATTACH",
        _ => false,
    };
    let opening = ["Connection::open", "ATTACH", "SQLITE_OPEN_URI", "OpenFlags::default"];
    stands_nowhere_else(&opening, &may, "`sealed::open_file` and `path_of` look at the path first");
    let text = std::fs::read_to_string(root().join("src/campaign/run/sealed.rs")).expect("it is readable");
    let text = without_tests(&text);
    for (word, times) in
        [("Connection::open_with_flags(", 1), ("Connection::open_in_memory(", 1), ("Connection::open(", 0)]
    {
        assert_eq!(text.matches(word).count(), times, "{word}");
    }
}

/// A crafted journal made versions of SQLite before this remove files that it names.
#[test]
fn the_bundled_sqlite_removes_no_file_that_a_journal_names() {
    assert!(rusqlite::version_number() >= 3_054_000, "{}", rusqlite::version());
}

#[test]
fn what_is_from_outside_is_written_by_the_function_of_its_place() {
    let may = |path: &Path, word: &str| match path.to_str() {
        Some("src/cli/output.rs") => word.starts_with("io::"),
        // They speak a protocol.
        Some("src/cli/lsp.rs" | "src/cli/ads/toy.rs") => word.starts_with("io::"),
        Some("src/lang/syntax/parse.rs" | "src/campaign/emit/tree.rs") => word == " Doc { text",
        // In Markdown a tag is the one thing that is escaped.
        Some("src/base/outside.rs" | "src/cli/doc.rs") => word == "&lt;",
        _ => false,
    };
    let words = [".display()", "println!", "print!(", "io::stdout", "io::stderr", " Doc { text", "&lt;"];
    stands_nowhere_else(
        &words,
        &may,
        "`base/outside` has a function for each place, and `cli/output` prints",
    );
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
