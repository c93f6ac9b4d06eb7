"""A follower that obeys the law, or breaks one rule of it: `python3 driver.py WHAT`, with one of the names in FAULTS."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "python"))

import avastra

FAULTS = ["sane", "red", "fast", "close", "brakes", "oncoming", "never"]
WHAT = sys.argv[1]
#: The time gap that it keeps, s.
GAP = 0.3 if WHAT == "close" else 1.5


class Follower(avastra.Driver):
    name = f"follower_{WHAT}"
    answer = "trajectory" if WHAT == "oncoming" else "acceleration"

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.steps = 0

    def accel(self, step):
        ego, front = step.ego, step.ego.route_s + self.vehicle.rear_axle_to_front
        ahead = [(gap, other.speed) for gap, other in self.on_the_way(step, front)]
        line = self.way.stop(step)
        if line is not None and WHAT != "red":
            ahead.append((line - front, 0.0))
        gap, speed = min(ahead, default=(1000.0, ego.speed))
        closing = ego.speed * (ego.speed - speed) / (2.0 * (2.0 * 3.0) ** 0.5)
        wanted = 2.0 + max(0.0, ego.speed * GAP + closing)
        most = self.way.speed(ego.route_s) * (1.3 if WHAT == "fast" else 1.0)
        return 2.0 * (1.0 - (ego.speed / most) ** 4 - (wanted / max(gap, 0.1)) ** 2)

    def on_the_way(self, step, front):
        for other in step.objects:
            beside = self.way.path.project(other.x, other.y)
            # Who drives along a lane keeps to it; a person who walks may be there soon.
            room = 3.0 if other.kind == "pedestrian" and other.speed > 0.2 else 0.5
            if beside.station > front and abs(beside.offset) < (self.vehicle.width + other.width) / 2.0 + room:
                yield beside.station - other.length / 2.0 - front, other

    def step(self, step):
        self.steps += 1
        accel = max(self.accel(step), -self.vehicle.max_decel)
        if WHAT == "never":
            accel = -self.vehicle.max_decel
        # A second of hard braking in every eight.
        if WHAT == "brakes" and self.steps % 80 >= 70:
            accel = -5.0
        if WHAT != "oncoming":
            return avastra.Acceleration(accel)
        points, station, speed = [], step.ego.route_s, step.ego.speed
        for tick in range(31):
            # It changes over within 30 m, and stays there.
            offset = 3.5 * min(1.0, max(0.0, (station - 15.0) / 30.0))
            points.append(avastra.TrajectoryPoint(step.t_us + tick * 100_000, *self.way.path.at(station, offset), v=speed))
            speed = max(0.0, min(speed + 0.1 * accel, self.way.speed(station)))
            station += 0.1 * speed
        return avastra.Trajectory(points)


avastra.serve(Follower)
