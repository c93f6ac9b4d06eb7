"""A driver that keeps the speed with which it begins, along its way, and sees nothing: as a player moves an ego vehicle without a story."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "python"))

import avastra


class Blind(avastra.Driver):
    name = "blind"
    answer = "acceleration"

    def reset(self, reset):
        self.speed = None

    def step(self, step):
        if self.speed is None:
            self.speed = step.ego.speed
        return avastra.Acceleration(5.0 * (self.speed - step.ego.speed))


avastra.serve(Blind)
