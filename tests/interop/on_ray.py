"""A study on a Ray of this machine, with two processors: as fast as the program alone, and the same bytes after workers, programs,
the driver and the head were killed.

    python tests/interop/on_ray.py AVASTRA [FOLDER]

in an environment with Ray, from the repository's root. Needs Linux, whose /proc says which process is which. It is not named
`ray.py`, because the other scripts of this folder would import it for Ray.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AVASTRA = str(Path(sys.argv[1]).resolve())
FOLDER = Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "target/interop/ray").resolve()
SHARDS = 8
STUDY = f"""question: Does Ray make the study?
space: {ROOT}/scenarios/avastra45.ava
roads: [corner, boulevard]
first_seed: 5
ads_config: {ROOT}/scenarios/ads/faults/perception_flicker.yaml
agents:
  - {{ name: random, repeats: 12 }}
  - name: ddqn
    label: tiny
    trainings: 6
    episodes: 60
    train_roads: [corner, crossroad]
    config: {{ hidden_units: [8], batch_len: 8, learning_starts: 20, updates_per_step: 1, observation_period_s: 4 }}
  - {{ name: bandit, trainings: 4, episodes: 40 }}
baselines: [random]
evaluation: {{ episodes: 5, seeds: 2, horizon_s: 60 }}
"""


def timed(*command):
    """Seconds of the wall that a command took."""
    begun = time.monotonic()
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 0, f"{command}: {ended.stderr}"
    return time.monotonic() - begun


def by_ray(out, *more):
    return [sys.executable, "-m", "avastra.ray", "study", str(FOLDER / "study.yaml"), "--out", str(out), "--shards", str(SHARDS),
            "--workers", "2", "--program", AVASTRA, *more]


def files(directory):
    """All but the times that machines took."""
    kept = (path for path in directory.rglob("*") if path.is_file() and path.name != "timing.jsonl")
    return {str(path.relative_to(directory)): path.read_bytes() for path in kept}


def equal(directory):
    whole, other = files(FOLDER / "whole"), files(directory)
    assert whole.keys() == other.keys(), (whole.keys(), other.keys())
    differ = [name for name in whole if whole[name] != other[name]]
    assert not differ, f"these differ: {differ}"
    return f"{len(whole)} files, {sum(map(len, whole.values()))} bytes, all equal"


def processes():
    """Number, parent and command line of each process of this machine."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                yield int(entry.name), parent, (entry / "cmdline").read_text().split("\0")
            except (FileNotFoundError, ProcessLookupError):
                pass


def programs(out):
    """The programs that play shards, each with the Ray worker that began it."""
    return [(process, parent) for process, parent, line in processes() if line[0] == AVASTRA and f"{out}.shards" in " ".join(line)]


def waited(what, limit_s=300):
    """What a function returns, as soon as that is something."""
    begun = time.monotonic()
    while time.monotonic() - begun < limit_s:
        found = what()
        if found:
            return found
        time.sleep(0.05)
    sys.exit(f"nothing came within {limit_s} s of {what}")


def kept(out):
    """Bytes of the databases of shards: they grow as long as something is played."""
    return sum(file.stat().st_size for file in Path(f"{out}.shards").glob("*/study.db"))


def begin(out):
    return subprocess.Popen(by_ray(out), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def killed(process):
    """Ends a process as the kernel does when memory is short."""
    os.kill(process, signal.SIGKILL)


FOLDER.mkdir(parents=True, exist_ok=False)
(FOLDER / "study.yaml").write_text(STUDY)
for jobs, name in ((1, "one"), (2, "whole")):
    took_s = timed(AVASTRA, "study", str(FOLDER / "study.yaml"), "--jobs", str(jobs), "--out", str(FOLDER / name), "--quiet")
    print(f"unsharded, {jobs} threads: {took_s:.1f} s", flush=True)
took_s = timed(*by_ray(FOLDER / "calm"))
print(f"{SHARDS} shards, two workers: {took_s:.1f} s with Ray's begin and the merge; {equal(FOLDER / 'calm')}", flush=True)

# A worker with its shard in the middle, a program alone, the driver.
out = FOLDER / "struck"
driver = begin(out)
process, worker = waited(lambda: kept(out) and programs(out))[0]
killed(worker)
begun = time.monotonic()
waited(lambda: process not in [other for other, _ in programs(out)])
print(f"a worker killed: its program ended {time.monotonic() - begun:.2f} s later", flush=True)
grown = kept(out)
process, _ = waited(lambda: kept(out) > grown and programs(out))[0]
killed(process)
print("a program killed", flush=True)
grown = kept(out)
waited(lambda: kept(out) > grown and programs(out))
killed(driver.pid)
driver.wait()
begun = time.monotonic()
waited(lambda: not programs(out))
print(f"the driver killed: no program was left {time.monotonic() - begun:.1f} s later", flush=True)

# The head of the cluster: here its driver's child.
driver = begin(out)
grown = kept(out)
waited(lambda: kept(out) > grown and programs(out))
head = [process for process, parent, line in processes() if parent == driver.pid and "gcs_server" in line[0]]
assert len(head) == 1, f"{len(head)} heads"
killed(head[0])
begun = time.monotonic()
status = driver.wait(timeout=600)
waited(lambda: not programs(out))
said = (driver.stderr.read().strip().splitlines() or [""])[-1]
print(f"the head killed: the driver ended with status {status} after {time.monotonic() - begun:.0f} s ({said[:120]})", flush=True)
# Ray does without its head for a minute: on a fast machine the rest takes less.
if status == 0:
    print(f"to the end all the same: {equal(out)}", flush=True)
else:
    took_s = timed(*by_ray(out))
    print(f"gone on with to the end in {took_s:.1f} s: {equal(out)}", flush=True)
refused = subprocess.run(by_ray(out, "--quick"), cwd=ROOT, capture_output=True, text=True)
assert refused.returncode == 1 and "say the same command" in refused.stderr, refused.stderr
assert json.loads(Path(f"{out}.shards/command.json").read_text())["shards"] == SHARDS
print(f"refused: {refused.stderr.strip()}")
