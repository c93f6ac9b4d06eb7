#!/usr/bin/env python3
"""Plays the labelled situations (`tests/cases/situations`) and compares avastra's verdicts with their labels.

    python3 tests/interop/situations.py AVASTRA [NAME...]

Prints a line for each disagreement, and how many situations agree with each analyst. Exit status 1 if one could not be played.
"""
import csv
import glob
import os
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SITUATIONS = os.path.join(ROOT, "tests/cases/situations")
# Requirements that the law gained after the labels were written: no label can have named them.
NEWER = set(open(os.path.join(SITUATIONS, "newer.txt")).read().split())



def play(avastra, path, out):
    """Plays one situation; returns its contacts and the requirements that were breached."""
    ads = re.search(r"^// ADS: (.*)$", open(path).read(), re.M).group(1)
    command = [avastra, "run", path, "--agent", "every-row", "--ads", ads, "--jobs", "1", "--repeat", "0", "--out", out]
    environment = {**os.environ, "PYTHONPATH": os.path.join(ROOT, "python")}
    done = subprocess.run(command, capture_output=True, text=True, timeout=170, cwd=SITUATIONS, env=environment)
    try:
        database = sqlite3.connect(f"{out}/run.db")
        database.row_factory = sqlite3.Row
        contacts = [dict(row) for row in database.execute("SELECT * FROM collision ORDER BY episode, number")]
        breaches = {row[0] for row in database.execute("SELECT requirement FROM breach")}
        refused = [row["refused"] for row in csv.DictReader(open(f"{out}/protocol.csv")) if row["refused"]]
    except (sqlite3.Error, OSError) as error:
        raise RuntimeError(f"{error}: {done.stderr[-400:]}") from error
    if refused:
        raise RuntimeError(f"its row was refused: {refused}")
    return contacts, breaches


def verdict(contacts, breaches, nth):
    """What avastra says of a contact, under the labels' names."""
    said = {"hit": "yes" if len(contacts) >= nth else "no", "breach": breaches}
    if said["hit"] == "yes":
        contact = contacts[nth - 1]
        said |= {
            "avoid": "yes" if contact["avoidability"] == "avoidable" else "no",
            "prio": contact["priority"],
            "struck": "yes" if contact["struck"] else "no",
            "sudden": "yes" if contact["sudden"] else "no",
            "kind": str(contact["precrash_number"]),
            "harm": contact["harm"],
        }
    return said


def disagreements(label, said):
    """The fields of a label that avastra says otherwise."""
    told = {name: value for name, value in label.items() if value and name not in ("case", "n")}
    if told.get("hit") != "no" and said["hit"] == "no":
        if set(told) <= {"breach"}:
            told.pop("hit", None)
        else:
            return ["no contact"]
    found = []
    for name, value in told.items():
        if name == "breach":
            right = not said[name] - NEWER if value == "none" else set(value.split(";")) <= said[name]
        else:
            right = said.get(name) in value.split("|")
        if not right:
            shown = ",".join(sorted(said[name])) or "none" if name == "breach" else said.get(name)
            found.append(f"{name}: labelled {value}, found {shown}")
    return found


def main():
    avastra, names = os.path.abspath(sys.argv[1]), sys.argv[2:]
    broken = 0
    for folder in ("first", "second", "third"):
        tables = sorted(glob.glob(f"{SITUATIONS}/{folder}/labels*.csv"))
        labels = {os.path.basename(table): {row["case"]: row for row in csv.DictReader(open(table))} for table in tables}
        agree = {table: 0 for table in labels}
        played = either = 0
        for path in sorted(glob.glob(f"{SITUATIONS}/{folder}/*.ava")):
            case = os.path.basename(path)[:-4]
            if names and not any(name in case for name in names):
                continue
            work = tempfile.mkdtemp()
            try:
                contacts, breaches = play(avastra, path, f"{work}/out")
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                print(f"{folder}/{case}: not played: {error}")
                broken += 1
                continue
            finally:
                shutil.rmtree(work, ignore_errors=True)
            played += 1
            right = False
            for table, rows in labels.items():
                nth = int(rows[case]["n"] or 1)
                said = verdict(contacts, breaches, nth)
                wrong = disagreements(rows[case], said)
                agree[table] += not wrong
                right |= not wrong
                if wrong:
                    contact = contacts[nth - 1] if len(contacts) >= nth else {}
                    shown = ("time_s", "ego_speed_mps", "closing_speed_mps", "avoidability", "avoided_by", "hazard_onset_s", "priority", "priority_rule", "struck", "precrash", "side")
                    print(f"{folder}/{case} ({table}): {'; '.join(wrong)}")
                    print("    " + ", ".join(f"{name} {contact[name]}" for name in shown if name in contact))
            either += right
            sys.stdout.flush()
        counts = ", ".join(f"{count} with {table}" for table, count in agree.items())
        print(f"{folder}: of {played}, {counts}; {either} with one analyst at least")
    return 1 if broken else 0


sys.exit(main())
