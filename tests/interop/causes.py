"""Which module does `diagnose` name, and is it the one that was planted? A confusion matrix over every counted crash that is
looked at, not only over those that vanish when the planted module is mended.

    python3 tests/interop/causes.py AVASTRA [FOLDER] [SEED]

- `degraded.yaml`: 400 episodes on each of the four roads. Right is a module that differs from the default.
- Each fault of `scenarios/ads/faults/`, and each pair of faults of two modules, among decoys: small changes in all other
  modules, so that the cause is not simply what differs from the default. Right is a planted module.
- Several modules that the replays do not tell apart are neither right nor wrong if a planted one is among them (`tied`).

The shipped space is played, and those of `tests/cases/faults`, in which crashes count whether they can be avoided or not. SINGLE
crashes of each fault are diagnosed, and PAIRED of each pair. Takes some 20 minutes of processor time; ends with status 1 if a mark
is missed.
"""

import itertools
import json
import math
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AVASTRA = str(Path(sys.argv[1]).resolve())
FOLDER = Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "target/interop/causes").resolve()
SEED = sys.argv[3] if len(sys.argv) > 3 else "1"

MODULES = ["localization", "perception", "tracking", "prediction", "planning", "latency", "control", "emergency"]
SHIPPED = "scenarios/avastra45.ava"
OWN = [f"tests/cases/faults/{name}.ava" for name in ("leader", "oncoming", "step_out")]
# Crashes that are diagnosed, and episodes on each road: of the shipped space, and of the others.
SINGLE, SINGLE_EPISODES = 6, (10, 20)
PAIRED, PAIRED_EPISODES = 1, (2, 4)
# The marks: the share that is right where a module is named, and how many modules are blamed that are as in the default.
RIGHT_MIN, AS_DEFAULT_MAX = 0.85, 0


def settings(path):
    """The settings in a fault's file: nested keys by indentation, each with a value or with keys of its own."""
    found, open_keys = {}, []
    for line in path.read_text().splitlines():
        if not line.strip() or line.strip().startswith("#"):
            continue
        depth = (len(line) - len(line.lstrip())) // 2
        key, value = line.strip().split(":", 1)
        place = found
        for parent in open_keys[:depth]:
            place = place[parent]
        open_keys[depth:] = [key]
        place[key] = json.loads(value) if value.strip() else {}
    return found


def decoys():
    """The decoys of tests/it/faults.rs, by module. Latency is a module of its own, whose setting stands under perception."""
    found = {module: {module: own} for module, own in settings(ROOT / "tests/cases/faults/decoys.yaml").items()}
    late = found["perception"]["perception"].pop("latency_frames")
    return {**found, "latency": {"perception": {"latency_frames": late}}}


def merge(into, other):
    for key, value in other.items():
        if isinstance(value, dict):
            merge(into.setdefault(key, {}), value)
        else:
            into[key] = value
    return into


def module_of(fault):
    return next(module for module in MODULES if fault.startswith(module))


def profile(name, faults):
    """Writes a profile with these faults, and decoys in all other modules."""
    planted = {module_of(fault) for fault in faults}
    merged = {}
    for module, decoy in decoys().items():
        if module not in planted:
            merge(merged, decoy)
    for fault in faults:
        merge(merged, FAULTS[fault])
    path = FOLDER / f"{name}.yaml"
    path.write_text(json.dumps(merged) + "\n")
    return path


def avastra(*arguments):
    ended = subprocess.run([AVASTRA, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
    return ended.returncode, ended.stdout, ended.stderr


def crashes(config, name, space, episodes):
    """Plays a space, and gives the files of its counted crashes."""
    out = FOLDER / name / Path(space).stem
    plan = ["--episodes", episodes, "--seed", SEED, "--ads", config, "--quiet", "--out", out]
    status, _, told = avastra("run", space, *plan)
    assert status == 0, told
    return sorted((out / "critical").glob("*.ava"))


def diagnoses(files):
    if not files:
        return []
    status, told, mistakes = avastra("diagnose", *files, "--format", "json", "--quiet")
    assert status == 0, mistakes
    return [found["diagnosis"] for found in json.loads(told.splitlines()[-1])["scenarios"]]


def as_default(diagnosis):
    """The modules that are named although they are as in the default."""
    same = {found["module"] for found in diagnosis["modules"] if found["restored"] is None}
    return [module for module in diagnosis["cause"] if module in same]


def is_tied(diagnosis):
    """Whether several modules are named because the replays do not tell them apart."""
    return len(diagnosis["cause"]) > 1 and diagnosis["verdict"] != "together"


def planted(faults, counts, looked_at):
    """Diagnoses the first crashes of a profile with these faults, one of each space in turn."""
    name = "+".join(faults)
    config = profile(name, faults)
    spaces = [(SHIPPED, counts[0]), *((space, counts[1]) for space in OWN)]
    found = [crashes(config, name, space, episodes) for space, episodes in spaces]
    turns = [file for turn in itertools.zip_longest(*found) for file in turn if file is not None]
    return diagnoses(turns[:looked_at])


def share_text(right, named):
    if named == 0:
        return "none named"
    share, z = right / named, 1.96
    middle = share + z * z / (2 * named)
    reach = z * math.sqrt(share * (1 - share) / named + z * z / (4 * named * named))
    low, high = ((middle + sign * reach) / (1 + z * z / named) for sign in (-1, 1))
    return f"{right} of {named} right where a module is named: {share:.1%} ({low:.0%} to {high:.0%})"


def verdicts_text(found):
    counts = Counter(diagnosis["verdict"] for diagnosis in found)
    return ", ".join(f"{verdict} {count}" for verdict, count in counts.most_common())


FAULTS = {path.stem: settings(path) for path in sorted((ROOT / "scenarios/ads/faults").glob("*.yaml"))}
FOLDER.mkdir(parents=True, exist_ok=False)
right, named, blamed = 0, 0, []

print("degraded.yaml, 1,600 episodes", flush=True)
found = diagnoses(crashes(ROOT / "scenarios/ads/degraded.yaml", "degraded", SHIPPED, 400))
causes = Counter(" and ".join(diagnosis["cause"]) or "none" for diagnosis in found)
for cause, count in causes.most_common():
    print(f"{count:6}  {cause}")
blamed += [f"degraded.yaml: {module}" for diagnosis in found for module in as_default(diagnosis)]
own = [diagnosis for diagnosis in found if diagnosis["cause"]]
own_right = sum(not as_default(diagnosis) for diagnosis in own)
right, named = right + own_right, named + len(own)
print(f"{len(found)} crashes; {verdicts_text(found)}\n{share_text(own_right, len(own))}\n", flush=True)

print("one fault among decoys: planted (rows) and named (columns)", flush=True)
matrix, wrong, singles = Counter(), [], []
for fault in FAULTS:
    found = planted([fault], SINGLE_EPISODES, SINGLE)
    for diagnosis in found:
        cause = " and ".join(diagnosis["cause"])
        module = module_of(fault)
        if is_tied(diagnosis):
            matrix[module, "tied"] += 1
            missed = module not in diagnosis["cause"]
        else:
            matrix[module, cause if cause in MODULES else "pair" if cause else "none"] += 1
            missed = bool(cause) and diagnosis["cause"] != [module]
        if missed:
            wrong.append(f"{fault}: {cause} ({diagnosis['verdict']})")
        blamed += [f"{fault}: {module}" for module in as_default(diagnosis)]
    singles += found
columns = [*MODULES, "pair", "tied", "none"]
print(f"{'':14}" + "".join(f"{column[:9]:>10}" for column in columns))
for row in MODULES:
    print(f"{row:14}" + "".join(f"{matrix[row, column] or '.':>10}" for column in columns))
own_right = sum(matrix[module, module] for module in MODULES)
own_named = own_right + len(wrong)
right, named = right + own_right, named + own_named
print(f"{len(singles)} crashes; {verdicts_text(singles)}\n{share_text(own_right, own_named)}")
print("".join(f"  wrong: {line}\n" for line in wrong), flush=True)

print("two faults among decoys: planted modules (rows), and what of them is named (columns)", flush=True)
matrix, wrong, pairs = Counter(), [], []
for first, second in itertools.combinations(FAULTS, 2):
    both = [module_of(first), module_of(second)]
    if both[0] == both[1]:
        continue
    found = planted([first, second], PAIRED_EPISODES, PAIRED)
    for diagnosis in found:
        cause = diagnosis["cause"]
        if not cause:
            kind = "none"
        elif is_tied(diagnosis) and set(cause) & set(both):
            kind = "tied"
        elif not set(cause) <= set(both):
            kind = "another"
            wrong.append(f"{first}+{second}: {' and '.join(cause)} ({diagnosis['verdict']})")
        else:
            kind = "both" if len(cause) == 2 else "one"
        # Data flows in the order of the modules.
        matrix[tuple(sorted(both, key=MODULES.index)), kind] += 1
        blamed += [f"{first}+{second}: {module}" for module in as_default(diagnosis)]
    pairs += found
columns = ["one", "both", "tied", "another", "none"]
print(f"{'':28}" + "".join(f"{column:>10}" for column in columns))
for row in itertools.combinations(MODULES, 2):
    print(f"{' and '.join(row):28}" + "".join(f"{matrix[row, column] or '.':>10}" for column in columns))
own_right = sum(matrix[modules, kind] for modules, kind in matrix if kind in ("one", "both"))
own_named = own_right + len(wrong)
right, named = right + own_right, named + own_named
print(f"{len(pairs)} crashes; {verdicts_text(pairs)}\n{share_text(own_right, own_named)}")
print("".join(f"  wrong: {line}\n" for line in wrong), flush=True)

print(f"all: {share_text(right, named)} (mark: {RIGHT_MIN:.0%})")
print(f"blamed modules that are as in the default: {len(blamed)} (mark: {AS_DEFAULT_MAX})")
print("".join(f"  {line}\n" for line in blamed), end="")
sys.exit(1 if named == 0 or right < RIGHT_MIN * named or len(blamed) > AS_DEFAULT_MAX else 0)
