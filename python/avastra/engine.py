"""The engine: spaces, episodes and what runs left behind. Its names are those of `avastra` itself."""

import copyreg
import os
from typing import Any, Dict, Tuple, Union

import numpy as np
from numpy.typing import NDArray

try:
    from ._native import (ENGINE, Draw, EpisodeError, Episodes, Snapshot, Space, SpaceError, Variable, episode_seed,
                          read_table, recurs, step_all, variables)
except ImportError as error:
    raise ImportError("the engine of avastra is not built: `pip install ./python` in its repository does it, "
                      "and needs Rust") from error

__all__ = [
    "ENGINE", "Draw", "EpisodeError", "Episodes", "Snapshot", "Space", "SpaceError", "Variable", "compile", "episode_seed",
    "read_run", "recurs", "step_all", "variables",
]

_Path = Union[str, "os.PathLike[str]"]

#: Tables of `run.db` that `read_run` reads.
TABLES = ("episode", "step", "collision", "breach", "margin", "failure", "held", "offer", "reason", "learning")


def _reduced(space: Space) -> Tuple[Any, ...]:
    return _compiled_again, (os.path.abspath(space.path), space.digest)


def _compiled_again(path: str, digest: str) -> Space:
    space = Space(path)
    if space.digest != digest:
        raise ValueError(f"`{path}` means something else here, or has changed, since the space was pickled")
    return space


# A space is its path and what it means: another process compiles it again.
copyreg.pickle(Space, _reduced)


def compile(path: _Path) -> Space:
    """The space in a file, checked with all that it uses.

    Raises `SpaceError` if it has mistakes; its text is what `avastra check` prints, and `diagnostics` has one dict for
    each: `code`, `severity`, `message`, `help`, `file`, `line`, `column`, `text`.
    """
    return Space(path)


def read_run(directory: _Path) -> "Dict[str, Dict[str, NDArray[np.generic]]]":
    """What a run or a training wrote: for each table of `TABLES` a dict of NumPy arrays of equal length, by the names of
    the columns of `run.db`.

    - `episode`, `step`, `collision`, `breach` (of requirements), `failure` (of a driving system of your own)
    - `margin`: the smallest margin of each requirement in an episode
    - `held`: what limited the ego vehicle's speed, and from when on
    - `offer`: how often a row was refused, with the number of its `reason`
    - `learning`: the episodes of a training

    Rows come by rising key: `episode["episode"]`, then `step["step"]` or `collision["number"]`. Names end in the unit;
    the state variables of `step` are those of `variables()`, by their `column`. Numbers are `float64` (NaN: none) and
    `int64` (-1: none), `seed` is `uint64`, texts are objects (`None`: none). Each value is copied once, out of the file,
    which is not changed. Raises `ValueError` if there is no such file, or another version of avastra wrote it.
    """
    file = os.path.join(os.fspath(directory), "run.db")
    return {table: read_table(file, table) for table in TABLES}
