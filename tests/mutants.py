#!/usr/bin/env python3
"""Does a test notice when the code that judges, or that enforces rules, is changed?

    python3 tests/mutants.py judging            lists how many changes there are
    python3 tests/mutants.py judging 1 120      tries 120 of them, chosen by seed 1
    python3 tests/mutants.py judging 1 120 --again 12,40      tries two of those again

`judging` is priority, kinds, avoidability, `counted`, shrinking and the monitor of requirements; `rules` is what solves, judges
and proves rules. The changes are those of `cargo mutants --list` (`cargo install cargo-mutants`). All that are chosen are built
at once, in a copy of the checkout under target/mutants: a changed function has each of its changed bodies beside its own, and the
variable MUTANT says which one runs. So a change costs the run of the tests that belong to it, not a build. A change that does not
compile there is replaced by the next one of the lot, and the last line says how many those were.
"""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COPY = ROOT / "target/mutants/tree"
TARGET = ROOT / "target/mutants/target"
#: Of each subject: its files; the crates whose unit tests belong to it; and those of `tests/it` that do.
SUBJECTS = {
    "judging": (
        ["src/world/sim/right_of_way.rs", "src/world/sim/right_of_way/*.rs"]
        + [f"src/campaign/episode/{name}.rs" for name in ("precrash", "monitor")]
        + [f"src/campaign/oracle/{name}.rs" for name in ("avoidable", "counted", "shrink")],
        ["avastra-world", "avastra-campaign"],
        ["situations::", "verdicts::", "requirements::", "suites::", "r157::", "emitted::"],
    ),
    "rules": (
        ["src/lang/model/rules/*.rs", "src/lang/model/memory.rs", "src/world/action/draw.rs"]
        + [f"src/lang/check/{name}.rs" for name in ("rule", "scenario_rules")]
        + [f"src/lang/prove/{name}.rs" for name in ("reach", "realise", "time", "moment", "witness")],
        ["avastra-lang", "avastra-world"],
        ["cases::", "rules::", "language::", "wishes::"],
    ),
}
SWITCH = """
/// Which change of `tests/mutants.py` runs; 0 is none.
pub fn mutant() -> u32 {
    static WHICH: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *WHICH.get_or_init(|| std::env::var("MUTANT").map_or(0, |text| text.parse().expect("a number")))
}
"""


def listed(patterns):
    """The changes of some files, as `cargo mutants` names them."""
    files = [part for pattern in patterns for part in ("-f", pattern)]
    command = ["cargo", "mutants", "--list", "--json", "--workspace", *files]
    return json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True).stdout)


def copy_checkout():
    """Brings the copy to the state of the checkout, touching what differs alone."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, check=True, text=True).stdout.splitlines()
    for name in names:
        source, copy = ROOT / name, COPY / name
        if source.is_file() and not (copy.is_file() and copy.read_bytes() == source.read_bytes()):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)


def at(lines, place):
    """The index of a place in the text whose lines are given with their ends."""
    return sum(map(len, lines[: place["line"] - 1])) + place["column"] - 1


class File:
    """A file with some of its changes beside its own code."""

    def __init__(self, name):
        self.name, self.text = name, (ROOT / name).read_text()
        lines = self.text.splitlines(keepends=True)
        self.starts = [0]
        for line in lines:
            self.starts.append(self.starts[-1] + len(line))

    def index(self, place):
        return self.starts[place["line"] - 1] + place["column"] - 1

    def body(self, change):
        """Where the body of the changed function begins and ends, without its braces; None for one that is `const`."""
        begin, end = (self.index(change["function"]["span"][side]) for side in ("start", "end"))
        name = change["function"]["function_name"].split("::")[-1].split("<")[0]
        head = re.search(rf"\bfn {re.escape(name)}\b", self.text[begin:end])
        if head is None or re.search(r"\bconst\s+(unsafe\s+)?$", self.text[: begin + head.start()]):
            return None
        return self.text.index("{", begin + head.end()) + 1, end - 1

    def write(self, changes):
        """Writes the copy with these changes, and keeps which lines each of them takes."""
        bodies = {}
        for change in changes:
            bodies.setdefault(self.body(change), []).append(change)
        text, after, pieces = self.text, len(self.text), []
        for (begin, end), group in sorted(bodies.items(), reverse=True):
            pieces[:0] = [(None, text[end:after])]
            arms = [(None, " match avastra_base::mutant() {\n")]
            for change in group:
                first, last = (self.index(change["span"][side]) for side in ("start", "end"))
                changed = text[begin:first] + change["replacement"] + text[last:end]
                arms.append((change, f"{change['number']} => {{{changed}\n}}\n"))
            arms.append((None, "_ => {" + text[begin:end] + "} }"))
            pieces[:0] = arms
            after = begin
        pieces[:0] = [(None, text[:after])]
        self.lines, line = [], 1
        for change, piece in pieces:
            if change:
                self.lines.append((line, line + piece.count("\n"), change))
            line += piece.count("\n")
        written = "".join(piece for _, piece in pieces)
        if (COPY / self.name).read_text() != written:
            (COPY / self.name).write_text(written)

    def change_at(self, line):
        return next((change for first, last, change in self.lines if first <= line <= last), None)


def cargo(*arguments):
    """Messages of a build in the copy."""
    settings = {"cwd": COPY, "capture_output": True, "text": True, "env": os.environ | {"CARGO_TARGET_DIR": str(TARGET)}}
    done = subprocess.run(["cargo", *arguments, "--message-format=json"], check=False, **settings)
    return done, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def refused(messages, files):
    """The changes that errors of the compiler lie in."""
    found = {}
    for message in messages:
        if message.get("reason") != "compiler-message" or message["message"]["level"] != "error":
            continue
        for span in message["message"]["spans"]:
            file = files.get(span["file_name"])
            change = file and file.change_at(span["line_start"])
            if change:
                found[change["number"]] = change
    return found


def build(lot, count, packages):
    """Builds as many changes of the lot as are asked for; gives them, how many did not compile, and the test programs."""
    base = COPY / "src/base/lib.rs"
    base.write_text((ROOT / "src/base/lib.rs").read_text() + SWITCH)
    files, chosen, dropped = {}, {}, 0
    checked = [part for package in packages for part in ("-p", package)]
    while True:
        while len(chosen) < count and lot:
            change = lot.pop()
            change["number"] = len(chosen) + dropped + 1
            file = files.setdefault(change["file"], None) or File(change["file"])
            files[change["file"]] = file
            if file.body(change) is None:
                dropped += 1
            else:
                chosen[change["number"]] = change
        for name, file in files.items():
            file.write([change for change in chosen.values() if change["file"] == name])
        done, messages = cargo("check", *checked)
        if done.returncode == 0:
            break
        out = refused(messages, files)
        if not out:
            sys.exit(f"the copy does not compile:\n{done.stderr[-3000:]}")
        for number in out:
            del chosen[number]
        dropped += len(out)
    done, messages = cargo("test", "--no-run", "--workspace", "--exclude", "avastra-python")
    if done.returncode != 0:
        sys.exit(f"the tests do not compile:\n{done.stderr[-3000:]}")
    programs = {(message["package_id"], message["target"]["name"]): message["executable"]
                for message in messages if message.get("reason") == "compiler-artifact" and message.get("executable") and message["profile"]["test"]}
    return list(chosen.values()), dropped, programs


def stages(programs, packages, names):
    """Commands that a change must make fail, and the folders that they run in."""
    units = {name: program for (_, name), program in programs.items()}
    folders = {package: COPY / "src" / package.removeprefix("avastra-") for package in packages}
    commands = [(folders[package], [units[package.replace("-", "_")]]) for package in packages]
    return [*commands, (COPY, [units["it"], *names])]


def played(commands, number, limits):
    """`caught` by which command, `endless`, or `survived`."""
    for index, (folder, command) in enumerate(commands):
        variables = os.environ | {"MUTANT": str(number), "INSTA_UPDATE": "no", "RUST_TEST_THREADS": "1", "CARGO_MANIFEST_DIR": str(folder)}
        try:
            done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, timeout=limits[index], check=False)
        except subprocess.TimeoutExpired:
            return "endless", index, ""
        if done.returncode != 0:
            failed = re.findall(r"^test (\S+) .*FAILED", done.stdout.decode(errors="replace"), re.M)
            return "caught", index, failed[0] if failed else f"status {done.returncode}"
    return "survived", None, ""


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("subject", choices=SUBJECTS)
    arguments.add_argument("seed", nargs="?", type=int)
    arguments.add_argument("count", nargs="?", type=int, default=20)
    arguments.add_argument("--jobs", type=int, default=2)
    arguments.add_argument("--again", help="numbers of changes that alone are tried")
    given = arguments.parse_args()
    patterns, packages, names = SUBJECTS[given.subject]
    lot = listed(patterns)
    print(f"{len(lot)} changes in {len({change['file'] for change in lot})} files", flush=True)
    if given.seed is None:
        return
    random.Random(given.seed).shuffle(lot)
    copy_checkout()
    changes, dropped, programs = build(lot, given.count, packages)
    commands = stages(programs, packages, names)
    limits = []
    for index, command in enumerate(commands):
        begin = time.monotonic()
        outcome = played([command], 0, [900])
        if outcome[0] != "survived":
            sys.exit(f"without a change, a test fails: {outcome}")
        limits.append(4 * (time.monotonic() - begin) + 20)
    print("tests take " + ", ".join(f"{(limit - 20) / 4:.0f} s" for limit in limits), flush=True)
    if given.again:
        changes = [change for change in changes if str(change["number"]) in given.again.split(",")]
    counts = Counter()
    with ThreadPoolExecutor(given.jobs) as pool:
        outcomes = pool.map(lambda change: played(commands, change["number"], limits), changes)
        for change, (outcome, _, by) in zip(changes, outcomes):
            counts[outcome] += 1
            print(f"{outcome:8} {change['number']:3} {change['name']}   {by}", flush=True)
    print(f"{dict(counts)}; {dropped} did not compile beside the others")


main()
