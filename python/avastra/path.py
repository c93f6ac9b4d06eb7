"""A polyline with stations, for lanes and routes: where is a point along it, and which pose lies at a station.

Plain Python on purpose: a planner with numpy will want arrays, which `Path.xy` gives.
"""

import math
from bisect import bisect_right
from typing import List, NamedTuple, Sequence, Tuple

# A projection first looks at every so many vertices, then at all around the nearest of them.
_STRIDE = 8

# Gap between lanes that follow each other, m, as maps are rounded. A point nearer than this to the one before it has no
# direction of its own.
_SEAM_M = 0.01


class Pose(NamedTuple):
    """A place in the frame of the map: m, m, rad counter-clockwise from +x."""

    x: float
    y: float
    heading: float


class Beside(NamedTuple):
    """A point as seen from a path."""

    #: Along the path, m; below 0 and beyond the length where the path is thought to go on straight.
    station: float
    #: To the left of the path, m.
    offset: float
    #: Of the path at that station, rad.
    heading: float


class Path:
    """A polyline of at least two different points, measured from its first point.

    Points within a centimetre of the one before are left out, because lanes of a map may miss those that follow by
    millimetres, and the step across such a seam, which may even lead backwards, is no heading of the road. The last point stays.
    """

    def __init__(self, points: Sequence[Sequence[float]]):
        kept: List[Tuple[float, float]] = []
        for point in points:
            here = float(point[0]), float(point[1])
            if not kept or math.dist(here, kept[-1]) > _SEAM_M:
                kept.append(here)
        if kept and kept[-1] != here:
            # The path keeps its last point, which replaces kept points within a seam of it.
            while len(kept) > 1 and math.dist(here, kept[-1]) <= _SEAM_M:
                kept.pop()
            if math.dist(here, kept[-1]) > 1e-6:
                kept.append(here)
        if len(kept) < 2:
            raise ValueError(f"a path needs two different points, and has {len(kept)}")
        self.xy = kept
        self.stations = [0.0]
        self.headings: List[float] = []
        for (x0, y0), (x1, y1) in zip(kept, kept[1:]):
            self.stations.append(self.stations[-1] + math.hypot(x1 - x0, y1 - y0))
            self.headings.append(math.atan2(y1 - y0, x1 - x0))

    @property
    def length(self) -> float:
        """m"""
        return self.stations[-1]

    def smoothed(self, reach: int = 1) -> "Path":
        """The path with its points averaged twice over `reach` neighbours to both sides; its ends stay.

        Roads go from straight to bend at once, and a planner that bounds how fast the wheel turns finds no way along
        that. With points 1 m apart and a `reach` of 1 the change takes some 5 m, and a bend of 6 m is cut by 0.1 m.
        """
        points = self.xy
        for _ in range(2):
            averaged = []
            for index in range(len(points)):
                span = min(reach, index, len(points) - 1 - index)
                near = points[index - span: index + span + 1]
                averaged.append((sum(x for x, _ in near) / len(near), sum(y for _, y in near) / len(near)))
            points = averaged
        return Path(points)

    def at(self, station: float, offset: float = 0.0) -> Pose:
        """The pose at a station and `offset` m to the left of it; beyond its ends the path goes on straight."""
        index = self._segment(station)
        x, y = self.xy[index]
        heading = self.headings[index]
        ahead = station - self.stations[index]
        cos, sin = math.cos(heading), math.sin(heading)
        return Pose(x + ahead * cos - offset * sin, y + ahead * sin + offset * cos, self._heading(station))

    def curvature(self, station: float, reach: float = 2.0) -> float:
        """1/m, positive to the left: how much the heading turns within `reach` m to both sides."""
        before, after = self._heading(station - reach), self._heading(station + reach)
        return wrap(after - before) / (2.0 * reach)

    def project(self, x: float, y: float) -> Beside:
        """Where the point lies beside the path."""
        def squared(index: int) -> float:
            dx, dy = x - self.xy[index][0], y - self.xy[index][1]
            return dx * dx + dy * dy

        last = len(self.xy) - 1
        near = min([*range(0, last, _STRIDE), last], key=squared)
        near = min(range(max(near - _STRIDE, 0), min(near + _STRIDE, last) + 1), key=squared)
        return min((self._beside(index, x, y) for index in {max(near - 1, 0), min(near, last - 1)}),
                   key=lambda found: found[0])[1]

    def _beside(self, index: int, x: float, y: float) -> Tuple[float, Beside]:
        """Squared distance to a segment, and the point as seen from it; the first and last go on for ever."""
        heading = self.headings[index]
        cos, sin = math.cos(heading), math.sin(heading)
        dx, dy = x - self.xy[index][0], y - self.xy[index][1]
        along, left = cos * dx + sin * dy, cos * dy - sin * dx
        length = self.stations[index + 1] - self.stations[index]
        low = -math.inf if index == 0 else 0.0
        high = math.inf if index == len(self.headings) - 1 else length
        kept = min(max(along, low), high)
        station = self.stations[index] + kept
        # Beside a corner the nearest place is the corner itself.
        offset = math.copysign(math.hypot(along - kept, left), left)
        return (along - kept) ** 2 + left ** 2, Beside(station, offset, self._heading(station))

    def _segment(self, station: float) -> int:
        return min(max(bisect_right(self.stations, station) - 1, 0), len(self.headings) - 1)

    def _heading(self, station: float) -> float:
        """Turns evenly from the middle of a segment to the middle of the next."""
        index = self._segment(station)
        middle = (self.stations[index] + self.stations[index + 1]) / 2.0
        other = index + 1 if station > middle else index - 1
        if not 0 <= other < len(self.headings):
            return self.headings[index]
        other_middle = (self.stations[other] + self.stations[other + 1]) / 2.0
        share = (station - middle) / (other_middle - middle)
        return wrap(self.headings[index] + share * wrap(self.headings[other] - self.headings[index]))


def wrap(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    turned = math.fmod(angle + math.pi, 2.0 * math.pi)
    return turned - math.pi if turned > 0.0 else turned + math.pi
