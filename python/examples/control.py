"""Acceleration and steering: follows the route by pure pursuit and stands still while anything is close ahead of it.

    avastra run scenarios/avastra45.ava --ads 'python3 python/examples/control.py'
"""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))  # not needed after `pip install ./python`

import avastra


class Pursuit(avastra.Driver):
    name = "pursuit"
    answer = "control"

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)

    def step(self, step):
        ego = step.ego
        aim = self.way.path.at(ego.route_s + 3.0 + 0.6 * ego.speed)
        bearing = math.atan2(aim.y - ego.y, aim.x - ego.x) - ego.heading
        distance = math.hypot(aim.x - ego.x, aim.y - ego.y)
        steer = math.atan(2.0 * self.vehicle.wheelbase * math.sin(bearing) / distance)
        braking = max(0.0, self.braking_distance(step))
        wanted = min(self.way.speed(ego.route_s), math.sqrt(2.0 * 2.0 * braking))
        return avastra.Control(accel=2.0 * (wanted - ego.speed), steer=steer)

    def braking_distance(self, step):
        front = step.ego.route_s + self.vehicle.rear_axle_to_front
        ends = [self.way.stop(step) or math.inf]
        for other in step.objects:
            beside = self.way.path.project(other.x, other.y)
            if beside.station > front and abs(beside.offset) < 2.5:
                ends.append(beside.station - other.length / 2.0)
        return min(ends) - front - 3.0


avastra.serve(Pursuit)
