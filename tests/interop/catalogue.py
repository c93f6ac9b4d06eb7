"""Plays our catalogue of protocols with every driving system of avastra, and with one that sees nothing: how each family of rows ends.

Arguments: the program, and `--write` to put the table into scenarios/catalogue/README.md. The driver that sees nothing must hit in every
row; if not, a row does not test what it says.
"""

import collections
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = ["euro_ncap_cars", "euro_ncap_vulnerable"]
DRIVERS = ["modular", "frenet", "reactive", "idm", "cc", "fsm", "rss", "r157"]
BLIND = f"{sys.executable} {ROOT / 'tests/interop/esmini/blind.py'}"
ENDINGS = ["avoided", "near miss", "mitigated", "hit"]
BEGIN, END = "<!-- begin: table -->", "<!-- end: table -->"


def played(avastra, file, ads):
    with tempfile.TemporaryDirectory() as out:
        run = Path(out) / "run"
        subprocess.run([avastra, "run", ROOT / f"scenarios/catalogue/{file}.ava", "--agent", "every-row", "--ads", ads, "--replays", "0",
                        "--out", run], check=True, capture_output=True)
        with open(run / "protocol.csv", newline="") as table:
            return list(csv.DictReader(table))


def main():
    avastra = sys.argv[1]
    families, counts, missed = [], collections.defaultdict(collections.Counter), []
    for file in FILES:
        for ads in [*DRIVERS, BLIND]:
            for row in played(avastra, file, ads):
                # The near and the far side, and overlaps, are one family.
                family = row["action"].split("_")[0]
                if family not in families:
                    families.append(family)
                counts[family, ads][row["ending"]] += 1
                counts["all", ads][row["ending"]] += 1
    lines = ["| family | rows | " + " | ".join(DRIVERS) + " |", "|---|---" + "|---" * len(DRIVERS) + "|"]
    for family in [*families, "all"]:
        rows = sum(counts[family, DRIVERS[0]].values())
        cells = [" / ".join(str(counts[family, ads][ending]) for ending in ENDINGS) for ads in DRIVERS]
        lines.append(f"| {family.upper() if family != 'all' else 'all'} | {rows} | " + " | ".join(cells) + " |")
        if counts[family, BLIND]["hit"] != rows:
            missed.append(f"the driver that sees nothing hits in {counts[family, BLIND]['hit']} of {rows} rows of {family}")
    table = "\n".join(lines)
    print(table)
    if missed:
        sys.exit("\n".join(missed))
    if "--write" in sys.argv:
        readme = ROOT / "scenarios/catalogue/README.md"
        text = readme.read_text()
        head, rest = text.split(BEGIN)
        readme.write_text(head + BEGIN + "\n" + table + "\n" + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
