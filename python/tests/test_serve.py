"""The conversation, as the simulator sees it: over the pipes of a process."""

import json
import pathlib
import subprocess
import sys
import textwrap
import unittest

from stand_in import INIT, Program, World, drive

ROOT = pathlib.Path(__file__).parent.parent
EXAMPLES = ROOT / "examples"
RECORDED = pathlib.Path(__file__).parent / "conversation.jsonl"


def speak(source, messages):
    """Runs a driver's source over messages; returns its answers, its standard error and its exit status."""
    source = f"import sys\nsys.path.insert(0, {str(ROOT)!r})\nimport avastra\n" + textwrap.dedent(source)
    text = "".join(json.dumps(message) + "\n" for message in messages)
    done = subprocess.run([sys.executable, "-c", source], input=text, capture_output=True, text=True, timeout=60)
    return [json.loads(line) for line in done.stdout.splitlines()], done.stderr, done.returncode


def opening(road="straight"):
    world = World(road)
    return [INIT, world.map, world.reset(), world.step(0)]


CRUISE = """
class Cruise(avastra.Driver):
    answer = "acceleration"
    def step(self, step):
        {}
        return avastra.Acceleration({})
avastra.serve(Cruise)
"""


class Speaking(unittest.TestCase):
    def test_each_question_has_one_answer(self):
        answers, _, status = speak(CRUISE.format("pass", "1.0"), [*opening(), {"type": "event", "kind": "end", "t_us": 5},
                                                                  {"type": "event", "kind": "unheard of", "t_us": 5}])
        self.assertEqual(answers[0], {"type": "ready", "protocol": "avastra-ads/1", "name": "Cruise", "version": "0",
                                      "answer": "acceleration", "deterministic": True})
        self.assertEqual(answers[1:], [{"type": "ready"}, {"type": "ready"}, {"type": "acceleration", "seq": 0, "accel": 1.0}])
        self.assertEqual(status, 0)

    def test_prints_go_to_standard_error_from_native_code_too(self):
        noise = "print('from Python'); import os; os.write(1, b'from below\\n'); os.system('echo from a child')"
        answers, errors, status = speak(CRUISE.format(noise, "1.0"), opening())
        self.assertEqual((len(answers), status), (4, 0))
        for said in ("from Python", "from below", "from a child"):
            self.assertIn(said, errors)

    def test_close_ends_the_conversation(self):
        answers, _, status = speak(CRUISE.format("pass", "1.0"), [INIT, {"type": "close"}, *opening()])
        self.assertEqual((len(answers), status), (1, 0))


class Failing(unittest.TestCase):
    def fails(self, source, messages, text, status):
        answers, errors, ended = speak(source, messages)
        self.assertEqual(answers[-1]["type"], "error")
        self.assertIn(text, answers[-1]["message"])
        self.assertIn(text.split("`")[0], errors)
        self.assertEqual(ended, status)

    def test_what_is_not_finite_is_refused(self):
        self.fails(CRUISE.format("pass", "float('nan')"), opening(), "`acceleration.accel` is nan, and must be finite", 1)

    def test_what_the_driver_raises_is_told(self):
        self.fails(CRUISE.format("[][0]", "0.0"), opening(), "IndexError: list index out of range", 1)

    def test_another_kind_of_answer_than_announced_is_refused(self):
        source = CRUISE.replace('answer = "acceleration"', 'answer = "control"').format("pass", "0.0")
        self.fails(source, opening(), "returned a acceleration, but `answer` of the class announces `control`", 1)

    def test_a_short_trajectory_is_refused(self):
        source = """
        class Short(avastra.Driver):
            answer = "trajectory"
            def step(self, step):
                return avastra.Trajectory([avastra.TrajectoryPoint(time, 0.0, 0.0, 0.0, 0.0) for time in (0, 900_000)])
        avastra.serve(Short)
        """
        self.fails(source, opening(), "reach at least 1 s beyond it", 1)

    def test_a_negative_speed_is_refused(self):
        source = """
        class Back(avastra.Driver):
            answer = "trajectory"
            def step(self, step):
                return avastra.Trajectory([avastra.TrajectoryPoint(time, 0.0, 0.0, 0.0, -1e-9) for time in (0, 1_000_000)])
        avastra.serve(Back)
        """
        self.fails(source, opening(), "the vehicle does not drive backwards", 1)

    def test_a_kind_that_the_driver_cannot_give_is_refused(self):
        self.fails(CRUISE.format("pass", "0.0"), [dict(INIT, answer="control")], "gives only `acceleration`", 1)

    def test_another_protocol_ends_with_status_2(self):
        self.fails(CRUISE.format("pass", "0.0"), [dict(INIT, protocol="avastra-ads/2")], "the simulator speaks avastra-ads/2", 2)

    def test_what_is_not_understood_ends_with_status_2(self):
        self.fails(CRUISE.format("pass", "0.0"), opening()[1:], "the first message is `map`", 2)
        self.fails(CRUISE.format("pass", "0.0"), [INIT, {"type": "step", "seq": 0}], "`step` has no field `t_us`", 2)
        self.fails(CRUISE.format("pass", "0.0"), [INIT, {"type": "dance"}], "`dance` is no message", 2)

    def test_a_driver_without_step_is_told_what_is_missing(self):
        self.fails("avastra.serve(type('Idle', (avastra.Driver,), {}))", opening(), "Idle has no method `step`", 1)

    def test_only_drivers_are_served(self):
        self.fails("avastra.serve(dict)", opening(), "needs a class derived from avastra.Driver", 1)


class Examples(unittest.TestCase):
    """Every example drives; one gives the answers of a recorded conversation."""

    def test_the_examples_drive(self):
        for name in ("acceleration", "control", "trajectory"):
            program = Program([sys.executable, str(EXAMPLES / f"{name}.py")])
            self.assertEqual(program.ask(INIT)["answer"], name)
            for road, end in (("bend", "arrived"), ("light", "arrived"), ("beside", "standing")):
                world = drive(program, road)
                with self.subTest(name=name, road=road):
                    self.assertEqual(world.ended(), end)
                    self.assertLess(world.worst_offset, 0.5)
                    self.assertGreater(world.least_gap, 1.0)
            self.assertEqual(program.close(), 0)

    def test_the_example_of_the_page_drives(self):
        blocks = (ROOT / "README.md").read_text(encoding="utf-8").split("```python\n")[1:]
        source = next(block.split("```")[0] for block in blocks if "avastra.serve" in block)
        program = Program([sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{source}"])
        program.ask(INIT)
        self.assertEqual(drive(program, "bend").ended(), "arrived")
        self.assertEqual(program.close(), 0)

    def test_an_episode_driven_again_in_the_same_process_has_the_same_answers(self):
        program = Program([sys.executable, str(EXAMPLES / "acceleration.py")])
        program.ask(INIT)
        first, _, again = drive(program, "straight"), drive(program, "bend"), drive(program, "straight")
        self.assertEqual(first.answers, again.answers)
        self.assertEqual(program.close(), 0)

    def test_a_recorded_conversation_is_repeated(self):
        program = Program([sys.executable, str(EXAMPLES / "acceleration.py")])
        due = None
        for direction, message in map(json.loads, RECORDED.read_text().splitlines()):
            if direction == "<":
                self.alike(due, message)
            elif message["type"] in ("event", "close"):
                program.ask(message, answered=False)
            else:
                due = program.ask(message)
        self.assertEqual(program.process.wait(timeout=20), 0)
        program.process.stdin.close()
        program.process.stdout.close()

    def alike(self, given, recorded):
        """Equal; numbers up to the last digits, in which mathematical libraries differ."""
        self.assertEqual(given.keys(), recorded.keys())
        for key, value in recorded.items():
            if isinstance(value, float):
                self.assertAlmostEqual(given[key], value, places=9)
            else:
                self.assertEqual(given[key], value)
