"""Where the program `avastra` is."""

import os
import shutil
import sys
from typing import Optional


def found(named: str) -> Optional[str]:
    """The path of a program: on the PATH, or beside this Python, where the wheel puts the command `avastra`."""
    return shutil.which(named) or shutil.which(named, path=os.path.dirname(sys.executable))
