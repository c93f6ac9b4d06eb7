"""Resident memory and bytes of run.db for 100, 1,000 and 10,000 episodes, each number in one process: memory.py [AVASTRA [COMMAND]].

With the COMMAND of a driving system of one's own, one process of it drives all episodes of one road. Fails if 10,000 episodes need a quarter more memory than 1,000: nothing may grow with the number of episodes. Needs Unix.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROADS = 4


def measured(avastra, episodes, folder, program):
    """Largest resident memory, kB, and the size of the database."""
    out = Path(folder, str(episodes))
    command = [avastra, "run", "scenarios/avastra45.ava", "--jobs", "1", "--quiet", "--out", str(out)]
    if program:
        command += ["--ads", program, "--road", "corner", "--agent", "none", "--episodes", str(episodes)]
    else:
        command += ["--traffic", "released", "--episodes", str(episodes // ROADS)]
    run = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(run.pid, 0)
    if status != 0:
        sys.exit(f"a run of {episodes} episodes failed")
    kilobytes = used.ru_maxrss // (1024 if sys.platform == "darwin" else 1)
    return kilobytes, (out / "run.db").stat().st_size, used.ru_utime + used.ru_stime


def main(avastra=None, program=None):
    if avastra is None:
        subprocess.run(["cargo", "build", "--release", "--quiet", "--bin", "avastra"], cwd=ROOT, check=True)
        avastra = ROOT / "target/release/avastra"
    with tempfile.TemporaryDirectory() as folder:
        resident = {}
        for episodes in [100, 1_000, 10_000]:
            resident[episodes], size, seconds = measured(Path(avastra).resolve(), episodes, folder, program)
            print(
                f"{episodes:6,} episodes: {resident[episodes] / 1024:6.1f} MB resident, "
                f"{size / episodes:6,.0f} bytes of run.db and {1000 * seconds / episodes:5.1f} CPU ms an episode",
                flush=True,
            )
    if resident[10_000] > 1.25 * resident[1_000]:
        sys.exit("memory grows with the number of episodes")


main(*sys.argv[1:])
