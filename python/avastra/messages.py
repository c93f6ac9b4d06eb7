"""The messages of the protocol avastra-ads/1 as Python objects; docs/reference/protocol.md is the specification.

What the simulator says is read into the classes of the first part; fields that it adds in later versions are ignored.
What a driver answers is a `Control`, an `Acceleration` or a `Trajectory`.

Units are SI. The frame of the map is right-handed; headings are rad counter-clockwise from +x, left is positive. The place
of the ego vehicle is the middle of its rear axle, that of an object the middle of its outline.
"""

import dataclasses
import functools
import math
import typing
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Type, TypeVar, Union

PROTOCOL = "avastra-ads/1"

Point = Tuple[float, float]
T = TypeVar("T")


class ProtocolError(Exception):
    """A message is not what the protocol says. The text names the field and says what is wrong with it."""


# --- What the simulator says -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Vehicle:
    """The vehicle that is driven: m, rad, rad/s, m/s² and kg; the deceleration is a magnitude."""

    length: float
    width: float
    height: float
    wheelbase: float
    rear_axle_to_front: float
    rear_axle_to_back: float
    max_steer: float
    max_steer_rate: float
    max_accel: float
    max_decel: float
    mass: float

    @property
    def rear_axle_to_centre(self) -> float:
        """From the rear axle forward to the middle of the outline, m."""
        return (self.rear_axle_to_front - self.rear_axle_to_back) / 2.0


@dataclass(frozen=True)
class Init:
    """Once, at the beginning of the conversation."""

    protocol: str
    simulator: str
    tick_us: int
    period_us: int
    observation: str
    vehicle: Vehicle
    #: The kind of answer that the user asks for, if there is one.
    answer: Optional[str] = None

    @property
    def period(self) -> float:
        """Time between two steps, s."""
        return self.period_us / 1e6


@dataclass(frozen=True)
class Neighbor:
    """The next driving lane on one side."""

    id: str
    same_direction: bool
    #: Width of what lies between, m.
    gap: float


@dataclass(frozen=True)
class LaneStopLine:
    s: float
    signal: str


@dataclass(frozen=True)
class LaneSign:
    s: float
    kind: str


@dataclass(frozen=True)
class Lane:
    """A driving lane; `centerline`, `left` and `right` have a point for each station in `s`."""

    id: str
    length: float
    s: List[float]
    centerline: List[Point]
    left: List[Point]
    right: List[Point]
    #: m/s
    speed_limit: float
    turn: str
    junction: Optional[str]
    successors: List[str]
    predecessors: List[str]
    left_neighbor: Optional[Neighbor]
    right_neighbor: Optional[Neighbor]
    changes_left: List[Tuple[float, float]]
    changes_right: List[Tuple[float, float]]
    stop_lines: List[LaneStopLine]
    signs: List[LaneSign]
    precedence: str


@dataclass(frozen=True)
class MapSignal:
    id: str
    x: float
    y: float


@dataclass(frozen=True)
class Crosswalk:
    id: str
    outline: List[Point]


@dataclass(frozen=True)
class Map:
    """The road network; only the last one sent holds."""

    id: str
    opendrive: Optional[str]
    lanes: List[Lane]
    signals: List[MapSignal]
    crosswalks: List[Crosswalk]

    @functools.cached_property
    def lane(self) -> Dict[str, Lane]:
        """The lanes by their ids."""
        return {lane.id: lane for lane in self.lanes}


@dataclass(frozen=True)
class Start:
    x: float
    y: float
    heading: float
    speed: float


@dataclass(frozen=True)
class Goal:
    x: float
    y: float
    heading: float
    lane: str
    route_s: float


# `from` is a word of Python: these fields have another name in the JSON.
@dataclass(frozen=True)
class RouteLane:
    """The route is in this lane from one of its stations to another."""

    id: str
    begin: float = field(metadata={"json": "from"})
    end: float = field(metadata={"json": "to"})


@dataclass(frozen=True)
class RouteChange:
    """A lane change: the path performs it between two stations; it must be over by `latest`."""

    begin: float = field(metadata={"json": "from"})
    end: float = field(metadata={"json": "to"})
    latest: float
    #: How far it goes to the left, m.
    lateral: float


@dataclass(frozen=True)
class RouteStopLine:
    route_s: float
    signal: str


@dataclass(frozen=True)
class RouteSign:
    route_s: float
    kind: str


class RoutePoint(NamedTuple):
    """A point of the route's path; curvature in 1/m, limit in m/s."""

    x: float
    y: float
    heading: float
    curvature: float
    speed_limit: float


@dataclass(frozen=True)
class Conflict:
    """A crossing of the route with another lane, at `route_s` and at `s` of that lane."""

    route_s: float
    lane: str
    s: float
    #: Heading of that lane minus that of the route, rad; positive comes from the right.
    angle: float


@dataclass(frozen=True)
class Route:
    """The way to the goal. `path` has a point every `spacing` m from station 0, lane changes included."""

    lanes: List[RouteLane]
    length: float
    spacing: float
    path: List[RoutePoint]
    changes: List[RouteChange]
    stop_lines: List[RouteStopLine]
    signs: List[RouteSign]
    crosswalks: List[Tuple[float, float]]
    #: Where the path crosses other lanes inside junctions; only if `Driver.wants` has "conflicts".
    conflicts: Optional[List[Conflict]] = None


@dataclass(frozen=True)
class Reset:
    """At the beginning of each episode."""

    seed: int
    map: str
    start: Start
    goal: Goal
    route: Route
    #: The seed in full, as scenarios have it; only if `Driver.wants` has "names".
    episode_seed: Optional[str] = None


@dataclass(frozen=True)
class Ego:
    """The ego vehicle. `vx` and `vy` are in the frame of the map, `speed` and `accel` along the vehicle."""

    x: float
    y: float
    heading: float
    vx: float
    vy: float
    speed: float
    accel: float
    yaw_rate: float
    #: Angle of the road wheels now, rad.
    steer: float
    #: It has hit, or been hit by, something in this episode.
    touched: bool
    lane: Optional[str]
    s: float
    d: float
    route_s: float
    route_d: float
    position_std: float


@dataclass(frozen=True)
class Object:
    """Another road user. `kind` is its `class`: car, truck, bus, motorcycle, cyclist, pedestrian, animal, object or unknown."""

    id: int
    kind: str = field(metadata={"json": "class"})
    x: float
    y: float
    heading: float
    vx: float
    vy: float
    length: float
    width: float
    height: float
    visible: float
    #: hazard, left, right or flash; None of one that shows nothing.
    lights: Optional[str] = None
    #: Acceleration in the map frame, m/s²; turn, rad/s; time since it is known, s. Only if `Driver.wants` has "motion".
    ax: Optional[float] = None
    ay: Optional[float] = None
    yaw_rate: Optional[float] = None
    age: Optional[float] = None
    #: Its number in scenarios and reports, for your logs; None of a ghost. Only if `Driver.wants` has "names".
    npc: Optional[int] = None

    @property
    def speed(self) -> float:
        """m/s, never negative."""
        return math.hypot(self.vx, self.vy)


@dataclass(frozen=True)
class Signal:
    """A traffic light: red, yellow, green or unknown."""

    id: str
    state: str


@dataclass(frozen=True)
class Conditions:
    """Light in [0, 1], rain in mm/h, visibility in m, water on the road in mm, coefficient of tyre friction."""

    light: float
    rain: float
    visibility: float
    water: float
    friction: float


@dataclass(frozen=True)
class Step:
    """What is known now; one answer is due."""

    seq: int
    t_us: int
    ego: Ego
    objects: List[Object]
    signals: List[Signal]
    conditions: Conditions

    @property
    def time(self) -> float:
        """Since the start of the episode, s."""
        return self.t_us / 1e6


@dataclass(frozen=True)
class Event:
    """Something has happened: "collision" or "end". Kinds that you do not know mean nothing."""

    kind: str
    t_us: int


# --- What a driver answers ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Internal:
    """What the driver believes and wants, for pictures, logs and measures. All of it is optional."""

    #: What holds the speed back now, for example "follow 3".
    reason: Optional[str] = None
    #: Where the rear axle shall be, every 0.1 s from now on.
    planned: Optional[List[Point]] = None
    #: Where the driver believes its rear axle is: x, y, heading.
    localized: Optional[Tuple[float, float, float]] = None
    plan_ms: Optional[float] = None


@dataclass(frozen=True)
class Control:
    """The wanted angle of the road wheels (rad, left is positive) and the wanted acceleration (m/s², negative brakes)."""

    accel: float
    steer: float
    internal: Optional[Internal] = None


@dataclass(frozen=True)
class Pedals:
    """As `Control`, with the positions of the pedals, each from 0 to 1, in place of the acceleration."""

    throttle: float
    brake: float
    steer: float
    internal: Optional[Internal] = None


@dataclass(frozen=True)
class Acceleration:
    """The wanted acceleration alone, m/s²: avastra steers along the route."""

    accel: float
    internal: Optional[Internal] = None
    #: What is to become of the route's next lane change: "wait" or "go"; without it avastra looks whether there is room.
    lane_change: Optional[str] = None


@dataclass(frozen=True)
class TrajectoryPoint:
    """Where the rear axle shall be at a time of the episode; `v` is the speed there, `a` the acceleration."""

    t_us: int
    x: float
    y: float
    heading: float
    v: float
    a: Optional[float] = None


@dataclass(frozen=True)
class Trajectory:
    """2 to 1,000 points in rising time, from now or before to at least 1 s from now; avastra's controller follows it."""

    points: List[TrajectoryPoint]
    internal: Optional[Internal] = None


Answer = Union[Control, Pedals, Acceleration, Trajectory]

#: The `type` of the message that carries an answer.
ANSWER_TYPES: Mapping[type, str] = {
    Control: "control",
    Pedals: "control",
    Acceleration: "acceleration",
    Trajectory: "trajectory",
}


# --- Reading and writing -----------------------------------------------------------------------------------------


def read(cls: Type[T], data: Any, where: str) -> T:
    """Builds a class of this file from parsed JSON; errors name the place, beginning with `where`."""
    if not isinstance(data, Mapping):
        raise ProtocolError(f"`{where}` is {_shown(data)}, and must be an object")
    values = {}
    of: Any = cls
    for name, key, kind, required in _fields(of):
        if key in data:
            values[name] = _value(kind, data[key], f"{where}.{key}")
        elif required:
            raise ProtocolError(f"`{where}` has no field `{key}`")
    return cls(**values)


def answer(given: Any, seq: int) -> Dict[str, Any]:
    """The message that carries what a driver returned from `step`; refuses what the protocol does not allow."""
    kind = ANSWER_TYPES.get(type(given))
    if kind is None:
        wanted = ", ".join(sorted(cls.__name__ for cls in ANSWER_TYPES))
        raise ProtocolError(f"`step` returned {_shown(given)}; it must return one of {wanted}")
    if isinstance(given, Trajectory):
        _check_points(given.points)
    message = {"type": kind, "seq": seq, **_plain(given, kind)}
    if isinstance(given, Pedals):
        for pedal in ("throttle", "brake"):
            if not 0.0 <= message[pedal] <= 1.0:
                raise ProtocolError(f"`control.{pedal}` is {message[pedal]}, and must be from 0 to 1")
    localized = message.get("internal", {}).get("localized")
    if localized is not None:
        message["internal"]["localized"] = dict(zip(("x", "y", "heading"), localized))
    return message


def _check_points(points: Any) -> None:
    if not isinstance(points, (list, tuple)):
        raise ProtocolError(f"`trajectory.points` is {_shown(points)}, and must be a list")
    for index, point in enumerate(points):
        if not isinstance(point, TrajectoryPoint):
            raise ProtocolError(f"`trajectory.points[{index}]` is {_shown(point)}, and must be a "
                                "TrajectoryPoint(t_us, x, y, heading, v)")
    if len(points) < 2:
        raise ProtocolError(f"`trajectory.points` has {len(points)} points, and needs at least 2")


def _plain(value: Any, where: str) -> Any:
    """The value as JSON has it, without optional fields that are None. Numbers of numpy become Python's."""
    if dataclasses.is_dataclass(value):
        plain = {}
        of: Any = type(value)
        for name, _, kind, required in _fields(of):
            inner = getattr(value, name)
            if kind == Optional[str] and isinstance(inner, str):
                plain[name] = inner
            elif inner is not None or required:
                plain[name] = _plain(inner, f"{where}.{name}")
        return plain
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(inner, f"{where}[{index}]") for index, inner in enumerate(value)]
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise ProtocolError(f"`{where}` is {value}, and must be finite")
        return value
    raise ProtocolError(f"`{where}` is {_shown(value)}, and must be a number")


@functools.lru_cache(maxsize=None)
def _fields(cls: Any) -> Tuple[Tuple[str, str, Any, bool], ...]:
    """Of each field: its name here, its key in the JSON, its type, and whether it must be there."""
    kinds = typing.get_type_hints(cls)
    return tuple(
        (entry.name, entry.metadata.get("json", entry.name), kinds[entry.name], entry.default is dataclasses.MISSING)
        for entry in dataclasses.fields(cls)
    )


def _value(kind: Any, data: Any, where: str) -> Any:
    if kind is float:
        if isinstance(data, (int, float)) and not isinstance(data, bool):
            return float(data)
    elif kind in (int, str, bool):
        if type(data) is kind:
            return data
    elif kind is RoutePoint:
        if isinstance(data, list) and len(data) >= len(RoutePoint._fields):
            return RoutePoint(*(_value(float, inner, where) for inner in data[: len(RoutePoint._fields)]))
    elif dataclasses.is_dataclass(kind):
        as_class: Any = kind
        return read(as_class, data, where)
    else:
        return _generic(typing.get_origin(kind), typing.get_args(kind), data, where)
    raise ProtocolError(f"`{where}` is {_shown(data)}, and must be of type {kind.__name__}")


def _generic(origin: Any, arguments: Tuple[Any, ...], data: Any, where: str) -> Any:
    """A value of type `Optional[…]`, `List[…]` or `Tuple[…]`: the only ones in this file."""
    if origin is Union:
        return None if data is None else _value(arguments[0], data, where)
    if not isinstance(data, list):
        raise ProtocolError(f"`{where}` is {_shown(data)}, and must be a list")
    if origin is list:
        return [_value(arguments[0], entry, f"{where}[{index}]") for index, entry in enumerate(data)]
    if len(data) != len(arguments):
        raise ProtocolError(f"`{where}` has {len(data)} entries, and must have {len(arguments)}")
    return tuple(_value(kind, entry, where) for kind, entry in zip(arguments, data))


def _shown(data: Any) -> str:
    text = repr(data)
    return text if len(text) <= 60 else text[:57] + "..."
