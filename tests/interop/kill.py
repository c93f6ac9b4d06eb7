"""Ends runs, trainings and studies at each system call by which they change files, and goes on with them.

However a command ends, what is gone on with must end in the same bytes as the uninterrupted one, or be refused with
a message that says the way out, which is then taken. `kill.c` strikes; see there for the modes.
"""

import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

AVASTRA, SHIM, STRIDE = sys.argv[1], sys.argv[2], int(sys.argv[3])
FAULT = "scenarios/ads/faults/perception_flicker.yaml"
# Two agents, so that cells are written in two jobs.
STUDY = """space: {space}
roads: [corner]
evaluation: {{ episodes: 1, seeds: 1 }}
agents:
  - {{ name: random, repeats: 2 }}
  - {{ name: random, label: again, repeats: 1 }}
"""
SMALL = "learning_starts: 4\nupdates_per_step: 1\nhidden_units: [8]\nbatch_len: 4\nrules_leaves: 0\n"
AGAIN = "begin one in a new directory with `--out"


def call(arguments, **fault):
    env = {**os.environ, **{key: str(value) for key, value in fault.items()}}
    if fault:
        env["LD_PRELOAD"] = SHIM
    ended = subprocess.run([AVASTRA, *arguments, "--quiet"], env=env, capture_output=True, text=True, timeout=300)
    return ended.returncode, ended.stderr


def kept(out):
    """What a directory holds, file by file."""
    found = {}
    for path in sorted(out.rglob("*")):
        # Two plays of a study need not take the same time.
        if path.is_file() and not path.name.endswith((".partial", "-journal", "timing.jsonl")):
            found[str(path.relative_to(out))] = path.read_bytes()
    return found


def gone_on(command, begin, out, **fault):
    """Goes on with a directory; if it was never begun, begins it."""
    status, told = call([command, "--resume", str(out)], **fault)
    if status == 1 and (AGAIN in told or not out.exists()):
        status, told = call(begin(out), **fault)
    return status, told


def strike(folder, name, command, begin, modes):
    whole = folder / f"{name}-whole"
    count = folder / "count"
    status, told = call(begin(whole), FAULT_COUNT=count)
    assert status == 0, told
    wanted, calls = kept(whole), int(count.read_text())
    rng = random.Random(2026)
    for mode in modes:
        equal = begun_again = 0
        wrong = []
        moments = range(1, calls + 1, STRIDE)
        for moment in moments:
            out = folder / "out"
            shutil.rmtree(out, ignore_errors=True)
            status, told = call(begin(out), FAULT_AT=moment, FAULT_MODE=mode)
            if mode == "full" and status != 1:
                wrong.append(f"{moment}: status {status} on a full disk: {told}")
            begun_again += not any((out / begun).exists() for begun in ("run.yaml", "study.yaml"))
            # Every third time the second attempt is struck as well.
            if moment % 3 == 0:
                gone_on(command, begin, out, FAULT_AT=rng.randrange(1, calls + 1), FAULT_MODE=mode)
            status, told = gone_on(command, begin, out)
            if status == 0 and kept(out) == wanted:
                equal += 1
            else:
                differ = [path for path in wanted if kept(out).get(path) != wanted[path]] if out.exists() else []
                wrong.append(f"{moment}: status {status}, differ: {differ}: {told}")
        print(f"{name}, {mode}: {len(moments)} of {calls} calls struck, {equal} end equal, "
              f"{begun_again} of them begun again", flush=True)
        if wrong:
            print("\n".join(wrong))
            sys.exit(1)


with tempfile.TemporaryDirectory() as scratch:
    folder = Path(scratch)
    settings = folder / "small.yaml"
    settings.write_text(SMALL)
    space = "scenarios/avastra45.ava"
    common = ["--road", "corner", "--seed", "5", "--ads", FAULT]
    run = ["run", space, *common, "--episodes", "6", "--jobs", "1"]
    train = ["train", space, *common, "--episodes", "6", "--config", str(settings)]
    every = ["kill", "torn", "full"]
    strike(folder, "run", "run", lambda out: [*run, "--out", str(out)], every)
    strike(folder, "self-contained run", "run", lambda out: [*run, "--self-contained", "--out", str(out)], ["kill"])
    strike(folder, "training", "train", lambda out: [*train, "--out", str(out)], every)
    study = folder / "study.yaml"
    study.write_text(STUDY.format(space=Path(space).resolve()))
    strike(folder, "study", "study", lambda out: ["study", str(study), "--jobs", "1", "--out", str(out)], every)
