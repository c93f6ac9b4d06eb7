"""Tests of the Gymnasium environments; `tests/interop/wheel.sh` runs them with several versions of Gymnasium."""

import os
import tempfile
import unittest
import warnings
from pathlib import Path

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import avastra
import avastra.gym
from test_engine import failing_profile

ROOT = Path(__file__).resolve().parents[3]
SPACE = avastra.compile(ROOT / "scenarios" / "avastra45.ava")


def made(**options):
    return gymnasium.make("avastra/Space-v0", space=SPACE, road="crossroad", **options)


class Page(unittest.TestCase):
    def test_the_examples_of_the_page_run(self):
        blocks = (ROOT / "python/README.md").read_text(encoding="utf-8").split("```python\n")[1:]
        sources = [block.split("```")[0] for block in blocks if "avastra.serve" not in block and "avastra.runs" not in block]
        self.assertEqual(len(sources), 3)
        here = os.getcwd()
        os.chdir(ROOT)
        try:
            with tempfile.TemporaryDirectory() as folder:
                for source in sources:
                    names = {}
                    exec(source.replace("found.ava", f"{folder}/found.ava"), names)
                    played = names["info"] if "info" in names else names["played"]["steps"][1]
                    self.assertEqual(played["refused"], None)
                self.assertEqual(os.listdir(folder), ["found.ava"])
        finally:
            os.chdir(here)


class OneWorld(unittest.TestCase):
    def test_gymnasium_finds_nothing_wrong(self):
        for options in [{}, {"observation": "raw", "reward": "space"}, {"mask": "observation"}]:
            with warnings.catch_warnings(record=True) as found:
                warnings.simplefilter("always")
                check_env(made(**options).unwrapped, skip_render_check=True)
            self.assertEqual([str(one.message) for one in found], [])

    def test_a_given_seed_is_the_episode_s(self):
        env = made(observation="raw")
        observation, info = env.reset(seed=7)
        expected, mask = avastra.Episodes(SPACE, "crossroad").reset(7)
        np.testing.assert_array_equal(observation, expected)
        np.testing.assert_array_equal(info["action_mask"], mask)
        self.assertEqual(info["seed"], 7)
        drawn = [env.reset()[1]["seed"] for _ in range(3)]
        env.reset(seed=7)
        self.assertEqual(drawn, [env.reset()[1]["seed"] for _ in range(3)])
        self.assertEqual(len(set(drawn)), 3)

    def test_masks_are_in_every_form(self):
        env = made(mask="observation")
        observation, info = env.reset(seed=1)
        for _ in range(4):
            legal = info["action_mask"]
            np.testing.assert_array_equal(observation["action_mask"].astype(bool), legal)
            np.testing.assert_array_equal(env.unwrapped.action_masks(), legal)
            observation, _, _, _, info = env.step(int(legal.argmax()))
            self.assertEqual(info["row"], int(legal.argmax()))

    def test_an_illegal_row_loses_the_step(self):
        env = made()
        _, info = env.reset(seed=1)
        _, _, terminated, truncated, info = env.step(int((~info["action_mask"]).argmax()))
        self.assertEqual((terminated, truncated, info["row"]), (False, False, -1))
        self.assertIn(":", info["refused"])

    def test_a_changed_info_changes_nothing(self):
        env = made()
        for info in (env.reset(seed=1)[1], env.step(0)[4]):
            kept = env.unwrapped.action_masks()
            info["action_mask"][:] = ~info["action_mask"]
            np.testing.assert_array_equal(env.unwrapped.action_masks(), kept)

    def test_an_episode_ends_judged(self):
        env = made(ads="idm")
        env.reset(seed=avastra.episode_seed(5, 11))
        generator, counted = np.random.default_rng(0), 0
        while True:
            legal = np.flatnonzero(env.unwrapped.action_masks())
            _, reward, terminated, truncated, info = env.step(int(generator.choice(legal)))
            counted += info["counted"]
            self.assertEqual(reward == 20.0, info["counted"] > 0)
            if terminated or truncated:
                break
        self.assertEqual(terminated, info["ended"]["end"] == "arrived")
        self.assertEqual(info["ended"]["counted"], counted)


class ManyWorlds(unittest.TestCase):
    def play(self, env, steps, seed):
        """Observations, rewards and ends of chosen rows, and the seeds of the episodes."""
        observation, info = env.reset(seed=seed)
        found, seeds = [observation.copy()], [info["seed"].tolist()]
        for _ in range(steps):
            rows = env.unwrapped.action_masks().argmax(axis=1)
            observation, reward, terminated, truncated, info = env.step(rows)
            self.assertIn(observation, env.observation_space)
            found.append((observation, reward, terminated, truncated))
            seeds.append(info["seed"].tolist())
        return found, seeds

    def test_each_world_is_an_environment(self):
        many = avastra.gym.VectorEnv(3, SPACE, "crossroad", threads=2)
        found, _ = self.play(many, 30, 5)
        ends = 0
        for world in range(3):
            one = made()
            observation, _ = one.reset(seed=5 + world)
            np.testing.assert_array_equal(found[0][world], observation)
            over = False
            for observations, rewards, terminated, truncated in found[1:]:
                if over:
                    observation, _ = one.reset()
                    reward, ended, cut = 0.0, False, False
                    ends += 1
                else:
                    row = int(one.unwrapped.action_masks().argmax())
                    observation, reward, ended, cut, _ = one.step(row)
                np.testing.assert_array_equal(observations[world], observation)
                self.assertEqual((rewards[world], terminated[world], truncated[world]), (reward, ended, cut))
                over = ended or cut
        self.assertGreater(ends, 3)

    def test_a_name_may_be_a_number_of_one_row_and_a_word_of_another(self):
        text = (ROOT / "scenarios/avastra45.ava").read_text(encoding="utf-8").replace('use "', f'use "{ROOT}/scenarios/')
        text += "action brisk(any pick: Speed in 1 m/s .. 2 m/s) { set sky = None }\naction sided(any pick: Side) { set sky = None }\n"
        space = avastra.Space.from_text(text.replace("count(actions) == 45", "count(actions) == 47"))
        rows = [space.rows.index("brisk()"), space.rows.index("sided()")]
        for mode in ("NEXT_STEP", "SAME_STEP"):
            env = avastra.gym.VectorEnv(2, space, "corner", ads="idm", autoreset_mode=mode)
            env.reset(seed=1)
            over = False
            while not over:
                _, _, terminated, truncated, info = env.step(rows)
                over = (terminated | truncated).any()
                if not over:
                    self.assertEqual([type(values["pick"]) for values in info["values"]], [float, str])

    def test_modes_play_the_same_episodes(self):
        def seeds(mode):
            env = avastra.gym.VectorEnv(2, SPACE, ["crossroad", "corner"], autoreset_mode=mode)
            env.reset(seed=1)
            met, last = [[], []], 0
            for _ in range(45):
                _, _, terminated, truncated, info = env.step(env.action_masks().argmax(axis=1))
                ended = terminated | truncated
                for world in np.flatnonzero(ended):
                    own = info["final_info"] if mode == AutoresetMode.SAME_STEP else info
                    met[world].append(int(own["ended"]["distance_m"][world] * 1000))
                if mode == AutoresetMode.SAME_STEP and ended.any():
                    last += 1
                    self.assertEqual(info["_final_obs"].tolist(), ended.tolist())
                if mode == AutoresetMode.DISABLED and ended.any():
                    with self.assertRaisesRegex(avastra.EpisodeError, "reset_mask"):
                        env.step([0, 0])
                    env.reset(options={"reset_mask": ended})
            return [own[:2] for own in met]

        modes = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED]
        first, second, third = (seeds(mode) for mode in modes)
        self.assertEqual(first, second)
        self.assertEqual(first, third)
        self.assertEqual([len(own) for own in first], [2, 2])

    def test_whole_seeds_come_through_every_mode(self):
        large = [2**63 + 1, 2**64 - 1]
        for mode in AutoresetMode:
            env = avastra.gym.VectorEnv(2, SPACE, "crossroad", autoreset_mode=mode)
            info = env.reset(seed=large)[1]
            ended = np.zeros(2, dtype=bool)
            while not ended.any():
                self.assertEqual(info["seed"].tolist(), large)
                _, _, terminated, truncated, info = env.step(env.action_masks().argmax(axis=1))
                ended = terminated | truncated
            world = int(ended.argmax())
            last = info["final_info"] if mode == AutoresetMode.SAME_STEP else info
            self.assertEqual(int(last["seed"][world]), large[world])

    def test_a_step_that_is_refused_changes_no_later_episode(self):
        def seeds(is_refused_once):
            env = avastra.gym.VectorEnv(2, SPACE, "crossroad")
            env.reset(seed=3)
            ended = np.zeros(2, dtype=bool)
            while not ended.any():
                _, _, terminated, truncated, _ = env.step(env.action_masks().argmax(axis=1))
                ended = terminated | truncated
            if is_refused_once:
                with self.assertRaises(avastra.EpisodeError):
                    env.step([int(not ended[0]) * env.single_action_space.n, int(ended[0]) * env.single_action_space.n])
            return env.step([0, 0])[4]["seed"].tolist()

        self.assertEqual(seeds(True), seeds(False))

    def test_the_last_observation_has_its_own_mask(self):
        env = avastra.gym.VectorEnv(2, SPACE, "crossroad", mask="observation", autoreset_mode="SAME_STEP")
        plain = avastra.gym.VectorEnv(2, SPACE, "crossroad", autoreset_mode="DISABLED")
        env.reset(seed=3)
        plain.reset(seed=3)
        ended = np.zeros(2, dtype=bool)
        while not ended.any():
            rows = env.action_masks().argmax(axis=1)
            observation, _, terminated, truncated, info = env.step(rows)
            last = plain.step(rows)[0]
            self.assertIn(observation, env.observation_space)
            ended = terminated | truncated
        for world in np.flatnonzero(ended):
            final = info["final_obs"][world]
            np.testing.assert_array_equal(final["observation"], last[world])
            np.testing.assert_array_equal(final["action_mask"].astype(bool), info["final_info"]["action_mask"][world])
            np.testing.assert_array_equal(final["action_mask"].astype(bool), plain.action_masks()[world])

    def test_the_infos_of_two_episodes_are_apart(self):
        env = avastra.gym.VectorEnv(2, SPACE, "crossroad", autoreset_mode="SAME_STEP")
        _, info = env.reset(seed=3)
        begun, ended = info["seed"].tolist(), np.zeros(2, dtype=bool)
        while not ended.any():
            _, _, terminated, truncated, info = env.step(env.action_masks().argmax(axis=1))
            ended = terminated | truncated
        for world in np.flatnonzero(ended):
            final = info["final_info"]
            self.assertEqual(int(final["seed"][world]), begun[world])
            self.assertTrue(final["_ended"][world])
            self.assertNotEqual(int(info["seed"][world]), begun[world])
            # What only the end of an episode tells stands with the end alone.
            self.assertFalse(np.any(info.get("_ended", np.zeros(2, dtype=bool))[world]))

    def test_modes_have_names_and_options_are_known(self):
        for mode in AutoresetMode:
            for name in (mode, mode.name, mode.value):
                self.assertEqual(avastra.gym.VectorEnv(1, SPACE, "crossroad", autoreset_mode=name).autoreset_mode, mode)
        with self.assertRaisesRegex(ValueError, "no option `reset_masks`"):
            avastra.gym.VectorEnv(1, SPACE, "crossroad").reset(options={"reset_masks": [True]})

    def test_what_is_no_whole_number_is_no_row(self):
        env, worlds = made(), avastra.gym.VectorEnv(2, SPACE, "crossroad")
        env.reset(seed=1)
        worlds.reset(seed=1)
        for wrong in (1.9, "3", 1.0, np.float32(1), None, True, [1]):
            with self.subTest(wrong=wrong), self.assertRaisesRegex(TypeError, "action must be a whole number"):
                env.step(wrong)
            with self.subTest(wrong=wrong), self.assertRaisesRegex(TypeError, "action must be a whole number"):
                worlds.step([0, wrong])
        with self.assertRaises(TypeError):
            worlds.step(np.array([0.5, 1.0]))
        with self.assertRaises(TypeError):
            worlds.reset(seed=[1, 1.9])
        # Nothing has moved, and whole numbers of every kind are rows.
        for right in (1, np.int64(1), np.uint8(1), np.array(1)):
            self.assertEqual(env.step(right)[4]["time_s"] % 6.0, 0.0)
        worlds.step(np.array([0, 1]))

    def test_a_driving_system_that_fails_at_once(self):
        with tempfile.TemporaryDirectory() as folder:
            conditions = {"ads_config": failing_profile(folder)}
            with self.assertRaisesRegex(avastra.EpisodeError, "as it began"):
                made(**conditions).reset(seed=1)
            env = avastra.gym.VectorEnv(1, SPACE, "crossroad", **conditions)
            with self.assertRaisesRegex(avastra.EpisodeError, "world 0: the episode of seed 1 ended as it began"):
                env.reset(seed=1)
            _, rewards, terminated, truncated, info = env.step([0])
        self.assertEqual((rewards.tolist(), terminated.tolist(), truncated.tolist()), ([0.0], [False], [True]))
        self.assertEqual(info["ended"]["duration_s"].tolist(), [0.0])

    def test_gymnasium_makes_it(self):
        env = gymnasium.make_vec("avastra/Space-v0", num_envs=2, vectorization_mode="vector_entry_point",
                                 space=SPACE, road="crossroad", mask="observation")
        observation, info = env.reset(seed=1)
        self.assertIn(observation, env.observation_space)
        self.assertEqual(observation["action_mask"].shape, (2, 45))
        self.assertEqual(info["action_mask"].shape, (2, 45))
        self.assertEqual(env.metadata["autoreset_mode"], AutoresetMode.NEXT_STEP)
        with self.assertRaises(ValueError):
            env.reset(options={"reset_mask": np.zeros(2, dtype=bool)})


if __name__ == "__main__":
    unittest.main()
