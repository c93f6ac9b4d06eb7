#!/usr/bin/env python3
"""Does a test notice when the code that judges, or that enforces rules, is changed?

    python3 tests/mutants.py judging            lists how many changes there are
    python3 tests/mutants.py judging 1 120      tries 120 of them, chosen by seed 1
    python3 tests/mutants.py judging 1 120 --again 12,40    tries two of those again

`judging` is priority, kinds, avoidability, `counted`, shrinking and the monitor of requirements; `rules` is what solves, judges
and proves rules. The changes are those of `cargo mutants --list` (`cargo install cargo-mutants`). All that are chosen are built
at once, in a copy of the checkout under target/mutants: a changed function has each of its changed bodies beside its own, and the
variable MUTANT says which one runs. So a change costs the run of the tests that belong to it, not a build. A change that does not
compile there is replaced by the next one of the lot, and the last line says how many those were.
"""

import argparse
import hashlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COPY = ROOT / "target/mutants/tree"
TARGET = ROOT / "target/mutants/target"
#: Names of changes that do not compile beside the others, with their files' texts.
REFUSED = ROOT / "target/mutants/refused.json"
#: Of each subject: files; the crates whose unit tests belong to them; and those of `tests/it` that do.
SUBJECTS = {
    "judging": [
        (["src/world/behave/right_of_way/*.rs", "src/world/state/passed.rs", "src/world/state/rights.rs"],
         ["avastra-world", "avastra-campaign"], ["situations::", "verdicts::"]),
        ([f"src/campaign/{name}.rs" for name in ("episode/precrash", "oracle/avoidable", "oracle/counted")],
         ["avastra-campaign"], ["situations::", "verdicts::", "r157::", "suites::"]),
        (["src/campaign/episode/monitor.rs"], ["avastra-campaign"], ["situations::", "shrinks::", "requirements::"]),
        (["src/campaign/oracle/shrink.rs"], ["avastra-campaign"], ["shrinks::", "sureness::"]),
    ],
    "rules": [
        (["src/lang/model/rules/*.rs", "src/lang/model/memory.rs", "src/world/action/draw.rs"],
         ["avastra-lang", "avastra-world"], ["corpus::", "every_broken", "rules::", "tables::", "told::", "wishes::"]),
        ([f"src/lang/{name}.rs" for name in ("check/rule", "check/scenario_rules", "prove/reach", "prove/realise", "prove/time",
                                             "prove/moment", "prove/witness")],
         ["avastra-lang", "avastra-world"], ["corpus::", "every_broken", "language::", "rules::", "tables::", "wishes::"]),
    ],
}
#: What all crates use has the switch.
BASE = "src/base/lib.rs"
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


def copy_checkout(changed):
    """Brings the copy to the state of the checkout, touching what differs alone; `changed` are files that are written with changes."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    names = set(subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True).stdout.splitlines())
    # Tests read whole folders: what is gone from the checkout must not be there.
    for path in COPY.rglob("*"):
        name = str(path.relative_to(COPY))
        if path.is_file() and not ((ROOT / name).is_file() and name in names):
            path.unlink()
    for name in names - changed:
        source, copy = ROOT / name, COPY / name
        if source.is_file() and not (copy.is_file() and copy.read_bytes() == source.read_bytes()):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)


def write(path, text):
    """Writes a file, unless it has that text: cargo goes by times."""
    if not path.exists() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


class File:
    """A file with some of its changes beside its own code."""

    def __init__(self, name):
        self.name, self.text = name, (ROOT / name).read_text()
        self.digest = hashlib.sha256(self.text.encode()).hexdigest()
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
        write(COPY / self.name, "".join(piece for _, piece in pieces))

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


def build(lot, count, crates):
    """Builds as many changes of the lot as are asked for; gives them, how many did not compile, and the test programs."""
    write(COPY / BASE, (ROOT / BASE).read_text() + SWITCH)
    files, chosen, dropped = {name: File(name) for name in {change["file"] for change in lot}}, {}, 0
    known = json.loads(REFUSED.read_text()) if REFUSED.exists() else {}
    checked = [part for crate in crates for part in ("-p", crate)]
    while True:
        while len(chosen) < count and lot:
            change = lot.pop()
            change["number"] = len(chosen) + dropped + 1
            file = files[change["file"]]
            if file.body(change) is None or known.get(change["name"]) == file.digest:
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
        for number, change in out.items():
            known[change["name"]] = files[change["file"]].digest
            del chosen[number]
        REFUSED.write_text(json.dumps(known))
        dropped += len(out)
    done, messages = cargo("test", "--no-run", "--workspace", "--exclude", "avastra-python")
    if done.returncode != 0:
        sys.exit(f"the tests do not compile:\n{done.stderr[-3000:]}")
    built = (message for message in messages if message.get("reason") == "compiler-artifact" and message.get("executable"))
    programs = {message["target"]["name"]: message["executable"] for message in built if message["profile"]["test"]}
    return list(chosen.values()), dropped, programs


def stages(programs, crates, names):
    """Commands that a change must make fail, and the folders that they run in."""
    folder = {crate: COPY / "src" / crate.removeprefix("avastra-") for crate in crates}
    of_crates = [(folder[crate], [programs[crate.replace("-", "_")]]) for crate in crates]
    return of_crates + [(COPY, [programs["it"], name]) for name in names]


def played(commands, number, limits):
    """`caught` and by which test, `endless`, or `survived`."""
    for (folder, command), limit in zip(commands, limits):
        variables = os.environ | {"MUTANT": str(number), "INSTA_UPDATE": "no", "RUST_TEST_THREADS": "1"}
        settings = {"cwd": folder, "env": variables, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True, "errors": "replace",
                    "start_new_session": True}
        with subprocess.Popen(command, **settings) as tests:
            # With the commands that it has started: an endless one would go on.
            end = lambda: os.killpg(tests.pid, signal.SIGKILL)
            clock = threading.Timer(limit, end)
            clock.start()
            # The first failure is enough.
            lines = (line for line in tests.stdout if line != "running 0 tests\n" or sys.exit(f"no test is called {command[1:]}"))
            failed = next((line for line in lines if re.match(r"test .*FAILED", line)), None)
            is_late = not clock.is_alive()
            clock.cancel()
            if failed is not None:
                end()
        if failed is not None:
            return "caught", failed.split()[1]
        if is_late:
            return "endless", f"{limit:.0f} s"
        if tests.returncode != 0:
            return "caught", f"status {tests.returncode}"
    return "survived", ""


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("subject", choices=SUBJECTS)
    arguments.add_argument("seed", nargs="?", type=int)
    arguments.add_argument("count", nargs="?", type=int, default=20)
    arguments.add_argument("--jobs", type=int, default=2)
    arguments.add_argument("--again", help="numbers of changes that alone are tried")
    given = arguments.parse_args()
    groups = SUBJECTS[given.subject]
    lot = listed([pattern for patterns, _, _ in groups for pattern in patterns])
    files = {change["file"] for change in lot}
    print(f"{len(lot)} changes in {len(files)} files", flush=True)
    if given.seed is None:
        return
    random.Random(given.seed).shuffle(lot)
    copy_checkout({*files, BASE})
    crates = sorted({crate for _, crates, _ in groups for crate in crates})
    changes, dropped, programs = build(lot, given.count, crates)
    if given.again:
        changes = [change for change in changes if str(change["number"]) in given.again.split(",")]
    took = {}
    for _, crates, names in groups:
        for folder, command in stages(programs, crates, names):
            if tuple(command) not in took:
                begin = time.monotonic()
                outcome = played([(folder, command)], 0, [900])
                if outcome[0] != "survived":
                    sys.exit(f"without a change, a test fails: {outcome}")
                took[tuple(command)] = time.monotonic() - begin
    print("tests take " + ", ".join(f"{seconds:.0f} s" for seconds in took.values()), flush=True)

    def tried(change):
        belongs = (group for group in groups if any(fnmatch(change["file"], pattern) for pattern in group[0]))
        _, crates, names = next(belongs)
        commands = stages(programs, crates, names)
        return change, *played(commands, change["number"], [4 * took[tuple(command)] + 20 for _, command in commands])

    counts = Counter()
    with ThreadPoolExecutor(given.jobs) as pool:
        for done in as_completed([pool.submit(tried, change) for change in changes]):
            change, outcome, by = done.result()
            counts[outcome] += 1
            print(f"{outcome:8} {change['number']:3} {change['name']}   {by}", flush=True)
    print(f"{dict(counts)}; {dropped} did not compile beside the others")


main()
