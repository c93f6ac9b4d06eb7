"""The route of an episode as most drivers need it: how fast, how much room, and where to stop for a light or a sign.

Objects are not looked at here: whom to follow and whom to give way to is what a driver under test decides.
"""

import math
from typing import List, Optional, Set, Tuple

from .messages import Map, Reset, Step, TrajectoryPoint, Vehicle
from .path import Path

#: A yellow light that needs harder braking than this is passed, m/s².
_YELLOW_DECEL = 4.0
#: A vehicle that stands no farther than this before the line of a stop sign has stopped at it, m.
_AT_SIGN = 3.0
#: Slower than this a vehicle stands, m/s.
_STANDS = 0.1
#: A vehicle whose front is no farther than this beyond a line still waits at it, m.
_OVER = 1.0


class Way:
    """The route from `reset` to the goal. Stations are `route_s` of the protocol, those of the rear axle."""

    def __init__(self, vehicle: Vehicle, map: Map, reset: Reset, lateral_accel: float = 2.0, decel: float = 1.5):
        """`lateral_accel` bounds the speed in bends, `decel` (a magnitude) is the braking before them; both in m/s²."""
        self.vehicle = vehicle
        self.map = map
        self.route = reset.route
        self.goal = reset.goal.route_s
        self.path = Path([(point.x, point.y) for point in reset.route.path])
        self._speeds = _speeds(reset, lateral_accel, decel)
        self._signs_done = 0
        self._held: Set[int] = set()

    def speed(self, station: float) -> float:
        """What limits and bends, here and ahead, allow, m/s."""
        return self._speeds[self._index(station)]

    def curvature(self, station: float) -> float:
        """1/m, positive to the left."""
        return self.route.path[self._index(station)].curvature

    def stop(self, step: Step) -> Optional[float]:
        """The station that the front must not pass now, for a light or a stop sign; None if there is none.

        To be asked in every step: it remembers at which signs the vehicle has stopped, and for which lights it has begun to stop.
        """
        front = step.ego.route_s + self.vehicle.rear_axle_to_front
        lines = [line for line in (self._light(step, front), self._sign(step, front)) if line is not None]
        return min(lines, default=None)

    def wanted_speed(self, step: Step, decel: float = 1.5, gap: float = 1.5) -> float:
        """What limits, bends and a line that holds ask for, m/s: braking at `decel` (m/s²) to stop `gap` m before the line.

        It is the speed for 1 s from now, because a planner comes to it with some delay.
        """
        ego = step.ego
        wanted = min(self.speed(ego.route_s), self.speed(ego.route_s + 1.5 * ego.speed))
        line = self.stop(step)
        if line is None:
            return wanted
        left = line - gap - ego.route_s - self.vehicle.rear_axle_to_front - ego.speed
        return min(wanted, math.sqrt(2.0 * decel * max(left, 0.0)))

    def braking(self, step: Step, seconds: float = 3.0) -> List[TrajectoryPoint]:
        """A way out for a planner without a plan: braking as hard as the vehicle can, at its distance beside the route."""
        points, station, speed, period = [], step.ego.route_s, step.ego.speed, 0.1
        decel = self.vehicle.max_decel
        for index in range(round(seconds / period) + 1):
            pose = self.path.at(station, step.ego.route_d)
            # Also at rest: a controller that looks ahead must find the brake pressed there.
            points.append(TrajectoryPoint(step.t_us + round(index * 1e6 * period), *pose, v=speed, a=-decel))
            braked = min(period, speed / decel)
            station += speed * braked - decel * braked**2 / 2.0
            # Rounding must not make it roll backwards.
            speed = max(speed - decel * braked, 0.0)
        return points

    def room(self, station: float) -> Tuple[float, float]:
        """How far lanes of the own direction reach to the left and to the right of the path, m; both positive."""
        on = next((lane for lane in self.route.lanes if lane.end >= station), self.route.lanes[-1])
        here = self.path.at(station)
        edges = []
        for side in ("left", "right"):
            lane = self.map.lane[on.id]
            while True:
                neighbor = getattr(lane, f"{side}_neighbor")
                if neighbor is None or not neighbor.same_direction or neighbor.gap > 0.5:
                    break
                lane = self.map.lane[neighbor.id]
            edges.append(abs(Path(getattr(lane, side)).project(here.x, here.y).offset))
        return edges[0], edges[1]

    def _index(self, station: float) -> int:
        return min(max(int(station / self.route.spacing), 0), len(self.route.path) - 1)

    def _light(self, step: Step, front: float) -> Optional[float]:
        states = {signal.id: signal.state for signal in step.signals}
        for index, line in enumerate(self.route.stop_lines):
            distance = line.route_s - front
            state = states.get(line.signal)
            hardest = {"red": self.vehicle.max_decel, "yellow": _YELLOW_DECEL}.get(state or "")
            if hardest is None or distance < -_OVER:
                self._held.discard(index)
                continue
            # Once begun, braking goes on: a driver that brakes late would otherwise be let through in the middle of it.
            if index in self._held or step.ego.speed**2 <= 2.0 * hardest * max(distance, 0.1):
                self._held.add(index)
                return line.route_s
        return None

    def _sign(self, step: Step, front: float) -> Optional[float]:
        # A yield sign asks for no stop: whether to give way is the driver's own business.
        stops = [sign.route_s for sign in self.route.signs if sign.kind == "stop"]
        while self._signs_done < len(stops):
            distance = stops[self._signs_done] - front
            has_stopped = distance < _AT_SIGN and step.ego.speed < _STANDS
            if not has_stopped and distance >= -_OVER:
                return stops[self._signs_done]
            self._signs_done += 1
        return None


def _speeds(reset: Reset, lateral_accel: float, decel: float) -> List[float]:
    """The speed allowed at each point of the path: limits and bends, and what braking in time for them allows."""
    route = reset.route
    speeds = [min(point.speed_limit, (lateral_accel / max(abs(point.curvature), 1e-6)) ** 0.5) for point in route.path]
    for index in range(len(speeds) - 2, -1, -1):
        speeds[index] = min(speeds[index], (speeds[index + 1] ** 2 + 2.0 * decel * route.spacing) ** 0.5)
    return speeds
