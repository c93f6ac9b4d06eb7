"""Draws `town.xodr`: a roundabout, a crossing with stop signs, and an avenue with a bus lane. `python3 scenarios/roads/town.py`

Every arm begins at its junction and leads away from it. A way through a junction lies between the middle lines of two arms, with
its lane to the right. All traffic keeps to the right. Lengths are in m, angles in rad.
"""

import math
import pathlib

LANE_M = 3.5
FOOTWAY_M = 2.5
SIDES = "east", "north", "west", "south"


class Pen:
    """Where the middle line of a road has come to, and the pieces that it has drawn."""

    def __init__(self, x, y, heading):
        self.x, self.y, self.heading, self.length, self.pieces = x, y, heading, 0.0, []

    def draw(self, length, curvature=0.0):
        """A line, or an arc to the left (to the right, if the curvature in 1/m is below 0)."""
        shape = f'<arc curvature="{curvature:.12f}"/>' if curvature else "<line/>"
        place = f's="{self.length:.9f}" x="{self.x:.9f}" y="{self.y:.9f}" hdg="{self.heading:.12f}" length="{length:.9f}"'
        self.pieces.append(f"<geometry {place}>{shape}</geometry>")
        turned = length * curvature
        chord = 2 * math.sin(turned / 2) / curvature if curvature else length
        self.x += chord * math.cos(self.heading + turned / 2)
        self.y += chord * math.sin(self.heading + turned / 2)
        self.heading += turned
        self.length += length
        return self


class Town:
    """The elements of the map."""

    def __init__(self):
        self.roads, self.junctions = [], []

    def road(self, number, pen, lanes, link, speed, junction=-1, name="", extra=""):
        """A road; `lanes` is the text of its lane sections."""
        kind = f'<type s="0" type="town"><speed max="{speed}" unit="km/h"/></type>'
        self.roads.append(
            f'  <road id="{number}" name="{name}" length="{pen.length:.9f}" junction="{junction}" rule="RHT">\n    <link>{link}</link>{kind}\n'
            f"    <planView>{''.join(pen.pieces)}</planView>\n    <lanes>{lanes}</lanes>{extra}\n  </road>"
        )

    def way(self, number, pen, junction, come, go):
        """A way through a junction. `come`, `go`: the road, its contact point and its lane."""
        link = (
            f'<predecessor elementType="road" elementId="{come[0]}" contactPoint="{come[1]}"/>'
            f'<successor elementType="road" elementId="{go[0]}" contactPoint="{go[1]}"/>'
        )
        self.road(number, pen, section(0, [], [driving(-1, come[2], go[2], mark="none")]), link, 50, junction)
        self.junctions[-1][1].append(
            f'<connection id="{number}" incomingRoad="{come[0]}" connectingRoad="{number}" contactPoint="start"><laneLink from="{come[2]}" to="-1"/></connection>'
        )

    def junction(self, number, name):
        """The ways that follow lead through it."""
        self.junctions.append((f'<junction id="{number}" name="{name}">', []))

    def text(self):
        """The map."""
        header = '<header revMajor="1" revMinor="7" name="Town" version="1" date="2026-12-01T00:00:00" vendor="avastra"/>'
        note = "<!-- Drawn by town.py: change that file, not this one. -->"
        junctions = [f"  {head}{''.join(connections)}</junction>" for head, connections in self.junctions]
        return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', note, "<OpenDRIVE>", f"  {header}", *self.roads, *junctions, "</OpenDRIVE>", ""])


def driving(number, before=None, after=None, kind="driving", mark="broken", width=f'<width sOffset="0" a="{LANE_M}" b="0" c="0" d="0"/>'):
    """A lane for vehicles."""
    links = "".join(f'<{name} id="{lane}"/>' for name, lane in (("predecessor", before), ("successor", after)) if lane is not None)
    return f'<lane id="{number}" type="{kind}"><link>{links}</link>{width}<roadMark sOffset="0" type="{mark}"/></lane>'


def footway(number):
    """A lane for people on foot."""
    return f'<lane id="{number}" type="sidewalk"><width sOffset="0" a="{FOOTWAY_M}" b="0" c="0" d="0"/><roadMark sOffset="0" type="none"/></lane>'


def section(start, left, right):
    """A lane section from the station `start`, with its lanes from left to right."""
    center = '<center><lane id="0" type="none"><roadMark sOffset="0" type="broken"/></lane></center>'
    left = f"<left>{''.join(left)}</left>" if left else ""
    return f'<laneSection s="{start}">{left}{center}<right>{"".join(right)}</right></laneSection>'


def street():
    """A lane and a footway each way."""
    return section(0, [footway(2), driving(1, mark="solid")], [driving(-1, mark="solid"), footway(-2)])


def crosswalk(number, station, half):
    """A crosswalk over `half` m on either side."""
    corners = "".join(f'<cornerLocal u="{u}" v="{v}" z="0" height="0"/>' for u, v in ((-2, -half), (2, -half), (2, half), (-2, half)))
    return f'<objects><object type="crosswalk" id="crosswalk_{number}" s="{station}" t="0" zOffset="0" hdg="0" orientation="none"><outline>{corners}</outline></object></objects>'


def sign(number, kind, t):
    """A sign for those who drive to the beginning of an arm: 205 is "give way", 206 is "stop"."""
    place = f's="1" t="{t}" zOffset="2.2" orientation="-"'
    return f'<signals><signal id="sign_{number}" {place} dynamic="no" country="DE" type="{kind}" subtype="-1" value="-1" height="0.9" width="0.9"/></signals>'


def to_junction(number):
    """The link of an arm."""
    return f'<predecessor elementType="junction" elementId="{number}"/>'


def roundabout(town, x, y):
    """Roads 10 to 13: the arms. 2K enters from arm K, 3K leaves to it, 4K passes it; 5K is the ring from arm K to the next. Junctions 100 to 103."""
    ring_m, entry_m, turn = 20 - LANE_M / 2, 20 - LANE_M / 2, math.pi / 3
    # An entry turns right by 60° and meets the ring 30° beyond the arm; the ring's middle line is the left edge of its lane.
    reach = ring_m * math.cos(math.pi / 6) + entry_m * math.sin(turn)
    straight = 33 - reach
    for arm, side in enumerate(SIDES):
        out = arm * math.pi / 2
        at = lambda radius, angle: (x + radius * math.cos(angle), y + radius * math.sin(angle))  # noqa: B023, E731
        here, before = 100 + arm, (arm + 3) % 4
        zebra = crosswalk(10 + arm, 5, LANE_M) if arm % 2 else ""
        town.road(10 + arm, Pen(*at(33, out), out).draw(150), street(), to_junction(here), 50, name=f"Round {side}", extra=zebra + sign(10 + arm, 205, LANE_M + 1))
        town.junction(here, f"Roundabout {side}")
        town.way(20 + arm, Pen(*at(33, out), out + math.pi).draw(straight).draw(entry_m * turn, -1 / entry_m), here, (10 + arm, "start", 1), (50 + arm, "start", -1))
        on_ring = lambda: Pen(*at(ring_m, out - math.pi / 6), out + math.pi / 3)  # noqa: B023, E731
        town.way(30 + arm, on_ring().draw(entry_m * turn, -1 / entry_m).draw(straight), here, (50 + before, "end", -1), (10 + arm, "start", -1))
        town.way(40 + arm, on_ring().draw(ring_m * turn, 1 / ring_m), here, (50 + before, "end", -1), (50 + arm, "start", -1))
        piece = Pen(*at(ring_m, out + math.pi / 6), out + math.pi / 6 + math.pi / 2).draw(ring_m * math.pi / 6, 1 / ring_m)
        link = f'{to_junction(here)}<successor elementType="junction" elementId="{100 + (arm + 1) % 4}"/>'
        town.road(50 + arm, piece, section(0, [], [driving(-1, mark="solid")]), link, 50, name="Ring")


def crossing(town, x, y):
    """Roads 60 to 63: the arms; those in the north and south have stop signs and crosswalks. 7KL leads from arm K to arm L. Junction 104."""
    half, number = 12.0, 104
    for arm, side in enumerate(SIDES):
        out, minor = arm * math.pi / 2, arm % 2
        extra = crosswalk(60 + arm, 8, LANE_M) + sign(60 + arm, 206, LANE_M + 1) if minor else ""
        start = Pen(x + half * math.cos(out), y + half * math.sin(out), out)
        town.road(60 + arm, start.draw(200), street(), to_junction(number), 50, name=f"{'Side' if minor else 'Main'} {side}", extra=extra)
    town.junction(number, "Stop signs")
    for arm in range(4):
        out = arm * math.pi / 2
        for other, curvature, length in (((arm + 1) % 4, -1 / half, half * math.pi / 2), ((arm + 2) % 4, 0, 2 * half), ((arm + 3) % 4, 1 / half, half * math.pi / 2)):
            pen = Pen(x + half * math.cos(out), y + half * math.sin(out), out + math.pi).draw(length, curvature)
            town.way(700 + 10 * arm + other, pen, number, (60 + arm, "start", 1), (60 + other, "start", -1))


def avenue(town, x, y):
    """Road 80: two lanes each way and a bus lane that ends at 300 m. It ends at junction 105, where the left lane turns left into road 81,
    the right lane goes straight on into road 82 or turns right into road 83."""
    half, number, length, merge, taper = 15.0, 105, 420.0, 300, 40
    full, narrow = f'<width sOffset="0" a="{LANE_M}" b="0" c="0" d="0"/>', f'<width sOffset="0" a="{LANE_M}" b="{-LANE_M / taper}" c="0" d="0"/>'
    sections = "".join((
        section(0, [footway(3), driving(2, after=2, mark="solid"), driving(1, after=1)],
                [driving(-1, after=-1), driving(-2, after=-2), driving(-3, after=-3, kind="bus", mark="solid", width=full), footway(-4)]),
        section(merge, [footway(3), driving(2, 2, 2, mark="solid"), driving(1, 1, 1)],
                [driving(-1, -1, -1), driving(-2, -2, -2), driving(-3, before=-3, kind="bus", mark="solid", width=narrow), footway(-4)]),
        section(merge + taper, [footway(3), driving(2, before=2, mark="solid"), driving(1, before=1)], [driving(-1, before=-1), driving(-2, before=-2, mark="solid"), footway(-3)]),
    ))
    link = f'<successor elementType="junction" elementId="{number}"/>'
    town.road(80, Pen(x - half - length, y, 0).draw(length), sections, link, 50, name="Avenue", extra=crosswalk(80, 360, 2 * LANE_M))
    town.road(81, Pen(x, y + half, math.pi / 2).draw(150), street(), to_junction(number), 50, name="Avenue north", extra=crosswalk(81, 8, LANE_M))
    onward = section(0, [footway(3), driving(2, mark="solid"), driving(1)], [driving(-1), driving(-2, mark="solid"), footway(-3)])
    town.road(82, Pen(x + half, y, 0).draw(250), onward, to_junction(number), 50, name="Avenue east")
    town.road(83, Pen(x, y - half, -math.pi / 2).draw(150), street(), to_junction(number), 50, name="Avenue south", extra=sign(83, 205, LANE_M + 1))
    town.junction(number, "Avenue")
    straight = 2 * half
    way = lambda at, pen, come, go: town.way(at, pen, number, come, go)  # noqa: E731
    west, east, north, south = (x - half, y, 0.0), (x + half, y, math.pi), (x, y + half, -math.pi / 2), (x, y - half, math.pi / 2)
    beside = lambda place, lanes: (place[0] + lanes * LANE_M * math.sin(place[2]), place[1] - lanes * LANE_M * math.cos(place[2]), place[2])  # noqa: E731
    # From the west: the left lane turns left or goes straight on, the right one goes straight on or turns right.
    way(841, Pen(*west).draw(half * math.pi / 2, 1 / half), (80, "end", -1), (81, "start", -1))
    way(842, Pen(*west).draw(straight), (80, "end", -1), (82, "start", -1))
    way(843, Pen(*beside(west, 1)).draw(straight), (80, "end", -2), (82, "start", -2))
    way(844, Pen(*beside(west, 1)).draw(LANE_M).draw((half - LANE_M) * math.pi / 2, -1 / (half - LANE_M)), (80, "end", -2), (83, "start", -1))
    # From the east, likewise.
    way(851, Pen(*east).draw(half * math.pi / 2, 1 / half), (82, "start", 1), (83, "start", -1))
    way(852, Pen(*east).draw(straight), (82, "start", 1), (80, "end", 1))
    way(853, Pen(*beside(east, 1)).draw(straight), (82, "start", 2), (80, "end", 2))
    # From the side streets: to the right, and straight on.
    way(861, Pen(*north).draw(half * math.pi / 2, -1 / half), (81, "start", 1), (80, "end", 1))
    way(862, Pen(*north).draw(straight), (81, "start", 1), (83, "start", -1))
    way(871, Pen(*south).draw(half * math.pi / 2, -1 / half), (83, "start", 1), (82, "start", -1))
    way(872, Pen(*south).draw(straight), (83, "start", 1), (81, "start", -1))


def main():
    town = Town()
    roundabout(town, 0, 0)
    crossing(town, 600, 0)
    avenue(town, 600, -600)
    pathlib.Path(__file__).with_name("town.xodr").write_text(town.text())


if __name__ == "__main__":
    main()
