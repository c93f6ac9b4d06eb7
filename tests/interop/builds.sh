#!/bin/sh
# Holds the committed traces of ten episodes against a debug build, a release build, and a release build that uses all the
# instructions of this machine (AVX2 and FMA, if it has them). Then two runs, on one thread and on two, must leave equal
# databases. Not part of `cargo test`, because the builds take minutes.
set -eu
cd "$(dirname "$0")/../.."
held() {
    echo "$1"
    INSTA_UPDATE=no cargo test --profile "$2" --target-dir "$3" --test it traces::
}
held debug dev target
held release release target
RUSTFLAGS="-C target-cpu=native" held "release, native" release target/native
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
for jobs in 1 2; do
    cargo run --quiet --release -- run scenarios/avastra45.ava --traffic released --episodes 10 --jobs "$jobs" --quiet \
        --out "$out/$jobs" > /dev/null
    python3 - "$out/$jobs/run.db" > "$out/$jobs.txt" <<'SQL'
import sqlite3, sys
database = sqlite3.connect(sys.argv[1])
for table in ["episode", "collision", "step", "seal"]:
    for row in sorted(database.execute(f"SELECT * FROM {table}"), key=repr):
        print(table, *row)
SQL
done
cmp "$out/1.txt" "$out/2.txt"
echo "one thread and two: equal"
