#!/bin/sh
# Plays a study on a Ray of this machine, kills workers, programs, the driver and the head, and compares time and bytes with the
# program alone. Needs Linux, Python 3.10 or later with venv, and PyPI for the first run. AVASTRA names a program that is built already.
set -eu
cd "$(dirname "$0")/../.."
venv=target/interop/ray-venv
if [ ! -e "$venv/installed" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet 'ray==2.60.0'
    touch "$venv/installed"
fi
[ -n "${AVASTRA:-}" ] || cargo build --release --quiet
rm -rf target/interop/ray
# Ray gives its workers a niceness of 15, by which anything else on the machine would be measured with them.
export RAY_worker_niceness=0 RAY_USAGE_STATS_ENABLED=0 PYTHONPATH=python
exec "$venv/bin/python" tests/interop/on_ray.py "${AVASTRA:-target/release/avastra}" target/interop/ray
