#!/bin/sh
# Finds the crash of README.md's picture again, with README.md's first command, and draws it: `sh scenarios/found/make.sh`.
# Needed when the engine, the driving system or the space change; another crash than this one may then be the one to show.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
found=residential_0046
binary=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cd "$root/scenarios/found"
"$binary" run ../avastra45.ava --ads ../ads/faults/perception_blind_to_large_vehicles.yaml --out "$work/run" --quiet
# The space lies beside this folder, wherever the run was.
sed 's|^use "[^"]*avastra45.ava"|use "../avastra45.ava"|' "$work/run/critical/$found.ava" > "$found.ava"
"$binary" render "$found.ava" --strip --out "$found.svg"
