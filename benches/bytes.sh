#!/bin/sh
# Whether two programs play the same: `sh benches/bytes.sh AVASTRA OTHER` plays some 700 episodes with each (careful and released traffic,
# the law among ambient traffic, manoeuvres, a motorway, every row of the catalogue) and compares databases and scenarios, byte by byte.
# Ends with status 1 if one differs. Half a minute on two cores.
set -eu
cd "$(dirname "$0")/.."
[ $# = 2 ] || { sed -n 2,4p benches/bytes.sh >&2; exit 2; }
command -v sqlite3 > /dev/null || { echo "bytes.sh needs sqlite3 (Debian: apt install sqlite3)" >&2; exit 1; }
work=target/bytes
rm -rf "$work"
mkdir -p "$work"

# The digest of a run: its database as text but for the times that it took, and its scenarios.
played() {
    name=$1
    shift
    rm -rf "$work/run"
    "$avastra" run "$@" --repeat 0 --quiet --out "$work/run" > /dev/null
    { sqlite3 "$work/run/run.db" .dump; cat "$work"/run/critical/*.ava; } 2> /dev/null | sha256sum | cut -c -64 | tr "\n" " "
    echo "$name"
}

for avastra in "$1" "$2"; do
    {
        played careful scenarios/avastra45.ava --episodes 60 --seed 4
        played released scenarios/avastra45.ava --episodes 60 --seed 5 --traffic released --ads scenarios/ads/degraded.yaml
        played law scenarios/avastra45_law.ava --episodes 30 --seed 6 --ambient 8 --ads idm
        played manoeuvres scenarios/manoeuvres.ava --episodes 60 --seed 7 --ads reactive
        played motorway scenarios/r157.ava --episodes 20 --seed 8 --ambient 6
        for catalogue in euro_ncap_cars euro_ncap_vulnerable pre_crash; do
            played "$catalogue" "scenarios/catalogue/$catalogue.ava" --agent every-row --ads idm
        done
    } > "$work/$(echo "$avastra" | tr / _).txt"
done
first="$work/$(echo "$1" | tr / _).txt"
second="$work/$(echo "$2" | tr / _).txt"
if diff "$first" "$second"; then echo "the same: $(wc -l < "$first") runs"; else exit 1; fi
