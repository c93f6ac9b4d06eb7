"""Steps per second of MetaDrive with its default traffic and LiDAR, without a picture: metadrive_speed.py SECONDS. Prints the rates by the
clock and by the processor as JSON in the last line. A step is 0.1 s of driving; episodes end and begin within the time, as in gym_speed.py."""

import json
import sys
import time

from metadrive import MetaDriveEnv

seconds = float(sys.argv[1])
env = MetaDriveEnv({"use_render": False, "environment_num": 100})
env.reset()
env.action_space.seed(1)
steps, wall, processor = 0, time.perf_counter(), time.process_time()
while time.perf_counter() - wall < seconds:
    _, _, has_ended, _ = env.step(env.action_space.sample())
    steps += 1
    if has_ended:
        env.reset()
rates = steps / (time.perf_counter() - wall), steps / (time.process_time() - processor)
env.close()
print(json.dumps(rates))
