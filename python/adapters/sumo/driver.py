"""SUMO's car-following models (PyPI `libsumo`, DLR) as driving systems under test: `driver.py IDM`, or EIDM, ACC, CACC, Krauss.

SUMO drives the ego vehicle in a world of our own making: one endless lane. In each step the speed of its vehicle is set to the real one's, and
what is in the way of the real one is put before it at the same gap: other road users that reach into the strip that the vehicle
sweeps along the route, and the line of a light or stop sign that holds. SUMO does one step of 0.1 s; the change of speed is the answer, and
avastra steers. Limits and bends are the lane's speed limit. SUMO's vehicles brake before a slower lane, but EIDM hardly when the limit of its own falls.
So no answer keeps a speed above that limit.

So SUMO's following is under test, and neither its lane changes nor its junction logic, which is never asked. For that logic stands what the adapter
foresees:

- Each road user keeps its speed, a vehicle along its lanes, all others straight on. A vehicle shows by its lights where it turns; without them it drives
  straight on where it can. It stops at a red light, and at a sign if the route has none, as long as it needs no more than `GENTLE` for that.
- One that comes onto the strip while the vehicle would be there, or shortly before or after, is put before it as an obstacle that stands
  where the strip is entered. One that comes over from beside is put there as a leader, at the gap that it will have.
- One that stands beside the strip is passed slowly if it is a pedestrian.
- A pedestrian who walks towards the strip on a crosswalk is an obstacle that stands at the crosswalk's edge, whoever would be there first.

It does not foresee who speeds up, starts, or turns without a light. Once the front has passed
the middle of a road user that comes onto the strip, it drives on.
Parameters are SUMO's defaults, except the vehicle's own length and brakes, and `sigma` 0: the driver is not meant to dawdle.
"""

import math
import pathlib
import subprocess
import sys
import tempfile
import typing

import avastra
import careful
import libsumo
import numpy as np

MODELS = ("IDM", "EIDM", "ACC", "CACC", "Krauss")
#: Added to both sides of the vehicle for the strip that it sweeps, m. Ours.
MARGIN = 0.3
#: The ego vehicle begins here on the endless lane, m; lanes of SUMO have a beginning, and vehicles a tail.
BEGIN = 100.0
LANE_LENGTH = 100_000.0
#: Farther ahead than this nothing is put before the vehicle, m.
REACH = 150.0
#: Harder than this a falling limit slows no vehicle down, m/s²; SUMO's own braking.
LIMIT_DECEL = 4.5

# What is foreseen. All of it is ours.
#: Times at which a road user is foreseen, s.
TIMES = np.arange(0.0, 8.01, 0.2)
#: Farther ahead than this on the route nothing is foreseen, m.
FORESEEN = 80.0
#: Another one that leaves the strip this long before the vehicle may come, or comes this long after it has left, is in nobody's way, s.
BEFORE, AFTER = 0.5, 1.0
#: The vehicle may come as early as its engine allows, and leaves as late as with this acceleration, m/s².
LEISURELY = 1.0
#: Others are thought to brake as hard as this for their lights and signs, m/s².
GENTLE = 3.0
#: Slower than this a road user stands, m/s.
STANDS = 0.3
#: A pedestrian nearer than this to the strip, m, is passed with `PASSING`, m/s, and the vehicle slows down for that with so many m/s².
MARGIN_PEDESTRIAN, PASSING, PASSING_DECEL = 1.0, 2.0, 1.5
#: A pedestrian this far beside the route walks on a crosswalk of it, m.
CROSSWALK_WIDE = 12.0
#: One beside the vehicle that is turned no more than this comes over from a lane of the same direction, rad.
PARALLEL = math.radians(35.0)
#: A vehicle farther from a lane's centre, or turned farther from it, is not in that lane, m and rad.
LANE_OFF, LANE_TURNED = 2.5, math.radians(45.0)
#: Where one is put that drives beyond the last lane, m.
GONE = 1e6
VEHICLES = ("car", "truck", "bus", "motorcycle", "cyclist")


class Leader(typing.NamedTuple):
    """What is in the way: its gap to the vehicle's front (m), its speed along the way (m/s) and its length (m)."""

    name: str
    gap: float
    speed: float
    length: float


class Sumo(avastra.Driver):
    version = "1.28.0"
    answer = "acceleration"

    def __init__(self, model):
        self.model = model
        self.name = f"SUMO {model}"

    def init(self, init):
        self.vehicle, self.period, self.running = init.vehicle, init.period, False
        self.folder = tempfile.TemporaryDirectory(prefix="avastra-sumo-")
        self.options = write_network(pathlib.Path(self.folder.name), self.model, init)

    def map(self, map):
        self.roads = map
        self.lanes = Lanes(map)

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        stations = np.arange(0.0, self.way.path.length + REACH, 1.0)
        #: The route: rows of station, x, y, heading.
        self.poses = np.array([(station, *self.way.path.at(station)) for station in stations])
        # Loaded anew: some models draw random numbers, and vehicles keep memories.
        options = [*self.options, "--seed", str(reset.seed % 2**31)]
        (libsumo.load if self.running else libsumo.start)(options if self.running else ["sumo", *options])
        self.running = True
        libsumo.vehicle.add("ego", "way", typeID="ego", departPos=str(BEGIN), departSpeed=str(reset.start.speed), departLane="0")
        libsumo.simulationStep()
        self.ahead = []

    def step(self, step):
        ego, front = step.ego, step.ego.route_s + self.vehicle.rear_axle_to_front
        limit = max(min(self.way.speed(ego.route_s), self.passing(step, front)), 0.1)
        leaders = in_order(self.in_the_way(step, front))
        reached = min(self.followed(ego.speed, limit, leaders), max(limit, ego.speed - LIMIT_DECEL * self.period))
        accel = (reached - ego.speed) / self.period
        reason = f"follow {leaders[0].name}" if leaders else "free"
        return avastra.Acceleration(accel, avastra.Internal(reason=reason))

    def followed(self, speed, limit, leaders):
        """The speed that SUMO's vehicle has after a step, m/s."""
        sumo_front = libsumo.vehicle.getLanePosition("ego")
        libsumo.vehicle.setPreviousSpeed("ego", speed)
        libsumo.lane.setMaxSpeed("way_0", limit)
        # SUMO follows in the order in which vehicles came to the lane: where two have passed each other, as a car passes a
        # line that holds, all are put there anew.
        stay = [leader.name for leader in leaders if leader.name in self.ahead]
        if stay != [name for name in self.ahead if name in stay]:
            stay = []
        for name in self.ahead:
            if name not in stay:
                libsumo.vehicle.remove(name)
        for leader in leaders:
            self.put(leader, sumo_front, is_new=leader.name not in stay)
        self.ahead = [leader.name for leader in leaders]
        libsumo.simulationStep()
        return libsumo.vehicle.getSpeed("ego")

    def in_the_way(self, step, front):
        """Everything on the strip ahead."""
        line = self.way.stop(step)
        if line is not None and line > front - 1.0:
            yield Leader("line", max(line - front, 0.0), 0.0, 1.0)
        signs = any(0.0 <= sign.route_s - front < FORESEEN for sign in self.way.route.signs)
        red = {signal.id for signal in step.signals if signal.state == "red"}
        for other in step.objects:
            yield from self.foreseen(step, other, front, red, signs)
            beside = self.way.path.project(other.x, other.y)
            turned = other.heading - beside.heading
            cos, sin = abs(math.cos(turned)), abs(math.sin(turned))
            along, across = cos * other.length + sin * other.width, sin * other.length + cos * other.width
            gap = beside.station - along / 2.0 - front
            overlaps = abs(beside.offset) < (self.vehicle.width + across) / 2.0 + MARGIN
            # What reaches beside the vehicle's front is nothing that it could follow.
            if overlaps and beside.station > front and gap < REACH:
                speed = other.vx * math.cos(beside.heading) + other.vy * math.sin(beside.heading)
                # No vehicle of SUMO's lane comes nearer. So an oncoming vehicle stands where it will be once the ego vehicle has braked.
                comes = max(-speed, 0.0) * step.ego.speed / GENTLE
                yield Leader(f"object {other.id}", max(gap - comes, 0.0), max(speed, 0.0), along)

    def foreseen(self, step, other, front, red, signs):
        """What another road user will be in the way, if anything."""
        if other.speed < STANDS or math.dist((other.x, other.y), (step.ego.x, step.ego.y)) > FORESEEN + other.speed * TIMES[-1]:
            return
        walks = other.kind not in VEHICLES
        ways = [] if walks else self.lanes.ways(other, red, signs)
        for way in ways or [straight(other)]:
            stations, offsets, turned = self.beside(way, front)
            cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
            along, across = cos * other.length + sin * other.width, sin * other.length + cos * other.width
            room = np.abs(offsets) - (self.vehicle.width + across) / 2.0
            meets = (room < (MARGIN_PEDESTRIAN if walks else MARGIN)) & (stations < front + FORESEEN)
            # On the strip it is followed, or follows, as it is.
            if room[0] < MARGIN or not meets.any():
                continue
            first = int(meets.argmax())
            last = first + int(np.append(~meets[first:], True).argmax()) - 1
            rears = stations - along / 2.0
            gap = rears[first: last + 1].min() - front
            if abs(turned[0]) < PARALLEL and stations[0] < front + FORESEEN and not walks and abs(turned[first]) < PARALLEL:
                moved = front + step.ego.speed * TIMES[first]
                if stations[first] > moved:
                    yield Leader(f"object {other.id}", max(rears[first] - moved, 0.0), other.speed, other.length)
                continue
            edge = self.crosswalk(stations[0], offsets[0], front) if walks else None
            if edge is not None:
                yield Leader(f"object {other.id}", min(edge, max(gap, 0.0)), 0.0, other.length)
                continue
            zone = stations[first: last + 1] + along[first: last + 1] / 2.0
            comes = arrival(gap, step.ego.speed, self.vehicle.max_accel, self.way.speed(front))
            leaves = arrival(zone.max() - front + self.vehicle.length, step.ego.speed, LEISURELY, self.way.speed(front))
            if stations[first] > front and TIMES[last] + BEFORE > comes and TIMES[first] - AFTER < leaves:
                yield Leader(f"object {other.id}", max(gap, 0.0), 0.0, other.length)

    def passing(self, step, front):
        """The speed with which pedestrians beside the strip may be passed, m/s."""
        fastest = math.inf
        for other in step.objects:
            if other.kind == "pedestrian":
                beside = self.way.path.project(other.x, other.y)
                ahead, room = beside.station - front, abs(beside.offset) - (self.vehicle.width + other.width) / 2.0
                if -self.vehicle.length < ahead < FORESEEN and room < MARGIN_PEDESTRIAN:
                    fastest = min(fastest, math.sqrt(PASSING**2 + 2.0 * PASSING_DECEL * max(ahead - 1.0, 0.0)))
        return fastest

    def beside(self, way, front):
        """Stations, offsets and turns against the route of poses, shape (times, 3)."""
        begin = max(int(front - self.vehicle.length), 0)
        near = self.poses[begin: begin + int(FORESEEN) + 20]
        nearest = np.hypot(way[:, :1] - near[:, 1], way[:, 1:2] - near[:, 2]).argmin(axis=1)
        station, x, y, heading = near[nearest].T
        dx, dy, cos, sin = way[:, 0] - x, way[:, 1] - y, np.cos(heading), np.sin(heading)
        turned = np.angle(np.exp(1j * (way[:, 2] - heading)))
        return station + dx * cos + dy * sin, dy * cos - dx * sin, turned

    def crosswalk(self, station, offset, front):
        """The distance to the edge of the crosswalk that a pedestrian is on; None if it is on none, or the front is beyond its edge."""
        for begin, end in self.way.route.crosswalks:
            if begin - 1.0 < station < end + 1.0 and abs(offset) < CROSSWALK_WIDE and front < begin:
                return begin - front
        return None

    def put(self, leader, sumo_front, is_new):
        vehicle, name = libsumo.vehicle, leader.name
        position = sumo_front + leader.gap + leader.length
        if is_new:
            vehicle.add(name, "way", typeID="other", departPos=str(position), departSpeed=str(leader.speed), departLane="0")
            vehicle.setSpeedMode(name, 0)
        vehicle.setLength(name, leader.length)
        vehicle.moveTo(name, "way_0", position)
        vehicle.setSpeed(name, leader.speed)
        vehicle.setPreviousSpeed(name, leader.speed)

    def close(self):
        if self.running:
            libsumo.close()
        self.folder.cleanup()


class Careful(Sumo):
    """The careful planner, which reads what is put on SUMO's lane."""

    def __init__(self):
        super().__init__("IDM")
        self.name = "careful planner as SUMO"

    def followed(self, speed, limit, leaders):
        vehicle = careful.Vehicle(self.vehicle.length, self.vehicle.width, speed, self.vehicle.max_accel, self.vehicle.max_decel)
        way = np.array([(station, station, 0.0, 0.0) for station in (0.0, REACH)])
        others = [careful.moving(leader.gap + (self.vehicle.length + leader.length) / 2.0, 0.0, 0.0, leader.speed, 0.0, leader.length, 1.0)
                  for leader in leaders]
        return max(speed + careful.acceleration(vehicle, way, others, limit) * self.period, 0.0)


class Lanes:
    """Where the vehicles of a map may drive on."""

    def __init__(self, map):
        self.lane = map.lane
        self.paths = {lane.id: np.array(lane.centerline) for lane in map.lanes}
        self.stations = {lane.id: np.array(lane.s) for lane in map.lanes}
        self.ids = [lane.id for lane in map.lanes for _ in lane.s]
        #: Of each point of all lanes: x, y, heading, station.
        self.points = np.concatenate([
            np.column_stack([path, np.arctan2(*np.gradient(path, axis=0).T[::-1]), self.stations[id]]) for id, path in self.paths.items()])

    def ways(self, other, red, signs):
        """The ways along lanes that a vehicle may take, each rows of x, y, heading at `TIMES`; none if it is in no lane."""
        x, y, heading, stations = self.points.T
        turned = np.abs(np.angle(np.exp(1j * (heading - other.heading))))
        away = np.hypot(x - other.x, y - other.y)
        nearest = int((away + 3.0 * turned).argmin())
        if away[nearest] > LANE_OFF or turned[nearest] > LANE_TURNED:
            return []
        cos, sin = math.cos(heading[nearest]), math.sin(heading[nearest])
        along = cos * (other.x - x[nearest]) + sin * (other.y - y[nearest])
        offset = cos * (other.y - y[nearest]) - sin * (other.x - x[nearest])
        # One that moves across its lane is leaving it.
        if abs(other.vy * cos - other.vx * sin) > 0.1 * other.speed + STANDS:
            return []
        station = stations[nearest] + along
        lengths = self.followed(self.ids[nearest], station, other, red, signs, station + other.speed * TIMES[-1] + 1.0)
        return [self.driven(lanes, station, end, other.speed, offset) for lanes, end in lengths]

    def followed(self, id, station, other, red, signs, reach):
        """The lanes from one on, and how far it may drive on them, in stations of the first."""
        lane = self.lane[id]
        lines = [line.s for line in lane.stop_lines if line.signal in red]
        lines += [] if signs else [sign.s for sign in lane.signs]
        for line in sorted(lines):
            left = line - station - other.length / 2.0
            if left > 0.0 and other.speed**2 <= 2.0 * GENTLE * left:
                return [([id], station + left)]
        if lane.length >= reach or not lane.successors:
            return [([id], reach)]
        turns = {next_id: self.lane[next_id].turn for next_id in lane.successors}
        shown = other.lights if other.lights in ("left", "right") else "straight"
        taken = [next_id for next_id, turn in turns.items() if turn == shown] or lane.successors
        return [([id, *lanes], lane.length + end) for next_id in taken
                for lanes, end in self.followed(next_id, station - lane.length, other, red, signs, reach - lane.length)]

    def driven(self, lanes, station, end, speed, offset):
        path = np.concatenate([self.paths[id] for id in lanes])
        steps = np.hypot(*np.diff(path, axis=0).T)
        path = path[np.append(True, steps > 0.05)]
        steps = np.diff(path, axis=0)
        on = np.append(0.0, np.cumsum(np.hypot(*steps.T)))
        headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        at = np.minimum(station + speed * TIMES, end)
        heading = np.interp(at, (on[1:] + on[:-1]) / 2.0, headings)
        # Beyond the last lane it is gone, and no longer foreseen anywhere.
        x, y = np.interp(at, on, path[:, 0], right=GONE), np.interp(at, on, path[:, 1], right=GONE)
        return np.column_stack([x - offset * np.sin(heading), y + offset * np.cos(heading), heading])


def straight(other):
    """The way of a road user that keeps its velocity: rows of x, y, heading at `TIMES`."""
    return np.column_stack([other.x + other.vx * TIMES, other.y + other.vy * TIMES, np.full(len(TIMES), other.heading)])


def arrival(distance, speed, accel, fastest):
    """When a vehicle that speeds up to `fastest` has driven a distance, s."""
    if distance <= 0.0:
        return 0.0
    fastest = max(fastest, speed, 0.1)
    rising = (fastest - speed) / accel
    risen = (speed + fastest) / 2.0 * rising
    if distance < risen:
        return (math.sqrt(speed**2 + 2.0 * accel * distance) - speed) / accel
    return rising + (distance - risen) / fastest


def in_order(found):
    """From the nearest on, up to the first that stands; none reaches beyond the next, as a car may beyond a line."""
    nearest = {}
    for leader in found:
        if leader.name not in nearest or leader.gap < nearest[leader.name].gap:
            nearest[leader.name] = leader
    leaders = sorted(nearest.values(), key=lambda leader: leader.gap)
    stands = next((index for index, leader in enumerate(leaders) if leader.speed == 0.0), len(leaders))
    leaders = leaders[: stands + 1]
    for index, (leader, after) in enumerate(zip(leaders, leaders[1:])):
        leaders[index] = leader._replace(length=max(min(leader.length, after.gap - leader.gap - 0.1), 0.1))
    return leaders


def write_network(folder, model, init):
    """The endless lane and the two types of vehicles; returns the options that SUMO is started with."""
    (folder / "nodes.xml").write_text(f'<nodes><node id="a" x="0" y="0"/><node id="b" x="{LANE_LENGTH}" y="0"/></nodes>')
    (folder / "edges.xml").write_text('<edges><edge id="way" from="a" to="b" numLanes="1" speed="50"/></edges>')
    netconvert = pathlib.Path(sys.executable).parent / "netconvert"
    subprocess.run([netconvert, "-n", folder / "nodes.xml", "-e", folder / "edges.xml", "-o", folder / "net.xml"],
                   check=True, stdout=subprocess.DEVNULL)
    length, brakes = init.vehicle.length, init.vehicle.max_decel
    (folder / "routes.xml").write_text(
        f'<routes><vType id="ego" carFollowModel="{model}" length="{length}" emergencyDecel="{brakes}" sigma="0" speedDev="0"/>'
        '<vType id="other" length="5" minGap="0"/><route id="way" edges="way"/></routes>')
    return ["-n", str(folder / "net.xml"), "-r", str(folder / "routes.xml"), "--step-length", str(init.period),
            "--step-method.ballistic", "--no-step-log", "--no-warnings", "--time-to-teleport", "-1", "--collision.action", "none"]


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "IDM"
    if chosen not in (*MODELS, "careful"):
        sys.exit(f"`{chosen}` is none of {', '.join(MODELS)}, careful")
    avastra.serve(lambda: Careful() if chosen == "careful" else Sumo(chosen))
