"""Prints a row for each of many maps; see gallery.sh.

Arguments: the avastra binary, a directory for maps, and folders with further maps. A map's routes begin on lanes
outside junctions, drawn with the map's name as seed, and follow links for up to 250 m. Every driver drives
ROUTES of them alone, in EPISODES episodes of other moments of the lights' cycles each. Exit status 1 if a map does
not load, a pose differs, a light holds no lane, or a driver crashes or does not arrive.

Poses are compared as in maps.py, except on roads of which something was repaired (a corner rounded, a lane cut
short): these repairs are counted.
"""

import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import maps

DRIVERS = ["modular", "frenet", "reactive", "idm"]
ROUTES = int(os.environ.get("ROUTES", "5"))
EPISODES = int(os.environ.get("EPISODES", "8"))
GENERATED = {
    f"{kind} {seed}": f"{options} --seed {seed}"
    for seed in range(1, 7)
    for kind, options in {
        "town": "--rand --rand.iterations 25",
        "lights": "--rand --rand.iterations 30 -L 2 --tls.guess true --tls.guess.threshold 20",
        "left-hand": "--rand --rand.iterations 20 --lefthand -L 2",
        "lanes": "--rand --rand.iterations 30 -L 3 --rand.random-lanenumber --random-type",
        "grid": f"--grid --grid.number {seed + 1} --grid.length {60 + 20 * seed} -L {1 + seed % 3}",
        "spider": f"--spider --spider.arm-number {seed + 2} --spider.circle-number 2 --spider.space-radius 80",
    }.items()
}
# The road of a warning about a repair.
REPAIRED = re.compile(r"road `([^`]*)`.*(?:rounded|cut short|left out)")
SPACE = """language 1
state rested: Bool = true
action rest() {{ set rested = true }}
road r {{
  map: {map}
  start: lane {start}
  goal: lane {goal}
}}
episode {{ stop: arrived or stalled >= 4 }}
"""


def ran(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=600)
    return done.returncode, done.stdout, done.stderr


def convert(directory):
    """The networks of SUMO's package and those of its generator, as OpenDRIVE."""
    home = Path(maps.sumo.SUMO_HOME)
    networks = {path.name.split(".")[0] + " " + path.parent.name: path for path in sorted(home.rglob("*.net.xml"))}
    for title, options in GENERATED.items():
        networks[title] = directory / f"{title.replace(' ', '_')}.net.xml"
        if not networks[title].exists():
            ran(home / "bin/netgenerate", *options.split(), "-o", networks[title])
    for title, network in networks.items():
        xodr = directory / f"{title.replace(' ', '_')}.xodr"
        if not xodr.exists():
            ran(home / "bin/netconvert", "-s", network, "--opendrive-output", xodr)
        # Networks for trams or for people on foot have no street.
        if xodr.exists() and 'type="driving"' in xodr.read_text():
            yield title, xodr


def place(lane, station_m):
    """A place on a lane, in the language; near its end stations of the road are interpolated."""
    stations = [pose[:2] for pose in lane["poses"]]
    s = next(s for at, s in stations if at >= station_m - 1e-6)
    road = json.dumps(lane["key"]["road"])
    return f'{road}/{lane["key"]["lane"]} at {s:.3f} m'


def routes(town, draw, wanted):
    """Starts and goals: places on lanes, up to 250 m apart."""
    key = lambda lane: (lane["road"], lane["section"], lane["lane"])
    lanes = {key(lane["key"]): lane for lane in town["lanes"]}
    starts = [lane for lane in town["lanes"] if lane["junction"] is None and lane["length_m"] > 25]
    for lane in draw.sample(starts, min(len(starts), 4 * wanted)):
        start, before_m = place(lane, 4.0), -4.0
        while before_m + lane["length_m"] < 250 and lane["successors"]:
            before_m += lane["length_m"]
            lane = lanes[key(draw.choice(lane["successors"]))]
        goal_m = min(lane["length_m"] - 8.0, 250.0 - before_m)
        if lane["junction"] is None and goal_m > 4.0 and before_m + goal_m > 40:
            yield start, place(lane, goal_m)


def drive(avastra, path, town, title, directory):
    """Episodes, arrivals, contacts and stalls of all drivers, and what went wrong first."""
    totals, wrong = dict.fromkeys(["episodes", "arrived", "collisions", "stalled"], 0), ""
    done = 0
    for start, goal in routes(town, random.Random(title), ROUTES):
        if done == ROUTES:
            break
        space = directory / "space.ava"
        space.write_text(SPACE.format(map=json.dumps(str(path.resolve())), start=start, goal=goal))
        if ran(avastra, "check", space)[0] != 0:
            continue
        done += 1
        for driver in DRIVERS:
            out = directory / "run"
            subprocess.run(["rm", "-rf", str(out)], check=True)
            code, stdout, stderr = ran(
                avastra, "run", space, "--agent", "none", "--ads", driver, "--episodes", EPISODES, "--out", out, "--format", "json"
            )
            result = json.loads(stdout.splitlines()[-1]) if stdout.strip() else {}
            found = result.get("totals", result)
            totals["episodes"] += EPISODES
            for name in ("arrived", "collisions", "stalled"):
                totals[name] += found.get(name, 0)
            if code != 0 or found.get("arrived") != EPISODES:
                wrong = wrong or f"{driver} from {start} to {goal} {stderr.strip()[:80]}"
    return totals, wrong


def main():
    avastra, directory = Path(sys.argv[1]), Path(sys.argv[2])
    directory.mkdir(parents=True, exist_ok=True)
    found = list(convert(directory))
    for folder in sys.argv[3:]:
        found += [(path.stem, path) for path in sorted(Path(folder).glob("*.xodr"))]
    print(
        f"{'map':32} {'lanes':>6} {'CARLA':>7} {'mm':>7} {'deg':>7} {'TUM':>6} {'mm':>7} {'deg':>7} {'links':>6} {'differ':>6}"
        f" {'lights':>9} {'repairs':>7} {'arrived':>9} {'contacts':>8} {'stalls':>6}"
    )
    failures = 0
    sums = dict.fromkeys(["maps", "held", "lights", "episodes", "arrived", "collisions", "stalled"], 0)
    for title, path in found:
        code, stdout, stderr = ran(avastra, "road", path, "--format", "json")
        if code != 0:
            failures += 1
            print(f"{title[:32]:32} does not load: {stderr.strip()[:120]}", flush=True)
            continue
        town = json.loads(stdout.splitlines()[-1])
        lights = [signal for signal in town["signals"] if signal["for_vehicles"]]
        held = sum(1 for signal in lights if signal["lanes"])
        repairs = sum(1 for warning in town["warnings"] if "rounded" in warning or "left out" in warning or "cut short" in warning)
        try:
            repaired = {found for warning in town["warnings"] for found in REPAIRED.findall(warning)}
            tally = maps.compare(title, path, avastra, repaired)
            poses = (
                f"{tally.poses:7} {tally.position_m * 1000:7.3f} {tally.heading_deg:7.4f} {tally.second:6}"
                f" {tally.second_m * 1000:7.3f} {tally.second_deg:7.4f} {tally.links:6} {tally.mismatches:6}"
            )
            exact = tally.ok()
        except Exception as error:  # noqa: BLE001
            # What the readers raise is theirs: CARLA's wants small numbers as ids, among others.
            poses, exact = f"{'not compared: ' + str(error)[:36]:>54}", True
        totals, wrong = drive(avastra, path, town, title, directory)
        sums["maps"] += 1
        sums["held"] += held
        sums["lights"] += len(lights)
        for name in totals:
            sums[name] += totals[name]
        good = exact and held == len(lights) and totals["arrived"] == totals["episodes"] and totals["collisions"] == 0
        failures += not good
        arrivals = f"{totals['arrived']}/{totals['episodes']}"
        print(
            f"{title[:32]:32} {len(town['lanes']):6} {poses} {f'{held}/{len(lights)}':>9} {repairs:7} {arrivals:>9}"
            f" {totals['collisions']:8} {totals['stalled']:6}  {'ok' if good else wrong}",
            flush=True,
        )
    print(
        f"{sums['maps']} maps: {sums['held']} of {sums['lights']} lights hold lanes; {sums['arrived']} of {sums['episodes']}"
        f" episodes arrive, {sums['collisions']} contacts, {sums['stalled']} stalls"
    )
    sys.exit(1 if failures else 0)


main()
