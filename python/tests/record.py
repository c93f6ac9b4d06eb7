"""Writes `conversation.jsonl`: what the stand-in and `examples/acceleration.py` say to each other in the first 2.5 s at a red light.

To be run again when the protocol changes; then read the difference.
"""

import json
import pathlib
import sys

from stand_in import INIT, Program, World

HERE = pathlib.Path(__file__).parent


def main() -> None:
    program = Program([sys.executable, str(HERE.parent / "examples" / "acceleration.py")])
    program.ask(INIT)
    world = World("light")
    world.other = [60.0, 6.0]
    program.ask(world.map)
    program.ask(world.reset())
    for seq in range(25):
        world.obey(program.ask(world.step(seq)))
    program.ask({"type": "event", "kind": "end", "t_us": world.time_us}, answered=False)
    program.close()
    lines = [json.dumps([direction, json.loads(line)]) for direction, line in program.talk]
    (HERE / "conversation.jsonl").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
