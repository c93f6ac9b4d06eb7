"""What does avastra find in planners that have one defect each? The ten defects of `DEFECTS`, and a sane planner as the control.

    python3 tests/interop/defects.py AVASTRA [DEFECT…]      # all without DEFECT; those that are not known are named
    python3 tests/interop/defects.py AVASTRA --faults       # the planted faults of scenarios/ads/faults, by the same measure
    python3 tests/interop/defects.py --drive DEFECT         # serves the planner, for `avastra run --ads` of your own

Each planner drives 100 episodes of `avastra45_law.ava` and 100 of `manoeuvres.ava`, 25 on each road. For each it is printed which
requirements it breached, in how many episodes and by how much, and which kinds of collisions counted (numbers of the pre-crash
typology). FOUND means that what was expected of the defect is among them, in more episodes than in the control where that is played, too.
`latency` drives one episode only, since it wastes the wall clock: it is found if 1 % of its answers or more take longer than the period. What is not found fails
nothing: the last line names it. Takes some ten minutes on two processors. The runs are left in target/interop/defects, or in the folder $OUT.

With `--faults` each planted fault drives 40 episodes on each road of three spaces. One that hits somebody has to have a counted collision
or a breach; the last line names those that have none.

The planner is told the truth (`observation: truth`), so that what is found is its own doing. It knows only what it has seen once. avastra
steers (`answer: acceleration`), but for `changes_blindly`, which turns the wheel itself.
"""

import json
import math
import os
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))

import avastra  # noqa: E402

SPACES = {"law": "scenarios/avastra45_law.ava", "man": "scenarios/manoeuvres.ava"}
PEOPLE = {11, 12, 13, 14}
REAR_END = {24, 25, 26}
#: Of each defect: what it does, which requirements and which kinds of counted collisions are expected, and options of `run`.
DEFECTS = {
    "none": ("sane, the control", set(), set(), []),
    "stops_at_green": ("stands for 10 s at green, too", {"goes_at_green"}, set(), []),
    "creeps": ("stands 0.45 m over the line at red", {"stops_at_red"}, set(), []),
    "short_gap": ("follows at 0.9 s and brakes at most at 3 m/s²", {"keeps_distance"}, REAR_END, []),
    "turns_left": ("turns left where others come in 1.5 s", set(), {27, 29}, []),
    "forgets": ("forgets who is hidden for 0.5 s", {"yields_to_people"}, PEOPLE, []),
    "changes_blindly": ("changes lanes without a look", set(), {18}, []),
    "slow": ("drives 8 km/h below the limit", {"lets_traffic_flow"}, set(), ["--ambient", "8"]),
    "ignores_leader": ("ignores one leader in five", {"keeps_distance"}, REAR_END, []),
    "mirrored": ("sees left and right mirrored", {"keeps_to_its_side"}, {16, 19, 20, 21, 27, 29}, []),
    "latency": ("thinks for 20 ms of wall clock about each object", set(), set(), ["--road", "residential"]),
}
#: Episodes on each road.
EPISODES, EPISODES_LATENCY = 25, 1

#: m/s², magnitudes: what the planner asks for, and where it hurries.
ACCEL, COMFORT, HARDEST = 1.5, 2.0, 6.0
#: Others are thought to go on along their lanes for so long, s, in steps of this length, s.
HORIZON, PART = 6.0, 0.4
#: How long before and after another one is not to be in its way, s: vehicles, and people.
MARGIN_CAR, MARGIN_PERSON = 1.5, 1.2
#: Slower than this somebody stands, m/s.
STANDS = 0.3
#: Width of the cells by which points of lanes are found, m.
CELL = 4.0


def wrap(angle):
    return math.remainder(angle, 2.0 * math.pi)


class Near:
    """Points of polylines, found by their place."""

    def __init__(self):
        self.cells = {}

    def add(self, x, y, entry):
        self.cells.setdefault((int(x // CELL), int(y // CELL)), []).append((x, y, entry))

    def around(self, x, y):
        """Each point within a cell or two, with its squared distance."""
        column, row = int(x // CELL), int(y // CELL)
        for i in (column - 1, column, column + 1):
            for j in (row - 1, row, row + 1):
                for px, py, entry in self.cells.get((i, j), ()):
                    yield (px - x) ** 2 + (py - y) ** 2, px, py, entry


class Other:
    """A road user as the planner has it in mind."""

    def __init__(self, seen):
        self.id, self.kind = seen.id, seen.kind
        self.x, self.y, self.vx, self.vy, self.heading = seen.x, seen.y, seen.vx, seen.vy, seen.heading
        self.length, self.width, self.speed = seen.length, seen.width, seen.speed
        self.is_person = seen.kind in ("pedestrian", "animal")

    def mirror(self, ego):
        """Left becomes right, as the ego vehicle sees it."""
        cos, sin = math.cos(2.0 * ego.heading), math.sin(2.0 * ego.heading)
        dx, dy = self.x - ego.x, self.y - ego.y
        self.x, self.y = ego.x + cos * dx + sin * dy, ego.y + sin * dx - cos * dy
        self.vx, self.vy = cos * self.vx + sin * self.vy, sin * self.vx - cos * self.vy
        self.heading = wrap(2.0 * ego.heading - self.heading)


class Conflict:
    """Where and when another one will be on the route: stations of the ego vehicle's front, and times, s."""

    def __init__(self, begin, since, travelled, pose, lane):
        self.begin, self.end, self.since, self.until = begin, begin, since, since
        #: How far the other one comes until then, m; its heading then; its lane.
        self.travelled, self.heading, self.lane = travelled, pose, lane


class Planner(avastra.Driver):
    """Follows the route at the limit, follows leaders by IDM, and waits where a light, a sign, people or other traffic ask for it."""

    answer = "acceleration"

    def __init__(self, defect):
        self.defect = defect
        self.name = f"planner, {defect}"
        if defect == "changes_blindly":
            self.answer = "control"

    def init(self, init):
        self.vehicle = init.vehicle
        self.hardest = 3.0 if self.defect == "short_gap" else HARDEST

    def map(self, map):
        self.roads, self.lanes = map, Near()
        for lane in map.lanes:
            for index, (x, y) in enumerate(lane.centerline):
                after = lane.centerline[min(index + 1, len(lane.centerline) - 1)]
                before = lane.centerline[max(index - 1, 0)]
                self.lanes.add(x, y, (lane, index, math.atan2(after[1] - before[1], after[0] - before[0])))

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.route, self.seed = reset.route, reset.seed
        self.near = Near()
        for index, point in enumerate(reset.route.path):
            self.near.add(point.x, point.y, (index * reset.route.spacing, point.heading))
        self.seen_at, self.walked, self.green_since = {}, {}, {}
        self.aside = 0.0

    def step(self, step):
        others = self.known(step)
        if self.defect == "latency":
            time.sleep(0.02 * len(step.objects))
        ego = step.ego
        self.front = ego.route_s + self.vehicle.rear_axle_to_front
        limit = min(self.way.speed(ego.route_s), self.way.speed(ego.route_s + 1.5 * ego.speed), self.sight(step))
        if self.defect == "slow":
            limit = max(limit - 8.0 / 3.6, 2.0)
        asked = [((limit - ego.speed) / 1.0, "limit")]
        line = self.line(step)
        if line is not None:
            asked.append((self.stopping(ego.speed, line - self.front), "light or sign"))
        for other in others:
            asked.extend(self.minding(step, other, limit))
        accel, reason = min(asked)
        accel, reason = max(min(accel, ACCEL), -self.hardest), avastra.Internal(reason=reason)
        if self.defect == "changes_blindly":
            return avastra.Control(accel=accel, steer=self.swerving(step), internal=reason)
        return avastra.Acceleration(accel, reason)

    def swerving(self, step):
        """The wheel's angle of a driver who is in the lane beside its own for 8 s of every 16 s, whoever is there."""
        left, right = self.way.room(self.front)
        side = 3.3 if left >= 4.9 else -3.3 if right >= 4.9 else 0.0
        wanted = side if step.time % 16.0 >= 8.0 else 0.0
        self.aside += max(-0.15, min(0.15, wanted - self.aside))
        ego = step.ego
        place = self.way.path.at(ego.route_s + 3.0 + 0.5 * ego.speed)
        dx = place.x - self.aside * math.sin(place.heading) - ego.x
        dy = place.y + self.aside * math.cos(place.heading) - ego.y
        return math.atan(2.0 * self.vehicle.wheelbase * math.sin(math.atan2(dy, dx) - ego.heading) / math.hypot(dx, dy))

    def known(self, step):
        """Who has been seen at least once. Truth holds for those who are hidden now: the memory of a good planner."""
        known = []
        for seen in step.objects:
            if seen.visible >= 0.1:
                self.seen_at[seen.id] = step.time
            since = step.time - self.seen_at.get(seen.id, -math.inf)
            if since == math.inf or self.defect == "forgets" and since > 0.5:
                continue
            known.append(Other(seen))
            if self.defect == "mirrored":
                known[-1].mirror(step.ego)
        return known

    def sight(self, step):
        """The speed from which the vehicle stops within what is seen: 1.2 s of reaction, and braking at 7 m/s² or what the road gives."""
        braking = min(7.0, 8.0 * step.conditions.friction)
        reach = 1.2 * braking
        return math.sqrt(reach**2 + 2.0 * braking * max(0.95 * step.conditions.visibility, 1.0)) - reach

    def line(self, step):
        """Where the front has to stand for a light or a sign, if it has to."""
        lines = [line - 1.0 for line in [self.way.stop(step)] if line is not None]
        states = {signal.id: signal.state for signal in step.signals}
        red = [line.route_s for line in self.route.stop_lines if states.get(line.signal) in ("red", "yellow")]
        if self.defect == "creeps":
            lines = [line + 1.45 if line + 1.0 in red else line for line in lines]
        if self.defect == "stops_at_green":
            for line in self.route.stop_lines:
                left = line.route_s - self.front
                # It counts the seconds of green from when it stands there.
                if states.get(line.signal) == "green" and -0.5 <= left <= 60.0:
                    if left <= 3.0 and step.ego.speed < STANDS:
                        self.green_since.setdefault(line.route_s, step.time)
                    if step.time - self.green_since.get(line.route_s, step.time) < 10.0:
                        lines.append(line.route_s - 1.0)
        return min(lines, default=None)

    def stopping(self, speed, left):
        """The acceleration to stand after `left` m."""
        if left <= 0.1:
            return -max(1.0, 3.0 * speed)
        needed = speed * speed / (2.0 * left)
        if needed > 1.2:
            return -1.1 * needed
        return math.sqrt(2.0 * 1.2 * max(left - 0.3 * speed, 0.0)) - speed

    def follow(self, speed, gap, ahead):
        """The interaction of IDM: a desired gap of 2 m and 1.5 s, and braking for who is slower."""
        if self.defect == "short_gap":
            # A control of distance: unlike IDM it does not brake the harder the faster it comes nearer, which makes up for a short gap.
            return 0.8 * (gap - 1.0 - 0.9 * speed) + 1.0 * (ahead - speed)
        wanted = 2.0 + max(0.0, speed * 1.5 + speed * (speed - ahead) / (2.0 * math.sqrt(ACCEL * COMFORT)))
        return ACCEL * (1.0 - (wanted / max(gap, 0.1)) ** 2)

    def beside(self, x, y):
        """Station, offset and heading of the route near a place; None farther away than a cell."""
        found = min(self.near.around(x, y), default=None, key=lambda entry: entry[0])
        if found is None:
            return None
        _, px, py, (station, heading) = found
        dx, dy = x - px, y - py
        cos, sin = math.cos(heading), math.sin(heading)
        return station + dx * cos + dy * sin, dy * cos - dx * sin, heading

    def minding(self, step, other, limit):
        """What another road user asks for: accelerations, with a reason."""
        ego = step.ego
        here = self.beside(other.x, other.y)
        if here is not None:
            station, offset, heading = here
            along = math.cos(other.heading - heading)
            ahead = other.vx * math.cos(heading) + other.vy * math.sin(heading)
            aside = self.half(other, other.heading - heading)
            # A lane change that waits leaves the vehicle beside its route.
            places = [0.0, ego.route_d] if abs(ego.route_d) > 0.5 else [0.0]
            is_on = any(abs(offset - place) < aside for place in places)
            reach = abs(along) * other.length / 2.0 + math.sqrt(max(0.0, 1.0 - along * along)) * other.width / 2.0
            gap = station - reach - self.front
            # Who comes in from beside is let in from when it is ahead by half a length.
            if is_on and station > self.front - self.vehicle.length / 2.0:
                lanewise = abs(along) > 0.7 and not other.is_person
                if lanewise or other.speed < STANDS:
                    if not (self.defect == "ignores_leader" and random.Random(f"{self.seed}/{other.id}").random() < 0.2):
                        yield self.follow(ego.speed, gap, ahead), f"follow {other.id}"
                    return
            if is_on and station <= self.front - self.vehicle.length / 2.0 and along > 0.7:
                return  # a follower
        for conflict in self.conflicts(step, other):
            if self.waits(step, other, conflict, limit):
                left = conflict.begin - (2.0 if other.is_person else 1.5) - self.front
                yield self.stopping(ego.speed, left), f"wait for {other.id}"

    def half(self, other, angle):
        """How far from the route somebody's middle is when both touch, and a little more, m."""
        body = abs(math.cos(angle)) * other.width / 2.0 + abs(math.sin(angle)) * other.length / 2.0
        return self.vehicle.width / 2.0 + body + (0.8 if other.is_person else 0.3)

    def conflicts(self, step, other):
        """Where and when it comes across the route, along each way it may take."""
        if other.is_person:
            ways = [self.walking(step, other)]
        elif other.speed < STANDS:
            return
        else:
            ways = self.driving(other)
        for way in ways:
            found = None
            for seconds, x, y, heading, lane in way:
                here = self.beside(x, y)
                if here is None or abs(here[1]) >= self.half(other, heading - here[2]):
                    if found:
                        break
                    continue
                along = math.cos(heading - here[2])
                reach = abs(along) * other.length / 2.0 + math.sqrt(max(0.0, 1.0 - along * along)) * other.width / 2.0
                if found is None:
                    found = Conflict(here[0] - reach, seconds, seconds * other.speed, heading, lane)
                    found.is_same_way = along > 0.7
                found.begin, found.end = min(found.begin, here[0] - reach), max(found.end, here[0] + reach)
                found.until = seconds
            if found and found.end > self.front:
                yield found

    def walking(self, step, other):
        """Straight on. Who has stopped beside the way may be hesitating, and walks on in mind for 4 s."""
        velocity = other.vx, other.vy
        if other.speed >= STANDS:
            self.walked[other.id] = (step.time, velocity)
        else:
            since, before = self.walked.get(other.id, (-math.inf, velocity))
            velocity = before if step.time - since < 4.0 else velocity
        heading = math.atan2(velocity[1], velocity[0])
        for index in range(round(HORIZON / PART) + 1):
            seconds = index * PART
            yield seconds, other.x + seconds * velocity[0], other.y + seconds * velocity[1], heading, None

    def driving(self, other):
        """Along the lane it is in and each that follows, or straight on where it is in none. Beside its lane it stays beside it."""
        direction = math.atan2(other.vy, other.vx)
        fits = (entry for entry in self.lanes.around(other.x, other.y) if abs(wrap(entry[3][2] - direction)) < 0.8)
        found = min(fits, default=None, key=lambda entry: entry[0] + 4.0 * abs(wrap(entry[3][2] - direction)))
        if found is None:
            yield [(index * PART, other.x + index * PART * other.vx, other.y + index * PART * other.vy, direction, None)
                   for index in range(round(HORIZON / PART) + 1)]
            return
        _, px, py, (lane, index, heading) = found
        offset = (other.y - py) * math.cos(heading) - (other.x - px) * math.sin(heading)
        yield from self.branches(lane, lane.s[index], other.speed, 0.0, offset, [])

    def branches(self, lane, station, speed, seconds, offset, before):
        way, points = list(before), lane.centerline
        index = 0
        while seconds <= HORIZON and station <= lane.length:
            while index + 2 < len(points) and lane.s[index + 1] < station:
                index += 1
            (x0, y0), (x1, y1) = points[index], points[index + 1]
            share = (station - lane.s[index]) / max(lane.s[index + 1] - lane.s[index], 1e-6)
            heading = math.atan2(y1 - y0, x1 - x0)
            way.append((seconds, x0 + share * (x1 - x0) - offset * math.sin(heading),
                        y0 + share * (y1 - y0) + offset * math.cos(heading), heading, lane))
            seconds, station = seconds + PART, station + PART * speed
        if seconds > HORIZON or not lane.successors:
            yield way
            return
        for name in lane.successors:
            yield from self.branches(self.roads.lane[name], station - lane.length, speed, seconds, 0.5 * offset, way)

    def waits(self, step, other, conflict, limit):
        """Whether the ego vehicle lets the other one go first."""
        ego = step.ego
        if conflict.begin < self.front:
            # It is in the way itself, and clears it; but it does not set off into somebody who is about to pass.
            return ego.speed < 2.0 and conflict.since < 2.0 and not conflict.is_same_way
        arrives = self.reaching(ego.speed, limit, conflict.begin - self.front)
        clears = self.reaching(ego.speed, limit, conflict.end - self.front + self.vehicle.length)
        margin = MARGIN_PERSON if other.is_person else MARGIN_CAR
        if not other.is_person:
            if not self.goes_first(other, conflict):
                # Who should wait and no longer can is let go all the same.
                if other.speed < 2.0 or conflict.travelled > other.speed**2 / (2.0 * 3.0) + 0.5 * other.speed:
                    return False
                margin = 0.5
            elif self.defect == "turns_left" and self.turn_at(conflict.begin) == "left":
                return conflict.since < 1.5
            if conflict.is_same_way:
                return conflict.since - margin < clears and arrives < conflict.since + 2.0
        return conflict.since - margin < clears and arrives < conflict.until + margin

    def reaching(self, speed, limit, distance):
        """When the vehicle is `distance` m on if it goes on, s."""
        if distance <= 0.0:
            return 0.0
        top = max(speed, limit, 1.0)
        rising = (top * top - speed * speed) / (2.0 * ACCEL)
        if distance <= rising:
            return (math.sqrt(speed * speed + 2.0 * ACCEL * distance) - speed) / ACCEL
        return (top - speed) / ACCEL + (distance - rising) / top

    def lane_at(self, station):
        on = next((lane for lane in self.route.lanes if lane.end >= station), self.route.lanes[-1])
        return self.roads.lane[on.id]

    def turn_at(self, station):
        """What the route does in the junction that lies at a station of the front, or just after it."""
        lanes = [self.lane_at(station + beyond) for beyond in (0.0, 4.0, 8.0)]
        return next((lane.turn for lane in lanes if lane.junction), "straight")

    def goes_first(self, other, conflict):
        """Whether the other vehicle has the right of way where both meet."""
        lane = next((lane for lane in map(self.lane_at, (conflict.begin, conflict.begin + 4.0)) if lane.junction), None)
        if lane is None or conflict.lane is None or not conflict.lane.junction:
            # Outside junctions nobody crosses by right; who already is on the way is followed.
            return conflict.since < 1.0
        entry = next(part.begin for part in self.route.lanes if part.id == lane.id)
        mine = self.route.path[min(int(entry / self.route.spacing), len(self.route.path) - 1)].heading
        (x0, y0), (x1, y1) = conflict.lane.centerline[:2]
        angle = wrap(math.atan2(y1 - y0, x1 - x0) - mine)
        is_lit = any(abs(line.route_s - entry) < 25.0 for line in self.route.stop_lines)
        if abs(angle) > 2.3:
            return lane.turn == "left" and conflict.lane.turn != "left"
        if is_lit:
            return False  # Who crosses has red while the ego vehicle has green.
        if any(sign.kind == "stop" and abs(sign.route_s - entry) < 25.0 for sign in self.route.signs):
            return True
        ranks = {"priority": 2, "equal": 1, "yield": 0}
        if ranks[lane.precedence] != ranks[conflict.lane.precedence]:
            return ranks[conflict.lane.precedence] > ranks[lane.precedence]
        return angle > 0.4  # from the right


def play(program, defect, space, out):
    """What `run` says of 100 episodes, as JSON."""
    profile = out / f"{defect}.yaml"
    command = [sys.executable, str(Path(__file__).resolve()), "--drive", defect]
    profile.write_text(f"ads:\n  command: {json.dumps(command)}\n  observation: truth\n")
    episodes = EPISODES_LATENCY if defect == "latency" else EPISODES
    folder = out / f"{defect}-{space}"
    shutil.rmtree(folder, ignore_errors=True)
    done = subprocess.run(
        [program, "run", SPACES[space], "--ads", profile, "--episodes", str(episodes), "--repeat", "0", "--jobs", "2",
         *DEFECTS[defect][3], "--out", folder, "--format", "json"],
        cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{defect} in {space}: exit {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return json.loads(done.stdout)


def breaches(told):
    """Of each requirement that was breached: episodes, and the worst margin with its unit."""
    return {entry["requirement"]: (entry["breached_in"], entry["smallest"], entry["unit"])
            for entry in told["requirements"] if entry["breached_in"]}


def kinds(told):
    """Counted collisions by number of their kind; None of a wreck."""
    counts = Counter()
    for group in told["groups"]:
        counts[group["precrash_number"]] += group["count"]
    return counts


def is_found(defect, told, control):
    """Whether what is expected of a defect was found, more often than in the control where there is one."""
    _, requirements, numbers, _ = DEFECTS[defect]
    if defect == "latency":
        # On a busy machine a sane planner has some 0.1 %.
        return told["thinking"]["beyond_period"] > 0.01
    breached, counted = breaches(told), kinds(told)
    before = (breaches(control), kinds(control)) if control else ({}, Counter())
    if defect == "creeps":
        return abs((breached.get("stops_at_red", (0, 0.0))[1] or 0.0) + 0.45) < 0.2
    return (any(breached.get(name, (0,))[0] > before[0].get(name, (0,))[0] for name in requirements)
            or sum(counted[number] for number in numbers) > sum(before[1][number] for number in numbers))


def play_faults(program, out):
    """Collisions and findings of each planted fault; names those that hit somebody and have no finding."""
    missed = []
    for fault in sorted((ROOT / "scenarios/ads/faults").glob("*.yaml")):
        hits = found = 0
        for space in [*SPACES.values(), "scenarios/r157.ava"]:
            folder = out / fault.stem
            shutil.rmtree(folder, ignore_errors=True)
            told = json.loads(subprocess.run(
                [program, "run", space, "--ads", fault, "--episodes", "40", "--seed", "7", "--repeat", "0", "--out", folder,
                 "--format", "json"], cwd=ROOT, capture_output=True, text=True, check=True).stdout)
            hit, counted, breached = told["totals"]["collisions"], told["totals"]["counted"], sorted(breaches(told))
            hits, found = hits + hit, found + counted + len(breached)
            print(f"{fault.stem}, {Path(space).stem}: {hit} collisions, {counted} counted; breached: {', '.join(breached) or 'nothing'}", flush=True)
        if hits and not found:
            missed.append(fault.stem)
    print(f"hit somebody, and without a finding: {', '.join(missed) or 'none'}")


def main():
    program = str(Path(sys.argv[1]).resolve())
    names = [name for name in sys.argv[2:] if name != "--faults"] or list(DEFECTS)
    unknown = [name for name in names if name not in DEFECTS]
    if unknown:
        sys.exit(f"no defect {', '.join(unknown)}; there are {', '.join(DEFECTS)}")
    out = Path(os.environ.get("OUT", ROOT / "target/interop/defects")).resolve()
    out.mkdir(parents=True, exist_ok=True)
    if "--faults" in sys.argv:
        return play_faults(program, out)
    controls, missed = {}, []
    for defect in names:
        print(f"{defect}: {DEFECTS[defect][0]}")
        found = False
        for space in ["law"] if defect == "latency" else SPACES:
            told = play(program, defect, space, out)
            if defect == "none":
                controls[space] = told
            hit = defect != "none" and is_found(defect, told, controls.get(space))
            found |= hit
            totals, thinking = told["totals"], told["thinking"]
            lines = [f"{name} in {count}" + (f" ({worst:.2f} {unit})" if worst is not None else "")
                     for name, (count, worst, unit) in breaches(told).items()]
            crashes = [f"{number} ×{count}" for number, count in sorted(kinds(told).items(), key=lambda pair: pair[0] or 99)]
            print(f"  {space}: {totals['episodes']} episodes, {totals['arrived']} arrived, {totals['simulated_s'] / 60:.0f} min; "
                  f"breached: {', '.join(lines) or 'nothing'}; counted kinds: {', '.join(crashes) or 'none'}; "
                  f"answers beyond the period: {100 * thinking['beyond_period']:.1f} %{'; FOUND' if hit else ''}", flush=True)
        if defect != "none" and not found:
            missed.append(defect)
    print(f"not found: {', '.join(missed) or 'none'}")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--drive":
        avastra.serve(lambda: Planner(sys.argv[2]))
    elif len(sys.argv) < 2:
        sys.exit(__doc__)
    else:
        main()
