"""Mutates OpenSCENARIO files and imports each: no panic, none over a second, and nothing is read or written but what is named.

Arguments: the program, how many mutants, and folders that hold `.xosc` files (our cases in tests/cases/imports, and public ones). A mutant
lies beside its original, so that it finds maps and catalogues. With `strace` on the path, of each tenth mutant every file that the program opens must lie in
the original's repository, in the folder of the result, or belong to the system's libraries; without it that is not looked at.
"""

import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HANG_S = 1.0
VALUES = ["", "-1", "0", "1e300", "1e9", "NaN", "inf", "${", "$x", "${1/0}", "${$a + }", "é", "../../../../etc/passwd", "/etc/passwd",
          "999999999999", "true", "Ego", "startTransition", "0.0001", "&#0;", "<", "lane"]
TOKEN = re.compile(r'"[^"<]*"|<[A-Za-z]+|[A-Za-z]+=')
SYSTEM = ("/lib", "/usr", "/etc/ld.so", "/proc", "/sys", "/dev")


def mutant(text, rng):
    for _ in range(rng.randint(1, 3)):
        kind = rng.random()
        if kind < 0.6:
            token = rng.choice(list(TOKEN.finditer(text)))
            other = rng.choice(list(TOKEN.finditer(text))).group()
            new = f'"{rng.choice(VALUES)}"' if token.group()[0] == '"' and rng.random() < 0.7 else other
            text = text[:token.start()] + new + text[token.end():]
        elif kind < 0.9:
            lines = text.split("\n")
            at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
            lines[at:at + 1] = [[], [lines[at]] * 2, [lines[other]]][rng.randrange(3)]
            text = "\n".join(lines)
        else:
            text = text[:rng.randrange(len(text))]
        if not list(TOKEN.finditer(text)):
            break
    return text


def run(command):
    usage = lambda: resource.getrusage(resource.RUSAGE_CHILDREN)
    before = usage()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, errors="replace", check=False)
    except subprocess.TimeoutExpired:
        return None, "", 60.0
    after = usage()
    return done.returncode, done.stdout + done.stderr, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    avastra, count, folders = Path(sys.argv[1]).resolve(), int(sys.argv[2]), [Path(folder).resolve() for folder in sys.argv[3:]]
    files = [(folder, file) for folder in folders for file in sorted(folder.rglob("*.xosc"))]
    rng, wrong, statuses = random.Random(1), [], {0: 0, 1: 0, 2: 0}
    strace = shutil.which("strace")
    for number in range(count):
        folder, file = rng.choice(files)
        made = file.with_name(f"mutant_{number}.xosc")
        try:
            made.write_text(mutant(file.read_text(errors="replace"), rng), errors="replace")
            with tempfile.TemporaryDirectory() as out:
                command = [avastra, "import", "--out", out, made]
                status, said, took_s = run(command)
                statuses[status] = statuses.get(status, 0) + 1
                if status not in (0, 1, 2) or "panicked" in said or took_s > HANG_S:
                    wrong.append(f"{file.name} {number}: status {status}, {took_s:.1f} s: {said[-200:]}")
                if strace and number % 10 == 0:
                    trace = Path(out) / "trace"
                    run([strace, "-f", "-e", "trace=openat,open,creat,unlink,rename,mkdir,execve", "-o", trace, *command])
                    for path, rest in re.findall(r'"(/[^"]*)"([^\n]*)', trace.read_text(errors="replace")):
                        # The repository of the original: maps and catalogues lie beside scenarios there.
                        known = [str(out), str(folder), str(folder.parents[1]), str(avastra), *SYSTEM]
                        if not path.startswith(tuple(known)) and "ENOENT" not in rest:
                            wrong.append(f"{file.name} {number}: opens {path}")
        finally:
            made.unlink(missing_ok=True)
    for one in wrong:
        print(one)
    print(f"{count} mutants: {statuses.get(0, 0)} imported, {statuses.get(2, 0)} refused, {statuses.get(1, 0)} otherwise; {len(wrong)} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
