"""Compares the rebuilt observation with MetaDrive's own, over a drive of its expert in its own world and traffic.

    sh python/adapters/run.sh metadrive && target/adapters/metadrive/bin/python python/adapters/metadrive/compare.py

Not compared are the places of the checkpoints, which hang on the route that is put in the place of MetaDrive's roads. A ray may pass beside a corner that
the other meets: MetaDrive's poses are rounded by its physics. So the number of rays that differ is printed, not the largest difference.
"""

import math
from types import SimpleNamespace

import avastra
import driver
import numpy as np
from metadrive.envs.metadrive_env import MetaDriveEnv
from metadrive.examples.ppo_expert.numpy_expert import expert

STEPS = 250
CHECKPOINTS = (9, 10, 14, 15)


def main():
    env = MetaDriveEnv({"use_render": False, "map": "SCS", "traffic_density": 0.3, "start_seed": 5, "environment_num": 1})
    env.reset()
    vehicle = env.vehicle
    state, others_apart, rays_apart = 0.0, 0, 0
    for _ in range(STEPS):
        action, theirs = expert(vehicle, deterministic=True, need_obs=True)
        difference = np.abs(rebuilt(env, vehicle) - theirs.reshape(-1))
        difference[list(CHECKPOINTS)] = 0.0
        state = max(state, difference[:19].max())
        # Beyond the fourth vehicle, and at the edge of the range, the two may choose others.
        others_apart += int((difference[19:35] > 0.02).sum())
        rays_apart += int((difference[35:] > 0.02).sum())
        if env.step(action)[2]:
            break
    print(f"state and navigation: at most {state:.4f} apart; {others_apart} of {STEPS * 16} figures of others and "
          f"{rays_apart} of {STEPS * driver.RAYS} rays differ by more than 0.02")


def rebuilt(env, vehicle):
    """The adapter's observation of MetaDrive's world. MetaDrive's frame has y to the right, ours to the left."""
    navigation, lane = vehicle.navigation, vehicle.lane
    station, _ = lane.local_coordinates(vehicle.position)
    lanes, width = navigation.current_ref_lanes, navigation.get_current_lane_width()
    on = lane.index[2] if lane in lanes else 0
    adapter = driver.Expert()
    adapter.vehicle, adapter.period = SimpleNamespace(rear_axle_to_centre=0.0), 0.1
    path = avastra.Path([(place[0], -place[1]) for place in (lane.position(at, 0.0) for at in np.arange(station - 20.0, station + 60.0, 0.5))])
    adapter.way = SimpleNamespace(path=path, stop=lambda step: None)
    adapter.room = [(on * width + width / 2.0, (len(lanes) - 1 - on) * width + width / 2.0)]
    adapter.stretches = [stretch(lanes[0]), stretch((navigation.next_ref_lanes or lanes)[0])]
    adapter.actions = list(vehicle.last_current_action)
    adapter.heading = -math.atan2(vehicle.last_heading_dir[1], vehicle.last_heading_dir[0])
    ego = SimpleNamespace(x=vehicle.position[0], y=-vehicle.position[1], heading=-vehicle.heading_theta, speed=vehicle.speed_km_h / 3.6)
    moving = [other for other in env.engine.get_objects().values() if other is not vehicle and hasattr(other, "velocity_km_h")]
    objects = [avastra.Object(index, "car", other.position[0], -other.position[1], -other.heading_theta, other.velocity_km_h[0] / 3.6,
                              -other.velocity_km_h[1] / 3.6, other.LENGTH, other.WIDTH, 1.5, 1.0)
               for index, other in enumerate(moving)]
    return adapter.observed(SimpleNamespace(ego=ego, objects=objects))


def stretch(lane):
    """A lane of MetaDrive as a stretch that does not end."""
    made = driver.Stretch(math.inf, 1.0, 0.0)
    if type(lane).__name__ == "CircularLane":
        made.radius, made.clockwise, made.angle = lane.radius, float(lane.direction), lane.length / lane.radius
    # `Path.at` needs a place for the checkpoint.
    made.end = 1e6
    return made


if __name__ == "__main__":
    main()
