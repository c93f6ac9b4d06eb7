//! Hostile texts and maps: those that the fuzz target kept, and some made to be slow or large. `fuzz/` makes more of
//! them.

#[path = "../../fuzz/examine.rs"]
mod examine;
#[path = "../../fuzz/scale.rs"]
mod scale;

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use avastra::rng;
use avastra::rng::{Rng, Stream};
use avastra::road::RoadMap;

use crate::cases::{cases, entries, files, root};
use crate::scaling_maps::constructs::CONSTRUCTS;

/// Limits on processor time (s) and memory (MB) for a text of 64 KB. The aim is 1 s, which `fuzz/run.sh` checks
/// with an optimised build. The limit here only catches what grows without bound, on any build and a busy
/// machine. The system counts a child's peak from its fork on, and so never less than what the tests hold by then.
const CPU_S_MAX: f64 = 10.0;
const PEAK_MB_MAX: f64 = 500.0;

#[test]
fn what_the_fuzz_target_kept_breaks_no_law() {
    let seeds = entries(root().join("fuzz/seeds"));
    for seed in &seeds {
        examine::examine(&String::from_utf8_lossy(&std::fs::read(seed).expect("a seed is readable")));
    }
    assert!(seeds.len() >= 40, "{} seeds", seeds.len());
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

/// What must become of a text.
enum Fate {
    Sound,
    /// It is refused with that code.
    Refused(&'static str),
    /// One or the other, as the limits are.
    Either,
}

/// Texts that once took minutes or gigabytes, most of them small: each is soon read, or refused with a code.
#[test]
fn texts_that_cost_much_are_refused_or_read() {
    use Fate::{Either, Refused, Sound};
    let texts = [
        ("groups that double", 100, Sound),
        ("maps of a drawn start", 128, Either),
        ("maps beside many rows", 75, Refused("AV0113")),
        ("states with rules", 200, Either),
        ("states with rules about time", 100, Either),
        ("states with transitions", 100, Either),
        ("actions", 32_000, Sound),
        ("actions", 99_000, Refused("AV0013")),
        ("constants in a chain, the last first", 50_000, Sound),
        ("rows", 100_000, Sound),
        ("rows under three rules", 100_000, Sound),
        ("rows under a rule about the moment", 100_000, Sound),
        ("rows that a rule about the moment tells apart", 100_000, Refused("AV0113")),
        ("effects of one key", 10_000, Refused("AV0113")),
        ("a sum", 2_000_000, Refused("AV0013")),
        ("matches in the subject", 10_000, Refused("AV0003")),
        ("matches in arms for all variants", 12, Either),
        ("numbers matched in the subject", 40, Refused("AV0107")),
        ("cases of a number in a rule", 60_000, Refused("AV0107")),
        ("unknown names", 20_000, Refused("AV0101")),
        ("functions in rules", 100, Either),
        ("a function of itself", 60, Either),
        ("drawn truths that nothing fits", 40, Either),
        ("more effects of all actions", 2_000, Refused("AV0113")),
    ];
    let scratch = Scratch::new();
    let mut wrong = Vec::new();
    for (name, size, fate) in texts {
        let construct = scale::GRAMMAR.iter().find(|(construct, _)| *construct == name);
        let (_, text) = construct.expect("it is in the list");
        let came = scratch.run("check", &text(size), CPU_S_MAX);
        let is_right = match fate {
            Sound => came.exit == Some(0),
            Refused(code) => came.exit == Some(2) && came.output.contains(code),
            Either => matches!(came.exit, Some(0 | 2)),
        };
        if !is_right || came.cpu_s > CPU_S_MAX || came.peak_mb > SCALED_MB_MAX {
            wrong.push(format!("{name}, {size}: {}", came.words()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// `diff` matches rows by their labels, not each with each.
#[test]
fn long_tables_are_compared_soon() {
    let scratch = Scratch::new();
    let text = |rule: &str| {
        format!(
            "language 1\nuse \"roads.ava\"\nstate c: Int = 0\naction a(each x: Int in 1 .. 30000) {{ set c = x }}\nrule r on a: {rule}\n"
        )
    };
    let other = scratch.folder.path().join("other.ava");
    std::fs::write(&other, text("x <= 30000 and c <= 30000")).expect("it is writable");
    let came = scratch.run("diff", &text("x <= 30000"), 2.0 * CPU_S_MAX);
    assert!(came.exit == Some(0) && came.output.contains("rule `r`"), "{}", came.words());
}

/// Most memory for a text that is large in one construct, MB.
const SCALED_MB_MAX: f64 = 500.0;

/// Most processor time for a text without mistakes, s. One with mistakes has a second, or a second for each megabyte.
const SOUND_CPU_S_MAX: f64 = 4.0;

/// Sizes of each construct, as long as its text is smaller than this, bytes.
const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];
const SCALED_BYTES_MAX: usize = 4_000_000;

/// The commands that are run on a text.
const VERBS: [&str; 4] = ["check", "table", "compile", "lsp"];

/// Every construct of the grammar and of maps ten, a hundred, … times, and then as often as chance says: which of them take
/// over [`SOUND_CPU_S_MAX`], over a second where the text is wrong, or over 500 MB. Meant for an optimised build; each run of the program has a limit of time.
///
/// `FUZZ_S=1800 FUZZ_SEED=1 cargo test --release --test it -- --ignored --nocapture each_construct_scales`
#[test]
#[ignore = "runs for as long as it is told to"]
fn each_construct_scales() {
    let (seconds, seed) = (asked("FUZZ_S", 60) as f64, asked("FUZZ_SEED", 1));
    let of_grammar = scale::GRAMMAR
        .iter()
        .flat_map(|&(name, text)| VERBS.into_iter().map(move |verb| Large { name, text, verb }));
    let of_maps = CONSTRUCTS.iter().map(|&(name, text, _)| Large { name, text, verb: "road" });
    let all: Vec<Large> = of_grammar.chain(of_maps).collect();
    let mut measured = Measured { scratch: Scratch::new(), runs: 0, spent_s: 0.0, dear: Vec::new() };
    for large in &all {
        for size in SIZES {
            // At the next size it would be dearer still, or longer.
            if measured.spent_s > seconds || !measured.may_be_larger(large, size) {
                break;
            }
        }
    }
    for nth in 0.. {
        if measured.spent_s > seconds {
            break;
        }
        let mut random = rng::stream(seed, Stream::Exploration, nth);
        let large = &all[rng::below(&mut random, all.len() as u32) as usize];
        // An element of a map has a hundred times the bytes of a word.
        let powers = if large.verb == "road" { 4 } else { 6 };
        let size = 10_usize.pow(rng::below(&mut random, powers)) * (1 + rng::below(&mut random, 9) as usize);
        measured.may_be_larger(large, size);
    }
    let Measured { runs, spent_s, dear, .. } = measured;
    println!("{runs} runs, {spent_s:.0} s");
    assert!(dear.is_empty(), "{}", dear.join("\n"));
}

/// A number from the environment.
#[expect(clippy::disallowed_methods, reason = "how long and with which seed is said in the environment")]
fn asked(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// A construct, and what the program is asked to do with texts that are large in it.
struct Large {
    name: &'static str,
    text: fn(usize) -> String,
    verb: &'static str,
}

/// The cost of the runs so far.
struct Measured {
    scratch: Scratch,
    runs: usize,
    spent_s: f64,
    /// Those over the limits, in words.
    dear: Vec<String>,
}

impl Measured {
    /// Runs the program on a construct of that size; whether it was within the limits, and the text was not too long.
    fn may_be_larger(&mut self, large: &Large, size: usize) -> bool {
        let Large { name, text, verb } = large;
        let text = text(size);
        if text.len() > SCALED_BYTES_MAX {
            // To make it took time, too.
            self.spent_s += 1e-3;
            return false;
        }
        let came = self.scratch.run(verb, &text, CPU_S_MAX);
        self.runs += 1;
        self.spent_s += came.cpu_s;
        let ends_well = matches!(came.exit, Some(0..100));
        // What is sound may be a table of 100,000 rows; what is wrong is soon said, but it has to be read.
        // The server always ends well; `check` measures the same text.
        let is_sound = came.exit == Some(0);
        let cpu_s_max = if is_sound { SOUND_CPU_S_MAX } else { 1.0_f64.max(1e-6 * text.len() as f64) };
        let is_cheap = ends_well && came.cpu_s <= cpu_s_max && came.peak_mb <= SCALED_MB_MAX;
        if !is_cheap {
            let words = format!("{verb} {name}, {size}, {} bytes: {}", text.len(), came.words());
            println!("{words}");
            self.dear.push(words);
        }
        is_cheap
    }
}

/// A folder with the files that texts may use.
struct Scratch {
    folder: tempfile::TempDir,
}

/// The end and the cost of a run of the program.
struct Came {
    cpu_s: f64,
    peak_mb: f64,
    /// `None` if a signal ended it.
    exit: Option<i32>,
    /// All that it printed.
    output: String,
}

impl Came {
    fn words(&self) -> String {
        let exit = self.exit.map_or_else(|| "a signal".to_owned(), |exit| format!("exit {exit}"));
        let mut lines = self.output.lines();
        let said = lines.find(|line| line.starts_with("error")).unwrap_or_default();
        let said: String = said.chars().take(100).collect();
        format!("{:.2} s, {:.0} MB, {exit} {said}", self.cpu_s, self.peak_mb)
    }
}

impl Scratch {
    fn new() -> Scratch {
        let folder = tempfile::tempdir().expect("a scratch directory");
        // The shipped roads: proofs about a moment go over the stretches of a route, and theirs are many.
        let copy = |from: PathBuf, to: &str| {
            std::fs::copy(from, folder.path().join(to)).expect("it can be copied");
        };
        let shipped = root().join("scenarios");
        copy(shipped.join("roads.ava"), "roads.ava");
        copy(shipped.join("lanes.ava"), "lanes.ava");
        std::fs::create_dir(folder.path().join("roads")).expect("the folder is writable");
        for entry in std::fs::read_dir(shipped.join("roads")).expect("it is there").flatten() {
            copy(entry.path(), &format!("roads/{}", entry.file_name().display()));
        }
        std::fs::write(folder.path().join("straight.xodr"), examine::STRAIGHT).expect("it is writable");
        Scratch { folder }
    }

    /// Runs the program on a text, for so many seconds of a processor and in 4 GB at most.
    fn run(&self, verb: &str, text: &str, cpu_s_max: f64) -> Came {
        let in_folder = |name: &str| self.folder.path().join(name);
        let path = in_folder(if verb == "road" { "large.xodr" } else { "large.ava" });
        std::fs::write(&path, text).expect("it is writable");
        let mut command = Command::new(env!("CARGO_BIN_EXE_avastra"));
        command.arg(verb);
        match verb {
            "lsp" => {
                std::fs::write(in_folder("messages"), messages(&path, text)).expect("it is writable");
                command.stdin(File::open(in_folder("messages")).expect("it was written"));
            }
            "compile" => {
                command.arg(&path).arg("--out").arg(in_folder("table.yaml"));
            }
            "diff" => {
                command.arg(&path).arg(in_folder("other.ava"));
            }
            "table" => {
                command.arg(&path).arg("--markdown");
            }
            _ => {
                command.arg(&path);
            }
        }
        let output = File::create(in_folder("output")).expect("it is writable");
        command.stderr(output.try_clone().expect("a file has handles")).stdout(output);
        let seconds = cpu_s_max.ceil() as libc::rlim_t;
        let limited = move || {
            let limit = |most: libc::rlim_t| libc::rlimit { rlim_cur: most, rlim_max: most };
            // SAFETY: both are plain data, and `setrlimit` may be called between fork and exec.
            unsafe {
                libc::setrlimit(libc::RLIMIT_CPU, &limit(seconds + 1));
                libc::setrlimit(libc::RLIMIT_AS, &limit(4 << 30));
            }
            Ok(())
        };
        // SAFETY: it only sets limits of the child.
        unsafe {
            command.pre_exec(limited);
        }
        let (status, usage) = waited(&mut command);
        let exit = libc::WIFEXITED(status).then(|| libc::WEXITSTATUS(status));
        let printed = std::fs::read(in_folder("output")).expect("it was written");
        let (cpu_s, peak_mb) = taken(&usage);
        Came { cpu_s, peak_mb, exit, output: String::from_utf8_lossy(&printed).into_owned() }
    }
}

/// The messages of an editor that opens a text, asks for completions at its end, and leaves.
fn messages(path: &Path, text: &str) -> Vec<u8> {
    let uri = format!("file://{}", path.display());
    let document = serde_json::json!({ "uri": uri, "languageId": "avastra", "version": 1, "text": text });
    let end = serde_json::json!({ "line": text.lines().count(), "character": 0 });
    let place = serde_json::json!({ "textDocument": { "uri": uri }, "position": end });
    let messages = [
        serde_json::json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": { "capabilities": {} } }),
        serde_json::json!({ "jsonrpc": "2.0", "method": "initialized", "params": {} }),
        serde_json::json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": document } }),
        serde_json::json!({ "jsonrpc": "2.0", "id": 2, "method": "textDocument/completion", "params": place }),
        serde_json::json!({ "jsonrpc": "2.0", "id": 3, "method": "shutdown" }),
        serde_json::json!({ "jsonrpc": "2.0", "method": "exit" }),
    ];
    let framed = messages.iter().map(|message| {
        let body = message.to_string();
        format!("Content-Length: {}\r\n\r\n{body}", body.len())
    });
    framed.collect::<String>().into_bytes()
}

/// Texts of up to 64 KB, made of the kept texts, the cases and the shipped files: cut, doubled, mixed and with other
/// words. Fuzzing without `cargo fuzz`, which learns from what its texts reach; this does not, but runs everywhere:
///
/// `FUZZ_S=3600 FUZZ_SEED=1 cargo test --test it -- --ignored --nocapture made_up_texts`
#[test]
#[ignore = "runs for as long as it is told to"]
fn made_up_texts_break_no_law() {
    let (seconds, seed) = (asked("FUZZ_S", 60) as f64, asked("FUZZ_SEED", 1));
    let maker = Maker::new();
    let begin_s = processor_s();
    let (mut texts, mut bytes, mut dearest) = (0_u64, 0_u64, 0.0_f64);
    while processor_s() - begin_s < seconds {
        let (length, took_s) = maker.examine(seed, texts, 1.0);
        (texts, bytes, dearest) = (texts + 1, bytes + length as u64, dearest.max(took_s));
    }
    let (_, peak_mb) = own_cost();
    println!(
        "{texts} texts, {bytes} bytes, {:.0} s, at most {dearest:.2} s and {peak_mb:.0} MB",
        processor_s() - begin_s
    );
    assert!(peak_mb <= PEAK_MB_MAX, "{peak_mb:.0} MB");
}

/// The first of the same texts, in every run. Their time is not judged: other tests run beside this one.
#[test]
fn some_made_up_texts_break_no_law() {
    let maker = Maker::new();
    for number in 0..2000 {
        maker.examine(1, number, f64::INFINITY);
    }
}

/// Maps with other values, without some lines and with others twice: none panics, and none takes a second.
#[test]
fn mutated_maps_do_no_harm() {
    examine_mutated_maps(40);
}

/// The same at length: `cargo test --test it -- --ignored --nocapture a_thousand_mutated_maps`
#[test]
#[ignore = "takes minutes"]
fn a_thousand_mutated_maps_do_no_harm() {
    examine_mutated_maps(1000);
}

fn examine_mutated_maps(count: u64) {
    let folders = ["scenarios/roads", "tests/cases/diagnostics", "tests/cases/faults"];
    let paths = folders.iter().flat_map(|folder| files(root().join(folder), "xodr"));
    let texts: Vec<String> =
        paths.map(|path| std::fs::read_to_string(path).expect("a map is readable")).collect();
    let (mut read, mut dearest_s) = (0, 0.0_f64);
    for index in 0..count {
        let mut random = rng::stream(1, Stream::Exploration, index);
        let text = mutated(&texts[index as usize % texts.len()], &mut random);
        let before_s = processor_s();
        let result = std::panic::catch_unwind(|| RoadMap::from_opendrive("mutated", &text));
        let took_s = processor_s() - before_s;
        // The limit allows for an unoptimised build on a busy machine.
        if result.is_err() || took_s > CPU_S_MAX {
            let path = root().join(format!("target/mutated_{index}.xodr"));
            std::fs::write(&path, &text).expect("it is writable");
            panic!("{}: {took_s:.1} s, panics: {}", path.display(), result.is_err());
        }
        read += u64::from(matches!(result, Ok(Ok(_))));
        dearest_s = dearest_s.max(took_s);
    }
    println!("{count} mutated maps, {read} of them are still maps, at most {dearest_s:.2} s");
    assert!(read > 0, "none is a map any more");
}

/// A map with up to eight changes: values, lines left out and lines twice.
fn mutated(text: &str, random: &mut Rng) -> String {
    const VALUES: [&str; 14] = [
        "",
        "NaN",
        "inf",
        "1e308",
        "-1e9",
        "1e9",
        "0",
        "-1",
        "1e-300",
        "-2147483648",
        "7",
        "x",
        "+",
        "driving",
    ];
    let mut text = text.to_owned();
    for _ in 0..=rng::below(random, 8) {
        let from = rng::below(random, text.len() as u32) as usize;
        let Some(from) = (from..text.len()).find(|at| text.is_char_boundary(*at)) else { continue };
        if rng::below(random, 4) > 0 {
            let Some(begin) = text[from..].find("=\"").map(|at| from + at + 2) else { continue };
            let Some(length) = text[begin..].find('"') else { continue };
            let value = VALUES[rng::below(random, VALUES.len() as u32) as usize];
            text.replace_range(begin..begin + length, value);
        } else {
            let Some(begin) = text[from..].find('\n').map(|at| from + at + 1) else { continue };
            let Some(length) = text[begin..].find('\n').map(|at| at + 1) else { continue };
            let line = text[begin..begin + length].to_owned();
            let new = if rng::below(random, 2) == 0 { String::new() } else { line.repeat(2) };
            text.replace_range(begin..begin + length, &new);
        }
    }
    text
}

/// Elements, attributes and lines so many or so long that they find a cost that grows faster than the text.
#[test]
fn crowded_maps_are_refused_soon() {
    let attributes: String = (0..40_000).map(|n| format!(" a{n}=\"1\"")).collect();
    let many = format!("<OpenDRIVE><road{attributes}/></OpenDRIVE>");
    let long = format!("<OpenDRIVE><header name=\"{}\"/></OpenDRIVE>", "x".repeat(10_000_000));
    let roads = format!("<OpenDRIVE>{}</OpenDRIVE>", "<road id=\"1\"/>".repeat(200_000));
    for (what, text) in [("attributes", many), ("line", long), ("roads", roads)] {
        let before_s = processor_s();
        assert!(RoadMap::from_opendrive("crowded", &text).is_err(), "{what}");
        let took_s = processor_s() - before_s;
        assert!(took_s < CPU_S_MAX / 2.0, "{what}: {took_s:.1} s");
    }
}

/// Makes texts from others.
struct Maker {
    texts: Vec<String>,
    words: Vec<String>,
}

/// The most bytes of a text.
const TEXT_MAX: usize = 65_536;

impl Maker {
    fn new() -> Maker {
        let mut paths: Vec<std::path::PathBuf> = Vec::new();
        for folder in ["fuzz/seeds", "scenarios", "scenarios/examples", "policies"] {
            let Ok(found) = std::fs::read_dir(root().join(folder)) else { continue };
            paths.extend(found.flatten().map(|entry| entry.path()).filter(|path| path.is_file()));
        }
        for area in ["diagnostics", "format", "spaces", "wishes", "faults"] {
            paths.extend(cases(area).into_iter().map(|(_, path)| path));
        }
        paths.sort();
        let read = |path: &std::path::PathBuf| {
            Some(String::from_utf8_lossy(&std::fs::read(path).ok()?).into_owned())
        };
        // A policy of megabytes of weights would hide everything else.
        let texts: Vec<String> =
            paths.iter().filter_map(read).filter(|text: &String| text.len() < TEXT_MAX / 2).collect();
        assert!(texts.len() > 100, "{} texts", texts.len());
        let dictionary = std::fs::read_to_string(root().join("fuzz/ava.dict")).expect("it is there");
        let words =
            dictionary.lines().filter_map(|line| Some(line.strip_prefix('"')?.strip_suffix('"')?.to_owned()));
        let words: Vec<String> = words.collect();
        assert!(words.len() > 20, "{} words", words.len());
        Maker { texts, words }
    }

    /// Examines the text with a number and keeps it in a file if it breaks a law or takes longer than so many seconds.
    /// Gives its bytes and the seconds that it took.
    fn examine(&self, seed: u64, number: u64, seconds_max: f64) -> (usize, f64) {
        let text = self.text(&mut rng::stream(seed, Stream::Exploration, number));
        let before_s = processor_s();
        let result = std::panic::catch_unwind(|| examine::examine(&text));
        let took_s = processor_s() - before_s;
        if result.is_err() || took_s > seconds_max {
            let path = root().join(format!("target/fuzz_{seed}_{number}.ava"));
            std::fs::write(&path, &text).expect("it is writable");
            panic!("{}: {}", path.display(), if result.is_err() { "panics" } else { "takes too long" });
        }
        (text.len(), took_s)
    }

    fn text(&self, rng: &mut Rng) -> String {
        let one = |rng: &mut Rng, count: usize| rng::below(rng, count.max(1) as u32) as usize;
        let own = one(rng, self.texts.len());
        let mut parts = parts(&self.texts[own]);
        for _ in 0..1 + one(rng, 12) {
            if parts.is_empty() {
                break;
            }
            let at = one(rng, parts.len());
            let end = (at + 1 + one(rng, 30)).min(parts.len());
            match one(rng, 8) {
                0 => drop(parts.drain(at..end)),
                1 => {
                    let again: Vec<String> = parts[at..end].to_vec();
                    let times = 1 + one(rng, 40);
                    let all = again.iter().cycle().take(again.len() * times).cloned();
                    drop(parts.splice(at..at, all.collect::<Vec<_>>()));
                }
                2 => {
                    let other = one(rng, self.texts.len());
                    let other = self::parts(&self.texts[other]);
                    let from = one(rng, other.len());
                    let to = (from + 1 + one(rng, 200)).min(other.len());
                    let taken = other.get(from..to).unwrap_or_default().to_vec();
                    drop(parts.splice(at..at, taken));
                }
                3 => parts[at] = self.words[one(rng, self.words.len())].clone(),
                4 => parts.insert(at, self.words[one(rng, self.words.len())].clone()),
                5 => {
                    let with = one(rng, parts.len());
                    parts.swap(at, with);
                }
                6 => {
                    let with = one(rng, parts.len());
                    parts[at] = parts[with].clone();
                }
                _ => {
                    let numbers = ["0", "1", "-1", "0.000001", "99999999999", "128", "1/3", "360", "65536"];
                    parts[at] = numbers[one(rng, numbers.len())].to_owned();
                }
            }
        }
        let mut text = parts.concat();
        let mut end = text.len().min(TEXT_MAX);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text.truncate(end);
        text
    }
}

/// Words, numbers, spaces and single signs.
fn parts(text: &str) -> Vec<String> {
    let kind = |c: char| match c {
        _ if c.is_alphanumeric() || c == '_' => 0,
        _ if c.is_whitespace() => 1,
        _ => 2,
    };
    let mut parts: Vec<String> = Vec::new();
    let mut last = 2;
    for c in text.chars() {
        match parts.last_mut() {
            Some(part) if kind(c) == last && last != 2 => part.push(c),
            _ => parts.push(c.to_string()),
        }
        last = kind(c);
    }
    parts
}

/// Processor time of this process so far, s.
fn processor_s() -> f64 {
    own_cost().0
}

/// Processor time (s) and peak memory (MB) of this process so far.
fn own_cost() -> (f64, f64) {
    // SAFETY: it is plain data that the kernel fills in.
    unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        assert_eq!(libc::getrusage(libc::RUSAGE_SELF, &mut usage), 0);
        taken(&usage)
    }
}

/// Processor time (s) and peak memory (MB) of a command; it must end by itself.
fn cost(command: &mut Command) -> (f64, f64) {
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let (status, usage) = waited(command);
    assert!(libc::WIFEXITED(status), "a signal ended it");
    assert!(libc::WEXITSTATUS(status) < 100, "it panicked");
    taken(&usage)
}

/// Runs a command to its end: how it ended, and what it took.
fn waited(command: &mut Command) -> (i32, libc::rusage) {
    #[expect(clippy::zombie_processes, reason = "`wait4` waits for it, and tells what it took")]
    let child = command.spawn().expect("it starts");
    // SAFETY: both are plain data that the kernel fills in, and the child is waited for only here.
    unsafe {
        let mut status = 0;
        let mut usage: libc::rusage = std::mem::zeroed();
        let pid = child.id() as libc::pid_t;
        assert_eq!(libc::wait4(pid, &mut status, 0, &mut usage), pid);
        (status, usage)
    }
}

/// Processor time (s) and peak memory (MB).
fn taken(usage: &libc::rusage) -> (f64, f64) {
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    (seconds(usage.ru_utime) + seconds(usage.ru_stime), usage.ru_maxrss as f64 / 1024.0)
}
