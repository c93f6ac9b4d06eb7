"""A study in 64 shards, played in random order, three of them killed and gone on with: merged, it must have the bytes of the study
that was never cut.

    python3 tests/interop/shards.py AVASTRA [FOLDER] [SEED]
"""

import random
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AVASTRA = str(Path(sys.argv[1]).resolve())
FOLDER = Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "target/interop/shards").resolve()
RNG = random.Random(int(sys.argv[3]) if len(sys.argv) > 3 else 2026)
SHARDS = 64
# As scenarios/studies/smoke.yaml, with as many jobs as shards and more: trainings on two roads, searches, repetitions.
STUDY = f"""question: Do shards make the study?
space: {ROOT}/scenarios/avastra45.ava
roads: [corner, boulevard]
first_seed: 5
ads_config: {ROOT}/scenarios/ads/faults/perception_flicker.yaml
agents:
  - {{ name: random, repeats: 30 }}
  - name: ddqn
    label: tiny
    trainings: 6
    episodes: 6
    train_roads: [corner, crossroad]
    config: {{ hidden_units: [8], batch_len: 8, learning_starts: 20, updates_per_step: 1, observation_period_s: 4 }}
  - {{ name: av-fuzzer, trainings: 3, episodes: 4 }}
baselines: [random]
evaluation: {{ episodes: 3, seeds: 2, horizon_s: 40 }}
"""


def command(*arguments):
    return [AVASTRA, *map(str, arguments), "--quiet"]


def avastra(*arguments):
    ended = subprocess.run(command(*arguments), capture_output=True, text=True)
    return ended.returncode, ended.stdout, ended.stderr


def files(directory):
    """All but the times that machines took."""
    kept = (path for path in directory.rglob("*") if path.is_file() and path.name != "timing.jsonl")
    return {str(path.relative_to(directory)): path.read_bytes() for path in kept}


FOLDER.mkdir(parents=True, exist_ok=False)
study = FOLDER / "study.yaml"
study.write_text(STUDY)
begun = time.monotonic()
status, _, told = avastra("study", study, "--jobs", 2, "--out", FOLDER / "whole")
assert status == 0, told
whole_s = time.monotonic() - begun

order = list(range(1, SHARDS + 1))
RNG.shuffle(order)
struck = set(RNG.sample(order, 3))
began = time.monotonic()
for number in order:
    out = FOLDER / "shards" / str(number)
    arguments = command("study", study, "--shard", f"{number}/{SHARDS}", "--jobs", 1, "--out", out)
    child = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if number in struck:
        while not (out / "study.db").exists():
            time.sleep(0.002)
        child.kill()
    status = child.wait()
    assert status == (-9 if number in struck else 0), f"shard {number} ended with {status}"
print(f"{SHARDS} shards in {time.monotonic() - began:.0f} s, unsharded on two threads {whole_s:.0f} s; "
      f"killed: {sorted(struck)}", flush=True)

directories = sorted((FOLDER / "shards").iterdir(), key=lambda _: RNG.random())
status, missing, told = avastra("merge", *directories, "--missing")
assert status == 0, told
assert {int(number) for number in missing.strip().split(",")} == struck, missing
status, _, told = avastra("merge", *directories, "--out", FOLDER / "merged")
assert status == 1 and " of 64 are missing" in told, told
for number in struck:
    status, _, told = avastra("study", "--resume", FOLDER / "shards" / str(number))
    assert status == 0, told
began = time.monotonic()
status, _, told = avastra("merge", *directories, "--out", FOLDER / "merged")
assert status == 0, told
merge_s = time.monotonic() - began
whole, merged = files(FOLDER / "whole"), files(FOLDER / "merged")
assert whole.keys() == merged.keys(), (whole.keys(), merged.keys())
differ = [name for name in whole if whole[name] != merged[name]]
assert not differ, f"these differ: {differ}"
print(f"merged in {merge_s:.1f} s: {len(whole)} files, {sum(map(len, whole.values()))} bytes, all equal")

# A shard of another version.
edited = directories[0] / "study.yaml"
text = edited.read_text()
edited.write_text(text.replace("engine: plane/", "engine: plane/0"))
status, _, told = avastra("merge", *directories, "--out", FOLDER / "other")
assert status == 1 and "was begun by avastra" in told, told
edited.write_text(text)
print(f"refused: {told.strip()}")
