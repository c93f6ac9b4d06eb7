#!/bin/sh
# Draws the pictures of the book again: `sh docs/pictures/make.sh`. Needed when the engine or how it draws changes: look at each picture
# then, and at the moments below. `AVASTRA` names the program; without it, the program is built.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
binary=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)

cd "$root"
# One picture a line: its name, the moments of its panels in s, and its scenario, if that is no file of the same name here.
while read -r name moments scenario; do
  "$binary" render "${scenario:-docs/pictures/$name.ava}" --at "$moments" --out "docs/pictures/$name.svg" < /dev/null
done <<END
drive_behind 0.02,6
overtake 0.02,4
drive_opposite 0.02
cross_road 5.7
walk 2.5
walk_along 0.02
stand 0.02
follow 0.02,2.4,4.2
places 2.02
lane_offset 0.02
from_behind 1,2.8
early 4.78,6.78
cut_in 0.5,2.4
left_turn 6,7.94
from_the_right 5.5,7.12
crosswalk 11.5,13.42
strangers_pedestrian 1.3,3.26 scenarios/strangers/metadrive_crossroad_0069.ava
END
