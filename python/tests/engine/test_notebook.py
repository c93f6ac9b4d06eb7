"""Tests of frames and pages for notebooks; `tests/interop/wheel.sh` runs them with pandas and polars."""

import html
import os
import pickle
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

import avastra

try:
    import pandas
    import polars
except ImportError:
    pandas = polars = None

ROOT = Path(__file__).resolve().parents[3]
SPACE = ROOT / "scenarios" / "avastra45.ava"
FAULT = ROOT / "scenarios" / "ads" / "faults" / "planning_never_yields.yaml"
PROGRAM = os.environ.get("AVASTRA")


@unittest.skipUnless(PROGRAM and pandas, "needs the program in AVASTRA, pandas and polars")
class Runs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.out = Path(cls.folder.name) / "run"
        asked = ["run", SPACE, "--road", "crossroad", "--episodes", "40", "--ads", FAULT, "--out", cls.out, "--quiet"]
        subprocess.run([PROGRAM, *map(str, asked)], check=True, stdout=subprocess.DEVNULL)

    def test_frames_have_what_the_database_has(self):
        copy = Path(self.folder.name) / "copy"
        copy.mkdir()
        shutil.copy(self.out / "run.db", copy)
        database = sqlite3.connect(copy / "run.db")
        self.addCleanup(database.close)
        # A step without an action has no row; this run has none such.
        with database:
            database.execute("UPDATE step SET action_row = NULL WHERE episode % 2 = 0")
        for frames, is_none in (("pandas", pandas.isna), ("polars", lambda value: value is None)):
            run = avastra.runs(copy, frames)
            nulls = set()
            for frame, name, key in ((run.episodes, "episode", "episode"), (run.steps, "step", "episode, step"),
                                     (run.collisions, "collision", "episode, number")):
                rows = database.execute(f"SELECT * FROM {name} ORDER BY {key}")
                columns = [column for column, *_ in rows.description]
                self.assertEqual(list(frame.columns), columns)
                for column, values in zip(columns, zip(*rows)):
                    shown = frame[column].to_list()
                    self.assertEqual([is_none(value) for value in shown], [value is None for value in values], (frames, name, column))
                    # Seeds are texts in the database.
                    self.assertEqual([None if is_none(value) else str(value) for value in shown],
                                     [None if value is None else str(value) for value in values], (frames, name, column))
                    if None in values:
                        nulls.add(column)
            # One of each kind: number, integer, text.
            self.assertLessEqual({"ttc_s", "action_row", "cause"}, nulls)
            self.assertIn("40 episodes", repr(run))
        # A seed keeps its 64 bits.
        self.assertEqual(avastra.runs(self.out).episodes["seed"].dtype, np.uint64)

    def test_a_run_and_its_scenarios_are_shown_as_pages(self):
        run = avastra.runs(self.out)
        self.assertEqual(len(run.scenarios), len(list(self.out.glob("critical/*.ava"))))
        scenario = run.scenarios[0]
        for shown, named in ((run, "run"), (scenario, scenario.path.stem)):
            frame = shown._repr_html_()
            self.assertTrue(frame.startswith("<iframe srcdoc=") and frame.endswith("</iframe>"))
            page = html.unescape(frame.split('"')[1])
            # Not `assertIn`, which would print the page.
            self.assertTrue('<head><base href="about:srcdoc">' in page)
            self.assertIn(named, re.search("<title>(.*)</title>", page).group(1))

    def test_the_example_of_the_page_runs(self):
        blocks = (ROOT / "python/README.md").read_text(encoding="utf-8").split("```python\n")[1:]
        [source] = [block.split("```")[0] for block in blocks if "avastra.runs" in block]
        names = {}
        exec(source.replace("runs/0001", str(self.out)), names)
        self.assertEqual(len(names["run"].episodes), 40)

    def test_what_is_missing_is_named(self):
        with self.assertRaisesRegex(ValueError, "`pandas` or `polars`"):
            avastra.runs(self.out, "excel")
        with mock.patch.dict(sys.modules, {"polars": None}), self.assertRaisesRegex(ImportError, "pip install polars"):
            avastra.runs(self.out, "polars")
        with self.assertRaisesRegex(ValueError, "run.db"):
            avastra.runs(self.out / "critical")
        with self.assertRaisesRegex(FileNotFoundError, "no scenario"):
            avastra.Scenario(self.out / "critical" / "none.ava")
        with mock.patch.dict(os.environ, {"AVASTRA": "no_such_program"}), self.assertRaisesRegex(FileNotFoundError, "cargo install"):
            avastra.runs(self.out).report()
        torn = Path(self.folder.name) / "torn.ava"
        torn.write_text("nothing")
        with self.assertRaisesRegex(RuntimeError, "ended with status 2"):
            avastra.Scenario(torn).report()


class Pickles(unittest.TestCase):
    def test_a_space_is_its_path_and_what_it_means(self):
        space = avastra.compile(os.path.relpath(SPACE))
        kept = pickle.dumps(space)
        here = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            self.addCleanup(os.chdir, here)
            again = pickle.loads(kept)
            self.assertEqual((again.digest, again.rows, again.roads), (space.digest, space.rows, space.roads))
            os.chdir(here)

    def test_a_space_that_has_changed_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(SPACE.parent / "roads", Path(folder) / "roads")
            for name in ("avastra45.ava", "roads.ava", "lanes.ava"):
                shutil.copy(SPACE.parent / name, folder)
            file = Path(folder) / "avastra45.ava"
            kept = pickle.dumps(avastra.compile(file))
            file.write_text(file.read_text().replace("limit: 20 steps", "limit: 21 steps"))
            with self.assertRaisesRegex(ValueError, "has changed"):
                pickle.loads(kept)


if __name__ == "__main__":
    unittest.main()
