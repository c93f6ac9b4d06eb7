//! The tour: every command of it does what the page says.

use std::path::Path;

use assert_cmd::Command;

use crate::cases::root;
use crate::command::outcome;

/// A fenced block: what stands behind the fence, and what is inside.
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

/// Runs a line of the page and gives what it prints; the line may say with which exit status it ends.
fn run(line: &str, folder: &Path) -> String {
    let (command, wanted) = line.split_once(" # exit status ").unwrap_or((line, "0"));
    let mut shell = Command::new("sh");
    let binary = assert_cmd::cargo::cargo_bin("avastra");
    let binaries = binary.parent().expect("it lies in a folder").display().to_string();
    let found = format!("PATH=\"$AVASTRA:$PATH\"; {command}");
    shell.current_dir(folder).env("AVASTRA", binaries).args(["-c", &found]);
    let (status, stdout, stderr) = outcome(&mut shell);
    assert_eq!(status.to_string(), wanted, "{line}\n{stdout}\n{stderr}");
    stdout
}

/// ```` ```sh ```` is run, ```` ```text ```` after it has lines that it printed (one that ends in `…` is the beginning of one),
/// and a block with `> FILE` or `>> FILE` is written to that file.
#[test]
fn every_command_of_the_tour_does_what_the_page_says() {
    let page = std::fs::read_to_string(root().join("docs/tour.md")).expect("the page is there");
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let mut printed = String::new();
    let (mut commands, mut wrong) = (0, String::new());
    for Block { info, text, line } in blocks(&page) {
        match info.split_once(" > ").or(info.split_once(" >> ")) {
            Some((_, file)) => {
                let path = scratch.path().join(file);
                let before = info.contains(" >> ").then(|| std::fs::read_to_string(&path));
                let before = before.map_or(String::new(), |before| before.expect("it is there"));
                std::fs::write(path, before + &text).expect("it is writable");
            }
            None if info == "sh" => {
                printed = text.lines().map(|line| run(line, scratch.path())).collect();
                commands += text.lines().count();
            }
            None => {
                assert_eq!(info, "text", "line {line}: what is this block?");
                let is_printed = |line: &&str| match line.strip_suffix('…') {
                    Some(begin) => printed.lines().any(|one| one.starts_with(begin)),
                    None => printed.lines().any(|one| one == *line),
                };
                let missing: Vec<&str> = text.lines().filter(|line| !is_printed(line)).collect();
                if !missing.is_empty() {
                    wrong += &format!("line {line}: {missing:#?} is not in\n{printed}\n");
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(commands >= 12, "{commands} commands");
    for written in ["found/report.html", "crash.svg", "junit.xml", "suite/corner_0011.ava"] {
        assert!(scratch.path().join(written).is_file(), "{written}");
    }
}
