"""Plays our catalogue of protocols with every driving system of avastra, and with one that sees nothing: how each family of rows ends.

Arguments: the program, and `--write` to put the table into scenarios/catalogue/README.md. The driver that sees nothing must hit in every
row; if not, a row does not test what it says (where ranges are drawn, a slow cut-in may come too late).
"""

import collections
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Each with how often its rows are played: ranges are drawn.
FILES = {"catalogue/euro_ncap_cars": 1, "catalogue/euro_ncap_vulnerable": 1, "catalogue/pre_crash": 1, "r157": 20}
DRIVERS = ["modular", "frenet", "reactive", "idm", "cc", "fsm", "rss", "r157"]
BLIND = "blind"
ENDINGS = ["avoided", "near miss", "mitigated", "hit"]
BEGIN, END = "<!-- begin: table -->", "<!-- end: table -->"


def played(avastra, file, ads):
    with tempfile.TemporaryDirectory() as out:
        run = Path(out) / "run"
        subprocess.run([avastra, "run", ROOT / f"scenarios/{file}.ava", "--agent", "every-row", "--episodes", str(FILES[file]), "--ads", ads,
                        "--repeat", "0", "--out", run], check=True, capture_output=True)
        with open(run / "protocol.csv", newline="") as table:
            return list(csv.DictReader(table))


def family_of(file, action):
    if file == "catalogue/pre_crash":
        return "pre-crash types"
    if file == "r157":
        return f"R157 {action.replace('_', '-')}"
    # The near and the far side, and overlaps, are one family.
    return action.split("_")[0].upper()


def main():
    avastra = sys.argv[1]
    families, counts, missed = [], collections.defaultdict(collections.Counter), []
    for file in FILES:
        for ads in [*DRIVERS, BLIND]:
            for row in played(avastra, file, ads):
                family = family_of(file, row["action"])
                if family not in families:
                    families.append(family)
                counts[family, ads][row["ending"]] += 1
                counts["all", ads][row["ending"]] += 1
    shown = [*DRIVERS, BLIND]
    lines = ["| family | rows | " + " | ".join(shown) + " |", "|---|---" + "|---" * len(shown) + "|"]
    for family in [*families, "all"]:
        rows = sum(counts[family, DRIVERS[0]].values())
        cells = [" / ".join(str(counts[family, ads][ending]) for ending in ENDINGS) for ads in shown]
        lines.append(f"| {family} | {rows} | " + " | ".join(cells) + " |")
        touched = counts[family, BLIND]["hit"] + counts[family, BLIND]["mitigated"]
        # A slow cut-in may come after the ego vehicle has passed: such draws of a range are no test.
        if touched != rows and family != "all" and not family.startswith("R157"):
            missed.append(f"the driver that sees nothing hits in {touched} of {rows} rows of {family}")
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
