#!/bin/sh
# Ticks per second over those of highway-env, in the same minute and on the same core. Needs Python 3 with venv, and PyPI
# for the first run.
set -eu
cd "$(dirname "$0")/../.."
venv=target/interop/highway_env
if [ ! -e "$venv/installed" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet highway-env==1.12.1
    touch "$venv/installed"
fi
marks=$(cargo bench --no-run --bench marks 2>&1 | sed -n 's/.*(\(target[^)]*marks-[^)]*\)).*/\1/p')
"$venv/bin/python" tests/interop/ticks.py "$marks"
