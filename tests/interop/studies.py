"""Plays what is missing of studies, and keeps it beside them: `studies.py AVASTRA COMMIT NAME… [--minutes M]`.

Each job of a study (a training and its evaluation, or a repetition) is played as a shard of its own, and kept at once. So the studies can be played in
many sittings, of which nothing but `scenarios/studies/*.jsonl` is left. `--minutes` ends it after the job that is under way then.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
import time

STUDIES = pathlib.Path(__file__).resolve().parents[2] / "scenarios/studies"


def jobs(settings):
    """The cells of each job, in the order of shards: as `StudySettings::jobs`, those with most episodes first."""
    roads, found = settings["conditions"]["roads"], []
    for number in range(max(agent["repeats"] for agent in settings["agents"])):
        for agent in (agent for agent in settings["agents"] if number < agent["repeats"]):
            training = agent.get("training")
            together = [roads] if training and training["roads"] else [[road] for road in roads]
            for own in together:
                judged = settings["evaluation"]["episodes"] * settings["evaluation"]["seeds"]
                episodes = (training["episodes"] if training else 0) + (agent.get("searched", 0) + judged) * len(own)
                found.append((episodes, {(agent["label"], road, number) for road in own}))
    found.sort(key=lambda job: -job[0])
    return [cells for _, cells in found]


def play(avastra, commit, name, until):
    """Plays a study until that time; whether it is whole."""
    study, kept = STUDIES / f"{name}.yaml", STUDIES / f"{name}.jsonl"

    def shard(number, of):
        with tempfile.TemporaryDirectory() as scratch:
            quiet = {"check": True, "stdout": subprocess.DEVNULL, "cwd": STUDIES.parents[1]}
            out = f"{scratch}/played"
            subprocess.run([avastra, "study", study, "--jobs", "1", "--shard", f"{number}/{of}", "--out", out, "-q"], **quiet)
            subprocess.run([avastra, "study", "results", "--add", out, "--commit", commit, "-q"], **quiet)

    planned = subprocess.run([avastra, "study", study, "--dry-run", "--format", "json", "--out", f"{tempfile.gettempdir()}/unplayed"], check=True, capture_output=True, text=True)
    of = json.loads(planned.stdout.splitlines()[-1])["planned"]["shards_max"]
    if not kept.exists():
        shard(1, of)
    head, *cells, _ = map(json.loads, kept.read_text().splitlines())
    known = {(cell["agent"], cell["road"], cell["number"]) for cell in cells}
    for number, cells in enumerate(jobs(head["settings"]), 1):
        if cells <= known:
            continue
        if time.monotonic() > until:
            return False
        shard(number, of)
    return True


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("avastra", type=pathlib.Path)
    parser.add_argument("commit")
    parser.add_argument("names", nargs="+")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    options = parser.parse_args()
    until = time.monotonic() + 60 * options.minutes
    for name in options.names:
        print(f"{name}: {'whole' if play(options.avastra.resolve(), options.commit, name, until) else 'not whole yet'}", flush=True)


if __name__ == "__main__":
    main()
