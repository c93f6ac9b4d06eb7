"""How many vehicle-seconds avastra simulates per CPU second for each of SUMO's, in the same minutes: sumo_ticks.py AVASTRA.

Needs SUMO's package (`pip install eclipse-sumo==1.28.0 libsumo==1.28.0`). Both drive about as many vehicles, and those that are
there are counted, the ego vehicle included. SUMO (0.1 s) follows, changes lanes and gives way on a grid of signalised junctions;
only its steps are timed. avastra (0.02 s, `idm`) has vehicle dynamics, contacts and judging as well; its start and its maps
are taken out by the difference of two runs.
"""

import os
import random
import resource
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

ROUNDS = 3
SUMO_STEPS = 6000
EPISODES = (6, 30)


def peer(wanted):
    """SUMO's vehicle-seconds per CPU second with about so many vehicles."""
    import libsumo
    import sumo

    binaries = os.path.join(sumo.SUMO_HOME, "bin")
    with tempfile.TemporaryDirectory() as folder:
        net = os.path.join(folder, "grid.net.xml")
        grid = ["--grid", "--grid.number", "5", "--grid.length", "150", "-L", "2", "--tls.guess", "true"]
        subprocess.run([os.path.join(binaries, "netgenerate"), *grid, "-o", net], check=True, capture_output=True)
        libsumo.start(["sumo", "-n", net, "--step-length", "0.1", "--no-step-log", "--no-warnings", "--seed", "1"])
        chance = random.Random(1)
        edges = [edge for edge in libsumo.edge.getIDList() if not edge.startswith(":")]
        routes = 0
        while routes < 300:
            begin, end = chance.sample(edges, 2)
            way = libsumo.simulation.findRoute(begin, end).edges
            if len(way) > 3:
                libsumo.route.add(f"r{routes}", way)
                routes += 1
        added, seconds, spent = 0, 0.0, 0.0
        for step in range(SUMO_STEPS):
            there = libsumo.vehicle.getIDCount()
            for _ in range(wanted - there):
                libsumo.vehicle.add(f"v{added}", f"r{chance.randrange(routes)}", departPos="random", departSpeed="max")
                added += 1
            begun = time.process_time()
            libsumo.simulationStep()
            if step >= SUMO_STEPS // 6:
                spent += time.process_time() - begun
                seconds += 0.1 * there
        libsumo.close()
    print(seconds / spent)


def played(avastra, ambient, episodes):
    """CPU seconds of a run, and its vehicle-seconds."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "run")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        settings = ["--ads", "idm", "--agent", "none", "--ambient", str(ambient), "--episodes", str(episodes)]
        subprocess.run([avastra, "run", "scenarios/avastra45.ava", *settings, "--repeat", "0", "--keep", "0", "--jobs", "1", "--out", out],
                       check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        table = sqlite3.connect(os.path.join(out, "run.db"))
        (others,) = table.execute("SELECT avg(numObs) FROM step").fetchone()
        (seconds,) = table.execute("SELECT sum(duration_s) FROM episode").fetchone()
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, (others + 1) * seconds, others + 1


def main(avastra):
    for ambient in (20, 60):
        ratios, rates = [], []
        for _ in range(ROUNDS):
            few, many = (played(avastra, ambient, episodes) for episodes in EPISODES)
            ours = (many[1] - few[1]) / (many[0] - few[0])
            found = subprocess.run([sys.executable, __file__, "--peer", str(round(many[2]))], check=True, capture_output=True, text=True)
            theirs = float(found.stdout)
            rates.append((ours, theirs, many[2]))
            ratios.append(ours / theirs)
        ours, theirs, there = (statistics.median(column) for column in zip(*rates))
        print(f"ambient {ambient}: {there:.1f} vehicles there; avastra {ours:,.0f}, SUMO {theirs:,.0f} vehicle-seconds per CPU second: {statistics.median(ratios):.2f}")


if sys.argv[1:2] == ["--peer"]:
    peer(int(sys.argv[2]))
else:
    main(*sys.argv[1:])
