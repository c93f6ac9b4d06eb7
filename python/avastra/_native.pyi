"""The engine of avastra, built from `python/native` by maturin. Use its names from `avastra`."""

import os
from typing import Dict, List, Literal, Mapping, Optional, Sequence, Tuple, TypedDict, Union

import numpy as np
from numpy.typing import NDArray

_Path = Union[str, "os.PathLike[str]"]

#: Version of the simulated world: episodes are alike only in the same one.
ENGINE: str

class Diagnostic(TypedDict):
    code: str
    severity: Literal["error", "warning", "note"]
    message: str
    help: Optional[str]
    file: Optional[str]
    #: From 1; columns count characters. `None` if the diagnostic has no place.
    line: Optional[int]
    column: Optional[int]
    #: As `avastra check` prints it.
    text: str

class SpaceError(ValueError):
    """A space cannot be used. Its text has every diagnostic as `avastra check` prints it."""

    #: Empty if the file cannot be read or is no space.
    diagnostics: List[Diagnostic]

class EpisodeError(RuntimeError):
    """An episode cannot be stepped so: it has ended or not begun, or there is no such row. Or it ended as it began."""

class Variable:
    """A variable of a raw observation."""

    #: In the spelling of the language.
    name: str
    #: Name of its column in `run.db`.
    column: str
    #: Empty for plain numbers, words and rad/s.
    unit: str
    #: Bounds that it cannot pass, if there are any.
    low: Optional[float]
    high: Optional[float]
    #: The words that its values stand for; empty for a quantity.
    words: List[Tuple[str, float]]

def main(words: List[str]) -> int: ...
def variables() -> List[Variable]:
    """The variables of a raw observation, in its order: the paper's 19, then 25 of our own."""

class Space:
    """A space that was compiled: the rows of its action table, and its roads."""

    def __init__(self, path: _Path) -> None: ...
    path: os.PathLike[str]
    #: Labels of the rows, by their numbers: `drive_ahead(lane: Left, mode: Near, then: Change)`.
    rows: List[str]
    roads: List[str]
    #: Names of the space's own states.
    states: List[str]
    #: Observation period: how long a step drives, s.
    step_s: float
    #: Most steps of an episode.
    step_limit: int
    #: What the space means: equal for two files that mean the same.
    digest: str
    #: Warnings and remarks.
    diagnostics: List[Diagnostic]

    @staticmethod
    def from_text(text: str, path: _Path = "space.ava") -> Space:
        """The space in a text, as if it were the file at `path`, from where `use` finds other files. Nothing is written there.

        Raises `SpaceError` as `Space` does.
        """

    def draws(self, row: int, road: Optional[str] = None) -> List[Draw]:
        """What a row draws on a road (without one, on the first), and within which bounds by the rules that are always in force.
        Rules that ask about the moment may narrow them further. Empty if the row is masked there, or draws nothing.

        Raises `IndexError` if there is no such row, `ValueError` if there is no such road.
        """

class Draw:
    """A value that a row draws."""

    name: str
    #: SI; empty without a dimension and for a choice.
    unit: str
    #: Ends of a number's range, SI; `None` for a choice, and where no rule bounds it.
    low: Optional[float]
    high: Optional[float]
    #: The values of a choice.
    values: List[str]

#: A value of a draw: a number in SI, a truth value, or the word of a choice.
Drawn = Union[float, bool, str]

#: A step of `Episodes.evaluate`: a row, a row and values for some of what it draws, what a result says of a step, or `None`.
Chosen = Union[int, Tuple[int, Mapping[str, Drawn]], Carried, None]

class Measures(TypedDict):
    """How near the ego vehicle came to others. Those that it had touched before do not count."""

    #: Least distance between the outlines, m; `None` if nobody was there.
    distance_m: Optional[float]
    #: Least time to collision, s; `None` if none was expected within 8 s.
    ttc_s: Optional[float]
    #: Least time headway, s.
    thw_s: Optional[float]
    #: Greatest deceleration rate to avoid a crash, m/s².
    drac_mps2: float
    #: Greatest deceleration that would stop the ego vehicle before an expected contact, m/s².
    required_mps2: float
    #: Time in which both distances to a road user were unsafe by RSS, s.
    rss_unsafe_s: float

class Breach(TypedDict):
    """A requirement that was not kept."""

    requirement: str
    #: When it became a breach, s.
    time_s: float
    until_s: float
    #: Its smallest margin, SI; `None` for a requirement without one.
    margin: Optional[float]
    #: The number of the road user that it is about.
    npc: Optional[int]

class Carried(TypedDict):
    """What was carried out in a step."""

    #: -1 without one.
    row: int
    #: Why the chosen row was not carried out; `None` if it was.
    refused: Optional[str]
    #: What the row drew, by name: numbers in SI, words of choices.
    values: Dict[str, Drawn]

class Trajectories(TypedDict):
    """Where everybody was, every 0.1 s. The columns are time (s), x (m), y (m), heading (rad) and speed (m/s)."""

    #: Rear axle of the ego vehicle, shape (moments, 5).
    ego: NDArray[np.float64]
    #: Centre of each other road user, by its number, shape (its moments, 5).
    npc: Dict[int, NDArray[np.float64]]

class Finding(TypedDict):
    """A collision of the ego vehicle, judged."""

    step: int
    time_s: float
    #: Whether the space's verdict counts it.
    counted: bool
    #: Whether a careful driver avoids it, only one without any delay does, or none.
    avoidability: Literal["avoidable", "beyond_reference", "unavoidable"]
    #: Who had priority.
    priority: Literal["ego", "other", "none"]
    body: str
    own_body: Optional[str]
    verb: str
    #: Side of the ego vehicle that was hit.
    side: str
    approach: str
    ego_speed_mps: float
    closing_speed_mps: float
    #: Change of the ego vehicle's speed.
    delta_v_mps: float

class Ended(TypedDict):
    """An episode that has ended, judged."""

    #: `arrived`, `stalled`, `blocked`, `astray`, `left_the_map`, `limit`, or the failure of an external driving system.
    end: str
    duration_s: float
    distance_m: float
    red_runs: int
    #: Digest of every bit of the world after every tick. Equal to that of `avastra run` for the same rows, but for agents that
    #: also choose the values of a row (`space-filling`, searches) and policies with an observation period of their own.
    trace: str
    #: Number of counted collisions.
    counted: int
    findings: List[Finding]
    #: By rising time.
    breaches: List[Breach]
    #: Smallest margin of each requirement in force, SI; `None` of one that was never asked for, or that has none.
    margins: Dict[str, Optional[float]]
    measures: Measures
    #: What was carried out, one entry for each step. `Episodes.evaluate` takes this list, too.
    steps: List[Carried]

class Evaluated(Ended, total=False):
    """A whole episode that was played."""

    seed: int
    #: Only with `trajectory=True`.
    trajectory: Trajectories

class Info(TypedDict, total=False):
    seed: int
    #: Rows that are legal next, shape (rows,). Not in the dicts of `step_all`, which returns them as one array.
    action_mask: NDArray[np.bool_]
    #: When the step began, s.
    time_s: float
    #: Largest collision probability of the step, in [0, 1].
    proc: float
    #: The row that was carried out; -1 without one.
    row: int
    #: Why the chosen row was not carried out; `None` if it was.
    refused: Optional[str]
    #: What it drew, by name: numbers in SI, words of choices.
    values: Dict[str, Drawn]
    #: How near the step came to a collision.
    measures: Measures
    #: Contacts of the ego vehicle that began in the step.
    collisions: int
    #: Those of them that count; only with `reward="judged"`.
    counted: int
    #: Only after the last step.
    ended: Ended

class Episodes:
    """Episodes of a space on one road against one driving system, one at a time.

    The conditions are those of `avastra run`: `ads` is a name, `ads_config` a profile, `ads_cmd` the command of a driving
    system of your own, `ambient` a number of vehicles of ambient traffic, `traffic` a name or a profile, `with_rules` and
    `without_rules` names of rules.

    `observation` is `raw` (the variables of `variables()`, SI units, shape (44,)) or `scaled` (the inputs that `avastra
    train` gives its network, about 1 in size, categories as one-hot, shape (36,)), each of `float32`.

    `reward` is `space` (the space's own, which knows that a collision happened but not whether it counts) or `judged` (Eq. 8 with
    the constants of `avastra train`, 20 for a collision that counts and 0 for one that does not, paid at the collision's own
    step). Judging plays the episode again with careful drivers, so a step with a collision takes as long as a whole episode or
    two.

    Steps run without Python's lock. Calls of two threads on the same object wait for each other.
    """

    def __init__(self, space: Space, road: str, *, ads: str = "modular", ads_config: Optional[_Path] = None,
                 ads_cmd: Optional[str] = None, ambient: int = 0, traffic: Optional[str] = None, with_rules: Sequence[str] = (),
                 without_rules: Sequence[str] = (), observation: Literal["raw", "scaled"] = "raw",
                 reward: Literal["space", "judged"] = "space") -> None: ...
    #: Length of an observation.
    observation_len: int
    #: Number of rows.
    rows: int

    def sibling(self) -> Episodes:
        """Other episodes under the same conditions, which share the road."""

    def reset(self, seed: int) -> Tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Begins the episode of a seed: an observation, and which rows are legal, shape (rows,).

        The seed decides everything but the rows. `episode_seed` gives those of a run. Raises `EpisodeError` with the end if an
        external driving system fails as the episode begins.
        """

    def step(self, row: Optional[int], values: Optional[Mapping[str, Drawn]] = None) -> Tuple[NDArray[np.float32], float, Optional[str], Info]:
        """Carries a row out and drives for one observation period (`Space.step_s`): observation, reward, how the episode
        ended (`None`: it goes on), and what else is to say.

        An illegal row loses the step: nothing happens in it but driving, and `refused` says which rule forbids it. `None`
        passes, and so does any row while none is legal. An episode goes on after a collision. Collisions are judged when
        it ends: `info["ended"]`. Raises `EpisodeError` if there is no such row.

        `values` gives some of what the row draws, by name. Each number is moved to the nearest legal one; what is not given is
        drawn. `Space.draws` says names and bounds. Raises `ValueError` or `TypeError` for a name or value that the row does not
        draw.
        """

    def evaluate(self, seed: int, steps: Sequence[Chosen] = (), *, trajectory: bool = False) -> Evaluated:
        """Plays the whole episode of a seed: one entry of `steps` in each step, and then nothing until it ends.

        This is for searches: nothing is compiled, and nobody asks what is legal. It is then the episode under way, so `save`
        writes it. To play several at once, give each thread a `sibling()`. Raises `ValueError` or `TypeError` for a row, a name or
        a value that there is not.
        """

    def save(self, path: _Path, *, repeat: int = 0) -> None:
        """Writes the episode so far as a scenario, as `avastra run` does: cut after its last counted collision or breach, with
        what was found as claims; or the whole of it if nothing was found. An existing file is replaced.

        With `repeat`, the file says how often each finding recurs in up to so many plays under other noise. Raises `ValueError`
        if the name does not end in `.ava`, if the space's file does not hold the space (write the text of `Space.from_text`
        first), or if the file cannot be written.
        """

    def save_policy(self, path: _Path, layers: Sequence[Tuple[NDArray[np.float32], NDArray[np.float32]]], *, by: str,
                    seed: int = 0, episodes: int = 0, masked: bool = True) -> None:
        """Writes a network that was trained elsewhere as a policy, which `avastra run --policy` plays. In each step, it carries out
        the row of the largest output.

        Args:
            path: Ends in `.ava`. An existing file is replaced.
            layers: Weights, shape (outputs, inputs), and biases, shape (outputs,), of each layer, as PyTorch's `Linear` holds
                them, with ReLU between them. The first has the scaled observation as inputs, shape (36,), the last one output
                for each row.
            by: Who trained it: the policy's origin says so.
            seed, episodes: Those of the training, for its origin.
            masked: Whether only legal rows are chosen. If not, an illegal choice loses its step.

        Raises:
            ValueError: The layers do not fit, or the file cannot be written.
        """

    def findings(self) -> List[Finding]:
        """The collisions of the episode so far, judged. A verdict does not change any more."""

    def snapshot(self) -> Snapshot:
        """This moment, to return to as often as wanted: the world, and what the driving system has in mind."""

    def restore(self, snapshot: Snapshot) -> Tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Returns to a moment, of this object or of a sibling: its observation, and which rows are legal. An episode that had
        ended then has ended again: `step` raises `EpisodeError`.
        """

    def close(self) -> None:
        """Ends the episode under way and, where a driving system of your own is under test, its processes that no episode
        uses; siblings share them. `reset` starts it again.
        """

class Snapshot:
    """A kept moment of an episode."""

def step_all(
    worlds: Sequence[Episodes], rows: Sequence[Optional[int]], seeds: Sequence[Optional[int]], threads: int
) -> Tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.float64], List[Optional[str]], List[Info]]:
    """Steps episodes with equal observations and tables, on threads of Rust without Python's lock. One whose entry in `seeds`
    is a number begins that episode instead, and may end as it begins. The result does not depend on the number of threads.

    If one of them cannot be stepped so, or is there twice, `EpisodeError` says which, and none was stepped.

    Returns observations, shape (worlds, observation_len); legal rows, shape (worlds, rows); rewards, shape (worlds,);
    ends and infos, one each.
    """

def recurs(recurred: int, replays: int) -> bool:
    """Whether a finding recurs that happened again in `recurred` of its `replays` under other noise: the 95 % interval of
    the share lies above one half. Every command and page decides so; the columns are `recurred` and `replays` of
    `collision`. Where the driving system is not deterministic, the share mixes its chance with the noise."""

def episode_seed(seed: int, number: int) -> int:
    """The seed of the nth episode of a run of a seed, from 0 and through its roads one after another."""

def read_table(file: _Path, table: str) -> Dict[str, NDArray[np.generic]]:
    """A table of `run.db`, by the names of its columns; see `avastra.read_run`."""
