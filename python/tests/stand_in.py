"""A stand-in for the simulator, so that drivers and adapters can be tried without avastra.

It speaks avastra-ads/1 with a command, on roads of its own, with a kinematic car behind simple lags:

    python3 python/tests/stand_in.py bend -- python3 python/examples/control.py

`straight` has a slow leader that stops, `bend` a right angle of 12 m radius, `light` a red light that turns green, `beside` a
stopped car in the own lane of a street of two lanes. It prints how the drive ended.
"""

import json
import math
import pathlib
import subprocess
import sys
from typing import Any, Dict, List, Optional

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))

from avastra import Path, wrap

TICK = 0.02
VEHICLE = {
    "length": 4.7, "width": 2.06, "height": 2.05, "wheelbase": 2.837, "rear_axle_to_front": 3.705, "rear_axle_to_back": 0.995,
    "max_steer": 0.5127, "max_steer_rate": 0.436, "max_accel": 2.0, "max_decel": 6.0, "mass": 2120.0,
}
INIT = {
    "type": "init", "protocol": "avastra-ads/1", "simulator": "stand-in", "tick_us": 20000, "period_us": 100000,
    "observation": "truth", "vehicle": VEHICLE,
}
WIDTH = 3.5
LIMIT = 13.9


def line(bend: bool) -> Path:
    """200 m ahead; with a bend 80 m, a quarter of a circle to the left, and 80 m."""
    points, x, y, heading = [], 0.0, 0.0, 0.0
    for index in range(201):
        points.append((x, y))
        heading += 1.0 / 12.0 if bend and 80 <= index < 80 + 12.0 * math.pi / 2.0 else 0.0
        x, y = x + math.cos(heading), y + math.sin(heading)
    return Path(points)


def shifted(path: Path, offset: float) -> List[List[float]]:
    return [list(path.at(station, offset)[:2]) for station in path.stations]


def lane(path: Path, name: str, offset: float, left: Optional[str], right: Optional[str], light: bool) -> Dict[str, Any]:
    def beside(other: Optional[str]) -> Optional[Dict[str, Any]]:
        return {"id": other, "same_direction": True, "gap": 0.0} if other else None

    return {
        "id": name, "length": path.length, "s": path.stations, "centerline": shifted(path, offset),
        "left": shifted(path, offset + WIDTH / 2.0), "right": shifted(path, offset - WIDTH / 2.0), "speed_limit": LIMIT,
        "turn": "straight", "junction": None, "successors": [], "predecessors": [], "left_neighbor": beside(left),
        "right_neighbor": beside(right), "changes_left": [[0.0, path.length]] if left else [],
        "changes_right": [[0.0, path.length]] if right else [],
        "stop_lines": [{"s": 100.0, "signal": "L"}] if light else [], "signs": [], "precedence": "equal",
    }


class World:
    """One drive on one road: what to send, and what answers do."""

    def __init__(self, road: str):
        self.road = road
        self.path = line(road == "bend")
        self.light = road == "light"
        two = road == "beside"
        lanes = [lane(self.path, "own", 0.0, "left" if two else None, None, self.light)]
        if two:
            lanes.append(lane(self.path, "left", WIDTH, None, "own", self.light))
        self.map = {"type": "map", "id": road, "opendrive": None, "lanes": lanes,
                    "signals": [{"id": "L", "x": 104.0, "y": -4.0}] if self.light else [], "crosswalks": []}
        self.time_us = 0
        self.start, self.goal = 5.0, 165.0
        pose = self.path.at(self.start)
        self.x, self.y, self.heading, self.speed, self.steer, self.accel = *pose, 0.0, 0.0, 0.0
        # Station, speed: a leader that drives at 6 m/s and stops, or a car that stands.
        self.other = [60.0, 6.0] if road == "straight" else [90.0, 0.0] if two else None
        self.worst_offset = 0.0
        self.least_gap = math.inf

    def reset(self) -> Dict[str, Any]:
        goal = self.path.at(self.start + self.goal)
        route_length = min(self.goal + 30.0, self.path.length - self.start)
        stations = [self.start + index for index in range(int(route_length) + 1)]
        points = [[*self.path.at(station), self.path.curvature(station, 1.0), LIMIT] for station in stations]
        return {
            "type": "reset", "seed": 1, "map": self.road,
            "start": {"x": self.x, "y": self.y, "heading": self.heading, "speed": 0.0},
            "goal": {"x": goal.x, "y": goal.y, "heading": goal.heading, "lane": "own", "route_s": self.goal},
            "route": {"lanes": [{"id": "own", "from": 0.0, "to": route_length}], "length": route_length, "spacing": 1.0,
                      "path": points, "changes": [], "signs": [], "crosswalks": [],
                      "stop_lines": [{"route_s": 100.0 - self.start, "signal": "L"}] if self.light else []},
        }

    def step(self, seq: int) -> Dict[str, Any]:
        beside = self.path.project(self.x, self.y)
        objects = []
        if self.other:
            pose = self.path.at(self.other[0])
            vx, vy = self.other[1] * math.cos(pose.heading), self.other[1] * math.sin(pose.heading)
            objects.append({"id": 1, "class": "car", "x": pose.x, "y": pose.y, "heading": pose.heading, "vx": vx, "vy": vy,
                            "length": 4.8, "width": 1.85, "height": 1.45, "visible": 1.0})
        state = "red" if self.time_us < 25_000_000 else "green"
        return {
            "type": "step", "seq": seq, "t_us": self.time_us,
            "ego": {"x": self.x, "y": self.y, "heading": self.heading, "vx": self.speed * math.cos(self.heading),
                    "vy": self.speed * math.sin(self.heading), "speed": self.speed, "accel": self.accel,
                    "yaw_rate": self.speed * math.tan(self.steer) / VEHICLE["wheelbase"], "steer": self.steer,
                    "touched": False, "lane": "own", "s": beside.station, "d": beside.offset,
                    "route_s": beside.station - self.start, "route_d": beside.offset, "position_std": 0.0},
            "objects": objects, "signals": [{"id": "L", "state": state}] if self.light else [],
            "conditions": {"light": 1.0, "rain": 0.0, "visibility": 10000.0, "water": 0.0, "friction": 0.85},
        }

    def obey(self, answer: Dict[str, Any]) -> None:
        """0.1 s under one answer."""
        for _ in range(5):
            accel, steer = self._command(answer)
            self.accel += (min(max(accel, -8.0), 4.0) - self.accel) * TICK / 0.15
            rate = min(max((steer - self.steer) / 0.1, -VEHICLE["max_steer_rate"]), VEHICLE["max_steer_rate"])
            self.steer = min(max(self.steer + rate * TICK, -VEHICLE["max_steer"]), VEHICLE["max_steer"])
            self.speed = max(0.0, self.speed + self.accel * TICK)
            self.accel = 0.0 if self.speed == 0.0 and self.accel < 0.0 else self.accel
            self.heading = wrap(self.heading + self.speed * math.tan(self.steer) / VEHICLE["wheelbase"] * TICK)
            self.x += self.speed * math.cos(self.heading) * TICK
            self.y += self.speed * math.sin(self.heading) * TICK
            self.time_us += 20_000
            if self.other:
                if self.road == "straight" and self.time_us > 12_000_000:
                    self.other[1] = max(0.0, self.other[1] - 4.0 * TICK)
                self.other[0] += self.other[1] * TICK
        beside = self.path.project(self.x, self.y)
        self.worst_offset = max(self.worst_offset, abs(beside.offset))
        if self.other and abs(beside.offset) < 1.95:
            gap = self.other[0] - 2.4 - beside.station - VEHICLE["rear_axle_to_front"]
            if beside.station < self.other[0]:
                self.least_gap = min(self.least_gap, gap)

    def _command(self, answer: Dict[str, Any]) -> "tuple[float, float]":
        if answer["type"] == "control":
            return answer["accel"], answer["steer"]
        if answer["type"] == "acceleration":
            return answer["accel"], self._pursuit(self.path, self.path.project(self.x, self.y).station)
        points = answer["points"]
        after = next(index for index, point in enumerate(points) if point["t_us"] > self.time_us)
        before, then = points[max(after - 1, 0)], points[after]
        share = (self.time_us - before["t_us"]) / (then["t_us"] - before["t_us"])
        speed = before["v"] + share * (then["v"] - before["v"])
        feed = (then["v"] - before["v"]) / (then["t_us"] - before["t_us"]) * 1e6
        accel = feed + 1.5 * (speed - self.speed)
        if math.hypot(points[-1]["x"] - points[0]["x"], points[-1]["y"] - points[0]["y"]) < 0.5:
            return accel, self.steer
        path = Path([(point["x"], point["y"]) for point in points])
        here = path.project(self.x, self.y).station
        wanted = path.project(before["x"] + share * (then["x"] - before["x"]),
                              before["y"] + share * (then["y"] - before["y"])).station
        return accel + 0.5 * (wanted - here), self._pursuit(path, here)

    def _pursuit(self, path: Path, station: float) -> float:
        aim = path.at(station + 2.5 + 0.4 * self.speed)
        bearing = wrap(math.atan2(aim.y - self.y, aim.x - self.x) - self.heading)
        distance = math.hypot(aim.x - self.x, aim.y - self.y)
        return math.atan(2.0 * VEHICLE["wheelbase"] * math.sin(bearing) / max(distance, 1.0))

    def ended(self) -> Optional[str]:
        beside = self.path.project(self.x, self.y)
        if self.other and self.least_gap < 0.0:
            return "contact"
        if beside.station - self.start > self.goal:
            return "arrived"
        if self.time_us >= 60_000_000:
            return "standing" if self.speed < 0.1 else "late"
        return None


class Program:
    """A driver in a process of its own. `talk` collects the conversation as (direction, line)."""

    def __init__(self, command: List[str]):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.talk: List[List[str]] = []

    def ask(self, message: Dict[str, Any], answered: bool = True) -> Dict[str, Any]:
        line = json.dumps(message)
        self.talk.append([">", line])
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()
        if not answered:
            return {}
        reply = self.process.stdout.readline().decode().rstrip("\n")
        self.talk.append(["<", reply])
        if not reply:
            raise RuntimeError(f"the program ended with status {self.process.wait()}")
        return json.loads(reply)

    def close(self) -> int:
        self.ask({"type": "close"}, answered=False)
        self.process.stdin.close()
        status = self.process.wait(timeout=20)
        self.process.stdout.close()
        return status


def drive(program: Program, road: str, trace: bool = False) -> World:
    """One episode. `init` must have been sent."""
    world = World(road)
    program.ask(world.map)
    program.ask(world.reset())
    world.answers = []
    seq = 0
    while world.ended() is None:
        answer = program.ask(world.step(seq))
        if answer["type"] == "error":
            raise RuntimeError(answer["message"])
        world.answers.append(answer)
        world.obey(answer)
        if trace and seq % 10 == 0:
            beside = world.path.project(world.x, world.y)
            print(f"t {seq / 10:5.1f}  s {beside.station:6.1f}  d {beside.offset:6.2f}  v {world.speed:5.2f}  "
                  f"a {world.accel:5.2f}  steer {world.steer:6.3f}")
        seq += 1
    program.ask({"type": "event", "kind": "end", "t_us": world.time_us}, answered=False)
    return world


def main() -> None:
    arguments = sys.argv[1:]
    if "--" not in arguments:
        sys.exit(__doc__)
    split = arguments.index("--")
    program = Program(arguments[split + 1:])
    print(program.ask(INIT))
    for road in [word for word in arguments[:split] if word != "--trace"] or ["straight", "bend", "light", "beside"]:
        world = drive(program, road, "--trace" in arguments[:split])
        print(f"{road}: {world.ended()} after {world.time_us / 1e6:.1f} s, at most {world.worst_offset:.2f} m beside the path, "
              f"nearest {world.least_gap:.2f} m")
    print("status", program.close())


if __name__ == "__main__":
    main()
