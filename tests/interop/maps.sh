#!/bin/sh
# Holds our reading of OpenDRIVE against an independent reader, on maps that others' tools make.
#
# SUMO's netgenerate and netconvert make the maps, `avastra road` and CARLA's map library (which needs
# no server) read them; maps.py compares. Needs python3 with venv, and PyPI for the first run. Everything
# it makes stays under target/interop.
set -eu

. "$(dirname "$0")/map_tools.sh"
(cd "$root" && cargo build --quiet)
exec "$venv/bin/python" "$root/tests/interop/maps.py" "$root/target/debug/avastra" "$work/maps"
