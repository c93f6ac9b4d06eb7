"""Does the shipped law find those that break it, and leave alone who keeps it?

    python3 tests/interop/law/run.py AVASTRA [SEED]

Each driver of `driver.py` drives 20 random episodes on each road of `avastra45_law.ava`, the sane one 100, among 12 vehicles of
ordinary traffic. Each must breach the requirement that it breaks, and the sane one none. Ends with status 1 if one does not.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
AVASTRA = str(Path(sys.argv[1]).resolve())
SEED = sys.argv[2] if len(sys.argv) > 2 else "1"
WANTED = {
    "sane": None,
    "red": "stops_at_red",
    "fast": "keeps_the_limit",
    "close": "keeps_distance",
    "brakes": "brakes_for_a_reason",
    "oncoming": "keeps_to_its_side",
    "never": "goes_on",
}


def breaches(what, episodes, out):
    """By requirement: how often it was breached, in how many episodes, and a scenario."""
    command = [AVASTRA, "run", "scenarios/avastra45_law.ava", "--ads", f"python3 tests/interop/law/driver.py {what}"]
    command += ["--agent", "random-raw", "--repeat", "0", "--episodes", str(episodes), "--seed", SEED, "--ambient", "12", "--out", str(out), "--format", "json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode not in (0, 4) or not lines:
        sys.exit(done.stderr or done.stdout)
    found = next(line for line in lines if "requirements" in line)
    return found, {of["requirement"]: (of["breaches"], of["breached_in"], of["scenario"]) for of in found["requirements"]}


failed = False
with tempfile.TemporaryDirectory() as folder:
    for what, wanted in WANTED.items():
        episodes = 100 if wanted is None else 20
        result, found = breaches(what, episodes, Path(folder) / what)
        told = ", ".join(f"{name} {count} in {episodes}" for name, (count, episodes, _) in found.items() if count)
        is_right = not told if wanted is None else found[wanted][0] > 0
        failed |= not is_right
        print(f"{what}: {'right' if is_right else 'WRONG'}; {result['totals']['episodes']} episodes, breaches: {told or 'none'}")
sys.exit(int(failed))
