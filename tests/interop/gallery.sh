#!/bin/sh
# Drives on many maps that others' tools made, and prints a table: what loads, how far poses and links are from
# an independent reader's, how many lights hold lanes, and whether every driver arrives without a contact.
#
# SUMO's package brings the networks and its netgenerate makes more; netconvert writes them as OpenDRIVE. Further
# maps are taken from the folders that are named as arguments: `sh tests/interop/gallery.sh ~/maps`. Needs python3
# with venv, and PyPI for the first run. Everything it makes stays under target/interop.
set -eu

. "$(dirname "$0")/map_tools.sh"
binary=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)
exec "$venv/bin/python" "$root/tests/interop/gallery.py" "$binary" "$work/gallery" "$@"
