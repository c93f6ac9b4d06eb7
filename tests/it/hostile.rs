//! Hostile texts: those that the fuzz target kept, and some made to be slow or large. `fuzz/` makes more of
//! them.

#[path = "../../fuzz/examine.rs"]
mod examine;

use std::process::Command;

use crate::cases::{cases, root};

/// Limits on processor time (s) and memory (MB) for a text of 64 KB. The aim is 1 s, which `fuzz/run.sh` checks
/// with an optimised build. The limit here only catches what grows without bound, on any build and a busy
/// machine.
const CPU_S_MAX: f64 = 10.0;
const PEAK_MB_MAX: f64 = 256.0;

#[test]
fn what_the_fuzz_target_kept_breaks_no_law() {
    let seeds = root().join("fuzz/seeds");
    let mut read = 0;
    for entry in std::fs::read_dir(&seeds).expect("the seeds are there").flatten() {
        let bytes = std::fs::read(entry.path()).expect("a seed is readable");
        examine::examine(&String::from_utf8_lossy(&bytes));
        read += 1;
    }
    assert!(read >= 40, "{read} seeds");
}

#[test]
fn no_case_breaks_a_law() {
    for area in ["diagnostics", "format"] {
        for (_, path) in cases(area) {
            examine::examine(&String::from_utf8_lossy(&std::fs::read(&path).expect("a case is readable")));
        }
    }
}

/// Every prefix of a small space with every kind of declaration, cut in the middle of words.
#[test]
fn every_prefix_of_a_space_is_examined() {
    let text = std::fs::read_to_string(root().join("tests/cases/format/override.ava")).expect("it is there");
    for (end, _) in text.char_indices() {
        examine::examine(&text[..end]);
    }
}

/// Texts of 64 KB; each is made to find a cost that grows faster than the text.
#[test]
fn texts_made_to_be_slow_are_not() {
    let full = |head: &str, line: &dyn Fn(usize) -> String| {
        let mut text = format!("language 1\n{head}\n");
        let mut number = 0;
        while text.len() < 64_000 {
            text.push_str(&line(number));
            number += 1;
        }
        text
    };
    let arms = |count: usize| (0..count).map(|v| format!("V{v} => {v}\n")).collect::<String>();
    let variants = (0..128).map(|v| format!("V{v}")).collect::<Vec<_>>().join(" | ");
    let axes = "action a(each x: Int in 1 .. 300, each y: Int in 1 .. 300) { set n = x + y }";
    let texts: Vec<(&str, String)> = vec![
        ("unknown names", full("", &|n| format!("let a{n} = b{n}\n"))),
        ("duplicates", full("", &|_| "let a = 1\n".to_owned())),
        ("constants in a chain", full("let a0 = 1", &|n| format!("let a{} = a{n}\n", n + 1))),
        (
            "functions in a chain",
            full("fn f0() -> Int = 1", &|n| format!("fn f{}() -> Int = f{n}()\n", n + 1)),
        ),
        ("enums", full("", &|n| format!("enum E{n} = A | B\n"))),
        (
            "variants",
            full(&format!("enum E = {variants}"), &|n| {
                format!("fn f{n}(e: E) -> Int = match e {{ {} }}\n", arms(128))
            }),
        ),
        ("actions", full("state b: Bool = true", &|n| format!("action a{n}() {{ set b = true }}\n"))),
        (
            "rules of many rows",
            full(&format!("state n: Int = 0\n{axes}"), &|n| format!("rule r{n}: n > {n}\n")),
        ),
        ("brackets", full("", &|_| "let a = ((((((((1))))))))\n".to_owned())),
        ("mistakes", full("", &|_| "let ( = } \n".to_owned())),
        ("one long sum", full("let a = 1", &|_| "+ 1".to_owned())),
        ("comments", full("", &|_| "/// a\n// b\n".to_owned())),
        (
            "groups",
            full("state b: Bool = true\naction a() { set b = true }\ngroup g0 = a", &|n| {
                format!("group g{} = g{n}, a\n", n + 1)
            }),
        ),
        (
            "states",
            full("enum E = A | B", &|n| format!("state s{n}: E = any\naction a{n}() {{ set s{n} = B }}\n")),
        ),
        ("texts", full("", &|n| format!("use \"{n}.ava\"\n"))),
        ("rows without a witness", {
            let roads = root().join("scenarios/roads.ava").display().to_string();
            let action = "action a(each x: Int in 1 .. 60, each y: Int in 1 .. 60, any e: E, any f: E, any d: Length in 1 m .. 9 m)";
            let spawn = "spawn Sedan ahead d { lane: Current, speed: 5 m/s, does: DriveAhead }\n set s = e";
            format!(
                "language 1\nuse \"{roads}\"\nenum E = {variants}\nstate s: E = any\n{action} {{ {spawn} }}\nrule r on a: d * d == x * y * (7 m * 1 m) and e == f implies s == e and d * d == 3 m * 1 m"
            )
        }),
        ("a fair spawn with many choices", {
            let roads = root().join("scenarios/roads.ava").display().to_string();
            let action = "action a(each x: Int in 1 .. 90, each y: Int in 1 .. 90, any e: E, any f: E, any d: Length in 90 m .. 99 m)";
            let spawn = "spawn Sedan ahead d { lane: Current, speed: 5 m/s, does: DriveAhead }\n set s = e";
            format!(
                "language 1\nuse \"{roads}\"\nenum E = {variants}\nstate s: E = any\n{action} {{ {spawn} }}\nrule r on a: e == f or s == e"
            )
        }),
        ("one long list", full("let a = [1", &|_| ", 1".to_owned())),
    ];
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let mut dear = Vec::new();
    for (what, text) in texts {
        let path = scratch.path().join("hostile.ava");
        std::fs::write(&path, text).expect("it is writable");
        for verb in ["check", "fmt"] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_avastra"));
            command.arg(verb).arg(&path);
            if verb == "fmt" {
                command.arg("--check");
            }
            let (cpu_s, peak_mb) = cost(&mut command);
            if cpu_s > CPU_S_MAX || peak_mb > PEAK_MB_MAX {
                dear.push(format!("{verb} {what}: {cpu_s:.2} s, {peak_mb:.0} MB"));
            }
        }
    }
    assert!(dear.is_empty(), "{}", dear.join("\n"));
}

/// Processor time (s) and peak memory (MB) of a command; it must end by itself.
fn cost(command: &mut Command) -> (f64, f64) {
    #[expect(clippy::zombie_processes, reason = "`wait4` waits for it, and tells what it took")]
    let child = command
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    // SAFETY: both are plain data that the kernel fills in, and the child is waited for only here.
    let (status, usage) = unsafe {
        let mut status = 0;
        let mut usage: libc::rusage = std::mem::zeroed();
        let pid = child.id() as libc::pid_t;
        assert_eq!(libc::wait4(pid, &mut status, 0, &mut usage), pid);
        (status, usage)
    };
    assert!(libc::WIFEXITED(status), "a signal ended it");
    assert!(libc::WEXITSTATUS(status) < 100, "it panicked");
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    (seconds(usage.ru_utime) + seconds(usage.ru_stime), usage.ru_maxrss as f64 / 1024.0)
}
