#!/bin/sh
# The slow twin: plays some 10,000 episodes with debug assertions, in which who may touch whom, and who matters at a junction, are
# worked out anew in each tick and compared with what is kept. On shipped roads, on motorways and on the maps that
# `sh benches/twin.sh SPACE…` names; ambient traffic 0, 8, 20 and 60; careful and released drivers. Ends with another status than 0
# at the first difference. Four minutes on two cores, and four for the build.
set -eu
cd "$(dirname "$0")/.."
cargo build --profile twin
work=target/twin/run
all=0
played() {
    episodes=$1
    shift
    rm -rf "$work"
    target/twin/avastra run "$@" --repeat 0 --episodes "$episodes" --seed "$((all + 1))" --quiet --out "$work" > /dev/null
    all=$((all + 1))
    echo "the same: $episodes episodes a road of $*"
}
for ambient in 0 8 20; do
    for ads in modular idm scenarios/ads/degraded.yaml; do
        played 180 scenarios/avastra45.ava --ads "$ads" --ambient "$ambient"
        played 45 scenarios/avastra45.ava --ads "$ads" --ambient "$ambient" --traffic released
    done
    played 100 scenarios/manoeuvres.ava --ads reactive --ambient "$ambient"
    played 20 scenarios/r157.ava --ads idm --ambient "$ambient"
done
played 60 scenarios/avastra45.ava --ads idm --ambient 60
for catalogue in euro_ncap_cars euro_ncap_vulnerable pre_crash; do
    played 1 "scenarios/catalogue/$catalogue.ava" --agent every-row --ads idm
done
for space in tests/cases/maps/dead_end.ava tests/cases/maps/left_hand.ava tests/cases/maps/motorway.ava "$@"; do
    played 100 "$space" --agent none --ads idm --ambient 8
done
