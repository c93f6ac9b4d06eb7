#!/bin/sh
# Lets searchers that others wrote look for crashes, and a learner train, by the examples of python/examples; prints evaluations a second.
# Each writes a scenario, which is replayed: searches.sh AVASTRA. Run wheel.sh first: it builds the wheel. Needs Python 3.11, and PyPI for the first run.
set -eu
avastra=$(realpath "$1")
cd "$(dirname "$0")/../.."
root=$PWD/target/interop/searches
mkdir -p "$root"
# OpenSBT pins an old NumPy.
for packages in 'opensbt==0.1.4 optuna==5.0.0' 'ribs==0.12.0 stable-baselines3==2.9.2 gymnasium==1.2.2'; do
    venv=$root/${packages%%=*}
    if [ ! -e "$venv/ready" ]; then
        python3 -m venv "$venv"
        # shellcheck disable=SC2086
        "$venv/bin/pip" install --quiet $packages
        touch "$venv/ready"
    fi
    "$venv/bin/pip" install --quiet --force-reinstall --no-deps target/interop/wheel/dist/*.whl
done
space=scenarios/avastra45.ava
opensbt=$root/opensbt/bin/python ribs=$root/ribs/bin/python
echo "evaluate alone, of random rows, on one thread:"
"$opensbt" - "$space" <<'PY'
import random
import sys
import time

import avastra

space = avastra.compile(sys.argv[1])
for road in space.roads:
    episodes = avastra.Episodes(space, road, ads="reactive")
    rows = [row for row in range(len(space.rows)) if space.draws(row, road)]
    drawn, began = random.Random(1), time.perf_counter()
    for _ in range(200):
        episodes.evaluate(1, [drawn.choice(rows) for _ in range(4)])
    print(f"  {road}: {200 / (time.perf_counter() - began):.0f} evaluations/s")
PY
echo "optuna:" && "$opensbt" python/examples/search_optuna.py "$space" residential 300 "$root/optuna.ava"
echo "OpenSBT:" && "$opensbt" python/examples/search_opensbt.py "$space" residential 'pedestrian(from: Right)' "$root/opensbt.ava" | tail -1
echo "pyribs:" && "$ribs" python/examples/search_pyribs.py "$space" residential 1000 "$root/ribs.ava"
echo "Stable-Baselines3:" && "$ribs" python/examples/train_sb3.py "$space" corner \
    scenarios/ads/faults/planning_never_yields.yaml 20000 "$root/sb3" | tail -1
"$avastra" replay "$root"/optuna.ava "$root"/opensbt.ava "$root"/ribs.ava | tail -1
