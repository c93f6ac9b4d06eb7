"""FISS (PyPI `fiss-planner`, Shuo Sun) as a driving system under test: `driver.py fiss_plus`, or fiss, fop_plus, fop.

The package's whole pipeline drives, its `LocalPlanner`: corridor, lane changes, choice of speed, sampling, checks, fallback and braking for want of a plan.
Its figures are the package's own. Ours is what its adapters for CARLA and CommonRoad do for their worlds:

- avastra's lanes as its `RoadMap`, with the lanes of the route as the way to take. Its lanes know only whether they may be changed, not where:
  one with any stretch for it counts as one that may be left anywhere;
- lights and stop signs as its stop lines. A line is active while `avastra.Way` says that it holds, with those of the same light beside it;
- limits and bends ahead as the wanted speed;
- its predictions: vehicles follow their lanes, all others keep their velocity;
- `ignore_rear_in_lane`, as in its loop in CARLA: followers keep their distance. Their predictions would not;
- the trajectory's frame: it plans the middle of the vehicle along its direction of motion, avastra steers the rear axle.

It knows no right of way, and crosswalks only by the pedestrians that it sees on them. When it stands before a line, its plans may run out, and the short
plan that follows passes the line. That is its own mistake, and nothing here prevents it.
"""

import dataclasses
import math
import sys
import types

import avastra
import careful
import fiss_planner as fiss
import numpy as np

PLANNERS = ("fop", "fop_plus", "fiss", "fiss_plus", "careful")
#: Time between points of predictions and trajectories, s; the package's own.
DT = 0.1
#: Beyond the longest sampled trajectory predictions go on for this, s; as the package's adapters have it.
AFTER = 0.5
#: The package's own limit of 30 m/s would hold on a motorway, m/s.
SPEED_MAX = 50.0
#: Faster than this the velocity says where a pedestrian faces, m/s; as in the package's adapter for CARLA.
WALKS = 0.5
#: Lanes farther apart than this are not beside each other, m. Ours, as `Way.room` has it.
BESIDE = 0.5
#: A plan that begins this near the last one goes on from it, m. Ours.
SAME = 0.05
#: A trajectory must reach this far, s; what avastra does after its end, m/s². Both are the protocol's.
REACH, END_DECEL = 1.0, 3.0
VEHICLES = ("car", "truck", "bus", "motorcycle", "cyclist")


class Fiss(avastra.Driver):
    version = "1.0.0"
    answer = "trajectory"

    def __init__(self, planner):
        self.planner = planner
        self.name = "careful planner as FISS" if planner == "careful" else f"FISS {planner}"

    def init(self, init):
        self.vehicle = init.vehicle
        self.params = fiss.VehicleParams()
        self.params.length, self.params.width, self.params.wheelbase = init.vehicle.length, init.vehicle.width, init.vehicle.wheelbase
        self.params.rear_axle_to_center = init.vehicle.rear_axle_to_centre
        self.params.max_speed = SPEED_MAX
        self.params.max_accel, self.params.max_decel = init.vehicle.max_accel, init.vehicle.max_decel
        self.params.max_steer, self.params.max_steer_rate = init.vehicle.max_steer, init.vehicle.max_steer_rate
        self.config = fiss.LocalPlannerConfig()
        if self.planner != "careful":
            self.config.planner.type = fiss.planner_type_from_string(self.planner)
        self.config.planner.collision.ignore_rear_in_lane = True
        self.horizon = self.config.planner.sampling.max_t + AFTER

    def map(self, map):
        self.roads = map
        self.numbers = {lane.id: number for number, lane in enumerate(map.lanes)}
        #: Of each stop line, by its number: its lane, its station there, and its light; None is a stop sign.
        self.lines = [(lane.id, line.s, line.signal) for lane in map.lanes for line in lane.stop_lines]
        self.lines += [(lane.id, sign.s, None) for lane in map.lanes for sign in lane.signs if sign.kind == "stop"]
        self.network = network(map, self.numbers, self.lines)

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        # Made anew: it stitches plans, and remembers its lane.
        self.local = Careful(self.params, self.way) if self.planner == "careful" else fiss.LocalPlanner(self.config, self.params)
        #: The last plan by its times: the vehicle's middle, and the point that was made of it.
        self.last = {}
        self.local.set_map(self.network, [self.numbers[lane.id] for lane in reset.route.lanes])

    def step(self, step):
        ego = step.ego
        self.set_lines(self.way.stop(step))
        wanted = min(self.way.speed(ego.route_s), self.way.speed(ego.route_s + 1.5 * ego.speed))
        output = self.local.step(step.time, self.start(ego), [self.predicted(other) for other in step.objects], wanted)
        how = [name for name in ("fallback", "degraded", "emergency") if getattr(output, name)]
        if len(output.trajectory.t) < 2:
            return avastra.Trajectory(self.way.braking(step), avastra.Internal(reason="no plan: brakes"))
        return avastra.Trajectory(self.points(step, output.trajectory), avastra.Internal(reason=", ".join(how) or "plan"))

    def set_lines(self, holds):
        """Makes the line at a station of the route active, with those of the same light, and no other."""
        route = self.way.route
        lights = [line.signal for line in route.stop_lines if line.route_s == holds]
        lanes = [lane.id for lane in route.lanes for sign in route.signs
                 if sign.route_s == holds and lane.begin <= sign.route_s <= lane.end]
        for number, (lane, _, signal) in enumerate(self.lines):
            self.local.set_stop_line_active(number, lane in lanes if signal is None else signal in lights)

    def start(self, ego):
        """The vehicle's middle, and where it moves to; its outline is turned against that by the slip in a bend."""
        ahead = self.vehicle.rear_axle_to_centre
        slip = math.atan(math.tan(ego.steer) * ahead / self.vehicle.wheelbase)
        return fiss.EgoState(ego.x + ahead * math.cos(ego.heading), ego.y + ahead * math.sin(ego.heading), ego.heading + slip,
                             ego.speed / math.cos(slip), ego.accel, math.sin(slip) / ahead)

    def points(self, step, plan):
        """A plan for the vehicle's middle as one for its rear axle, which is drawn along behind it."""
        ego, ahead, points = step.ego, self.vehicle.rear_axle_to_centre, []
        times = [int(time) for time in step.t_us + np.rint(1e6 * plan.t)]
        # Where a plan goes on from the last one its headings do, too; from the vehicle's own no error of it would ever be steered away.
        middle, point = self.last.get(times[0], (None, None))
        if middle is None or math.dist(middle, (plan.x[0], plan.y[0])) > SAME:
            point = avastra.TrajectoryPoint(step.t_us, ego.x, ego.y, ego.heading, v=0.0)
        way = np.hypot(np.diff(plan.x, prepend=plan.x[0]), np.diff(plan.y, prepend=plan.y[0]))
        self.last = {}
        for time, x, y, yaw, speed, accel, rate, on in zip(times, plan.x, plan.y, plan.yaw, plan.v, plan.a, plan.s_d, way):
            if rate < 0.0:
                # Plans roll back some decimetres after their stop, which the protocol does not know.
                point = dataclasses.replace(point, t_us=time, v=0.0, a=0.0)
            else:
                # By the way, and not by the plan's curvature, which means nothing near standstill.
                slip = math.remainder(yaw - point.heading, math.tau) * math.exp(-on / ahead)
                heading = yaw - slip
                point = avastra.TrajectoryPoint(time, x - ahead * math.cos(heading), y - ahead * math.sin(heading), heading,
                                                v=max(speed * math.cos(slip), 0.0), a=accel)
            self.last[time] = (x, y), point
            points.append(point)
        return lengthened(points, step.t_us)

    def predicted(self, other):
        if other.kind in VEHICLES:
            return fiss.predict_lane_following(self.network, other.id, other.x, other.y, other.heading, other.speed,
                                               other.length, other.width, self.horizon, DT)
        heading = math.atan2(other.vy, other.vx) if other.speed > WALKS else other.heading
        return fiss.predict_constant_velocity(other.id, other.x, other.y, heading, other.speed, other.length, other.width, self.horizon, DT)


class Careful:
    """The careful planner in place of `fiss.LocalPlanner`: it reads its obstacles and stop lines."""

    def __init__(self, params, way):
        self.params, self.path, self.active = params, way.path, set()

    def set_map(self, network, _):
        self.network = network

    def set_stop_line_active(self, number, is_active):
        (self.active.add if is_active else self.active.discard)(number)

    def step(self, _, ego, obstacles, wanted):
        params, station = self.params, self.path.project(ego.x, ego.y).station
        vehicle = careful.Vehicle(params.length, params.width, ego.v, params.max_accel, params.max_decel)
        others = [read(obstacle) for obstacle in obstacles]
        others += [self.barrier(line) for line in self.network.stop_lines if line.id in self.active]
        way = careful.way(self.path, station)
        plan = careful.driven(way, ego.v, careful.acceleration(vehicle, way, others, wanted), DT, 3.0)
        x, y, yaw, v, a = plan.T
        trajectory = types.SimpleNamespace(t=DT * np.arange(len(plan)), x=x, y=y, yaw=yaw, v=v, a=a, s_d=v)
        return types.SimpleNamespace(trajectory=trajectory, fallback=False, degraded=False, emergency=False)

    def barrier(self, line):
        center = avastra.Path([(x, y) for x, y in np.asarray(self.network.lane(line.lane_id).centerline)[:, :2]])
        return careful.moving(*center.at(line.s + 0.5), 0.0, 0.0, 1.0, 3.0)


def read(obstacle):
    """What an obstacle of the package says."""
    poses = [(state.x, state.y, state.yaw) for state in obstacle.prediction]
    return careful.predicted(DT * np.arange(len(poses)), poses, obstacle.length, obstacle.width)


def network(map, numbers, lines):
    """The lanes and stop lines as the package has them."""
    made = fiss.RoadMap()
    for lane in map.lanes:
        entry = fiss.MapLane()
        entry.id, entry.speed_limit = numbers[lane.id], lane.speed_limit
        entry.centerline, entry.left, entry.right = np.array(lane.centerline), np.array(lane.left), np.array(lane.right)
        entry.successors = [numbers[other] for other in lane.successors]
        entry.predecessors = [numbers[other] for other in lane.predecessors]
        for side in ("left", "right"):
            neighbor = getattr(lane, f"{side}_neighbor")
            if neighbor is not None and neighbor.same_direction and neighbor.gap < BESIDE:
                setattr(entry, f"{side}_neighbor", numbers[neighbor.id])
                setattr(entry, f"can_change_{side}", bool(getattr(lane, f"changes_{side}")))
        made.add_lane(entry)
    for number, (lane, station, _) in enumerate(lines):
        made.add_stop_line(fiss.StopLine(number, numbers[lane], station, False))
    made.finalize()
    return made


def lengthened(points, now_us):
    """A plan that ends too soon for the protocol, with the braking after its end that avastra does by itself."""
    while points[-1].t_us < now_us + 1e6 * REACH:
        last = points[-1]
        speed = max(last.v - END_DECEL * DT, 0.0)
        way = (last.v + speed) / 2.0 * DT
        points.append(avastra.TrajectoryPoint(last.t_us + round(1e6 * DT), last.x + way * math.cos(last.heading),
                                              last.y + way * math.sin(last.heading), last.heading, v=speed, a=-END_DECEL))
    return points


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "fiss_plus"
    if chosen not in PLANNERS:
        sys.exit(f"`{chosen}` is none of {', '.join(PLANNERS)}")
    avastra.serve(lambda: Fiss(chosen))
