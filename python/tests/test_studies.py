"""Sweeps, accuracy studies and comparisons."""

import os
import signal
import subprocess
import sys
import threading
import time
import types

import numpy
import pytest

import laws
import rumple
from conftest import COMMON, DOME

pandas = pytest.importorskip("pandas")

SMALL = {"sheet.vertices": 80, "time.until": 0.5, "output.every": 0.25}
TIMES = ["CPU [s]", "memory [MB]"]


def test_a_sweep_is_that_of_the_program(program, tmp_path):
    scene = rumple.load(DOME, SMALL)
    over = {"effect[4].coefficient": [0.1, 1.0], "time.policy": ["quasi-static"]}
    table = rumple.sweep(scene, over, out=tmp_path / "a", jobs=2)
    assert list(table["effect[4].coefficient"]) == [0.1, 1.0]
    assert list(table["status"]) == ["complete"] * 2 and list(table["time"]) == [0.5] * 2
    assert table.attrs["directory"] == str(tmp_path / "a")
    texts = [word for text in SMALL.items() for word in ("--set", f"{text[0]}={text[1]}")]
    overs = ["--over", "effect[4].coefficient=0.1,1.0", "--over", "time.policy=quasi-static"]
    command = [program, "sweep", DOME, "--out", tmp_path / "b", "--quiet", *texts, *overs]
    subprocess.run(command, check=True)
    other = pandas.read_csv(tmp_path / "b/sweep.csv")
    same = [name for name in table if name not in ["member", *TIMES]]
    pandas.testing.assert_frame_equal(table[same], other[same])
    first = rumple.read(tmp_path / "a/members" / table["member"][0])
    assert len(first.frames) == 3


def test_a_sweep_goes_on_and_is_replaced_by_force(tmp_path):
    scene = rumple.load(DOME, SMALL)
    rumple.sweep(scene, {"material.thickness": [0.5]}, out=tmp_path / "out")
    status = tmp_path / "out/members/thickness=0.5/status.json"
    before = status.stat().st_mtime_ns
    table = rumple.sweep(scene, {"material.thickness": "0.5,0.6"}, out=tmp_path / "out")
    assert len(table) == 2 and status.stat().st_mtime_ns == before
    with pytest.raises(rumple.Error, match="holds another sweep"):
        rumple.sweep(scene, {"material.young": [1e3]}, out=tmp_path / "out")
    rumple.sweep(scene, {"material.young": [1e3]}, out=tmp_path / "out", force=True)
    assert not status.exists()


def test_members_that_fail_are_rows():
    scene = rumple.load(DOME, {**SMALL, "time.until": 5.0, "kinetics.rates.c": "5*c^2 + k"})
    table = rumple.sweep(scene, {"kinetics.parameters.k": [0.0, 2.0]})
    assert list(table["status"]) == ["complete", "failed"]
    assert table["reason"][1] and table.attrs["directory"] is None


def test_seeds_repeat_members():
    noisy = {**SMALL, "sheet.imperfection": {"amplitude": 0.01}}
    table = rumple.sweep(rumple.load(DOME, noisy), seeds=2)
    assert list(table["seed"]) == [1, 2]
    assert table["energy [energy]"].nunique() == 2
    with pytest.raises(rumple.Error, match="kinetics.parameters.nothing"):
        rumple.sweep(DOME, {"kinetics.parameters.nothing": [1]})
    with pytest.raises(rumple.Error, match="nothing to vary"):
        rumple.sweep(DOME)
    for wrong in ["jobs", "threads", "seeds"]:
        with pytest.raises(rumple.Error, match=f"{wrong} is 0, expected 1 or more"):
            rumple.sweep(rumple.load(DOME, noisy), **{"seeds": 1, wrong: 0})


def test_scenes_of_text_are_written_beside_the_study(tmp_path):
    scene = rumple.parse(DOME.read_text(), SMALL)
    out = tmp_path / "thick"
    table = rumple.sweep(scene, {"material.thickness": [0.5]}, out=out)
    assert list(table["status"]) == ["complete"]
    assert (tmp_path / "thick.toml").read_text() == DOME.read_text()
    rumple.sweep(scene, {"material.thickness": [0.5]}, out=out)
    with pytest.raises(rumple.Error, match="is another scene"):
        rumple.sweep(rumple.parse("# other\n" + DOME.read_text()), {"material.thickness": [0.5]}, out=out)
    files = rumple.parse(DOME.read_text().replace('shape = "disc"', 'file = "x.obj" #').replace("radius", "#")
                         .replace("vertices = 300", ""))
    with pytest.raises(rumple.Error, match=r"names files \(sheet.file\)"):
        rumple.sweep(files, {"material.thickness": [0.5]})


def test_pandas_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(rumple.Error, match="pip install pandas"):
        rumple.sweep(DOME, {"material.thickness": [0.5]})


def test_ctrl_c_ends_a_sweep_with_its_members(tmp_path):
    sent = []

    def send():
        status = tmp_path / "out/members/thickness=0.5/ledger.csv"
        while not status.is_file():
            time.sleep(0.01)
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    scene = rumple.load(DOME, {"sheet.vertices": 3000, "time.until": 1e4, "output.every": 1e4})
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Thread(target=send).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            rumple.sweep(scene, {"material.thickness": [0.5, 0.6]}, out=tmp_path / "out")
        assert time.monotonic() - sent[0] < 2.0
    finally:
        signal.signal(signal.SIGINT, before)
    member = rumple.read(tmp_path / "out/members/thickness=0.5")
    assert member.status["status"] == "interrupted"


def test_accuracy_has_errors_and_advice():
    table = rumple.accuracy(
        rumple.load(DOME, SMALL),
        integrators=["staggered"],
        tolerances=[1e-2, 1e-4],
        references=['{ kind = "staggered" }'],
        seeds=0,
        limit=60,
        want=0.05,
        of="species",
    )
    assert set(table["status"]) == {"complete"}
    assert list(table["tolerance"]) == [1e-2, 1e-4]
    errors = table["error of the species"]
    assert errors[0] > errors[1] > 0
    assert "staggered" in table.attrs["advice"]
    with pytest.raises(rumple.Error, match="is not a quantity; expected one of species, shape"):
        rumple.accuracy(DOME, of="colour")
    with pytest.raises(rumple.Error, match="want is 0"):
        rumple.accuracy(DOME, want=0.0)
    with pytest.raises(rumple.Error, match="tolerances: 2 is not a number between 0 and 1"):
        rumple.accuracy(DOME, tolerances=[2.0])


def test_comparisons_have_a_member_for_every_policy(tmp_path):
    scene = rumple.load(DOME, {**SMALL, "material.drag": 1.0})
    policies = ["quasi-static", "simultaneous"]
    table = rumple.compare(scene, policies=policies, out=tmp_path / "out")
    members = list(table["member"].unique())
    assert [name.split(",")[0] for name in members] == policies
    assert table["shape distance"][table["member"] == members[0]].max() == 0
    assert table["shape distance"][table["member"] == members[1]].max() > 0
    assert "slowest mode of the shape" in table.attrs["report"]
    assert list(rumple.compare(scene, policies=policies, out=tmp_path / "out")["member"]) == list(table["member"])
    with pytest.raises(rumple.Error, match="holds another sweep"):
        rumple.compare(scene, policies=policies[:1], out=tmp_path / "out")


def test_studies_of_a_law_in_python(tmp_path):
    # Importable, so that plain pickle does.
    scene = rumple.scene(
        **{**COMMON, "kinetics": {"plugin": laws.GROWING, "parameters": {"k": 1.0}}},
        time={"until": 0.5},
    )
    over = {"kinetics.parameters.k": [1.0, 2.0]}
    table = rumple.sweep(scene, over, out=tmp_path / "own", jobs=2)
    assert list(table["status"]) == ["complete"] * 2
    text = rumple.load(DOME, SMALL)
    text = text.varied({"kinetics.rates.c": "k*area_strain - c", "kinetics.parameters": {"k": 1.0}})
    expected = rumple.sweep(text, over)
    assert numpy.allclose(table["amplitude [length]"], expected["amplitude [length]"], rtol=1e-6)
    assert table["amplitude [length]"].is_monotonic_increasing
    # The same call resumes the sweep; another law is another sweep.
    status = next((tmp_path / "own/members").glob("*/status.json"))
    before = status.stat().st_mtime_ns
    rumple.sweep(scene, over, out=tmp_path / "own")
    assert status.stat().st_mtime_ns == before
    with pytest.raises(rumple.Error, match="changed"):
        rumple.sweep(scene, over, out=tmp_path / "own", law=laws.SHRINKING)
    failing = rumple.sweep(scene, over, law=laws.FAILING)
    assert list(failing["status"]) == ["failed"] * 2 and "on purpose" in failing["reason"][0]
    compared = rumple.compare(scene, integrators=["staggered", "monolithic"])
    assert compared["member"].nunique() == 2 and compared["shape distance"].max() < 0.05
    errors = rumple.accuracy(
        scene, integrators=["staggered"], tolerances=[1e-2], seeds=0, of="species"
    )
    assert set(errors["status"]) == {"complete"} and errors["error of the species"][0] > 0


def test_a_law_that_no_other_process_can_have_is_refused(monkeypatch):
    held, until = threading.Lock(), {"until": 0.5}
    law = rumple.Law(lambda at: {"c": -at.c if held else at.c}, "c", name="growing")
    with pytest.raises(rumple.Error, match="'growing' cannot be given to the processes of a study: "):
        rumple.sweep(rumple.scene(**COMMON, kinetics=law, time=until), {"material.thickness": [0.5]})
    # A function of a script, whose names other processes do not have.
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    script = types.FunctionType(laws.growing.__code__, {"__name__": "__main__"})
    law = rumple.Law(script, "c", signals=["area_strain"], parameters={"k": 1.0}, name="growing")
    with pytest.raises(rumple.Error, match="pip install cloudpickle, or define its functions in a module"):
        rumple.sweep(rumple.scene(**COMMON, kinetics=law, time=until), {"material.thickness": [0.5]})


def test_a_law_of_a_script_runs_in_other_processes():
    pytest.importorskip("cloudpickle")
    constant = 2.0
    law = rumple.Law(lambda at: {"c": constant - at.c}, "c", name="local")
    table = rumple.sweep(
        rumple.scene(**COMMON, kinetics=law, time={"until": 0.5}), {"material.thickness": [0.5]}
    )
    assert list(table["status"]) == ["complete"]


def test_progress_of_a_study_is_shown_or_handed_over(tmp_path, capsys, monkeypatch):
    seen = []
    over = {"effect[4].coefficient": [0.1, 1.0]}
    scene = rumple.load(DOME, SMALL)
    rumple.sweep(scene, over, out=tmp_path / "a", threads=2, progress=lambda share, text: seen.append((share, text)))
    assert seen == sorted(seen, key=lambda one: one[0]) and seen[0][0] == 0.0
    assert [share for share, text in seen if "complete" in text] == [0.5, 1.0]

    def fails(share, text):
        raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError, match="on purpose"):
        rumple.sweep(scene, over, out=tmp_path / "b", progress=fails)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    rumple.compare(scene, policies=["quasi-static"], progress=True)
    assert "100 %  [1/1]" in capsys.readouterr().err
