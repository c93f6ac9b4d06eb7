"""Put a driving system written in Python under test with avastra.

    import avastra

    class Cruise(avastra.Driver):
        answer = "acceleration"

        def step(self, step):
            return avastra.Acceleration(8.0 - step.ego.speed)

    avastra.serve(Cruise)

Then `avastra run SPACE --ads-cmd 'python3 cruise.py'`. PROTOCOL.md describes what is sent; nothing beyond Python is needed.
"""

from .driver import Driver
from .messages import (Acceleration, Answer, Conditions, Control, Crosswalk, Ego, Event, Goal, Init, Internal, Lane,
                       Map, Object, Pedals, ProtocolError, Reset, Route, RoutePoint, Signal, Start, Step, Trajectory,
                       TrajectoryPoint, Vehicle)
from .path import Beside, Path, Pose, wrap
from .serve import serve
from .way import Way

__all__ = [
    "Acceleration", "Answer", "Beside", "Conditions", "Control", "Crosswalk", "Driver", "Ego", "Event", "Goal", "Init",
    "Internal", "Lane", "Map", "Object", "Path", "Pedals", "Pose", "ProtocolError", "Reset", "Route", "RoutePoint",
    "Signal", "Start", "Step", "Trajectory", "TrajectoryPoint", "Vehicle", "Way", "serve", "wrap",
]
