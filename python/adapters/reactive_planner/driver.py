"""TUM's reactive planner (PyPI `commonroad-reactive-planner`) as a driving system under test: `driver.py [HORIZON]`, in seconds.

Sampling, checks, costs and choice are the package's, with its defaults, but for the horizon: 3 s unless another is named (the package's 6 s
takes four times as long), and for the vehicle's own sizes and limits. As by its default, a plan holds for 0.3 s. Ours is what the package
leaves to its caller:

- the road: the lanes of the own direction along the route, as one lanelet, and the route's path as reference;
- the prediction: every road user keeps its velocity;
- lights and stop signs as a box across the lane and, as limits and bends, as the desired speed;
- what happens without a plan: braking as hard as the vehicle can.

It knows no right of way. Planning goes on from the last plan, unless the vehicle is farther than `ASTRAY` from it.
"""

import math
import sys

import avastra
import commonroad_dc.pycrcc as pycrcc
import numpy as np
from commonroad.scenario.lanelet import Lanelet, LaneletNetwork
from commonroad.scenario.scenario import Scenario, ScenarioID
from commonroad_clcs.config import CLCSParams
from commonroad_dc.boundary.boundary import create_road_boundary_obstacle
from commonroad_rp.reactive_planner import ReactivePlanner
from commonroad_rp.state import ReactivePlannerState
from commonroad_rp.utility.config import ReactivePlannerConfiguration
from commonroad_rp.utility.utils_coordinate_system import CoordinateSystem

DT = 0.1
#: A plan is begun anew at the real vehicle when it is farther than this from the last one, m and m/s.
ASTRAY = 0.5
#: Kept free beyond the lanes' edges, m: the reference leaves the lane's middle in lane changes.
VERGE = 0.3
#: A desired speed of 0 makes the planner look for a goal, m/s.
SLOWEST = 0.01


class Reactive(avastra.Driver):
    name = "commonroad-reactive-planner"
    version = "2025.1"
    answer = "trajectory"

    def __init__(self, horizon):
        self.count = round(horizon / DT)

    def init(self, init):
        car = self.vehicle = init.vehicle
        config = self.config = ReactivePlannerConfiguration()
        config.planning.dt, config.planning.time_steps_computation = DT, self.count
        config.planning.planning_horizon = DT * self.count
        config.debug.multiproc, config.debug.logging_level = False, "ERROR"
        sizes = config.vehicle
        sizes.length, sizes.width = car.length, car.width
        sizes.wb_rear_axle = car.rear_axle_to_centre
        sizes.wb_front_axle = car.wheelbase - car.rear_axle_to_centre
        sizes.a_max = car.max_decel
        sizes.delta_min, sizes.delta_max = -car.max_steer, car.max_steer
        sizes.v_delta_min, sizes.v_delta_max = -car.max_steer_rate, car.max_steer_rate
        sizes._update_computed_params()

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        path = self.way.path
        # Beyond both ends straight on, so that no place near them lies outside of the planner's frame.
        stations = np.arange(-20.0, path.length + 80.0, 1.0)
        # Smooth, because the planner bounds how fast the wheel turns.
        reference = np.array(avastra.Path([path.at(station)[:2] for station in stations]).smoothed().xy)
        room = [self.way.room(min(max(station, 0.0), path.length)) for station in stations]
        left = np.array([path.at(station, sides[0] + VERGE)[:2] for station, sides in zip(stations, room)])
        right = np.array([path.at(station, -sides[1] - VERGE)[:2] for station, sides in zip(stations, room)])
        scenario = Scenario(DT, ScenarioID(False, "ZAM", "Avastra", 1))
        lanelet = Lanelet(left, reference, right, 1)
        scenario.replace_lanelet_network(LaneletNetwork.create_from_lanelet_list([lanelet]))
        self.config.update(scenario=scenario)
        self.planner = ReactivePlanner(self.config)
        self.planner.set_reference_path(
            coordinate_system=CoordinateSystem(reference, preprocess_reference=False, clcs_params=CLCSParams()))
        self.edges = create_road_boundary_obstacle(scenario)[1]
        self.plan, self.age = None, 0

    def step(self, step):
        if not self.holds(step):
            self.plan, self.age = self.planned(step), 0
        if self.plan is None:
            return avastra.Trajectory(self.way.braking(step), avastra.Internal(reason="no plan: brakes"))
        rows = self.plan[self.age:]
        self.age += 1
        return avastra.Trajectory([avastra.TrajectoryPoint(step.t_us + round(index * 1e6 * DT), *row[:4], a=row[4])
                                   for index, row in enumerate(rows)])

    def holds(self, step):
        """Whether the plan is young enough and the vehicle on it."""
        return (self.plan is not None and self.age < self.config.planning.replanning_frequency and self.on_plan(step.ego))

    def on_plan(self, ego):
        x, y, _, speed = self.plan[self.age][:4]
        return math.dist((x, y), (ego.x, ego.y)) < ASTRAY and abs(speed - ego.speed) < ASTRAY

    def planned(self, step):
        """A new plan, as rows of x, y, heading, speed, acceleration, wheel angle, rate of turn; None if there is none."""
        ego = step.ego
        begin = (ego.x, ego.y, ego.heading, ego.speed, ego.accel, ego.steer, ego.yaw_rate)
        if self.plan is not None and self.on_plan(ego):
            begin = self.plan[self.age]
        x, y, heading, speed, accel, steer, turn = map(float, begin)
        line = self.way.stop(step)
        state = ReactivePlannerState(
            time_step=0, position=np.array([x, y]), orientation=heading, velocity=max(speed, 0.0), acceleration=accel,
            steering_angle=steer, yaw_rate=turn)
        try:
            self.planner.reset(initial_state_cart=state, collision_checker=self.checker(step, line),
                               coordinate_system=self.planner.coordinate_system)
            self.planner.set_desired_velocity(max(self.way.wanted_speed(step), SLOWEST), max(speed, SLOWEST))
            result = self.planner.plan()
        # The planner raises a bare Exception where its frame does not fit, and trips over its own log line where it stands.
        except Exception as error:
            print(f"reactive planner at {step.time:.1f} s: {error}")
            return None
        if result is None:
            return None
        return [(*state.position, state.orientation, max(state.velocity, 0.0), state.acceleration, state.steering_angle,
                 state.yaw_rate) for state in result[0].state_list]

    def checker(self, step, line):
        """What the planner must not touch: the edges, predicted road users, and a line that holds."""
        checker = pycrcc.CollisionChecker()
        checker.add_collision_object(self.edges)
        for other in step.objects:
            moving = pycrcc.TimeVariantCollisionObject(0)
            for index in range(self.count + 1):
                x, y = other.x + other.vx * index * DT, other.y + other.vy * index * DT
                moving.append_obstacle(pycrcc.RectOBB(other.length / 2.0, other.width / 2.0, other.heading, x, y))
            checker.add_collision_object(moving)
        if line is not None:
            pose = self.way.path.at(line + 0.5)
            checker.add_collision_object(pycrcc.RectOBB(1.0, 5.0, pose.heading, pose.x, pose.y))
        return checker


if __name__ == "__main__":
    seconds = sys.argv[1] if len(sys.argv) > 1 else "3"
    try:
        chosen = float(seconds)
    except ValueError:
        chosen = 0.0
    if not 1.5 <= chosen <= 10.0:
        sys.exit(f"`{seconds}` is no horizon: a number of seconds from 1.5 to 10")
    avastra.serve(lambda: Reactive(chosen))
