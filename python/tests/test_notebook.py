"""The notebook runs from its first cell to its last, and draws."""

import pytest

from conftest import ROOT

nbclient = pytest.importorskip("nbclient")


def test_the_notebook_runs_and_its_plots_are_there():
    import nbformat

    path = ROOT / "python/examples/in_plane_pair.ipynb"
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(path.parent)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not any(output.output_type == "error" for output in outputs)
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 3 and all(len(picture.data["image/png"]) > 5000 for picture in pictures)
    assert any("6 steps, complete" in output.get("data", {}).get("text/plain", "") for output in outputs)
