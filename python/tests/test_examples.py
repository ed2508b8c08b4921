"""The tutorial and the examples run."""

import importlib.util
import shutil

import pytest

from conftest import HERE

ROOT = HERE.parent


def test_the_tutorial_runs_and_is_stored_without_outputs():
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    for needed in ["ipykernel", "matplotlib", "pandas", "xarray"]:
        pytest.importorskip(needed)
    notebook = nbformat.read(ROOT / "tutorial.ipynb", as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    shown = [output.get("data", {}) for cell in code for output in cell.outputs]
    assert sum("image/png" in data for data in shown) == 5
    browser = any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
    assert sum("image/gif" in data for data in shown) == browser
    assert sum("<iframe" in data.get("text/html", "") for data in shown) == 1


def test_the_fit_recovers_its_coefficient():
    pytest.importorskip("scipy")
    spec = importlib.util.spec_from_file_location("fit", ROOT / "examples/fit.py")
    fit = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(fit)
    coefficient, error, _ = fit.fit()
    assert abs(coefficient / fit.TRUE - 1) < fit.TOLERANCE
    assert 0 < error < fit.TOLERANCE * fit.TRUE
    # Another realisation of the noise: within three of its standard errors.
    coefficient, error, _ = fit.fit(seed=2)
    assert abs(coefficient - fit.TRUE) < 3 * error
