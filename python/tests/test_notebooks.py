"""The studies that ship as notebooks run in small, and find what they should."""

import ast

import pytest

from conftest import HERE

STUDIES = HERE.parent / "studies"


def executed(monkeypatch, name, results):
    """The values of expressions after a notebook, with few vertices and iterations."""
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    for needed in ["ipykernel", "matplotlib", "scipy"]:
        pytest.importorskip(needed)
    notebook = nbformat.read(STUDIES / name, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
    monkeypatch.setenv("RUMPLE_SMALL", "1")
    notebook.cells.append(nbformat.v4.new_code_cell(f"print(({results},))"))
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    values = ast.literal_eval(notebook.cells[-1].outputs[0]["text"])
    return values[0] if len(values) == 1 else values


def test_growth_that_makes_a_shape_is_found(monkeypatch):
    results = (
        '{k: [float(v) for v in (r["error"], r["growth error"], r["course"][0, 2])] for k, r in found.items()}, '
        '{w: float(r["growth error"]) for (_, w), r in noisy.items()}, float(asymmetry), sizes.tolist()'
    )
    found, noisy, asymmetry, sizes = executed(monkeypatch, "inverse-design.ipynb", results)
    for kind, bound in {"cap": 0.02, "saddle": 0.02, "leaf": 0.1}.items():
        error, _, first = found[kind]
        assert error < bound and error < 0.3 * first
    # Half of the spread of a growth that the search did not know.
    assert found["cap"][1] < 0.6 and found["saddle"][1] < 0.7
    assert noisy[100.0] < noisy[0.0]
    # Differences of wrong gradients make no symmetric matrix.
    assert asymmetry < 1e-3 and sizes[0] > 3 * sizes[-1] > 0


def test_parameters_are_found_from_noisy_frames(monkeypatch, program):
    monkeypatch.setenv("RUMPLE", str(program))
    # As text, since an error may be infinite.
    results = "{of: [tuple(map(str, table[key])) for key in TRUE] for (_, of), table in fits.items()}"
    fits = executed(monkeypatch, "fit-model-i.ipynb", results)
    (w, _), (_, threshold_error), _ = ([float(v) for v in row] for row in fits["c"])
    # c alone does not determine its threshold.
    assert abs(w - 2) < 0.3 and threshold_error > 0.4
    (w, w_error), (threshold, threshold_error), (diffusivity, _) = ([float(v) for v in row] for row in fits["c and height"])
    # The meshes are coarse: their error is beside that of noise.
    assert abs(w - 2) < 0.2 and w_error < 0.1
    assert abs(threshold - 0.4) < 0.25 and threshold_error < 0.1
    assert abs(diffusivity - 1) < 0.5


def test_maps_of_sensitivity_are_those_of_differences(monkeypatch):
    checks, left = executed(
        monkeypatch, "sensitivity-model-ii.ipynb", "{k: float(v) for k, v in checks.items()}, {k: float(v) for k, v in cancelled.items()}"
    )
    for (_, step), error in checks.items():
        if step == 1e-4:
            assert error < 1e-5
    assert checks["material.thickness", 1e-3] < checks["material.thickness", 1e-2] / 20
    # More binding makes more motors everywhere; thickness acts with both signs.
    assert left["kinetics.parameters.k_on"] > 0.9 and left["material.thickness"] < 0.6
