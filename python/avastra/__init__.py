"""Find where a driving system crashes, with avastra.

Two halves. The engine compiles spaces and steps their episodes; it comes with `pip install ./python`, which needs Rust:

    import avastra

    space = avastra.compile("scenarios/avastra45.ava")
    episodes = avastra.Episodes(space, "crossroad")
    observation, mask = episodes.reset(seed=1)
    observation, reward, end, info = episodes.step(int(mask.argmax()))

`avastra.gym` makes Gymnasium environments of it. The other half puts a driving system written in Python under test, and needs
nothing but Python:

    class Cruise(avastra.Driver):
        answer = "acceleration"

        def step(self, step):
            return avastra.Acceleration(8.0 - step.ego.speed)

    avastra.serve(Cruise)

Then `avastra run SPACE --ads 'python3 cruise.py'`. docs/reference/protocol.md describes what is sent.
"""

from typing import TYPE_CHECKING, Any, List

from .driver import Driver
from .messages import (Acceleration, Answer, Conditions, Control, Crosswalk, Ego, Event, Goal, Init, Internal, Lane,
                       Map, Object, Pedals, ProtocolError, Reset, Route, RoutePoint, Signal, Start, Step, Trajectory,
                       TrajectoryPoint, Vehicle)
from .path import Beside, Path, Pose, wrap
from .serve import Listener, listen, serve
from .way import Way

if TYPE_CHECKING:
    # Under their own names: for a type checker this is what makes them names of this package.
    from .engine import ENGINE as ENGINE
    from .engine import Draw as Draw
    from .engine import EpisodeError as EpisodeError
    from .engine import Episodes as Episodes
    from .engine import Snapshot as Snapshot
    from .engine import Space as Space
    from .engine import SpaceError as SpaceError
    from .engine import Variable as Variable
    from .engine import compile as compile
    from .engine import episode_seed as episode_seed
    from .engine import read_run as read_run
    from .engine import recurs as recurs
    from .engine import step_all as step_all
    from .engine import variables as variables
    from .notebook import Run as Run
    from .notebook import Scenario as Scenario
    from .notebook import runs as runs

__version__ = "0.1.0"

_ENGINE = [
    "ENGINE", "Draw", "EpisodeError", "Episodes", "Snapshot", "Space", "SpaceError", "Variable", "compile", "episode_seed",
    "read_run", "recurs", "step_all", "variables",
]
_NOTEBOOK = ["Run", "Scenario", "runs"]

__all__ = [
    "Acceleration", "Answer", "Beside", "Conditions", "Control", "Crosswalk", "Driver", "Ego", "Event", "Goal", "Init",
    "Internal", "Lane", "Listener", "Map", "Object", "Path", "Pedals", "Pose", "ProtocolError", "Reset", "Route", "RoutePoint",
    "Signal", "Start", "Step", "Trajectory", "TrajectoryPoint", "Vehicle", "Way", "listen", "serve", "wrap",
]


# A type checker knows the names from above. With this function it would take any name for one of them.
if not TYPE_CHECKING:
    def __getattr__(name: str) -> Any:
        # Loaded when it is asked for: a driving system under test works without the engine.
        if name in _ENGINE:
            from . import engine
            return getattr(engine, name)
        if name in _NOTEBOOK:
            from . import notebook
            return getattr(notebook, name)
        raise AttributeError(f"module 'avastra' has no attribute '{name}'")


def __dir__() -> List[str]:
    return sorted([*globals(), *_ENGINE, *_NOTEBOOK])
