"""Searches a row with OpenSBT's NSGA-II: with which values does it come near, and how hard must the ego vehicle brake?

    pip install opensbt
    python python/examples/search_opensbt.py scenarios/avastra45.ava residential 'pedestrian(from: Right)' nearest.ava
"""

import sys
import time

from opensbt.algorithm.nsga2_optimizer import NsgaIIOptimizer
from opensbt.evaluation.critical import Critical
from opensbt.evaluation.fitness import Fitness
from opensbt.experiment.search_configuration import DefaultSearchConfiguration
from opensbt.problem.adas_problem import ADASProblem
from opensbt.simulation.simulator import SimulationOutput

import avastra

path, road, label, file = sys.argv[1:]
space = avastra.compile(path)
episodes = avastra.Episodes(space, road, ads="reactive")
row = space.rows.index(label)
draws = [draw for draw in space.draws(row, road) if draw.low is not None]


def steps(values):
    return [(row, dict(zip([draw.name for draw in draws], values)))] * 4


def simulate(individuals, *_, **__):
    return [SimulationOutput(otherParams=episodes.evaluate(1, steps(values))) for values in individuals]


class Danger(Fitness):
    name, min_or_max = ("time to collision", "braking that is needed"), ("min", "max")

    def eval(self, output):
        ttc_s, needed = (output.otherParams["measures"][name] for name in ("ttc_s", "required_mps2"))
        return -output.otherParams["counted"] or (8.0 if ttc_s is None else ttc_s), needed


class Near(Critical):
    def eval(self, fitness, simout=None):
        return fitness[0] < 1.0


problem = ADASProblem([draw.low for draw in draws], [draw.high for draw in draws], path, Danger(), simulate, Near(),
                      [draw.name for draw in draws], problem_name=label)
began = time.perf_counter()
result = NsgaIIOptimizer(problem, DefaultSearchConfiguration()).run()
print(f"{result.algorithm.evaluator.n_eval / (time.perf_counter() - began):.0f} evaluations/s")
episodes.evaluate(1, steps(min(result.pop, key=lambda one: one.F[0]).X))
episodes.save(file, repeat=20)
