"""Runs that write result directories."""

import importlib.util
import os
import signal
import subprocess
import sys
import threading
import time

import numpy
import pytest

import laws
import rumple
from conftest import COMMON, DOME, HERE
from test_law import LAW, without_kinetics

WALL = "wall time [s]"


def content(folder):
    """Files of a run by name, but for those that name times, machines and commands."""
    apart = ["provenance.json", "status.json", "costs.json", "report.html", "lock"]
    files = {path.relative_to(folder): path for path in folder.rglob("*") if path.is_file()}
    return {
        str(name): path.read_bytes()
        for name, path in files.items()
        if not any(word in name.name for word in apart) and name.suffix != ".bin"
    }


def without_wall(ledger):
    rows = [row.split(",") for row in ledger.decode().splitlines()]
    at = rows[0].index(WALL)
    return [row[:at] + row[at + 1 :] for row in rows]


def same_files(own, other):
    own, other = content(own), content(other)
    assert set(own) == set(other) and "sheet.pvd" in own
    assert without_wall(own.pop("ledger.csv")) == without_wall(other.pop("ledger.csv"))
    assert [name for name in own if own[name] != other[name]] == []
    assert len([name for name in own if name.startswith("frames")]) > 3


def test_a_run_writes_what_the_program_writes(program, tmp_path):
    command = [program, "run", DOME, "--out", tmp_path / "a", "--quiet"]
    subprocess.run(command, check=True)
    results = rumple.run(DOME, tmp_path / "b")
    same_files(tmp_path / "b", tmp_path / "a")
    assert results.status["status"] == "complete" and results.status["time"] == 1.0
    assert (tmp_path / "b/report.html").is_file() and (tmp_path / "b/provenance.json").is_file()


def test_so_does_one_with_plugins_and_overrides(program, tmp_path):
    scene = HERE.parents[1] / "models/model-i/small.toml"
    overrides = ["sheet.vertices=300", "time.until=0.3", "output.every=0.1", "output.report=false"]
    texts = [word for text in overrides for word in ("--set", text)]
    folders = ["--plugin-path", program.parent]
    command = [program, "run", scene, "--out", tmp_path / "a", "--quiet", *folders, *texts]
    subprocess.run(command, check=True)
    rumple.run(rumple.load(scene, overrides), tmp_path / "b", plugins=[program.parent])
    same_files(tmp_path / "b", tmp_path / "a")
    assert not (tmp_path / "b/report.html").exists()


def test_results_are_replaced_only_by_force(tmp_path):
    scene = rumple.load(DOME, {"time.until": 0.25, "sheet.vertices": 100, "output.report": False})
    rumple.run(scene, tmp_path / "out")
    with pytest.raises(rumple.Error, match="is not empty"):
        rumple.run(scene, tmp_path / "out")
    assert len(rumple.run(scene, tmp_path / "out", force=True).frames) == 2
    with pytest.raises(rumple.Error, match="`dome.toml` in it is the scene"):
        rumple.run(DOME, HERE)


def test_observers_see_states_and_end_runs(tmp_path):
    seen = []

    def observe(state):
        seen.append((state.steps, state.time, state.positions[:, 2].max(), state.species["c"].max()))
        assert set(state.energies) == {"stretching", "bending", "pressure"}
        return state.steps == 3

    results = rumple.run(DOME, tmp_path / "out", observe=observe)
    assert [row[0] for row in seen] == [1, 2, 3]
    ledger = results.ledger
    assert list(ledger["time"])[1:] == [row[1] for row in seen]
    assert list(ledger["largest c"])[1:] == [row[3] for row in seen]
    assert results.frames[-1].points[:, 2].max() == seen[-1][2]
    assert results.status["reason"] == "an observer has ended the run"


def test_an_exception_of_an_observer_leaves_a_run_to_be_resumed(tmp_path):
    def observe(state):
        if state.steps == 4:
            raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError, match="on purpose"):
        rumple.run(DOME, tmp_path / "a", observe=observe)
    assert rumple.read(tmp_path / "a").status["status"] == "interrupted"
    rumple.resume(tmp_path / "a")
    rumple.run(DOME, tmp_path / "b")
    same_files(tmp_path / "a", tmp_path / "b")
    with pytest.raises(rumple.Error, match="the run is complete"):
        rumple.resume(tmp_path / "a")
    assert rumple.resume(tmp_path / "a", until=1.25).status["time"] == 1.25


def test_a_run_that_ended_after_its_steps_goes_on_with_more(tmp_path):
    rumple.run(rumple.load(DOME, {"time.max_steps": 2, "checkpoint.every": 1e-9}), tmp_path / "a")
    with pytest.raises(rumple.Error, match="time.max_steps=N"):
        rumple.resume(tmp_path / "a", until=2)
    with pytest.raises(rumple.Error, match="material.young was"):
        rumple.resume(tmp_path / "a", overrides={"time.max_steps": 4, "material.young": 7.0})
    results = rumple.resume(tmp_path / "a", overrides={"time.max_steps": 4})
    assert list(results.ledger["step"]) == [0, 1, 2, 3, 4]


def test_ctrl_c_ends_within_a_second_and_the_program_goes_on(program, tmp_path):
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    # Too long to end before the signal comes, however fast the machine.
    scene = rumple.load(DOME, {"sheet.vertices": 2500, "time.until": 1e4, "output.every": 1e4})
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    begun = threading.Event()
    threading.Thread(target=lambda: begun.wait() and time.sleep(0.3) is None and send()).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            rumple.run(scene, tmp_path / "a", observe=lambda state: begun.set())
        assert time.monotonic() - sent[0] < 1.0
    finally:
        begun.set()
        signal.signal(signal.SIGINT, before)
    status = rumple.read(tmp_path / "a").status
    assert status["status"] == "interrupted" and 0 < status["time"] < 1e4
    until = str(status["time"] + 0.5)
    subprocess.run([program, "resume", tmp_path / "a", "--until", until, "--quiet"], check=True)
    assert rumple.read(tmp_path / "a").status["status"] == "complete"
    # The next run is not interrupted by the request that ended this one.
    done = rumple.run(rumple.load(DOME, {"time.max_steps": 2}), tmp_path / "b")
    assert done.status["reason"] == "the number of steps is reached"


def test_other_threads_go_on_meanwhile(tmp_path):
    counted = []
    scene = rumple.load(DOME, {"sheet.vertices": 2000, "time.until": 0.25})
    work = threading.Thread(target=lambda: rumple.run(scene, tmp_path / "out"))
    work.start()
    while work.is_alive():
        counted.append(time.monotonic())
        time.sleep(0.001)
    assert len(counted) > 20 and rumple.read(tmp_path / "out").status["status"] == "complete"


def test_a_parsed_scene_and_a_law_in_python_run(tmp_path):
    results = rumple.run(without_kinetics(), tmp_path / "out", law=LAW)
    sim = rumple.Simulation(without_kinetics(), law=LAW)
    sim.run()
    assert (results.frames[-1].points == sim.positions).all()

    def ends(state):
        raise ZeroDivisionError

    # Its directory does not have the law.
    with pytest.raises(ZeroDivisionError):
        rumple.run(without_kinetics(), tmp_path / "ended", law=LAW, observe=ends)
    with pytest.raises(rumple.Error, match="the law `growing` is a function"):
        rumple.resume(tmp_path / "ended")

    def fails(at):
        raise ValueError("a law that fails")

    law = rumple.Law(fails, "c")
    with pytest.raises(rumple.Error) as raised:
        rumple.run(without_kinetics(), tmp_path / "failed", law=law)
    assert isinstance(raised.value.__cause__, ValueError)


def test_a_run_with_a_law_in_python_goes_on_with_the_same_law(program, tmp_path):
    kinetics = {"plugin": laws.GROWING, "initial": {"c": 0.1}}
    scene = rumple.scene(**COMMON, kinetics=kinetics, time={"until": 1.0})

    def observe(state):
        if state.steps == 3:
            raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError):
        rumple.run(scene, tmp_path / "a", observe=observe)
    with pytest.raises(rumple.Error, match="(?s)law `growing` is a function.*law=growing"):
        rumple.resume(tmp_path / "a")
    refused = subprocess.run([program, "resume", tmp_path / "a"], capture_output=True, text=True)
    assert refused.returncode == 2 and "law `growing` is a function" in refused.stderr
    with pytest.raises(rumple.Error, match="the law growing has changed"):
        rumple.resume(tmp_path / "a", law=laws.SHRINKING)
    rumple.resume(tmp_path / "a", law=laws.GROWING)
    rumple.run(scene, tmp_path / "b")
    same_files(tmp_path / "a", tmp_path / "b")


def test_errors_have_file_line_and_key(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(DOME.read_text().replace("radius = 10.0", 'radius = "ten"'))
    with pytest.raises(rumple.Error, match=r"(?s)wrong\.toml:3.*radius"):
        rumple.run(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_failed_run_leaves_its_report(tmp_path):
    growing = {"kinetics.rates.c": "100*c^2 + 1", "time.until": 10.0, "sheet.vertices": 80}
    with pytest.raises(rumple.Error, match="the run stopped at time"):
        rumple.run(rumple.load(DOME, growing), tmp_path / "out")
    assert rumple.read(tmp_path / "out").status["status"] == "failed"


def test_results_are_shown_in_a_browser(tmp_path, monkeypatch):
    import webbrowser

    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    scene = rumple.load(DOME, {"time.max_steps": 1, "output.report": False})
    results = rumple.run(scene, tmp_path / "out")
    assert results.show() is True
    assert opened == [(tmp_path / "out/report.html").as_uri()]
    assert numpy.isfinite(results.frames[0].points).all()


def test_a_run_starts_from_a_state(program, tmp_path):
    scene = rumple.load(DOME, {"time.until": 0.25, "output.report": False})
    first = rumple.run(scene, tmp_path / "first")
    state = first.frames[-1].path
    other = [program, "run", DOME, "--from", state, "--set", "time.until=0.25", "--set", "output.report=false"]
    subprocess.run([*other, "--out", tmp_path / "a", "--quiet"], check=True)
    with pytest.warns(UserWarning, match=r"that of time 0.25; .*: start_time 0.25 continues them"):
        results = rumple.run(scene, tmp_path / "b", state=state)
    assert (results.frames[0].field("c") == first.frames[-1].field("c")).all()
    own, other = content(tmp_path / "b"), content(tmp_path / "a")
    assert [name for name in other if name != "ledger.csv" and own[name] != other[name]] == []
    more = rumple.load(DOME, {"time.until": 0.5, "output.every": 0.25, "output.report": False})
    later = rumple.run(more, tmp_path / "c", state=state, start_time=0.25)
    assert [frame.time for frame in later.frames] == [0.25, 0.5]
    with pytest.raises(rumple.Error, match="start_time is 0.5, expected"):
        rumple.run(more, tmp_path / "d", state=state, start_time=0.5)
    with pytest.raises(rumple.Error, match="give its file as state"):
        rumple.run(more, tmp_path / "d", start_time=0.25)


def test_progress_is_shown_or_handed_over(tmp_path, capsys, monkeypatch):
    seen = []
    scene = rumple.load(DOME, {"checkpoint.every": 1e-9})
    results = rumple.run(scene, tmp_path / "out", progress=lambda share, state: seen.append((share, state.steps)), threads=1)
    assert [steps for _, steps in seen] == list(range(1, len(seen) + 1))
    assert seen[-1][0] == 1.0 and seen == sorted(seen)
    two = rumple.run(DOME, tmp_path / "two", progress=True, threads=2)
    assert (two.frames[-1].points == results.frames[-1].points).all()
    assert "100%" in capsys.readouterr().err or not _has("tqdm")
    rumple.resume(tmp_path / "out", until=1.5, progress=lambda share, state: seen.append((share, state.steps)))
    assert seen[-1][0] == 1.0 and 1.0 / 1.5 < seen[-2][0] < 1.0
    # Without tqdm a line now and then.
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    monkeypatch.setattr("rumple._progress.INTERVAL", 0.0)
    rumple.run(DOME, tmp_path / "three", progress=True)
    assert "100 %  time 1 of 1" in capsys.readouterr().err


def _has(module):
    return importlib.util.find_spec(module) is not None


def test_what_the_program_prints_is_logged(tmp_path, caplog):
    caplog.set_level("INFO", logger="rumple")
    scene = rumple.load(DOME, {"time.max_steps": 2, "output.report": False, "checkpoint.every": 1e-9})
    rumple.run(scene, tmp_path / "out")
    said = [record.getMessage() for record in caplog.records if record.name == "rumple"]
    assert "relaxing the initial shape" in said and any("step 2" in line for line in said)
    rumple.resume(tmp_path / "out", overrides={"time.max_steps": 3})
    assert any(record.getMessage().startswith("going on from time") for record in caplog.records)
