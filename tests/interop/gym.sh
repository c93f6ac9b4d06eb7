#!/bin/sh
# Lets learners that others wrote train on avastra, unmodified, and counts what they find beside `avastra train` at equal
# simulated time: gym.sh [SEEDS]. Then steps per second from Python, beside highway-env in the same process. Run wheel.sh first:
# it builds the wheel. Needs Python 3 with venv, and PyPI for the first run.
set -eu
cd "$(dirname "$0")/../.."
venv=target/interop/gym
if [ ! -e "$venv/installed" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet torch --index-url https://download.pytorch.org/whl/cpu || "$venv/bin/pip" install --quiet torch
    "$venv/bin/pip" install --quiet 'gymnasium==1.4.0' 'stable-baselines3==2.9.2' 'sb3-contrib==2.9.2' 'highway-env==1.12.1'
    touch "$venv/installed"
fi
"$venv/bin/pip" install --quiet --force-reinstall --no-deps target/interop/wheel/dist/*.whl
cargo build --release --quiet
"$venv/bin/python" tests/interop/gym_train.py target/release/avastra "${1:-1}"
"$venv/bin/python" tests/interop/gym_speed.py
