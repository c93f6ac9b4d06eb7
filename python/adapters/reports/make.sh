#!/bin/sh
# Makes what a maintainer of a driving system needs of a failure: `sh python/adapters/reports/make.sh fiss` fills target/reports/fiss.
#
# Beside README.md and show.py, which shows the failure with the package alone, there are then: the smallest scenario with its recorded answers, a page
# to watch, what the driving system was told and answered, and all versions. AVASTRA names the command.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
name=${1:?"name a report: $(cd "$here" && echo */ | tr -d /)"}
[ -f "$here/$name/show.py" ] || { echo "make.sh: there is no report \`$name\`; there are: $(cd "$here" && echo */ | tr -d /)" >&2; exit 1; }
avastra=${AVASTRA:-$root/target/release/avastra}
[ -n "${AVASTRA:-}" ] || (cd "$root" && cargo build --release --quiet)

out=$root/target/reports/$name
rm -rf "$out"
mkdir -p "$out"
profile=$(sh "$root/python/adapters/run.sh" "$name")
python=$root/target/adapters/$name/bin/python
cp "$here/$name/README.md" "$here/$name/show.py" "$out"
case $name in
fiss) scenario=$here/fiss/red_light.ava ;;
commonroad_idm) scenario=$root/scenarios/strangers/commonroad_idm_corner_0010.ava ;;
metadrive) scenario=$root/scenarios/strangers/metadrive_crossroad_0069.ava ;;
*) echo "make.sh: it does not know the scenario of \`$name\`" >&2; exit 1 ;;
esac
"$avastra" shrink "$scenario" --ads "$profile" --repeat 0 -o "$out/scenario.ava"
"$avastra" replay "$out/scenario.ava" --record "$out/questions.jsonl"
"$avastra" report "$out/scenario.ava" -o "$out/page.html"
{ "$avastra" --version; "$python" --version; "$python" -m pip freeze; } >"$out/versions.txt"
# It exits with 3 if it shows the failure; Python itself exits with 1 if the script breaks.
status=0
"$python" "$out/show.py" >"$out/shown.txt" 2>"$out/shown.log" || status=$?
if [ $status -ne 3 ]; then
    echo "make.sh: show.py does not show the failure (status $status): see $out/shown.txt and $out/shown.log" >&2
    exit 1
fi
cat "$out/shown.txt"
echo "$out"
