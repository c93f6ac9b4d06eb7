#!/bin/sh
# Lets learners that others wrote train on avastra, unmodified, and counts what they find beside `avastra train` at equal
# simulated time: gym.sh [SEEDS]. Run wheel.sh first: it builds the wheel. PROFILE=dev takes a faster build. Needs Python 3.11 with venv, and PyPI for the first run.
set -eu
cd "$(dirname "$0")/../.."
profile=${PROFILE:-release}
case $profile in dev) folder=debug ;; *) folder=$profile ;; esac
venv=target/interop/gym
if [ ! -e "$venv/ready" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet torch --index-url https://download.pytorch.org/whl/cpu || "$venv/bin/pip" install --quiet torch
    # RLlib pins Gymnasium.
    "$venv/bin/pip" install --quiet 'ray[rllib]==2.60.0' 'gymnasium==1.2.2' 'stable-baselines3==2.9.2' 'sb3-contrib==2.9.2'
    touch "$venv/ready"
fi
"$venv/bin/pip" install --quiet --force-reinstall --no-deps target/interop/wheel/dist/*.whl
cargo build --quiet --profile "$profile"
"$venv/bin/python" tests/interop/gym_train.py "target/$folder/avastra" "${1:-1}"
