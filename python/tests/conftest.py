"""What the tests share: a small scene, and the program."""

import os
from pathlib import Path

import pytest

import rumple

HERE = Path(__file__).parent
DOME = HERE / "dome.toml"
# The scene of DOME without its kinetics, smaller.
COMMON = {
    "sheet": {"shape": "disc", "radius": 10.0, "vertices": 80},
    "material": {"young": 1e3, "poisson": 1 / 3, "thickness": 0.5},
    "effect": [
        {"kind": "stretching"},
        {"kind": "bending"},
        {"kind": "pin", "where": "rim", "axes": "xyz"},
        {"kind": "pressure", "value": 1.0},
        {"kind": "diffusion", "species": "c", "coefficient": 0.5},
    ],
    "output": {"every": 0.25, "fields": ["c", "mean_curvature"]},
}


@pytest.fixture
def sim():
    return rumple.Simulation(rumple.load(DOME))


@pytest.fixture
def program():
    path = Path(os.environ.get("RUMPLE", HERE.parents[1] / "target/release/rumple"))
    if not path.is_file():
        pytest.skip(f"{path} is not built")
    return path
