"""What you write: a class with a method `step`."""

from typing import ClassVar, Sequence

from .messages import Answer, Event, Init, Map, Reset, Step


class Driver:
    """A driving system under test. Derive from it, write `step`, and hand the class to `avastra.serve`.

    One process drives many episodes: `init` is called once, `map` before the first episode on each map, `reset` before each
    episode, `step` every 0.1 s of simulated time. What `step` returns may depend on nothing but the map, the `reset` and
    the steps since: draw random numbers from a generator that is seeded in `reset`, and take the time from the messages.
    """

    #: What is under test, as reports name it. Empty: the name of the class.
    name: ClassVar[str] = ""
    version: ClassVar[str] = "0"
    #: What `step` returns: "control" (`Control` or `Pedals`), "acceleration" or "trajectory".
    answer: ClassVar[str] = "control"
    #: Whether the same `reset` and steps lead to the same answers.
    deterministic: ClassVar[bool] = True
    #: Groups of fields that are sent beside the others: "motion", "conflicts", "names".
    wants: ClassVar[Sequence[str]] = ()

    def init(self, init: Init) -> None:
        """The vehicle and the rates; once, before anything else."""

    def map(self, map: Map) -> None:
        """The map of the following episodes."""

    def reset(self, reset: Reset) -> None:
        """Start, goal and route of the next episode. Forget everything about the last one here."""

    def step(self, step: Step) -> Answer:
        """The command for the next 0.1 s."""
        raise NotImplementedError(f"{type(self).__name__} has no method `step`")

    def event(self, event: Event) -> None:
        """Something has happened, as a collision or the end of the episode. Nothing is answered."""

    def close(self) -> None:
        """The last call: free what you hold."""
