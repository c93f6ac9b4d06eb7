"""What each finder finds in the same simulated time, everything charged: `finders.py AVASTRA CELLS [--hours H] [--repeats N] [--drivers NAME;…] [--finders NAME,…]`.

Each finder searches a space for so many simulated hours against each driving system, in independent repetitions (seeds 1 to N). What it finds while it
learns counts; nothing is played after it. A run ends after whole rounds, so it plays some minutes more. A cell is the number of kinds of failures that recur, and the processor time with all judging and replays.
CELLS is a file of JSON lines: cells that it has, under the same engine, are not played again. The tables are printed in Markdown.
"""

import argparse
import collections
import itertools
import json
import math
import os
import pathlib
import re
import resource
import statistics
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
FAULTS = ROOT / "scenarios/ads/faults"
#: Of each finder: the command and its options.
FINDERS = {
    "random": ("run", "--agent", "random"),
    "random-raw": ("run", "--agent", "random-raw"),
    "space-filling": ("run", "--agent", "space-filling"),
    "constant": ("train", "--agent", "constant"),
    "bandit": ("train", "--agent", "bandit"),
    "deep_collision": ("train", "--agent", "deep_collision"),
    "ddqn": ("train", "--agent", "ddqn"),
}
#: Of each driving system: the space, and what `--ads` gets.
DRIVERS = {
    "reactive": ("avastra45_law.ava", "reactive"),
    "frenet": ("manoeuvres.ava", "frenet"),
    "never yields": ("avastra45.ava", FAULTS / "planning_never_yields.yaml"),
    "flickers": ("avastra45.ava", FAULTS / "perception_flicker.yaml"),
    "dirty sensors": ("manoeuvres.ava", ROOT / "scenarios/ads/degraded.yaml"),
}
COMPARED = ";".join(DRIVERS)
#: The same driving systems in the paper's space under the law, and in the town.
DRIVERS |= {
    f"{ads}, {space}": (f"{space}.ava", ads)
    for ads in ("reactive", "idm", "modular") for space in ("avastra45_law", "town")
}
BASELINES = ("random", "bandit")


def played(avastra, driver, finder, seed, hours):
    """The cell of a repetition."""
    space, ads = DRIVERS[driver]
    command, *agent = FINDERS[finder]
    how = ["--jobs", "1"] if command == "run" else ["--evaluate", "0"]
    with tempfile.TemporaryDirectory() as scratch:
        asked = [avastra, command, ROOT / "scenarios" / space, "--ads", ads, "--hours", str(hours), "--seed", str(seed)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([*asked, *agent, *how, "--format", "json", "-o", f"{scratch}/run"], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{done.args}\n{done.stdout}{done.stderr}")
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        found = json.loads(done.stdout.splitlines()[-1])
    return {
        "driver": driver, "finder": finder, "seed": seed, "hours": hours,
        "kinds": sorted(kind["kind"] for kind in found["left"]["kinds"]), "simulated_h": round(found["left"]["simulated_h"], 3),
        "counted": found["totals"]["counted"], "episodes": found["totals"]["episodes"],
        "cpu_s": round(used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime, 1),
    }


def superiority(first, second):
    """Â12: how probable it is that a value of the first is larger."""
    return sum((one > other) + 0.5 * (one == other) for one in first for other in second) / len(first) / len(second)


def rank_p(first, second):
    """The two-sided p of Mann and Whitney's test, by the normal distribution with ties."""
    n, m = len(first), len(second)
    ties = sum(count**3 - count for count in collections.Counter(first + second).values())
    spread = math.sqrt(n * m / 12 * (n + m + 1 - ties / ((n + m) * (n + m - 1))))
    distance = abs(superiority(first, second) * n * m - n * m / 2) - 0.5
    return 1.0 if spread == 0 else min(1.0, math.erfc(max(0.0, distance) / spread / math.sqrt(2)))


def holm(p):
    """The values after Holm's correction."""
    corrected, largest = [0.0] * len(p), 0.0
    for rank, place in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        largest = max(largest, min(1.0, (len(p) - rank) * p[place]))
        corrected[place] = largest
    return corrected


def table(cells):
    """The tables in Markdown."""
    of = collections.defaultdict(list)
    for cell in cells:
        of[cell["driver"], cell["finder"]].append(cell)
    drivers = [driver for driver in DRIVERS if any(key[0] == driver for key in of)]
    finders = [finder for finder in FINDERS if any(key[1] == finder for key in of)]
    lines = [f"| finder | {' | '.join(drivers)} |", "|---|" + "--:|" * len(drivers)]

    def row(finder, text):
        entries = [text(of[driver, finder]) if of[driver, finder] else "-" for driver in drivers]
        return f"| `{finder}` | {' | '.join(entries)} |"

    def kinds(own):
        counts = [len(cell["kinds"]) for cell in own]
        cpu_h = sum(cell["cpu_s"] for cell in own) / 3600
        together = len(set(itertools.chain.from_iterable(cell["kinds"] for cell in own)))
        return f"{statistics.mean(counts):.1f} ({min(counts)} to {max(counts)}); {together}; {sum(counts) / cpu_h:,.0f}"

    lines += [row(finder, kinds) for finder in finders]
    pairs = [
        (finder, base, driver)
        for base in BASELINES for finder in finders for driver in drivers
        if finder != base and of[driver, finder] and of[driver, base]
    ]
    samples = {key: [len(cell["kinds"]) for cell in own] for key, own in of.items()}
    both = [(samples[driver, finder], samples[driver, base]) for finder, base, driver in pairs]
    plain = [rank_p(*pair) for pair in both]
    corrected = dict(zip(pairs, holm(plain)))
    effect = dict(zip(pairs, (superiority(*pair) for pair in both)))
    lines += ["", f"| comparison | {' | '.join(drivers)} |", "|---|" + "--:|" * len(drivers)]
    for base in BASELINES:
        for finder in finders:
            entries = [
                f"{effect[finder, base, driver]:.2f} (p {corrected[finder, base, driver]:.3f})" if (finder, base, driver) in effect else "-"
                for driver in drivers
            ]
            if finder != base:
                lines.append(f"| `{finder}` / `{base}` | {' | '.join(entries)} |")
    told = [f"`{finder}` / `{base}` on {driver} (p {p:.3f})" for (finder, base, driver), p in zip(pairs, plain) if p < 0.05]
    lines += ["", f"Without the correction, p is below 0.05 for: {'; '.join(told)}"]
    for driver in drivers:
        episodes = {finder: statistics.mean(cell["episodes"] for cell in of[driver, finder]) for finder in finders if of[driver, finder]}
        lines.append(f"Episodes on {driver}: " + ", ".join(f"{finder} {count:.0f}" for finder, count in episodes.items()))
    lines.append(f"{sum(cell['cpu_s'] for own in of.values() for cell in own) / 60:.0f} minutes of a processor")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("avastra")
    parser.add_argument("cells", type=pathlib.Path)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--drivers", default=COMPARED)
    parser.add_argument("--finders", default=",".join(FINDERS))
    options = parser.parse_args()
    engine = re.search(r"\w+/\d+", subprocess.run([options.avastra, "--version"], check=True, capture_output=True, text=True).stdout)[0]
    known = [json.loads(line) for line in options.cells.read_text().splitlines()] if options.cells.exists() else []
    is_asked = lambda cell: (cell["engine"], cell["hours"]) == (engine, options.hours)  # noqa: E731
    others = [cell for cell in known if not is_asked(cell)]
    cells = {(cell["driver"], cell["finder"], cell["seed"]): cell for cell in known if is_asked(cell)}
    wanted = itertools.product(range(1, options.repeats + 1), options.drivers.split(";"), options.finders.split(","))
    for seed, driver, finder in wanted:
        if (driver, finder, seed) not in cells:
            cells[driver, finder, seed] = {"engine": engine, **played(os.path.abspath(options.avastra), driver, finder, seed, options.hours)}
            options.cells.write_text("".join(json.dumps(cell) + "\n" for cell in [*others, *cells.values()]))
    print(table(cells.values()))


if __name__ == "__main__":
    main()
