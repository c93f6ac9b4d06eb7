#!/bin/sh
# Makes up texts until one breaks a law of `examine.rs`: a crash, more than 1 s, or more than 256 MB, for
# up to 64 KB of text. Needs a nightly compiler and `cargo install cargo-fuzz`. The first argument is
# for how many seconds (1800); what it keeps goes to `fuzz/corpus/`. The second argument is the target: `text` (any
# text), or `scale` (texts that are large in one construct; `each_construct_scales` in `tests/it/hostile.rs` measures
# the program on them without any of this).
set -eu
cd "$(dirname "$0")/.."
target="${2:-text}"
mkdir -p "fuzz/corpus/$target"
if [ "$target" = scale ]; then
    exec cargo +nightly fuzz run --sanitizer none scale fuzz/corpus/scale -- \
        -seed=6 -max_len=3 -timeout=5 -rss_limit_mb=500 -malloc_limit_mb=500 -max_total_time="${1:-1800}"
fi
exec cargo +nightly fuzz run --sanitizer none text fuzz/corpus/text fuzz/seeds tests/cases/diagnostics -- \
    -seed=6 -dict=fuzz/ava.dict -max_len=65536 -timeout=1 -rss_limit_mb=256 -malloc_limit_mb=256 \
    -max_total_time="${1:-1800}" -print_final_stats=1
