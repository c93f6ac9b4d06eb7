#!/bin/sh
# Where the instructions go: per tick with ten others around, and per step of a whole run, by parts of avastra.
# Counted by callgrind, so a busy machine changes nothing. callgrind has no SHA instructions: hashes weigh more than they do
# on processors with them. `sh benches/profile.sh BINARIES` takes `avastra` and `marks` from a folder instead of building.
# `sh benches/profile.sh tick AVASTRA…` counts instructions within ticks alone, of a town without actions, for each program
# (built with symbols): what a change costs those who do not use it.
# `sh benches/profile.sh law AVASTRA` counts those of whole drives without requirements, with one, and with `law.ava`.
set -eu
cd "$(dirname "$0")/.."
for needed in valgrind python3; do
    command -v "$needed" > /dev/null || { echo "profile.sh needs $needed (Debian: apt install $needed)" >&2; exit 1; }
done
work=target/profile
mkdir -p "$work"
if [ $# = 0 ]; then
    # What was inlined is told apart by line tables alone.
    CARGO_PROFILE_RELEASE_STRIP=false CARGO_PROFILE_RELEASE_DEBUG=line-tables-only \
        cargo build --release --target-dir "$work" --bin avastra --bench marks
    set -- "$work/release"
    cp "$(ls -t "$1"/deps/marks-* | grep -v '\.d$' | head -n 1)" "$1/marks"
fi
counted() {
    out=$1
    shift
    valgrind --tool=callgrind --callgrind-out-file="$work/$out" "$@" > "$work/$out.log" 2>&1 \
        || { tail -n 20 "$work/$out.log" >&2; exit 1; }
}
if [ "${1-}" = tick ]; then
    shift
    for avastra in "$@"; do
        for ads in idm modular; do
            rm -rf "$work/run"
            counted within_ticks --toggle-collect='*World*::tick*' "$avastra" run scenarios/avastra45.ava --road boulevard \
                --ads "$ads" --agent none --ambient 8 --seed 3 --episodes 3 --jobs 1 --quiet --out "$work/run"
            echo "$avastra $ads: $(sed -n 's/.*Collected : //p' "$work/within_ticks.log") instructions within ticks"
        done
    done
    exit
fi
if [ "${1-}" = law ]; then
    for ads in modular idm; do
        for requires in '' 'require one: ego.speed <= ego.limit + 1 m/s within 2 s' 'use "../../scenarios/law.ava"'; do
            rm -rf "$work/run"
            printf 'language 1\nuse "../../scenarios/avastra45.ava"\n%s\n' "$requires" > "$work/law.ava"
            counted law --toggle-collect='*observation_period*' "$2" run "$work/law.ava" --road boulevard \
                --ads "$ads" --agent none --ambient 8 --seed 3 --episodes 12 --jobs 1 --quiet --out "$work/run"
            echo "$ads, '$requires': $(sed -n 's/.*Collected : //p' "$work/law.log") instructions"
        done
    done
    exit
fi
for ads in modular idm; do
    counted "tick.$ads" --toggle-collect='marks::Drive::tick' "$1/marks" "ticks_per_s_$ads"
    python3 benches/profile.py "$work/tick.$ads" 'World(>|)::tick$' tick "$ads"
done
for ads in modular idm; do
    rm -rf "$work/run"
    counted "run.$ads" "$1/avastra" run scenarios/avastra45.ava --ads "$ads" --traffic released --episodes 5 --jobs 1 \
        --quiet --out "$work/run"
    python3 benches/profile.py "$work/run.$ads" 'Play::step$' step "run of 20 episodes, $ads"
done
