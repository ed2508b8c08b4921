"""What the tests share: a small scene, and the program."""

import os
from pathlib import Path

import pytest

import rumple

HERE = Path(__file__).parent
DOME = HERE / "dome.toml"


@pytest.fixture
def sim():
    return rumple.Simulation(rumple.load(DOME))


@pytest.fixture
def program():
    path = Path(os.environ.get("RUMPLE", HERE.parents[1] / "target/release/rumple"))
    if not path.is_file():
        pytest.skip(f"{path} is not built")
    return path
