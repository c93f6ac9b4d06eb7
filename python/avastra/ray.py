"""Runs, studies and estimates on a Ray cluster: `python -m avastra.ray run|study|estimate`.

    python -m avastra.ray study scenarios/studies/rq1.yaml --out runs/rq1 --shards 64

Shards are Ray's tasks. Each of them is the program `avastra` with `--shard I/N` in a folder of its own below `OUT.shards`, which
keeps what it has played; Ray plays the task of a killed worker again, and it goes on from there. At the end `avastra merge` brings
the shards together: the directory has the bytes of the unsharded one, but for `timing.jsonl`. After a kill of everything, the
same command goes on, too.

The program, the files that the command names, and the folders must be at the same paths on all nodes, as on a cluster with a
shared file system. Needs Ray 2.60 or later (`pip install './python[ray]'`), and the program (`cargo install --locked --path .`).

A training is no such command: it is one sequence, in which each episode is chosen by weights that the one before has changed.
Many trainings at once are a study.
"""

import argparse
import collections
import itertools
import json
import os
import platform
import re
import subprocess
import sys
from typing import Any, Callable, Deque, Dict, Iterable, List, NoReturn, Optional, Sequence, Tuple

from .program import path_of

COMMANDS = ("run", "study", "estimate")
#: How often Ray plays a shard again whose worker or program was killed.
RETRIES = 5
#: How many tasks Ray has at a time: enough that a cluster grows by them, and few enough that each answer is found at once.
TASKS = 1000
#: Exit statuses of a shard that may be whole: it found a counted collision that was not to be, or the driving system failed in some
#: episodes. `merge` knows whether it is.
ENDED = (0, 4, 5)
#: The file that says what the shards of a folder are of.
RECORD = "command.json"

#: The command whose shards lie in a folder, and how they are played.
Work = Dict[str, Any]


class Refused(Exception):
    """Says to the user what cannot be done, and what would help."""


class Ended(Exception):
    """The program refuses the command, and has said why."""

    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """The command line. Returns the exit status: that of `avastra`, where it is the one that failed."""
    try:
        options, passed = _parsed(arguments)
        options.program = _program(options.program)
        shards = _kept(options, passed)
        most = shards or _shards_max(options, passed)
        return _cluster(options, passed, shards, most)
    except Ended as ended:
        return ended.status
    except Refused as refused:
        _say(f"error: {refused}")
        return 1
    except KeyboardInterrupt:
        _say("stopped: what has been played is kept, the same command goes on with it")
        return 130


def play(number: int, shards: int, work: Work) -> Tuple[int, str]:
    """Plays one shard, on whatever node Ray has chosen: its exit status and the last lines that it said.

    Raises `ChildProcessError` if the program was killed, so that Ray tries again.
    """
    node = platform.node()
    for folder in (work["working_directory"], work["folder"]):
        if not os.path.isdir(folder):
            return 1, f"there is no folder `{folder}` on node {node}: all nodes must see the same files"
    if path_of(work["program"]) is None:
        return 1, f"there is no program `{work['program']}` on node {node}"
    out = os.path.join(work["folder"], str(number))
    command = [work["program"], work["command"]]
    if os.path.isfile(os.path.join(out, f"{work['command']}.yaml")):
        command += ["--resume", out]
    else:
        command += [*work["arguments"], "--shard", f"{number}/{shards}", "--out", out]
    command += ["--jobs", str(work["jobs"]), *work["anew"]]
    child = subprocess.Popen(_bound(command), cwd=work["working_directory"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                             stderr=subprocess.PIPE, text=True, errors="replace")
    assert child.stderr is not None, "it was asked for"
    told = _told(child.stderr, f"{number}/{shards}")
    status = child.wait()
    if status < 0:
        raise ChildProcessError(f"shard {number}/{shards} on node {node} was ended by signal {-status}")
    return status, told


def _parsed(arguments: Optional[Sequence[str]]) -> Tuple[argparse.Namespace, List[str]]:
    parser = _Parser(
        prog="python -m avastra.ray", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Play a run, a study or an estimate of avastra in shards on a Ray cluster, and bring them together.",
        epilog="All other options are those of the command, for example `avastra study --help`.\n"
               "After a kill, the same command goes on. The shards stay in OUT.shards; delete them when they are merged.\n"
               "A training is one sequence and has no shards: use `avastra train`, or a study for many trainings at once.")
    parser.add_argument("command", choices=[*COMMANDS, "train"], metavar="run|study|estimate")
    parser.add_argument("--out", required=True, metavar="DIR", help="directory of the whole, new or empty")
    parser.add_argument("--shards", type=_number, metavar="N", help="into how many pieces, each with something to play [default: one for each processor of the cluster]")
    parser.add_argument("--jobs", type=_number, default=1, metavar="J", help="threads of each shard, and processors it asks Ray for [default: 1]")
    parser.add_argument("--address", help="the cluster, as `ray.init` takes it [default: RAY_ADDRESS, or a cluster on this machine]")
    parser.add_argument("--workers", type=_number, metavar="W", help="processors of a cluster that is begun on this machine [default: all]")
    parser.add_argument("--program", metavar="FILE", default=os.environ.get("AVASTRA", "avastra"),
                        help="the program [default: AVASTRA, or `avastra` in the PATH]")
    # What `--resume` takes, too: see `_anew`.
    parser.add_argument("--reuse", metavar="DIR", help=argparse.SUPPRESS)
    parser.add_argument("--fail-on", action="append", help=argparse.SUPPRESS)
    # What is for the output of the whole.
    parser.add_argument("--format", help=argparse.SUPPRESS)
    parser.add_argument("--color", help=argparse.SUPPRESS)
    parser.add_argument("--quiet", "-q", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--verbose", "-v", action="store_true", help=argparse.SUPPRESS)
    options, passed = parser.parse_known_args(arguments)
    if options.command == "train":
        raise Refused("a training is one sequence, in which each episode is chosen by weights that the one before has changed: it "
                      "has no shards. Train on one machine with `avastra train`, or many trainings at once with "
                      "`python -m avastra.ray study`")
    for option in passed:
        if option.split("=")[0] in ("--shard", "--resume"):
            raise Refused(f"`{option}` is said by Ray's tasks themselves: to go on, say the same command again")
        if option == "--dry-run":
            raise Refused(f"`{option}` needs no cluster: `avastra {options.command} … --dry-run` says what would be played")
    if not options.out:
        raise Refused("`--out` is empty: name a directory")
    if options.address and options.workers:
        raise Refused("`--workers` is for a cluster that is begun here, and `--address` names another")
    return options, passed


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise Refused(f"{message} (`python -m avastra.ray --help`)")


def _number(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"`{text}` is no number from 1")
    return int(text)


def _program(program: str) -> str:
    found = path_of(program)
    if found is None:
        raise Refused(f"there is no program `{program}`: `cargo install --locked --path .` in avastra's repository installs it, or name it "
                      "with `--program` or AVASTRA")
    return os.path.abspath(found)


def _shards_max(options: argparse.Namespace, passed: List[str]) -> int:
    """Into how many shards the command can be cut. What the program refuses, it says itself, and that ends this program, too.

    It is asked before there is a cluster, which takes seconds to begin.
    """
    # The shard keeps a scheduler's environment out of it.
    command = [options.program, options.command, *passed, *_anew(options), "--shard", "1/1", f"--out={options.out}", "--dry-run"]
    # First as the user wants to read it, so that a refusal reads so; then as JSON, for the number.
    for how in (_how(options), ["--format", "json"]):
        try:
            asked = subprocess.run([*command, *how], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
        except OSError as error:
            raise Refused(f"`{options.program}` cannot be started: {error.strerror}") from error
        if asked.returncode != 0:
            _say(asked.stderr.rstrip())
            raise Ended(max(asked.returncode, 1))
    most: int = json.loads(asked.stdout)["planned"]["shards_max"]
    if options.shards and options.shards > most:
        raise Refused(f"{options.shards} shards are too many: it can be cut into {most}")
    return most


def _anew(options: argparse.Namespace) -> List[str]:
    """What is said again of a shard that is gone on with."""
    return [*(["--reuse", options.reuse] if options.reuse else []), *(["--fail-on", ",".join(options.fail_on)] if options.fail_on else [])]


def _cluster(options: argparse.Namespace, passed: List[str], shards: Optional[int], most: int) -> int:
    try:
        import ray
    except ImportError as error:
        raise Refused(f"Ray is not installed ({error}): `pip install './python[ray]'` in avastra's repository installs it, or "
                      "`pip install ray`") from error
    begin = {"num_cpus": options.workers} if options.workers else {}
    try:
        ray.init(address=options.address, log_to_driver=False, logging_level="ERROR", **begin)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise Refused(f"no cluster: {error}") from error
    try:
        return _run(ray, options, passed, shards, most)
    finally:
        # This ends the tasks under way, and they their programs.
        ray.shutdown()


def _run(ray: Any, options: argparse.Namespace, passed: List[str], shards: Optional[int], most: int) -> int:
    processors = int(ray.cluster_resources().get("CPU", 1))
    if options.jobs > processors:
        raise Refused(f"no shard with {options.jobs} threads can begin: the cluster has {processors} processors")
    shards = shards or options.shards or min(max(1, processors // options.jobs), most)
    work = _begun(options, passed, shards)
    tell: Callable[[str], None] = (lambda text: None) if options.quiet else _say
    tell(f"{shards} shards on {processors} processors, in {work['folder']}")
    task = ray.remote(play).options(num_cpus=options.jobs, max_retries=RETRIES, retry_exceptions=[ChildProcessError],
                                    scheduling_strategy="SPREAD", name=f"avastra {options.command}")
    numbers = iter(range(1, shards + 1))
    under_way: Dict[Any, int] = {}
    ended_count, worst = 0, 0
    status: int
    while ended_count < shards:
        for number in itertools.islice(numbers, TASKS - len(under_way)):
            under_way[task.remote(number, shards, work)] = number
        ended, _ = ray.wait(list(under_way), num_returns=1)
        number = under_way.pop(ended[0])
        try:
            status, told = ray.get(ended[0])
        except ray.exceptions.RayError as error:
            # What `play` raises is of Ray's kind and of its own. Ray tries only these again.
            killed = (ChildProcessError, ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError)
            what = f"was killed more than {RETRIES} times" if isinstance(error, killed) else "could not be played"
            raise Refused(f"shard {number}/{shards} {what}: {str(error).strip().splitlines()[-1]}") from error
        if status not in ENDED:
            _say(f"error: shard {number}/{shards} ended with status {status}:\n{told}")
            return status
        if status != 0:
            _say(f"shard {number}/{shards}, status {status}:\n{told}")
        worst, ended_count = max(worst, status), ended_count + 1
        tell(f"{ended_count}/{shards} shards")
    return _merged(options, work, shards) or worst


def _work(options: argparse.Namespace, passed: List[str]) -> Tuple[Work, str]:
    """What is asked for, as the record keeps it, and the folder of the shards."""
    known = {"command": options.command, "arguments": passed, "working_directory": os.getcwd()}
    return known, f"{os.path.abspath(options.out)}.shards"


def _kept(options: argparse.Namespace, passed: List[str]) -> Optional[int]:
    """Into how many shards this command was cut when it began; `None` if it is new."""
    known, folder = _work(options, passed)
    record, out = os.path.join(folder, RECORD), os.path.abspath(options.out)
    left = [name for name in os.listdir(folder) if name != RECORD] if os.path.isdir(folder) else []
    # A record alone is that of a command whose shards could not begin.
    if left and os.path.isfile(record):
        with open(record, encoding="utf-8") as file:
            begun = json.load(file)
        shards: int = begun.pop("shards")
        if begun != known or options.shards not in (None, shards):
            was = " ".join([begun["command"], *begun["arguments"]])
            raise Refused(f"`{folder}` has {shards} shards of `{was}`, begun in `{begun['working_directory']}`: say the same command "
                          "there, name another `--out`, or delete that folder")
        return shards
    if left or (os.path.isdir(out) and os.listdir(out)):
        raise Refused(f"`{folder if left else out}` is not empty: name another `--out`")
    return None


def _begun(options: argparse.Namespace, passed: List[str], shards: int) -> Work:
    """The work of all shards, whose folder and record are there."""
    known, folder = _work(options, passed)
    record = os.path.join(folder, RECORD)
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise Refused(f"`{folder}` cannot be made: {error.strerror}") from error
    # Renamed into place, so that a kill leaves all of it or nothing.
    with open(f"{record}.new", "w", encoding="utf-8") as file:
        json.dump({**known, "shards": shards}, file, indent=1)
    os.replace(f"{record}.new", record)
    return {**known, "program": options.program, "folder": folder, "jobs": options.jobs, "anew": _anew(options)}


def _merged(options: argparse.Namespace, work: Work, shards: int) -> int:
    """Brings all shards together, on this node; its exit status."""
    directories = [os.path.join(work["folder"], str(number)) for number in range(1, shards + 1)]
    merge = [work["program"], "merge", *directories, "--out", os.path.abspath(options.out), *_how(options)]
    return subprocess.run(merge).returncode


def _how(options: argparse.Namespace) -> List[str]:
    """How the result is to be told."""
    return [*(["--format", options.format] if options.format else []), *(["--color", options.color] if options.color else []),
            *(["--quiet"] if options.quiet else []), *(["--verbose"] if options.verbose else [])]


def _bound(command: List[str]) -> List[str]:
    """A command that ends with this process, however that ends. Only Linux can do that: elsewhere the command is as it was."""
    if not sys.platform.startswith("linux"):
        return command
    # A worker that is killed cannot end its program, which would go on in the shard's folder. So a small program before the real
    # one asks the kernel for a signal (PR_SET_PDEATHSIG). The worker cannot ask between fork and exec, because it has threads.
    # The signal comes when the thread ends that began the program. Ray plays a task on its worker's main thread, so that is
    # when the worker ends.
    before = ("import ctypes, os, signal, sys\n"
              "ctypes.CDLL(None).prctl(1, signal.SIGKILL)\n"
              "os.getppid() == int(sys.argv[1]) or sys.exit(1)\n"
              "os.execv(sys.argv[2], sys.argv[2:])")
    return [sys.executable, "-S", "-c", before, str(os.getpid()), *command]


def _told(lines: Iterable[str], shard: str) -> str:
    """Reads what a program says to its end: the last lines. How far it is becomes gauges of Ray's dashboard."""
    last: Deque[str] = collections.deque(maxlen=30)
    gauges = _gauges()
    for line in lines:
        last.append(line.rstrip("\n"))
        said = re.match(r"(\d+)/\d+ episodes(?:, (\d+) collisions? counted)?", line)
        for gauge, value in zip(gauges, said.groups() if said else ()):
            if value is not None:
                gauge.set(int(value), {"shard": shard})
    return "\n".join(last)


def _gauges() -> Sequence[Any]:
    try:
        from ray.util.metrics import Gauge
    except ImportError:
        return ()
    tags = ("shard",)
    return (Gauge("avastra_episodes_played", "Episodes of a shard that are played.", tag_keys=tags),
            Gauge("avastra_collisions_counted", "Counted collisions in them.", tag_keys=tags))


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
