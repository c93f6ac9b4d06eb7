#!/bin/sh
# Runs ASAM's OpenDRIVE checker (PyPI: asam-qc-opendrive) over the authored roads; fails on any issue.
# Needs python3 and, the first time, the network: the checker is installed under target/.
set -eu
cd "$(dirname "$0")/../.."

venv=target/asam-checker
if [ ! -x "$venv/bin/qc_opendrive" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet asam-qc-opendrive==1.0.0
fi

failed=0
for map in scenarios/roads/*.xodr; do
    name=$(basename "$map" .xodr)
    config=$venv/$name.xml
    result=$venv/$name.xqar
    rm -f "$result"
    cat >"$config" <<XML
<Config>
  <Param name="InputFile" value="$PWD/$map"/>
  <CheckerBundle application="xodrBundle"><Param name="resultFile" value="$PWD/$result"/></CheckerBundle>
</Config>
XML
    "$venv/bin/qc_opendrive" -c "$config" >"$venv/$name.log" 2>&1
    issues=$(grep -c '<Issue ' "$result" || true)
    # A checker that did not run reports no issue either.
    ran=$(grep -c 'status="completed"' "$result" || true)
    echo "$map: $issues issues, $ran checkers completed"
    if [ "$issues" -ne 0 ] || [ "$ran" -eq 0 ]; then
        grep '<Issue ' "$result" || cat "$venv/$name.log"
        failed=1
    fi
done
exit $failed
