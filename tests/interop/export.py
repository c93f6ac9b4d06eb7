"""Do files that `avastra export` writes mean elsewhere what they mean here?

Called by export.sh with the folder that scenarios were exported to in every format, those with their natural versions and
with those for CARLA, and perhaps an esmini. Prints one line for each check, says which files fail, and ends with status 1 if any does; how far
natural versions drift from the recording is told, and no failure.
"""

import csv
import logging
import math
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import betterosi
import lxml.etree
import qc_openscenario
from commonroad.common.file_reader import CommonRoadFileReader
from commonroad_dc import pycrcc

# commonroad-io remarks on names of 2020a that its newer format has changed.
logging.disable(logging.WARNING)

# A player may be this far from the recorded place (m), and find the collision this much later or earlier (s).
STRAY_M = 0.1
LATE_S = 0.05
# Time step of the player, s.
STEP_S = 0.01


def main():
    exported, natural, carla = map(Path, sys.argv[1:4])
    esmini = Path(sys.argv[4]).absolute() if len(sys.argv) > 4 else None
    stems = sorted(path.stem for path in exported.glob("*.xosc"))
    if not stems:
        sys.exit(f"no .xosc in {exported}")
    recordings = {stem: recording(exported / f"{stem}.csv") for stem in stems}
    as_standards_want = [
        ("valid against OpenSCENARIO's schema", schema),
        ("without an issue or a skipped rule in asam-qc-openscenarioxml", checked("qc_openscenario", "xoscBundle")),
    ]
    checks = [(exported, *check) for check in as_standards_want] + [
        (exported, "read by commonroad-io, with the same collision at the same step", commonroad),
        (exported, "read by betterosi as OSI 3.8, with everyone where the table has them", osi_recording),
    ]
    if esmini:
        title = f"played by esmini within {STRAY_M} m, the collision within {LATE_S} s"
        checks.append((exported, title, played(esmini)))
    checks += [(natural, f"natural: {title}", check) for title, check in as_standards_want]
    checks += [
        (carla, "for CARLA: valid against the schema of 1.0", schema),
        (carla, "for CARLA: without an issue in the rules of asam-qc-openscenarioxml for 1.0",
         checked("qc_openscenario", "xoscBundle", may_skip=True)),
    ]
    drifts = {}
    if esmini:
        checks.append((natural, "natural: played by esmini without an error", drifted(esmini, drifts)))
    failed = False
    for folder, title, check in checks:
        found = {stem: check(folder / f"{stem}.xosc", recordings[stem]) for stem in stems}
        failed |= tell(title, found)
    if drifts:
        tell_drifts(drifts)
    maps = {path.stem: checked("qc_opendrive", "xodrBundle", may_skip=True)(path, None) for path in sorted(exported.glob("*.xodr"))}
    failed |= tell("maps without an issue in asam-qc-opendrive", maps)
    sys.exit(1 if failed else 0)


def tell(title, found):
    wrong = {stem: reason for stem, reason in found.items() if reason}
    print(f"{len(found) - len(wrong)} of {len(found)} {title}")
    for stem, reason in wrong.items():
        print(f"  {stem}: {reason}")
    return bool(wrong)


def recording(path):
    """Rows of the exported table by road user: {id: {tick: row}}."""
    users = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            numbers = {name: value if name == "body" else float(value) for name, value in row.items()}
            users.setdefault(int(row["id"]), {})[round(numbers["time_s"] * 50)] = numbers
    return users


def first_contact_s(users):
    """The end of the tick in which the ego vehicle first touched another, and which ones it touched then."""
    times = {user: min(tick for tick, row in rows.items() if row["contact"]) / 50
             for user, rows in users.items() if user and any(row["contact"] for row in rows.values())}
    if not times:
        return None, set()
    first = min(times.values())
    return first, {user for user, time in times.items() if time == first}


SCHEMAS = {}


def schema(path, _users):
    tree = lxml.etree.parse(str(path))
    minor = tree.find("FileHeader").get("revMinor")
    if minor not in SCHEMAS:
        folder = Path(qc_openscenario.__file__).parent / "schema" / f"1.{minor}.0"
        SCHEMAS[minor] = lxml.etree.XMLSchema(lxml.etree.parse(str(folder / "OpenSCENARIO.xsd")))
    return None if SCHEMAS[minor].validate(tree) else str(SCHEMAS[minor].error_log.last_error)


def checked(program, bundle, may_skip=False):
    """ASAM's checker. It exits with 0 whatever it finds, so its report is read. Some rules are for other versions than that
    of a map or a file."""

    def check(path, _users):
        config, report = path.with_suffix(".config"), path.with_suffix(".xqar").absolute()
        config.write_text(f'<Config><Param name="InputFile" value="{path.absolute()}"/>'
                          f'<CheckerBundle application="{bundle}"><Param name="resultFile" value="{report}"/>'
                          "</CheckerBundle></Config>")
        report.unlink(missing_ok=True)
        subprocess.run([Path(sys.executable).parent / program, "-c", config], capture_output=True, check=False)
        if not report.exists():
            return "no report"
        results = ElementTree.parse(report)
        issues = [issue.get("description") for issue in results.iter("Issue")]
        states = {checker.get("checkerId"): checker.get("status") for checker in results.iter("Checker")}
        done = {"completed", "skipped"} if may_skip else {"completed"}
        undone = [name for name, state in states.items() if state not in done]
        if not states:
            return "no rule was checked"
        return "; ".join(issues[:2] + undone) or None

    return check


def commonroad(path, users):
    """Whether the collision checker of CommonRoad meets the same road user in the step that ours does."""
    scenario, problems = CommonRoadFileReader(str(path.with_suffix(".xml"))).open()
    if len(problems.planning_problem_dict) != 1:
        return "no planning problem"
    boxes = {}
    for obstacle in scenario.dynamic_obstacles:
        half = obstacle.obstacle_shape.length / 2, obstacle.obstacle_shape.width / 2
        states = [obstacle.initial_state, *obstacle.prediction.trajectory.state_list]
        moving = pycrcc.TimeVariantCollisionObject(states[0].time_step)
        for state in states:
            moving.append_obstacle(pycrcc.RectOBB(*half, state.orientation, *state.position))
        boxes[obstacle.obstacle_id % 10000] = moving, states[0].time_step, states[-1].time_step
    ego, begin, end = boxes.pop(0)
    meetings = {}
    for user, (other, first, last) in boxes.items():
        for step in range(max(begin, first), min(end, last) + 1):
            if ego.obstacle_at_time(step).collide(other.obstacle_at_time(step)):
                meetings[user] = step
                break
    met_s, met = first_contact_s(users)
    if met_s is None:
        return f"meets {meetings}, and there was no collision" if meetings else None
    wanted = math.ceil(round(met_s / 0.1, 6))
    found = {user % 10000: meetings.get(user % 10000) for user in met}
    if any(step != wanted for step in found.values()) or min(meetings.values()) != wanted:
        return f"meets {meetings}, wanted {sorted(met)} at step {wanted}"
    return None


def osi_recording(path, users):
    table = path.with_suffix(".csv")
    script = Path(__file__).parents[2] / "python/adapters/osi/record.py"
    subprocess.run([sys.executable, script, table], check=True, capture_output=True)
    recording = table.with_suffix(".mcap")
    if [data["name"] for data in betterosi.read_file_metadata(recording)] != ["net.asam.osi.trace"]:
        return "not one record `net.asam.osi.trace`"
    seen = 0
    for truth in betterosi.read(recording):
        tick = round((truth.timestamp.seconds + truth.timestamp.nanos / 1e9) * 50)
        for moving in truth.moving_object:
            row = users[0 if moving.id.value == 1 else moving.id.value - 1000][tick]
            if (moving.base.position.x, moving.base.position.y) != (row["x_m"], row["y_m"]):
                return f"object {moving.id.value} is elsewhere at tick {tick}"
            seen += 1
    recording.unlink()
    wanted = sum(len(rows) for rows in users.values())
    return None if seen == wanted else f"{seen} of {wanted} rows"


def play(esmini, path):
    """Plays a file: the table of where everyone was, the first collision of the ego vehicle (time and names), and what
    went wrong."""
    folder = path.parent / "played"
    folder.mkdir(exist_ok=True)
    table, log, record = (folder / f"{path.stem}.{kind}" for kind in ("csv", "txt", "dat"))
    done = subprocess.run(
        [esmini, "--headless", "--osc", path.absolute(), "--fixed_timestep", str(STEP_S), "--collision",
         "--traj_filter", "0", "--record", record.absolute(), "--logfile_path", log.absolute(), "--disable_stdout"],
        capture_output=True, text=True, check=False, cwd=folder)
    text = log.read_text() if log.exists() else ""
    if done.returncode or "[error]" in text:
        return None, None, next((line for line in text.splitlines() if "[error]" in line), f"status {done.returncode}")
    subprocess.run([esmini.with_name("dat2csv"), "--file", record.absolute()], capture_output=True, check=True, cwd=folder)
    record.unlink()
    hits = re.findall(r"\[([0-9.]+)\].*Collision between (.*)", text)
    hits = [(float(time), set(re.findall(r"npc_\d+", names))) for time, names in hits if "ego" in names]
    return table, hits[0] if hits else None, None


def played(esmini):
    def check(path, users):
        table, hit, wrong = play(esmini, path)
        if wrong:
            return wrong
        away, who, when = max((away, name, time) for name, time, away in strays(path, table, users))
        met_s, met = first_contact_s(users)
        if met_s is None:
            late = "a collision that there was not" if hit else None
        elif not hit:
            late = f"no collision, wanted one at {met_s:.2f} s"
        else:
            fits = abs(hit[0] - met_s) <= LATE_S and any(f"npc_{user}" in hit[1] for user in met)
            late = None if fits else f"{hit[1]} at {hit[0]:.2f} s, wanted {sorted(met)} at {met_s:.2f} s"
        far = f"{away:.3f} m off ({who} at {when} s)" if away > STRAY_M else None
        return "; ".join(reason for reason in (far, late) if reason) or None

    return check


def drifted(esmini, drifts):
    """Plays a natural version and notes how far it drifts."""

    def check(path, users):
        table, hit, wrong = play(esmini, path)
        if wrong:
            return wrong
        met_s, met = first_contact_s(users)
        others = [(name, time, away) for name, time, away in strays(path, table, users) if name != "ego"]
        names = {f"npc_{user}" for user in met}
        end_s = max((time for _, time, _ in others), default=0.0)
        drifts[path.stem] = {
            "away": [away for _, time, away in others if met_s is None or time <= met_s],
            "at_end": [away for _, time, away in others if time >= end_s - 1e-6],
            "at_contact": [away for name, time, away in others if name in names and abs(time - met_s) < STEP_S / 2],
            "collision": (met_s, names, hit),
        }
        return None

    return check


def tell_drifts(drifts):
    figures = lambda values: (f"mean {sum(values) / len(values):.2f} m, 95 % within "
                              f"{sorted(values)[math.ceil(len(values) * 0.95) - 1]:.2f} m, at most {max(values):.2f} m")
    for key, title in [("away", "at any time up to the collision"), ("at_contact", "what is hit, at the collision"),
                       ("at_end", "at the end")]:
        values = [value for drift in drifts.values() for value in drift[key]]
        print(f"natural: drift {title}: {figures(values) if values else 'nothing'}")
    collisions = {stem: drift["collision"] for stem, drift in drifts.items() if drift["collision"][0] is not None}
    same = {stem: abs(hit[0] - met_s) for stem, (met_s, names, hit) in collisions.items() if hit and hit[1] & names}
    late = sorted(same.values())
    print(f"natural: {len(same)} of {len(collisions)} collisions happen with the same one"
          + (f", half of them within {late[len(late) // 2]:.2f} s, all within {late[-1]:.2f} s" if late else ""))
    for stem, (met_s, names, hit) in collisions.items():
        if stem not in same:
            found = f"{sorted(hit[1])} at {hit[0]:.2f} s" if hit else "no collision"
            print(f"  {stem}: {found}, wanted {sorted(names)} at {met_s:.2f} s")


def strays(path, table, users):
    """Name, time and distance between the played and the recorded middle of each road user, step by step."""
    # esmini tells where the rear axle is, the table where the middle is: the heading leads from one to the other.
    entities = ElementTree.parse(path).iter("ScenarioObject")
    offsets = {entity.get("name"): float(entity.find(".//Center").get("x")) for entity in entities}
    with open(table, newline="") as file:
        lines = [line for line in file if not line.startswith("Version")]
    for row in csv.DictReader(lines, skipinitialspace=True):
        name = row["name"].strip()
        user = 0 if name == "ego" else int(name.removeprefix("npc_"))
        tick = float(row["time"]) * 50
        before, after = users[user].get(math.floor(tick + 1e-6)), users[user].get(math.ceil(tick - 1e-6))
        if not before or not after:
            continue
        part = tick - math.floor(tick + 1e-6)
        where = [before[axis] + (after[axis] - before[axis]) * part for axis in ("x_m", "y_m")]
        x = float(row["x"]) + offsets[name] * math.cos(float(row["h"]))
        y = float(row["y"]) + offsets[name] * math.sin(float(row["h"]))
        yield name, float(row["time"]), math.hypot(x - where[0], y - where[1])


if __name__ == "__main__":
    main()
