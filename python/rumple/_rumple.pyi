"""The engine's classes and functions."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union, final

from numpy import float64, int64
from numpy.typing import ArrayLike, NDArray

_Path = Union[str, os.PathLike[str]]
_Overrides = Union[dict[str, Any], Sequence[str]]
_Names = Union[str, Iterable[str], dict[str, Any]]

__version__: str

class Error(Exception):
    """Anything that can go wrong in the engine; the message has the place in the scene, where there is one.

    An exception of a law written in Python is its `__cause__`.
    """

    path: Optional[str]
    line: Optional[int]
    column: Optional[int]
    key: Optional[str]
    vertex: Optional[int]
    time: Optional[float]
    folder: Optional[Path]

class SceneError(Error):
    """A scene is wrong: `path`, `line`, `column`, `key`."""

class LawError(Error):
    """A law cannot be loaded, or one of its calls failed: `vertex`."""

class SolverError(Error):
    """A solver stopped without a result; of a run `time`, `vertex` and `folder`."""

class FileError(Error):
    """A mesh, a state or a result cannot be read or written."""

@final
class Scene:
    """A checked scene; made by `load`, `parse` and `rumple.scene`."""

    @property
    def name(self) -> str:
        """Path of its file, or the name that it was parsed with."""
    @property
    def until(self) -> float:
        """Time of the last state."""
    @property
    def path(self) -> Optional[Path]:
        """Path of its file; None of a scene that was parsed."""
    @property
    def law(self) -> Optional[Law]:
        """The law in Python that goes with it."""
    def with_law(self, law: Optional[Law]) -> Scene:
        """The scene with another law in Python."""
    def varied(self, overrides: _Overrides) -> Scene:
        """The scene with more overrides."""
    def resolved(self) -> str:
        """The scene as TOML with every default written out."""
    def _parsed(self) -> tuple[Optional[str], list[str]]: ...
    def _files(self) -> list[str]: ...

def load(
    path: _Path, overrides: Optional[_Overrides] = None, *, law: Optional[Law] = None
) -> Scene:
    """Reads and checks the scene file at `path`, after the overrides.

    Overrides are a dict of key paths and values, `{"sheet.vertices": 5000}`, or a list of texts as after `--set`. `law` is
    a law in Python: that of the table that names it as its plugin, or one more.
    """

def parse(
    text: str,
    overrides: Optional[_Overrides] = None,
    name: str = "scene",
    *,
    law: Optional[Law] = None,
) -> Scene:
    """Checks the scene `text`, after the overrides; `name` stands for its file in messages."""

def tables_as_toml(tables: dict[str, Any]) -> str:
    """Tables of a scene as its text."""

def read_surface(
    path: _Path,
) -> tuple[
    NDArray[float64],
    NDArray[int64],
    dict[str, NDArray[float64]],
    dict[str, NDArray[float64]],
    Optional[float],
]:
    """Points, triangles, point fields, cell fields and time of a file (.vtu, .vtp, .vtk, .obj)."""


def run(
    scene: Scene,
    out: Optional[_Path],
    state: Optional[_Path],
    start_time: Optional[float],
    force: bool,
    observe: Optional[Callable[[State], Any]],
    law: Optional[Law],
    plugins: Union[_Path, Sequence[_Path], None],
    threads: int,
) -> Path:
    """Runs a scene and writes its results; the directory."""

def resume(
    directory: _Path,
    changes: _Overrides,
    observe: Optional[Callable[[State], Any]],
    law: Optional[Law],
    plugins: Union[_Path, Sequence[_Path], None],
    threads: int,
) -> Path:
    """Continues the run in a directory; the directory."""

def draw(
    files: tuple[_Path, _Path, bool],
    drawing: str,
    time: Optional[float],
    movie: Optional[tuple[int, float]],
) -> None:
    """Draws the results in a directory into a file."""

def report(directory: _Path) -> Path:
    """Writes the viewer of the results in a directory beside them; its path."""

def sweep(
    scene: Scene,
    over: Optional[dict[str, Any]],
    seeds: Optional[int],
    level: Optional[float],
    how: Any,
) -> None:
    """Runs a scene over values of its keys."""

def accuracy(
    scene: Scene, level: Optional[float], asked: Any, how: Any
) -> str:
    """Runs a scene by several integrators and tolerances against references; the advice."""

def compare(
    scene: Scene, policies: Sequence[str], integrators: Sequence[str], how: Any
) -> list[str]:
    """Runs a scene under several policies and integrators; what the program prints."""

def member(root: _Path, number: int, law: Optional[Law]) -> None:
    """Runs one member of a study in this process, which was started for it."""

@final
class Step:
    """An accepted step."""

    @property
    def number(self) -> int:
        """Number of the step, from 1."""
    @property
    def time(self) -> float:
        """Time reached."""
    @property
    def length(self) -> float:
        """Length of the step."""
    @property
    def error(self) -> float:
        """Error estimate in units of the tolerance (0 for fixed steps and for `monolithic`)."""
    @property
    def iterations(self) -> int:
        """Iterations of the relaxations in the step."""
    @property
    def residual(self) -> float:
        """Largest force left, in units of the force scale."""
    @property
    def rejected(self) -> int:
        """Rejected step attempts."""
    @property
    def snaps(self) -> int:
        """Snaps from one branch of equilibria to another that ended in the step."""
    @property
    def dissipated(self) -> float:
        """Work that the drag took up in the step, energy."""

@final
class State:
    """A state of a run that writes results, for observers: read-only copies."""

    @property
    def time(self) -> float:
        """Time of the state."""
    @property
    def steps(self) -> int:
        """Accepted steps."""
    @property
    def positions(self) -> NDArray[float64]:
        """Positions of the vertices, n × 3."""
    @property
    def species(self) -> dict[str, NDArray[float64]]:
        """Values of the species where they live, by name."""
    @property
    def energies(self) -> dict[str, float]:
        """Energy of every effect that has one, by name."""

@final
class Species(Mapping[str, NDArray[float64]]):
    """Values of the species where they live, by name: read-only copies, and to be set.

    `sim.species["c"] = values`, an array or one number for all, checks number, finiteness and valid range; the shape follows with
    the next step.
    """

    def __getitem__(self, name: str, /) -> NDArray[float64]: ...
    def __setitem__(self, name: str, values: ArrayLike, /) -> None: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...

@final
class Objective:
    """A measure of an equilibrium, or of a run in time, as a function of parameters of its scene, with its gradient: what optimisers take.

    `scipy.optimize.minimize(objective, objective.start, jac=True)` minimises it. Parameters are one array: numbers first, then fields, vertex by vertex.
    Every evaluation begins at the last equilibrium. Raises `Error`.
    """

    def __new__(
        cls,
        scene: Union[Scene, _Path],
        measure: Union[str, Sequence[str]],
        parameters: Sequence[str] = (),
        fields: Sequence[str] = (),
        *,
        at_start: bool = False,
        in_time: bool = False,
        times: Sequence[float] = (),
        law: Optional[Law] = None,
        plugins: Union[_Path, Sequence[_Path], None] = None,
    ) -> Objective:
        """`measure` is one of `rumple gradient` or several, whose sum is taken; `parameters` are keys of numbers, `fields` keys of fields.

        With `at_start` it is the equilibrium that the scene begins with, at the species there, rather than that at its end; with `in_time` the
        state at the end of the run, which need not rest; with `times` the sum over these times."""
    @property
    def names(self) -> list[str]:
        """Keys of the parameters, in their order."""
    @property
    def start(self) -> NDArray[numpy.float64]:
        """The parameters of the scene."""
    def value(self, x: Sequence[float]) -> float:
        """J."""
    def gradient(self, x: Sequence[float]) -> NDArray[numpy.float64]:
        """dJ/dx."""
    def __call__(self, x: Sequence[float]) -> tuple[float, NDArray[numpy.float64]]:
        """J and dJ/dx."""
    def split(self, x: Sequence[float]) -> dict[str, Any]:
        """The parameters by their keys: numbers, and arrays of fields."""
    def positions(self, x: Sequence[float]) -> NDArray[numpy.float64]:
        """The shape at rest, or at the last time, n × 3."""

@final
class Simulation:
    """A scene that is set up, to be stepped and asked. Iterating makes steps to the end of the scene."""

    def __new__(
        cls, scene: Union[Scene, _Path], *, law: Optional[Law] = None, plugins: Union[_Path, Sequence[_Path], None] = None
    ) -> Simulation:
        """`scene` is a scene or the path of its file; `law` is added to the laws of the scene; `plugins` are folders in which plugins are looked for first."""
    @property
    def time(self) -> float:
        """Time of the state."""
    @property
    def steps(self) -> int:
        """Accepted steps."""
    @property
    def ending(self) -> Optional[str]:
        """Why the run is at its end; None before it."""
    @property
    def notes(self) -> list[str]:
        """Warnings about the mesh, the scene or the laws, which are issued as UserWarning too."""
    @property
    def positions(self) -> NDArray[float64]:
        """Positions of the vertices, n × 3: a read-only copy. Setting them is checked; the next step finds equilibrium again."""
    @positions.setter
    def positions(self, positions: ArrayLike) -> None: ...
    @property
    def rest_positions(self) -> NDArray[float64]:
        """Positions of the vertices in the reference configuration, n × 3."""
    @property
    def triangles(self) -> NDArray[int64]:
        """Vertices of the triangles, m × 3; those across the end of a period have vertices on either side of it."""
    @property
    def periods(self) -> NDArray[float64]:
        """Translations by which a periodic sheet repeats itself, one a row; none of other sheets."""
    @property
    def species(self) -> Species:
        """The species, by name."""
    def prepare(self) -> int:
        """Brings the start into equilibrium and tries its laws, as the first step does; the number of iterations.

        A law with hidden state is an `Error`; derivatives that are not those of its rates are a UserWarning.
        """
    def relax(self) -> int:
        """Brings the shape into equilibrium with its species; the number of iterations."""
    def step(self, until: Optional[float] = None) -> Optional[Step]:
        """One step, which ends at the latest at the next output time and at `until`; None at the end."""
    def run(
        self,
        until: Optional[float] = None,
        observe: Optional[Callable[[Simulation, Step], Any]] = None,
    ) -> Optional[Step]:
        """Steps to the time `until`, or to the end of the scene; the last step.

        `observe(sim, step)` is called after every accepted step; a true result ends the run there.
        """
    def checkpoint(self, path: _Path) -> None:
        """Writes all that later steps depend on into a file: state, step control, memory of the solvers.

        The start is brought to equilibrium before. Integrators whose history cannot be stored (`monolithic`, `explicit` with
        `tsit45`) restart from the state, here too.
        """
    def restore(self, path: _Path) -> None:
        """Continues from the file of a checkpoint of the same scene and law, with the same steps; any other is refused."""
    def copy(self) -> Simulation:
        """Another simulation in the same state, which makes the same steps, as by `checkpoint` and `restore`."""
    def energies(self) -> dict[str, float]:
        """Energy of every effect that has one, by name."""
    def ledger_row(self) -> dict[str, float]:
        """Titles and numbers that the ledger has of the state: energies, constraints with their multipliers, totals and
        ranges of species, work of the last step; not the wall time, nor what a watch on stability adds."""
    def measures(self, *, level: Optional[float] = None) -> dict[str, Any]:
        """Scalar measures of the state, as a sweep has them.

        `energy` of all effects but loads, `amplitude` (largest displacement) and `deflection` (its part along the
        normals), `spots` (regions of the first species above `level`, by default half way between its least and largest
        value), their `separation`, the distance of `nearest` centres and their `share` of the area, and `rate`, the
        largest rate of change of a species in units of its typical magnitude.
        """
    def inspect(self) -> dict[str, Any]:
        """Everything that is known of the state, as `rumple inspect --json` has it, with arrays.

        `energy` and `force` by effect and `total`, `constraint`, `mean_curvature`, `gaussian_curvature`, `vertex_area`,
        `bond`, `species`, `signals`, `reaction`, `diffusion` and `length_factor`.
        """
    @property
    def area(self) -> float:
        """Area of the sheet in its current shape, length²."""
    @property
    def volume(self) -> Optional[float]:
        """Volume that a closed sheet encloses, length³, positive where normals point outwards; None with a boundary."""
    def fields(self, *, cells: bool = False) -> dict[str, NDArray[float64]]:
        """The fields of a frame of the state, by name with unit: on vertices, or on triangles with `cells`."""
    def field(self, name: str, *, cells: bool = False) -> NDArray[float64]:
        """One field of a frame of the state, with or without its unit in the name."""
    def to_pyvista(self) -> Any:
        """The surface with its fields as a mesh of PyVista, which has to be installed."""
    def __iter__(self) -> Iterator[Step]: ...
    def __next__(self) -> Step: ...

@final
class Batch:
    """What a law reads at a batch of points: columns and numbers, by name, as `at["c"]` or `at.c`. They cannot be written to."""

    def __getitem__(self, name: str, /) -> NDArray[float64]: ...
    def __getattr__(self, name: str, /) -> NDArray[float64]: ...
    def keys(self) -> list[str]:
        """Names of the columns and numbers."""

@final
class Law:
    """A law: a function that gives the rates of species from columns of species, signals and parameters.

    It must be pure: the same columns give the same rates.
    """

    def __new__(
        cls,
        rates: Callable[[Batch], dict[str, ArrayLike]],
        species: _Names,
        *,
        signals: Optional[_Names] = None,
        parameters: Optional[dict[str, float]] = None,
        rate_partials: Union[Callable[[Batch], dict[tuple[str, str], ArrayLike]], str, None] = None,
        length_factor: Optional[Callable[[Batch], ArrayLike]] = None,
        length_factor_across: Optional[Callable[[Batch], ArrayLike]] = None,
        curvature: Optional[Callable[[Batch], ArrayLike]] = None,
        location: str = "vertex",
        name: Optional[str] = None,
    ) -> Law:
        """`species` and `signals` are names, or a dict of names and typical magnitudes; `name` is by default that of `rates`.

        What a species has besides is given by a dict with `typical`, `lower`, `upper` and `unit`. `rate_partials` gives the
        derivatives of the rates, `{("c", "mean_curvature"): column}` by species and column; pairs that it leaves out are 0. With
        `"jax"` they are found by JAX, for rates written with jax.numpy; by default by differences. `length_factor`,
        `length_factor_across` (a fibre) and `curvature` (spontaneous, of bending) are functions of the species.
        """
    @property
    def name(self) -> str:
        """The name that scenes call it by."""
    @property
    def species(self) -> list[str]:
        """Names of the species."""
