"""Do spaces come back from OpenSCENARIO as they were?

Arguments: the program, and spaces. Each is exported, each template with its list of values is imported again, and every row of the space
and of what came back is played by a driving system whose sensors make no errors: the same drives must end alike, at the same speeds (km/h,
to a tenth). Rows that cannot be exported are told with their reasons. It leaves its files in target/interop/spaces, where
`esmini/compare.py` finds them.
"""

import collections
import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path


def avastra(program, *arguments):
    """The result of a command in JSON."""
    done = subprocess.run([program, *map(str, arguments), "--format", "json"], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(f"{arguments}: status {done.returncode}: {done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def played(program, space, out):
    """How each row ends, by action: how often each ending."""
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([program, "run", "--agent", "every-row", "--ads", "idm", "--out", out, space],
                   capture_output=True, text=True, check=False)
    ends = collections.defaultdict(collections.Counter)
    with open(out / "protocol.csv", encoding="utf-8") as table:
        for row in csv.DictReader(table):
            speeds = [round(float(row[name]), 1) if row[name] else None for name in ("before_kmh", "impact_kmh", "relative_kmh")]
            ends[row["action"]][(row["ending"], *speeds)] += 1
    return ends


def main():
    program, spaces = sys.argv[1], [Path(space) for space in sys.argv[2:]]
    base = Path("target/interop/spaces")
    shutil.rmtree(base, ignore_errors=True)
    differ = 0
    for space in spaces:
        exported = base / space.stem
        result = avastra(program, "export", "--to", "openscenario", "--out", exported, space)
        left_out = result["left_out"][0]["rows"]
        ends = played(program, space, base / "runs" / space.stem)
        files = [Path(file) for file in result["files"] if file.endswith(".xosc")]
        lists = [file for file in files if file.stem.endswith("_variations")]
        alone = [file for file in files if file not in lists and file.with_stem(f"{file.stem}_variations") not in lists]
        same = rows = 0
        found = collections.defaultdict(collections.Counter)
        for file in sorted(lists + alone):
            imported = avastra(program, "import", "--out", base / "imported" / space.stem, file)["imported"][0]
            if imported.get("refused"):
                sys.exit(f"{file}: {imported['refused']}")
            action = (file.stem.removesuffix("_variations")).removeprefix(f"{space.stem}_")
            again = played(program, imported["space"], base / "runs" / f"{space.stem}_{action}")
            base_action = action if action in ends else action.rsplit("_", 1)[0]
            for counter in again.values():
                found[base_action] += counter
        for action, counter in found.items():
            wanted = ends[action]
            rows += sum(counter.values())
            same += sum((counter & wanted).values())
            if counter - wanted:
                print(f"  {space.stem} {action}: {dict(counter - wanted)} for {dict(wanted - counter)}")
        differ += max(rows, result["rows"]) - same
        print(f"{space}: {rows} rows back of {result['rows']}, {same} end alike; left out: "
              + (", ".join(f"{len(named)} × {reason}" for reason, named in left_out.items()) or "none"))
    sys.exit(1 if differ else 0)


main()
