"""CommonRoad's IDM planner stops nearer to a pedestrian than to a car, and runs over one who crosses: `pip install commonroad-idm-planner==0.2.1`.

Everything is CommonRoad's: a straight lanelet, the planner with its defaults, its own collision check. Exits with 3 if it collides.
"""

import logging
import sys

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
from commonroad_idm_planner.idm_easy_api import solve_planning_problem

DT, CYCLES, LENGTH = 0.1, 40, 5.0


def state(x, y, heading, speed):
    return InitialState(time_step=0, position=np.array([x, y]), orientation=heading, velocity=speed, acceleration=0.0, yaw_rate=0.0,
                        slip_angle=0.0)


def planned(obstacle, speed):
    """The planner's trajectory past an obstacle, and whether its own check finds a collision."""
    along = np.arange(0.0, 401.0)
    middle = np.column_stack([along, 0.0 * along])
    scenario = Scenario(DT, ScenarioID(False, "ZAM", "Show", 1))
    scenario.replace_lanelet_network(LaneletNetwork.create_from_lanelet_list([Lanelet(middle + [0.0, 1.75], middle, middle - [0.0, 1.75], 1)]))
    scenario.add_objects(obstacle)
    goal = GoalRegion([CustomState(time_step=Interval(0, 1000), position=Rectangle(10.0, 3.0, np.array([380.0, 0.0])))])
    planner = solve_planning_problem(scenario, PlanningProblem(1, state(10.0, 0.0, 0.0, speed), goal), planning_cycle_max=CYCLES,
                                     ignore_static_obstacles=False)
    return planner.trajectory_over_scenario.state_list, planner.check_collision(one_cycle=False).collision_detected


logging.disable(logging.CRITICAL)
collided = False
print("who stands 140 m ahead   gap that is kept")
for kind, length, width in ((ObstacleType.PEDESTRIAN, 0.5, 0.5), (ObstacleType.CAR, 5.0, 1.8), (ObstacleType.BUS, 12.0, 2.5)):
    states, has_collided = planned(StaticObstacle(2, kind, Rectangle(length, width), state(150.0, 0.0, 0.0, 0.0)), 8.0)
    collided |= has_collided
    gap = min(150.0 - length / 2.0 - each.position[0] - LENGTH / 2.0 for each in states)
    print(f"{kind.value:24} {gap:.2f} m")

print("a pedestrian crosses 60 m ahead with 1.8 m/s   collision, speed then")
for begin in (-14.0, -12.0, -10.0, -8.0):
    states = [CustomState(time_step=step, position=np.array([70.0, begin + 1.8 * DT * step]), orientation=np.pi / 2.0, velocity=1.8)
              for step in range(1, 1000)]
    shape = Rectangle(0.5, 0.5)
    walker = DynamicObstacle(2, ObstacleType.PEDESTRIAN, shape, state(70.0, begin, np.pi / 2.0, 1.8),
                             TrajectoryPrediction(Trajectory(1, states), shape))
    states, has_collided = planned(walker, 8.0)
    collided |= has_collided
    near = [each.velocity for each in states if abs(each.position[0] - 70.0) < LENGTH / 2.0 + 0.25
            and abs(begin + 1.8 * DT * each.time_step) < 1.15]
    print(f"it begins {-begin:.0f} m beside          {has_collided}, {f'{max(near):.1f} m/s' if near else '-'}")
sys.exit(3 if collided else 0)
