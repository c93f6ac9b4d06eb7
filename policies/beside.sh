#!/bin/sh
# What each shipped policy finds beside random choice, in the same episodes: `sh policies/beside.sh AVASTRA`, from the repository's root.
set -eu

avastra=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
told() {
    name=$1
    shift
    "$avastra" run "$@" --episodes 60 --seed 7 --quiet --out "$scratch/$name" | grep -E "counted in|finding|kinds? of failure" | sed "s|^|$name: |"
}
for road in residential corner crossroad boulevard; do
    told "$road, policy" --policy "policies/$road.ava"
    told "$road, rules" --policy "policies/$road.ava" --face rules
    told "$road, random" scenarios/avastra45.ava --road "$road" --ads scenarios/ads/faults/planning_never_yields.yaml
done
