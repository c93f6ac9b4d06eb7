"""How many ticks a second avastra makes for each of highway-env's, taken in turn on one core: ticks.py MARKS.

MARKS is the built benchmark `marks`. Both have ten other vehicles. A tick of highway-env (20 Hz) is dynamics, behaviour and
collisions; one of avastra (50 Hz) has sensing, the driving system, exact contacts and the collision probability as well.
Rates are per CPU second of each process; the ratio is the median over the rounds.
"""

import os
import re
import statistics
import subprocess
import sys
import time

ROUNDS = 5
PEER_S = 3.0
SYSTEMS = ["modular", "idm"]
HERTZ = 20


def peer():
    """Ticks per CPU second of highway-env, resets included."""
    import gymnasium
    import highway_env  # noqa: F401, registers its environments

    config = {"vehicles_count": 10, "lanes_count": 3, "simulation_frequency": HERTZ, "policy_frequency": 1}
    environment = gymnasium.make("highway-v0", config=config)
    environment.reset(seed=1)
    environment.action_space.seed(1)
    steps, begun = 0, time.process_time()
    while time.process_time() - begun < PEER_S:
        _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
        steps += 1
        if terminated or truncated:
            environment.reset()
    print(steps * HERTZ / (time.process_time() - begun))


def measured(command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main(marks):
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rates = {name: [] for name in ["highway-env", *SYSTEMS]}
    for _ in range(ROUNDS):
        rates["highway-env"].append(float(measured([sys.executable, __file__, "--peer"])))
        for name in SYSTEMS:
            printed = measured([marks, f"ticks_per_s_{name}"])
            rates[name].append(float(re.search(r"ticks_per_s_\w+ ([\d.]+)", printed).group(1)))
    for name, found in rates.items():
        ratio = statistics.median(ours / theirs for ours, theirs in zip(found, rates["highway-env"]))
        print(f"{name:12} {statistics.median(found):10,.0f} ticks per CPU second, {ratio:6,.0f} x highway-env")


if sys.argv[1:] == ["--peer"]:
    peer()
else:
    main(*sys.argv[1:])
