"""Whether a run says the truth about its next hour: `next_hour.py AVASTRA OUT [HOURS]`.

Plays a long campaign of random episodes against each of three driving systems (100 simulated hours by default, 15 minutes of a processor for all) and
cuts each into windows. From a window alone follows the interval of the chance that an hour shows a new kind, by the formula of
`base::statistics::unseen`, written here once more. A kind is one without a cause. The truth is the share of the other hours of the campaign that show a kind which the window has not.
Then `--until` is tried: each campaign is begun at 40 places, and stops there by its rule. Campaigns in OUT are not played again.
"""

import collections
import math
import pathlib
import sqlite3
import subprocess
import sys

from systems import recurs

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The space, the driving system and the vehicles of ordinary traffic of each campaign.
CAMPAIGNS = {
    "reactive": ("avastra45_law.ava", "reactive", 6),
    "frenet": ("manoeuvres.ava", "frenet", 6),
    "dirty sensors": ("manoeuvres.ava", str(ROOT / "scenarios/ads/degraded.yaml"), 6),
}
WINDOWS_H = (1, 2, 5, 10)
UNTIL = (0.5, 0.3)
PLACES = 40
#: Episodes between two looks: four rounds of four roads.
BLOCK = 16


def bisect(low, high, is_above):
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return high


def at_most(count, mean):
    return sum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in range(count + 1))


def next_hour(seen, hours):
    """The 90 % interval of the chance of a new kind, from how often each kind was seen."""
    once, twice = (sum(times == wanted for times in seen.values()) for wanted in (1, 2))
    variance = once + 2 * twice + 1
    low = max(0.0, once - 1.6448536 * math.sqrt(variance))
    above = bisect(1e-9, 10 * once + 30, lambda mean: at_most(once, mean) <= 0.05)
    high = once + (above - once) * math.sqrt(variance / (once + 1))
    return tuple(1 - math.exp(-events / hours) for events in (low, high))


def episodes(database):
    """Of each episode, in their order: its hours, and the kinds that recur in it."""
    kinds = collections.defaultdict(set)
    for episode, kind, recurred, replays in database.execute(
        "SELECT episode, precrash, recurred, replays FROM collision WHERE counted AND precrash_number != 37"
        " AND precrash != 'wreck of another crash'"
        " UNION ALL SELECT episode, requirement, recurred, replays FROM breach"
    ):
        if replays and recurs(recurred, replays):
            kinds[episode].add(kind)
    rows = database.execute("SELECT episode, duration_s FROM episode ORDER BY episode")
    return [(seconds / 3600, kinds[episode]) for episode, seconds in rows]


def hours_of(all_episodes):
    """The kinds of each whole hour."""
    found, passed = [set()], 0.0
    for hours, kinds in all_episodes:
        found[-1] |= kinds
        passed += hours
        if passed >= len(found):
            found.append(set())
    return found[:-1]


def windows(all_episodes, length_h):
    """Each window of so many hours: its beginning, its length, and how often each kind was seen in it."""
    begun, passed, seen = 0.0, 0.0, collections.Counter()
    for hours, kinds in all_episodes:
        passed += hours
        seen.update(kinds)
        if passed - begun >= length_h:
            yield begun, passed - begun, seen
            begun, seen = passed, collections.Counter()


def chance(hours, known, begun, length):
    """The share of the hours outside of a window that show a kind which is not known."""
    others = [kinds for hour, kinds in enumerate(hours) if not begun - 1 <= hour <= begun + length]
    return sum(not kinds <= known for kinds in others) / len(others)


def stopped(all_episodes, first, until):
    """Where a campaign that begins at an episode stops: its hours, and the kinds that it knows; nothing if it reaches the end."""
    passed, seen = 0.0, collections.Counter()
    for number, (hours, kinds) in enumerate(all_episodes[first:], 1):
        passed += hours
        seen.update(kinds)
        if number % BLOCK == 0 and next_hour(seen, passed)[1] <= until:
            return passed, set(seen)
    return None


def main():
    avastra, out = sys.argv[1], pathlib.Path(sys.argv[2])
    hours = sys.argv[3] if len(sys.argv) > 3 else "100"
    held, all_windows = 0, 0
    for name, (space, ads, ambient) in CAMPAIGNS.items():
        folder = out / name.replace(" ", "_")
        if not (folder / "run.db").exists():
            command = [avastra, "run", ROOT / "scenarios" / space, "--ads", ads, "--ambient", str(ambient), "--hours", hours]
            subprocess.run([*command, "--seed", "11", "--jobs", "1", "-q", "-o", folder], check=True, stdout=subprocess.DEVNULL)
        played = episodes(sqlite3.connect(folder / "run.db"))
        by_hour = hours_of(played)
        kinds = collections.Counter(kind for _, found in played for kind in found)
        print(f"{name}: {sum(hours for hours, _ in played):.0f} h, {len(kinds)} kinds, seen in {sorted(kinds.values())} episodes")
        for length_h in WINDOWS_H:
            count, covered, width, truth = 0, 0, 0.0, 0.0
            for begun, length, seen in windows(played, length_h):
                low, high = next_hour(seen, length)
                true = chance(by_hour, set(seen), begun, length)
                count, covered, width, truth = count + 1, covered + (low <= true <= high), width + high - low, truth + true
            print(f"  {length_h:2} h: {covered} of {count} intervals hold the truth, which is {truth / count:.2f} on average; "
                  f"their mean width is {width / count:.2f}")
            held, all_windows = held + covered, all_windows + count
        for until in UNTIL:
            kept, ends = 0, []
            for first in (len(played) // 2 * place // PLACES for place in range(PLACES)):
                end = stopped(played, first, until)
                if end:
                    begun = sum(hours for hours, _ in played[:first])
                    ends.append(end[0])
                    kept += chance(by_hour, end[1], begun, end[0]) <= until
            middle = f"after {sorted(ends)[len(ends) // 2]:.0f} h" if ends else "never"
            print(f"  --until {until}: stops {middle}; {kept} of {len(ends)} keep it")
    print(f"{held} of {all_windows} intervals hold the truth ({held / all_windows:.0%}; at least 85 % are asked)")
    sys.exit(held / all_windows < 0.85)


if __name__ == "__main__":
    main()
