"""Contacts by CommonRoad's collision checker at every tick, against those in avastra's tables.

Called by confirm.sh with the program, a folder of emitted scenarios, a folder to work in and a number of episodes.
avastra finds the first moment of a contact, also between two ticks; the checker is asked at the ends of ticks, and again,
where it sees nothing at the tick of a contact, at moments within it and with outlines a millimetre larger: two that graze
have parted at its end. Such contacts are counted apart.
"""

import itertools
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path

from commonroad_dc import pycrcc

# Scenarios that are exported at once: a table has some megabytes.
BATCH = 20
# Outlines whose middles are farther apart than this cannot touch, m: half the diagonals of two buses.
FAR_M = 12.0
# What a grazing contact's outlines are larger by, m, and the moments within its tick that are looked at.
GRAZE_M = 0.001
MOMENTS = 50
# A contact may be seen so many ticks later.
LATE_TICKS = 1


def main():
    avastra, found, work, wanted = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    files = sorted(file for file in found.glob("*.ava") if not file.stem.startswith("confirm_"))
    if not files:
        sys.exit(f"no scenario in {found}")
    same, crashes, contacts, grazes, wrong = 0, 0, 0, 0, []
    todo = episodes(files)
    while (left := wanted - same - len(wrong)) > 0:
        batch = list(itertools.islice(todo, min(BATCH, left)))
        paths = []
        for name, text in batch:
            # Beside its origin, because it names its space relative to itself.
            path = found / f"{name}.ava"
            path.write_text(text)
            paths.append(path)
        try:
            done = subprocess.run([avastra, "export", "--to", "csv", "--out", work, "--quiet", *paths], check=False,
                                  capture_output=True, text=True)
        finally:
            for path in paths:
                path.unlink()
        # With other seeds an action may be refused, because something else is in its place: that is no export.
        if done.returncode not in (0, 3):
            sys.exit(done.stderr)
        for path in paths:
            table = work / f"{path.stem}.csv"
            if not table.exists():
                continue
            ours, theirs, grazed = met(table)
            table.unlink()
            for user in grazed:
                if theirs.get(user) not in range(ours[user], ours[user] + LATE_TICKS + 1):
                    theirs[user] = ours[user]
                    grazes += 1
            contacts += len(ours)
            crashes += bool(ours)
            reason = differ(ours, theirs)
            if reason:
                wrong.append(f"{path.stem}: {reason}")
            else:
                same += 1
    print(f"{same} of {same + len(wrong)} episodes have the same contacts at every tick: "
          f"{crashes} with a crash, {same + len(wrong) - crashes} without; {contacts} contacts, {grazes} of them grazes within a tick")
    for line in wrong:
        print(f"  {line}")
    sys.exit(1 if wrong else 0)


def episodes(files):
    """Names and texts without end: each crash as it was found, then with other seeds, in turn by the same driver and by the
    one that it was not found with."""
    for number in itertools.count():
        for file in files:
            text = file.read_text()
            name = f"confirm_{file.stem}_{number}"
            if number:
                # Other seeds are another episode: it claims nothing.
                text = re.sub(r"(?m)^  expect .*\n(?:    .*\n)*(?:  [\])].*\n)?", "", text)
                text = re.sub(r"(?m)^(\s+seed: )\d+", rf"\g<1>{number}", text)
                text = re.sub(r"traffic_seed: \d+", f"traffic_seed: {number}", text)
                if number % 2 == 0:
                    text = re.sub(r"(?m)^\s+profile(?:_digest)?: .*\n", "", text)
            yield name, text


def met(table):
    """The ticks of first contact by road user, as the table has them and as the checker does; and those that it sees within
    the tick of the table's contact."""
    ours, theirs, grazed = {}, {}, set()
    before, now, tick = {}, {}, None

    def look():
        for user, row in now.items():
            if user == "0" or math.hypot(row[3] - now["0"][3], row[4] - now["0"][4]) > FAR_M:
                continue
            if user not in theirs and box(now["0"]).collide(box(row)):
                theirs[user] = tick
            if row[11] == 1:
                ours.setdefault(user, tick)
                if user in before and grazes(before["0"], now["0"], before[user], row):
                    grazed.add(user)

    with open(table) as file:
        next(file)
        for line in file:
            cells = line.split(",")
            row = [0.0 if column == 2 else float(cell) for column, cell in enumerate(cells)]
            if cells[1] == "0":
                if now:
                    look()
                before, now, tick = now, {}, round(row[0] * 50)
            now[cells[1]] = row
    look()
    return ours, theirs, grazed


def grazes(ego_before, ego, other_before, other):
    return any(box(between(ego_before, ego, moment / MOMENTS), GRAZE_M)
               .collide(box(between(other_before, other, moment / MOMENTS))) for moment in range(MOMENTS + 1))


def between(before, now, part):
    row = list(now)
    for column in (3, 4):
        row[column] = before[column] + (now[column] - before[column]) * part
    turned = (now[5] - before[5] + math.pi) % (2 * math.pi) - math.pi
    row[5] = before[5] + turned * part
    return row


def box(row, more=0.0):
    x, y, heading, length, width = (row[column] for column in (3, 4, 5, 8, 9))
    return pycrcc.RectOBB(length / 2 + more, width / 2 + more, heading, x, y)


def differ(ours, theirs):
    reasons = []
    for user in sorted(ours.keys() | theirs.keys(), key=int):
        here, there = ours.get(user), theirs.get(user)
        if here is None:
            reasons.append(f"npc_{user} touched at tick {there} for the checker alone")
        elif there is None:
            reasons.append(f"npc_{user} touched at tick {here} for avastra alone")
        elif not 0 <= there - here <= LATE_TICKS:
            reasons.append(f"npc_{user} touched at tick {here}, for the checker at {there}")
    return "; ".join(reasons)


if __name__ == "__main__":
    main()
