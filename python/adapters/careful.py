"""A careful planner in a stranger's place: `NAME:careful` of `run.sh`. It reads what an adapter has made for its driver, and answers in the same form.

If it avoids a failure of the driver, the adapter tells enough and obeys well enough to avoid it. If it does not, nothing is shown. It keeps to the way
that it is given and chooses its acceleration alone:

- Each road user goes on as predicted, or brakes with `OTHERS_BRAKE` from now on: it must be safe against both.
- An acceleration is safe if it may be held for `HOLD` s, with braking to a stand after it, and nobody is touched meanwhile. The largest one is taken.
- If none is, it takes the largest that may be held for the whole horizon; if none may, it brakes as hard as it can.
"""

import dataclasses

import numpy as np

#: What is foreseen, s.
STEP, HORIZON = 0.2, 5.0
TIMES = np.arange(0.0, HORIZON + 1e-9, STEP)
#: Accelerations to choose from, m/s²; the vehicle's own limits are among them.
CHOICES = (2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -4.0, -6.0, -8.0)
HOLD = 0.4
#: Braking to a stand is planned with no more than this, m/s²; others may brake as hard as `OTHERS_BRAKE`.
BRAKING, OTHERS_BRAKE = 4.0, 6.0
#: Kept free ahead and behind, and on both sides, m; how fast the latter grows, m/s.
AHEAD, ASIDE, ASIDE_GAIN = 1.0, 0.4, 0.1
#: Farther away than this nobody is looked at, m; and how far a way reaches: 25 m/s for the horizon.
REACH, WAY = 120.0, 125.0


@dataclasses.dataclass
class Vehicle:
    """The ego vehicle, in m, m/s and m/s². `middle` is how far its middle lies ahead of the point that the way is of."""

    length: float
    width: float
    speed: float
    max_accel: float
    max_decel: float
    middle: float = 0.0


@dataclasses.dataclass
class Other:
    """A road user: rows of x, y, heading of its middle at `TIMES`; its length and width, m."""

    poses: np.ndarray
    length: float
    width: float


def moving(x, y, heading, vx, vy, length, width):
    """One that keeps its velocity."""
    return Other(np.column_stack([x + vx * TIMES, y + vy * TIMES, np.full(len(TIMES), heading)]), length, width)


def predicted(times, poses, length, width):
    """One whose poses are known at times from 0 on. Beyond the last it keeps its velocity."""
    poses = np.array(poses, dtype=float)
    if len(times) < 2:
        return moving(*poses[0], 0.0, 0.0, length, width)
    columns = [np.interp(TIMES, times, column) for column in (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))]
    beyond = np.maximum(TIMES - times[-1], 0.0) / (times[-1] - times[-2])
    for axis in (0, 1):
        columns[axis] = columns[axis] + beyond * (poses[-1, axis] - poses[-2, axis])
    return Other(np.column_stack(columns), length, width)


def way(path, station):
    """Rows of station, x, y, heading from a station of an `avastra.Path` on."""
    ahead = np.arange(0.0, WAY, 0.5)
    return np.array([(on, *path.at(station + on)) for on in ahead])


def driven(way, speed, accel, dt, seconds):
    """Rows of x, y, heading, speed, acceleration each `dt` s, if an acceleration is held until the vehicle stands."""
    times = np.arange(0.0, seconds + dt / 2.0, dt)
    speeds = np.maximum(speed + accel * times, 0.0)
    on = np.append(0.0, np.cumsum((speeds[1:] + speeds[:-1]) / 2.0 * dt))
    return np.column_stack([*at(way, on), speeds, np.where(speeds > 0.0, accel, 0.0)])


def acceleration(vehicle, way, others, wanted):
    """The acceleration to take, m/s².

    `way` has rows of station, x, y, heading; the vehicle is at station 0. `wanted` is the speed that is wanted.
    """
    choices = np.unique(np.clip([*CHOICES, vehicle.max_accel, -vehicle.max_decel], -vehicle.max_decel, vehicle.max_accel))[::-1]
    # No faster than wanted, and back to it within a second.
    choices = choices[(choices <= wanted - vehicle.speed) | (choices == choices.min())]
    near = [other for other in others if np.hypot(*(other.poses[0, :2] - way[0, 1:3])) < REACH]
    both = near + [braked(other) for other in near]
    safe = ~touches(vehicle, way, stations(vehicle.speed, choices, min(BRAKING, vehicle.max_decel), HOLD), both)
    if safe.any():
        return float(choices[safe.argmax()])
    safe = ~touches(vehicle, way, stations(vehicle.speed, choices, 0.0, HORIZON), near)
    return float(choices[safe.argmax()]) if safe.any() else -vehicle.max_decel


def stations(speed, accels, braking, hold):
    """How far a vehicle is at `TIMES` for each acceleration that it holds for a time before it brakes, shape (accelerations, times)."""
    fine = np.arange(0.0, HORIZON + 1e-9, STEP / 4.0)
    accels = np.asarray(accels, dtype=float)[:, None]
    speeds = speed + accels * np.minimum(fine, hold) - braking * np.maximum(fine - hold, 0.0)
    # Once it stands it stays.
    speeds = np.where(np.maximum.accumulate(speeds < 0.0, axis=1), 0.0, speeds)
    ways = np.cumsum((speeds[:, 1:] + speeds[:, :-1]) / 2.0 * STEP / 4.0, axis=1)
    return np.concatenate([np.zeros((len(accels), 1)), ways], axis=1)[:, ::4]


def braked(other):
    """The same road user, if it brakes from now on along the way that was predicted."""
    ways = np.append(0.0, np.cumsum(np.hypot(*np.diff(other.poses[:, :2], axis=0).T)))
    if ways[-1] < 1e-3:
        return other
    on = stations(ways[1] / STEP, [0.0], OTHERS_BRAKE, 0.0)[0]
    columns = (*other.poses[:, :2].T, np.unwrap(other.poses[:, 2]))
    return Other(np.column_stack([np.interp(on, ways, column) for column in columns]), other.length, other.width)


def at(way, on):
    """x, y and heading at stations of a way."""
    return (np.interp(on, way[:, 0], way[:, 1]), np.interp(on, way[:, 0], way[:, 2]), np.interp(on, way[:, 0], np.unwrap(way[:, 3])))


def touches(vehicle, way, driven, others):
    """Whether each row of stations at `TIMES` meets anybody, with room kept. One that comes from behind must look out itself."""
    x, y, heading = at(way, driven)
    cos, sin = np.cos(heading), np.sin(heading)
    x, y = x + vehicle.middle * cos, y + vehicle.middle * sin
    half_length, half_width = vehicle.length / 2.0 + AHEAD, vehicle.width / 2.0 + ASIDE + ASIDE_GAIN * TIMES
    met = np.zeros(len(driven), bool)
    for other in others:
        dx, dy = other.poses[:, 0] - x, other.poses[:, 1] - y
        along, across = dx * cos + dy * sin, dy * cos - dx * sin
        other_cos, other_sin = np.cos(other.poses[:, 2] - heading), np.sin(other.poses[:, 2] - heading)
        turned_cos, turned_sin = np.abs(other_cos), np.abs(other_sin)
        length, width = other.length / 2.0, other.width / 2.0
        # Separating axes: the vehicle's own two, then the other's.
        apart = np.abs(along) > half_length + turned_cos * length + turned_sin * width
        apart |= np.abs(across) > half_width + turned_sin * length + turned_cos * width
        apart |= np.abs(along * other_cos + across * other_sin) > length + turned_cos * half_length + turned_sin * half_width
        apart |= np.abs(across * other_cos - along * other_sin) > width + turned_sin * half_length + turned_cos * half_width
        follows = (along[:, :1] < -vehicle.length / 2.0) & (other_cos[:, :1] > 0.9)
        met |= (~apart & ~follows).any(axis=1)
    return met
