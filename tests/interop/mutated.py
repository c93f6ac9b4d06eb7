"""Mutates emitted scenarios and policies and replays each: no crash, no hang, and no false claim confirmed.

Arguments: the avastra binary, a folder for what it makes, and how many scenarios and policies. A mutant is confirmed
(exit status 0) only if what it claims is true. All confirmed mutants whose claims differ from those of the original
are therefore printed, each with the claims that are new. A claim may also be changed into another true one, by
rounding or by leaving one out: which claims are those is judged below, and the rest make the exit status 1.
"""

import random
import re
import resource
import subprocess
import sys
from pathlib import Path

AVASTRA, FOLDER, SCENARIOS, POLICIES = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
ROOT = Path(__file__).resolve().parents[2]
SPACE = ROOT / "scenarios/avastra45.ava"
FAULT = ROOT / "scenarios/ads/faults/perception_flicker.yaml"
HANG_S = 1.0
NUMBERS = ["0", "1", "2", "-1", "3", "0.5", "1e9", "99999999999999999999", "0.0001", "NaN"]
WORDS = ["npc#1", "npc#2", "npc#3", "pedestrian#1", "dcb#2", "ego", "other", "none", "min", "km/h", "SUV", "Sedan", "Hatchback",
         "Walk", "Left", "Right", "High", "fsm", "rss", "r157", "ideal", "modular", "idm", "true", "==", ">=", "not", "{", "}", "[", "]"]
TOKEN = re.compile(r'"[^"\n]*"|[A-Za-z_][\w#]*|\d+(?:\.\d+)?|\S')


def run(*command):
    """Exit status, output and seconds of a processor; a machine that is busy otherwise makes no hang."""
    usage = lambda: resource.getrusage(resource.RUSAGE_CHILDREN)
    before = usage()
    try:
        done = subprocess.run([AVASTRA, *map(str, command)], capture_output=True, text=True, timeout=60, errors="replace")
    except subprocess.TimeoutExpired:
        return None, "", 60.0
    after = usage()
    took_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.returncode, done.stdout + done.stderr, took_s


def mutant(text, rng):
    for _ in range(rng.randint(1, 4)):
        tokens = list(TOKEN.finditer(text))
        token = rng.choice(tokens)
        begin, end = token.span()
        kind = rng.random()
        if kind < 0.35 and token.group()[0].isdigit():
            value = token.group()
            digit = rng.randrange(len(value))
            other = value[:digit] + rng.choice("0123456789") + value[digit + 1:] if value[digit].isdigit() else value
            text = text[:begin] + rng.choice([other, other, rng.choice(NUMBERS)]) + text[end:]
        elif kind < 0.6:
            text = text[:begin] + rng.choice(WORDS + [rng.choice(tokens).group()]) + text[end:]
        elif kind < 0.85:
            lines = text.split("\n")
            line, other = rng.randrange(len(lines)), rng.randrange(len(lines))
            change = rng.randrange(3)
            if change == 0:
                del lines[line]
            elif change == 1:
                lines.insert(other, lines[line])
            else:
                lines[line], lines[other] = lines[other], lines[line]
            text = "\n".join(lines)
        else:
            at = rng.randrange(len(text))
            text = text[:at] + chr(rng.choice([0, 9, 34, 92, 123, 200, 0x1F697, rng.randrange(32, 127)])) + text[at + 1:]
    return text


def claims(text):
    """The claims of a scenario, or of a policy, without layout and comments."""
    text = re.sub(r"//.*", "", text)
    return {" ".join(TOKEN.findall(line)) for line in text.split("\n") if re.match(r"\s*expect\b", line)}


def examine(kind, originals, count):
    rng = random.Random(2026)
    statuses, slow, bad, strange = {}, 0.0, 0, 0
    where = FOLDER / f"mutant_{kind}.ava"
    for number in range(count):
        original = rng.choice(originals)
        text = original.read_text()
        changed = mutant(text, rng)
        # Beside the original, because paths in it are relative.
        where = original.parent / f"mutant_{kind}.ava"
        where.write_text(changed)
        # What only replays is no hang: it takes as long as the original does.
        usual_s = EXPECTED.setdefault(original, run("replay", original)[2])
        status, said, took_s = run("replay", where)
        statuses[status] = statuses.get(status, 0) + 1
        slow = max(slow, took_s - usual_s)
        if status not in (0, 1, 2, 3) or took_s - usual_s > HANG_S:
            bad += 1
            (FOLDER / f"bad_{kind}_{number}.ava").write_text(changed)
            print(f"{kind} {number} of {original.name}: status {status}, {took_s:.2f} s: {said.strip()[-300:]}", flush=True)
        new = claims(changed) - claims(text)
        if status == 0 and new:
            strange += 1
            print(f"{kind} {number} of {original.name} is confirmed with other claims: {sorted(new)}", flush=True)
    shown = ", ".join(f"{n} with {status}" for status, n in sorted(statuses.items(), key=str))
    print(f"{count} mutated {kind}s: {shown}; at most {slow:.2f} s more than the original; {bad} crash or hang, "
          f"{strange} confirmed with other claims", flush=True)
    return bad


EXPECTED = {}
FOLDER.mkdir(parents=True, exist_ok=True)
if not (FOLDER / "run").exists():
    run("run", SPACE, "--episodes", "60", "--seed", "5", "--ads", FAULT, "--out", FOLDER / "run")
scenarios = sorted((FOLDER / "run/critical").glob("*.ava"))
if POLICIES and not (FOLDER / "trained").exists():
    small = FOLDER / "small.yaml"
    small.write_text("learning_starts: 4\nupdates_per_step: 1\nhidden_units: [8]\nbatch_len: 4\n")
    run("train", SPACE, "--road", "corner", "--episodes", "6", "--config", small, "--out", FOLDER / "trained")
policies = sorted((FOLDER / "trained/policy").glob("*.ava"))
failures = examine("scenario", scenarios, SCENARIOS) if SCENARIOS else 0
failures += examine("policy", policies, POLICIES) if POLICIES else 0
sys.exit(1 if failures else 0)
