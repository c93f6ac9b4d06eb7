#!/bin/sh
# Holds our reading of OpenDRIVE against an independent reader, on maps that others' tools make.
#
# SUMO's netgenerate and netconvert make the maps, `avastra road` and CARLA's map library (which needs
# no server) read them; maps.py compares. Needs python3 with venv, and PyPI for the first run. Everything
# it makes stays under target/interop.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
work=$root/target/interop
venv=$work/venv
mkdir -p "$work"
if [ ! -e "$venv/installed" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet carla==0.9.16 eclipse-sumo==1.28.0
    touch "$venv/installed"
fi
(cd "$root" && cargo build --quiet)
exec "$venv/bin/python" "$root/tests/interop/maps.py" "$root/target/debug/avastra" "$work/maps"
