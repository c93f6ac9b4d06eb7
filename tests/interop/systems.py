"""What avastra finds of driving systems that others wrote: `systems.py AVASTRA OUT [--episodes N] [--shards N] NAME…`.

Each NAME is an adapter of python/adapters, as `run.sh` takes it. It drives each road alone and in light traffic, meets random actions under the law,
random manoeuvres, and rows of the catalogue. OUT keeps the runs, and what was measured as JSON. What is there is not measured again, also with
other options, so a call that names all systems prints the table of all. Installing needs the network.
"""

import argparse
import collections
import json
import math
import os
import pathlib
import resource
import sqlite3
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Of each part: the space, and how it is played.
PARTS = {
    "law": ("avastra45_law.ava", ["--episodes"]),
    "manoeuvres": ("manoeuvres.ava", ["--episodes"]),
    "pre_crash": ("catalogue/pre_crash.ava", ["--agent", "every-row"]),
    "euro_ncap": ("catalogue/euro_ncap_vulnerable.ava", ["--agent", "every-row", "--shard"]),
}


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def called(command, out):
    """The JSON that a command prints, with its processor time; kept in `out`."""
    if out.exists():
        return json.loads(out.read_text())
    used = cpu_s()
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode in (1, 2) or not done.stdout.startswith("{"):
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    found = {**json.loads(done.stdout), "cpu_s": cpu_s() - used}
    out.write_text(json.dumps(found))
    return found


def profile(name):
    """Installs an adapter, if it is not there, and writes its profile."""
    asked = ["sh", str(ROOT / "python/adapters/run.sh"), name]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


def measured(name, options):
    """The JSON of each part for a driving system."""
    out = options.out / name.replace(":", "_")
    out.mkdir(parents=True, exist_ok=True)
    asked = ["--format", "json", "--ads", profile(name)]
    parts = {"check": called([options.avastra, "ads", "check", "--drive=10", *asked], out / "check.json")}
    for part, (space, how) in PARTS.items():
        number = {"--episodes": [str(options.episodes)], "--shard": [f"1/{options.shards}"]}.get(how[-1], [])
        play = [options.avastra, "run", str(ROOT / "scenarios" / space), *how, *number, "--jobs", str(options.jobs)]
        parts[part] = called([*play, *asked, "-o", str(out / part)], out / f"{part}.json")
    scenarios = [str(file) for part in PARTS for file in parts[part]["critical"]]
    if scenarios:
        careful = ["--ads", profile(f"{name.partition(':')[0]}:careful"), "--format", "json"]
        parts["careful"] = called([options.avastra, "test", *scenarios, *careful], out / "careful.json")
    return parts


def recurs(recurred, replays):
    """Whether the 95 % interval of avastra's sequential test lies above one half: `run.db` has the counts, but not the verdict."""
    def beta(a, b):
        return math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)

    mixed = beta(recurred + 0.5, replays - recurred + 0.5) - beta(0.5, 0.5)
    return 2 * recurred > replays and mixed - replays * math.log(0.5) >= math.log(20.0)


def failures(parts):
    """The failures that recur, as (kind, part, road, episode). A kind is a pre-crash type without road, or a requirement.

    A protocol counts every collision. A failure is one that a careful driver avoids, that the ego vehicle makes, and in which it had no priority;
    wrecks of other crashes and "other" are none. A breach is one that a careful driver keeps. It is no second failure if the same road user was hit.
    """
    found = []
    for part in PARTS:
        run = sqlite3.connect(f"file:{parts[part]['directory']}/run.db?mode=ro", uri=True)
        collisions = run.execute(
            "SELECT precrash, road, episode, obstacle, recurred, replays FROM collision JOIN episode USING (episode) WHERE collision.counted"
            " AND avoidability = 'avoidable' AND priority <> 'ego' AND NOT struck AND NOT sudden AND NOT repeated"
            " AND precrash_number IS NOT NULL AND precrash <> 'other' AND replays IS NOT NULL")
        hits = [hit for hit in collisions if recurs(*hit[4:])]
        breaches = run.execute("SELECT requirement, road, episode, obstacle, min(recurred), min(replays) FROM breach JOIN episode USING (episode)"
                               " WHERE replays IS NOT NULL AND kept_by <> '' GROUP BY episode, requirement")
        hit = {(episode, obstacle) for _, _, episode, obstacle, *_ in hits}
        broken = [breach for breach in breaches if recurs(*breach[4:]) and breach[2:4] not in hit]
        found += [(kind, part, road, episode) for kind, road, episode, *_ in hits + broken]
    return found


def careful(parts, found):
    """How the scenarios with a failure end with the careful planner."""
    wanted = {(part, f"{road}_{episode:04}") for _, part, road, episode in found}
    outcomes = collections.Counter()
    for scenario in parts.get("careful", {"scenarios": []})["scenarios"]:
        file = pathlib.Path(scenario["file"])
        if (file.parent.parent.name, file.stem) in wanted:
            outcomes[scenario["outcome"]] += 1
    return f"{outcomes['passed']}, {outcomes['still fails']}, {outcomes['changed']}"


def column(parts, found):
    """What the table says of a driving system with these failures."""
    alone, among = parts["check"]["drives"]
    breaches = ", ".join(f"{breach['times']} × `{name}`" for name, breach in alone["breaches"].items()) or "none"
    yield "arrived alone, and among six vehicles, of 40", f"{alone['arrived']}, {among['arrived']}"
    yield "breaches alone", breaches
    yield "beside the route, median and 99 of 100", "{median:.2f}, {most_of_99:.2f} m".format(**alone["beside_m"])
    yield "answer, median and 99 of 100", "{:.1f}, {:.0f} ms".format(*(1e3 * parts["law"]["thinking"][key] for key in ("median_s", "most_of_99_s")))
    for part in PARTS:
        totals = parts[part]["totals"]
        yield f"{part}: episodes", totals["episodes"]
        yield f"{part}: counted, breached", f"{totals['counted']}, {totals['episodes_with_breach']}"
        yield f"{part}: findings that recur", f"{totals['recurring']} of {totals['replayed']}"
    yield "recurring failures, kinds", f"{len(found)}, {len({kind for kind, *_ in found})}"
    yield "the careful planner avoids, fails, other course", careful(parts, found)
    yield "CPU min", round(sum(part["cpu_s"] for part in parts.values()) / 60)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("avastra")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--episodes", type=int, default=30, help="episodes on each of four roads")
    parser.add_argument("--shards", type=int, default=6, help="of the 151 rows of Euro NCAP, one in so many")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    options.avastra = os.path.abspath(options.avastra)
    measures = {name: measured(name, options) for name in options.names}
    found = {name: failures(parts) for name, parts in measures.items()}
    columns = {name: dict(column(parts, found[name])) for name, parts in measures.items()}
    print("|", *(f"| `{name}`" for name in columns), "|")
    print("|---" * (len(columns) + 1) + "|")
    for row in next(iter(columns.values())):
        print("|", row, *(f"| {values[row]}" for values in columns.values()), "|")
    total, once = collections.Counter(), 0
    for name in found:
        kinds = collections.Counter(kind for kind, *_ in found[name])
        total += kinds
        once += len(kinds)
        print(f"\n{name}: {sum(kinds.values())} of {len(kinds)} kinds:", "; ".join(f"{count} × {kind}" for kind, count in kinds.most_common()))
    print(f"\nall: {sum(total.values())} of {len(total)} kinds; {once} if each kind counts once a system")


if __name__ == "__main__":
    main()
