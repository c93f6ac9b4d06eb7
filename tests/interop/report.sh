#!/bin/sh
# Opens a report in a real browser: plays, scrubs to the collision, toggles each layer, filters, opens a deep link, compares
# two drives, prints, and takes screenshots on a wide screen and on a phone's. No console error, no request; axe-core finds
# no violation; numbers read back are those of the file; a linter reads the script. Pages of a training and an estimate, and
# sizes at 50 and 500 scenarios.
#
# Needs node with npm (for the first run its registry) and Chromium: `CHROMIUM=/path/to/it`, or Debian's package `chromium`.
# `RUN=DIR` takes a run directory in place of a new one. Everything it makes stays under target/interop/report.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
work=$root/target/interop/report
mkdir -p "$work"
binary=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)

if [ ! -d "$work/node_modules/axe-core" ] || [ ! -d "$work/node_modules/typescript" ]; then
  [ -f "$work/package.json" ] || echo '{"private": true}' > "$work/package.json"
  (cd "$work" && npm install --no-audit --no-fund --silent puppeteer-core axe-core eslint @eslint/js globals prettier typescript)
fi

# The linter reads each module. That a name stands once in all of them, which become one script, `tests/page` keeps.
cp "$root/tests/interop/report.eslint.mjs" "$work/eslint.config.mjs"
rm -rf "$work/lint" && mkdir "$work/lint"
cp "$root"/src/exchange/report/page/*.js "$work/lint"
(cd "$work" && npx prettier --print-width 120 --check "lint/*.js" > lint.txt) || { cat "$work/lint.txt"; exit 1; }
(cd "$work" && npx eslint --max-warnings 0 lint)
# The modules hold to the shapes of `data.d.ts`.
"$work/node_modules/.bin/tsc" -p "$root/src/exchange/report/page"
for file in "$root"/src/exchange/report/page/*; do
  [ "$(wc -l < "$file")" -lt 350 ] || { echo "$file is too long"; exit 1; }
done
echo "the linter finds nothing"

if [ -z "${RUN:-}" ]; then
  RUN=$work/run
  rm -rf "$RUN"
  "$binary" run "$root/scenarios/avastra45.ava" --ads "$root/scenarios/ads/faults/planning_never_yields.yaml" \
    --causes --episodes 30 --seed 3 --out "$RUN" --quiet > /dev/null
  "$binary" shrink "$RUN"/critical/*.ava --quiet > /dev/null
fi
page=$work/page.html
"$binary" report "$RUN" --ads cc --out "$page"

# Pages of what has no crash to watch: a training's and an estimate's; STUDY=DIR adds a study's.
short="--road corner --seed 5 --quiet"
rm -rf "$work/train" "$work/estimate"
"$binary" train "$root/scenarios/avastra45.ava" --agent bandit --episodes 20 $short --out "$work/train" > /dev/null
"$binary" estimate "$root/scenarios/avastra45.ava" --ads reactive --traffic released --event collision --parts 3 \
  --episodes 30 $short --out "$work/estimate" > /dev/null
"$binary" report "$work/train" --most 5 --out "$work/training.html"
"$binary" report "$work/estimate" --most 5 --out "$work/estimate.html"
others="$work/training.html $work/estimate.html"
if [ -n "${STUDY:-}" ]; then
  "$binary" report "$STUDY" --out "$work/study.html"
  others="$others $work/study.html"
fi

# Copies have other names and the same contents: each is packed on its own, so sizes are as of so many different ones.
for wanted in 50 500; do
  folder=$RUN/copies_$wanted
  rm -rf "$folder" && mkdir "$folder"
  made=0
  while [ "$made" -lt "$wanted" ]; do
    for file in "$RUN"/critical/*.ava; do
      made=$((made + 1))
      [ "$made" -gt "$wanted" ] || cp "$file" "$folder/$(printf '%04d' "$made").ava"
    done
  done
  "$binary" report "$folder" --most 10000 --out "$work/page_$wanted.html"
done

cd "$work"
NODE_PATH=$work/node_modules exec node "$root/tests/interop/report.mjs" "$work" "$page" "$work/page_50.html" "$work/page_500.html" $others
