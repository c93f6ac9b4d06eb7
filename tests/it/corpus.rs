//! The corpus of broken files: every code occurs in two of them, every offered change removes its mistake, and
//! every output format of diagnostics is sound.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra::check::explain::PAGES;
use avastra::check::{Loaded, MapCache, ReadError, differences, load, load_with};
use avastra::syntax::ast::FileId;
use avastra::syntax::{Diagnostic, Severity, apply_fixes};

use crate::cases::{case, cases, each_case, files_below, root};
use crate::command::{avastra, done, done_in, outcome};

/// Loads a case, with `text` in place of the file's own text if there is one.
fn loaded(path: &Path, text: Option<&str>) -> Loaded {
    let read = |file: &Path| match text {
        Some(text) if file == path => Ok(text.to_owned()),
        _ => std::fs::read_to_string(file).map_err(|error| ReadError::new(error.to_string())),
    };
    load(path, &read).expect("a case is readable")
}

fn all(loaded: &Loaded) -> impl Iterator<Item = &Diagnostic> {
    loaded.diagnostics.iter().chain(&loaded.remarks)
}

#[test]
fn every_code_is_provoked_and_every_error_twice() {
    let mut files: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut severities: BTreeMap<&str, Severity> = BTreeMap::new();
    let cases = cases("diagnostics");
    assert!(cases.len() >= 120, "{} cases", cases.len());
    for (stem, path) in cases {
        for found in all(&loaded(&path, None)) {
            severities.insert(found.code, found.severity);
            let stems = files.entry(found.code).or_default();
            if !stems.contains(&stem) {
                stems.push(stem.clone());
            }
        }
    }
    let mut missing = Vec::new();
    // What is too long or too much would make long cases: `hostile` has them.
    let of_size = ["AV0013", "AV0113"];
    for page in PAGES.iter().filter(|page| !of_size.contains(&page.code)) {
        let wanted = match severities.get(page.code) {
            Some(Severity::Error) | None => 2,
            Some(Severity::Warning | Severity::Note) => 1,
        };
        let found = files.get(page.code).map_or(0, Vec::len);
        if found < wanted {
            missing.push(format!("{} occurs {found} times, wanted {wanted}", page.code));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// The rules of docs/maintaining.md, as far as a machine can see them.
#[test]
fn every_message_is_worded_for_authors() {
    let mut mistakes = Vec::new();
    for (stem, path) in cases("diagnostics") {
        for found in all(&loaded(&path, None)) {
            let labels = found.labels.iter().map(|label| label.text.as_str());
            let texts = [found.message.as_str()].into_iter().chain(labels).chain(found.help.as_deref());
            for text in texts.chain(found.notes.iter().map(String::as_str)) {
                // What stands in backticks is the author's, or to be written.
                let own: String = text.split('`').step_by(2).collect::<Vec<_>>().join("…");
                let is_long = |number: &str| number.split('.').nth(1).is_some_and(|digits| digits.len() > 6);
                let mut numbers = own.split(|c: char| !c.is_ascii_digit() && c != '.');
                let why = match () {
                    () if own.starts_with(char::is_uppercase) && !is_not_ours(&own) => "begins upper case",
                    () if own.ends_with('.') => "ends with a full stop",
                    () if ["::", "Some(", "Ok(", "Err(", "pest", "serde"]
                        .iter()
                        .any(|word| own.contains(word)) =>
                    {
                        "names Rust or a library"
                    }
                    () if numbers.any(is_long) => "has a number that no author wrote",
                    () => continue,
                };
                mistakes.push(format!("{stem}: {why}: {text}"));
            }
        }
    }
    assert!(mistakes.is_empty(), "{}", mistakes.join("\n"));
}

/// Whether the words are not ours: a code point, or what the system says.
fn is_not_ours(text: &str) -> bool {
    text.starts_with("U+") || text.contains("(os error ")
}

/// A case that is renamed or gone takes its expectation with it.
#[test]
fn every_expectation_of_a_case_has_its_case() {
    for area in ["diagnostics", "format", "imports", "missing_use", "wishes"] {
        let folder = root().join("snapshots").join(area);
        let name = |path: &PathBuf| {
            path.with_extension("").strip_prefix(&folder).expect("it is there").display().to_string()
        };
        let cases: BTreeSet<String> = cases(area).into_iter().map(|(name, _)| name).collect();
        let kept: BTreeSet<String> = files_below(&folder, "snap").iter().map(name).collect();
        assert_eq!(kept, cases, "snapshots/{area} beside tests/cases/{area}");
    }
}

/// If a file nearby declares an unknown name, the diagnostic says which `use` is missing.
#[test]
fn a_missing_use_is_named() {
    each_case("missing_use", |path| {
        let path = path.strip_prefix(root()).expect("it is a case").display().to_string();
        outcome(&mut avastra(&["check", "--format", "plain", &path])).2
    });
}

/// Each change that a diagnostic offers, made alone, removes the diagnostic.
#[test]
fn every_offered_change_is_a_cure() {
    let mut tried = 0;
    for (stem, path) in cases("diagnostics") {
        let before = loaded(&path, None);
        for found in all(&before) {
            for fix in &found.fixes {
                if fix.span.file != FileId(0) {
                    continue;
                }
                let alone = Diagnostic { fixes: vec![fix.clone()], ..found.clone() };
                let (text, made) =
                    apply_fixes(FileId(0), before.sources.text(FileId(0)), std::slice::from_ref(&alone));
                assert_eq!(made, 1, "{stem}: {}", fix.title);
                let after = loaded(&path, Some(&text));
                let same = |other: &&Diagnostic| other.code == found.code && other.message == found.message;
                let count = |loaded: &Loaded| all(loaded).filter(same).count();
                assert!(
                    count(&after) < count(&before),
                    "{stem}: `{}` does not cure {}",
                    fix.title,
                    found.code
                );
                tried += 1;
            }
        }
    }
    assert!(tried >= 20, "{tried} changes are offered");
}

#[test]
fn only_commands_with_diagnostics_print_sarif() {
    let (status, stdout, stderr) = outcome(&mut avastra(&["explain", "A101", "--format", "sarif"]));
    assert!(status == 1 && stdout.is_empty() && stderr.contains("`check` and `compile`"), "{stdout}{stderr}");
}

/// The parts of SARIF 2.1.0 that its schema requires of a log, a run, a result and a fix.
#[test]
fn sarif_has_the_structure_of_the_standard() {
    for stem in ["misspelt_name", "scenario_breaks_the_clock", "pretty_comparison", "cut_and_unfair"] {
        let path = case("diagnostics", stem);
        let (_, stdout, stderr) = outcome(&mut avastra(&["check", "--format", "sarif", &path]));
        let log: serde_json::Value = serde_json::from_str(&stdout).expect("the log is JSON");
        assert_eq!(log["version"], "2.1.0", "{stderr}");
        let run = &log["runs"][0];
        let driver = &run["tool"]["driver"];
        assert_eq!((&driver["name"], &run["columnKind"]), (&"avastra".into(), &"unicodeCodePoints".into()));
        let rules = driver["rules"].as_array().expect("rules");
        let results = run["results"].as_array().expect("results");
        assert!(!results.is_empty(), "{stem}");
        for result in results {
            let index = result["ruleIndex"].as_u64().expect("an index") as usize;
            assert_eq!(rules[index]["id"], result["ruleId"]);
            assert!(rules[index]["shortDescription"]["text"].is_string());
            assert!(["error", "warning", "note"].contains(&result["level"].as_str().expect("a level")));
            assert!(result["message"]["text"].is_string());
            let related = result["relatedLocations"].as_array().into_iter().flatten();
            for place in result["locations"].as_array().expect("locations").iter().chain(related) {
                let physical = &place["physicalLocation"];
                assert!(physical["artifactLocation"]["uri"].is_string());
                assert!(physical["region"]["startLine"].as_u64() >= Some(1));
                assert!(physical["region"]["startColumn"].as_u64() >= Some(1));
            }
            for fix in result["fixes"].as_array().into_iter().flatten() {
                let change = &fix["artifactChanges"][0];
                assert!(change["artifactLocation"]["uri"].is_string());
                assert!(change["replacements"][0]["deletedRegion"]["startLine"].is_u64());
                assert!(change["replacements"][0]["insertedContent"]["text"].is_string());
            }
        }
    }
}

#[test]
fn records_name_their_schema_and_their_changes() {
    let path = &case("diagnostics", "misspelt_name");
    let (_, _, stderr) = outcome(&mut avastra(&["check", "--format", "json", path]));
    let first: serde_json::Value =
        serde_json::from_str(stderr.lines().next().expect("a line")).expect("JSON");
    assert_eq!(first["schema"], 1);
    assert_eq!(first["fixes"][0]["edits"][0]["text"], "time");
}

#[test]
fn fixes_are_made_when_asked_for() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = scratch.path().join("a.ava");
    std::fs::write(&path, "let far = 12 metre # far\n/* near */\nlet near = 3 m\n").expect("it is writable");
    let name = path.display().to_string();
    let (status, stdout, _) = outcome(&mut avastra(&["check", "--fix", &name]));
    assert_eq!(status, 2, "{stdout}");
    let (_, _, stderr) = outcome(&mut avastra(&["check", "--fix", &name]));
    let text = std::fs::read_to_string(&path).expect("it is readable");
    assert!(text.contains("// near"), "{text}{stderr}");
}

/// A new space is sound, formatted, and runs.
#[test]
fn a_new_space_is_ready_to_use() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let in_scratch = |arguments: &[&str]| done_in(scratch.path(), arguments);
    in_scratch(&["new", "mine"]);
    in_scratch(&["check", "--strict", "mine/space.ava"]);
    in_scratch(&["fmt", "--check", "mine/space.ava", "mine/roads.ava"]);
    in_scratch(&["run", "mine/space.ava", "--episodes", "1", "--quiet"]);
    let page = in_scratch(&["table", "mine/space.ava", "--markdown"]);
    for words in
        ["# space", "### `pedestrian` (rows 4 to 5)", "The clock only moves forward.", "| `time` from | to |"]
    {
        assert!(page.contains(words), "`{words}` in\n{page}");
    }
    let (status, _, stderr) = outcome(avastra(&["new", "mine"]).current_dir(scratch.path()));
    assert_eq!(status, 1);
    assert!(stderr.contains("exists"), "{stderr}");
}

#[test]
fn codes_and_shells_are_explained() {
    let stdout = done(&["explain", "av0401"]);
    assert!(stdout.starts_with("# AV0401: ") && stdout.contains("## Right"), "{stdout}");
    let (_, stdout, _) = outcome(&mut avastra(&["explain"]));
    assert_eq!(stdout.lines().count(), PAGES.len() + 1, "a line for each code, and one for `json`");
    let (status, _, stderr) = outcome(&mut avastra(&["explain", "AV9999"]));
    assert_eq!(status, 1, "{stderr}");
    for shell in ["bash", "zsh", "fish"] {
        let (status, stdout, _) = outcome(&mut avastra(&["completions", shell]));
        assert!(status == 0 && stdout.contains("explain"), "{shell}");
    }
}

/// `diff` shows what an override changes.
#[test]
fn differences_are_told_by_their_meaning() {
    let space = "scenarios/avastra45.ava";
    let (status, stdout, stderr) = outcome(&mut avastra(&["diff", space, space]));
    assert_eq!((status, stdout.as_str()), (0, "the two spaces mean the same\n"), "{stderr}");
    let own = root().join("tests/cases/spaces/own_gap.ava");
    let stdout = done(&["diff", space, &own.display().to_string()]);
    for line in [
        "changed fn `lead`: ",
        "tightened rule `walking_pace`: ",
        "loosened rule `chronology`: Morning -> Night",
        "added row `lightning()`: it is 45",
    ] {
        assert!(stdout.contains(line), "`{line}` in\n{stdout}");
    }
}

/// Whatever is edited in a space, the digests differ if and only if `diff` tells a difference.
#[test]
fn digests_differ_if_and_only_if_a_difference_is_told() {
    let shipped = ["scenarios/avastra45.ava", "scenarios/examples/night_and_fog.ava"];
    let shipped = shipped.map(|name| root().join(name));
    let own = cases("spaces").into_iter().map(|(_, path)| path);
    let (mut alike, mut different) = (0, 0);
    let mut maps = MapCache::default();
    for path in shipped.into_iter().chain(own) {
        let text = std::fs::read_to_string(&path).expect("it is readable");
        let mut loaded = |edited: &str| {
            let read = |file: &Path| match file == path {
                true => Ok(edited.to_owned()),
                false => std::fs::read_to_string(file).map_err(|error| ReadError::new(error.to_string())),
            };
            load_with(&path, &read, &mut maps).expect("it is readable")
        };
        let digest = |loaded: &Loaded| loaded.space.as_ref().map(|space| space.meaning.digest().to_owned());
        let old = loaded(&text);
        for edited in edits(&text).into_iter().step_by(7) {
            let new = loaded(&edited);
            let Some(found) = differences(&old, &new) else { continue };
            let is_same = digest(&old) == digest(&new);
            assert_eq!(is_same, found.is_empty(), "{found:?} in {}:\n{edited}", path.display());
            match is_same {
                true => alike += 1,
                false => different += 1,
            }
        }
    }
    assert!(alike >= 10 && different >= 10, "{alike} edits mean the same, {different} do not");
}

/// A text with one line left out, written twice, in the place of the next one, or with another number, each in turn.
fn edits(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let mut edited = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let mut with = |replaced: &[&str], end: usize| {
            edited.push([&lines[..at], replaced, &lines[end..]].concat().join("\n"));
        };
        with(&[], at + 1);
        with(&[*line, *line], at + 1);
        if let Some(next) = lines.get(at + 1) {
            with(&[*next, *line], at + 2);
        }
        if let Some(digit) = line.rfind(|letter: char| letter.is_ascii_digit()) {
            let other = if line[digit..].starts_with('3') { "4" } else { "3" };
            let changed = format!("{}{other}{}", &line[..digit], &line[digit + 1..]);
            with(&[changed.as_str()], at + 1);
        }
    }
    edited
}

#[test]
fn every_prefix_of_a_space_is_checked_to_its_end() {
    let text = std::fs::read_to_string(root().join("scenarios/avastra45.ava")).expect("it is readable");
    let path = root().join("scenarios/avastra45.ava");
    for (end, _) in text.char_indices().step_by(61) {
        loaded(&path, Some(&text[..end]));
    }
}
