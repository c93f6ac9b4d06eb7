"""Shrinks variations of recorded failures: kind, harm, priority, recurrence and impact never change unsaid.

    python3 tests/interop/shrinks.py AVASTRA [SEED] [--failures N] [--keep FOLDER] [--minutes M] [--jobs J] [--long]

N failures (30) are recorded: crashes and breaches of four spaces, by `degraded.yaml`, `reactive` and the planted faults. Each
is varied in five ways, and each variation is shrunk:

- `jobs`: as recorded; of each third failure shrunk again, beside another file, with `--jobs 2` and in words: the bytes are the
  same, and the words say what the JSON says
- `number`: one number of one step is up to 5 % larger or smaller, and the scenario is recorded anew (`test --accept`)
- `start`: another seed of the traffic and another phase of the lights, recorded anew
- `replays`: the recurrence is claimed for 5 to 40 replays, not for 20; it stands in where `number` or `start` find none
- `first`: if there is a breach beside the crash, its claims come first; else no recurrence is claimed

A report page tells what the files before and after hold: `shrink` has no part in it. A violation is what differs from what
`shrink` printed, a change of kind, harm, priority or requirement (`shrink` says that it keeps them), a recurrence that falls below
its interval or is no longer sure ("recurs"), one that is told but not claimed or the other way round, and a written file that
`replay` refutes. Ends with status 1 if there is one.

With `--long`, the recurrence before and after is also counted in 100 replays, of the variation `jobs`. The table says how often
the interval that was printed, of 20, does not hold that share.
"""

import argparse
import json
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ARGUMENTS = argparse.ArgumentParser(description=__doc__.split("\n")[0])
ARGUMENTS.add_argument("avastra", type=lambda path: str(Path(path).resolve()))
ARGUMENTS.add_argument("seed", nargs="?", type=int, default=1)
ARGUMENTS.add_argument("--failures", type=int, default=30)
ARGUMENTS.add_argument(
    "--keep",
    type=Path,
    help="a folder for what is made; runs that lie there are taken [default: a temporary one]",
)
ARGUMENTS.add_argument("--minutes", type=float, default=math.inf, help="begin no more variations after that")
ARGUMENTS.add_argument("--jobs", type=int, default=2, help="failures that are tried at a time [default: 2]")
ARGUMENTS.add_argument("--long", action="store_true", help="compare intervals with 100 replays, too")
GIVEN = ARGUMENTS.parse_args()

END = time.monotonic() + 60 * GIVEN.minutes
WAYS = ["jobs", "number", "start", "replays", "first"]
# Episodes on each road: some spaces crash seldom.
SPACES = {"manoeuvres": 15, "avastra45_law": 10, "r157": 5, "deepcollision52": 60}
FAULTS = sorted((ROOT / "scenarios/ads/faults").glob("*.yaml"))
LIMIT_S = 150
# Replays that stand for the truth, in the comparison of intervals.
LONG = 100
# What `shrink` keeps. The first three are printed; the page also knows the rest.
KEPT = ["kind", "harm", "priority", "body", "verb", "class", "counted", "requirement"]


def avastra(*command, limit_s=LIMIT_S):
    """Status, standard output and standard error; the status is `None` beyond the time limit."""
    command = [GIVEN.avastra, *map(str, command)]
    try:
        settings = {"capture_output": True, "text": True, "timeout": limit_s, "cwd": ROOT}
        done = subprocess.run(command, **settings, preexec_fn=lambda: os.nice(5))
    except subprocess.TimeoutExpired:
        return None, "", f"more than {limit_s} s"
    return done.returncode, done.stdout, done.stderr


def told(*command):
    """Status, and the object that a command printed with `--format json`."""
    status, stdout, stderr = avastra(*command, "--format", "json")
    try:
        return status, json.loads(stdout.splitlines()[0])
    except (IndexError, ValueError):
        return status, {"error": stderr.strip() or "nothing was printed"}


def interval(recurrence):
    """The 95 % interval of Wilson, as avastra prints it."""
    k, n = recurrence["recurred"], recurrence["replays"]
    z = 1.959964
    middle, half = (k + z * z / 2) / (n + z * z), z * math.sqrt(k * (n - k) / n + z * z / 4) / (n + z * z)
    return max(0.0, middle - half), min(1.0, middle + half)


def claims(text):
    """Lines with claims."""
    return [line.strip() for line in text.splitlines() if line.strip().startswith("expect ")]


def meant(text):
    """The first finding that is claimed: a number of a road user, or the name of a requirement."""
    for claim in claims(text):
        if found := re.match(r"expect collision with \w+#(\d+)", claim):
            return int(found[1])
        if found := re.match(r"expect (\w+)\.breached", claim):
            return found[1]
    return None


RECURRENCE = re.compile(r"(expect (?:(\w+)\.)?recurrence == )(\d+) / (\d+)((?: with \w+#(\d+))?)")


def claimed_recurrence(text, finding):
    for claim in claims(text):
        found = RECURRENCE.match(claim)
        if found and finding in (found[2], int(found[6]) if found[6] else None):
            return {"recurred": int(found[3]), "replays": int(found[4])}
    return None


def truth(path, page):
    """What a file holds of its first finding, by a report page and by its own claims."""
    status, _, stderr = avastra("report", path, "-o", page)
    if status != 0:
        return {"error": f"report: {stderr.strip()[-200:]}"}
    index = json.loads(page.read_text().split('id="index">')[1].split("</script>")[0])
    page.unlink()
    summary, text = index["scenarios"][0]["summary"], path.read_text()
    finding = meant(text)
    of = {"recurrence": claimed_recurrence(text, finding)}
    if isinstance(finding, str):
        breach = next((one for one in summary["breaches"] if one["requirement"] == finding), None)
        return of | {"requirement": finding, "margin": breach.get("margin")} if breach else {"error": f"no breach of {finding}"}
    hit = [one for one in summary["collisions"] if one["obstacle"] == finding and one["counted"]]
    if not hit:
        return {"error": f"no counted collision with {finding}"}
    one = hit[0]
    same = {name: one[name] for name in ["harm", "priority", "body", "verb", "class", "counted"]}
    return of | same | {"kind": one["precrash"], "impact_mps": one["closing_mps"]}


def failures(work):
    """Paths of recorded failures, of as many runs as can be."""
    ads = [ROOT / "scenarios/ads/degraded.yaml", "reactive"]
    runs = [(space, one) for one in ads for space in SPACES]
    # Each fault on one space in turn, and then on another, until there is enough.
    runs += [(list(SPACES)[(number + turn) % len(SPACES)], fault) for turn in (0, 1) for number, fault in enumerate(FAULTS)]

    def record(number):
        space, ads = runs[number]
        out = work / "runs" / str(number)
        if out.exists():
            return sorted((out / "critical").glob("*.ava"))
        settings = ["--episodes", SPACES[space], "--seed", GIVEN.seed + number, "--jobs", 1]
        avastra("run", f"scenarios/{space}.ava", "--ads", ads, *settings, "--out", out)
        return sorted((out / "critical").glob("*.ava"))

    chosen = []
    first = len(runs) - len(FAULTS)
    for begin, end in ((0, first), (first, len(runs))):
        if len(chosen) >= GIVEN.failures:
            break
        with ThreadPoolExecutor(2) as pool:
            found = list(pool.map(record, range(begin, end)))
        # Crashes first, because only they have a kind and a harm, then breaches. Short ones of each:
        # a longer one takes many times as long to shrink.
        for files in found:
            files.sort(key=lambda file: ("collision" not in meant_all(file), len(file.read_text())))
        while len(chosen) < GIVEN.failures and any(found):
            chosen += [files.pop(0) for files in found if files][: GIVEN.failures - len(chosen)]
    return chosen


def record_anew(path, rng, change):
    """Changes a scenario until it is confirmed with a finding, at most eight times."""
    original = path.read_text()
    for _ in range(8):
        text = change(original, rng)
        if text == original:
            break
        path.write_text(text)
        lawful(path)
        avastra("test", "--accept", path)
        now = path.read_text()
        # A change of what was never reached makes the same drive.
        is_another = not {claim for claim in claims(now) if "trace" in claim} <= set(claims(original))
        if is_another and meant(now) is not None and avastra("replay", path)[0] == 0:
            return True
    path.unlink()
    return False


def lawful(path):
    """Where a rule of the space fixes another number by the changed one, writes what the message says that it must be."""
    for _ in range(4):
        status, _, stderr = avastra("check", path)
        found = re.search(r"-->.*:(\d+):(\d+)\n.*\n.*\n.*must be == ([\d.]+) ", stderr)
        if status == 0 or not found:
            return
        lines = path.read_text().splitlines(keepends=True)
        line, column = int(found[1]) - 1, int(found[2]) - 1
        lines[line] = lines[line][:column] + re.sub(r"[\d.]+", found[3], lines[line][column:], count=1)
        path.write_text("".join(lines))


def another_number(text, rng):
    begin, end = text.index("  steps {"), text.index("  expect ")
    quantity = re.compile(r"(?<=: )-?\d+(?:\.\d+)?(?= (?:m|s|m/s|km/h)\b)")
    numbers = list(quantity.finditer(text, begin, end))
    if not numbers:
        return text
    found = rng.choice(numbers)
    changed = float(found[0]) * rng.uniform(0.95, 1.05)
    return text[: found.start()] + f"{changed:.6f}" + text[found.end() :]


def another_start(text, rng):
    text = re.sub(r"traffic_seed: \d+", f"traffic_seed: {rng.randrange(2**62)}", text)
    return re.sub(r"signal_phase: [\d.]+ s", f"signal_phase: {rng.uniform(0, 60):.3f} s", text)


def other_replays(path, rng):
    """The same scenario, with the recurrence in other replays: `replay` says what it is."""
    replays = rng.choice([5, 8, 12, 30, 40])
    path.write_text(RECURRENCE.sub(lambda found: f"{found[1]}0 / {replays}{found[5]}", path.read_text()))
    _, answer = told("replay", path)
    # In the order of the claims.
    found = [one for one in answer["scenarios"][0]["claims"] if "recurrence" in one["claim"]]
    counts = iter([0 if one["confirmed"] else int(re.search(r"\d+", one["found"])[0]) for one in found])
    path.write_text(RECURRENCE.sub(lambda found: f"{found[1]}{next(counts)} / {replays}{found[5]}", path.read_text()))
    return avastra("replay", path)[0] == 0


def other_first(path):
    text = path.read_text()
    lines = text.splitlines(keepends=True)
    breach = [line for line in lines if re.match(r"\s*expect \w+\.(breached|kept|recurrence)", line)]
    crash = [line for line in lines if "expect collision" in line]
    if breach and crash:
        at = lines.index(next(line for line in lines if line.strip().startswith("expect ")))
        rest = [line for line in lines[at:] if line not in breach]
        lines = lines[:at] + breach + rest
        if isinstance(meant(text), str):
            lines = [line for line in lines if line not in breach]
    else:
        lines = [line for line in lines if not RECURRENCE.match(line.strip())]
    path.write_text("".join(lines))
    return avastra("replay", path)[0] == 0


def varied(file, way, folder, rng):
    """A variation of a failure, or `None`."""
    folder.mkdir(parents=True)
    path = folder / file.name
    path.write_text(file.read_text())
    done = {
        "jobs": lambda: True,
        "number": lambda: record_anew(path, rng, another_number),
        "start": lambda: record_anew(path, rng, another_start),
        "replays": lambda: other_replays(path, rng),
        "first": lambda: other_first(path),
    }[way]()
    return path if done else None


def shrunk_path(path):
    return path.parent / "shrunk" / path.name


def words_hold(words, one):
    """What of the JSON is missing in the words."""
    before, after = one["worth_before"], one["worth"]
    wanted = []
    if after["kind"]:
        first = {"none": "no priority", "ego": "ego first"}.get(after["priority"], "the other first")
        wanted.append(f"kept: {after['kind']}, {after['harm']} harm, {first}")
        wanted.append(f"impact {3.6 * before['impact_mps']:.1f} → {3.6 * after['impact_mps']:.1f} km/h")
    else:
        wanted.append(f"kept: `{one['requirement']}` is breached")
        if before["margin"] is not None:
            wanted.append(f"margin {before['margin']:.2f} → {after['margin']:.2f}")
    if before["recurrence"] and after["recurrence"]:
        both = [(of, *interval(of)) for of in (before["recurrence"], after["recurrence"])]
        shown = [f"{of['recurred']} of {of['replays']} ({low:.2f} to {high:.2f})" for of, low, high in both]
        wanted.append("recurs in " + " → ".join(shown))
    else:
        wanted.append("how often it recurs was not tried")
    return [part for part in wanted if part not in words]


def compare(path, way):
    """Shrinks one file. Returns rows of the table, and violations."""
    rows, bad = Counter(), []
    before = truth(path, path.with_suffix(".html"))
    if "error" in before:
        return rows, [f"before: {before['error']}"]
    status, answer = told("shrink", "--jobs", 1, path)
    if status is None:
        return Counter({"not done in time": 1}), []
    if status != 0 or not answer.get("scenarios"):
        return rows, [f"status {status}: {answer.get('error')} {answer.get('failed', '')}"]
    one = answer["scenarios"][0]
    small = shrunk_path(path)
    after = truth(small, small.with_suffix(".html"))
    if "error" in after:
        return rows, [f"after: {after['error']}"]
    rows["shrunk"] += 1
    rows["crashes" if "kind" in before else "breaches"] += 1
    rows["fewer actions"] += one["actions"] < one["actions_before"]
    # What was printed is what the files hold.
    for name, which, held in (("worth_before", "before", before), ("worth", "after", after)):
        printed = one[name]
        for part in ["kind", "harm", "priority", "impact_mps", "margin", "recurrence"]:
            is_near = part == "margin" and None not in (printed[part], held.get(part)) and abs(printed[part] - held[part]) < 6e-4
            # The page rounds margins to 0.001.
            if printed[part] != held.get(part) and not is_near:
                bad.append(f"{part} {which}: {printed[part]} is printed, {held.get(part)} is so")
    if one["requirement"] != after.get("requirement"):
        bad.append(f"{one['requirement']} is printed, {after.get('requirement')} is so")
    # What is said to be kept is kept.
    for part in KEPT:
        if before.get(part) != after.get(part):
            bad.append(f"{part} became another: {before.get(part)} → {after.get(part)}")
    if avastra("replay", small)[0] != 0 or one["refuted"] != 0:
        bad.append("the written file does not replay as claimed")
    # Changes that were said, for the table.
    if "kind" in before:
        ratio = after["impact_mps"] / max(before["impact_mps"], 1e-9)
        rows["impact changed, and it was said"] += ratio != 1.0
        rows["  by more than a tenth, harder"] += ratio > 1.1
        rows["  by more than a tenth, softer"] += ratio < 0.9
    if before["recurrence"] and after["recurrence"]:
        shares = [of["recurred"] / of["replays"] for of in (before["recurrence"], after["recurrence"])]
        low, high = interval(before["recurrence"])
        rows["recurrence tried"] += 1
        rows["recurrence changed, and it was said"] += shares[0] != shares[1]
        if shares[1] < low - 1e-9:
            bad.append(f"the recurrence fell below its interval: {before['recurrence']} → {after['recurrence']}")
        if low > 0.5 >= interval(after["recurrence"])[0]:
            bad.append(f"it recurs no longer: {before['recurrence']} → {after['recurrence']}")
        rows["  to more than the interval before"] += shares[1] > high
    else:
        rows["recurrence not claimed, and so it was said"] += 1
    if meant_all(path) - meant_all(small):
        rows["another finding of the file is gone, of which nothing is said"] += 1
    return rows, bad, one


def meant_all(path):
    """What kinds of finding a file claims: collision, and names of requirements."""
    found = re.findall(r"expect (collision)|expect (\w+)\.breached", path.read_text())
    return {one or other for one, other in found}


def long_count(path):
    """The recurrence of the first finding in LONG replays."""
    text = path.read_text()
    finding = meant(text)
    copy = path.with_name("long_" + path.name)
    copy.write_text(RECURRENCE.sub(lambda found: f"{found[1]}0 / {LONG}{found[5]}", text))
    _, answer = told("replay", copy)
    copy.unlink()
    for one in answer.get("scenarios", [{}])[0].get("claims", []):
        name = rf"{finding}\.recurrence " if isinstance(finding, str) else rf"recurrence .*#{finding}$"
        if re.match(name, one["claim"]):
            return 0 if one["confirmed"] else int(re.search(r"\d+", one["found"])[0])
    return None


def try_failure(work, number, file, seed):
    """All variations of one failure."""
    rng = random.Random(seed)
    rows, bad, shrunk = Counter(), [], {}
    paths = {}
    for way in WAYS:
        if time.monotonic() > END:
            break
        path = paths[way] = varied(file, way, work / "tried" / str(number) / way, rng)
        if path is None:
            # What always can be varied stands in.
            rows[f"`replays` again, because none was found by `{way}`"] += 1
            path = paths[way] = varied(file, "replays", work / "tried" / str(number) / f"{way}_again", rng)
        if path is None:
            rows[f"no variation by `{way}`"] += 1
            continue
        rows["variations"] += 1
        more, violations, *one = compare(path, way)
        rows += more
        bad += [(path, violation) for violation in violations]
        if one:
            shrunk[way] = one[0]
    # The same in words, with other jobs, and beside another file.
    pair = [way for way in ("jobs", "number") if way in shrunk and paths[way].parent.name == way]
    if pair and number % 3 == 0 and time.monotonic() < END:
        written = {way: shrunk_path(paths[way]).read_bytes() for way in pair}
        both = [paths[way] for way in pair]
        status, stdout, stderr = avastra("shrink", "--jobs", 2, *both)
        said = (stdout + stderr).splitlines()
        if status is None:
            rows["not done in time"] += 1
        for way in pair if status is not None else []:
            path = paths[way]
            rows["shrunk again with `--jobs 2`, and compared in words"] += 1
            if shrunk_path(path).read_bytes() != written[way]:
                bad.append((path, "other jobs write other bytes"))
            at = next((at for at, line in enumerate(said) if f"/{way}/shrunk/" in line), None)
            missing = words_hold(said[at + 1], shrunk[way]) if at is not None else ["anything"]
            bad += [(path, f"the words do not say `{part}`") for part in missing]
    if GIVEN.long and "jobs" in shrunk:
        for name, path in (("worth_before", paths["jobs"]), ("worth", shrunk_path(paths["jobs"]))):
            told_of, count = shrunk["jobs"][name]["recurrence"], long_count(path)
            if told_of and count is not None:
                when = "before" if name == "worth_before" else "after"
                low, high = interval(told_of)
                rows[f"interval {when} compared with {LONG} replays"] += 1
                rows[f"  {when}: the truth is below it"] += count / LONG < low
                rows[f"  {when}: the truth is above it"] += count / LONG > high
    print(f"{number}: {file.relative_to(work)}: {dict(rows)}, {bad}", file=sys.stderr, flush=True)
    return rows, bad


def main():
    rng = random.Random(GIVEN.seed)
    with tempfile.TemporaryDirectory() as temporary:
        work = GIVEN.keep.resolve() if GIVEN.keep else Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        (work / "runs").mkdir(exist_ok=True)
        shutil.rmtree(work / "tried", ignore_errors=True)
        files = failures(work)
        seeds = [rng.randrange(2**32) for _ in files]
        with ThreadPoolExecutor(GIVEN.jobs) as pool:
            done = list(pool.map(lambda of: try_failure(work, *of), zip(range(len(files)), files, seeds)))
    rows = sum((rows for rows, _ in done), Counter({"failures": len(files)}))
    bad = [one for _, all_bad in done for one in all_bad]
    for name, count in rows.items():
        print(f"{count:5}  {name}")
    print(f"{len(bad):5}  violations")
    for path, violation in bad:
        print(f"{violation}\n    {GIVEN.avastra} shrink --format json {path}")
    # Without `--keep` the files of violations are gone: the seed makes them again.
    sys.exit(1 if bad or not rows["shrunk"] else 0)


if __name__ == "__main__":
    main()
