"""Do others drive in avastra as in esmini?

Arguments: the program, esmini, the number of variations of each file of variations, and folders that hold `.xosc` files. Each file that
avastra imports, with each of the chosen variations, is played by both with an ego vehicle that keeps its speed (`blind.py`). Says for each
by how much the middles of all others differ: the part of the ticks within 0.3 m, the greatest difference, and how far apart in time they
begin to do something (the speed has changed by 0.2 m/s, or the place across the first heading changes by 0.02 m/s). Compared is up to the first
contact of the ego vehicle, because a contact moves nobody in esmini, and as long as the ego vehicles are within 0.5 m of each other.
"""

import csv
import itertools
import math
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

HERE = Path(__file__).parent
STEP_S = 0.02
DURATION_S = 30.0


def identifier(name):
    """What the import calls an entity."""
    own = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)
    own = re.sub(r"[^A-Za-z0-9]", "_", own).strip("_").lower()
    return own if own[:1].isalpha() else f"s_{own}"


def variations(root):
    """The sets of values of a file of variations."""
    parts = []
    for part in root.find("ParameterValueDistribution/Deterministic"):
        name = part.get("parameterName")
        if part.find("DistributionSet") is not None:
            parts.append([{name: one.get("value")} for one in part.find("DistributionSet")])
        elif part.find("DistributionRange") is not None:
            within = part.find("DistributionRange/Range")
            low, high = float(within.get("lowerLimit")), float(within.get("upperLimit"))
            step = float(part.find("DistributionRange").get("stepWidth"))
            values = [low + nth * step for nth in range(int((high - low) / step + 1e-6) + 1)]
            parts.append([{name: f"{value:.9g}"} for value in values])
        else:
            sets = part.findall("ValueSetDistribution/ParameterValueSet")
            parts.append([{one.get("parameterRef"): one.get("value") for one in values} for values in sets])
    for chosen in itertools.product(*parts):
        yield {name: value for values in chosen for name, value in values.items()}


def concrete(file, count):
    """The scenario of a file, or of some of its variations, as files without a distribution."""
    root = ET.parse(file).getroot()
    named = root.find("ParameterValueDistribution/ScenarioFile")
    if named is None:
        if root.find("Storyboard") is not None:
            yield file.stem, file
        return
    scenario = file.parent / named.get("filepath")
    every = list(variations(root))
    for nth in sorted({round(part * (len(every) - 1) / max(count - 1, 1)) for part in range(min(count, len(every)))}):
        tree = ET.parse(scenario)
        for declared in tree.getroot().find("ParameterDeclarations"):
            declared.set("value", every[nth].get(declared.get("name"), declared.get("value")))
        written = scenario.with_name(f"tmp_{file.stem}_{nth}.xosc")
        tree.write(written)
        yield f"{file.stem} {nth}", written
        written.unlink()


def ours(avastra, file, out):
    """Times, and the way of everybody by name: x, y, speed."""
    done = subprocess.run([avastra, "import", "--out", out, file], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    space = out / f"{file.stem}.ava"
    driver = f"{sys.executable} {HERE / 'blind.py'}"
    run = [avastra, "run", space, "--ads", driver, "--agent", "random", "--episodes", "1", "--keep", "1", "--repeat", "0",
           "--jobs", "1", "--out", out / "run"]
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    found = list((out / "run").glob("critical/*.ava")) + list((out / "run").glob("kept/*.ava"))
    if not found:
        raise RuntimeError(done.stdout[-500:] + done.stderr[-500:])
    subprocess.run([avastra, "export", "--to", "csv", "--out", out, found[0]], capture_output=True, check=True)
    names = ["ego"] + re.findall(r"spawn \w+ as (\w+)", space.read_text())
    ways = {}
    with open(out / f"{found[0].stem}.csv", newline="") as table:
        for row in csv.DictReader(table):
            speed = math.hypot(float(row["vx_mps"]), float(row["vy_mps"]))
            place = (float(row["x_m"]), float(row["y_m"]), speed, float(row["heading_rad"]))
            ways.setdefault(names[int(row["id"])], {})[round(float(row["time_s"]) / STEP_S)] = place
    contact = re.search(r"collision with npc#\d+ at ([\d.]+) s", found[0].read_text())
    return ways, float(contact.group(1)) if contact else math.inf


def theirs(esmini, file, out):
    log = out / "esmini.csv"
    subprocess.run([esmini, "--headless", "--disable_stdout", "--fixed_timestep", str(STEP_S), "--csv_logger", log, "--osc", file,
                    "--logfile_path", out / "log.txt"], capture_output=True, timeout=120, check=False, cwd=out)
    lines = log.read_text().splitlines()
    begin = next(at for at, line in enumerate(lines) if line.startswith("Index"))
    heads = [head.strip() for head in lines[begin].split(",")]
    ways = {}
    for line in lines[begin + 1:]:
        cells = [cell.strip() for cell in line.split(",")]
        tick = round(float(cells[1]) / STEP_S)
        if tick * STEP_S > DURATION_S:
            break
        yield_every(heads, cells, tick, ways)
    return ways


def yield_every(heads, cells, tick, ways):
    """Takes the columns of each entity out of a row of esmini's log."""
    at = [nth for nth, head in enumerate(heads) if "Entity_Name" in head]
    for begin, end in zip(at, at[1:] + [len(heads)]):
        if end > len(cells):
            break
        of = {re.sub(r"^#\d+ ", "", head).split(" [")[0]: cell for head, cell in zip(heads[begin:end], cells[begin:end])}
        heading = float(of["World_Heading_Angle"])
        dx, dy = float(of["bb_x"]), float(of["bb_y"])
        x = float(of["World_Position_X"]) + dx * math.cos(heading) - dy * math.sin(heading)
        y = float(of["World_Position_Y"]) + dx * math.sin(heading) + dy * math.cos(heading)
        ways.setdefault(identifier(of["Entity_Name"]), {})[tick] = (x, y, abs(float(of["Current_Speed"])), heading)


def begins(way, last):
    """The tick in which somebody begins to do something."""
    ticks = sorted(tick for tick in way if tick <= last)
    x, y, speed, heading = way[ticks[0]]
    was = 0.0
    for tick in ticks:
        now = way[tick]
        across = -(now[0] - x) * math.sin(heading) + (now[1] - y) * math.cos(heading)
        if abs(now[2] - speed) > 0.2 or abs(across - was) > 0.02 * STEP_S:
            return tick
        was = across
    return None


def compare(avastra, esmini, name, file):
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch)
        found = ours(avastra, file, out)
        if found is None:
            return None
        own, contact_s = found
        other = theirs(esmini, file, out)
    last = min(contact_s / STEP_S, DURATION_S / STEP_S, max(own["ego"]))
    ego = next((way for name, way in other.items() if name in ("ego", "hero")), None)
    ego = ego or next(way for name, way in other.items() if name not in own)
    for tick in sorted(own["ego"]):
        # Esmini's ego vehicle has another body: its front is compared by what it began with.
        if tick in ego and tick <= last:
            moved = [math.dist(way[tick][:2], way[min(way)][:2]) for way in (own["ego"], ego)]
            if abs(moved[0] - moved[1]) > 0.5:
                last = tick
                break
    within, count, worst, late = 0, 0, (0.0, ""), (0.0, "")
    for who, way in own.items():
        if who == "ego" or who not in other:
            continue
        for tick, place in way.items():
            if tick <= last and tick in other[who]:
                away = math.dist(place[:2], other[who][tick][:2])
                within, count = within + (away <= 0.3), count + 1
                worst = max(worst, (away, f"{who} at {tick * STEP_S:.1f} s"))
        mine, its = begins(way, last), begins(other[who], last)
        if mine is not None and its is not None:
            late = max(late, (abs(mine - its) * STEP_S, who))
        elif mine is not its and max(mine or 0, its or 0) * STEP_S < last * STEP_S - 1.0:
            late = max(late, (math.inf, who))
    return name, within, count, worst, late, last * STEP_S


def main():
    avastra, esmini, number, folders = Path(sys.argv[1]).resolve(), sys.argv[2], int(sys.argv[3]), sys.argv[4:]
    good, all_files = 0, 0
    for folder in folders:
        for file in sorted(Path(folder).rglob("*.xosc")):
            text = file.read_text(errors="replace")
            if "<Catalog " in text or file.name.startswith("tmp_"):
                continue
            for name, scenario in concrete(file, number):
                try:
                    found = compare(avastra, esmini, name, scenario)
                except Exception as problem:  # noqa: BLE001 - one file of many
                    print(f"  ?    {name}: {type(problem).__name__}: {str(problem)[-300:]}", flush=True)
                    continue
                if found is None:
                    continue
                _, within, count, worst, late, until_s = found
                if count == 0:
                    print(f"  -    {name}: nobody to compare", flush=True)
                    continue
                part = within / count
                is_good = part >= 0.95 and late[0] <= 0.1
                good, all_files = good + is_good, all_files + 1
                print(f"  {'ok' if is_good else 'NOT'}  {name}: {part:.1%} of {count} within 0.3 m, at most {worst[0]:.2f} m ({worst[1]}); "
                      f"they begin {late[0]:.2f} s apart ({late[1]}); up to {until_s:.1f} s", flush=True)
    print(f"{good} of {all_files} drive alike")


if __name__ == "__main__":
    main()
