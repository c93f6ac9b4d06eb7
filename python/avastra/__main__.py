"""The command `avastra`, which the wheel brings along: `python -m avastra`."""

import sys

from ._native import main


def command() -> None:
    sys.exit(main(["avastra", *sys.argv[1:]]))


if __name__ == "__main__":
    command()
