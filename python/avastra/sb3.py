"""Spaces as a vectorised environment of Stable-Baselines3: many episodes at once, on threads of Rust.

    from sb3_contrib import MaskablePPO
    from avastra.sb3 import VecEnv

    env = VecEnv(16, "scenarios/avastra45.ava", "crossroad")
    MaskablePPO("MlpPolicy", env).learn(10_000)

Needs `stable-baselines3>=2.4,<3` and `gymnasium`. What a row, a step and a reward are, `avastra.gym` says.
"""

import functools
import os
from typing import Any, Dict, Iterable, List, Optional, Sequence, Tuple, Type, Union

import numpy as np
from stable_baselines3.common.vec_env import VecEnv as _VecEnv

from .engine import EpisodeError, Space, step_all
from .gym import Env, draw_seed, whole

__all__ = ["VecEnv"]


class VecEnv(_VecEnv):
    """Many worlds, each of which begins anew when its episode ends.

    World i with the seed s is `avastra.gym.Env` with the seed s + i, whatever the number of threads.

    Args:
        num_envs: How many worlds, at least 1.
        space: A path, or a compiled `Space`.
        road: The name of a road, or several, which the worlds take in turn.
        threads: How many; without it one for each processor.
        **settings: `observation`, `reward` and the conditions, as for `avastra.gym.Env`.

    An info has what `avastra.gym.Env.step` says. After the last step of an episode it also has `terminal_observation` and
    `TimeLimit.truncated`, as Stable-Baselines3 asks. `action_masks` is there for `MaskablePPO`.

    Raises:
        SpaceError, ValueError: As for `avastra.gym.Env`.
    """

    def __init__(self, num_envs: int, space: "Union[str, os.PathLike[str], Space]",
                 road: Union[str, Sequence[str], None] = None, *, threads: Optional[int] = None, **settings: Any) -> None:
        roads = [road] if road is None or isinstance(road, str) else list(road)
        if num_envs < 1 or not roads:
            raise ValueError("a vector environment has at least one world and one road")
        if settings.get("mask", "info") != "info":
            raise ValueError("masks are in the infos and in `action_masks`: leave `mask` out")
        compiled = space if isinstance(space, Space) else Space(space)
        first = [Env(compiled, name, **settings) for name in roads[:num_envs]]
        self._first = first
        self.worlds = [first[i % len(first)].episodes.sibling() for i in range(num_envs)]
        self.rows = compiled.rows
        self.threads = threads or os.cpu_count() or 1
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._legal = np.zeros((num_envs, first[0].episodes.rows), dtype=bool)
        self._actions: List[Any] = []
        super().__init__(num_envs, first[0].observation_space, first[0].action_space)

    def reset(self) -> np.ndarray:
        """Begins an episode in every world; with the seeds of `seed`, if that was called since the last one."""
        seeds = [draw_seed(self._generators[world]) if seed is None else seed for world, seed in enumerate(self._seeds)]
        self._generators = [np.random.default_rng(seed) for seed in seeds]
        observations, self.reset_infos = self._begin(range(self.num_envs), seeds)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = [whole(action, "action") for action in actions]

    def step_wait(self) -> Any:
        """Observations, rewards, whether episodes ended, and infos, one each."""
        none: List[Optional[int]] = [None] * self.num_envs
        observations, self._legal, rewards, ends, found = step_all(self.worlds, self._actions, none, self.threads)
        infos: List[Dict[str, Any]] = [{**info, "action_mask": mask} for info, mask in zip(found, self._legal.copy())]
        over = [world for world, end in enumerate(ends) if end is not None]
        for world in over:
            infos[world]["terminal_observation"] = observations[world].copy()
            infos[world]["TimeLimit.truncated"] = ends[world] != "arrived"
        if over:
            observations[over], begun = self._begin(over, [draw_seed(self._generators[world]) for world in over])
            for world, info in zip(over, begun):
                self.reset_infos[world] = info
        return observations, rewards.astype(np.float32), np.array([end is not None for end in ends]), infos

    def action_masks(self) -> np.ndarray:
        """Which rows are legal now, shape (worlds, rows)."""
        return self._legal.copy()

    def close(self) -> None:
        """Ends the episodes, and the processes of a driving system of your own."""
        for world in self.worlds:
            world.close()
        for env in self._first:
            env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> List[Any]:
        if attr_name == "action_masks":
            return [functools.partial(self._masks_of, world) for world in self._get_indices(indices)]
        if attr_name == "episodes":
            return [self.worlds[world] for world in self._get_indices(indices)]
        return [getattr(self._first[world % len(self._first)], attr_name) for world in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(f"worlds share their settings: make another VecEnv to set `{attr_name}`")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> List[Any]:
        if method_name == "action_masks":
            return [self._masks_of(world) for world in self._get_indices(indices)]
        raise AttributeError(f"a world has no method `{method_name}`")

    def env_is_wrapped(self, wrapper_class: Type[Any], indices: Any = None) -> List[bool]:
        return [False for _ in self._get_indices(indices)]

    def _masks_of(self, world: int) -> np.ndarray:
        return np.array(self._legal[world])

    def _begin(self, worlds: Iterable[int], seeds: Sequence[int]) -> "Tuple[np.ndarray, List[Dict[str, Any]]]":
        which = list(worlds)
        some = [self.worlds[world] for world in which]
        observations, legal, _, ends, found = step_all(some, [None] * len(some), seeds, self.threads)
        for world, seed, end in zip(which, seeds, ends):
            if end is not None:
                raise EpisodeError(f"world {world}: the episode of seed {seed} ended as it began: `{end}`")
        self._legal[which] = legal
        return observations, [{**info, "action_mask": mask} for info, mask in zip(found, legal)]
