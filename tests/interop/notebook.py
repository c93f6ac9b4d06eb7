"""Runs the notebooks of python/examples where they lie, as a reader would: notebook.py. None may have outputs in its file."""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]

for file in sorted((ROOT / "python/examples").glob("*.ipynb")):
    notebook = nbformat.read(file, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells), f"{file.name} has outputs: clear them"
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(file.parent)}}).execute()
    shown = [output["data"]["text/html"] for cell in cells for output in cell.outputs if "text/html" in output.get("data", {})]
    assert any("<iframe srcdoc=" in html for html in shown), f"{file.name} shows no replay"
    assert any("<table" in html for html in shown), f"{file.name} shows no frame"
    print(f"{file.name}: {len(cells)} cells")
