"""Steps per second from Python, beside highway-env in the same process, and beside MetaDrive: gym_speed.py [PYTHON].

MetaDrive needs older versions of NumPy and Gymnasium, so it runs in turn in a process of PYTHON, an interpreter that has it.

A step of avastra is 6 s of driving (300 ticks at 50 Hz: sensing, the driving system, exact contacts, the collision probability)
and the legality of every row; one of highway-env is 1 s (20 ticks at 20 Hz), with ten vehicles. So seconds of driving per second are
printed, too. Each is measured in turn, for some seconds, three times; the medians count. On a busy machine only the rates by
seconds of a processor mean anything (all threads together).
"""

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gymnasium
import highway_env  # noqa: F401, registers its environments

import avastra
import avastra.gym

SPACE = avastra.compile("scenarios/avastra45.ava")
SECONDS = 6.0
ROUNDS = 3
WORLDS = 16


class Clock:
    """Seconds since it was made: of the wall, and of all processors."""

    def __init__(self):
        self.wall, self.processor = time.perf_counter(), time.process_time()

    def is_over(self):
        return time.perf_counter() - self.wall > SECONDS

    def rates(self, steps):
        return steps / (time.perf_counter() - self.wall), steps / (time.process_time() - self.processor)


def vector(threads, **conditions):
    """Rates of steps of a vector environment, resets included; rows are drawn among the legal ones."""
    env = avastra.gym.VectorEnv(WORLDS, SPACE, "crossroad", threads=threads, **conditions)
    env.reset(seed=1)
    spaces = [gymnasium.spaces.Discrete(len(env.rows), seed=world) for world in range(WORLDS)]
    steps, clock = 0, Clock()
    while not clock.is_over():
        masks = env.action_masks().astype("int8")
        env.step([int(space.sample(mask)) for space, mask in zip(spaces, masks)])
        steps += WORLDS
    return clock.rates(steps)


def peer():
    config = {"vehicles_count": 10, "lanes_count": 3, "simulation_frequency": 20, "policy_frequency": 1}
    env = gymnasium.make("highway-v0", config=config)
    env.reset(seed=1)
    env.action_space.seed(1)
    steps, clock = 0, Clock()
    while not clock.is_over():
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        steps += 1
        if terminated or truncated:
            env.reset()
    return clock.rates(steps)


def metadrive():
    """Rates of a process of its own; it measures them without its start."""
    script = Path(__file__).with_name("metadrive_speed.py")
    told = subprocess.run([sys.argv[1], script, str(SECONDS)], check=True, capture_output=True, text=True).stdout
    return json.loads(told.splitlines()[-1])


CASES = [
    ("highway-env, one thread", 1.0, peer),
    *([("MetaDrive, one thread", 0.1, metadrive)] if len(sys.argv) > 1 else []),
    ("avastra, modular, one thread", SPACE.step_s, lambda: vector(1)),
    ("avastra, modular, two threads", SPACE.step_s, lambda: vector(2)),
    ("avastra, idm, one thread", SPACE.step_s, lambda: vector(1, ads="idm")),
    ("avastra, idm, two threads", SPACE.step_s, lambda: vector(2, ads="idm")),
]

rates = {name: [] for name, _, _ in CASES}
for _ in range(ROUNDS):
    for name, _, rate in CASES:
        rates[name].append(rate())
for name, step_s, _ in CASES:
    wall, processor = (statistics.median(each) for each in zip(*rates[name]))
    print(f"{name:32} {wall:7,.0f} steps/s, {processor:7,.0f} steps and {processor * step_s:9,.0f} s of driving per processor second")
