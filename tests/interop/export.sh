#!/bin/sh
# Do other tools read what `avastra export` writes, and see the same crashes? Finds crashes of a driving system that never
# yields, exports them, and asks OpenSCENARIO's schema, ASAM's checkers, CommonRoad's reader and collision checker, and, if
# ESMINI names its program (built from its public repository, with `dat2csv` beside it), an independent player; how far
# natural versions drift in it is told.
# Needs Python 3 and, once, a network for `pip install`.
# Arguments: episodes on each road (default 100), and what else `run` is to be told: `540 --traffic released` finds 200 crashes.
set -eu
episodes=${1:-100}
[ $# -eq 0 ] || shift
cd "$(dirname "$0")/../.."
work=target/interop/export
if ! [ -x "$work/venv/bin/python" ]; then
    python3 -m venv "$work/venv"
fi
"$work/venv/bin/python" -c 'import qc_openscenario, qc_opendrive, commonroad, commonroad_dc, betterosi' 2>/dev/null ||
    "$work/venv/bin/pip" install --quiet asam-qc-openscenarioxml==1.0.0 asam-qc-opendrive==1.0.0 \
        commonroad-io==2026.1 commonroad-drivability-checker==2025.4.0 betterosi==0.9.0 mcap
avastra=${AVASTRA:-target/release/avastra}
[ -x "$avastra" ] || cargo build --release
rm -rf "$work/run" "$work/out" "$work/natural" "$work/carla"
"$avastra" run scenarios/avastra45.ava --ads scenarios/ads/faults/planning_never_yields.yaml \
    --episodes "$episodes" --seed 1 --out "$work/run" --quiet "$@"
for arguments in "openscenario" "commonroad --ego trajectory" "csv"; do
    # shellcheck disable=SC2086
    "$avastra" export --to $arguments --out "$work/out" "$work"/run/critical/*.ava
done
"$avastra" export --to openscenario --natural --out "$work/natural" "$work"/run/critical/*.ava
"$avastra" export --to openscenario --profile carla --out "$work/carla" "$work"/run/critical/*.ava 2>/dev/null
"$work/venv/bin/python" tests/interop/export.py "$work/out" "$work/natural" "$work/carla" ${ESMINI:+"$ESMINI"}
