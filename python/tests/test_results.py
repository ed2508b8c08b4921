"""Results of the program."""

import shutil
import subprocess

import pytest

import rumple
from conftest import DOME


def test_results_are_read(program, tmp_path):
    subprocess.run([program, "run", DOME, "--out", tmp_path / "out", "--quiet"], check=True)
    results = rumple.read(tmp_path / "out")
    assert [frame.time for frame in results.frames] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert len(results.frames[1:3]) == 2
    frame = results.frames[-1]
    assert frame.points.shape[1] == frame.triangles.shape[1] == 3
    assert (frame.field("mean_curvature") == frame.fields["mean_curvature [1/length]"]).all()
    assert frame.field("displacement").shape == frame.points.shape
    with pytest.raises(KeyError, match="it has"):
        frame.field("nothing")
    times = results.ledger["time"]
    assert times[0] == 0.0 and list(times)[-1] == 1.0


@pytest.mark.parametrize("index", ["sheet.vtkhdf", "sheet.vtk.series"])
def test_frames_of_other_formats_are_refused(tmp_path, index):
    (tmp_path / "ledger.csv").write_text("step,time\n0,0\n")
    (tmp_path / index).touch()
    with pytest.raises(rumple.Error, match=f"{index}.*ParaView"):
        rumple.read(tmp_path).frames


def test_the_ledger_without_pandas(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    (tmp_path / "ledger.csv").write_text('step,time,"a, b"\n0,0,\n1,0.5,2\n2,0.')
    results = rumple.read(tmp_path)
    assert {name: list(values)[1:] for name, values in results.ledger.items()} == {
        "step": [1],
        "time": [0.5],
        "a, b": [2],
    }
    assert len(results.frames) == 0


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(rumple.Error, match="not a result directory"):
        rumple.read(tmp_path)


def test_pyvista_gets_the_fields(sim):
    pytest.importorskip("pyvista")
    sim.run(until=0.1)
    mesh = sim.to_pyvista()
    assert mesh.n_points == len(sim.positions) and mesh.n_cells == len(sim.triangles)
    assert (mesh.point_data["c"] == sim.species["c"]).all()


def test_results_as_xarray(program, tmp_path):
    pytest.importorskip("xarray")
    subprocess.run([program, "run", DOME, "--out", tmp_path / "out", "--quiet"], check=True)
    results = rumple.read(tmp_path / "out")
    data = results.to_xarray()
    last = results.frames[-1]
    assert list(data.time) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert (data.position.sel(time=1.0) == last.points).all()
    assert (data.mean_curvature.isel(time=-1) == last.field("mean_curvature")).all()
    assert data.mean_curvature.attrs["units"] == "1/length" and data.mean_curvature.dims == ("time", "vertex")
    assert (data.triangles == last.triangles).all()


def test_results_and_scenes_in_a_notebook(program, tmp_path):
    subprocess.run([program, "run", DOME, "--out", tmp_path / "out", "--quiet"], check=True)
    text = rumple.read(tmp_path / "out")._repr_html_()
    assert "complete: the end time is reached" in text and "<th>frames</th><td>5</td>" in text
    assert "until = 1.0" in rumple.load(DOME)._repr_html_()
    frame = rumple.read(tmp_path / "out").frames[-1]
    c = frame.field("c")
    assert f"<tr><th>c</th><td>{c.min():.4g} to {c.max():.4g}, mean {c.mean():.4g}</td></tr>" in frame._repr_html_()
    sim = rumple.Simulation(DOME)
    text = sim._repr_html_()
    assert f"<th>vertices</th><td>{len(sim.positions)}</td>" in text and "<th>energy of bending</th>" in text


def test_pictures_and_movies(program, tmp_path):
    subprocess.run([program, "run", DOME, "--out", tmp_path / "out", "--quiet"], check=True)
    results = rumple.read(tmp_path / "out")
    with pytest.raises(rumple.Error, match="unknown field `colour`"):
        results.picture(tmp_path / "a.png", colour="c")
    with pytest.raises(rumple.Error, match="80 to 8192"):
        results.picture(tmp_path / "a.png", size=(2, 2))
    if not any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))):
        pytest.skip("no browser")
    assert results.picture(tmp_path / "a.png", field="mean_curvature", range=(-0.1, 0.1)) == tmp_path / "a.png"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    results.movie(tmp_path / "a.gif", view=(-50, 35), size=(200, 160), title="dome")
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")


def test_frames_are_a_series_of_pyvista(tmp_path):
    pytest.importorskip("pyvista")
    results = rumple.run(DOME, tmp_path / "out")
    blocks = results.to_pyvista()
    times = [0.0, 0.25, 0.5, 0.75, 1.0]
    assert list(blocks.field_data["time"]) == times
    assert blocks.keys() == [f"time {time:g}" for time in times]
    last, frame = blocks[-1], results.frames[-1]
    assert (last.points == frame.points).all() and last.n_cells == len(frame.triangles)
    assert list(last.field_data["time"]) == [1.0]
    assert (last.point_data["c"] == frame.field("c")).all()
