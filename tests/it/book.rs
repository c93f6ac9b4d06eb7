//! The book (docs/SUMMARY.md): its examples compile, its commands do what its pages say, its links lead somewhere, and what is
//! generated follows from the program. `INSTA_UPDATE=always` writes the generated parts anew.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

use avastra::check::Loaded;
use avastra::model::vocabulary::{Fact, Word, WordFact};
use avastra::syntax::Diagnostic;

use crate::cases::{files_below, root};
use crate::command::{done, outcome};
use crate::world::loaded;

/// Pages beside the book whose links are checked, too.
const BESIDE: [&str; 11] = [
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "README.md",
    "RESULTS.md",
    "editors/vscode/README.md",
    "llms.txt",
    "policies/README.md",
    "python/README.md",
    "python/adapters/README.md",
    "scenarios/catalogue/README.md",
    "tests/README.md",
];

/// A fenced block: what stands behind the fence, what is inside, and its line.
struct Block<'a> {
    info: &'a str,
    text: String,
    line: usize,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut found = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else { continue };
        let inside: Vec<&str> =
            lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```").collect();
        found.push(Block { info, text: inside.join("\n") + "\n", line: number + 1 });
    }
    found
}

/// The pages of the book by their paths in the repository, in the order of its summary.
fn pages() -> Vec<String> {
    let summary = read("docs/SUMMARY.md");
    let links = links(&summary).into_iter().map(|(_, target)| format!("docs/{target}"));
    links.collect()
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The links of a page: line and target.
fn links(page: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut is_code = false;
    for (number, line) in (1..).zip(page.lines()) {
        is_code ^= line.starts_with("```");
        if is_code {
            continue;
        }
        let plain: String =
            line.split('`').enumerate().filter(|(nth, _)| nth % 2 == 0).map(|(_, part)| part).collect();
        for part in plain.split("](").skip(1) {
            found.push((number, part.split(')').next().unwrap_or_default().to_owned()));
        }
    }
    found
}

/// The anchors of a page, as GitHub and mdBook make them of its headings.
fn anchors(page: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut found = BTreeSet::new();
    for line in page.lines() {
        is_code ^= line.starts_with("```");
        if is_code || !line.starts_with('#') {
            continue;
        }
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        found.insert(kept.map(|c| if c == ' ' { '-' } else { c }).collect());
    }
    found
}

#[test]
fn each_page_is_in_the_summary_and_each_link_leads_somewhere() {
    let pages = pages();
    let known: BTreeSet<PathBuf> = pages.iter().map(|page| root().join(page)).collect();
    let there = files_below(root().join("docs"), "md");
    let lost = there.iter().filter(|file| !known.contains(*file) && !file.ends_with("SUMMARY.md"));
    let mut wrong: Vec<String> = lost.map(|file| format!("{}: not in the summary", file.display())).collect();
    for page in pages.iter().map(String::as_str).chain(BESIDE) {
        let text = read(page);
        for (line, target) in links(&text) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let folder = root().join(page).parent().expect("it lies in a folder").to_owned();
            let file = if path.is_empty() { root().join(page) } else { folder.join(path) };
            if !file.exists() {
                wrong.push(format!("{page}:{line}: nothing is at `{target}`"));
            } else if !anchor.is_empty() && path.ends_with(".md") {
                let other = std::fs::read_to_string(&file).expect("it is a text");
                if !anchors(&other).contains(anchor) {
                    wrong.push(format!("{page}:{line}: no heading for `{target}`"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Compiles an example as if it stood beside the shipped files.
fn compiled(example: &str) -> Loaded {
    let text = match example.starts_with("language") || example.starts_with("//!") {
        true => example.to_owned(),
        false => format!("language 1\nuse \"avastra45.ava\"\n{example}"),
    };
    loaded("scenarios/example.ava", &text)
}

/// ```` ```ava ```` compiles; ```` ```ava error=AV0201 ```` has this mistake and no other.
#[test]
fn every_example_says_what_its_page_says_of_it() {
    let (mut examples, mut wrong) = (0, Vec::new());
    for page in pages() {
        let text = read(&page);
        for Block { info, text, line } in blocks(&text) {
            let Some(info) = info.strip_prefix("ava").filter(|info| !info.contains('>')) else { continue };
            let loaded = compiled(&text);
            let errors = loaded.diagnostics.iter().filter(|found| found.is_error());
            let codes: Vec<&str> = errors.map(|found| found.code).collect();
            let wanted: Vec<&str> = info.trim().strip_prefix("error=").into_iter().collect();
            examples += 1;
            if codes != wanted {
                let messages: Vec<&Diagnostic> = loaded.diagnostics.iter().collect();
                wrong.push(format!("{page}:{line}: {messages:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(examples >= 60, "{examples} examples");
}

/// Runs a line of a page and gives what it prints; the line may say with which exit status it ends.
fn run(line: &str, folder: &Path) -> Result<String, String> {
    let (command, wanted) = line.split_once(" # exit status ").unwrap_or((line, "0"));
    let mut shell = Command::new("sh");
    let binary = assert_cmd::cargo::cargo_bin("avastra");
    let binaries = binary.parent().expect("it lies in a folder").display().to_string();
    let found = format!("PATH=\"$AVASTRA:$PATH\"; {command}");
    shell.current_dir(folder).env("AVASTRA", binaries).args(["-c", &found]);
    let (status, stdout, stderr) = outcome(&mut shell);
    match status.to_string() == wanted {
        true => Ok(stdout),
        false => Err(format!("{line}: status {status}\n{stdout}\n{stderr}")),
    }
}

/// Runs a page's commands in a folder of their own, in which some folders of the repository can be seen:
///
/// - ```` ```sh ```` is run line by line
/// - ```` ```text ```` after it has lines that it printed; one that ends in `…` is the beginning of one
/// - a block with `> FILE` or `>> FILE` is written to that file
/// - ```` ```sh,untested ```` needs more than the machine of a test
///
/// A page that runs Python is passed over on a machine without it.
fn tried(page: &str) -> Vec<String> {
    if read(page).contains("python3")
        && std::process::Command::new("python3").arg("--version").output().is_err()
    {
        return Vec::new();
    }
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for shared in ["examples", "policies", "python", "scenarios"] {
        symlink(root().join(shared), scratch.path().join(shared)).expect("links can be made");
    }
    let mut wrong = Vec::new();
    let mut printed = String::new();
    let text = read(page);
    for Block { info, text, line } in blocks(&text) {
        let written = info.split_once(" >> ").map(|(_, file)| (file, true));
        match written.or_else(|| info.split_once(" > ").map(|(_, file)| (file, false))) {
            Some((file, is_more)) => {
                let path = scratch.path().join(file);
                let before = is_more.then(|| std::fs::read_to_string(&path).expect("it is there"));
                std::fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("it can be made");
                std::fs::write(path, before.unwrap_or_default() + &text).expect("it is writable");
            }
            None if info == "sh" => {
                printed.clear();
                for command in text.lines() {
                    match run(command, scratch.path()) {
                        Ok(stdout) => printed += &stdout,
                        Err(failed) => wrong.push(format!("{page}:{line}: {failed}")),
                    }
                }
            }
            None if info == "text" => {
                let is_printed = |line: &&str| match line.strip_suffix('…') {
                    Some(begin) => printed.lines().any(|one| one.starts_with(begin)),
                    None => printed.lines().any(|one| one == *line),
                };
                let missing: Vec<&str> = text.lines().filter(|line| !is_printed(line)).collect();
                if !missing.is_empty() {
                    wrong.push(format!("{page}:{line}: {missing:#?} is not in\n{printed}"));
                }
            }
            None => {}
        }
    }
    wrong
}

fn all_tried(is_of: impl Fn(&str) -> bool) {
    let pages: Vec<String> = pages().into_iter().filter(|page| is_of(page)).collect();
    assert!(!pages.is_empty());
    let wrong: Vec<String> = pages.iter().flat_map(|page| tried(page)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_commands_of_the_tour_do_what_it_says() {
    all_tried(|page| page == "docs/tour.md");
}

#[test]
fn the_commands_of_the_guides_do_what_they_say() {
    all_tried(|page| page.starts_with("docs/guides/"));
}

#[test]
fn the_commands_of_all_other_pages_do_what_they_say() {
    all_tried(|page| page != "docs/tour.md" && !page.starts_with("docs/guides/"));
}

/// Compares a page, or writes it anew.
#[expect(clippy::disallowed_methods, reason = "as insta decides it for snapshots")]
fn is_as_generated(page: &str, wanted: &str) {
    let path = root().join(page);
    if std::env::var("INSTA_UPDATE").is_ok_and(|how| how == "always") {
        std::fs::write(path, wanted).expect("it is writable");
        return;
    }
    let found = std::fs::read_to_string(path).unwrap_or_default();
    assert!(found == wanted, "{page} is not as generated: INSTA_UPDATE=always writes it anew");
}

/// What `--help` prints of each command.
#[test]
fn the_page_of_commands_is_their_help() {
    let help = done(&["--help"]);
    let mut page = "# Commands\n\nThis page is generated: it has what `--help` prints.\n\n".to_owned();
    let _ = writeln!(page, "```console\n{}```", as_printed(&help));
    let is_command =
        |line: &&str| line.starts_with("  ") && line.as_bytes().get(2).is_some_and(u8::is_ascii_lowercase);
    let listed =
        help.lines().skip_while(|line| *line != "Write:").take_while(|line| *line != "Every command:");
    for line in listed.filter(is_command) {
        let name = line.split_whitespace().next().expect("it has a name");
        let of_all = |text: &str| text.split("\nEvery command:").next().unwrap_or_default().to_owned() + "\n";
        let help = done(&[name, "--help"]);
        let after = help.split("\nEvery command:").nth(1).and_then(|rest| rest.split_once("\n\n"));
        let text = of_all(&help) + after.map_or("", |(_, after)| after);
        let _ = writeln!(page, "\n## {name}\n\n```console\n{}```", as_printed(&text));
    }
    is_as_generated("docs/reference/commands.md", &page);
}

/// Help without the ends of lines that are blank, and with the program's name as a user types it.
fn as_printed(text: &str) -> String {
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

#[test]
fn the_page_of_json_is_what_the_program_explains() {
    let text = done(&["explain", "json"]);
    let page = format!(
        "# Results in JSON\n\nThis page is generated: it has what `avastra explain json` prints.\n\n```console\n{}```\n",
        as_printed(&text)
    );
    is_as_generated("docs/reference/json.md", &page);
}

/// The rows of a table of facts: name, type or words, and meaning.
fn row(name: &str) -> String {
    if let Some(fact) = Fact::from_name(name) {
        let (ty, meaning) = fact.meaning().split_once(": ").expect("it begins with its type");
        let (first, rest) = meaning.split_at(1);
        return format!("| `{name}` | {ty} | {}{rest} |\n", first.to_uppercase());
    }
    let fact = WordFact::from_name(name).unwrap_or_else(|| panic!("`{name}` is no fact"));
    let words: Vec<String> = fact.words().iter().map(|(word, _)| format!("`{word}`")).collect();
    format!("| `{name}` | {} | {} |\n", words.join(", "), fact.meaning())
}

/// A line `<!-- facts: NAME NAME -->` stands before the table of these facts. Each fact is in one table.
#[test]
fn the_tables_of_facts_follow_from_the_facts() {
    let mut listed = Vec::new();
    for page in pages() {
        let text = read(&page);
        let mut wanted = String::new();
        let mut lines = text.lines().peekable();
        while let Some(line) = lines.next() {
            let _ = writeln!(wanted, "{line}");
            let names = line.strip_prefix("<!-- facts: ").and_then(|rest| rest.strip_suffix(" -->"));
            let Some(names) = names else { continue };
            wanted += "\n| fact | type | meaning |\n|---|---|---|\n";
            for name in names.split(' ') {
                wanted += &row(name);
                listed.push(name.to_owned());
            }
            while lines.next_if(|line| line.is_empty() || line.starts_with('|')).is_some() {}
            wanted.push('\n');
        }
        is_as_generated(&page, &wanted);
    }
    let all = Fact::names().chain(WordFact::names());
    let is_told = |name: &&str| {
        ![
            "road.limit",
            "proc",
            "collision",
            "repeated",
            "sudden",
            "struck",
            "avoidable",
            "hit",
            "near",
            "priority",
            "spawn_gap",
            "safety_gap",
        ]
        .contains(name)
    };
    let mut wanted: Vec<&str> = all.filter(is_told).collect();
    wanted.sort_unstable();
    listed.sort_unstable();
    assert_eq!(listed, wanted);
}
