"""Does the interval of an estimate hold what it promises, in the simulator? Does `estimate --than` see weaker brakes, and how soon?
What is gained where crashes are rarer still?

    python3 tests/interop/coverage.py AVASTRA [FOLDER] [REPEATS] [EPISODES]

Coverage: one estimate of a rare crash is made REPEATS times (200), each with a seed of its own, in two parts of EPISODES (250),
and each with an interval of 95 %. With 50 episodes an estimate rests on one event or none, and no exact interval is narrow. The
truth is not known; it is taken from all repeats together, whose error is a fourteenth of one's, and is held against counting.
Between 92 and 98 % of the intervals should have it: with 200 repeats, chance alone takes a right one out of that range once in
sixteen times.

Brakes: the driving system against itself with brakes that are 10 % weaker, in the same episodes (`estimate --than`) and by counting
each on its own. What is printed is how many kilometres each needs to tell them apart.

Rarer: the same crash where chance does nothing 10 and 250 times as often, and how much longer counting would take for an
interval as narrow.
"""

import json
import math
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AVASTRA = str(Path(sys.argv[1]).resolve())
FOLDER = Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "target/interop/coverage").resolve()
REPEATS = int(sys.argv[3]) if len(sys.argv) > 3 else 200
EPISODES = int(sys.argv[4]) if len(sys.argv) > 4 else 250
# Two steps an episode, in which chance mostly does nothing.
SPACE = """language 1
use "{root}/scenarios/avastra45.ava"
state quiet: Bool = false
action nothing() {{ set quiet = false }}
odds actions {{ nothing => {nothing} }}
override episode {{ roads: [corner], limit: 2 steps }}
"""
NOTHING = (40, 400, 10000)
CRASHES = ["--ads", "reactive", "--traffic", "released", "--event", "collision"]
WEAKER = "control: { actuators: { brake_mps2_max: 7.65 } }\n"
# Of 8.5 m/s², see scenarios/ads/default.yaml.
COMPARED = ["--event", "collision", "--traffic", "released", "--episodes", "1500"]


def avastra(*arguments):
    line = [AVASTRA, *map(str, arguments), "--jobs", "1", "--format", "json"]
    ended = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 0, f"{line}: {ended.returncode}: {ended.stderr}{ended.stdout}"
    return json.loads(ended.stdout.splitlines()[-1])


def estimate(space, name, *how):
    """The result for all roads; kept, so that the script can be killed and goes on."""
    out = FOLDER / name
    if not (out / "results.json").exists():
        begun = ["--resume", out] if (out / "estimate.yaml").exists() else [space, *CRASHES, *how, "--out", out]
        avastra("estimate", *begun)
    return json.loads((out / "results.json").read_text())["together"]


def rare(nothing):
    """The space in which chance does nothing so many times as often as any other row."""
    space = FOLDER / f"rare_{nothing}.ava"
    space.write_text(SPACE.format(root=ROOT, nothing=nothing))
    return space


def rarer():
    for nothing in NOTHING:
        found = estimate(rare(nothing), f"rarer_{nothing}", "--method", "probe", "--parts", 10, "--episodes", 200)
        low, high = found["interval"]["low"], found["interval"]["high"]
        print(f"nothing => {nothing}: {found['probability']:.3g} [{low:.3g}, {high:.3g}] in {found['simulated_h']:.0f} h, "
              f"{found['gain']:.1f} times less than counting")


def coverage():
    space = rare(NOTHING[0])
    how = ["--method", "probe", "--parts", 2, "--episodes", EPISODES]
    found = []
    for seed in range(1, REPEATS + 1):
        found.append(estimate(space, f"probe_{EPISODES}/{seed}", *how, "--seed", seed))
        if seed % 20 == 0:
            print(f"{seed} of {REPEATS} repeats", flush=True)
    means = [one["probability"] for one in found]
    truth = sum(means) / len(means)
    error = math.sqrt(sum((mean - truth) ** 2 for mean in means) / (len(means) - 1) / len(means))
    holds = sum(one["interval"]["low"] <= truth <= one["interval"]["high"] for one in found)
    above = sum(one["interval"]["low"] > truth for one in found)
    share = 100 * holds / len(found)
    print(f"all repeats together: {truth:.3g}, give or take {error:.2g}; {sum(mean == 0 for mean in means)} found nothing")
    counted = estimate(space, "count", "--method", "count", "--parts", 50, "--episodes", 1000, "--seed", 9)
    low, high = counted["interval"]["low"], counted["interval"]["high"]
    print(f"counting {counted['episodes']} episodes: {counted['probability']:.3g} [{low:.3g}, {high:.3g}]")
    print(f"coverage: {holds} of {len(found)} intervals have it, {share:.1f} %; {above} lie above it")
    return 92 <= share <= 98 and low <= truth + 2 * error and truth - 2 * error <= high


def brakes():
    profile = FOLDER / "weaker_brakes.yaml"
    profile.write_text(WEAKER)
    found = avastra("estimate", ROOT / "scenarios/avastra45.ava", "--ads", ROOT / "scenarios/ads/default.yaml", "--than", profile, *COMPARED)
    results = found["results"]
    probabilities, kilometres = results["probability"], results["driven_km"]
    print(f"{results['episodes']} pairs of episodes: {probabilities} of them with a collision over {kilometres} km")
    print(f"alike {results['both']}, alone {results['first_only']} and {results['second_only']}, p {results['p']:.3g}, "
          f"told apart after {results['told_apart_km']} km of both together")
    # Two independent proportions differ with 95 % confidence and 80 % power after so many episodes each.
    first, second = probabilities
    if first == second:
        print("no difference to tell apart by counting either")
        return
    each = (1.96 + 0.84) ** 2 * (first * (1 - first) + second * (1 - second)) / (first - second) ** 2
    paired = (results["first_only"] + results["second_only"]) / results["episodes"]
    of_pairs = (1.96 + 0.84) ** 2 * paired / (first - second) ** 2
    km = sum(kilometres) / results["episodes"]
    print(f"from these rates, with 80 % power: {of_pairs * km:.0f} km in the same episodes, {each * km:.0f} km by counting "
          f"each on its own: {each / of_pairs:.1f} times as many")


FOLDER.mkdir(parents=True, exist_ok=True)
holds = coverage()
brakes()
rarer()
sys.exit(0 if holds else 1)
