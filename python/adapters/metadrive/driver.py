"""MetaDrive's learned expert (PyPI `metadrive-simulator` 0.3.0.1, trained with PPO) as a driving system under test.

The expert is a network of 275 observations and two actions, whose weights lie in the package. Only they are used: the observation is rebuilt
here as MetaDrive 0.3.0.1 makes it, and the mean of the actions is taken. Ours is what stands for MetaDrive's world:

- the route as MetaDrive's roads, each straight or an arc, with two checkpoints ahead at their ends;
- 240 rays to the outlines of road users, up to 50 m, and to a wall at the line of a light or stop sign that holds;
- its car: wheels that turn up to 40 degrees, and the forces of its engine and brakes, for which avastra's vehicle gets the same
  curvature and acceleration as far as it can;
- no engine force above what limits and bends allow, because the expert knows no limit but its car's 80 km/h.

The expert was trained on roads of two to three lanes of 3 to 4.5 m with bends of 25 m and more, among cars alone. Narrower bends, single lanes, pedestrians,
lights and crossing traffic are new to it.
"""

import importlib.util
import math
import pathlib
import sys

import avastra
import careful
import numpy as np

RAYS, REACH = 240, 50.0
OTHERS = 4
#: Figures of MetaDrive 0.3.0.1: of its default car, its maps and its observation.
WHEELBASE = 1.05234 + 1.4166
STEER_MAX = math.radians(40.0)
SPEED_MAX_KMH = 80.0
MASS, ENGINE, BRAKE = 1100.0, 800.0, 150.0
PHYSICS_STEP = 0.02
FRICTION_DECEL = 0.9 * 9.81
LANES_WIDTH_MAX = 4 * 4.5
LANE_WIDTH_MAX = 4.5
RADIUS_MAX = 60.0
ANGLE_MAX_DEG = 135.0
STEER_SCALE = 60.0
CHECKPOINT_REACH = 50.0

#: A stretch of the route bends if its radius is smaller than this, m.
BENDS = 90.0
#: Shorter stretches belong to the one before, m.
STRETCH_MIN = 8.0


class Expert(avastra.Driver):
    name = "MetaDrive expert"
    version = "0.3.0.1"
    answer = "control"

    def init(self, init):
        self.vehicle, self.period = init.vehicle, init.period
        package = pathlib.Path(importlib.util.find_spec("metadrive").origin).parent
        weights = np.load(package / "examples" / "ppo_expert" / "expert_weights.npz")
        names = ("fc_1", "fc_2", "fc_out")
        self.layers = [(weights[f"default_policy/{name}/kernel"], weights[f"default_policy/{name}/bias"]) for name in names]

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.stretches = stretches(reset.route)
        self.room = [self.way.room(float(station)) for station in range(int(self.way.path.length) + 1)]
        self.actions = [(0.0, 0.0), (0.0, 0.0)]
        self.heading = reset.start.heading

    def step(self, step):
        turn, pedal = (float(min(max(action, -1.0), 1.0)) for action in self.acted(self.observed(step)))
        self.actions = [self.actions[1], (turn, pedal)]
        self.heading = step.ego.heading
        curvature = math.tan(turn * STEER_MAX) / WHEELBASE
        return avastra.Control(self.accel(pedal, step.ego), math.atan(self.vehicle.wheelbase * curvature))

    def acted(self, seen):
        """The expert's actions: wheels and pedal, both in [-1, 1]."""
        value = seen
        for index, (kernel, bias) in enumerate(self.layers):
            value = value @ kernel + bias
            value = np.tanh(value) if index < 2 else value
        return value[:2]

    def accel(self, pedal, ego):
        """What MetaDrive's car makes of a pedal, m/s²: its brakes lock almost at a touch."""
        if pedal < 0.0:
            return -min(4.0 * BRAKE * -pedal / MASS / PHYSICS_STEP, FRICTION_DECEL)
        limit = self.way.speed(ego.route_s)
        if ego.speed > limit:
            # Beyond its highest speed its car only rolls; ours has bends to be slow for.
            return -2.0 * (ego.speed - limit)
        return 4.0 * ENGINE * pedal / MASS

    def observed(self, step):
        """MetaDrive's frame has y to the right: what is `right` below is positive there."""
        ego, ahead = step.ego, self.vehicle.rear_axle_to_centre
        x, y = ego.x + ahead * math.cos(ego.heading), ego.y + ahead * math.sin(ego.heading)
        here = self.way.path.project(x, y)
        left, right = self.room[min(max(int(here.station), 0), len(self.room) - 1)]
        turned = abs(avastra.wrap(ego.heading - self.heading))
        state = [
            (left - here.offset) / LANES_WIDTH_MAX,
            (right + here.offset) / LANES_WIDTH_MAX,
            math.sin(here.heading - ego.heading) / 2.0 + 0.5,
            (ego.speed * 3.6 + 1.0) / (SPEED_MAX_KMH + 1.0),
            (self.actions[1][0] / STEER_SCALE + 1.0) / 2.0,
            (self.actions[0][0] + 1.0) / 2.0,
            (self.actions[0][1] + 1.0) / 2.0,
            turned / self.period,
            (-here.offset * 2.0 / LANE_WIDTH_MAX + 1.0) / 2.0,
        ]
        frame = Frame(x, y, ego.heading, ego.speed)
        boxes = [(other.x, other.y, other.heading, other.length / 2.0, other.width / 2.0) for other in step.objects]
        line = self.way.stop(step)
        if line is not None:
            wall = self.way.path.at(line + 1.0)
            boxes.append((*wall, 0.5, 2.5))
        navigation = self.navigation(here.station, left, right, frame)
        return np.clip(np.array(state + navigation + self.others(step, frame) + rays(frame, boxes)), 0.0, 1.0)

    def navigation(self, station, left, right, frame):
        index = next((index for index, stretch in enumerate(self.stretches) if station < stretch.end), len(self.stretches) - 1)
        numbers = []
        for stretch in (self.stretches[index], self.stretches[min(index + 1, len(self.stretches) - 1)]):
            # The checkpoint lies in the middle of the road's lanes.
            checkpoint = self.way.path.at(stretch.end, (left - right) / 2.0)
            along, aside = frame.seen(checkpoint.x, checkpoint.y, CHECKPOINT_REACH)
            numbers += [
                (along / CHECKPOINT_REACH + 1.0) / 2.0,
                (aside / CHECKPOINT_REACH + 1.0) / 2.0,
                stretch.radius / (RADIUS_MAX + left + right),
                (stretch.clockwise + 1.0) / 2.0,
                (math.degrees(stretch.angle) / ANGLE_MAX_DEG + 1.0) / 2.0,
            ]
        return numbers

    def others(self, step, frame):
        vehicles = [other for other in step.objects if other.kind not in ("pedestrian", "animal", "object")]
        near = sorted(vehicles, key=lambda other: math.dist((other.x, other.y), (frame.x, frame.y)))
        numbers = []
        for other in near[:OTHERS]:
            if math.dist((other.x, other.y), (frame.x, frame.y)) > REACH + other.length / 2.0:
                break
            along, aside = frame.seen(other.x, other.y)
            along_kmh = 3.6 * (other.vx * frame.cos + other.vy * frame.sin - frame.speed)
            aside_kmh = 3.6 * (other.vx * frame.sin - other.vy * frame.cos)
            numbers += [(along / REACH + 1.0) / 2.0, (aside / REACH + 1.0) / 2.0,
                        (along_kmh / SPEED_MAX_KMH + 1.0) / 2.0, (aside_kmh / SPEED_MAX_KMH + 1.0) / 2.0]
        return numbers + [0.0] * (4 * OTHERS - len(numbers))


class Careful(Expert):
    """The careful planner in the expert's place: it reads the 275 observations. Rays say where something is, but not how it moves."""

    name = "careful planner as MetaDrive expert"

    def acted(self, seen):
        speed, half = (seen[3] * (SPEED_MAX_KMH + 1.0) - 1.0) / 3.6, LANE_WIDTH_MAX / 2.0
        way = bent(seen[9:19], LANES_WIDTH_MAX * (seen[0] + seen[1]), (2.0 * seen[8] - 1.0) * half, math.asin(2.0 * seen[2] - 1.0))
        vehicle = careful.Vehicle(self.vehicle.length, self.vehicle.width, speed, 4.0 * ENGINE / MASS, min(FRICTION_DECEL, self.vehicle.max_decel))
        accel = careful.acceleration(vehicle, way, met(seen[35:]) + known(seen[19:35], speed), SPEED_MAX_KMH / 3.6)
        ahead = way[min(int((4.0 + 0.5 * speed) / 0.5), len(way) - 1)]
        curvature = 2.0 * ahead[2] / (ahead[1] ** 2 + ahead[2] ** 2)
        pedal = accel * MASS / (4.0 * ENGINE) if accel >= 0.0 else accel * MASS * PHYSICS_STEP / (4.0 * BRAKE)
        return math.atan(WHEELBASE * curvature) / STEER_MAX, pedal


def bent(navigation, width, aside, turned):
    """The way through two stretches, in the vehicle's frame with y to the left; `aside` is how far its beginning lies to the left."""
    ways, bends, left = np.arange(0.0, careful.WAY, 0.5), [], 0.0
    for along, across, radius, clockwise, _ in navigation.reshape(2, 5):
        radius *= RADIUS_MAX + width
        reach = left + CHECKPOINT_REACH * math.hypot(2.0 * along - 1.0, 2.0 * across - 1.0) if not bends else math.inf
        bends.append((left, reach, (1.0 - 2.0 * clockwise) / radius if radius > 1.0 else 0.0))
        left = reach
    curvatures = np.select([(ways >= begin) & (ways < end) for begin, end, _ in bends], [bend for _, _, bend in bends])
    headings = turned + np.append(0.0, np.cumsum(0.5 * curvatures[:-1]))
    x, y = (np.append(0.0, np.cumsum(0.5 * part(headings[:-1]))) for part in (np.cos, np.sin))
    return np.column_stack([ways, x - aside * math.sin(turned), y + aside * math.cos(turned), headings])


def met(shares):
    """What the rays meet, as small things that stand."""
    hits = np.flatnonzero(shares < 1.0)
    angles = -hits * 2.0 * math.pi / RAYS
    return [careful.moving(REACH * share * math.cos(angle), REACH * share * math.sin(angle), 0.0, 0.0, 0.0, 0.5, 0.5)
            for share, angle in zip(shares[hits], angles)]


def known(numbers, speed):
    """The vehicles whose velocity is known, of a usual size."""
    found = []
    for along, aside, along_kmh, aside_kmh in numbers.reshape(OTHERS, 4):
        if (along, aside) != (0.0, 0.0):
            vx, vy = (2.0 * along_kmh - 1.0) * SPEED_MAX_KMH / 3.6 + speed, -(2.0 * aside_kmh - 1.0) * SPEED_MAX_KMH / 3.6
            heading = math.atan2(vy, vx) if math.hypot(vx, vy) > 0.5 else 0.0
            found.append(careful.moving((2.0 * along - 1.0) * REACH, -(2.0 * aside - 1.0) * REACH, heading, vx, vy, 4.8, 1.9))
    return found


class Frame:
    """The ego vehicle's own frame: its centre, ahead and to the right."""

    def __init__(self, x, y, heading, speed):
        self.x, self.y, self.heading, self.speed = x, y, heading, speed
        self.cos, self.sin = math.cos(heading), math.sin(heading)

    def seen(self, x, y, reach=math.inf):
        """How far ahead and to the right a point is; one beyond `reach` is drawn in to it."""
        dx, dy = x - self.x, y - self.y
        scale = min(1.0, reach / max(math.hypot(dx, dy), 1e-9))
        return scale * (dx * self.cos + dy * self.sin), scale * (dx * self.sin - dy * self.cos)


class Stretch:
    """A part of the route that is straight or an arc: where it ends, its radius (0: straight), its sense and its angle."""

    def __init__(self, end, length, turn):
        self.end = end
        bends = abs(turn) > length / BENDS
        self.radius = length / abs(turn) if bends else 0.0
        self.clockwise = (1.0 if turn < 0.0 else -1.0) if bends else 0.0
        self.angle = abs(turn) if bends else 0.0


def stretches(route):
    """The route, cut where it begins or ends to bend."""
    parts = []
    for index, point in enumerate(route.path):
        sense = 0 if abs(point.curvature) < 1.0 / BENDS else (1 if point.curvature > 0.0 else -1)
        if parts and (parts[-1][0] == sense or (index - parts[-1][1]) * route.spacing < STRETCH_MIN):
            continue
        parts.append((sense, index))
    starts = [index for _, index in parts] + [len(route.path) - 1]
    found = []
    for begin, end in zip(starts, starts[1:]):
        turn = sum(point.curvature for point in route.path[begin:end]) * route.spacing
        found.append(Stretch(end * route.spacing, max((end - begin) * route.spacing, route.spacing), turn))
    return found


def rays(frame, boxes):
    """The share of 50 m after which each ray meets a box; ray 0 is ahead, the following go clockwise."""
    angles = frame.heading - np.arange(RAYS) * 2.0 * math.pi / RAYS
    shares = np.ones(RAYS)
    for x, y, heading, half_length, half_width in boxes:
        cos, sin = math.cos(heading), math.sin(heading)
        dx, dy = frame.x - x, frame.y - y
        origin = np.array([dx * cos + dy * sin, dy * cos - dx * sin])
        direction = REACH * np.stack([np.cos(angles - heading), np.sin(angles - heading)])
        direction = np.where(np.abs(direction) < 1e-9, 1e-9, direction)
        half = np.array([half_length, half_width])
        nearer = ((-half - origin)[:, None] / direction, (half - origin)[:, None] / direction)
        enters = np.minimum(*nearer).max(axis=0)
        leaves = np.maximum(*nearer).min(axis=0)
        hits = (enters <= leaves) & (leaves > 0.0) & (enters < 1.0)
        shares = np.where(hits, np.minimum(shares, np.maximum(enters, 0.0)), shares)
    return shares.tolist()


if __name__ == "__main__":
    avastra.serve({"": Expert, "careful": Careful}[sys.argv[1] if len(sys.argv) > 1 else ""])
