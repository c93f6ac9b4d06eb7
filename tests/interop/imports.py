"""How many OpenSCENARIO files of others does `avastra import` take, and what do the rest hold that it does not?

Arguments: the program, and folders with `.xosc` files (of esmini's examples, of the ALKS scenarios of UN R157: fetch them from
their public repositories). What is imported is left in target/interop/imports. A file is counted at each element that it is
refused for.
"""

import collections
import json
import subprocess
import sys
from pathlib import Path


def main():
    avastra, folders = sys.argv[1], [Path(folder) for folder in sys.argv[2:]]
    if not folders:
        sys.exit("usage: imports.py AVASTRA FOLDER...")
    for folder in folders:
        files = sorted(folder.glob("*.xosc"))
        out = Path("target/interop/imports") / folder.name
        imported, reasons = [], collections.defaultdict(set)
        for file in files:
            done = subprocess.run([avastra, "import", "--format", "json", "--out", out, file],
                                  capture_output=True, text=True, check=False)
            result = json.loads(done.stdout.splitlines()[-1])
            if done.returncode == 0:
                imported.append(file.stem)
                continue
            if done.returncode != 2:
                sys.exit(f"{file}: status {done.returncode}: {done.stderr}")
            for found in result["imported"]:
                for refused in found["refused"]:
                    # Names and figures are of the file.
                    reason = "`…`".join(refused["reason"].split("`")[::2])
                    reasons[f"{refused['element']}: {reason}"].add(file.stem)
        print(f"{folder}: {len(imported)} of {len(files)} imported: {', '.join(imported)}")
        for reason, stems in sorted(reasons.items(), key=lambda item: (-len(item[1]), item[0])):
            print(f"  {len(stems):3} × {reason}")


if __name__ == "__main__":
    main()
