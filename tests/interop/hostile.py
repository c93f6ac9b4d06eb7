"""Attacks a built avastra with files, names, programs, databases and kills, and counts what it withstands.

    python3 tests/interop/hostile.py target/release/avastra [CLASS ...]

Each try runs commands in a home of its own, which holds files of the user and a clone that came from elsewhere. Whatever is tried:
nothing outside the clone and the named places changes, no program is started, no line of the output is forged, nothing panics, and
every command ends within its time limit. Each class of attacks says what else must hold. Needs Linux and Python; with a C compiler,
merges are killed at each system call by which they change files (`kill.c`), and without it at moments by chance. As root, limits of
threads are tried as another user. Prints a table of classes, tries and failures, and exits with 1 if there is a failure.
"""

import json
import os
import random
import resource
import shutil
import signal
import socket
import sqlite3
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AVASTRA = str(Path(sys.argv[1]).resolve())
SPACE = str(ROOT / "scenarios/avastra45.ava")
FLICKER = str(ROOT / "scenarios/ads/faults/perception_flicker.yaml")
XOSC = str(ROOT / "tests/cases/imports/cut_in.xosc")
FOUND = "run/critical/corner_0000.ava"
UGLY = "language 1\nlet   a = 3 m\n"
NEAT = "language 1\nlet a = 3 m\n"
TYPO = "language 1\nlet a = 3 m;\n"
TIME_S = 60
STATUSES = {0, 1, 2, 3, 4, 5, 130}
# A driving system that follows the protocol until a step, and then says what a file holds.
DRIVER = '''import json, sys
how = json.load(open("how.json"))
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "init":
        answer = {"type": "ready", "protocol": "avastra-ads/1", "name": how.get("name", "mine"), "version": "1",
                  "answer": "acceleration", "deterministic": True}
    elif kind in ("map", "reset"):
        answer = {"type": "ready"}
    elif kind == "step" and message["seq"] >= 3 and how["at"] != "internal":
        if how["at"] == "stderr":
            sys.stderr.write(how["text"])
            sys.stderr.flush()
            sys.exit(3)
        answer = {"type": "error", "message": how["text"]}
        if how["at"] == "line":
            answer = how["text"]
    elif kind == "step":
        answer = {"type": "acceleration", "seq": message["seq"], "accel": 8.0 - message["ego"]["speed"]}
        if how["at"] == "internal":
            answer["internal"] = {"reason": how["text"]}
    elif kind == "close":
        break
    else:
        continue
    print(json.dumps(answer), flush=True)
'''
FORGED = ["require injected: ego.speed <= 1 m/s", 'use "injected.ava"', "::error::injected", "##vso[task.injected]",
          "##[error]injected", "error: injected", "action injected() { }"]
BREAKS = ["\n", "\r\n", "\r", "\u2028", "\u0085", "\u000b", "\n\n", "\n///\n", "\u202e\n", " */ \n", "\x1b[2K\n", "\n\t"]
NAMES = ["a\n::error::injected", "::error::injected", "a\rerror: injected", "a\u2028b", "\x1b[2Ja", "a\u202eb", "##vso[task.injected]",
         "a\nrequire injected: 1 > 2"]


class Failed(Exception):
    pass


def check(holds, *what):
    if not holds:
        raise Failed(" ".join(str(one) for one in what)[:600])


def snapshot(home):
    """All that lies beside the clone."""
    found = {}
    for path in sorted(home.rglob("*")):
        if path == home / "clone" or (home / "clone") in path.parents:
            continue
        info = path.lstat()
        held = path.read_bytes() if stat.S_ISREG(info.st_mode) else os.readlink(path) if path.is_symlink() else ""
        found[str(path.relative_to(home))] = (info.st_mode, info.st_nlink, held)
    return found


def limited(files=None, memory=None, threads=None):
    def prepare():
        if memory:
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        if threads is not None:
            resource.setrlimit(resource.RLIMIT_NPROC, (threads, threads))
            if os.getuid() == 0:
                os.setgid(65534)
                os.setuid(65534)
    return prepare


class Home:
    """A home of one try."""

    fixture = None
    number = 0

    def __enter__(self):
        Home.number += 1
        self.home = Home.fixture.with_name(f"h{Home.number:05}")
        shutil.copytree(Home.fixture, self.home, symlinks=True)
        self.clone = self.home / "clone"
        self.before = snapshot(self.home)
        return self

    def __exit__(self, kind, *_):
        try:
            if kind is None:
                self.untouched()
        finally:
            shutil.rmtree(self.home, ignore_errors=True)

    def untouched(self):
        after = snapshot(self.home)
        changed = [name for name in {*self.before, *after} if self.before.get(name) != after.get(name)]
        check(not changed, "touched outside the clone:", changed)

    def run(self, *words, limit_s=TIME_S, stdin=b"", env=None, **limits):
        """Runs a command in the clone; its status and what it said."""
        command = subprocess.Popen([AVASTRA, *map(str, words)], cwd=self.clone, stdin=subprocess.PIPE if isinstance(stdin, bytes) else stdin,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, **(env or {})},
                                   preexec_fn=limited(**limits) if limits else None, start_new_session=True)
        try:
            out, err = command.communicate(stdin if isinstance(stdin, bytes) else None, timeout=limit_s)
        except subprocess.TimeoutExpired:
            os.killpg(command.pid, signal.SIGKILL)
            command.communicate()
            raise Failed(f"hangs: {words}") from None
        said = out.decode(errors="replace") + err.decode(errors="replace")
        short_of_memory = limits.get("memory") and command.returncode in (-signal.SIGABRT, -signal.SIGSEGV)
        check(command.returncode in STATUSES or short_of_memory, words, "status", command.returncode, said)
        check("panicked" not in said, words, said)
        self.in_line(said, words)
        check(not (self.home / "started").exists(), words, "started a program:", said)
        return command.returncode, said

    def in_line(self, said, words):
        for line in said.replace("\r\n", "\n").split("\n"):
            check(not line.strip().startswith("::") and not line.startswith(tuple(FORGED)) and "##vso[" not in line and "##[" not in line, words, "forged line:", repr(line))
            odd = [c for c in line if (ord(c) < 32 and c != "\t") or 127 <= ord(c) < 160 or c in "\u202e\u2066\u2067\u200f"]
            check(not odd, words, "control characters:", repr(line))


def fixture(home):
    clone = home / "clone"
    clone.mkdir(parents=True)
    (home / "folder").mkdir()
    (home / "mine.txt").write_text("mine\n")
    (home / "folder/keep.txt").write_text("kept\n")
    (clone / "x.ava").write_text(UGLY)
    (clone / "driver.py").write_text(DRIVER)
    (clone / "driver.sh").write_text(f"#!/bin/sh\ntouch ../started\nexec '{AVASTRA}' ads toy\n")
    (clone / "driver.sh").chmod(0o755)
    (clone / "profile.yaml").write_text("ads:\n  command: [./driver.sh]\n")
    (clone / "study.yaml").write_text(
        f"space: {SPACE}\nroads: [corner]\nads: cc\nagents: [{{ name: random, repeats: 2 }}]\nevaluation: {{ episodes: 1, seeds: 1 }}\n")

    def made(*words):
        ended = subprocess.run([AVASTRA, *words, "--quiet"], cwd=clone, capture_output=True, text=True, timeout=300)
        assert ended.returncode == 0, (words, ended.stdout, ended.stderr)

    corner = ["--road", "corner"]
    made("run", SPACE, *corner, "--self-contained", "--episodes", "2", "--seed", "8", "--ads", FLICKER, "--out", "run")
    assert (clone / FOUND).is_file(), "the run finds a crash: choose another seed"
    for shard in "12":
        made("estimate", SPACE, *corner, "--shard", f"{shard}/2", "--ads", "cc", "--parts", "2", "--episodes", "1", "--out", f"e{shard}")
        made("run", SPACE, *corner, "--shard", f"{shard}/2", "--ads", FLICKER, "--seed", "8", "--episodes", "2", "--out", f"r{shard}")
    made("study", "study.yaml", "--out", "study")


QUICK = ["run", SPACE, "--road", "corner", "--ads", "cc", "--episodes", "1", "--quiet"]


def messages():
    """A driving system says what would be code, or a line of its own."""
    for at in ("message", "stderr", "internal", "name", "line"):
        for text in FORGED:
            for end in BREAKS if at == "message" else BREAKS[:4]:
                yield f"{at} {text!r} {end!r}", lambda at=at, text=f"x{end}{text}{end}": says(at, text)


def says(at, text):
    with Home() as home:
        how = {"at": at, "text": text, **({"name": text} if at == "name" else {})}
        (home.clone / "how.json").write_text(json.dumps(how))
        (home.clone / "mine.yaml").write_text(f"ads:\n  command: [{sys.executable}, driver.py]\n")
        status, said = home.run("run", SPACE, "--road", "corner", "--ads", "mine.yaml", "--episodes", 1, "--out", "own")
        if (home.clone / "own").is_dir():
            for file in sorted((home.clone / "own").rglob("*.ava")):
                if "failures" in file.parts or "critical" in file.parts:
                    code = [line for line in file.read_text().splitlines() if not line.lstrip().startswith("//")]
                    check(not any(word in line for line in code for word in ("injected:", "injected.ava", "injected()")), "code:", code[:12])
                    ended, told = home.run("check", file)
                    check(ended == 0, "not readable:", told)
                    home.run("replay", file)
            home.run("report", "own")
            home.run("run", "--resume", "own")
        home.run("ads", "check", "--ads", "mine.yaml", "--format", "json")


def names():
    """Names of files that would be lines of their own."""
    commands = [["check"], ["fmt"], ["fmt", "--check"], ["replay"], ["test"], ["report"], ["render"], ["table"], ["compile"], ["run"],
                ["road"], ["diagnose"], ["shrink"], ["export", "--to", "csv"], ["export", "--to", "ava", "--out", "out"], ["diff", "x.ava"],
                ["policy", "explain"], ["study"], ["import"], ["merge"], ["run", "--resume"], ["check", "--fix"]]
    for name in NAMES:
        for command in commands:
            for held in ("scenario", "missing"):
                yield f"{command} {name!r} {held}", lambda name=name, command=command, held=held: named(name, command, held)


def named(name, command, held):
    with Home() as home:
        file = home.clone / f"{name}.ava"
        if held == "scenario":
            shutil.copy(home.clone / FOUND, file)
            shutil.copytree(home.clone / "run/critical/space", home.clone / "space")
            # A folder that holds such a file.
            home.run("test", "run", "--quiet")
            shutil.copy(home.clone / FOUND, home.clone / "run/critical" / file.name)
            home.run("report", "run")
        home.run(*command, "./" + file.name)


def texts():
    """Words of settings, maps and scenarios of others that would be lines of their own."""
    for text in ("x\n::error::injected", "::error::injected", "x\rerror: injected", "x\u0085error: injected", "\x1b[2Jx", "##vso[task.injected]"):
        files = [("study.yaml", ["study", "study.yaml", "--dry-run"]), ("run/run.yaml", ["run", "--resume", "run"]), ("run/run.yaml", ["report", "run"]),
                 ("e1/estimate.yaml", ["estimate", "--resume", "e1"]), ("mine.yaml", ["replay", FOUND, "--ads", "mine.yaml"]),
                 ("own.yaml", [*QUICK, "--traffic", "own.yaml"]), ("e1/estimate.yaml", ["merge", "e1", "e2", "--out", "m"])]
        for file, command in files:
            for at in range(12):
                yield f"{text!r} in {file} at {at}: {command}", lambda *_, t=text, f=file, c=command, a=at: said_in(t, f, c, a)
        for at in range(24):
            yield f"{text!r} in OpenSCENARIO at {at}", lambda *_, t=text, a=at: marked_up(t, Path(XOSC), a, ["import", "theirs.xosc", "--out", "osc"])
            for command in (["road", "theirs.xodr"], ["new", "--map", "theirs.xodr", "fresh"]):
                yield f"{text!r} in a map at {at}: {command}", lambda *_, t=text, a=at, c=command: marked_up(t, ROOT / "scenarios/roads/crossroad.xodr", a, c)


def said_in(text, name, command, at):
    with Home() as home:
        file = home.clone / name
        if name == "mine.yaml":
            shutil.copy(FLICKER, file)
        elif name == "own.yaml":
            file.write_text("speed: 1\nshare: 2\n")
        lines = file.read_text().splitlines()
        quoted = json.dumps(text)
        line = lines[at // 2 % len(lines)]
        key, _, _ = line.partition(":")
        lines[at // 2 % len(lines)] = f"{key}: {quoted}" if at % 2 else f"{key[:len(key) - len(key.lstrip())]}{quoted}: 1"
        file.write_text("\n".join(lines) + "\n")
        home.run(*command)


def marked_up(text, source, at, command):
    """Puts a text into an attribute of XML."""
    with Home() as home:
        parts = source.read_text().replace("../../../scenarios", str(ROOT / "scenarios")).split('="')
        place = 1 + at * (len(parts) - 2) // 24
        _, quote, rest = parts[place].partition('"')
        marked = "".join(f"&#{ord(c)};" if ord(c) >= 32 or c in "\r\n\t" else "" for c in text)
        parts[place] = marked + quote + rest
        (home.clone / f"theirs{source.suffix}").write_text('="'.join(parts))
        home.run(*command)
        for file in home.clone.rglob("*.ava"):
            if file.parent.name in ("osc", "fresh"):
                code = [line for line in file.read_text().splitlines() if not line.lstrip().startswith("//") and '"' not in line]
                check(not any("injected" in line and ":error" in line for line in code), "code:", code[:9])


def uris():
    """Paths that SQLite would take for a URI."""
    for name in ["file:x", "file:x?mode=memory", "file:sub", "file:///tmp/x", "file:.%2f..%2fmine", "file:a?vfs=unix-none#b", "file::memory:",
                 "FILE:x", "file://localhost/x", "file:%00"]:
        for what in ("run", "estimate", "study", "train", "resume", "merge"):
            yield f"{what} {name}", lambda name=name, what=what: uri(name, what)


def uri(name, what):
    with Home() as home:
        out = home.clone / name
        os.symlink(home.home / "folder", home.clone / "sub")
        os.symlink(home.home / "folder", home.clone / "mode")
        before = set(os.listdir(home.clone))
        database = {"run": "run.db", "estimate": "estimate.db", "study": "study.db", "train": "run.db", "resume": "run.db", "merge": "run.db"}
        if what == "run":
            status, said = home.run(*QUICK, "--out", name)
        elif what == "estimate":
            status, said = home.run("estimate", SPACE, "--road", "corner", "--ads", "cc", "--parts", 2, "--episodes", 1, "--out", name)
        elif what == "study":
            status, said = home.run("study", "study.yaml", "--out", name)
        elif what == "train":
            status, said = home.run("train", SPACE, "--road", "corner", "--agent", "bandit", "--ads", "cc", "--episodes", 1, "--out", name)
        elif what == "resume":
            out.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(home.clone / "run", out)
            status, said = home.run("run", "--resume", name)
        else:
            status, said = home.run("merge", "r1", "r2", "--out", name)
        check(status == 0, said)
        check((out / database[what]).stat().st_size > 0, "the database is not in its folder", said)
        new = set(os.listdir(home.clone)) - before
        check(new <= {Path(name).parts[0]}, "further files:", new)
        status, said = home.run("report", name)
        check(status == 0, said)


def rights():
    """Files that are written again keep their rights, their links and their owner."""
    for mode in (0o600, 0o640, 0o644, 0o755, 0o666, 0o4755, 0o444, 0o400):
        for link in ("none", "symbolic", "hard", "both"):
            for command in (["fmt"], ["check", "--fix"], ["export-svg"]):
                yield f"{mode:o} {link} {command}", lambda mode=mode, link=link, command=command: kept_rights(mode, link, command)
    for owner in (1, 65534):
        for link in ("none", "symbolic", "hard"):
            yield f"owner {owner} {link}", lambda owner=owner, link=link: kept_rights(0o644, link, ["fmt"], owner)


def kept_rights(mode, link, command, owner=None):
    with Home() as home:
        own, named = home.clone / "own.ava", home.clone / "named.ava"
        if command == ["export-svg"]:
            own, named = home.clone / "own.svg", home.clone / "named.svg"
            words = ["render", FOUND, "--at", "1", "-o"]
        else:
            words = command
        text = TYPO if command == ["check", "--fix"] else UGLY
        own.write_text(text)
        target = own
        if link in ("hard", "both"):
            os.link(own, home.clone / "further")
        if link in ("symbolic", "both"):
            os.symlink("own" + own.suffix, named)
            target = named
        if owner is not None and os.getuid() == 0:
            os.chown(own, owner, owner)
        own.chmod(mode)
        before = own.stat()
        status, said = home.run(*words, target)
        after = own.stat()
        check((before.st_mode, before.st_uid, before.st_gid, before.st_nlink) == (after.st_mode, after.st_uid, after.st_gid, after.st_nlink),
              "was", before, "is", after)
        check(named.is_symlink() == (link in ("symbolic", "both")), "the link is gone")
        if mode & 0o222:
            check(status == 0 and own.read_text() != text, said)
        else:
            check(status == 1 and "read-only" in said and own.read_text() == text, status, said)
        if link in ("hard", "both"):
            check((home.clone / "further").read_bytes() == own.read_bytes(), "the further name has another text")
        check(not list(home.clone.glob("*.partial*")), "a partial file is left")


def planted(place, what):
    """Puts something that is no text where a file is expected."""
    if place.is_symlink() or place.is_file():
        place.unlink()
    elif place.is_dir():
        shutil.rmtree(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    if what == "pipe":
        os.mkfifo(place)
    elif what == "socket":
        # A socket's path is short.
        here = os.getcwd()
        os.chdir(place.parent)
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(place.name)
        os.chdir(here)
    elif what == "folder":
        place.mkdir()
    elif what == "loop":
        os.symlink(place.name, place)
    elif what == "huge":
        with open(place, "wb") as file:
            file.truncate(1 << 40)
    elif what == "binary":
        place.write_bytes(b"\xff\xfe\0" * 1000)
    else:
        os.symlink(what, place)


SPECIAL = ["pipe", "socket", "folder", "loop", "huge", "binary", "/dev/zero", "/dev/full", "/dev/tty", "/proc/self/mem"]


def special():
    """Pipes, devices and endless files in the place of files."""
    places = [
        ("out/x.ava", ["export", "--to", "ava", "x.ava", "--out", "out"]),
        ("out/corner_0000.ava", ["export", "--to", "ava", FOUND, "--out", "out"]),
        ("run/critical/corner_0000.ava", ["test", "run"]),
        ("run/critical/corner_0000.ava", ["run", "--resume", "run"]),
        ("run/run.yaml", ["report", "run"]),
        ("run/run.db", ["run", "--resume", "run"]),
        ("run/report.html", ["report", "run"]),
        ("m/estimate.yaml", ["merge", "e1", "e2", "--out", "m"]),
        ("m/results.json", ["merge", "e1", "e2", "--out", "m"]),
        ("m.partial", ["merge", "e1", "e2", "--out", "m"]),
        ("m.partial/merge.partial", ["merge", "e1", "e2", "--out", "m"]),
        ("r1/critical/space/avastra45.ava", ["merge", "r1", "r2", "--out", "m"]),
        ("e1/shard.yaml", ["merge", "e1", "e2", "--out", "m"]),
        ("x.ava", ["fmt", "x.ava"]),
        ("x.ava", ["check", "--fix", "x.ava"]),
        ("reused", ["study", "study.yaml", "--reuse", "reused", "--dry-run"]),
        ("reused/study.yaml", ["study", "study.yaml", "--reuse", "reused", "--out", "s"]),
        ("run/critical/corner_0000.answers.jsonl", ["replay", FOUND]),
    ]
    for place, command in places:
        for what in SPECIAL:
            yield f"{what} as {place}: {command}", lambda place=place, command=command, what=what: is_special(place, command, what)


def is_special(place, command, what):
    with Home() as home:
        planted(home.clone / place, what)
        status, said = home.run(*command, limit_s=30, memory=4 << 30)
        if "--dry-run" in command:
            check(status != 0, "a study that cannot be read is passed over:", said)


def forged(database, change):
    with sqlite3.connect(database) as connection:
        connection.executescript(change)
    connection.close()


def databases():
    """Views, triggers, conditions and rows in a database from elsewhere."""
    slow = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n WHERE x < 1000000000) SELECT max(x) FROM n"
    remade = ("PRAGMA legacy_alter_table = ON; ALTER TABLE {0} RENAME TO old; CREATE TABLE {0} ({1}) STRICT; "
              "INSERT INTO {0} SELECT * FROM old; DROP TABLE old;")
    seal = "unit INTEGER PRIMARY KEY, digest TEXT NOT NULL"
    changes = {
        "a condition": remade.format("seal", seal + ", CHECK (length(hex(zeroblob(200000000))) > 0)"),
        "a condition on a column": remade.format("seal", seal + " CHECK (length(replace(hex(zeroblob(90000000)), '00', '1111')) > 0)"),
        "a default": remade.format("seal", "unit INTEGER PRIMARY KEY, digest TEXT NOT NULL DEFAULT (hex(randomblob(9)))"),
        "a collation": remade.format("seal", "unit INTEGER PRIMARY KEY, digest TEXT NOT NULL COLLATE NOCASE"),
        "a table with a condition": "CREATE TABLE more (x CHECK (length(hex(zeroblob(x))) > 0)); INSERT INTO more VALUES (200000000);",
        "a view": f"CREATE VIEW more AS {slow};",
        "a view as a table": f"ALTER TABLE begun RENAME TO old; CREATE VIEW begun AS SELECT 1 AS only, ({slow}) AS settings;",
        "a trigger": f"CREATE TRIGGER more AFTER INSERT ON seal BEGIN {slow.replace('WITH RECURSIVE n(x) AS (', 'SELECT x FROM (').replace(') SELECT max(x) FROM n', ')').replace('SELECT 1 UNION ALL SELECT x + 1 FROM n WHERE x < 1000000000', 'SELECT 1 AS x')}; END;",
        "an index": "CREATE INDEX more ON seal (hex(digest));",
        "a partial index": "CREATE INDEX more ON seal (digest) WHERE length(digest) > 3;",
        "a column": "ALTER TABLE seal ADD COLUMN more TEXT;",
        "a computed column": "ALTER TABLE seal ADD COLUMN more INTEGER AS (length(hex(zeroblob(unit + 100000000))));",
        "statistics": "ANALYZE;",
        "a virtual table": "CREATE VIRTUAL TABLE more USING fts5(x);",
        "many seals": "INSERT INTO seal SELECT value, 'x' FROM (WITH RECURSIVE n(value) AS (SELECT 1000 UNION ALL SELECT value + 1 FROM n "
                      "WHERE value < 1000000) SELECT value FROM n);",
        "a name": "UPDATE begun SET settings = settings || char(10) || '::error::injected: 1';",
        "no table": "DROP TABLE seal;",
        "another version": "PRAGMA user_version = 1000000;",
        "schema by hand": "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'digest TEXT NOT NULL', "
                          "'digest TEXT NOT NULL CHECK (length(hex(zeroblob(200000000))) > 0)') WHERE name = 'seal';",
    }
    commands = [("run/run.db", ["report", "run"]), ("run/run.db", ["run", "--resume", "run"]), ("r1/run.db", ["merge", "r1", "r2", "--out", "m"]),
                ("study/study.db", ["study", "--resume", "study"]), ("e1/estimate.db", ["merge", "e1", "e2", "--out", "m"]), ("run/run.db", ["test", "run"])]
    for what, change in changes.items():
        for database, command in commands:
            yield f"{what}: {command}", lambda what=what, change=change, database=database, command=command: stranger(what, change, database, command)


def stranger(what, change, database, command):
    with Home() as home:
        try:
            forged(home.clone / database, change)
        except sqlite3.Error as error:
            check(False, "the attack cannot be made:", error)
        status, said = home.run(*command, limit_s=20, memory=3 << 30)
        if what not in ("many seals", "a name", "no table") and command[0] != "test":
            check("no table that avastra makes" in said or "layout" in said or "damaged" in said, status, said)


def journals():
    """What lies beside a database, where SQLite looks."""
    commands = [("run/run.db", ["report", "run"]), ("run/run.db", ["run", "--resume", "run"]), ("r1/run.db", ["merge", "r1", "r2", "--out", "m"]),
                ("e1/estimate.db", ["merge", "e1", "e2", "--out", "m"]), ("study/study.db", ["study", "--resume", "study"])]
    for ending in ("-journal", "-wal", "-shm"):
        for what in ("pipe", "socket", "folder", "loop", "/dev/zero", "mine", "hard link", "garbage", "super journal"):
            for database, command in commands:
                yield f"{what} as {ending}: {command}", lambda *_, e=ending, w=what, d=database, c=command: beside(e, w, d, c)


def beside(ending, what, database, command):
    with Home() as home:
        place = home.clone / (database + ending)
        if what == "mine":
            os.symlink(home.home / "mine.txt", place)
        elif what == "hard link":
            os.link(home.home / "mine.txt", place)
            home.before = snapshot(home.home)
        elif what == "garbage":
            place.write_bytes(b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7" + bytes(range(256)) * 40)
        elif what == "super journal":
            # A journal that names another one, which is to be removed with it.
            name = str(home.home / "mine.txt").encode()
            total = sum(name) & 0xFFFFFFFF
            tail = (0x0F00).to_bytes(4, "big") + name + len(name).to_bytes(4, "big") + total.to_bytes(4, "big") + b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
            head = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7" + (0).to_bytes(4, "big") + b"\0" * 4 + (1).to_bytes(4, "big") + (512).to_bytes(4, "big") + (4096).to_bytes(4, "big")
            place.write_bytes(head.ljust(512, b"\0") + tail)
        else:
            planted(place, what)
        home.run(*command, limit_s=20)


def held(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name not in ("timing.jsonl", "report.html")}


def shim():
    compiler, made = shutil.which("cc"), Home.fixture.with_name("kill.so")
    if compiler and not made.exists():
        subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", made, ROOT / "tests/interop/kill.c", "-ldl"], check=True)
    return made if compiler else None


def struck(home, words, moment, preload):
    """Runs a command and kills it at its nth change of a file, or after some milliseconds."""
    env = {**os.environ, **({"LD_PRELOAD": str(preload), "FAULT_AT": str(moment), "FAULT_MODE": "kill"} if preload else {})}
    command = subprocess.Popen([AVASTRA, *words], cwd=home.clone, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        command.wait(TIME_S if preload else moment * 0.01)
    except subprocess.TimeoutExpired:
        command.kill()
        command.wait()
        check(not preload, "hangs")


def kills():
    """Commands are killed, and the next one goes on."""
    for kind, moments in (("merge", range(1, 61)), ("resume", range(1, 41)), ("fmt", range(1, 9))):
        for moment in moments:
            yield f"{kind} at {moment}", lambda kind=kind, moment=moment: killed(kind, moment)


def killed(kind, moment):
    preload = shim()
    with Home() as home:
        if kind == "merge":
            struck(home, ["merge", "r1", "r2", "--out", "m"], moment, preload)
            if moment % 3 == 0:
                struck(home, ["merge", "r1", "r2", "--out", "m"], moment // 2 + 1, preload)
            status, said = home.run("merge", "r1", "r2", "--out", "m")
            check(status == 0, said)
            home.run("merge", "r1", "r2", "--out", "other")
            check(held(home.clone / "m") == held(home.clone / "other"), "the merged directories differ")
        elif kind == "resume":
            shutil.rmtree(home.clone / "run/critical/space")
            for file in (home.clone / "run/critical").glob("*.ava"):
                file.unlink()
            words = ["run", SPACE, "--road", "corner", "--ads", FLICKER, "--seed", "8", "--episodes", "2", "--jobs", "1", "--self-contained", "--out", "fresh"]
            struck(home, words, moment, preload)
            status, said = home.run("run", "--resume", "fresh")
            if status != 0:
                status, said = home.run(*words)
            check(status == 0, said)
        else:
            for name in "abc":
                (home.clone / f"{name}.ava").write_text(UGLY)
            struck(home, ["fmt", "a.ava", "b.ava", "c.ava"], moment, preload)
            for name in "abc":
                check((home.clone / f"{name}.ava").read_text() in (UGLY, NEAT), "a torn file")
                (home.clone / f"{name}.ava").write_text(UGLY)
            home.run("fmt", "a.ava", "b.ava", "c.ava")
        left = [path for path in home.clone.rglob("*.partial*")]
        check(not left, "left behind:", left)


def races():
    """Two merges into one directory: nothing is destroyed, and what is there is whole."""
    for number in range(20):
        yield f"race {number}", lambda number=number: raced(number)


def raced(number):
    with Home() as home:
        words = [AVASTRA, "merge", "r1", "r2", "--out", "m"]
        pair = []
        for delay in (0, number * 0.004):
            time.sleep(delay)
            pair.append(subprocess.Popen(words, cwd=home.clone, stdout=subprocess.PIPE, stderr=subprocess.STDOUT))
        said = [one.communicate(timeout=TIME_S)[0].decode() for one in pair]
        ended = [one.returncode for one in pair]
        check(0 in ended and all(status in (0, 1) for status in ended), ended, said)
        for status, text in zip(ended, said):
            check(status == 0 or "at work" in text or "is not empty" in text, text)
        home.run("merge", "r1", "r2", "--out", "other")
        check(held(home.clone / "m") == held(home.clone / "other"), "the merged directories differ", ended, said)
        check(not list(home.clone.glob("*.partial*")), "left behind:", ended, said)


def threads():
    """No threads, or little memory."""
    commands = [["check", FOUND], ["fmt", "--check", "x.ava"], ["run", SPACE, "--road", "corner", "--ads", "cc", "--episodes", "2", "--out", "t"],
                ["replay", FOUND], ["test", "run"], ["table", SPACE, "--try"], ["study", "study.yaml", "--out", "t"],
                ["estimate", SPACE, "--road", "corner", "--ads", "cc", "--parts", "2", "--episodes", "1", "--out", "t"], ["diagnose", FOUND],
                ["train", SPACE, "--road", "corner", "--agent", "bandit", "--ads", "cc", "--episodes", "1", "--out", "t"], ["report", FOUND], ["lsp"]]
    for command in commands:
        for limits in ({"threads": 1}, {"threads": 0}, {"memory": 300 << 20}, {"memory": 200 << 20}):
            yield f"{limits} {command}", lambda command=command, limits=limits: short(command, limits)


def short(command, limits):
    with Home() as home:
        if "threads" in limits:
            for path in [home.clone, *home.clone.rglob("*")]:
                path.chmod(0o777 if path.is_dir() else 0o666)
        status, said = home.run(*command, **limits)
        if "threads" in limits and command[0] != "lsp":
            check(status in (0, 2, 3, 4), status, said)
        shutil.rmtree(home.clone / "t", ignore_errors=True)


def inputs():
    """Standard input without an end, and much of everything."""
    for command in (["fmt", "-"], ["fmt", "--check", "-"]):
        for source in ("/dev/zero", "/dev/urandom", "huge"):
            yield f"{command} {source}", lambda command=command, source=source: endless(command, source)
    for text in (b"\0" * 100, b"\xff", UGLY.encode(), b"(" * 100000):
        yield f"fmt - {text[:9]!r}", lambda text=text: fed(text)
    yield "10,000 scenarios of one space", many


def endless(command, source):
    with Home() as home:
        if source == "huge":
            planted(home.clone / "huge", "huge")
            source = home.clone / "huge"
        with open(source, "rb") as file:
            status, said = home.run(*command, stdin=file, limit_s=20, memory=2 << 30)
        check(status == 1, said)


def fed(text):
    with Home() as home:
        home.run("fmt", "-", stdin=text)


def many():
    with Home() as home:
        text = (home.clone / FOUND).read_text()
        (home.clone / "many").mkdir()
        shutil.copytree(home.clone / "run/critical/space", home.clone / "many/space")
        for number in range(10_000):
            (home.clone / f"many/s{number}.ava").write_text(text)
        files = [f"many/s{number}.ava" for number in range(10_000)]
        status, said = home.run("check", "--quiet", *files, limit_s=20)
        check(status == 0, said)


CLASSES = [messages, names, texts, uris, rights, special, databases, journals, kills, races, threads, inputs]


def main():
    chosen = [one for one in CLASSES if not sys.argv[2:] or one.__name__ in sys.argv[2:]]
    table, wrong = [], []
    with tempfile.TemporaryDirectory(prefix="hostile") as scratch:
        os.chmod(scratch, 0o755)
        Home.fixture = Path(scratch).resolve() / "fixture"
        fixture(Home.fixture)
        for attacks in chosen:
            begun, failed, tries = time.monotonic(), [], 0
            for name, attack in attacks():
                tries += 1
                try:
                    attack()
                except Failed as error:
                    failed.append(f"{attacks.__name__}: {name}: {error}")
            table.append((attacks.__name__, tries, len(failed), time.monotonic() - begun))
            wrong += failed
            print(f"{attacks.__name__:<12}{tries:>5} tries {len(failed):>4} failed {time.monotonic() - begun:>7.0f} s  {attacks.__doc__}", flush=True)
            for one in failed[:5]:
                print(f"    {one}", flush=True)
    print(f"{'together':<12}{sum(row[1] for row in table):>5} tries {len(wrong):>4} failed")
    sys.exit(1 if wrong else 0)


random.seed(2026)
main()
