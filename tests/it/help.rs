//! `--help`: its examples do what they say.

use assert_cmd::Command;

use crate::cases::root;
use crate::command::{avastra, done, outcome};

/// Commands that only read and write small files, and end soon.
const QUICK: [&str; 11] =
    ["check", "compile", "completions", "diff", "explain", "fmt", "lsp", "new", "policy", "road", "table"];

/// The lines to type that the help of a command shows.
fn examples(command: &str) -> Vec<String> {
    let help = done(&[command, "--help"]);
    let lines = help.lines().filter_map(|line| line.strip_prefix("  avastra "));
    let lines: Vec<String> = lines.map(|line| line.split("  ").next().unwrap_or(line).to_owned()).collect();
    assert!(!lines.is_empty(), "{command} has no example: {help}");
    lines
}

#[test]
fn the_examples_of_quick_commands_work() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for shared in ["scenarios", "policies"] {
        let link = scratch.path().join(shared);
        std::os::unix::fs::symlink(root().join(shared), link).expect("links can be made");
    }
    for (name, starter) in [("mine.ava", "space.ava"), ("roads.ava", "roads.ava")] {
        let text = std::fs::read_to_string(root().join("src/cli/starter").join(starter));
        std::fs::write(scratch.path().join(name), text.expect("it is shipped")).expect("it is writable");
    }
    std::fs::create_dir(scratch.path().join("roads")).expect("it is new");
    let map = root().join("scenarios/roads/corner.xodr");
    std::fs::copy(map, scratch.path().join("roads/corner.xodr")).expect("it can be copied");
    let binary = assert_cmd::cargo::cargo_bin("avastra");
    for command in QUICK {
        // Trying rows out and driving with a policy take long.
        let is_quick = |line: &String| {
            !line.contains("--try") && !line.contains(" explain ") && !line.contains(" distil ")
        };
        for line in examples(command).into_iter().filter(is_quick) {
            let mut shell = Command::new("sh");
            shell.current_dir(scratch.path()).env("HOME", scratch.path()).env("AVASTRA", &binary);
            // The folder of a completion script need not exist; that is the shell's affair.
            let line = line.split(" > ").next().unwrap_or(&line).to_owned();
            shell.args(["-c", &format!("\"$AVASTRA\" {line}")]).write_stdin("language 1\n");
            let (status, stdout, stderr) = outcome(&mut shell);
            // An editor that hangs up without a farewell is an error, as the protocol has it.
            let wanted = i32::from(command == "lsp");
            assert_eq!(status, wanted, "{line}\n{stdout}\n{stderr}");
        }
    }
}

#[test]
fn completions_offer_the_values_of_closed_sets() {
    for shell in ["bash", "zsh", "fish"] {
        let script = done(&["completions", shell]);
        for value in ["random-raw", "frenet", "space-filling", "released", "sarif", "network"] {
            assert!(script.contains(value), "{shell}: {value}");
        }
    }
}

#[test]
fn help_lists_the_exit_statuses() {
    let (_, help, _) = outcome(&mut avastra(&["--help"]));
    for status in ["0", "1", "2", "3", "4", "130"] {
        assert!(help.lines().any(|line| line.trim_start().starts_with(&format!("{status} "))), "{help}");
    }
}
