"""Tests of the engine as a bench for searches: values of the caller, whole episodes, files of the language."""

import os
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import avastra

ROOT = Path(__file__).resolve().parents[3]
SPACE = ROOT / "scenarios" / "avastra45.ava"
LAW = ROOT / "scenarios" / "avastra45_law.ava"
PROGRAM = os.environ.get("AVASTRA")
#: A row that draws a speed, a distance and a choice.
WALKS = "pedestrian(from: Right)"


class Cruise(avastra.Driver):
    """Holds 8 m/s and minds nobody."""

    answer = "acceleration"

    def step(self, step):
        return avastra.Acceleration(8.0 - step.ego.speed)


class Spaces(unittest.TestCase):
    def test_a_text_is_a_space(self):
        text = SPACE.read_text()
        space = avastra.Space.from_text(text, SPACE)
        self.assertEqual(space.digest, avastra.compile(SPACE).digest)
        with self.assertRaises(avastra.SpaceError) as caught:
            avastra.Space.from_text("language 1\nlet x = 12 m + 3 s\n")
        self.assertEqual(caught.exception.diagnostics[0]["line"], 2)

    def test_a_row_says_what_it_draws(self):
        space = avastra.compile(SPACE)
        draws = {draw.name: draw for draw in space.draws(space.rows.index(WALKS), "residential")}
        self.assertEqual((draws["speed"].unit, draws["speed"].low, draws["speed"].values), ("m/s", 0.5, []))
        self.assertEqual((draws["mode"].low, draws["mode"].values), (None, ["Near", "Far"]))
        self.assertEqual(space.draws(0), [])
        with self.assertRaisesRegex(IndexError, "rows 0 to 44"):
            space.draws(45)
        with self.assertRaisesRegex(ValueError, "it has residential"):
            space.draws(0, "nowhere")


class Values(unittest.TestCase):
    def setUp(self):
        self.space = avastra.compile(SPACE)
        self.row = self.space.rows.index(WALKS)
        self.episodes = avastra.Episodes(self.space, "residential", ads="reactive")

    def test_a_step_takes_values(self):
        self.episodes.reset(1)
        _, _, _, info = self.episodes.step(self.row, {"speed": 1.0, "mode": "Near", "distance": 1000.0})
        self.assertEqual((info["row"], info["refused"]), (self.row, None))
        self.assertEqual((info["values"]["speed"], info["values"]["mode"]), (1.0, "Near"))
        # What is out of bounds is moved to the bound.
        self.assertLessEqual(info["values"]["distance"], 40.0)
        self.assertGreater(info["measures"]["distance_m"], 0.0)

    def test_a_legal_value_stays_as_it_is(self):
        for seed in range(6):
            step = self.episodes.evaluate(seed, [[self.row, {"distance": 20.0}]])["steps"][0]
            self.assertEqual((step["refused"], step["values"]["distance"]), (None, 20.0))

    def test_a_wrong_value_is_refused(self):
        for values, error, text in [({"pace": 1.0}, ValueError, "draws no `pace`, but mode, speed"),
                                    ({"speed": "fast"}, TypeError, "a number"), ({"mode": 3}, TypeError, "a word"),
                                    ({"mode": "Nearly"}, TypeError, "one of"),
                                    ({"speed": float("nan")}, ValueError, "finite")]:
            with self.subTest(values=values), self.assertRaisesRegex(error, text):
                self.episodes.evaluate(1, [(self.row, values)])
        for steps, error in [([(1,)], ValueError), ([(1, {}, 3)], ValueError), ([{}], ValueError), ([1.5], TypeError), ([99], ValueError), ([-1], ValueError), (["0"], TypeError)]:
            with self.subTest(steps=steps), self.assertRaises(error):
                self.episodes.evaluate(1, steps)

    def test_a_whole_episode_is_the_same_in_steps(self):
        values = {"speed": 1.25}
        played = self.episodes.evaluate(7, [None, (self.row, values), 0], trajectory=True)
        self.episodes.reset(7)
        end, chosen = None, iter([(None, None), (self.row, values), (0, None)])
        while end is None:
            row, given = next(chosen, (None, None))
            _, _, end, info = self.episodes.step(row, given)
        for key in ("trace", "end", "counted", "findings", "breaches", "margins", "measures", "steps"):
            self.assertEqual(info["ended"][key], played[key], key)
        ego = played["trajectory"]["ego"]
        self.assertEqual(ego.shape[1], 5)
        self.assertAlmostEqual(ego[-1, 0], played["duration_s"], delta=0.1)
        self.assertEqual(list(played["trajectory"]["npc"]), [1])
        # What was carried out can be played again.
        self.assertEqual(self.episodes.evaluate(7, played["steps"])["trace"], played["trace"])

    def test_margins_and_breaches_are_told(self):
        episodes = avastra.Episodes(avastra.compile(LAW), "crossroad", ads="blind")
        played = episodes.evaluate(1)
        self.assertIn("stops_at_red", played["margins"])
        self.assertTrue(played["breaches"])
        self.assertEqual(set(played["breaches"][0]), {"requirement", "time_s", "until_s", "margin", "npc"})

    def test_threads_play_siblings_alike(self):
        alone = [self.episodes.evaluate(seed, [(self.row, {})])["trace"] for seed in range(6)]
        found = [None] * 6

        def play(first):
            sibling = self.episodes.sibling()
            for seed in range(first, 6, 2):
                found[seed] = sibling.evaluate(seed, [(self.row, {})])["trace"]

        threads = [threading.Thread(target=play, args=(first,)) for first in range(2)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        self.assertEqual(found, alone)


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def replayed(self, *arguments):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    @unittest.skipUnless(PROGRAM, "needs the program")
    def test_what_was_played_is_saved(self):
        episodes = avastra.Episodes(avastra.compile(LAW), "crossroad", ads="blind")
        with self.assertRaisesRegex(ValueError, "reset first"):
            episodes.save(self.path / "early.ava")
        episodes.evaluate(1)
        episodes.save(self.path / "my-crash 2.ava", repeat=7)
        self.assertIn("holds", self.replayed("replay", self.path / "my-crash 2.ava"))
        self.assertIn("It recurs", (self.path / "my-crash 2.ava").read_text())
        with self.assertRaisesRegex(ValueError, "end it with `.ava`"):
            episodes.save(self.path / "found.txt")

    def test_a_text_that_is_nowhere_saves_nothing(self):
        text = SPACE.read_text().replace('use "', f'use "{SPACE.parent}/')
        space = avastra.Space.from_text(text, self.path / "space.ava")
        episodes = avastra.Episodes(space, "corner", ads="idm")
        episodes.evaluate(1)
        with self.assertRaisesRegex(ValueError, "is not there: what is saved"):
            episodes.save(self.path / "found.ava")
        self.assertEqual(os.listdir(self.path), [])

    def test_only_emitted_files_are_replaced(self):
        own = self.path / "space.ava"
        own.write_text(SPACE.read_text().replace('use "', f'use "{SPACE.parent}/'))
        episodes = avastra.Episodes(avastra.compile(own), "corner", ads="idm")
        episodes.evaluate(1)
        with self.assertRaisesRegex(ValueError, "did not emit it"):
            episodes.save(own)
        for _ in range(2):
            episodes.save(self.path / "played.ava")
        self.assertEqual(len(avastra.compile(own).rows), 45)

    @unittest.skipUnless(PROGRAM, "needs the program")
    def test_a_network_becomes_a_policy(self):
        episodes = avastra.Episodes(avastra.compile(SPACE), "corner", ads="idm", observation="scaled")
        generator = np.random.default_rng(3)
        sizes = [36, 16, 45]
        layers = [(generator.normal(size=(outputs, inputs)).astype(np.float32), generator.normal(size=outputs).astype(np.float32))
                  for inputs, outputs in zip(sizes, sizes[1:])]
        with self.assertRaisesRegex(ValueError, "needs 36-16-45"):
            episodes.save_policy(self.path / "p.ava", [layers[0], (layers[1][0][:3], layers[1][1][:3])], by="nobody")
        episodes.save_policy(self.path / "p.ava", layers, by="numpy")
        text = (self.path / "p.ava").read_text()
        self.assertIn("numpy, trained elsewhere", text)
        self.replayed("run", SPACE, "--policy", self.path / "p.ava", "--road", "corner", "--ads", "idm", "--episodes", "3",
                      "--seed", "5", "--out", self.path / "run")
        played = avastra.read_run(self.path / "run")
        for seed, trace in zip(played["episode"]["seed"], played["episode"]["trace"]):
            observation, legal = episodes.reset(int(seed))
            end = None
            while end is None:
                hidden = np.maximum(layers[0][0] @ observation + layers[0][1], 0.0)
                values = np.where(legal, layers[1][0] @ hidden + layers[1][1], -np.inf)
                observation, _, end, info = episodes.step(int(values.argmax()) if legal.any() else None)
                legal = info["action_mask"]
            self.assertEqual(info["ended"]["trace"], trace)


try:
    from avastra.sb3 import VecEnv
except ImportError:
    VecEnv = None


@unittest.skipUnless(VecEnv, "needs stable-baselines3")
class Vectors(unittest.TestCase):
    def test_worlds_are_environments_of_their_seeds(self):
        env = VecEnv(3, SPACE, ["corner", "residential"], ads="idm", threads=2)
        self.addCleanup(env.close)
        env.seed(5)
        observations = env.reset()
        alone = [env.worlds[world].sibling() for world in range(3)]
        for world in range(3):
            np.testing.assert_array_equal(alone[world].reset(5 + world)[0], observations[world])
        over = False
        while not over:
            observations, _, dones, infos = env.step(np.zeros(3, dtype=int))
            for world in range(3):
                told, _, end, _ = alone[world].step(0)
                shown = infos[world]["terminal_observation"] if dones[world] else observations[world]
                np.testing.assert_array_equal(told, shown)
                self.assertEqual(end is not None, dones[world])
            over = dones.any()
        self.assertEqual(env.env_method("action_masks")[0].shape, (45,))
        shown = [masks() for masks in env.get_attr("action_masks")]
        np.testing.assert_array_equal(shown, env.action_masks())
        with self.assertRaisesRegex(ValueError, "leave `mask` out"):
            VecEnv(1, SPACE, mask="observation")
        with self.assertRaises(TypeError):
            env.step(np.array([0.5, 1.0, 2.0]))


class Drivers(unittest.TestCase):
    def test_a_class_drives_in_this_process(self):
        with avastra.listen(Cruise) as listener:
            episodes = avastra.Episodes(avastra.compile(SPACE), "corner", ads_cmd=listener.address)
            first = episodes.evaluate(3)
            self.assertEqual(episodes.sibling().evaluate(3)["trace"], first["trace"])
            self.assertGreater(first["distance_m"], 50.0)
            episodes.close()


if __name__ == "__main__":
    unittest.main()
