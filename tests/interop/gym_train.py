"""Counted collisions of learners that others wrote, beside avastra's own: gym_train.py AVASTRA TRAININGS.

A study of avastra trains `ddqn` and `constant`, and plays chance, for as many episodes as come to some 20,000 steps (33 h of
driving). The others train for 20,000 steps on the same road against the same driving system, with the reward constants
of `avastra train`. The first training of each is judged in the same 60 episodes, the second in 60 others, and so on. What is printed
is counted collisions in 15 episodes, as in the paper's tables.

The hyperparameters of the others are their own defaults; `like ours` gives stable-baselines3's DQN what it has in common with the
preset `avastra`. RLlib's DQN (its new API stack) is double, dueling, with prioritised replay, by default.
"""

import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import ray
import torch
from ray.rllib.algorithms.dqn import DQNConfig
from ray.rllib.core.columns import Columns
from ray.tune import register_env
from sb3_contrib import MaskablePPO
from stable_baselines3 import DQN

import avastra
import avastra.gym

SPACE = Path("scenarios/avastra45.ava").resolve()
ADS_CONFIG = Path("scenarios/ads/faults/perception_flicker.yaml").resolve()
ROAD = "crossroad"
STEPS = 20_000
#: Mean steps of an episode of this road under random rows; only to choose how many episodes avastra's own agents get.
EPISODE_STEPS = 11.7
EVALUATION = {"episodes": 15, "seeds": 4}
STUDY = """
question: How do learners that others wrote compare?
space: {space}
ads_config: {ads_config}
roads: [{road}]
agents:
  - {{ name: ddqn, trainings: {trainings}, episodes: {episodes} }}
  - {{ name: constant, trainings: {trainings}, episodes: {episodes} }}
  - {{ name: random, repeats: 1 }}
baselines: [constant, random]
evaluation: {{ episodes: {evaluation[episodes]}, seeds: {evaluation[seeds]} }}
"""
LIKE_OURS = dict(learning_rate=5e-4, learning_starts=300, batch_size=64, gamma=0.3, train_freq=1, gradient_steps=1,
                 target_update_interval=200, exploration_fraction=0.5, exploration_final_eps=0.05, buffer_size=20_000,
                 policy_kwargs=dict(net_arch=[64, 64]))


def study(program, trainings, folder):
    """What a study of avastra's own agents kept: its database."""
    file, out = Path(folder) / "study.yaml", Path(folder) / "study"
    file.write_text(STUDY.format(space=SPACE, ads_config=ADS_CONFIG, road=ROAD, trainings=trainings,
                                 episodes=round(STEPS / EPISODE_STEPS), evaluation=EVALUATION))
    subprocess.run([program, "study", str(file), "--jobs", "1", "--out", str(out), "--quiet"], check=True)
    return sqlite3.connect(out / "study.db")


def ours(database):
    """Name, number of the training, counted collisions in all judged episodes, and hours of training."""
    return database.execute(
        """SELECT agent, number, (SELECT coalesce(sum(counted), 0) FROM collision WHERE collision.cell = cell.cell),
                  (SELECT coalesce(sum(simulated_s), 0) / 3600 FROM trained WHERE trained.cell = cell.cell)
           FROM cell ORDER BY cell""").fetchall()


def judged_seeds(database, training):
    """The seeds of the episodes in which the nth training of each agent is judged, from 0."""
    rows = database.execute(
        """SELECT seed, evaluated.number FROM evaluated JOIN cell USING (cell)
           WHERE agent = 'ddqn' AND cell.number = ? ORDER BY episode""", [training])
    seeds = [avastra.episode_seed(int(seed), number) for seed, number in rows]
    expected = EVALUATION["episodes"] * EVALUATION["seeds"]
    if len(seeds) != expected:
        sys.exit(f"training {training + 1} was judged in {len(seeds)} episodes instead of {expected}")
    return seeds


def made():
    return avastra.gym.Env(SPACE, ROAD, ads_config=ADS_CONFIG)


def judged(choose, seeds):
    """Counted collisions in the judged episodes, and the share of steps lost to illegal rows; `choose` gets an observation and
    a mask."""
    env, counted, lost, steps = made(), 0, 0, 0
    for seed in seeds:
        observation, info = env.reset(seed=seed)
        while "ended" not in info:
            observation, _, _, _, info = env.step(choose(observation, info["action_mask"]))
            lost += info["refused"] is not None
            steps += 1
        counted += info["ended"]["counted"]
    return counted, lost / steps


def by_baselines(seed, settings):
    """DQN of stable-baselines3."""
    model = DQN("MlpPolicy", made(), seed=seed, device="cpu", **settings).learn(STEPS)
    return lambda seen, mask: int(model.predict(seen, deterministic=True)[0])


def by_contrib(seed):
    """MaskablePPO of sb3-contrib, which knows what is legal: its most likely row, and one drawn as it learned to."""
    model = MaskablePPO("MlpPolicy", made(), seed=seed, device="cpu").learn(STEPS)
    return [lambda seen, mask, is_greedy=is_greedy: int(model.predict(seen, action_masks=mask, deterministic=is_greedy)[0])
            for is_greedy in (True, False)]


def by_rllib(seed):
    """DQN of RLlib, all in this process."""
    register_env("avastra", lambda _: made())
    config = DQNConfig().environment("avastra").env_runners(num_env_runners=0).debugging(seed=seed)
    algorithm, steps = config.build_algo(), 0
    while steps < STEPS:
        steps = algorithm.train()["env_runners"]["num_env_steps_sampled_lifetime"]
    module = algorithm.get_module()

    def choose(seen, mask):
        with torch.no_grad():
            return int(module.forward_inference({Columns.OBS: torch.as_tensor(seen)[None]})[Columns.ACTIONS][0])

    return choose


LEARNERS = {
    "DQN (stable-baselines3)": lambda seed: [by_baselines(seed, {})],
    "DQN (stable-baselines3), like ours": lambda seed: [by_baselines(seed, LIKE_OURS)],
    "MaskablePPO (sb3-contrib)": by_contrib,
    "DQN (RLlib)": lambda seed: [by_rllib(seed)],
}


def others(seed, seeds, learners=LEARNERS):
    """Name, counted collisions, share of lost steps, and processor seconds of training of each learner."""
    for name, learned in learners.items():
        begun = time.process_time()
        policies = learned(seed)
        took_s = time.process_time() - begun
        for policy, how in zip(policies, ("", ", drawn")):
            torch.manual_seed(seed)
            yield name + how, *judged(policy, seeds), took_s


def main(program, trainings):
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        database = study(program, trainings, folder)
        seeds = [judged_seeds(database, number) for number in range(trainings)]
        for name, number, counted, hours in ours(database):
            print(f"{name} (avastra), training {number + 1}: {counted} counted in {len(seeds[number])} episodes, {hours:.1f} h",
                  flush=True)
            found.setdefault(f"{name} (avastra)", []).append(counted)
    for number, own in enumerate(seeds, start=1):
        for name, counted, lost, took_s in others(number, own):
            print(f"{name}, training {number}: {counted} counted in {len(own)} episodes, {lost:.0%} of its steps lost to "
                  f"illegal rows; trained in {took_s:.0f} s of a processor", flush=True)
            found.setdefault(name, []).append(counted)
    print("\nCounted collisions in 15 episodes: mean, and each training.")
    rates = {name: [counted * 15 / len(seeds[0]) for counted in counts] for name, counts in found.items()}
    for name, values in sorted(rates.items(), key=lambda item: -statistics.mean(item[1])):
        print(f"{name:38} {statistics.mean(values):5.1f}   {' '.join(f'{value:.1f}' for value in values)}")


if __name__ == "__main__":
    # More threads wait for each other longer than such small networks take.
    torch.set_num_threads(1)
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    main(sys.argv[1], int(sys.argv[2]))
