"""Gymnasium environments of spaces: a learner chooses what happens around the ego vehicle, to make its driving system crash.

    import gymnasium
    import avastra.gym

    env = gymnasium.make("avastra/Space-v0", space="scenarios/avastra45.ava", road="crossroad")
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample(info["action_mask"].astype("int8")))

Needs `gymnasium>=1.2.2,<2`: `pip install './python[gym]'`.

- An **action** is a row of the action table. An illegal one loses its step: nothing happens in it but driving, and
  `info["refused"]` says which rule forbids it. So learners without masks work, and learn what illegal rows are worth:
  as much as doing nothing. `info["action_mask"]` says which rows are legal next, `action_masks()` says it to
  sb3-contrib, and with `mask="observation"` the observation is a dict with it.
- A **step** drives for the space's observation period. A **collision** does not end an episode. Arriving at the goal
  terminates it; its limit of steps, standing still, leaving the map or a failure of an external driving system truncates it.
- The **reward** is by default `judged`: the constants of `avastra train`, paid at the collision's own step, and only if it
  counts.
- A **seed** that `reset` gets is the seed of that episode: the same as any other of avastra's. Without one, it is drawn.
  `info["seed"]` has it.
- After the last step, `info["ended"]` is the judged episode (`avastra._native.Ended`).
- An external driving system that **fails as an episode begins** leaves nothing to step: `reset` raises `EpisodeError`, and so
  does the step that begins an episode in the mode `SAME_STEP`. In `NEXT_STEP` that world is truncated at once, with reward 0
  and its `ended`.
"""

import copy
import functools
import operator
import os
from typing import Any, Callable, Dict, List, Literal, Mapping, Optional, Sequence, Tuple, Union

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from .driver import Driver
from .engine import EpisodeError, Episodes, Space, step_all, variables
from .serve import Listener, listen

__all__ = ["Env", "VectorEnv"]

#: Stands for a bound that avastra does not promise: environments should be bounded, and nothing comes near it.
FAR = 1e9

#: What a learner sees: the variables, or with `mask="observation"` a dict of `observation` and `action_mask`.
Observation = Union["np.ndarray[Any, np.dtype[np.float32]]", Dict[str, "np.ndarray[Any, Any]"]]

_Seen = Literal["raw", "scaled"]
_Reward = Literal["space", "judged"]


class Env(gymnasium.Env[Observation, np.int64]):
    """One episode after another on one road.

    Args:
        space: A path, or a compiled `Space`.
        road: The name of one of its roads; without one the first.
        observation: `scaled`, about 1 in size, or `raw`, in SI units: as in `avastra.Episodes`, which says the shapes.
        reward: `judged`, or `space` for the reward that the space declares: as in `avastra.Episodes`.
        mask: `info`, or `observation` for a dict of `observation` and `action_mask`.
        **conditions: Those of `avastra.Episodes`: `ads`, `ads_config`, `ads_cmd`, `ambient`, `traffic`, `with_rules`,
            `without_rules`. Here `ads` may also be a class derived from `avastra.Driver`, which then drives in this process.

    Raises:
        SpaceError: The space has mistakes; its text is what `avastra check` prints.
        ValueError: There is no such road, driving system, traffic, rule or mask.
    """

    metadata = {"render_modes": []}

    def __init__(self, space: "Union[str, os.PathLike[str], Space]", road: Optional[str] = None, *,
                 observation: _Seen = "scaled", reward: _Reward = "judged", mask: str = "info", **conditions: Any) -> None:
        compiled = _compiled(space)
        self.episodes = _episodes(compiled, road, observation, reward, conditions)
        self.rows = compiled.rows
        self.render_mode = None
        self._is_masked = _is_masked(mask)
        self.action_space = spaces.Discrete(self.episodes.rows)
        self.observation_space = _observation_space(self.episodes, observation, self._is_masked)
        self._legal = np.zeros(self.episodes.rows, dtype=bool)

    def reset(self, *, seed: Optional[int] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: That of the episode, which decides everything but the rows; without one it is drawn.
            options: There are none.

        Returns:
            The first observation, and an info with `seed` and `action_mask`, shape (rows,), of the first step.

        Raises:
            EpisodeError: An external driving system failed as the episode began.
            ValueError: There is an option.
        """
        if options:
            raise ValueError(f"no option `{next(iter(options))}`: `reset` takes `seed` alone")
        super().reset(seed=seed)
        seed = draw_seed(self.np_random) if seed is None else whole(seed, "seed")
        observation, self._legal = self.episodes.reset(seed)
        return self._shown(observation), {"seed": seed, "action_mask": self._legal.copy()}

    def step(self, action: "Union[int, np.integer[Any]]") -> Tuple[Observation, float, bool, bool, Dict[str, Any]]:
        """Carries a row out and drives for one observation period.

        Args:
            action: A row of the table, 0 to rows - 1. An illegal one loses the step: nothing happens in it but driving.

        Returns:
            The next observation; the reward of the step; whether the ego vehicle arrived, which terminates the episode;
            whether it was truncated (limit of steps, standing still, off the map, failure of an external driving system);
            and an info (`avastra._native.Info`):

            - `action_mask`: the rows that are legal next, shape (rows,)
            - `row`: the row that was carried out, -1 without one; `refused`: why the chosen one was not, or `None`
            - `values`: what it drew, by name (of `VectorEnv` one dict a world); `measures`: how near the step came to a collision
            - `time_s`: when the step began, s
            - `proc`: the largest collision probability of the step, in [0, 1]
            - `collisions`: contacts that began in the step; with `reward="judged"`, `counted`: those that count
            - `seed`: that of the episode
            - `ended`, after the last step alone: the judged episode (`avastra._native.Ended`)

        Raises:
            EpisodeError: There is no such row, or the episode has ended: `reset` begins the next one.
            TypeError: The action is no whole number.
        """
        observation, reward, end, info = self.episodes.step(whole(action, "action"))
        # What the caller does with its info is not done to what is legal.
        self._legal = info["action_mask"].copy()
        terminated = _is_terminal(end)
        return self._shown(observation), reward, terminated, end is not None and not terminated, dict(info)

    def action_masks(self) -> np.ndarray:
        """Which rows are legal now, shape (rows,). If none is, any row passes."""
        return self._legal.copy()

    def close(self) -> None:
        """Ends the episode and the processes of a driving system of your own; `reset` starts it again."""
        self.episodes.close()
        super().close()

    def _shown(self, observation: "np.ndarray[Any, np.dtype[np.float32]]") -> Observation:
        return _with_mask(observation, self._legal) if self._is_masked else observation


class VectorEnv(gymnasium.vector.VectorEnv[Observation, "np.ndarray[Any, Any]", "np.ndarray[Any, Any]"]):
    """Many episodes at once, stepped on threads of Rust without Python's lock.

    World i with the seed s is `Env` with the seed s + i: the same observations and rewards, whatever the number of threads.

    Args:
        num_envs: How many worlds, at least 1.
        space, observation, reward, mask, **conditions: As for `Env`.
        road: As for `Env`, or several, which the worlds take in turn.
        threads: How many; without it one for each processor.
        autoreset_mode: `NEXT_STEP` (a world that has ended begins anew in the next step, whose action is ignored),
            `SAME_STEP` (at once; the last observation and info are `final_obs` and `final_info`) or `DISABLED` (`reset`
            with `options={"reset_mask": ...}` begins them).

    Raises:
        SpaceError, ValueError: As for `Env`.
    """

    def __init__(self, num_envs: int, space: "Union[str, os.PathLike[str], Space]",
                 road: Union[str, Sequence[str], None] = None, *, observation: _Seen = "scaled", reward: _Reward = "judged",
                 mask: str = "info", threads: Optional[int] = None,
                 autoreset_mode: Union[str, AutoresetMode] = AutoresetMode.NEXT_STEP, **conditions: Any) -> None:
        compiled = _compiled(space)
        roads = [road] if road is None or isinstance(road, str) else list(road)
        if num_envs < 1 or not roads:
            raise ValueError("a vector environment has at least one world and one road")
        first = [_episodes(compiled, name, observation, reward, conditions) for name in roads[:num_envs]]
        self.worlds: List[Episodes] = [first[i % len(first)].sibling() for i in range(num_envs)]
        self.num_envs = num_envs
        self.rows = compiled.rows
        self.render_mode = None
        self.threads = threads or os.cpu_count() or 1
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self._is_masked = _is_masked(mask)
        self.single_action_space = spaces.Discrete(first[0].rows)
        self.single_observation_space = _observation_space(first[0], observation, self._is_masked)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        #: What the seeds of each world's next episodes are drawn with, once it has drawn one.
        self._generators: Dict[int, np.random.Generator] = {}
        self._observations = np.zeros((num_envs, first[0].observation_len), dtype=np.float32)
        self._legal = np.zeros((num_envs, first[0].rows), dtype=bool)
        self._has_ended = np.zeros(num_envs, dtype=bool)

    def reset(self, *, seed: Union[int, Sequence[Optional[int]], None] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Observation, Dict[str, Any]]:
        """Begins an episode in every world.

        Args:
            seed: That of the first world, of which the others have the next ones; or one for each. Without, it is drawn.
            options: `reset_mask`, shape (worlds,): in which worlds alone.

        Returns:
            The observations of all worlds, and the infos of those that begin, as arrays by key (`Env.reset`).

        Raises:
            EpisodeError: An external driving system failed as an episode began.
            ValueError: Seeds or mask do not fit the number of worlds, or there is another option.
        """
        which = np.ones(self.num_envs, dtype=bool)
        for option in options or {}:
            if option != "reset_mask":
                raise ValueError(f"no option `{option}`: `reset` takes `seed` and the option `reset_mask`")
        if options and "reset_mask" in options:
            which = np.asarray(options["reset_mask"], dtype=bool)
            if which.shape != (self.num_envs,) or not which.any():
                raise ValueError(f"`reset_mask` has {self.num_envs} values, at least one of them true")
        if seed is None or isinstance(seed, (int, np.integer)):
            seed = [None if seed is None else whole(seed, "seed") + world for world in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"{self.num_envs} worlds need as many seeds")
        infos = self._begin(np.flatnonzero(which), seed, {})
        self._add_masks(infos)
        return self._shown(), infos

    def step(self, actions: Any) -> Tuple[Observation, Any, Any, Any, Dict[str, Any]]:
        """Drives one step in every world; those whose episodes have ended begin anew as the mode says.

        Args:
            actions: A row for each world, shape (worlds,).

        Returns:
            Observations, rewards, terminations and truncations, each with one entry a world, and the infos as arrays by key
            (`Env.step`).

        Raises:
            EpisodeError: There is no such row, or in the mode `DISABLED` an episode has ended. No world has moved then, and
                the next episodes are those that they would have been. In `SAME_STEP` also if an external driving system
                fails as the next episode begins: all worlds have moved then.
            TypeError: An action is no whole number. No world has moved then.
        """
        begin: List[int] = np.flatnonzero(self._has_ended).tolist()
        if self.autoreset_mode == AutoresetMode.DISABLED and begin:
            raise EpisodeError(f"the episodes of worlds {begin} have ended: reset them with `reset_mask`")
        drawn, generators = self._draw(begin)
        seeds = [drawn.get(world) for world in range(self.num_envs)]
        rows = [whole(action, "action") for action in actions]
        observations, legal, rewards, ends, found = step_all(self.worlds, rows, seeds, self.threads)
        self._generators.update(generators)
        self._observations, self._legal = observations, legal
        self._has_ended = np.array([end is not None for end in ends])
        terminated = np.array([_is_terminal(end) for end in ends])
        truncated = self._has_ended & ~terminated
        at_once = self._has_ended & (self.autoreset_mode == AutoresetMode.SAME_STEP)
        infos: Dict[str, Any] = {}
        for world in np.flatnonzero(~at_once).tolist():
            infos = self._add_step(infos, found[world], world)
        if at_once.any():
            infos = self._begin_at_once(infos, found)
        self._add_masks(infos)
        return self._shown(), rewards, terminated, truncated, infos

    def action_masks(self) -> np.ndarray:
        """Which rows are legal now, shape (worlds, rows). If none is, any row passes."""
        return self._legal.copy()

    def close_extras(self, **_: Any) -> None:
        """Ends the episodes and the processes of a driving system of your own."""
        for world in self.worlds:
            world.close()

    def _begin(self, worlds: np.ndarray, seeds: Sequence[Optional[int]], infos: Dict[str, Any]) -> Dict[str, Any]:
        """Begins the next episodes of some worlds and adds their infos. A seed also begins a world's own sequence of seeds."""
        given = {world: whole(seed, "seed") for world, seed in enumerate(seeds) if seed is not None}
        own, generators = self._draw([world for world in worlds.tolist() if world not in given])
        generators.update({world: seeding.np_random(given[world])[0] for world in worlds.tolist() if world in given})
        drawn = [given[world] if world in given else own[world] for world in worlds.tolist()]
        some = [self.worlds[world] for world in worlds]
        observations, legal, _, ends, found = step_all(some, [None] * len(some), drawn, self.threads)
        self._generators.update(generators)
        self._observations[worlds], self._legal[worlds] = observations, legal
        self._has_ended[worlds] = [end is not None for end in ends]
        for world, seed, end in zip(worlds, drawn, ends):
            if end is not None:
                raise EpisodeError(f"world {world}: the episode of seed {seed} ended as it began: `{end}`")
        for world, info in zip(worlds, found):
            infos = self._add_info(infos, _with_whole_seed(info), int(world))
        return infos

    def _add_step(self, infos: Dict[str, Any], info: Mapping[str, Any], world: int) -> Dict[str, Any]:
        # Gymnasium would make an array of each value, and a name may be a number of one row and a word of another.
        told = _with_whole_seed(info)
        values = told.pop("values", None)
        infos = self._add_info(infos, told, world)
        if values is not None:
            infos.setdefault("values", np.full(self.num_envs, None, dtype=object))[world] = values
            infos.setdefault("_values", np.zeros(self.num_envs, dtype=bool))[world] = True
        return infos

    def _begin_at_once(self, infos: Dict[str, Any], found: Sequence[Mapping[str, Any]]) -> Dict[str, Any]:
        last = self._shown()
        ended = np.flatnonzero(self._has_ended)
        for world in ended.tolist():
            own = {key: value[world] for key, value in last.items()} if isinstance(last, dict) else last[world]
            final = {**_with_whole_seed(found[world]), "action_mask": self._legal[world].copy()}
            # `ended` has those of all steps; see `_add_step`.
            final.pop("values", None)
            kept = {"final_obs": own, "final_info": final}
            infos = self._add_info(infos, kept, int(world))
        return self._begin(ended, [None] * self.num_envs, infos)

    def _add_masks(self, infos: Dict[str, Any]) -> None:
        infos["action_mask"] = self._legal.copy()
        infos["_action_mask"] = np.ones(self.num_envs, dtype=bool)

    def _draw(self, worlds: Sequence[int]) -> Tuple[Dict[int, int], Dict[int, np.random.Generator]]:
        """The seeds of the next episodes of some worlds, and the generators as they are once these have begun."""
        known = self._generators
        generators = {world: copy.deepcopy(known[world]) if world in known else seeding.np_random(None)[0] for world in worlds}
        return {world: draw_seed(generator) for world, generator in generators.items()}, generators

    def _shown(self) -> Observation:
        return _with_mask(self._observations.copy(), self._legal) if self._is_masked else self._observations.copy()


def _compiled(space: "Union[str, os.PathLike[str], Space]") -> Space:
    return space if isinstance(space, Space) else Space(space)


def _episodes(space: Space, road: Optional[str], observation: _Seen, reward: _Reward,
              conditions: Dict[str, Any]) -> Episodes:
    ads = conditions.get("ads")
    if isinstance(ads, Driver):
        raise TypeError("`ads` is the class of a driver, not an object of it: each episode makes its own")
    if callable(ads):
        conditions = {name: value for name, value in conditions.items() if name != "ads"}
        conditions["ads_cmd"] = _listener(ads).address
    return Episodes(space, road or space.roads[0], observation=observation, reward=reward, **conditions)


@functools.lru_cache(maxsize=None)
def _listener(driver: Callable[[], Driver]) -> Listener:
    # One for each class, as long as this process lives: environments begin anew after `close`.
    return listen(driver)


def _mode(mode: Union[str, AutoresetMode]) -> AutoresetMode:
    """A mode by its name here and in the documents of Gymnasium, or by its value."""
    return AutoresetMode[mode] if isinstance(mode, str) and mode in AutoresetMode.__members__ else AutoresetMode(mode)


def _is_masked(mask: str) -> bool:
    if mask not in ("info", "observation"):
        raise ValueError(f"no mask `{mask}`: `info` or `observation`")
    return mask == "observation"


def _observation_space(episodes: Episodes, observation: str, is_masked: bool) -> "spaces.Space[Any]":
    low = np.full(episodes.observation_len, -FAR, dtype=np.float32)
    high = -low
    if observation == "raw":
        for index, variable in enumerate(variables()):
            low[index] = -FAR if variable.low is None else variable.low
            high[index] = FAR if variable.high is None else variable.high
    box = spaces.Box(low, high, dtype=np.float32)
    if not is_masked:
        return box
    return spaces.Dict({"observation": box, "action_mask": spaces.Box(0, 1, (episodes.rows,), dtype=np.int8)})


def _with_mask(observation: np.ndarray, legal: np.ndarray) -> Dict[str, np.ndarray]:
    return {"observation": observation, "action_mask": legal.astype(np.int8)}


def _with_whole_seed(info: Mapping[str, Any]) -> Dict[str, Any]:
    # Gymnasium gathers Python's integers as int64, which half of the seeds of a run exceed.
    return {**info, "seed": np.uint64(info["seed"])}


def whole(value: Any, what: str) -> int:
    """A whole number as it is. `int` would cut a share off, and would read a text."""
    if not isinstance(value, (bool, np.bool_)):
        try:
            return operator.index(value)
        except TypeError:
            pass
    raise TypeError(f"{what} must be a whole number, and is {value!r}")


def _is_terminal(end: Optional[str]) -> bool:
    return end == "arrived"


def draw_seed(generator: np.random.Generator) -> int:
    return int(generator.integers(2**63))


gymnasium.register("avastra/Space-v0", entry_point="avastra.gym:Env", vector_entry_point="avastra.gym:VectorEnv")
