#!/bin/sh
# Draws the pictures of the book again: `sh docs/pictures/make.sh`. Needed when the engine or how it draws changes: look at each picture
# then, and at the moments below. `AVASTRA` names the program; without it, the program is built.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
binary=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)

cd "$root"
# One picture a line: its scenario, and the moments of its panels in s.
while read -r name moments; do
  "$binary" render "docs/pictures/$name.ava" --at "$moments" --out "docs/pictures/$name.svg"
done <<END
drive_behind 0.02,6
overtake 0.02,4
drive_opposite 0.02,3
cross_road 3.5,6
walk 0.02,2
walk_along 0.02,3
stand 0.02
follow 0.02,2,4
places 2.02
lane_offset 0.02
from_behind 0.02,2
early 3.5,6
cut_in 0.5,2
left_turn 4,6
from_the_right 4,6
crosswalk 10,12
END
