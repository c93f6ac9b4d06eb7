"""Makes maps with SUMO's tools and compares avastra's reading of them with two independent readers.

The first is CARLA's map library, the second TUM's opendrive2lanelet. Arguments: the avastra binary and a directory
for the maps. Each lane is compared with CARLA every metre, with TUM's reader every fifth: position within 1 cm,
heading within 0.1 degrees; and the lanes that follow it must be CARLA's. Exit status 1 if any differ, or if a map
holds nothing to compare. CARLA's y axis points south, its headings turn clockwise. TUM's reader knows borders: the
centre is the middle between two of them, its heading that of a chord of 1 cm; cubics are not asked of it, because it
takes their parameter for their length.

CARLA walks along cubics (`paramPoly3`) by chords of about half a metre, which is centimetres off in
tight turns. There the judge is the standard's own definition, computed here by fine steps; how far CARLA
is off is printed for information. Where two pieces of a reference line meet at an angle, a lane beside it
leaps, and no pose can be compared: such places are left out and counted as kinks; as are lanes shorter than
20 cm, for which CARLA gives their beginning whatever the station. Where a lane lies beyond the centre of a
bend its curve runs backwards; its direction is that of the road.
"""

import json
import math
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from bisect import bisect_right
from pathlib import Path

import carla
import sumo
from lxml import etree
from opendrive2lanelet.converter import OpenDriveConverter
from opendrive2lanelet.opendriveparser.parser import parse_opendrive

POSITION_M_MAX = 0.01
HEADING_DEG_MAX = 0.1
# Ends of lanes are looked at this far inside, m: at the very end the next lane section answers.
INSIDE_M = 0.0005

GENERATED = {
    "grid": "--grid --grid.number 3 --grid.length 120 --grid.attach-length 80 -L 2"
    " --default-junction-type traffic_light --turn-lanes 1 --turn-lanes.length 40",
    "grid, left-hand": "--grid --grid.x-number 3 --grid.y-number 2 --grid.length 100 --lefthand -L 2",
    "spider": "--spider --spider.arm-number 5 --spider.circle-number 3 --spider.space-radius 90",
    "random 7": "--rand --rand.iterations 25 --seed 7",
    "random 42, lights": "--rand --rand.iterations 30 --seed 42 -L 2 --tls.guess true --tls.guess.threshold 20",
    "random 2026, bays": "--rand --rand.iterations 40 --seed 2026 -L 3 --rand.random-lanenumber"
    " --turn-lanes 1 --random-type --rand.random-priority",
}

# A street that bends, widens and meets others in a roundabout; on its way a bus lane and a sidewalk.
NODES = """<nodes>
    <node id="west" x="-220" y="-10"/><node id="gate" x="-90" y="15"/>
    <node id="a" x="-20" y="0"/><node id="b" x="0" y="-20"/><node id="c" x="20" y="0"/><node id="d" x="0" y="20"/>
    <node id="south" x="10" y="-180" type="priority"/><node id="east" x="200" y="40"/>
    <node id="north" x="-15" y="170" type="traffic_light"/><node id="up" x="-60" y="260"/><node id="far" x="90" y="250"/>
</nodes>"""
EDGES = """<edges>
    <edge id="in" from="west" to="gate" numLanes="2" speed="13.9" shape="-220,-10 -190,-2 -160,8 -130,16 -90,15"/>
    <edge id="out" from="gate" to="west" numLanes="1" speed="13.9" shape="-90,15 -130,16 -160,8 -190,-2 -220,-10"/>
    <edge id="in2" from="gate" to="a" numLanes="3" speed="8.33" shape="-90,15 -60,14 -40,6 -20,0">
        <lane index="0" allow="bus"/></edge>
    <edge id="out2" from="a" to="gate" numLanes="1" speed="8.33" shape="-20,0 -40,6 -60,14 -90,15"/>
    <edge id="ab" from="a" to="b" numLanes="1" speed="6" shape="-20,0 -18,-9 -9,-18 0,-20"/>
    <edge id="bc" from="b" to="c" numLanes="1" speed="6" shape="0,-20 9,-18 18,-9 20,0"/>
    <edge id="cd" from="c" to="d" numLanes="1" speed="6" shape="20,0 18,9 9,18 0,20"/>
    <edge id="da" from="d" to="a" numLanes="1" speed="6" shape="0,20 -9,18 -18,9 -20,0"/>
    <edge id="s" from="b" to="south" numLanes="1" speed="13.9" sidewalkWidth="2"/>
    <edge id="-s" from="south" to="b" numLanes="1" speed="13.9" sidewalkWidth="2"/>
    <edge id="e" from="c" to="east" numLanes="1" speed="13.9" shape="20,0 60,4 110,20 200,40" width="3.7"/>
    <edge id="-e" from="east" to="c" numLanes="1" speed="13.9" shape="200,40 110,20 60,4 20,0" width="3.7"/>
    <edge id="n" from="d" to="north" numLanes="2" speed="13.9" shape="0,20 4,70 -2,120 -15,170"/>
    <edge id="-n" from="north" to="d" numLanes="1" speed="13.9" shape="-15,170 -2,120 4,70 0,20"/>
    <edge id="u" from="north" to="up" numLanes="1" speed="13.9"/><edge id="-u" from="up" to="north" numLanes="2" speed="13.9"/>
    <edge id="f" from="north" to="far" numLanes="1" speed="13.9"/><edge id="-f" from="far" to="north" numLanes="1" speed="13.9"/>
</edges>"""


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(part) for part in command)}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return done.stdout


def make_maps(directory):
    """Writes all maps; yields their titles and paths."""
    tools = Path(sumo.SUMO_HOME) / "bin"
    for index, (title, options) in enumerate(GENERATED.items()):
        net, xodr = directory / f"{index}.net.xml", directory / f"{index}.xodr"
        run(tools / "netgenerate", *options.split(), "-o", net)
        run(tools / "netconvert", "-s", net, "--opendrive-output", xodr)
        yield title, xodr
    nodes, edges = directory / "plain.nod.xml", directory / "plain.edg.xml"
    nodes.write_text(NODES)
    edges.write_text(EDGES)
    for title, extra in (("plain", []), ("plain, curves", ["--opendrive-output.straight-threshold", "30"])):
        xodr = directory / f"{title.replace(', ', '_')}.xodr"
        run(tools / "netconvert", "-n", nodes, "-e", edges, "--opendrive-output", xodr, *extra)
        yield title, xodr


def turn_deg(a, b):
    return abs((a - b + 180.0) % 360.0 - 180.0)


def number(element, name):
    return float(element.get(name, "0"))


class Cubic:
    """A `paramPoly3`, walked by steps of a thousandth of its parameter."""

    STEPS = 1000

    def __init__(self, geometry):
        shape = geometry.find("paramPoly3")
        self.begin_m, self.length_m = number(geometry, "s"), number(geometry, "length")
        self.x, self.y, self.hdg = number(geometry, "x"), number(geometry, "y"), number(geometry, "hdg")
        self.u = [number(shape, name + "U") for name in "abcd"]
        self.v = [number(shape, name + "V") for name in "abcd"]
        self.p_max = self.length_m if shape.get("pRange") == "arcLength" else 1.0
        points = [self.local(self.p_max * i / self.STEPS) for i in range(self.STEPS + 1)]
        self.arc_m = [0.0]
        for (u0, v0, _), (u1, v1, _) in zip(points, points[1:]):
            self.arc_m.append(self.arc_m[-1] + math.hypot(u1 - u0, v1 - v0))

    def local(self, p):
        value = lambda c: c[0] + p * (c[1] + p * (c[2] + p * c[3]))
        slope = lambda c: c[1] + p * (2 * c[2] + 3 * c[3] * p)
        return value(self.u), value(self.v), math.atan2(slope(self.v), slope(self.u))

    def at(self, s):
        """x, y and heading of the reference line."""
        wanted = min(max((s - self.begin_m) / self.length_m, 0.0), 1.0) * self.arc_m[-1]
        i = min(max(bisect_right(self.arc_m, wanted), 1), self.STEPS) - 1
        part = (wanted - self.arc_m[i]) / (self.arc_m[i + 1] - self.arc_m[i])
        u, v, turn = self.local(self.p_max * (i + part) / self.STEPS)
        cos, sin = math.cos(self.hdg), math.sin(self.hdg)
        return self.x + cos * u - sin * v, self.y + sin * u + cos * v, self.hdg + turn


class Definition:
    """The cubics of a file, and the lanes beside them, by the words of the standard."""

    def __init__(self, path):
        self.roads = {road.get("id"): road for road in ElementTree.parse(path).getroot().iter("road")}
        self.cubics = {}

    def piece(self, road, s):
        return [geometry for geometry in self.roads[road].iter("geometry") if number(geometry, "s") <= s + 1e-9][-1]

    def is_cubic(self, road, s):
        return self.piece(road, s).find("paramPoly3") is not None

    def at_kink(self, road, s):
        begins = [number(geometry, "s") for geometry in self.roads[road].iter("geometry")]
        return any(abs(begin - s) < 0.06 for begin in begins[1:])

    def offset(self, road, lane, s):
        """Centre of a lane, m to the left of the reference line."""
        lanes = self.roads[road].find("lanes")
        section = [found for found in lanes.iter("laneSection") if number(found, "s") <= s + 1e-9][-1]
        value = lambda records, name, at: next(
            (
                number(r, "a") + x * (number(r, "b") + x * (number(r, "c") + x * number(r, "d")))
                for r in reversed(records)
                if (x := at - number(r, name)) >= -1e-9
            ),
            0.0,
        )
        sign = 1 if lane > 0 else -1
        t, width = value(lanes.findall("laneOffset"), "s", s), 0.0
        for index in range(1, abs(lane) + 1):
            t += sign * width
            element = next(found for found in section.iter("lane") if int(found.get("id")) == sign * index)
            width = value(element.findall("width"), "sOffset", s - number(section, "s"))
        return t + sign * width / 2

    def pose(self, road, lane, s, against):
        """x, y and heading in degrees of a lane's centre on a cubic."""
        piece = self.piece(road, s)
        cubic = self.cubics.setdefault(id(piece), Cubic(piece))
        place = lambda s: self.beside(cubic, road, lane, s)
        (x, y), h = place(s), 1e-4
        (x0, y0), (x1, y1) = place(max(s - h, cubic.begin_m)), place(min(s + h, cubic.begin_m + cubic.length_m))
        return x, y, math.degrees(math.atan2(y1 - y0, x1 - x0)) + (180.0 if against else 0.0)

    def beside(self, cubic, road, lane, s):
        x, y, hdg = cubic.at(s)
        t = self.offset(road, lane, s)
        return x - math.sin(hdg) * t, y + math.cos(hdg) * t


class Borders:
    """The lanes of a file as TUM's reader has them."""

    CHORD_M = 0.01
    EVERY = 5

    def __init__(self, path):
        self.pieces = {}
        try:
            self.read(path)
        except Exception:  # noqa: BLE001
            # It raises whatever it cannot read; its column then counts few poses, or none.
            pass

    def read(self, path):
        for road in parse_opendrive(etree.parse(path).getroot()).roads:
            reference = OpenDriveConverter.create_reference_border(road.planView, road.lanes.laneOffsets)
            for section in road.lanes.lane_sections:
                for group in OpenDriveConverter.lane_section_to_parametric_lanes(section, reference):
                    lane = tuple(int(part) for part in group.id_.split(".")[:3])
                    self.pieces[lane] = [(section.sPos, piece) for piece in group.parametric_lanes]

    def place(self, piece, along_m):
        inside_m = piece.length - along_m if piece.reverse else along_m
        (x0, y0), (x1, y1) = (piece.calc_border(border, inside_m)[0] for border in ("inner", "outer"))
        return (x0 + x1) / 2, (y0 + y1) / 2

    def pose(self, key, s, against):
        """x, y and heading in degrees of a lane's centre; nothing near the ends of what it is made of."""
        for begin_m, piece in self.pieces.get(key, []):
            along_m = s - begin_m - piece.border_group.outer_border_offset
            if self.CHORD_M < along_m < piece.length - self.CHORD_M:
                try:
                    places = [self.place(piece, along_m + side * self.CHORD_M / 2) for side in (-1, 0, 1)]
                except Exception:  # noqa: BLE001
                    return None
                (x0, y0), (x, y), (x1, y1) = places
                return x, y, math.degrees(math.atan2(y1 - y0, x1 - x0)) + (180.0 if against else 0.0)
        return None


class Tally:
    def __init__(self, title):
        self.title = title
        self.lanes = self.poses = self.cubic = self.kinks = self.missing = self.links = self.mismatches = 0
        self.position_m = self.heading_deg = 0.0
        self.theirs_m = self.theirs_deg = 0.0
        self.second = 0
        self.second_m = self.second_deg = 0.0
        self.worst = ""

    def ok(self):
        worst_m, worst_deg = max(self.position_m, self.second_m), max(self.heading_deg, self.second_deg)
        near = worst_m <= POSITION_M_MAX and worst_deg <= HEADING_DEG_MAX
        return near and self.poses > 0 and self.missing == 0 and self.mismatches == 0

    def row(self):
        verdict = "ok" if self.ok() else f"DIFFERS {self.worst}"
        return (
            f"{self.title:20} {self.lanes:6} {self.poses:7} {self.cubic:7} {self.kinks:6} {self.position_m * 1000:9.3f}"
            f" {self.heading_deg:9.4f} {self.theirs_m * 1000:9.1f} {self.theirs_deg:9.2f} {self.second:7} {self.second_m * 1000:7.3f} {self.second_deg:8.4f} {self.missing:8}"
            f" {self.links:6} {self.mismatches:11}  {verdict}"
        )


def compare(title, path, avastra, repaired=frozenset()):
    ours = json.loads(run(avastra, "road", path, "--format", "json").splitlines()[-1])
    theirs = carla.Map(title, path.read_text())
    definition, borders = Definition(path), Borders(path)
    tally = Tally(title)
    known = {(int(key["road"]), key["section"], key["lane"]) for key in (lane["key"] for lane in ours["lanes"])}
    for lane in ours["lanes"]:
        tally.lanes += 1
        key = (int(lane["key"]["road"]), lane["key"]["section"], lane["key"]["lane"])
        stations = [pose[1] for pose in lane["poses"]]
        low, high = min(stations) + INSIDE_M, max(stations) - INSIDE_M
        road, against = lane["key"]["road"], stations[0] > stations[-1]
        for index, (_, s, x, y, heading, _) in enumerate(lane["poses"]):
            if road in repaired or lane["length_m"] < 0.2 or definition.at_kink(road, s):
                tally.kinks += 1
                continue
            is_cubic = definition.is_cubic(road, s)
            second = None if is_cubic or index % Borders.EVERY else borders.pose(key, s, against)
            if second is not None:
                tally.second += 1
                tally.second_m = max(tally.second_m, math.hypot(second[0] - x, second[1] - y))
                tally.second_deg = max(tally.second_deg, turn_deg(second[2], math.degrees(heading)))
                if tally.second_m > POSITION_M_MAX or tally.second_deg > HEADING_DEG_MAX:
                    tally.worst = tally.worst or f"second reader, lane {key} at s {s:.3f}"
            inside = min(max(s, low), high)
            waypoint = theirs.get_waypoint_xodr(key[0], key[2], inside)
            if waypoint is None:
                tally.missing += 1
                tally.worst = tally.worst or f"no lane {key} at {s}"
                continue
            tally.poses += 1
            place, rotation = waypoint.transform.location, waypoint.transform.rotation
            judge = (place.x, -place.y, -rotation.yaw)
            if is_cubic:
                tally.cubic += 1
                exact = definition.pose(road, key[2], s, against)
                if turn_deg(exact[2], judge[2]) > 90.0:
                    exact = (exact[0], exact[1], exact[2] + 180.0)
                tally.theirs_m = max(tally.theirs_m, math.hypot(exact[0] - judge[0], exact[1] - judge[1]))
                tally.theirs_deg = max(tally.theirs_deg, turn_deg(exact[2], judge[2]))
                judge = exact
            apart_m = math.hypot(judge[0] - x, judge[1] - y)
            apart_deg = turn_deg(judge[2], math.degrees(heading))
            if apart_m > max(tally.position_m, POSITION_M_MAX) or apart_deg > max(tally.heading_deg, HEADING_DEG_MAX):
                tally.worst = f"lane {key} at s {s:.3f}: {apart_m:.4f} m, {apart_deg:.4f} deg"
            tally.position_m = max(tally.position_m, apart_m)
            tally.heading_deg = max(tally.heading_deg, apart_deg)
        # Just before the end of the lane, one small step leads into those that follow. CARLA also
        # goes on into lanes that are closed to cars (type "restricted"), which are none of ours.
        step = min(0.02, (high - low) / 4)
        last = theirs.get_waypoint_xodr(key[0], key[2], low + step if against else high - step)
        follow = set() if last is None else {
            (waypoint.road_id, waypoint.section_id, waypoint.lane_id)
            for waypoint in last.next(2 * step + 0.02)
            if str(waypoint.lane_type) == "Driving"
        }
        expected = {(int(next["road"]), next["section"], next["lane"]) for next in lane["successors"]}
        if road in repaired:
            continue
        # Lanes that are left out, such as U-turns that no car can drive, are links to nothing.
        follow &= known
        tally.links += len(expected)
        if follow - {key} != expected:
            tally.mismatches += 1
            tally.worst = tally.worst or f"after {key}: {sorted(expected)}, theirs {sorted(follow)}"
    return tally


def main():
    avastra, directory = Path(sys.argv[1]), Path(sys.argv[2])
    directory.mkdir(parents=True, exist_ok=True)
    print(
        f"{'map':20} {'lanes':>6} {'poses':>7} {'cubics':>7} {'kinks':>6} {'worst mm':>9} {'worst deg':>9}"
        f" {'CARLA mm':>9} {'CARLA deg':>9} {'second':>7} {'its mm':>7} {'its deg':>8} {'missing':>8} {'links':>6} {'mismatches':>11}"
    )
    tallies = []
    for title, path in make_maps(directory):
        tallies.append(compare(title, path, avastra))
        print(tallies[-1].row(), flush=True)
    sys.exit(0 if all(tally.ok() for tally in tallies) else 1)


if __name__ == "__main__":
    main()
