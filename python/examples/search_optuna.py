"""Searches a space with optuna: which rows, with which values, in the first steps come nearest to a crash?

    pip install optuna
    python python/examples/search_optuna.py scenarios/avastra45.ava crossroad 200 nearest.ava
"""

import sys
import time

import optuna

import avastra

path, road, trials, file = sys.argv[1:]
space = avastra.compile(path)
episodes = avastra.Episodes(space, road, ads="reactive")
rows = [row for row in range(len(space.rows)) if space.draws(row, road)]


def chosen(trial):
    """The rows and values of the first four steps."""
    steps = []
    for step in range(4):
        row = trial.suggest_categorical(f"row {step}", rows)
        draws = [draw for draw in space.draws(row, road) if draw.low is not None]
        steps.append((row, {draw.name: trial.suggest_float(f"{step} {row} {draw.name}", draw.low, draw.high) for draw in draws}))
    return steps


def nearness(trial):
    """Least time to collision, s; less than 0 for a collision that counts."""
    played = episodes.evaluate(1, chosen(trial))
    ttc_s = played["measures"]["ttc_s"]
    return -played["counted"] or (8.0 if ttc_s is None else ttc_s)


optuna.logging.set_verbosity(optuna.logging.WARNING)
study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
began = time.perf_counter()
study.optimize(nearness, int(trials))
print(f"{int(trials) / (time.perf_counter() - began):.0f} evaluations/s, {sum(trial.value < 0 for trial in study.trials)} of them crash")
episodes.evaluate(1, chosen(study.best_trial))
episodes.save(file, repeat=20)
