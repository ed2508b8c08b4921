"""Tables in HTML, as notebooks show objects."""

import html


def table(caption, rows):
    """Rows of a name and a value each."""
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(str(value))}</td></tr>" for name, value in rows)
    return f"<table><caption>{html.escape(str(caption))}</caption>{cells}</table>"


def ranges(fields):
    """A row a field with one component: least, mean and largest value; largest length of vectors."""
    for name, values in fields.items():
        if values.ndim > 1:
            yield name, f"length up to {(values**2).sum(axis=1).max() ** 0.5:.4g}"
        elif len(values):
            yield name, f"{values.min():.4g} to {values.max():.4g}, mean {values.mean():.4g}"


def simulation(sim):
    """The state of a simulation."""
    rows = [("time", f"{sim.time:g}"), ("step", sim.steps), ("vertices", len(sim.positions))]
    if len(sim.triangles):
        rows += [("triangles", len(sim.triangles)), ("area", f"{sim.area:.6g}")]
    rows += ranges(dict(sim.species.items()))
    rows += [(f"energy of {name}", f"{energy:.6g}") for name, energy in sim.energies().items()]
    return table("Simulation", rows + [("note", note) for note in sim.notes])


def frame(of):
    """A frame of results."""
    time = "unknown" if of.time is None else f"{of.time:g}"
    rows = [("time", time), ("points", len(of.points)), ("triangles", len(of.triangles))]
    return table(of.path.name, [*rows, *ranges(of.fields), *ranges(of.cell_fields)])
