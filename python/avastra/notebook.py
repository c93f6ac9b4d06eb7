"""What runs left behind, for notebooks: tables as data frames, and scenarios as replays to watch.

    run = avastra.runs("runs/0001")
    run.collisions[run.collisions["counted"] == 1].groupby("cause").size()
    run                                     # as the last line of a cell: the page of `avastra report`

Frames need pandas or polars, whichever is asked for; pages need the program `avastra` in the PATH, or named by the environment
variable AVASTRA. Neither is installed with this package.
"""

import html
import importlib
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, List, Union

from .engine import read_run
from .program import path_of

__all__ = ["Run", "Scenario", "runs"]

#: How high a page is in a notebook, px.
HEIGHT_PX = 720


class _Page:
    """Something that `avastra report` makes a page of."""

    path: Path

    def report(self) -> str:
        """The page of `avastra report`: self-contained HTML, which plays every scenario again to show it."""
        named = os.environ.get("AVASTRA", "avastra")
        program = path_of(named)
        if program is None:
            raise FileNotFoundError(f"there is no program `{named}`, which draws the page: `cargo install --locked --path .` in avastra's "
                                    "repository installs it, or name it with the environment variable AVASTRA")
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "report.html"
            asked = [program, "report", str(self.path), "--out", str(page), "--quiet"]
            ended = subprocess.run(asked, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
            # A scenario that does not play as it claims is a finding, and stands on the page.
            if ended.returncode not in (0, 3):
                raise RuntimeError(f"`avastra report {self.path}` ended with status {ended.returncode}:\n{ended.stderr.strip()}")
            return page.read_text(encoding="utf-8")

    def _repr_html_(self) -> str:
        # Links of the page are parts of its own address, which is this one in a frame that is written in place.
        page = self.report().replace("<head>", '<head><base href="about:srcdoc">', 1)
        return (f'<iframe srcdoc="{html.escape(page)}" title="{html.escape(str(self.path))}" '
                f'style="width: 100%; height: {HEIGHT_PX}px; border: 0"></iframe>')


class Scenario(_Page):
    """An emitted scenario, to be watched: as the last line of a cell it is its replay."""

    def __init__(self, path: "Union[str, os.PathLike[str]]") -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise FileNotFoundError(f"no scenario `{self.path}`")

    def __repr__(self) -> str:
        return f"<avastra.Scenario {self.path}>"


class Run(_Page):
    """A run or a training: its tables as data frames, and its scenarios.

    `episodes` has a row for each episode, `steps` for each step, `collisions` for each collision; they join by `episode`, and by
    `step`. Columns are those of `avastra.read_run`; where a value has none, the frame has its own word for that.
    """

    def __init__(self, path: "Union[str, os.PathLike[str]]", frames: str = "pandas") -> None:
        self.path = Path(path)
        tables = read_run(self.path)
        make = _FRAMES.get(frames)
        if make is None:
            raise ValueError(f"no frames of `{frames}`: `pandas` or `polars`")
        try:
            library = importlib.import_module(frames)
        except ImportError as error:
            raise ImportError(f"{frames} is not installed ({error}): `pip install {frames}`; `avastra.read_run` has the same as "
                              "NumPy arrays") from error
        self.episodes, self.steps, self.collisions = (make(library, tables[name]) for name in ("episode", "step", "collision"))

    @property
    def scenarios(self) -> List[Scenario]:
        """The scenarios of its crashes, by name."""
        return [Scenario(path) for path in sorted((self.path / "critical").glob("*.ava"))]

    def __repr__(self) -> str:
        counts = ((len(self.episodes), "episodes"), (len(self.steps), "steps"), (len(self.collisions), "collisions"))
        return f"<avastra.Run {self.path}: {', '.join(f'{count:,} {what}' for count, what in counts)}>"


def runs(path: "Union[str, os.PathLike[str]]", frames: str = "pandas") -> Run:
    """What `avastra run` or `avastra train` wrote, as frames of `pandas` or `polars`; shown in a notebook, its page.

    Raises `ValueError` if there is no run, or another version of avastra wrote it.
    """
    return Run(path, frames)


def _pandas(pandas: Any, table: Any) -> Any:
    def column(values: Any) -> Any:
        # -1 is no number of anything: it stands for none.
        has_none = values.dtype.kind == "i" and (values < 0).any()
        return pandas.Series(values).astype("Int64").mask(values < 0) if has_none else values

    return pandas.DataFrame({name: column(values) for name, values in table.items()})


def _polars(polars: Any, table: Any) -> Any:
    def column(name: str, values: Any) -> Any:
        if values.dtype.kind == "O":
            return polars.Series(name, values.tolist(), dtype=polars.String)
        series = polars.Series(name, values)
        if values.dtype.kind == "f":
            return series.fill_nan(None)
        return series.set(series < 0, None) if values.dtype.kind == "i" and (values < 0).any() else series

    return polars.DataFrame([column(name, values) for name, values in table.items()])


_FRAMES = {"pandas": _pandas, "polars": _polars}
