"""Frenetix (PyPI `frenetix`, TUM) as a driving system under test: its C++ core samples, checks and rates trajectories.

The package is a core without a planner around it. Ours is what its callers have to bring, after the scheme of Werling et al.:

- the samples: durations up to 3 s, speeds at their end, offsets from the route within the lanes of the own direction;
- the weights of the costs, because the package has none of its own;
- the prediction: every road user keeps its velocity, with a spread that grows by 0.2 m in a second (`SPREAD`);
- the choice: the cheapest feasible trajectory whose box meets no predicted box; if there is none, braking as hard as the vehicle can;
- limits and bends as the wanted speed, lights and stop signs as that and as a box across the lane.

It knows no right of way beyond the prediction, and crosswalks only by the pedestrians that it sees on them. Planning goes on from the last plan, unless
the vehicle is farther than `ASTRAY` from it.
"""

import math
import sys

import avastra
import careful
import frenetix
import numpy as np
from frenetix.trajectory_functions import FillCoordinates
from frenetix.trajectory_functions import cost_functions as costs
from frenetix.trajectory_functions import feasability_functions as limits

DT = 0.1
HORIZON = 3.0
#: Below this the core samples the offset over the way instead of over time, m/s.
LOW_SPEED = 2.0
DURATIONS = np.arange(1.1, HORIZON + 1e-9, 0.38)
SPEEDS = 11
OFFSETS = 9
#: Where the route bends more than this within `BEND_AHEAD` m, offsets are sampled only up to `BEND_OFFSET` m to the outside: on the inside a tight
#: bend is tighter than the wheels turn.
BEND, BEND_AHEAD, BEND_OFFSET = 1.0 / 25.0, 15.0, 0.5
#: Standard deviation of a predicted position now, and what it gains in a second, m.
SPREAD_NOW, SPREAD = 0.1, 0.2
#: Kept free around a predicted box, m.
MARGIN = 0.4
#: A plan is begun anew at the real vehicle when it is farther than this from the last one, m and m/s.
ASTRAY = 0.5


class Frenetix(avastra.Driver):
    name = "frenetix"
    version = "0.4.0"
    answer = "trajectory"

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.frame = frenetix.CoordinateSystemWrapper(np.array(reference(self.way.path).xy))
        self.plan = None
        stations = np.arange(0.0, self.way.path.length, 2.0)
        self.room = np.array([self.way.room(station) for station in stations]) - self.vehicle.width / 2.0

    def step(self, step):
        boxes = [self.predicted(other) for other in step.objects]
        line = self.way.stop(step)
        if line is not None:
            boxes.append(self.barrier(line))
        self.plan = self.best(self.stitched(step), self.way.wanted_speed(step), step.ego.route_s, boxes, step.objects)
        if self.plan is None:
            return avastra.Trajectory(self.way.braking(step), avastra.Internal(reason="no plan: brakes"))
        return avastra.Trajectory([avastra.TrajectoryPoint(step.t_us + round(index * 1e6 * DT), *row[:4], a=row[4])
                                   for index, row in enumerate(self.plan)])

    def stitched(self, step):
        """Where the plan goes on from: x, y, heading, speed, acceleration, angle of the wheels."""
        ego = step.ego
        if self.plan is not None:
            x, y, heading, speed, accel, curvature = self.plan[1]
            if math.dist((x, y), (ego.x, ego.y)) < ASTRAY and abs(speed - ego.speed) < ASTRAY:
                return x, y, heading, speed, accel, math.atan(self.vehicle.wheelbase * curvature)
        return ego.x, ego.y, ego.heading, ego.speed, ego.accel, ego.steer

    def predicted(self, other):
        """The boxes of an object at each time of the horizon: rows of x, y, heading; and half its length and width."""
        times = np.arange(0.0, HORIZON + DT / 2.0, DT)
        heading = np.full_like(times, other.heading)
        poses = np.stack([other.x + other.vx * times, other.y + other.vy * times, heading], axis=1)
        return poses, other.length / 2.0 + MARGIN, other.width / 2.0 + MARGIN

    def barrier(self, line):
        """A line that must not be passed, as a predicted box."""
        pose = self.way.path.at(line + 0.5)
        return np.tile(np.array(pose), (round(HORIZON / DT) + 1, 1)), 1.0, 5.0

    def best(self, now, wanted, station, boxes, objects):
        """The cheapest trajectory that may be driven, as rows of x, y, heading, speed, acceleration, curvature."""
        x, y, heading, speed, accel, steer = map(float, now)
        low = speed < LOW_SPEED
        state = frenetix.CartesianPlannerState(np.array([x, y]), heading, speed, accel, steer)
        try:
            curvilinear = frenetix.compute_initial_state(
                coordinate_system=self.frame, x_0=state, wheelbase=self.vehicle.wheelbase, low_velocity_mode=low)
        except (RuntimeError, ValueError) as error:
            print(f"frenetix: {error}")
            return None
        handler = self.handler(heading, low, wanted, objects)
        handler.generate_trajectories(self.samples(curvilinear, speed, wanted, station), low)
        handler.evaluate_all_current_functions(True)
        for trajectory in handler.get_sorted_trajectories():
            if not trajectory.feasible or not trajectory.valid:
                continue
            sample = trajectory.cartesian
            plan = np.stack([sample.x, sample.y, sample.theta, np.maximum(sample.v, 0.0), sample.a, sample.kappa], axis=1)
            if np.isfinite(plan).all() and not any(self.meets(plan, box) for box in boxes):
                return plan
        return None

    def handler(self, heading, low, wanted, objects):
        """The core's evaluation of one set of samples."""
        car = self.vehicle
        handler = frenetix.TrajectoryHandler(dt=DT)
        # Not its check of the rate of turn: it says the same as that of the curvature, and refuses every way on which the heading
        # passes from pi to -pi.
        handler.add_feasability_function(limits.CheckAccelerationConstraint(
            switchingVelocity=8.0, maxAcceleration=car.max_decel, wholeTrajectory=False))
        handler.add_feasability_function(limits.CheckCurvatureConstraint(
            deltaMax=car.max_steer, wheelbase=car.wheelbase, wholeTrajectory=False))
        handler.add_feasability_function(limits.CheckCurvatureRateConstraint(
            wheelbase=car.wheelbase, velocityDeltaMax=car.max_steer_rate, wholeTrajectory=False))
        handler.add_cost_function(costs.CalculateLateralJerkCost("lateral jerk", 0.2))
        handler.add_cost_function(costs.CalculateLongitudinalJerkCost("longitudinal jerk", 0.2))
        handler.add_cost_function(costs.CalculateDistanceToReferencePathCost("offset", 5.0))
        handler.add_cost_function(costs.CalculateVelocityOffsetCost("speed", 1.0, wanted, DT, 1.1, False, 2))
        if objects:
            predictions = {other.id: spread(other) for other in objects}
            handler.add_cost_function(costs.CalculateCollisionProbabilityFast(
                "collision", 100.0, predictions, car.length, car.width))
        handler.add_function(FillCoordinates(
            lowVelocityMode=low, initialOrientation=heading, coordinateSystem=self.frame, horizon=HORIZON))
        return handler

    def samples(self, curvilinear, speed, wanted, station):
        """The core's matrix: begin and end in time, along and across."""
        slowest = max(0.0, speed - self.vehicle.max_decel * 1.5)
        fastest = max(min(speed + self.vehicle.max_accel * HORIZON, wanted + 1.0), slowest + 1.0)
        left, right = self.room[min(max(int(station / 2.0), 0), len(self.room) - 1)]
        tightest = max((self.way.curvature(station + on) for on in np.arange(0.0, BEND_AHEAD)), key=abs)
        if abs(tightest) > BEND:
            left, right = (0.0, BEND_OFFSET) if tightest > 0.0 else (BEND_OFFSET, 0.0)
        ends = np.append(np.linspace(slowest, fastest, SPEEDS), [max(wanted, 0.0), 0.0])
        across = np.append(np.linspace(-max(right, 0.0), max(left, 0.0), OFFSETS), 0.0)
        grid = np.stack([axis.ravel() for axis in np.meshgrid(DURATIONS, np.unique(ends), np.unique(across), indexing="ij")])
        matrix = np.zeros((grid.shape[1], 13))
        matrix[:, 1], matrix[:, 5], matrix[:, 10] = grid
        matrix[:, 2:5], matrix[:, 7:10] = curvilinear.x0_lon, curvilinear.x0_lat
        return matrix

    def meets(self, plan, box):
        """Whether the vehicle's outline on a plan meets a predicted box at any time: separating axes, all times at once."""
        poses, half_length, half_width = box
        ahead, car = self.vehicle.rear_axle_to_centre, self.vehicle
        count = min(len(plan), len(poses))
        own, other = plan[:count], poses[:count]
        cos, sin = np.cos(own[:, 2]), np.sin(own[:, 2])
        dx, dy = other[:, 0] - own[:, 0] - ahead * cos, other[:, 1] - own[:, 1] - ahead * sin
        other_cos, other_sin = np.cos(other[:, 2]), np.sin(other[:, 2])
        turned_cos, turned_sin = np.abs(cos * other_cos + sin * other_sin), np.abs(cos * other_sin - sin * other_cos)
        apart = np.abs(dx * cos + dy * sin) > car.length / 2.0 + half_length * turned_cos + half_width * turned_sin
        apart |= np.abs(dy * cos - dx * sin) > car.width / 2.0 + half_length * turned_sin + half_width * turned_cos
        apart |= np.abs(dx * other_cos + dy * other_sin) > half_length + (car.length * turned_cos + car.width * turned_sin) / 2.0
        apart |= np.abs(dy * other_cos - dx * other_sin) > half_width + (car.length * turned_sin + car.width * turned_cos) / 2.0
        return not apart.all()


class Careful(Frenetix):
    """The careful planner, which reads the predicted boxes."""

    name = "careful planner as Frenetix"

    def best(self, now, wanted, station, boxes, objects):
        speed, middle = float(now[3]), self.vehicle.rear_axle_to_centre
        vehicle = careful.Vehicle(self.vehicle.length, self.vehicle.width, speed, self.vehicle.max_accel, self.vehicle.max_decel, middle)
        way = careful.way(self.way.path, station)
        others = [careful.predicted(DT * np.arange(len(poses)), poses, 2.0 * length, 2.0 * width) for poses, length, width in boxes]
        accel = careful.acceleration(vehicle, way, others, wanted)
        plan = careful.driven(way, speed, accel, DT, HORIZON)
        return np.column_stack([plan, np.zeros(len(plan))])


def reference(path):
    """The route for the core: longer at both ends, because its frame ends where its line does, and smooth."""
    before = [path.at(-float(back))[:2] for back in range(20, 0, -1)]
    after = [path.at(path.length + float(on))[:2] for on in range(1, 80)]
    return avastra.Path([*before, *path.xy, *after]).smoothed()


def spread(other):
    """An object's prediction as the core reads it."""
    turned = np.array([0.0, 0.0, math.sin(other.heading / 2.0), math.cos(other.heading / 2.0)])
    poses = []
    for index in range(round(HORIZON / DT) + 1):
        time = index * DT
        covariance = np.zeros((6, 6), order="F")
        covariance[0, 0] = covariance[1, 1] = (SPREAD_NOW + SPREAD * time) ** 2
        place = np.array([other.x + other.vx * time, other.y + other.vy * time, 0.0])
        poses.append(frenetix.PoseWithCovariance(place, turned, covariance))
    return frenetix.PredictedObject(other.id, poses, other.length, other.width)


if __name__ == "__main__":
    avastra.serve({"": Frenetix, "careful": Careful}[sys.argv[1] if len(sys.argv) > 1 else ""])
