"""Where the program `avastra` is."""

import os
import shutil
import sys
import sysconfig
from typing import Optional


def path_of(named: str) -> Optional[str]:
    """The path of a program: on the PATH, or beside this Python, where the wheel puts the command `avastra`."""
    beside = [os.path.dirname(sys.executable), sysconfig.get_path("scripts")]
    return shutil.which(named) or shutil.which(named, path=os.pathsep.join(beside))
