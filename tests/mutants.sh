#!/bin/sh
# Does a test notice when the enforcement of a rule is changed? Changes the code that enforces rules and the
# code that proves, one place after the other, and runs the tests that must then fail. Needs `cargo install
# cargo-mutants`; takes hours. Arguments go to cargo mutants: `sh tests/mutants.sh -f src/action/draw.rs`.
set -eu
cd "$(dirname "$0")/.."
if [ "$#" -eq 0 ]; then
    set -- -f 'src/model/rules/*.rs' -f 'src/action/*.rs' -f 'src/check/rule.rs' \
        -f 'src/check/scenario_rules.rs' -f 'src/prove/reach.rs'
fi
exec cargo mutants --output target/mutants --baseline skip --timeout 300 "$@" -- --lib --test it \
    -- action:: model:: prove:: check:: rules:: corpus:: wishes:: command::every_broken
