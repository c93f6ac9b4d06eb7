#!/usr/bin/env python3
"""Plays the same episodes with two builds of avastra: which of them move otherwise, and which verdicts differ.

    python3 tests/interop/builds.py OLD OLD_CHECKOUT NEW

OLD and NEW are programs; OLD_CHECKOUT is a checkout of the old version, because its program reads its own spaces. Prints a line
for each space, one for each collision with another verdict, and the breaches of `law.ava` by healthy drivers of the new build.
"""
import os
import sqlite3
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SPACES = [
    "avastra45.ava --episodes 60 --seed 11",
    "manoeuvres.ava --episodes 40 --seed 11",
    "r157.ava --episodes 40 --seed 11",
    "avastra45.ava --episodes 40 --seed 3 --ambient 6",
    "avastra45.ava --episodes 40 --seed 3 --ads idm",
]
DRIVERS = ["modular", "modular --ambient 8", "idm", "idm --ambient 8", "frenet --ambient 8", "reactive"]
VERDICT = ["priority", "avoidability", "struck", "sudden", "precrash_number", "harm", "counted"]


def play(avastra, checkout, arguments, folder):
    """Plays a space; returns its database."""
    space, *rest = arguments.split()
    out = os.path.join(folder, "run")
    command = [avastra, "run", f"scenarios/{space}", "--agent", "random", "--repeat", "0", "--quiet", "--out", out, *rest]
    subprocess.run(command, cwd=checkout, check=True, capture_output=True)
    return sqlite3.connect(f"{out}/run.db")


def compared(old, new):
    """How many episodes there are, how many move otherwise, and the collisions with another verdict."""
    episodes = "SELECT episode, ended, duration_s, distance_m, steps, collisions FROM episode ORDER BY episode"
    before, after = (database.execute(episodes).fetchall() for database in (old, new))
    moved = sum(one != other for one, other in zip(before, after, strict=True))
    contacts = f"SELECT episode, number, time_s, {', '.join(VERDICT)} FROM collision"
    known = {row[:3]: row[3:] for row in old.execute(contacts)}
    now = {row[:3]: row[3:] for row in new.execute(contacts)}
    verdicts = []
    for key in sorted(known.keys() | now.keys()):
        if key not in known or key not in now:
            verdicts.append(f"episode {key[0]}: a contact of one build alone")
            continue
        changes = [f"{name} {a} -> {b}" for name, a, b in zip(VERDICT, known[key], now[key]) if a != b]
        verdicts += [f"episode {key[0]}: {', '.join(changes)}"] if changes else []
    return len(after), moved, len(now), verdicts


def main():
    old, checkout, new = (os.path.abspath(argument) for argument in sys.argv[1:4])
    for arguments in SPACES:
        with tempfile.TemporaryDirectory() as before, tempfile.TemporaryDirectory() as after:
            found = compared(play(old, checkout, arguments, before), play(new, ROOT, arguments, after))
        episodes, moved, contacts, verdicts = found
        print(f"{arguments}: of {episodes} episodes {moved} move otherwise; {contacts} collisions, {len(verdicts)} with another verdict")
        print("".join(f"    {line}\n" for line in verdicts), end="")
    for driver in DRIVERS:
        with tempfile.TemporaryDirectory() as folder:
            law = play(new, ROOT, f"avastra45_law.ava --episodes 40 --seed 5 --ads {driver}", folder)
            (episodes,) = law.execute("SELECT count(*) FROM episode").fetchone()
            breaches = law.execute("SELECT requirement, count(*) FROM breach GROUP BY 1").fetchall()
        print(f"law, {driver}: {episodes} episodes, breaches {dict(breaches) or 'none'}")


main()
