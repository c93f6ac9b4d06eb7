#!/bin/sh
# Does the collision checker of CommonRoad see the contacts that avastra reports, and no others? Plays the crashes that
# export.sh found, and each of them again with other seeds and other drivers, mostly without a crash; looks at every tick.
# Needs what export.sh left in target/interop/export.
# Arguments: number of episodes (default 1000).
set -eu
cd "$(dirname "$0")/../.."
work=target/interop/export
avastra=${AVASTRA:-target/release/avastra}
if ! [ -d "$work/run/critical" ]; then
    echo "no scenarios in $work/run/critical: run tests/interop/export.sh first" >&2
    exit 1
fi
"$work/venv/bin/python" tests/interop/confirm.py "$avastra" "$work/run/critical" "$work/confirm" "${1:-1000}"
