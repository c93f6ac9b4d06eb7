"""Shards as Ray's tasks, with a Ray that plays them at once in this process, and a program that only says what it was asked."""

import contextlib
import io
import json
import os
import pathlib
import stat
import subprocess
import sys
import tempfile
import textwrap
import time
import types
import unittest
from unittest import mock

import avastra.ray

PROGRAM = f"""#!{sys.executable}
import json, os, pathlib, signal, sys
here, asked = pathlib.Path(__file__).parent, sys.argv[1:]
if "--dry-run" in asked:
    if "wrong.ava" in asked:
        print("error: wrong.ava: no such file", file=sys.stderr)
        sys.exit(2)
    print(json.dumps({{"planned": {{"shards_max": 40}}}}))
    sys.exit(0)
with open(here / "asked.jsonl", "a") as file:
    file.write(json.dumps(asked) + "\\n")
if asked[0] == "merge":
    sys.exit(int((here / "merge_status").read_text()) if (here / "merge_status").exists() else 0)
out = pathlib.Path(asked[asked.index("--resume" if "--resume" in asked else "--out") + 1])
if "none.ava" in asked:
    sys.exit(1)
out.mkdir(exist_ok=True)
(out / f"{{asked[0]}}.yaml").write_text("begun")
print("3/8 episodes, 1 collision counted", file=sys.stderr)
struck = here / f"kill_{{out.name}}"
if struck.exists() and int(struck.read_text()):
    struck.write_text(str(int(struck.read_text()) - 1))
    os.kill(os.getpid(), signal.SIGKILL)
fails = here / f"fail_{{out.name}}"
if fails.exists():
    print("error: scenarios/none.ava: no such file", file=sys.stderr)
    sys.exit(int(fails.read_text()))
"""


class RayError(Exception):
    """Ray's own."""


class WorkerCrashedError(RayError):
    """A worker was killed."""


class NodeDiedError(RayError):
    """And its node."""


class StandIn(types.ModuleType):
    """Plays a task when it is waited for, and again as often as Ray would."""

    def __init__(self):
        super().__init__("ray")
        self.exceptions = types.SimpleNamespace(RayError=RayError, WorkerCrashedError=WorkerCrashedError, NodeDiedError=NodeDiedError)
        self.is_on, self.begun = False, 0

    def init(self, address=None, num_cpus=3, **_):
        if address == "nowhere:1":
            raise ConnectionError("nothing listens at nowhere:1")
        self.is_on, self.processors, self.begun, self.given, self.most = True, num_cpus, self.begun + 1, 0, 0

    def shutdown(self):
        self.is_on = False

    def cluster_resources(self):
        return {"CPU": float(self.processors)}

    def remote(self, function):
        def options(max_retries, retry_exceptions, num_cpus, **_):
            return types.SimpleNamespace(remote=lambda *given: self.take(Task(function, given, max_retries, tuple(retry_exceptions))))
        return types.SimpleNamespace(options=options)

    def take(self, task):
        self.given += 1
        self.most = max(self.most, self.given)
        return task

    def wait(self, tasks, num_returns):
        self.given -= num_returns
        return tasks[-num_returns:], tasks[:-num_returns]

    def get(self, task):
        for left in range(task.retries, -1, -1):
            try:
                return task.function(*task.given)
            except Exception as error:
                if left == 0 or not isinstance(error, task.retried):
                    # As with Ray, it is one of Ray's errors and one of the task's.
                    raise type("RayTaskError", (RayError, type(error)), {})(str(error)) from error


class Task:
    def __init__(self, function, given, retries, retried):
        self.function, self.given, self.retries, self.retried = function, given, retries, retried


@unittest.skipUnless(os.name == "posix", "the program is a script")
class OnRay(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name).resolve()
        self.program = self.folder / "avastra"
        self.program.write_text(PROGRAM)
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)
        self.out = self.folder / "out"
        self.ray = StandIn()

    def called(self, *arguments, ray=True):
        """Exit status and standard error of a call, with `--out` and the program."""
        errors = io.StringIO()
        given = [*arguments, "--out", str(self.out), "--program", str(self.program)]
        with mock.patch.dict(sys.modules, {"ray": self.ray if ray else None}), contextlib.redirect_stderr(errors):
            status = avastra.ray.main(given)
        self.assertFalse(self.ray.is_on)
        return status, errors.getvalue()

    def asked(self):
        file = self.folder / "asked.jsonl"
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []

    def shard(self, number):
        return str(self.folder / "out.shards" / str(number))

    def test_shards_are_played_and_merged_in_order(self):
        status, told = self.called("study", "s.yaml", "--shards", "2", "--ads", "x --y", "--format", "json", "--jobs", "2")
        self.assertEqual(status, 0, told)
        played = {tuple(asked) for asked in self.asked()[:-1]}
        self.assertEqual(played, {("study", "s.yaml", "--ads", "x --y", "--shard", f"{number}/2", "--out", self.shard(number),
                                   "--jobs", "2") for number in (1, 2)})
        merge = ["merge", self.shard(1), self.shard(2), "--out", str(self.out), "--format", "json"]
        self.assertEqual(self.asked()[-1], merge)
        self.assertIn("2/2 shards", told)

    def test_there_are_as_many_shards_as_processors(self):
        self.assertEqual(self.called("run", "s.ava", "--workers", "5", "--jobs", "2")[0], 0)
        self.assertEqual(len(self.asked()), 2 + 1)
        status, told = self.called("run", "s.ava", "--workers", "2", "--jobs", "3")
        self.assertEqual((status, "the cluster has 2 processors" in told), (1, True), told)

    def test_ray_has_so_many_tasks_at_a_time(self):
        with mock.patch("avastra.ray.TASKS", 8):
            status, told = self.called("study", "s.yaml", "--shards", "40", "--workers", "2")
        self.assertEqual((status, len(self.asked()), self.ray.most), (0, 40 + 1, 8), told)

    def test_what_cannot_begin_is_said_before_there_is_a_cluster(self):
        status, told = self.called("study", "s.yaml", "--shards", "41")
        self.assertEqual((status, "41 shards are too many: it can be cut into 40" in told), (1, True), told)
        # The words and the status are the program's own.
        self.assertEqual(self.called("study", "wrong.ava"), (2, "error: wrong.ava: no such file\n"))
        self.assertEqual((self.asked(), self.ray.begun), ([], 0))
        # No more shards than there can be, where nobody has said how many.
        self.assertEqual(self.called("study", "s.yaml", "--workers", "64")[0], 0)
        self.assertEqual(len(self.asked()), 40 + 1)

    def test_a_killed_program_is_gone_on_with(self):
        (self.folder / "kill_2").write_text("2")
        status, told = self.called("run", "s.ava", "--shards", "3", "--fail-on", "collision")
        self.assertEqual(status, 0, told)
        own = [asked for asked in self.asked() if self.shard(2) in asked and asked[0] == "run"]
        self.assertEqual(own[0][-4:], ["--jobs", "1", "--fail-on", "collision"])
        self.assertEqual(own[1:], [["run", "--resume", self.shard(2), "--jobs", "1", "--fail-on", "collision"]] * 2)

    def test_a_shard_that_is_always_killed_ends_the_command(self):
        (self.folder / "kill_1").write_text("99")
        status, told = self.called("run", "s.ava", "--shards", "1")
        self.assertEqual(status, 1)
        self.assertRegex(told, "error: shard 1/1 was killed more than 5 times: .*signal 9")

    def test_a_shard_that_cannot_be_played_is_tried_once_and_told_as_such(self):
        with mock.patch("avastra.ray._bound", side_effect=OSError(12, "Cannot allocate memory")) as begun:
            status, told = self.called("run", "s.ava", "--shards", "1")
        self.assertEqual((status, begun.call_count), (1, 1))
        self.assertRegex(told, "error: shard 1/1 could not be played: .*Cannot allocate memory")
        self.assertNotIn("killed", told)

    def test_a_failing_shard_ends_the_command_with_its_own_words_and_status(self):
        (self.folder / "fail_1").write_text("2")
        status, told = self.called("run", "s.ava", "--shards", "1")
        self.assertEqual(status, 2)
        self.assertIn("shard 1/1 ended with status 2", told)
        self.assertIn("error: scenarios/none.ava: no such file", told)
        self.assertNotIn("merge", [asked[0] for asked in self.asked()])

    def test_findings_are_no_failure_and_their_status_is_the_commands(self):
        (self.folder / "fail_1").write_text("4")
        self.assertEqual(self.called("run", "s.ava", "--shards", "2")[0], 4)
        self.assertEqual(self.asked()[-1][0], "merge")
        (self.folder / "merge_status").write_text("1")
        self.assertEqual(self.called("run", "s.ava")[0], 1)

    def test_the_same_command_goes_on_and_another_is_refused(self):
        self.assertEqual(self.called("run", "s.ava", "--shards", "2")[0], 0)
        self.assertEqual(self.called("run", "s.ava")[0], 0)
        self.assertEqual([asked[1] for asked in self.asked()], ["s.ava"] * 2 + [self.shard(1)] + ["--resume"] * 2 + [self.shard(1)])
        # The shards that are there count, not the processors or what the program would say now.
        self.assertEqual(self.called("run", "s.ava", "--workers", "7")[0], 0)
        self.assertEqual(self.asked()[-1], ["merge", self.shard(1), self.shard(2), "--out", str(self.out)])
        for other in (["run", "t.ava"], ["run", "s.ava", "--shards", "3"], ["study", "s.ava"]):
            status, told = self.called(*other)
            self.assertEqual(status, 1)
            self.assertIn("has 2 shards of `run s.ava`", told)

    def test_a_command_that_never_began_is_in_nobodys_way(self):
        self.assertEqual(self.called("run", "none.ava", "--shards", "1")[0], 1)
        self.assertEqual(self.called("run", "s.ava", "--shards", "2")[0], 0)

    def test_what_is_in_the_way_is_left_alone(self):
        self.out.mkdir()
        (self.out / "notes.txt").write_text("mine")
        status, told = self.called("run", "s.ava")
        self.assertEqual((status, f"`{self.out}` is not empty" in told), (1, True), told)
        self.assertEqual(self.asked(), [])

    def test_mistakes_are_said_before_anything_is_played(self):
        for arguments, said in [
            (["train", "s.ava"], "it has no shards. Train on one machine with `avastra train`"),
            (["run", "s.ava", "--shard", "1/2"], "`--shard` is said by Ray's tasks"),
            (["run", "--resume=x"], "`--resume=x` is said by Ray's tasks"),
            (["run", "s.ava", "--shards", "0"], "`0` is no number from 1"),
            (["run", "s.ava", "--address", "auto", "--workers", "2"], "`--address` names another"),
            (["run", "s.ava", "--address", "nowhere:1"], "no cluster: nothing listens at nowhere:1"),
            (["drive", "s.ava"], "invalid choice: 'drive'"),
            (["run", "s.ava", "--dry-run"], "needs no cluster"),
        ]:
            status, told = self.called(*arguments)
            self.assertEqual(status, 1, told)
            self.assertIn(said, told)
        status, told = self.called("run", "s.ava", ray=False)
        self.assertEqual((status, "pip install" in told), (1, True), told)
        self.program.unlink()
        status, told = self.called("run", "s.ava")
        self.assertEqual((status, "there is no program" in told), (1, True), told)
        self.assertEqual(self.asked(), [])

    @unittest.skipUnless(sys.platform.startswith("linux"), "elsewhere nothing ends a killed worker's program")
    def test_a_killed_worker_takes_its_program_with_it(self):
        worker = f"""
            import subprocess, sys
            sys.path.insert(0, {str(pathlib.Path(avastra.__file__).parent.parent)!r})
            import avastra.ray
            child = subprocess.Popen(avastra.ray._bound([sys.executable, "-c", "import time; print('up', flush=True); time.sleep(60)"]))
            print(child.pid, flush=True)
            child.wait()
        """
        process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(worker)], stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        lines = {process.stdout.readline().strip(), process.stdout.readline().strip()}
        child = int((lines - {"up"}).pop())
        process.kill()
        process.wait()
        until = time.monotonic() + 30
        while os.path.exists(f"/proc/{child}") and not is_dead(child):
            self.assertLess(time.monotonic(), until, "the program lives on")
            time.sleep(0.02)


def is_dead(process):
    """Whether a process has ended that its new parent has not yet asked about."""
    with contextlib.suppress(FileNotFoundError):
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    return True


if __name__ == "__main__":
    unittest.main()
