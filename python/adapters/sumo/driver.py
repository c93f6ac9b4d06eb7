"""SUMO's car-following models (PyPI `libsumo`, DLR) as driving systems under test: `driver.py IDM`, or EIDM, ACC, CACC, Krauss.

SUMO drives the ego vehicle in a world of our own making: one endless lane. In each step the speed of its vehicle is set to the real one's, and
what is in the way of the real one is put before it at the same gap: other road users that reach into the strip that the vehicle
sweeps along the route, and the line of a light or stop sign that holds. SUMO does one step of 0.1 s; the change of speed is the answer, and
avastra steers. Limits and bends are the lane's speed limit.

So SUMO's following is under test, and neither its lane changes nor its junction logic, which is never asked: a crossing vehicle is
seen only on the strip itself. Crashes with crossing or oncoming vehicles are due to this adapter and not to SUMO.
Parameters are SUMO's defaults, except the vehicle's own length and brakes, and `sigma` 0: the driver is not meant to dawdle.
"""

import math
import pathlib
import subprocess
import sys
import tempfile
import typing

import avastra
import libsumo

MODELS = ("IDM", "EIDM", "ACC", "CACC", "Krauss")
#: Added to both sides of the vehicle for the strip that it sweeps, m. Ours.
MARGIN = 0.3
#: The ego vehicle begins here on the endless lane, m; lanes of SUMO have a beginning, and vehicles a tail.
BEGIN = 100.0
LANE_LENGTH = 100_000.0
#: Farther ahead than this nothing is put before the vehicle, m.
REACH = 150.0


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

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        # Loaded anew: some models draw random numbers, and vehicles keep memories.
        options = [*self.options, "--seed", str(reset.seed % 2**31)]
        (libsumo.load if self.running else libsumo.start)(options if self.running else ["sumo", *options])
        self.running = True
        libsumo.vehicle.add("ego", "way", typeID="ego", departPos=str(BEGIN), departSpeed=str(reset.start.speed), departLane="0")
        libsumo.simulationStep()
        self.ahead = []

    def step(self, step):
        ego, front = step.ego, step.ego.route_s + self.vehicle.rear_axle_to_front
        sumo_front = libsumo.vehicle.getLanePosition("ego")
        libsumo.vehicle.setPreviousSpeed("ego", ego.speed)
        libsumo.lane.setMaxSpeed("way_0", max(self.way.speed(ego.route_s), 0.1))
        leaders = in_order(self.in_the_way(step, front))
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
        accel = (libsumo.vehicle.getSpeed("ego") - ego.speed) / self.period
        reason = f"follow {self.ahead[0]}" if self.ahead else "free"
        return avastra.Acceleration(accel, avastra.Internal(reason=reason))

    def in_the_way(self, step, front):
        """Everything on the strip ahead."""
        line = self.way.stop(step)
        if line is not None and line > front - 1.0:
            yield Leader("line", max(line - front, 0.0), 0.0, 1.0)
        for other in step.objects:
            beside = self.way.path.project(other.x, other.y)
            turned = other.heading - beside.heading
            cos, sin = abs(math.cos(turned)), abs(math.sin(turned))
            along, across = cos * other.length + sin * other.width, sin * other.length + cos * other.width
            gap = beside.station - along / 2.0 - front
            overlaps = abs(beside.offset) < (self.vehicle.width + across) / 2.0 + MARGIN
            # What reaches beside the vehicle's front is nothing that it could follow.
            if overlaps and beside.station > front and gap < REACH:
                speed = other.vx * math.cos(beside.heading) + other.vy * math.sin(beside.heading)
                yield Leader(f"object {other.id}", max(gap, 0.0), max(speed, 0.0), along)

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


def in_order(found):
    """From the nearest on, up to the first that stands; none reaches beyond the next, as a car may beyond a line."""
    leaders = sorted(found, key=lambda leader: leader.gap)
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
    if chosen not in MODELS:
        sys.exit(f"`{chosen}` is none of {', '.join(MODELS)}")
    avastra.serve(lambda: Sumo(chosen))
