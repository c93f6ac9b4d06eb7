"""Trains DQN of Stable-Baselines3 to make a driving system crash. Its policy and its last crash become files of the language.

    pip install stable-baselines3
    python python/examples/train_sb3.py scenarios/avastra45.ava corner scenarios/ads/faults/planning_never_yields.yaml 20000 learned
"""

import sys

import stable_baselines3
from stable_baselines3 import DQN

import avastra
from avastra.sb3 import VecEnv

path, road, profile, steps, name = sys.argv[1:]
env = VecEnv(8, path, road, ads_config=profile)
env.seed(1)
model = DQN("MlpPolicy", env, learning_starts=1000, learning_rate=5e-4, gamma=0.3, exploration_fraction=0.5, train_freq=1,
            gradient_steps=4, seed=1)
model.learn(int(steps))

# The network as avastra plays it: linear layers with ReLU between them.
network = [layer for layer in model.q_net.q_net if hasattr(layer, "weight")]
layers = [(layer.weight.detach().cpu().numpy(), layer.bias.detach().cpu().numpy()) for layer in network]
episodes = env.worlds[0]
episodes.save_policy(f"{name}_policy.ava", layers, by=f"stable-baselines3 {stable_baselines3.__version__}, DQN", seed=1,
                     episodes=int(steps) // 20, masked=False)

# Twenty episodes with the learned network; the last one that crashes is kept.
counted, kept = 0, None
for number in range(20):
    seed = avastra.episode_seed(1, number)
    observation, _ = episodes.reset(seed)
    end = None
    while end is None:
        observation, _, end, info = episodes.step(int(model.predict(observation, deterministic=True)[0]))
    counted += info["ended"]["counted"]
    print(seed, info["ended"]["trace"])
    if info["ended"]["counted"]:
        kept = seed, info["ended"]["steps"]
print(f"{counted} counted collisions in 20 episodes")
if kept:
    episodes.evaluate(*kept)
    episodes.save(f"{name}_crash.ava", repeat=20)
