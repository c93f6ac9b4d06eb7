#!/bin/sh
# The C++ client: its own test, the check of its example, and drives in which the example breaches nothing (some five minutes):
# `sh tests/interop/cpp.sh target/release/avastra`. Needs a C++17 compiler, `CXX` or `c++`.
set -eu

avastra=$(realpath "${1:?"name the program avastra"}")
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

flags="-std=c++17 -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
# shellcheck disable=SC2086
"${CXX:-c++}" $flags -g -fsanitize=address,undefined -o test "$root/examples/cpp/test.cpp"
./test
# shellcheck disable=SC2086
"${CXX:-c++}" $flags -O2 -o planner "$root/examples/cpp/planner.cpp"
"$avastra" ads check --ads ./planner
for agent in none random; do
    "$avastra" run "$root/scenarios/avastra45_law.ava" --agent $agent --episodes 10 --ads ./planner --out "$agent" \
        --fail-on collision,breach,stalled
done
