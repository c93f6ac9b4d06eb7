"""MetaDrive's expert runs over a pedestrian who stands in its lane. It stops for a cyclist there, and mostly for a car.

    pip install metadrive-simulator==0.3.0.1 'numpy<2' gymnasium==0.28 && python show.py

Everything is MetaDrive's: a straight road without traffic, its default car, its expert without noise. MetaDrive's own `crash` stays false for a pedestrian, so
what is measured is how far whoever stood there was moved. Exits with 3 if a pedestrian is run over.
"""

import contextlib
import io
import logging
import math
import sys

logging.disable(logging.CRITICAL)
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    from metadrive import MetaDriveEnv
    from metadrive.component.traffic_participants.cyclist import Cyclist
    from metadrive.component.traffic_participants.pedestrian import Pedestrian
    from metadrive.component.vehicle.vehicle_type import MVehicle
    from metadrive.examples.ppo_expert.numpy_expert import expert

AHEAD, STEPS, MOVED, RAYS = 60.0, 400, 0.5, 240


def play(kind, seed):
    """How far whoever stands there is moved (m), the car's speed then (km/h), rays that meet it up to then, MetaDrive's own flag, and the end."""
    env = MetaDriveEnv({"map": "SSS", "traffic_density": 0.0, "start_seed": seed, "environment_num": 1, "horizon": STEPS})
    env.reset(force_seed=seed)
    car, lane = env.vehicle, env.vehicle.lane
    station = lane.local_coordinates(car.position)[0] + AHEAD
    if kind is MVehicle:
        other = env.engine.spawn_object(kind, vehicle_config={"spawn_lane_index": car.lane_index, "spawn_longitude": station})
    else:
        other = env.engine.spawn_object(kind, position=lane.position(station, 0.0), heading_theta=lane.heading_theta_at(station))
    begin, met_kmh, seen, crash = tuple(other.position), None, 0, False
    for _ in range(STEPS):
        observed, _, done, info = env.step(expert(car, deterministic=True))
        seen = max(seen, int((observed[-RAYS:] < 1.0).sum())) if met_kmh is None else seen
        crash |= bool(info["crash"])
        if met_kmh is None and math.dist(begin, other.position) > 0.05:
            met_kmh = car.speed_km_h
        if done:
            break
    moved = math.dist(begin, other.position)
    ends = {"arrives": info["arrive_dest"], "crash": info["crash"], "off the road": info["out_of_road"]}
    end = next((name for name, is_so in ends.items() if is_so), f"{car.speed_km_h:.1f} km/h at the end")
    env.close()
    return moved, met_kmh, seen, crash, end


run_over = False
for kind in (Pedestrian, Cyclist, MVehicle):
    for seed in range(3):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            moved, met_kmh, seen, crash, end = play(kind, seed)
        run_over |= kind is Pedestrian and moved > MOVED
        met = "not met" if met_kmh is None else f"met at {met_kmh:.0f} km/h, moved {moved:.1f} m, `crash` {crash}"
        print(f"{kind.__name__:10} seed {seed}: up to {seen} of {RAYS} rays meet it; {met}; {end}")
sys.exit(3 if run_over else 0)
