"""Tests of the engine; `tests/interop/wheel.sh` builds it and runs them. `AVASTRA` names the program to compare with."""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import avastra

ROOT = Path(__file__).resolve().parents[3]
SPACE = ROOT / "scenarios" / "avastra45.ava"
#: A driving system that fails as an episode begins.
FAILING = """
import avastra

class Failing(avastra.Driver):
    answer = "acceleration"

    def reset(self, reset):
        raise RuntimeError("no way from here")

avastra.serve(Failing)
"""
#: One that says when it is ended.
CRUISE = """
import avastra

class Cruise(avastra.Driver):
    answer = "acceleration"

    def step(self, step):
        return avastra.Acceleration(8.0 - step.ego.speed)

    def close(self):
        open({ended!r}, "w").close()

avastra.serve(Cruise)
"""


def failing_profile(folder):
    """A profile of the driving system that fails as an episode begins."""
    program, profile = Path(folder) / "failing.py", Path(folder) / "failing.yaml"
    program.write_text(FAILING)
    profile.write_text(json.dumps({"ads": {"command": [sys.executable, str(program)]}}))
    return profile


class Spaces(unittest.TestCase):
    def test_a_space_has_rows_and_roads(self):
        space = avastra.compile(SPACE)
        self.assertEqual(len(space.rows), 45)
        self.assertEqual(space.roads, ["residential", "corner", "crossroad", "boulevard"])
        self.assertIn("sky", space.states)
        self.assertEqual((space.step_s, space.step_limit), (6.0, 20))
        self.assertIn("45 rows", repr(space))

    def test_a_mistake_carries_its_diagnostic(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "wrong.ava"
            file.write_text("language 1\nlet x = 12 m + 3 s\n")
            with self.assertRaises(avastra.SpaceError) as caught:
                avastra.compile(file)
        error = caught.exception
        self.assertIsInstance(error, ValueError)
        first = error.diagnostics[0]
        self.assertEqual((first["severity"], first["line"]), ("error", 2))
        self.assertTrue(first["code"].startswith("AV"))
        self.assertTrue(first["file"].endswith("wrong.ava"))
        self.assertIn(f"error[{first['code']}]", str(error))
        self.assertIn(first["message"], str(error))

    def test_a_missing_file_has_no_diagnostics(self):
        with self.assertRaises(avastra.SpaceError) as caught:
            avastra.compile("no/such/file.ava")
        self.assertEqual(caught.exception.diagnostics, [])
        self.assertIn("no/such/file.ava", str(caught.exception))

    def test_conditions_that_do_not_exist_are_named(self):
        space = avastra.compile(SPACE)
        for arguments, word in [
            ({"road": "nowhere"}, "nowhere"), ({"road": "corner", "ads": "nobody"}, "nobody"),
            ({"road": "corner", "ambient": 99999}, "99999"), ({"road": "corner", "observation": "blurred"}, "blurred"),
            ({"road": "corner", "reward": "much"}, "much"), ({"road": "corner", "ads_config": "no.yaml"}, "no.yaml"),
            ({"road": "corner", "without_rules": ["no_rule"]}, "no_rule"),
        ]:
            with self.assertRaisesRegex(ValueError, word):
                avastra.Episodes(space, **arguments)

    def test_variables_describe_the_observation(self):
        found = avastra.variables()
        self.assertEqual(len(found), 44)
        speed = next(variable for variable in found if variable.name == "ego_speed")
        self.assertEqual((speed.column, speed.unit, speed.words), ("speed", "m/s", []))
        self.assertEqual(dict(found[1].words), {"Morning": 10.0, "Noon": 14.0, "Night": 20.0})


class Stepping(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.space = avastra.compile(SPACE)

    def episodes(self, **conditions):
        return avastra.Episodes(self.space, "crossroad", **conditions)

    def test_shapes_and_types(self):
        episodes = self.episodes()
        observation, mask = episodes.reset(seed=1)
        self.assertEqual((observation.dtype, observation.shape), (np.float32, (44,)))
        self.assertEqual((mask.dtype, mask.shape), (np.bool_, (45,)))
        observation, reward, end, info = episodes.step(int(mask.argmax()))
        self.assertEqual(observation.shape, (44,))
        self.assertIsInstance(reward, float)
        self.assertIsNone(end)
        self.assertEqual((info["row"], info["refused"], info["time_s"]), (int(mask.argmax()), None, 0.0))
        scaled, _ = self.episodes(observation="scaled").reset(1)
        self.assertEqual(scaled.shape, (36,))

    def test_an_illegal_row_loses_the_step(self):
        chosen, passed = self.episodes(), self.episodes()
        _, mask = chosen.reset(1)
        passed.reset(1)
        illegal = int((~mask).argmax())
        self.assertFalse(mask[illegal])
        here, there = chosen.step(illegal), passed.step(None)
        self.assertEqual(here[3]["row"], -1)
        self.assertTrue(here[3]["refused"])
        self.assertIsNone(there[3]["refused"])
        np.testing.assert_array_equal(here[0], there[0])
        self.assertEqual(here[1], there[1])

    def test_what_is_out_of_order_is_refused(self):
        episodes = self.episodes()
        with self.assertRaisesRegex(avastra.EpisodeError, "reset"):
            episodes.step(0)
        with self.assertRaisesRegex(avastra.EpisodeError, "reset"):
            episodes.snapshot()
        episodes.reset(1)
        for row in (45, -1):
            with self.assertRaisesRegex(avastra.EpisodeError, f"no row {row}: the table has rows 0 to 44"):
                episodes.step(row)
        with self.assertRaisesRegex(avastra.EpisodeError, "world 0: no row -1"):
            avastra.step_all([episodes], [-1], [None], 1)
        with self.assertRaises(OverflowError):
            episodes.reset(-1)
        end = None
        while end is None:
            _, _, end, info = episodes.step(None)
        self.assertEqual(info["ended"]["end"], end)
        with self.assertRaisesRegex(avastra.EpisodeError, "ended"):
            episodes.step(None)

    def test_a_snapshot_goes_on_alike(self):
        episodes = self.episodes(ads_config=ROOT / "scenarios/ads/degraded.yaml", ambient=4)
        episodes.reset(3)
        episodes.step(5)
        kept = episodes.snapshot()

        def on(of):
            _, mask = of.restore(kept)
            found = []
            for _ in range(4):
                observation, reward, end, info = of.step(int(mask.argmax()))
                mask = info["action_mask"]
                found.append((observation.tolist(), reward, end))
            return found

        first = on(episodes)
        self.assertEqual(first, on(episodes))
        self.assertEqual(first, on(episodes.sibling()))
        with self.assertRaisesRegex(avastra.EpisodeError, "other conditions"):
            self.episodes().restore(kept)

    def test_threads_change_nothing(self):
        worlds = [self.episodes().sibling() for _ in range(5)]
        rows = [[3, 8, 20, None, 44], [1, 2, 3, 4, 5], [44, 44, 44, 44, 44]]

        def play(threads):
            begun = avastra.step_all(worlds, [None] * 5, [10, 11, 12, 13, 14], threads)
            found = [begun[0].tolist()]
            for each in rows:
                observations, masks, rewards, ends, infos = avastra.step_all(worlds, each, [None] * 5, threads)
                found.append((observations.tolist(), masks.tolist(), rewards.tolist(), ends, infos))
            return found

        alone = play(1)
        self.assertEqual(alone, play(2))
        self.assertEqual(alone, play(9))
        with self.assertRaises(ValueError):
            avastra.step_all(worlds, [0], [None] * 5, 1)
        self.assertEqual(avastra.step_all([], [], [], 2)[0].shape, (0, 0))

    def test_what_cannot_be_stepped_leaves_all_as_they_were(self):
        first = self.episodes()
        worlds = [first, first.sibling(), first.sibling()]
        nothing = [None] * 3
        avastra.step_all(worlds, nothing, [1, 2, 3], 1)
        over = worlds[2].snapshot()
        for rows, reason in [([0, 0, 45], "world 2: no row 45"), ([45, 0, 0], "world 0: no row 45")]:
            with self.assertRaisesRegex(avastra.EpisodeError, reason):
                avastra.step_all(worlds, rows, nothing, 3)
        with self.assertRaisesRegex(avastra.EpisodeError, "world 1: no episode has begun"):
            avastra.step_all([first, first.sibling()], [0, 0], [None, None], 1)
        with self.assertRaisesRegex(avastra.EpisodeError, "worlds 0 and 2 are the same"):
            avastra.step_all([first, worlds[1], first], [0, 0, 0], [None, None, 4], 2)
        while worlds[2].step(None)[2] is None:
            pass
        with self.assertRaisesRegex(avastra.EpisodeError, "world 2: the episode has ended"):
            avastra.step_all(worlds, nothing, nothing, 2)
        worlds[2].restore(over)
        times = [info["time_s"] for info in avastra.step_all(worlds, nothing, nothing, 2)[4]]
        self.assertEqual(times, [0.0, 0.0, 0.0])

    def test_a_driving_system_that_fails_at_once_leaves_no_episode(self):
        with tempfile.TemporaryDirectory() as folder:
            episodes = self.episodes(ads_config=failing_profile(folder))
            with self.assertRaisesRegex(avastra.EpisodeError, "seed 1 ended as it began: `ads_"):
                episodes.reset(1)
            with self.assertRaisesRegex(avastra.EpisodeError, "has ended"):
                episodes.step(None)
            _, _, rewards, ends, infos = avastra.step_all([episodes], [None], [2], 1)
        self.assertEqual((rewards.tolist(), infos[0]["seed"]), ([0.0], 2))
        self.assertEqual(infos[0]["ended"]["end"], ends[0])
        self.assertEqual((infos[0]["ended"]["duration_s"], infos[0]["ended"]["findings"]), (0.0, []))

    def test_a_driving_system_of_ones_own_is_ended_and_begins_again(self):
        with tempfile.TemporaryDirectory() as folder:
            program, ended = Path(folder) / "cruise.py", Path(folder) / "ended"
            program.write_text(CRUISE.format(ended=str(ended)))
            episodes = self.episodes(ads_cmd=f"'{sys.executable}' '{program}'")
            for _ in range(2):
                episodes.reset(1)
                episodes.step(None)
                self.assertFalse(ended.exists())
                episodes.close()
                self.assertTrue(ended.exists(), "it was told to close, and has")
                ended.unlink()
            with self.assertRaisesRegex(avastra.EpisodeError, "reset"):
                episodes.step(None)

    def test_everything_says_what_it_does(self):
        for thing in (avastra.Space, avastra.Episodes, avastra.Snapshot):
            self.assertTrue(thing.__doc__)
            for name, member in vars(thing).items():
                if not name.startswith("_"):
                    self.assertTrue(member.__doc__, f"{thing.__name__}.{name}")

    def test_python_runs_while_episodes_drive(self):
        first = self.episodes()
        worlds = [first] + [first.sibling() for _ in range(39)]
        nothing, lengths, done = [None] * 40, [], threading.Event()
        avastra.step_all(worlds, nothing, list(range(40)), 1)

        def drive():
            for _ in range(3):
                begun = time.perf_counter()
                avastra.step_all(worlds, nothing, nothing, 1)
                lengths.append(time.perf_counter() - begun)
            done.set()

        thread = threading.Thread(target=drive)
        thread.start()
        longest, before = 0.0, time.perf_counter()
        while not done.is_set():
            now = time.perf_counter()
            longest, before = max(longest, now - before), now
        thread.join()
        # With the lock, the shortest of these calls would be a gap as long as itself.
        self.assertLess(longest, min(lengths) / 2)


class Runs(unittest.TestCase):
    """Against the program: the rows of a run, chosen again here, come to its bytes."""

    def test_a_run_steps_alike(self):
        program = os.environ.get("AVASTRA")
        if not program:
            self.skipTest("AVASTRA names no program")
        collisions = 0
        for ads in ["modular", "reactive"]:
            with tempfile.TemporaryDirectory() as folder:
                out = Path(folder) / "run"
                command = [program, "run", str(SPACE), "--road", "crossroad", "--ads", ads, "--episodes", "12", "--seed", "5"]
                subprocess.run([*command, "--out", str(out)], check=True, capture_output=True)
                run = avastra.read_run(out)
            collisions += self.replay(run, ads)
        self.assertGreater(collisions, 0)

    def replay(self, run, ads):
        episode, step, learning = run["episode"], run["step"], run["learning"]
        self.assertEqual(episode["episode"].tolist(), list(range(12)))
        self.assertEqual((episode["seed"].dtype, step["reward"].dtype), (np.uint64, np.float64))
        self.assertEqual(len(learning["episode"]), 0)
        columns = [variable.column for variable in avastra.variables()[:19]]
        states = np.stack([step[column] for column in columns], axis=1).astype(np.float32)
        episodes = avastra.Episodes(avastra.compile(SPACE), "crossroad", ads=ads)
        for number, seed in enumerate(episode["seed"].tolist()):
            self.assertEqual(seed, avastra.episode_seed(5, number))
            observation, _ = episodes.reset(seed)
            for index in np.flatnonzero(step["episode"] == number):
                np.testing.assert_array_equal(observation[:19], states[index])
                row = int(step["action_row"][index])
                observation, reward, end, info = episodes.step(None if row < 0 else row)
                told = (reward, info["time_s"], info["proc"], info["refused"])
                kept = tuple(step[name][index] for name in ["reward", "time_s", "proc", "refused"])
                self.assertEqual(told, kept)
            ended = info["ended"]
            self.assertEqual(end, episode["ended"][number])
            for name in ["trace", "duration_s", "distance_m", "red_runs", "counted"]:
                self.assertEqual(ended[name], episode[name][number], name)
            of = run["collision"]["episode"] == number
            for name in ["time_s", "counted", "avoidability", "priority", "body", "delta_v_mps"]:
                self.assertEqual([one[name] for one in ended["findings"]], run["collision"][name][of].tolist(), name)
        return len(run["collision"]["episode"])

    def test_a_table_with_bytes_is_read_without_them(self):
        program = os.environ.get("AVASTRA")
        if not program:
            self.skipTest("AVASTRA names no program")
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "training"
            command = [program, "train", str(SPACE), "--road", "corner", "--episodes", "1"]
            subprocess.run([*command, "--out", str(out)], check=True, capture_output=True)
            kept = avastra.engine.read_table(out / "run.db", "checkpoint")
        self.assertEqual(list(kept), ["only", "episodes", "digest"])
        self.assertEqual((kept["episodes"].tolist(), len(kept["digest"])), ([1], 1))

    def test_what_is_no_table_of_a_run_is_named(self):
        program = os.environ.get("AVASTRA")
        if not program:
            self.skipTest("AVASTRA names no program")
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "run"
            command = [program, "run", str(SPACE), "--road", "corner", "--episodes", "1", "--out", str(out)]
            subprocess.run(command, check=True, capture_output=True)
            with self.assertRaisesRegex(ValueError, "it has no table `episodes`: there are `episode`"):
                avastra.engine.read_table(out / "run.db", "episodes")

    def test_what_recurs_is_what_every_command_says(self):
        self.assertEqual([avastra.recurs(count, 20) for count in (16, 17)], [False, True])
        with self.assertRaises(ValueError):
            avastra.recurs(3, 2)

    def test_what_is_no_run_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(ValueError, "run.db"):
                avastra.read_run(folder)
            (Path(folder) / "run.db").write_text("no database")
            with self.assertRaisesRegex(ValueError, "run.db"):
                avastra.read_run(folder)


if __name__ == "__main__":
    unittest.main()
