"""Every example runs, in an empty folder, and leaves nothing behind."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from support.optional import needs
from support.places import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example, tmp_path):
    done = subprocess.run([sys.executable, str(example)], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert list(tmp_path.iterdir()) == []


@needs("nbclient", "ipykernel", "pandas", "xarray")
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_tables_and_figures(notebook, tmp_path):
    import nbformat
    from nbclient import NotebookClient

    cells = NotebookClient(
        nbformat.read(notebook, as_version=4), kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()["cells"]  # raises for a cell that fails
    shown = {kind for cell in cells for output in cell.get("outputs", ()) for kind in output.get("data", ())}
    assert {"text/html", "image/png"} <= shown
    assert not [output for cell in cells for output in cell.get("outputs", ()) if output["output_type"] == "stream"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(notebook):
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    assert not [cell for cell in cells if cell.get("outputs") or cell.get("execution_count")]
