"""GPUDrive's policy (PufferLib 3.0.0, trained by self-play on Waymo's maps) as a driving system under test.

The policy is a network of 1,847 observations, an LSTM of 512 cells, 7 accelerations and 13 angles of the wheels. Only its weights are used,
of PufferLib's source distribution: the observation is rebuilt here as its `gpudrive.h` makes it, and the likeliest action is taken. Ours is:

- the goal. In training it was where a recorded vehicle came to within 9 s, and nothing told the way. Here it is a point of the route, `GOAL` m ahead;
- the road: avastra's lanes, with an edge where a lane's border lies in no other lane. Segments are as in training, but never longer than `SEGMENT`;
- pedestrians, cyclists and obstacles as cars of their size. In training it saw cars alone;
- the change of its actions into the wheels of avastra's vehicle: the same curvature, and the acceleration that its steps really made;
- no more acceleration than limits, bends, lights and stop signs allow, because it knows none of them.

It knows no lanes of its own direction: its only reasons to keep to a side are the goal and the edges. It knows no right of way either, and hardly sees others:
on PufferLib's own map `map_942.bin`, with the observation as rebuilt here, it ran into 28 of 29 cars that were put to stand on its way. Its actions are coarse: the smallest
turn has a radius of 20 m, and in training wheels turned at once.
"""

import math
import pathlib
import sys

import avastra
import careful
import numpy as np

#: How far ahead on the route the goal is, m. Ours, by trial: with 20 m it leaves the road more often.
GOAL = 12.0
#: Longest segment of the road, m. Ours: exactly straight lines, as Waymo's maps have none, would be seen as one segment whose middle is far away.
SEGMENT = 20.0
#: A border belongs to another lane if a point this far outside it does, m. Ours.
OUTSIDE = 0.3

# Figures of `gpudrive.h`: what is seen, and the scales of the observation.
ACCELS = np.array([-4.0, -2.667, -1.333, 0.0, 1.333, 2.667, 4.0])
STEERS = np.array([-1.0, -0.833, -0.667, -0.5, -0.333, -0.167, 0.0, 0.167, 0.333, 0.5, 0.667, 0.833, 1.0])
#: A step of 0.1 s changes the speed by this share of the acceleration times 0.1 s.
ACCEL_SHARE = 0.5
CARS, CARS_REACH = 63, 50.0
SEGMENTS, CELL, CELLS_REACH, CELL_SEGMENTS = 200, 5.0, 10, 10
DISTANCE, WIDTH, LENGTH, SPEED, SEGMENT_WIDTH = 100.0, 15.0, 30.0, 100.0, 0.001
#: Vehicles are this much smaller in training than they were recorded, in what is seen and in how they turn.
SHRUNK = 0.7
#: It divides directions by a macro `2 * PI` without brackets, which divides by 2 and multiplies by pi. The policy was trained with that.
TURN = 2.0 / math.pi
LANE, LINE, EDGE = 0.0, 1.0, 2.0
#: Polylines of more points than this lose those that span less than this area with their neighbours, m².
LONG, AREA = 10, 0.1
#: The network's parameters, in the order of its file.
SHAPES = {"ego": (64, 6), "road": (64, 13), "cars": (64, 7), "shared": (512, 192), "actor": (20, 512), "value": (1, 512)}
CELLS = 512


class GpuDrive(avastra.Driver):
    name = "GPUDrive policy"
    version = "3.0.0"
    answer = "control"

    def __init__(self, is_careful=False):
        self.is_careful = is_careful
        if is_careful:
            self.name = "careful planner as GPUDrive policy"

    def init(self, init):
        self.vehicle = init.vehicle
        self.policy = Careful() if self.is_careful else Policy(pathlib.Path(sys.prefix) / "gpudrive_weights.bin")

    def map(self, map):
        self.roads = map
        self.segments = segments(map)

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.policy.forget()

    def step(self, step):
        accel, steer = self.policy.act(*self.observed(step))
        curvature = curved(steer, SHRUNK * self.vehicle.length)
        allowed = self.way.wanted_speed(step) - step.ego.speed
        reason = "policy" if ACCEL_SHARE * accel <= allowed else "limit or line"
        return avastra.Control(min(ACCEL_SHARE * accel, allowed), math.atan(self.vehicle.wheelbase * curvature), avastra.Internal(reason=reason))

    def observed(self, step):
        """The vehicle and its goal, shape (6,); other road users, shape (63, 7); segments of the road, shape (200, 13)."""
        ego, ahead = step.ego, self.vehicle.rear_axle_to_centre
        here = np.array([ego.x + ahead * math.cos(ego.heading), ego.y + ahead * math.sin(ego.heading)])
        # Rows: forward and left of the vehicle.
        frame = np.array([[math.cos(ego.heading), math.sin(ego.heading)], [-math.sin(ego.heading), math.cos(ego.heading)]])
        goal = frame @ (np.array(self.way.path.at(ego.route_s + ahead + GOAL)[:2]) - here)
        own = np.array([*goal / DISTANCE, ego.speed / SPEED, SHRUNK * self.vehicle.width / WIDTH, SHRUNK * self.vehicle.length / LENGTH, 0.0])
        cars = np.zeros((CARS, 7))
        near = [other for other in step.objects if math.dist((other.x, other.y), here) < CARS_REACH]
        for row, other in zip(cars, near):
            turned = other.heading - ego.heading
            row[:] = (*frame @ (np.array([other.x, other.y]) - here) / DISTANCE, SHRUNK * other.width / WIDTH, SHRUNK * other.length / LENGTH,
                      math.cos(turned) / TURN, math.sin(turned) / TURN, other.speed / SPEED)
        return own, cars, self.road(here, frame)

    def road(self, here, frame):
        middles, directions, lengths, kinds, cells = self.segments
        rings = np.abs(cells - np.floor(here / CELL)).max(axis=1)
        order = np.argsort(rings, kind="stable")
        order = order[rings[order] <= CELLS_REACH][:SEGMENTS]
        rows = np.zeros((SEGMENTS, 13))
        # What is not there is a lane's segment of length 0.
        rows[:, 6] = 1.0
        rows[: len(order), 6] = 0.0
        rows[: len(order), :2] = (middles[order] - here) @ frame.T / DISTANCE
        rows[: len(order), 2], rows[: len(order), 3] = lengths[order] / 2.0 / DISTANCE, SEGMENT_WIDTH
        rows[: len(order), 4:6] = directions[order] @ frame.T / TURN
        rows[np.arange(len(order)), 6 + kinds[order].astype(int)] = 1.0
        return rows


class Policy:
    """The network: encoders with the largest value over all rows, a layer, an LSTM, and the likeliest actions."""

    def __init__(self, file):
        values, self.layers = np.fromfile(file, dtype=np.float32), {}
        for name, (to, of) in SHAPES.items():
            weights, biases, values = values[: to * of], values[to * of: to * of + to], values[to * of + to:]
            self.layers[name] = weights.reshape(to, of), biases
        wide = 4 * CELLS
        weights, biases = values[: -2 * wide].reshape(2, wide, CELLS), values[-2 * wide:].reshape(2, wide)
        self.cell = np.concatenate(weights, axis=1), biases.sum(axis=0)
        self.forget()

    def forget(self):
        self.hidden, self.memory = np.zeros(CELLS, np.float32), np.zeros(CELLS, np.float32)

    def act(self, own, cars, road):
        """Acceleration (m/s²) and angle of the wheels (rad) for an observation."""
        seen = np.concatenate([self.layer("ego", own), self.layer("road", road).max(axis=0), self.layer("cars", cars).max(axis=0)])
        gelu = seen * np.array([0.5 * (1.0 + math.erf(value / math.sqrt(2.0))) for value in seen], np.float32)
        inner = np.concatenate([np.maximum(self.layer("shared", gelu), 0.0), self.hidden])
        weights, biases = self.cell
        enter, keep, new, leave = np.split(weights @ inner + biases, 4)
        self.memory = sigmoid(keep) * self.memory + sigmoid(enter) * np.tanh(new)
        self.hidden = sigmoid(leave) * np.tanh(self.memory)
        logits = self.layer("actor", self.hidden)
        return ACCELS[logits[: len(ACCELS)].argmax()], STEERS[logits[len(ACCELS):].argmax()]

    def layer(self, name, values):
        weights, biases = self.layers[name]
        return values.astype(np.float32) @ weights.T + biases


class Careful:
    """The careful planner in place of the policy: it reads the observation, and takes one of the policy's actions."""

    def forget(self):
        pass

    def act(self, own, cars, _):
        x, y = DISTANCE * own[:2]
        speed, width, length = SPEED * own[2], WIDTH / SHRUNK * own[3], LENGTH / SHRUNK * own[4]
        curvature = 2.0 * y / (x**2 + y**2)
        vehicle = careful.Vehicle(length, width, speed, ACCEL_SHARE * ACCELS[-1], -ACCEL_SHARE * ACCELS[0])
        accel = careful.acceleration(vehicle, arc(curvature, math.hypot(x, y)), [read(car) for car in cars if car.any()], math.inf)
        steer = STEERS[np.argmin([abs(curved(steer, SHRUNK * length) - curvature) for steer in STEERS])]
        return ACCELS[np.flatnonzero(ACCEL_SHARE * ACCELS <= accel + 1e-6).max(initial=0)], steer


def read(car):
    """What a row of the observation says of a car, in the vehicle's frame."""
    x, y, width, length, cos, sin, speed = car
    heading, speed = math.atan2(sin, cos), SPEED * speed
    return careful.moving(DISTANCE * x, DISTANCE * y, heading, speed * math.cos(heading), speed * math.sin(heading), LENGTH / SHRUNK * length,
                          WIDTH / SHRUNK * width)


def arc(curvature, length):
    """A way that bends up to a length, and goes straight on; rows of station, x, y, heading."""
    ways = np.arange(0.0, careful.WAY, 0.5)
    headings = curvature * np.minimum(ways, length)
    x, y = (np.append(0.0, np.cumsum(0.5 * part(headings[:-1]))) for part in (np.cos, np.sin))
    return np.column_stack([ways, x, y, headings])


def curved(steer, length):
    """The curvature that an angle of the wheels makes, 1/m: its car turns about its middle, as if its length were its wheelbase."""
    slip = math.tanh(0.5 * math.tan(steer))
    return math.cos(slip) * math.tan(steer) / length


def sigmoid(values):
    return 1.0 / (1.0 + np.exp(-values))


def segments(map):
    """The map's segments: middles, directions, lengths, kinds and cells of the grid."""
    lanes = [(lane, np.array(lane.left), np.array(lane.right)) for lane in map.lanes]
    outlines = [np.concatenate([left, right[::-1]]) for _, left, right in lanes]
    found = []
    for index, (lane, left, right) in enumerate(lanes):
        found += pieces(np.array(lane.centerline), LANE)
        for border, side in ((left, 1.0), (right, -1.0)):
            along = np.diff(border, axis=0)
            outward = side * np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
            probes = (border[1:] + border[:-1]) / 2.0 + OUTSIDE * outward
            inside = np.zeros(len(probes), bool)
            for other, outline in enumerate(outlines):
                if other != index:
                    inside |= contains(outline, probes)
            # A border between two lanes is one line, which the lane to its right has drawn; in a junction there is none.
            neighbor = lane.left_neighbor
            draws = side > 0.0 and lane.junction is None and neighbor is not None and (neighbor.same_direction or lane.id < neighbor.id)
            for kind, wanted in ((EDGE, ~inside), (LINE, inside & draws)):
                for begin, end in runs(wanted):
                    found += pieces(border[begin: end + 1], kind)
    starts, ends, kinds = (np.array(column) for column in zip(*found))
    middles, along = (starts + ends) / 2.0, ends - starts
    lengths = np.hypot(*along.T)
    cells = np.floor(middles / CELL)
    _, which = np.unique(cells, axis=0, return_inverse=True)
    # Of each cell the first few are kept.
    order = np.argsort(which, kind="stable")
    counted = np.arange(len(order)) - np.searchsorted(which[order], which[order])
    kept = np.sort(order[counted < CELL_SEGMENTS])
    return middles[kept], (along / lengths[:, None])[kept], lengths[kept], kinds[kept], cells[kept]


def pieces(points, kind):
    """The segments of a polyline without its superfluous points, as start, end, kind."""
    points = list(points)
    while len(points) > LONG:
        kept = [points[0]]
        for index in range(1, len(points) - 1):
            (ax, ay), (bx, by), (cx, cy) = kept[-1], points[index], points[index + 1]
            small = abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2.0 < AREA
            if not small or math.dist(kept[-1], points[index + 1]) > SEGMENT:
                kept.append(points[index])
        kept.append(points[-1])
        if len(kept) == len(points):
            break
        points = kept
    return [(start, end, kind) for start, end in zip(points, points[1:]) if math.dist(start, end) > 1e-3]


def runs(flags):
    """Begins and ends of the runs of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return zip(edges[::2], edges[1::2])


def contains(outline, points):
    """Which points lie in a polygon: whether a ray to the right crosses its outline an odd number of times."""
    result = np.zeros(len(points), bool)
    near = np.flatnonzero(((points >= outline.min(axis=0)) & (points <= outline.max(axis=0))).all(axis=1))
    (x, y), (x0, y0), (x1, y1) = points[near].T[:, :, None], outline.T[:, None], np.roll(outline, -1, axis=0).T[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossed = ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    result[near] = crossed.sum(axis=1) % 2 == 1
    return result


if __name__ == "__main__":
    avastra.serve(lambda: GpuDrive(sys.argv[1:] == ["careful"]))
