"""The notebooks of the documentation run; what they keep is small and names no machine's paths."""

import os
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs" / "notebooks").glob("*.ipynb"))


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request):
    return nbformat.read(request.param, as_version=4)


@pytest.mark.slow
@pytest.mark.sim
def test_a_notebook_runs_and_its_stored_outputs_are_of_the_same_kinds(
    notebook, tmp_path, monkeypatch
):
    # Shell lines call `roboirg`, which lies beside this Python.
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    kept = [kinds_of_outputs(cell) for cell in notebook.cells]

    nbclient.NotebookClient(
        notebook, timeout=None, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()

    assert [kinds_of_outputs(cell) for cell in notebook.cells] == kept, (
        "its outputs are old: execute it"
    )


def kinds_of_outputs(cell):
    return {(output.output_type, output.get("name")) for output in cell.get("outputs", ())}


def test_a_notebook_is_small_and_shows_its_outputs(notebook):
    """In bytes, with its outputs, of which none is an error."""
    nbformat.validate(notebook)
    outputs = []
    for cell in notebook.cells:
        outputs += cell.get("outputs", ())

    assert len(nbformat.writes(notebook).encode()) < 100_000
    assert outputs
    assert "error" not in {output.output_type for output in outputs}
