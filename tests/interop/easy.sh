#!/bin/sh
# Which planted faults are not easy (see scenarios/studies/rq1.yaml): `sh tests/interop/easy.sh AVASTRA`. Of each fault: what random choice counts in
# four hours and how many kinds recur, and in how many of 40 episodes the best row of a list crashes on the crossroad.
set -eu
avastra=$1
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
said() {
  python3 -c "import json, sys; found = json.loads(sys.stdin.read().splitlines()[-1]); print($1, end='; ')"
}
for fault in scenarios/ads/faults/*.yaml; do
  name=$(basename "$fault" .yaml)
  printf '%s: ' "$name"
  "$avastra" run scenarios/avastra45.ava --ads "$fault" --hours 4 --seed 5 --format json --out "$scratch/$name-random" 2>/dev/null |
    said "f\"random {found['totals']['counted']} in {found['totals']['episodes']} episodes, {len(found['left']['kinds'])} kinds\""
  "$avastra" train scenarios/avastra45.ava --ads "$fault" --agent constant --road crossroad --episodes 150 --evaluate 40 --seed 5 --format json \
    --out "$scratch/$name-constant" 2>/dev/null | said "f\"best row {found['evaluation']['colliding']} of {found['evaluation']['episodes']}\""
  echo
done
