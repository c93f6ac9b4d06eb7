"""CommonRoad's IDM planner (PyPI `commonroad-idm-planner` 0.2.1, TUM) as a driving system under test.

The package plans a whole scenario along a path. Here it plans anew in each step from where the vehicle is, and the change of speed of its first step of
0.1 s is the answer; avastra steers. The choice of whom to follow and the following are the package's, with its default parameters. Ours is what it
leaves to its caller:

- the path: the route, up to `REACH` m ahead. The package knows its speeds by lanelets; here limits and bends are its desired speed;
- the prediction: every road user keeps its velocity over its horizon of 1 s, and what stands is an obstacle that does not move;
- lights and stop signs as an obstacle that stands behind the line, as long as the vehicle: it measures from middle to middle and takes one length off;
- brakes: no more than the vehicle has. The package knows no limit.

It follows the nearest road user whose outline meets the path within the next second. It knows no right of way and foresees no crossing.
"""

import logging
import math
import sys

import avastra
import careful
import numpy as np
from commonroad.common.util import Interval
from commonroad.geometry.shape import Rectangle
from commonroad.planning.goal import GoalRegion
from commonroad.planning.planning_problem import PlanningProblem
from commonroad.prediction.prediction import TrajectoryPrediction
from commonroad.scenario.lanelet import Lanelet, LaneletNetwork
from commonroad.scenario.obstacle import DynamicObstacle, ObstacleType, StaticObstacle
from commonroad.scenario.scenario import Scenario, ScenarioID
from commonroad.scenario.state import CustomState, InitialState
from commonroad.scenario.trajectory import Trajectory
from commonroad_idm_planner.configuration.planner_config import IDMConfigFactory
from commonroad_idm_planner.idm_path import IDMPathFactory
from commonroad_idm_planner.idm_planner import IDMPlanner

DT = 0.1
#: How far ahead the path reaches, and what lies between its points, m.
REACH, SPACING = 60.0, 0.5
#: Road users farther away than this, m, are left out: none can reach the path within its horizon of 1 s.
TOLD = 120.0
#: Slower than this a road user stands, m/s.
STANDS = 0.1
#: Its desired speed is a divisor, m/s.
SLOWEST = 0.1
LINE = 2


class Idm(avastra.Driver):
    name = "CommonRoad IDM"
    version = "0.2.1"
    answer = "acceleration"

    def init(self, init):
        self.vehicle = init.vehicle
        self.config = IDMConfigFactory.generate_default_config(ignore_static_obstacles=False)
        self.config.vehicle_length, self.config.vehicle_width = init.vehicle.length, init.vehicle.width

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        # It looks for the lanelet of each point, for its signs.
        stations = np.arange(-10.0, self.way.path.length + REACH, 5.0)
        left, middle, right = (np.array([self.way.path.at(station, offset)[:2] for station in stations]) for offset in (1.0, 0.0, -1.0))
        lanelet = Lanelet(left, middle, right, 1)
        self.network = LaneletNetwork.create_from_lanelet_list([lanelet])
        # Its goal is only looked at for the speed there; it has none here.
        self.goal = GoalRegion([CustomState(time_step=Interval(0, 10_000))])

    def step(self, step):
        wanted = max(min(self.way.speed(step.ego.route_s), self.way.speed(step.ego.route_s + 1.5 * step.ego.speed)), SLOWEST)
        accel = self.planned(step.ego, wanted, self.scenario(step))
        return avastra.Acceleration(min(max(accel, -self.vehicle.max_decel), self.vehicle.max_accel))

    def scenario(self, step):
        """The road users and the line that holds, as the package has them."""
        scenario = Scenario(DT, ScenarioID(False, "ZAM", "Avastra", 1))
        scenario.replace_lanelet_network(self.network)
        for other in step.objects:
            if math.dist((other.x, other.y), (step.ego.x, step.ego.y)) < TOLD:
                scenario.add_objects(self.obstacle(other))
        line = self.way.stop(step)
        if line is not None:
            x, y, heading = self.way.path.at(line + self.vehicle.length / 2.0)
            state = InitialState(time_step=0, position=np.array([x, y]), orientation=heading, velocity=0.0)
            scenario.add_objects(StaticObstacle(LINE, ObstacleType.ROAD_BOUNDARY, Rectangle(self.vehicle.length, 3.0), state))
        return scenario

    def obstacle(self, other):
        shape, kind = Rectangle(other.length, other.width), ObstacleType.CAR
        place, number = np.array([other.x, other.y]), other.id + LINE + 1
        state = InitialState(time_step=0, position=place, orientation=other.heading, velocity=other.speed)
        if other.speed < STANDS:
            return StaticObstacle(number, kind, shape, state)
        velocity = np.array([other.vx, other.vy])
        states = [CustomState(time_step=index, position=place + DT * index * velocity, orientation=other.heading, velocity=other.speed)
                  for index in range(1, self.config.planning_horizon + 2)]
        return DynamicObstacle(number, kind, shape, state, TrajectoryPrediction(Trajectory(1, states), shape))

    def planned(self, ego, wanted, scenario):
        """The acceleration that the package plans, m/s²."""
        middle = ego.route_s + self.vehicle.rear_axle_to_centre
        stations = np.arange(middle - 5.0, middle + REACH, SPACING)
        path = IDMPathFactory.generate_idm_path_from_np_2d_positional_array(np.array([self.way.path.at(station)[:2] for station in stations]))
        x, y, heading = self.way.path.at(middle)
        start = InitialState(time_step=0, position=np.array([x, y]), orientation=heading, velocity=ego.speed, acceleration=ego.accel,
                             yaw_rate=0.0, slip_angle=0.0)
        self.config.v_desired = wanted
        planner = IDMPlanner(scenario, PlanningProblem(0, start, self.goal), self.config, path, logging.ERROR)
        return (planner.plan().state_list[1].velocity - ego.speed) / DT


class Careful(Idm):
    """The careful planner, which reads the package's scenario."""

    name = "careful planner as CommonRoad IDM"

    def planned(self, ego, wanted, scenario):
        vehicle = careful.Vehicle(self.vehicle.length, self.vehicle.width, ego.speed, self.vehicle.max_accel, self.vehicle.max_decel)
        way = careful.way(self.way.path, ego.route_s + self.vehicle.rear_axle_to_centre)
        return careful.acceleration(vehicle, way, [read(obstacle) for obstacle in scenario.obstacles], wanted)


def read(obstacle):
    """What an obstacle of the package says."""
    states, shape = [obstacle.initial_state], obstacle.obstacle_shape
    if isinstance(obstacle, DynamicObstacle):
        states += obstacle.prediction.trajectory.state_list
    poses = [(*state.position, state.orientation) for state in states]
    return careful.predicted(DT * np.arange(len(poses)), poses, shape.length, shape.width)


if __name__ == "__main__":
    avastra.serve({"": Idm, "careful": Careful}[sys.argv[1] if len(sys.argv) > 1 else ""])
