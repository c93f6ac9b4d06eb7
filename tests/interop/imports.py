"""How many OpenSCENARIO files of others does `avastra import` take, and why does it refuse the rest?

Arguments: the program, and folders that hold `.xosc` files at any depth: of public repositories, which are to be fetched before
(docs/maintaining.md names them). What is imported is left in target/interop/imports. A file that is refused is counted at its first
reason. Files of catalogues are left out: they are no scenarios. Some examples of esmini call no entity `Ego`; who stands for it is in EGO.
"""

import collections
import json
import subprocess
import sys
import time
from pathlib import Path

#: The ego vehicle of files that call nobody so.
EGO = {
    "light_state": "Car1", "parking_demo": "Target", "speed-profile": "Car1", "tunnels": "Car1", "velodrome": "Car1",
}

#: ALKS's logical files have up to 52,500.
VARIATIONS = "60000"


def main():
    avastra, folders = sys.argv[1], [Path(folder) for folder in sys.argv[2:]]
    if not folders:
        sys.exit("usage: imports.py AVASTRA FOLDER...")
    for folder in folders:
        files = [file for file in sorted(folder.rglob("*.xosc")) if "<Catalog " not in file.read_text(errors="replace")]
        imported, reasons, slowest = 0, collections.defaultdict(list), 0.0
        for file in files:
            out = Path("target/interop/imports") / folder.name / file.relative_to(folder).with_suffix("")
            ego = ["--ego", EGO[file.stem]] if file.stem in EGO else []
            began = time.monotonic()
            done = subprocess.run([avastra, "import", "--format", "json", "--variations", VARIATIONS, "--out", out, *ego, file],
                                  capture_output=True, text=True, check=False)
            slowest = max(slowest, time.monotonic() - began)
            if done.returncode not in (0, 2):
                sys.exit(f"{file}: status {done.returncode}: {done.stderr}")
            result = json.loads(done.stdout.splitlines()[-1])["imported"][0]
            if done.returncode == 0:
                imported += 1
                continue
            refused = result["refused"][0]
            reasons[f"{refused['element']}: {refused['reason']}"].append(file.stem)
        print(f"{folder}: {imported} of {len(files)} imported, the slowest in {slowest:.1f} s")
        for reason, stems in sorted(reasons.items(), key=lambda item: (-len(item[1]), item[0])):
            print(f"  {len(stems):3} × {reason} ({', '.join(stems)})")


if __name__ == "__main__":
    main()
