"""A trajectory: 5 s along the route, braked evenly before whatever is ahead; avastra's controller follows it.

    avastra run scenarios/avastra45.ava --ads 'python3 python/examples/trajectory.py'
"""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))  # not needed after `pip install ./python`

import avastra


class Planner(avastra.Driver):
    name = "planner"
    answer = "trajectory"

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)

    def step(self, step):
        end = self.end(step)
        station, speed, points = step.ego.route_s, step.ego.speed, []
        for tick in range(51):
            pose = self.way.path.at(station)
            points.append(avastra.TrajectoryPoint(step.t_us + tick * 100_000, *pose, v=speed))
            wanted = min(self.way.speed(station), math.sqrt(2.0 * 2.0 * max(end - station, 0.0)))
            speed = max(0.0, speed + min(max(wanted - speed, -0.5), 0.15))
            station += 0.1 * speed
        return avastra.Trajectory(points)

    def end(self, step):
        """The station at which the rear axle has to stand."""
        front = self.vehicle.rear_axle_to_front
        ends = [self.way.stop(step) or math.inf]
        for other in step.objects:
            beside = self.way.path.project(other.x, other.y)
            if beside.station > step.ego.route_s + front and abs(beside.offset) < 2.5:
                ends.append(beside.station - other.length / 2.0)
        return min(ends) - front - 3.0


avastra.serve(Planner)
