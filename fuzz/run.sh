#!/bin/sh
# Makes up texts until one breaks a law of `examine.rs`: a crash, more than 1 s, or more than 256 MB, for
# up to 64 KB of text. Needs a nightly compiler and `cargo install cargo-fuzz`. The first argument is
# for how many seconds (1800); what it keeps goes to `fuzz/corpus/`.
set -eu
cd "$(dirname "$0")/.."
mkdir -p fuzz/corpus/text
exec cargo +nightly fuzz run --sanitizer none text fuzz/corpus/text fuzz/seeds tests/cases/diagnostics -- \
    -seed=6 -dict=fuzz/ava.dict -max_len=65536 -timeout=1 -rss_limit_mb=256 -malloc_limit_mb=256 \
    -max_total_time="${1:-1800}" -print_final_stats=1
