"""Adds a callgrind file up by the parts of avastra: profile.py FILE PER COUNTED TITLE.

PER is the function whose calls are counted, COUNTED the word for one of them ("tick"). What the compiler inlined
counts where its source stands; what is no source of avastra (std, libm, SQLite) counts where it was called from.
"""

import re
import sys
from collections import defaultdict

# The first prefix that fits decides. Sources that stand under no prefix belong to what calls them.
PARTS = [
    ("world/view/sense.rs", "sensing and sight lines"),
    ("base/geometry/path.rs", "projections"),
    ("base/geometry/beside.rs", "projections"),
    ("drivers/kit/guide.rs", "projections"),
    ("world/scene/way.rs", "projections"),
    ("base/geometry/contact.rs", "contacts and gaps"),
    ("world/step/contact.rs", "contacts and gaps"),
    ("world/step/incident.rs", "contacts and gaps"),
    ("world/state/trace.rs", "trace"),
    ("world/place/", "offers: places"),
    ("world/view/safety.rs", "offers: places"),
    ("world/view/moment.rs", "offers: places"),
    ("world/action/", "offers: drawing and judging"),
    ("lang/model/", "offers: drawing and judging"),
    ("base/units/", "offers: drawing and judging"),
    ("world/behave/right_of_way", "right of way"),
    ("world/behave/", "behaviour of others"),
    ("world/state/driver.rs", "behaviour of others"),
    ("world/state/change.rs", "behaviour of others"),
    ("world/scene/junction.rs", "behaviour of others"),
    ("world/", "world, the rest"),
    ("drivers/modular/perception/", "perception"),
    ("drivers/modular/tracking/", "tracking"),
    ("drivers/modular/prediction/", "prediction"),
    ("drivers/modular/planning/", "planning"),
    ("drivers/modular/control.rs", "control"),
    ("drivers/modular/emergency.rs", "emergency braking"),
    ("drivers/", "driving system, the rest"),
    ("search/mdp/", "criticality"),
    ("campaign/oracle/", "verdicts, the rest"),
    ("campaign/run/database.rs", "database"),
    ("campaign/run/sealed.rs", "database"),
    ("campaign/run/", "run, the rest"),
    ("campaign/episode/", "episode"),
    ("search/agent/", "agent"),
    ("road/", "reading the space and its roads"),
    ("lang/syntax/", "reading the space and its roads"),
    ("lang/check/", "reading the space and its roads"),
    ("lang/prove/", "reading the space and its roads"),
]
ELSEWHERE = "elsewhere"


def part_of(file):
    """The part of a source file; None if its callers decide."""
    found = re.search(r"(?:^|/)src/(.*\.rs)$", file)
    if not found or "/rustc/" in file or "/registry/" in file or "/library/" in file:
        return None
    return next((part for prefix, part in PARTS if found.group(1).startswith(prefix)), None)


def read(path):
    """Costs by (function, part), costs of calls by callee and (function, part) of the caller, numbers of calls."""
    names = {"f": {}, "n": {}}
    own, edges, calls = defaultdict(int), defaultdict(lambda: defaultdict(int)), defaultdict(int)
    home, here, function, callee, is_call = None, None, None, None, False

    def name(kind, text):
        found = re.match(r"\((\d+)\)(?: (.*))?", text)
        if found.group(2) is not None:
            names[kind][found.group(1)] = found.group(2)
        return names[kind][found.group(1)]

    for line in open(path, errors="replace"):
        key, _, value = line.rstrip("\n").partition("=")
        if key == "fl":
            home = here = part_of(name("f", value))
        elif key in ("fi", "fe"):
            here = part_of(name("f", value)) or home
        elif key == "fn":
            function, here = name("n", value), home
        elif key in ("cfi", "cfl"):
            name("f", value)
        elif key == "cfn":
            callee = name("n", value)
        elif key == "calls":
            calls[callee] += int(value.split()[0])
            is_call = True
        elif line[:1] in "0123456789+-*":
            cost = int((line.split() + ["0"])[1])
            if is_call:
                edges[callee][function, here] += cost
                is_call = False
            else:
                own[function, here] += cost
    return own, edges, calls


def by_part(own, edges):
    """Instructions by part."""
    parts, foreign = defaultdict(float), defaultdict(float)
    for (function, part), cost in own.items():
        if part:
            parts[part] += cost
        else:
            foreign[function] += cost
    # From callee to caller, in shares of what the calls cost, until everything has arrived.
    for _ in range(60):
        moved = defaultdict(float)
        for function, cost in foreign.items():
            callers = {caller: calls for caller, calls in edges[function].items() if caller[0] != function}
            whole = sum(callers.values())
            if not whole:
                parts[ELSEWHERE] += cost
            for (caller, part), calls in callers.items():
                if part:
                    parts[part] += cost * calls / whole
                elif whole:
                    moved[caller] += cost * calls / whole
        foreign = moved
    parts[ELSEWHERE] += sum(foreign.values())
    return parts


def main():
    path, per, counted, title = sys.argv[1:]
    own, edges, calls = read(path)
    number = sum(count for function, count in calls.items() if re.search(per, function))
    if not number:
        sys.exit(f"profile.py: {path} has no calls of {per}")
    parts, whole = by_part(own, edges), sum(own.values())
    print(f"{title}: {number:,} {counted}s, {whole / number:,.0f} instructions a {counted}")
    for part, cost in sorted(parts.items(), key=lambda item: -item[1]):
        if cost >= 0.0005 * whole:
            print(f"  {cost / number:12,.0f}  {100 * cost / whole:5.1f} %  {part}")


main()
