"""What is read and written: the examples of docs/reference/protocol.md, and what is refused."""

import json
import math
import pathlib
import unittest

import avastra
from avastra import messages
from avastra.messages import ProtocolError, answer, read

PROTOCOL_PAGE = pathlib.Path(__file__).parents[2] / "docs/reference/protocol.md"
READ_AS = {"init": messages.Init, "map": messages.Map, "reset": messages.Reset, "step": messages.Step, "event": messages.Event}


def examples():
    """The messages of docs/reference/protocol.md."""
    lines = PROTOCOL_PAGE.read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines if line.startswith('{"type"')]


class Reading(unittest.TestCase):
    def test_every_example_of_the_specification_is_read(self):
        found = [message for message in examples() if message["type"] in READ_AS]
        self.assertEqual({message["type"] for message in found}, set(READ_AS))
        for message in found:
            self.assertIsInstance(read(READ_AS[message["type"]], message, message["type"]), READ_AS[message["type"]])

    def test_fields_have_the_values_of_the_message(self):
        step = read(messages.Step, next(message for message in examples() if message["type"] == "step"), "step")
        self.assertEqual((step.objects[0].kind, step.objects[0].speed, step.ego.lane), ("car", 8.0, "1/0/-1"))
        reset = read(messages.Reset, next(message for message in examples() if message["type"] == "reset"), "reset")
        self.assertEqual((reset.route.lanes[0].end, reset.route.path[1].speed_limit), (2.0, 13.9))

    def test_errors_name_the_field(self):
        message = next(message for message in examples() if message["type"] == "step")
        wrong = dict(message, ego=dict(message["ego"], heading="north"))
        with self.assertRaisesRegex(ProtocolError, r"`step\.ego\.heading` is 'north'"):
            read(messages.Step, wrong, "step")
        del wrong["ego"]
        with self.assertRaisesRegex(ProtocolError, r"`step` has no field `ego`"):
            read(messages.Step, wrong, "step")
        with self.assertRaisesRegex(ProtocolError, r"`step\.objects\[0\]` is 7"):
            read(messages.Step, dict(message, objects=[7]), "step")

    def test_fields_of_later_versions_are_ignored(self):
        message = next(message for message in examples() if message["type"] == "event")
        self.assertEqual(read(messages.Event, dict(message, mood="good"), "event").kind, message["kind"])


class Answering(unittest.TestCase):
    def test_answers_become_the_messages_of_the_specification(self):
        self.assertEqual(answer(avastra.Control(1.5, -0.01), 3), {"type": "control", "seq": 3, "accel": 1.5, "steer": -0.01})
        self.assertEqual(answer(avastra.Acceleration(-2.5, avastra.Internal(reason="follow 1")), 0),
                         {"type": "acceleration", "seq": 0, "accel": -2.5, "internal": {"reason": "follow 1"}})
        points = [avastra.TrajectoryPoint(0, 1.0, 2.0, 0.0, 5.0), avastra.TrajectoryPoint(100_000, 1.5, 2.0, 0.0, 5.0, 0.5)]
        self.assertEqual(answer(avastra.Trajectory(points), 1)["points"],
                         [{"t_us": 0, "x": 1.0, "y": 2.0, "heading": 0.0, "v": 5.0},
                          {"t_us": 100_000, "x": 1.5, "y": 2.0, "heading": 0.0, "v": 5.0, "a": 0.5}])
        localized = answer(avastra.Control(0.0, 0.0, avastra.Internal(localized=(1.0, 2.0, 3.0))), 0)["internal"]
        self.assertEqual(localized, {"localized": {"x": 1.0, "y": 2.0, "heading": 3.0}})

    def test_what_is_not_finite_or_no_number_is_refused(self):
        for wrong in (math.nan, math.inf, "fast", None, True):
            with self.subTest(wrong), self.assertRaisesRegex(ProtocolError, "`control.accel` is .*, and must be"):
                answer(avastra.Control(wrong, 0.0), 0)
        with self.assertRaisesRegex(ProtocolError, r"`trajectory\.points\[1\]\.x` is nan"):
            points = [avastra.TrajectoryPoint(index, math.nan if index else 0.0, 0.0, 0.0, 0.0) for index in range(2)]
            answer(avastra.Trajectory(points), 0)

    def test_only_answers_are_answers(self):
        for wrong in (None, 2.0, {"accel": 1.0}):
            with self.subTest(wrong), self.assertRaisesRegex(ProtocolError, "must return one of"):
                answer(wrong, 0)

    def test_pedals_are_shares(self):
        self.assertEqual(answer(avastra.Pedals(0.2, 0.0, 0.1), 0)["throttle"], 0.2)
        with self.assertRaisesRegex(ProtocolError, r"`control\.brake` is 40"):
            answer(avastra.Pedals(0.0, 40.0, 0.1), 0)
