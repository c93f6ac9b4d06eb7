"""The smallest driver: an acceleration alone, from IDM on the nearest object ahead on the route; avastra steers.

    avastra run scenarios/avastra45.ava --ads 'python3 python/examples/acceleration.py'
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))  # not needed after `pip install ./python`

import avastra


class Follower(avastra.Driver):
    name = "follower"
    answer = "acceleration"

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)

    def step(self, step):
        ego, front = step.ego, step.ego.route_s + self.vehicle.rear_axle_to_front
        ahead = [(gap, other.speed, f"follow {other.id}") for gap, other in self.on_the_way(step, front)]
        line = self.way.stop(step)
        if line is not None:
            ahead.append((line - front, 0.0, "light or sign"))
        gap, speed, reason = min(ahead, default=(1000.0, ego.speed, "free"))
        wanted = 2.0 + max(0.0, ego.speed * 1.5 + ego.speed * (ego.speed - speed) / (2.0 * (2.0 * 3.0) ** 0.5))
        free = (ego.speed / self.way.speed(ego.route_s)) ** 4
        accel = 2.0 * (1.0 - free - (wanted / max(gap, 0.1)) ** 2)
        return avastra.Acceleration(max(accel, -self.vehicle.max_decel), avastra.Internal(reason=reason))

    def on_the_way(self, step, front):
        for other in step.objects:
            beside = self.way.path.project(other.x, other.y)
            if beside.station > front and abs(beside.offset) < (self.vehicle.width + other.width) / 2.0 + 0.3:
                yield beside.station - other.length / 2.0 - front, other


avastra.serve(Follower)
