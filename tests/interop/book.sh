#!/bin/sh
# Renders the book with mdBook and looks at it in a browser, from files: each page at two widths, light and dark, without a
# console error, a broken picture or a cut page; the search finds forty words of the glossary.
#
# Needs mdBook 0.5 (`cargo install mdbook --version '^0.5'`, or MDBOOK=/path/to/it), node with npm (for the first run its
# registry) and Chromium as report.sh. Everything it makes stays under target/interop/book.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
work=$root/target/interop/book
mkdir -p "$work"
if [ ! -d "$work/node_modules/puppeteer-core" ]; then
  [ -f "$work/package.json" ] || echo '{"private": true}' > "$work/package.json"
  (cd "$work" && npm install --no-audit --no-fund --silent puppeteer-core)
fi
"${MDBOOK:-mdbook}" build "$root/docs" --dest-dir "$work/html"
node "$root/tests/interop/book.mjs" "$work" "$root/docs/glossary.md"
