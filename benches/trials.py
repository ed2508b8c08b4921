"""Scenes with known answers, in eleven classes of inputs that are easy to answer wrongly without a word.

    benches/trials.py PROGRAM [--class N …] [--python PYTHON]

Makes the scenes in a temporary folder, runs them with PROGRAM, compares with closed forms, conserved totals or Runge-Kutta
integrations of its own, and prints the table that `docs/notebook/trials.md` sums up. Class 8 needs PYTHON, an interpreter
that has the module `rumple`. Standard library only; trials_sheets.py beside it has the classes of sheets, files and Python.
"""

import argparse
import csv
import math
import os
import subprocess
import tempfile
from pathlib import Path

SHEET = 'sheet = { shape = "disc", radius = 3.0, vertices = 40 }'
POINT = 'sheet = { shape = "point" }'
STAGGERED = {f"staggered {name}": f'{{ kind = "staggered", chemistry = "{name}" }}' for name in ("chebyshev", "bdf", "tsit45")}
MONOLITHIC = {name: f'{{ kind = "monolithic", method = "{name}" }}' for name in ("bdf", "tr-bdf2", "esdirk34")}
TSIT45 = '{ kind = "explicit", method = "tsit45" }'


class Run:
    """A run of a scene: exit code, messages, columns of the ledger by title without unit."""

    def __init__(self, trials: "Trials", scene: str, *arguments: str):
        trials.runs += 1
        folder = Path(trials.folder) / f"run{trials.runs}"
        folder.mkdir()
        self.scene, self.out = folder / "scene.toml", folder / "out"
        self.scene.write_text(scene)
        self.code, self.said = trials.command("run", str(self.scene), "--out", str(self.out), *arguments)
        self.columns: dict[str, list[float]] = {}
        if (ledger := self.out / "ledger.csv").exists():
            with ledger.open() as lines:
                rows = list(csv.reader(lines))
            for k, title in enumerate(rows[0]):
                self.columns[title.split(" [")[0]] = [float(row[k] or "nan") for row in rows[1:]]

    def species(self, name: str) -> tuple[float, float]:
        """Least and largest value of a species along the run: at a point, or over a sheet."""
        if name in self.columns:
            return min(self.columns[name]), max(self.columns[name])
        return min(self.columns[f"least {name}"]), max(self.columns[f"largest {name}"])

    def end(self, name: str) -> float:
        """The last value of a species; of a sheet where it is uniform."""
        last = [self.columns[t][-1] for t in (name, f"least {name}", f"largest {name}") if t in self.columns]
        return max(last, key=abs) if last else math.nan


class Trials:
    """The program, a folder for its scenes, and the rows of the table."""

    def __init__(self, program: str, python: str | None, folder: str):
        self.program, self.python, self.folder = program, python, folder
        self.runs = self.findings = 0

    def command(self, *arguments: str, executable: str | None = None) -> tuple[int, str]:
        """Exit code and messages, without the marks of wrapped lines."""
        done = subprocess.run([executable or self.program, *arguments], capture_output=True, text=True, cwd=self.folder,
                              env=os.environ | {"RAYON_NUM_THREADS": "1"}, timeout=300)
        said = f"{done.stdout} {done.stderr}".replace("│", " ").replace(f"{self.folder}/", "")
        return done.returncode, " ".join(said.split())

    def run(self, scene: str, *arguments: str) -> Run:
        return Run(self, scene, *arguments)

    def row(self, number: int, member: str, expected: str, found: str, right: bool) -> None:
        self.findings += not right
        if number in (8, 9) and right and len(found) > 24:
            found = found[:24].rsplit(" ", 1)[0].rstrip(":,") + " …"
        cells = (str(number), member, expected, found, "✓" if right else "**finding**")
        print("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |", flush=True)

    def near(self, number: int, member: str, expected: float, found: float, tolerance: float, run: Run) -> None:
        """A row of two numbers that differ by at most `tolerance`, of a run that is complete."""
        right = run.code == 0 and abs(found - expected) <= tolerance
        text = f"{found:.5g}" if run.code == 0 else f"code {run.code}: {run.said[:120]}"
        self.row(number, member, f"{expected:.5g} ± {tolerance:.1g}", text, right)


def kinetics(rates: dict, initial: dict, until: float, sheet: str = POINT, integrator: str = "", more: str = "") -> str:
    """A scene of a law as text."""
    lines = [sheet, more, "[kinetics]"]
    lines += [f'rates.{name} = "{rate}"' for name, rate in rates.items()]
    lines += [f"initial.{name} = {value!r}" for name, value in initial.items()]
    lines += ["[time]", 'policy = "simultaneous"', f"until = {until!r}"]
    lines += [f"integrator = {integrator}"] if integrator else []
    return "\n".join([*lines, "[output]", "report = false", ""])


def integral(rate, a: float, b: float, parts: int = 400_000) -> float:
    """Midpoint rule."""
    step = (b - a) / parts
    return sum(rate(a + (k + 0.5) * step) for k in range(parts)) * step


def runge_kutta(rates, y: list[float], until: float, steps: int = 100_000) -> list[float]:
    """Fourth order, fixed steps."""
    h = until / steps
    moved = lambda y, k, by: [a + by * b for a, b in zip(y, k)]
    for _ in range(steps):
        a = rates(y)
        b = rates(moved(y, a, h / 2))
        c = rates(moved(y, b, h / 2))
        d = rates(moved(y, c, h))
        y = [v + h / 6 * (p + 2 * q + 2 * r + s) for v, p, q, r, s in zip(y, a, b, c, d)]
    return y


# ------------------------------------------------------------------------------------------------ 1: pulses in time
def pulses(trials: Trials) -> None:
    """Rates and loads that are 0 at both ends of a step."""
    root = math.sqrt(math.pi)
    window = lambda t: 1 / (1 + math.exp(min((50 - t) / 0.05, 700))) / (1 + math.exp(min((t - 50.5) / 0.05, 700)))
    members = [
        ("two gaussians far apart", "exp(-((t-30)/0.2)^2) + 2*exp(-((t-170)/0.05)^2)", 0.3 * root, "", POINT),
        ("ten bursts", "step(t-40)*step(60-t)*sin(pi*(t-40)/2)^2", 10.0, MONOLITHIC["tr-bdf2"], POINT),
        ("sech²", "1 - tanh((t-77.7)/0.4)^2", 0.8, STAGGERED["staggered chebyshev"], SHEET),
        ("clipped sine, 7 % of the period", "pos(sin(t) - 0.975)", integral(lambda t: max(math.sin(t) - 0.975, 0), 0, 200), STAGGERED["staggered bdf"], SHEET),
        ("window of two switches", "logistic((t-50)/0.05)*logistic((50.5-t)/0.05)", integral(window, 45, 55), MONOLITHIC["esdirk34"], POINT),
        ("gaussian times sine²", "sin(2*pi*t)^2*exp(-((t-50)/2)^2)", root * (1 - math.exp(-((4 * math.pi) ** 2))), "", SHEET),
        ("Lorentzian", "1/(1 + ((t-123)/0.02)^2)", 0.02 * (math.atan(77 / 0.02) + math.atan(123 / 0.02)), MONOLITHIC["bdf"], SHEET),
        ("a pulse that travels", "exp(-((t - 60 - 5*position_x)/0.3)^2)", 0.3 * root, TSIT45, SHEET),
        ("sin⁴⁰, one crest", "sin(pi*t/200)^40", 200 * math.comb(40, 20) / 2**40, STAGGERED["staggered tsit45"], POINT),
        ("a pulse in a `let` and a parameter", "w*q", 0.01 * root, "", POINT),
    ]
    for member, rate, exact, integrator, sheet in members:
        scene = kinetics({"c": rate}, {"c": 0.0}, 200.0, sheet, integrator)
        if "q" in rate.split("*"):
            scene = scene.replace("[time]", 'let.q = "exp(-((t - at)/0.01)^2)"\nparameters = { w = 1.0, at = 141.4 }\n[time]')
        run = trials.run(scene)
        trials.near(1, f"{member}: `{rate}`", exact, run.end("c"), 0.02 * exact, run)
    for member, ramp, exact, integrator in [
        ("load under drag, one pulse", "exp(-((t-50)/0.4)^2)", 0.4 * root, ""),
        ("load under drag, clipped sine", "pos(sin(2*pi*t/10) - 0.95)", integral(lambda t: max(math.sin(math.tau * t / 10) - 0.95, 0), 0, 100), MONOLITHIC["esdirk34"]),
    ]:
        scene = kinetics({"c": "position_z"}, {"c": 0.0}, 100.0, SHEET, integrator,
                         'material = { young = 1.0, poisson = 0.3, thickness = 0.1, drag = { per-area = 1.0 } }\neffect = [{ kind = "stretching" },'
                         f' {{ kind = "load", where = "all", force = {{ per-area = [0, 0, 1] }}, ramp = {{ formula = "{ramp}" }} }}]')
        run = trials.run(scene.replace('"position_z"', '"0"'), "--set", 'output.fields=["c"]', "--set", 'output.compression="none"')
        trials.near(1, f"{member}: `{ramp}`", exact, last_height(run), 0.02 * exact, run)


def last_height(run: Run) -> float:
    """Mean z of the last frame."""
    from trials_sheets import positions

    frames = sorted((run.out / "frames").glob("*.vtu")) if run.code == 0 else []
    heights = [x[2] for x in positions(frames[-1])] if frames else [math.nan]
    return sum(heights) / len(heights)


# ------------------------------------------------------------------------------------------------ 2: units of amounts
def amounts(trials: Trials) -> None:
    """The same law in units in which species are of the size K, without a typical magnitude."""
    members = [
        ("repressor", {"u": "K/(1+(u/K)^4) - u"}, {"u": 0.0}, lambda y: [1 / (1 + y[0] ** 4) - y[0]]),
        ("Michaelis-Menten", {"s": "-K*s/(0.1*K+s)", "p": "K*s/(0.1*K+s)"}, {"s": 1.0, "p": 0.0}, lambda y: [-y[0] / (0.1 + y[0]), y[0] / (0.1 + y[0])]),
        ("Brusselator", {"u": "K + u^2*v/K^2 - 4*u", "v": "3*u - u^2*v/K^2"}, {"u": 1.0, "v": 1.0}, lambda y: [1 + y[0] ** 2 * y[1] - 4 * y[0], 3 * y[0] - y[0] ** 2 * y[1]]),
        ("Gompertz", {"u": "-u*log(u/K)"}, {"u": 1e-3}, lambda y: [-y[0] * math.log(y[0])]),
        ("epidemic", {"s": "-2*s*i/K", "i": "2*s*i/K - i/2"}, {"s": 1.0, "i": 1e-3}, lambda y: [-2 * y[0] * y[1], 2 * y[0] * y[1] - y[1] / 2]),
        ("dimers", {"a": "-2*a^2/K + 2*d", "d": "a^2/K - d"}, {"a": 1.0, "d": 0.0}, lambda y: [2 * y[1] - 2 * y[0] ** 2, y[0] ** 2 - y[1]]),
        ("toggle switch", {"u": "2*K/(1+(v/K)^2) - u", "v": "2*K/(1+(u/K)^2) - v"}, {"u": 0.0, "v": 0.5}, lambda y: [2 / (1 + y[1] ** 2) - y[0], 2 / (1 + y[0] ** 2) - y[1]]),
        ("a pool that feeds a chain", {"u": "-0.3*u", "v": "0.3*u - 3*v", "w": "3*v"}, {"u": 1.0, "v": 0.0, "w": 0.0}, lambda y: [-0.3 * y[0], 0.3 * y[0] - 3 * y[1], 3 * y[1]]),
        ("van der Pol", {"u": "v", "v": "(1 - u^2/K^2)*v - u"}, {"u": 1.0, "v": 0.0}, lambda y: [y[1], (1 - y[0] ** 2) * y[1] - y[0]]),
        ("Lotka-Volterra", {"u": "u - u*v/K", "v": "u*v/K - v"}, {"u": 2.0, "v": 1.0}, lambda y: [y[0] - y[0] * y[1], y[0] * y[1] - y[1]]),
    ]
    for member, rates, initial, law in members:
        exact = runge_kutta(law, list(initial.values()), 8.0, 20_000)
        size = max(map(abs, exact))
        for name, sheet, integrator, within in [("point", POINT, "", 0.01), ("sheet", SHEET, "", 0.05)]:
            worst, where = 0.0, ""
            for k in (1.0, 1e-3, 1e-9, 1e-15):
                start = {n: v * k for n, v in initial.items()}
                scene = kinetics(rates, start, 8.0, sheet, integrator).replace("[time]", f"parameters.K = {k!r}\n[time]")
                run = trials.run(scene)
                off = max(abs(run.end(n) / k - e) / size for n, e in zip(initial, exact)) if run.code == 0 else math.inf
                worst, where = max((worst, where), (off, f" at K = {k:g}"))
            trials.row(2, f"{member}, {name}", f"the same in units of K = 1 to 1e-15, within {within:g}", f"{worst:.1e}{where}", worst <= within)


# ------------------------------------------------------------------------------------------------ 3: output times
def outputs(trials: Trials) -> None:
    """Output times nearer to each other than the steps, where nothing moves."""
    diffusion = 'effect = [{ kind = "diffusion", species = "c", coefficient = 1.0 }]'
    members = [
        ("steady, 600 outputs", "0", 1.0, 0.06, 1e-4, "bdf", ""),
        ("decay, times 1e-9 apart", "-c", 1.0, 1e-7, 1e-9, "bdf", ""),
        ("decay, 1/30 of no whole number", "-c", 1.0, 10.0, 1 / 30, "esdirk34", diffusion),
        ("a jump just beyond an output", "step(t - 0.3000001) - c", 0.0, 1.0, 0.1, "tr-bdf2", ""),
        ("a jump at every output", "1 + step(sin(2*pi*t)) - c", 1.0, 5.0, 0.5, "bdf", diffusion),
        ("pulse between outputs", "exp(-((t-0.05)/0.001)^2)", 0.0, 1.0, 0.1, "bdf", ""),
        ("staggered chebyshev", "-c", 1.0, 5.0, 0.0137, "staggered chebyshev", diffusion),
        ("staggered bdf", "-c", 1.0, 0.4, 1e-3, "staggered bdf", ""),
        ("explicit euler, step 0.03, outputs 0.1", "-c", 1.0, 1.0, 0.1, '{ kind = "explicit", method = "euler", step = 0.03 }', ""),
        ("longer than the run", "-c", 1.0, 1.0, 7.0, "bdf", ""),
        ("oscillator, 500 outputs", "cos(t)", 0.0, 20.0, 0.04, "esdirk34", diffusion),
    ]
    for member, rate, start, until, every, integrator, more in members:
        chosen = (STAGGERED | MONOLITHIC).get(integrator, integrator)
        run = trials.run(kinetics({"c": rate}, {"c": start}, until, SHEET, chosen, more), "--set", f"output.every={every!r}")
        exact = known(rate, start, until)
        times, wanted = set(run.columns.get("time", [])), []
        while (k := len(wanted) + 1) * every < until:
            wanted.append(k * every)
        missed = [t for t in [*wanted, until] if t not in times]
        frames = len(list((run.out / "frames").glob("*.vtu")))
        # The fixed step of Euler's method has the error h/2 of its order.
        within = 0.05 if "staggered" in integrator or "euler" in integrator else 2e-3
        right = run.code == 0 and not missed and abs(run.end("c") - exact) < within and frames == len(wanted) + 2
        found = f"{run.end('c'):.5g}, {frames} frames, {len(missed)} missed" if run.code == 0 else run.said[:120]
        trials.row(3, f"{member} ({integrator.split(',')[0].strip('{ ')})", f"{exact:.5g} ± {within:g}, {len(wanted) + 2} frames at multiples", found, right)


def known(rate: str, start: float, until: float) -> float:
    """Solutions of the laws of [`outputs`]."""
    if rate == "0":
        return start
    if rate == "-c":
        return start * math.exp(-until)
    if rate == "cos(t)":
        return math.sin(until)
    if rate.startswith("exp"):
        return 0.001 * math.sqrt(math.pi)
    if rate.startswith("step"):
        return 1 - math.exp(0.3000001 - until)
    c = start  # relaxation to 2 and 1 in turns of half a unit
    for k in range(round(2 * until)):
        level = 2.0 if k % 2 == 0 else 1.0
        c = level + (c - level) * math.exp(-0.5)
    return c


# ------------------------------------------------------------------------------------------------ 5: stiff, conserved
def stiff(trials: Trials) -> None:
    """Conserved totals at loose tolerances: species stay between 0 and their total."""
    plugin = lambda name, initial, until: f'{POINT}\n[kinetics]\nplugin = "{name}"\ninitial = {initial}\n[time]\nuntil = {until}\n[output]\nreport = false\n'
    chain = {"a": "1e3*b - 1e-2*a", "b": "1e-2*a - 1e3*b - 1e6*b + 1e2*c", "c": "1e6*b - 1e2*c - 1e-3*c + 1e-5*d", "d": "1e-3*c - 1e-5*d"}
    bound = {"s": "-1e6*e*s + 1e2*q", "e": "-1e6*e*s + 1.1e3*q", "q": "1e6*e*s - 1.1e3*q", "p": "1e3*q"}
    covalent = {"w": "-1e5*w*e1 + 10*c1 + 1e2*c2", "c1": "1e5*w*e1 - 110*c1", "e1": "-1e5*w*e1 + 110*c1",
                "x": "1e2*c1 - 1e5*x*e2 + 10*c2", "c2": "1e5*x*e2 - 110*c2", "e2": "-1e5*x*e2 + 110*c2"}
    ozone = {"n2": "-0.35*n2 + 26.6e2*o3*n", "n": "0.35*n2 - 26.6e2*o3*n", "o": "0.35*n2 - 1e6*o", "o3": "1e6*o - 26.6e2*o3*n"}
    e5 = {"a": "-7.89e-10*a - 1.936e4*a*c", "b": "7.89e-10*a - 1.9888e6*b*c", "c": "7.89e-10*a - 1.936e4*a*c + 1.13e3*d - 1.9888e6*b*c", "d": "1.936e4*a*c - 1.13e3*d"}
    acid = {"x": "-1e3*x + 1e8*h*y", "h": "1e3*x - 1e8*h*y", "y": "1e3*x - 1e8*h*y - 1e4*y + 1e-1*z", "z": "1e4*y - 1e-1*z"}
    plague = {"s": "-1e4*s*i + 10*r", "i": "1e4*s*i - 1e3*i", "r": "1e3*i - 10*r"}
    dimer = {"m": "-2e8*m^2 + 2*d", "d": "1e8*m^2 - d - 1e5*d*k + 1e-2*b", "k": "-1e5*d*k + 1e-2*b", "b": "1e5*d*k - 1e-2*b"}
    gate = {"a": "-1e4*a + 1e-1*b", "b": "1e4*a - (1e-1 + 1e7)*b + 1e6*c", "c": "1e7*b - (1e6 + 1e-3)*c + 1e-6*e", "e": "1e-3*c - 1e-6*e"}
    members = [  # name, scene, totals by species with their factors, known values at the end with their tolerance
        ("HIRES", plugin("hires", "{ y1 = 1.0, y8 = 0.0057 }", 321.8122), {"y7+y8": 0.0057}, {"y1": (7.371e-4, 0.01), "y8": (2.85e-3, 6e-4)}),
        ("Oregonator", plugin("oregonator", "{ y1 = 1.0, y2 = 2.0, y3 = 3.0 }", 360.0), {"y1": 1.3e5, "y2": 2e3, "y3": 3.5e4}, {}),
        ("chain of rates 1e-5 to 1e6", kinetics(chain, {"a": 1.0, "b": 0.0, "c": 0.0, "d": 0.0}, 1e8), {"a+b+c+d": 1.0}, {"d": (1 / (1 + 1e-2 + 1e-6 + 1e-1), 0.05)}),
        ("Michaelis-Menten with complex", kinetics(bound, {"s": 1.0, "e": 1e-3, "q": 0.0, "p": 0.0}, 1e3), {"s+q+p": 1.0, "e+q": 1e-3}, {"p": (1.0, 0.05)}),
        ("Goldbeter-Koshland", kinetics(covalent, {"w": 1.0, "c1": 0.0, "e1": 1e-2, "x": 0.0, "c2": 0.0, "e2": 5e-3}, 1e4), {"w+c1+x+c2": 1.0, "c1+e1": 1e-2, "c2+e2": 5e-3}, {"x": (0.99, 0.06)}),
        ("NO, NO₂, O₃", kinetics(ozone, {"n2": 0.1, "n": 0.0, "o": 0.0, "o3": 0.0}, 1e4), {"n2+n": 0.1, "n2+o+o3": 0.1}, {"o3": (3.564e-3, 5e-4)}),
        ("E5, scaled", kinetics(e5, {"a": 1.0, "b": 0.0, "c": 0.0, "d": 0.0}, 1e11), dict.fromkeys("abcd", 1.0), {}),
        ("acid and buffer", kinetics(acid, {"x": 1.0, "h": 0.0, "y": 0.0, "z": 0.0}, 1e6), {"x+y+z": 1.0, "x+h": 1.0}, {}),
        ("epidemic that returns", kinetics(plague, {"s": 1.0, "i": 1e-6, "r": 0.0}, 1e4), {"s+i+r": 1.0}, {"s": (0.1, 0.05)}),
        ("dimers that bind", kinetics(dimer, {"m": 1.0, "d": 0.0, "k": 0.3, "b": 0.0}, 1e5), {"m+2*d+2*b": 1.0, "k+b": 0.3}, {"b": (0.3, 0.03)}),
        ("channel with four states", kinetics(gate, {"a": 1.0, "b": 0.0, "c": 0.0, "e": 0.0}, 1e9), {"a+b+c+e": 1.0}, {"e": (1 / (1 + 1e-3 + 1e-4 + 1e-9), 0.05)}),
    ]
    methods = {**MONOLITHIC, "staggered bdf": STAGGERED["staggered bdf"]}
    for member, scene, totals, ends in members:
        worst, wrong, stopped, close = 0.0, [], [], 0.0
        for (name, integrator), tolerance in ((m, t) for m in methods.items() for t in (1e-2, 1e-3)):
            chosen = integrator.replace(" }", f", rtol = {tolerance}, atol = {tolerance} }}")
            run = trials.run(scene, "--set", f"time.integrator={chosen}")
            if run.code:
                stopped.append(f"{name} {tolerance:g}: {run.said.split('error:')[-1][:80]}")
                continue
            off = max(beyond(run, total, size) for total, size in totals.items())
            bad = [f"{s} = {run.end(s):.3g}" for s, (value, within) in ends.items() if abs(run.end(s) - value) > within]
            close = max([close, *(abs(run.end(s) - value) for s, (value, _) in ends.items())])
            worst = max(worst, off)
            if off > 0.1 or bad:
                wrong.append(f"{name} {tolerance:g}: {off:.2g} beyond {' '.join(bad)}")
        known = ", ".join(f"{s} → {value:.4g}" for s, (value, _) in ends.items())
        text = f"at most {worst:.1e} beyond" + (f", {close:.1e} from the end" if ends else "") + (f"; stopped: {stopped}" if stopped else "")
        trials.row(5, member, f"0 ≤ species ≤ total {known}".strip(), "; ".join(wrong) or text, not wrong)


def beyond(run: Run, total: str, size: float) -> float:
    """How far the species of a total leave the range from 0 to it along a run, and the total its value, in units of it."""
    terms = [(float(f) if f else 1.0, name) for f, _, name in (part.rpartition("*") for part in total.split("+"))]
    columns = [[factor * value for value in run.columns[name]] for factor, name in terms]
    below, above = min(map(min, columns)), max(map(max, columns))
    sums = [sum(row) for row in zip(*columns)] if len(terms) > 1 else [size]
    return max(-below, above - size, max(abs(s - size) for s in sums)) / size


# ------------------------------------------------------------------------------------------------ 6: edges of domains
def edges(trials: Trials) -> None:
    """Rates whose derivatives are infinite or one-sided at the edge of a domain that the solution reaches."""
    e = math.e
    steady = bisection(lambda c: 1 - c**0.7 / (0.5**0.7 + c**0.7) - 0.2 * c, 0.0, 5.0)
    slow = bisection(lambda s: -2 * s - 2 * math.log(1 - s) - 3.0, 0.0, 1 - 1e-12) ** 2
    members = [
        ("dies out in finite time", {"c": "-pos(c)^0.3"}, {"c": 1.0}, 3.0, {"c": 0.0}),
        ("root at 0, where the slope is infinite", {"c": "3*pos(c)^(2/3)"}, {"c": 0.0}, 2.0, {"c": 0.0}),
        ("from 0 by 1 - √|c|", {"c": "1 - sqrt(abs(c))"}, {"c": 0.0}, 3.0, {"c": slow}),
        ("Hill of exponent 0.7 from 0", {"c": "1 - hill(c, 0.5, 0.7) - 0.2*c"}, {"c": 0.0}, 60.0, {"c": steady}),
        ("log(1 + pos) through 0", {"c": "1 - log(1 + pos(c))"}, {"c": -1.0}, 60.0, {"c": e - 1}),
        ("√c - c from a little", {"c": "pos(c)^0.5 - c"}, {"c": 0.01}, 3.0, {"c": (1 - 0.9 * math.exp(-1.5)) ** 2}),
        ("power 1.5 that ends", {"c": "pos(1 - c)^1.5 - pos(c - 2)^0.5"}, {"c": 0.0}, 10.0, {"c": 1 - 1 / 36}),
        ("exp(-1/pos(c)) through 0", {"c": "1 + exp(-1/pos(c))"}, {"c": -1.0}, 2.0, {"c": runge_kutta(lambda y: [1 + math.exp(-1 / y[0]) if y[0] > 0 else 1.0], [0.0], 1.0)[0]}),
        ("√(1 - c²) to its end", {"c": "sqrt(1 - min(c, 1)^2)"}, {"c": 0.0}, 3.0, {"c": 1.0}),
        ("-c log(max(c, 0⁺))", {"c": "-c*log(max(c, 1e-90))"}, {"c": 1e-6}, 2.0, {"c": math.exp(math.log(1e-6) * math.exp(-2))}),
        ("two that become equal", {"u": "-sqrt(pos(u - v))", "v": "sqrt(pos(u - v))"}, {"u": 1.0, "v": 0.0}, 3.0, {"u": 0.5, "v": 0.5}),
    ]
    for member, rates, initial, until, exact in members:
        for name, sheet, integrator, within in [("point", POINT, "", 1e-3), ("sheet", SHEET, "", 0.02), ("sheet, bdf", SHEET, MONOLITHIC["bdf"], 5e-3)]:
            run = trials.run(kinetics(rates, initial, until, sheet, integrator))
            off = {s: run.end(s) - value for s, value in exact.items()} if run.code == 0 else {}
            worst = max(map(abs, off.values()), default=math.inf)
            if name == "point" or worst > within:
                text = f"within {worst:.1e}" if off else f"code {run.code}: {run.said.split('error:')[-1][:140]}"
                trials.row(6, f"{member}, {name}", ", ".join(f"{s} = {v:.5g}" for s, v in exact.items()) + f" ± {within:g}", text, worst <= within)


def bisection(f, low: float, high: float) -> float:
    """The root of a function that changes its sign once."""
    sign = f(low) > 0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (f(middle) > 0) == sign else (low, middle)
    return low


def main() -> None:
    import trials_sheets as sheets

    classes = {1: pulses, 2: amounts, 3: outputs, 4: sheets.contradictions, 5: stiff, 6: edges, 7: sheets.resolution,
               8: sheets.python, 9: sheets.results, 10: sheets.clamps, 11: sheets.every}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--class", dest="number", type=int, action="append", choices=classes, help="all if not given")
    parser.add_argument("--python", help="an interpreter that has the module")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        python = arguments.python and os.path.abspath(arguments.python)
        trials = Trials(os.path.abspath(arguments.program), python, folder)
        print("| class | member | expected | found | verdict |\n| --- | --- | --- | --- | --- |")
        for number in arguments.number or classes:
            classes[number](trials)
    print(f"\n{trials.findings} findings.")


if __name__ == "__main__":
    main()
