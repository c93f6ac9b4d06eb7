"""Searches a space with pyribs (CMA-ME): near misses that differ in where and how fast the ego vehicle was.

    pip install ribs
    python python/examples/search_pyribs.py scenarios/avastra45.ava residential 1000 nearest.ava
"""

import sys
import time

import numpy as np
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter
from ribs.schedulers import Scheduler

import avastra

path, road, count, file = sys.argv[1:]
space = avastra.compile(path)
episodes = avastra.Episodes(space, road, ads="reactive")
rows = [row for row in range(len(space.rows)) if space.draws(row, road)]


def steps_of(shares):
    """The rows and values of the first four steps: ten shares of [0, 1) each choose a row and its values."""
    steps = []
    for first, *others in np.clip(shares, 0.0, 0.999).reshape(4, 10):
        row = rows[int(first * len(rows))]
        draws = [draw for draw in space.draws(row, road) if draw.low is not None]
        steps.append((row, {draw.name: draw.low + share * (draw.high - draw.low) for draw, share in zip(draws, others)}))
    return steps


archive = GridArchive(solution_dim=40, dims=[20, 20], ranges=[(0.0, 300.0), (0.0, 9.0)])
scheduler = Scheduler(archive, [EvolutionStrategyEmitter(archive, x0=[0.5] * 40, sigma0=0.3, batch_size=25, seed=1)])
began = time.perf_counter()
for _ in range(int(count) // 25):
    played = [episodes.evaluate(1, steps_of(shares)) for shares in scheduler.ask()]
    near = [8.0 if one["measures"]["ttc_s"] is None else one["measures"]["ttc_s"] for one in played]
    scheduler.tell([one["counted"] or -ttc_s for one, ttc_s in zip(played, near)],
                   [[one["distance_m"], one["measures"]["required_mps2"]] for one in played])
best = archive.best_elite
print(f"{int(count) / (time.perf_counter() - began):.0f} evaluations/s, {len(archive)} cells, "
      f"{int((archive.data('objective') > 0).sum())} of them crash")
episodes.evaluate(1, steps_of(best["solution"]))
episodes.save(file, repeat=20)
