#!/usr/bin/env python3
"""Does a test notice when the enforcement of a rule is changed?

Changes the code that solves, judges and proves rules, one place after the other, and runs the tests that must then
fail. Takes a sample by seed, because each change is a build of its own (a minute on two cores):

    python3 tests/mutants.py            lists how many places there are
    python3 tests/mutants.py 1 20       tries 20 of them, chosen by seed 1
    python3 tests/mutants.py 1 20 src/world/action/draw.rs

It works in the checkout and puts every file back, also when it is interrupted. What survives is printed with its
line. A change that does not compile counts as none and is replaced by another.
"""

import glob
import random
import re
import subprocess
import sys

FILES = [
    "src/lang/model/rules/*.rs",
    "src/lang/model/memory.rs",
    "src/world/action/draw.rs",
    "src/lang/check/rule.rs",
    "src/lang/check/scenario_rules.rs",
    "src/lang/prove/reach.rs",
    "src/lang/prove/realise.rs",
    "src/lang/prove/time.rs",
    "src/lang/prove/moment.rs",
    "src/lang/prove/witness.rs",
]
UNIT_TESTS = ["cargo", "test", "-q", "-p", "avastra-lang", "-p", "avastra-world", "--lib"]
# The cases of diagnostics are asked only where the unit tests notice nothing: they take a build more.
TESTS = [
    [*UNIT_TESTS, "--", "action::", "model::", "prove::", "check::"],
    ["cargo", "test", "--test", "it", "-q", "--", "every_broken_file_has_its_diagnostics"],
]
# A change may make a search endless.
TIMEOUT_S = 300

# What is looked for, and what stands in its place.
CHANGES = [
    (r" < (?=[a-z0-9(])", " <= "),
    (r" <= (?=[a-z0-9(])", " < "),
    (r" > (?=[a-z0-9(])", " >= "),
    (r" >= (?=[a-z0-9(])", " > "),
    (r" == ", " != "),
    (r" != ", " == "),
    (r" && ", " || "),
    (r" \|\| (?=[a-z!(])", " && "),
    (r"\btrue\b", "false"),
    (r"\bfalse\b", "true"),
    (r"(?<=[( ])!(?=[a-z(])", ""),
    (r" \+ (?=[a-z0-9(])", " - "),
    (r" - (?=[a-z0-9(])", " + "),
    (r"\.any\(", ".all("),
    (r"\.all\(", ".any("),
    (r"\.is_none\(\)", ".is_some()"),
    (r"\.is_some\(\)", ".is_none()"),
    (r"\.is_empty\(\)", ".is_empty() == false"),
    (r" &= ", " |= "),
    (r" \+= ", " -= "),
    (r"\.min\(", ".max("),
    (r"\.max\(", ".min("),
]


def places(path):
    """Every change of a file: its line, and the text after it."""
    text = open(path, encoding="utf-8").read()
    code = text.split("#[cfg(test)]")[0]
    found = []
    for pattern, other in CHANGES:
        for match in re.finditer(pattern, code):
            line = code.count("\n", 0, match.start()) + 1
            whole = code.splitlines()[line - 1]
            if whole.lstrip().startswith("//") or "assert" in whole:
                continue
            changed = text[: match.start()] + other + text[match.end() :]
            found.append((path, line, f"`{match.group(0)}` -> `{other}`", whole.strip(), changed))
    return found


def tried(change):
    """`caught`, `survived`, `endless`, or `broken` for a change that does not compile."""
    path, _, _, _, changed = change
    before = open(path, encoding="utf-8").read()
    try:
        open(path, "w", encoding="utf-8").write(changed)
        build = subprocess.run([*UNIT_TESTS, "--no-run"], capture_output=True, check=False)
        if build.returncode != 0:
            return "broken"
        for tests in TESTS:
            if subprocess.run(tests, capture_output=True, timeout=TIMEOUT_S, check=False).returncode != 0:
                return "caught"
        return "survived"
    except subprocess.TimeoutExpired:
        return "endless"
    finally:
        open(path, "w", encoding="utf-8").write(before)


def main():
    patterns = sys.argv[3:] or FILES
    paths = sorted(path for pattern in patterns for path in glob.glob(pattern))
    changes = [change for path in paths for change in places(path)]
    if len(sys.argv) < 3:
        print(f"{len(changes)} places in {len(paths)} files")
        return
    random.Random(int(sys.argv[1])).shuffle(changes)
    results = {}
    for change in changes:
        if sum(results.get(key, 0) for key in ("caught", "survived", "endless")) >= int(sys.argv[2]):
            break
        result = tried(change)
        results[result] = results.get(result, 0) + 1
        path, line, what, whole, _ = change
        print(f"{result:8} {path}:{line} {what}   {whole}", flush=True)
    print(results)


main()
