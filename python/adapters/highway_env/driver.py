"""highway-env's IDM and MOBIL (PyPI `highway-env`, Farama) as a driving system under test.

The driver is its `IDMVehicle` as it comes: every parameter is the package's. Ours is the road that it sees, in each step:

- one lane for the route and one for each lane of the own direction beside it, as long as it goes along (a "strand");
- every object as a vehicle that keeps its speed. The model measures from centre to centre and takes all vehicles to be 5 m long, so an object
  is moved along the lane until its end that is nearer to the ego vehicle is where that of such a car would be;
- a light or stop sign that holds, and the end of a strand before the goal, as an obstacle;
- speed limits and bends as its target speed, because IDM slows down for neither.

Its steering law presumes a wheel that turns at once. So the answer is no wheel angle but a trajectory: the model's own vehicle, driven on
for 1 s by the acceleration of now and its steering law, and in the next step from where it was to be by then, unless the real
vehicle is farther than `ASTRAY` from there.

It knows no right of way: it brakes for what is on its lane or within 1 m beside it, and for nothing else.
"""

import math

import avastra
import highway_env
import numpy as np
from highway_env.road.lane import AbstractLane, LineType
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Obstacle

#: Half of the length that the model takes every vehicle to have, m.
HALF_LENGTH = IDMVehicle.LENGTH / 2.0
#: A lane that ends sooner than this is none to change to, m.
ROOM_TO_CHANGE = 60.0
#: A vehicle on a lane that ends sooner than this has to leave it, m.
HAS_TO_LEAVE = 120.0
#: The model's vehicle is put back to the real one when they are this far apart, m and m/s.
ASTRAY = 1.0
#: Points of the answer, a period apart.
POINTS = 11
#: Parts of a period in which the model's vehicle moves: its steering law swings in long steps, the more so the slower it drives.
PARTS, PARTS_SLOW, SLOW = 2, 5, 5.0
#: Names of the only two nodes of the network.
EDGE = ("start", "goal")


class Strand(AbstractLane):
    """Lanes of the map that follow each other beside the route, as one lane of highway-env."""

    def __init__(self, lanes):
        points = [point for lane in lanes for point in lane.centerline]
        self.path = avastra.Path(points)
        self.length = self.path.length
        self.width = min(max(math.dist(left, right) for left, right in zip(lane.left, lane.right)) for lane in lanes)
        self.ids = {lane.id for lane in lanes}
        self.line_types = [LineType.STRIPED, LineType.STRIPED]
        # None: the ego vehicle's own target speed holds.
        self.speed_limit = None
        self.forbidden = False
        self.priority = 0

    def position(self, longitudinal, lateral):
        return np.array(self.path.at(longitudinal, lateral)[:2])

    def local_coordinates(self, position):
        beside = self.path.project(*position)
        return beside.station, beside.offset

    def heading_at(self, longitudinal):
        return self.path.at(longitudinal).heading

    def width_at(self, longitudinal):
        return self.width


class Network(RoadNetwork):
    """The strands as lanes of one road. They need not lie side by side in the order of their numbers: some begin where others have ended."""

    def __init__(self, strands):
        super().__init__()
        self.strands = strands
        for strand in strands:
            self.add_lane(*EDGE, strand)

    def side_lanes_at(self, index, position):
        """The nearest strand on either side of a place."""
        middle = self.strands[index[2]].path.project(*position)
        here = self.strands[index[2]].path.at(middle.station)
        sides = {}
        for number, strand in enumerate(self.strands):
            station, offset = strand.local_coordinates(here[:2])
            if number == index[2] or not 0.0 <= station < strand.length:
                continue
            side = offset < 0.0
            if side not in sides or abs(offset) < abs(sides[side][0]):
                sides[side] = (offset, (*EDGE, number))
        return [lane for _, lane in sides.values()]


def strands(map, route):
    """The strands along a route, from left to right."""
    chains, beside_before = [], {}
    for step in route.lanes:
        group = beside(map, step.id)
        if step.id in beside_before:
            continue
        chain_of = {}
        for lane in group:
            before = next((name for name in lane.predecessors if name in beside_before), None)
            chain = beside_before.get(before)
            if chain is None or chain in chain_of.values():
                chain = len(chains)
                chains.append([])
            chains[chain].append(lane)
            chain_of[lane.id] = chain
        beside_before = chain_of
    path = avastra.Path([point[:2] for point in route.path])
    found = [Strand(chain) for chain in chains]

    def offset(strand):
        middle = strand.path.at(strand.length / 2.0)
        return path.project(middle.x, middle.y).offset

    return sorted(found, key=offset, reverse=True)


def beside(map, name):
    """A lane and those of its direction beside it, from left to right."""
    lane, group = map.lane[name], [map.lane[name]]
    while lane.left_neighbor and lane.left_neighbor.same_direction:
        lane = map.lane[lane.left_neighbor.id]
        group.insert(0, lane)
    lane = map.lane[name]
    while lane.right_neighbor and lane.right_neighbor.same_direction:
        lane = map.lane[lane.right_neighbor.id]
        group.append(lane)
    return group


class HighwayEnv(avastra.Driver):
    name = "highway-env IDM+MOBIL"
    version = "1.12.1"
    answer = "trajectory"

    def init(self, init):
        self.vehicle, self.period = init.vehicle, init.period

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.strands = strands(self.roads, reset.route)
        network = Network(self.strands)
        self.goal_lane = reset.route.lanes[-1].id
        self.road = Road(network, np_random=np.random.RandomState(reset.seed % 2**32))
        self.ego = None

    def step(self, step):
        ego = self.place(step)
        station = ego.lane.local_coordinates(ego.position)[0]
        for strand in self.strands:
            strand.forbidden = strand.length - strand.local_coordinates(ego.position)[0] < ROOM_TO_CHANGE
        ego.target_speed = self.way.speed(step.ego.route_s)
        ego.route = self.must_change(ego, station)
        self.road.vehicles = [ego] + [self.other(ego, other) for other in step.objects]
        self.road.objects = self.obstacles(step)
        # The model asks for the lanes beside the ego vehicle's own, and for no other's.
        self.road.network.side_lanes = lambda index: self.road.network.side_lanes_at(index, ego.position)
        ego.act()
        ego.timer += self.period
        return self.driven_on(step.t_us)

    def place(self, step):
        """The model's vehicle, in step with the real one."""
        real, ahead = step.ego, self.vehicle.rear_axle_to_centre
        centre = np.array([real.x + ahead * math.cos(real.heading), real.y + ahead * math.sin(real.heading)])
        if self.ego is None:
            self.ego = IDMVehicle(self.road, centre, real.heading, real.speed)
        ego = self.ego
        if math.dist(centre, ego.position) > ASTRAY or abs(ego.speed - real.speed) > ASTRAY:
            ego.position, ego.heading, ego.speed = centre, real.heading, real.speed
            ego.on_state_update()
        return ego

    def driven_on(self, now_us):
        """The way of the model's vehicle from now on; afterwards it is where it will be one period from now."""
        ego, points, after = self.ego, [], None
        for index in range(POINTS):
            x, y = ego.position - self.vehicle.rear_axle_to_centre * ego.direction
            points.append(avastra.TrajectoryPoint(now_us + round(index * 1e6 * self.period), x, y, ego.heading, max(ego.speed, 0.0)))
            ego.action["acceleration"] = max(ego.action["acceleration"], -ego.speed / self.period)
            parts = PARTS if ego.speed > SLOW else PARTS_SLOW
            for _ in range(parts):
                ego.action["steering"] = ego.steering_control(ego.target_lane_index)
                Vehicle.step(ego, self.period / parts)
            after = after or (ego.position.copy(), ego.heading, ego.speed)
        ego.position, ego.heading, ego.speed = after
        ego.on_state_update()
        return avastra.Trajectory(points)

    def must_change(self, ego, station):
        """The route of highway-env: it names a lane where the vehicle has to leave its own, and none where it is free."""
        goal = self.following(ego)
        leaves = ego.lane.length - station < HAS_TO_LEAVE and goal is not None and goal != ego.lane_index[2]
        return [(*EDGE, goal)] if leaves else None

    def following(self, ego):
        """The strand beside the ego vehicle that goes on farthest along the route; None if its own does."""
        front = [(strand.length - strand.local_coordinates(ego.position)[0], index)
                 for index, strand in enumerate(self.strands) if strand.is_reachable_from(ego.position) or strand is ego.lane]
        farthest, index = max(front)
        own = ego.lane.length - ego.lane.local_coordinates(ego.position)[0]
        return index if farthest > own + 10.0 else None

    def other(self, ego, other):
        """An object as a vehicle of the model."""
        lane_heading = ego.lane.heading_at(ego.lane.local_coordinates((other.x, other.y))[0])
        turned = other.heading - lane_heading
        half = (abs(math.cos(turned)) * other.length + abs(math.sin(turned)) * other.width) / 2.0
        along = np.array([math.cos(lane_heading), math.sin(lane_heading)])
        away = np.dot(np.array([other.x, other.y]) - ego.position, along)
        # A car of the model within a longer body, as near to the ego vehicle as it gets: beside it while the two are abreast.
        shift = min(max(-away, HALF_LENGTH - half), half - HALF_LENGTH) if half > HALF_LENGTH else math.copysign(HALF_LENGTH - half, away)
        position = np.array([other.x, other.y]) + along * shift
        heading = math.atan2(other.vy, other.vx) if other.speed > 0.5 else other.heading
        return ControlledVehicle(self.road, position, heading, other.speed)

    def obstacles(self, step):
        """What holds on the road itself."""
        walls = []
        line = self.way.stop(step)
        if line is not None:
            walls.append(self.way.path.at(line + HALF_LENGTH))
        for strand in self.strands:
            end = strand.path.at(strand.length)
            if self.goal_lane not in strand.ids and self.leaves_route(strand):
                walls.append(end)
        return [Obstacle(self.road, (wall.x, wall.y), wall.heading) for wall in walls]

    def leaves_route(self, strand):
        """Whether another strand goes on where this one ends."""
        end = strand.path.at(strand.length)
        on = self.way.path.project(end.x, end.y)
        return abs(on.offset) > 1.0 and on.station < self.way.path.length - 1.0


if __name__ == "__main__":
    avastra.serve(HighwayEnv)
