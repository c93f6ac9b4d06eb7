"""Plays every variation of public test files against a driving system, and says what came of them.

Arguments: the program, the driving system, worker threads, and folders that hold `.xosc` files. Files that name the same variations in
several folders are all played. Left in target/interop/protocol: a space for each file and a run of each of its rows. Prints the
endings by file, and a digest of all tables and traces, which must not depend on the number of threads.
"""

import collections
import csv
import hashlib
import shutil
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

OUT = Path("target/interop/protocol")
ENDINGS = ["avoided", "near miss", "mitigated", "hit", ""]


def main():
    avastra, ads, jobs, folders = sys.argv[1], sys.argv[2], sys.argv[3], [Path(folder) for folder in sys.argv[4:]]
    if not folders:
        sys.exit("usage: protocol.py AVASTRA ADS JOBS FOLDER...")
    shutil.rmtree(OUT, ignore_errors=True)
    digest, total, played, began = hashlib.sha256(), collections.Counter(), 0, time.monotonic()
    for folder in folders:
        for file in sorted(folder.rglob("*.xosc")):
            # The concrete scenarios are rows of their variations, but for those without any.
            if "<ParameterValueDistribution" not in file.read_text(errors="replace"):
                continue
            out = OUT / folder.name / file.relative_to(folder).with_suffix("")
            done = subprocess.run([avastra, "import", "--out", out, file], capture_output=True, check=False)
            if done.returncode != 0:
                print(f"  refused: {file.stem}")
                continue
            run = out / "run"
            subprocess.run([avastra, "run", out / f"{file.stem}.ava", "--agent", "every-row", "--ads", ads, "--repeat", "0",
                            "--jobs", jobs, "--out", run], capture_output=True, check=True)
            with open(run / "protocol.csv", newline="") as table:
                rows = list(csv.DictReader(table))
            digest.update((run / "protocol.csv").read_bytes())
            with sqlite3.connect(run / "run.db") as database:
                for (trace,) in database.execute("SELECT trace FROM episode ORDER BY episode"):
                    digest.update(trace.encode())
            counts = collections.Counter(row["ending"] for row in rows)
            total.update(counts)
            played += len(rows)
            told = ", ".join(f"{counts[ending]} {ending or 'not played'}" for ending in ENDINGS if counts[ending])
            print(f"  {file.stem}: {told}", flush=True)
    told = ", ".join(f"{total[ending]} {ending or 'not played'}" for ending in ENDINGS if total[ending])
    print(f"{played} variations: {told}; {time.monotonic() - began:.0f} s; digest {digest.hexdigest()[:16]}")


if __name__ == "__main__":
    main()
