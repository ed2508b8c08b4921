//! Runs that stop say which of mesh, load, start, tolerance and chemistry it is, and what to try.

use std::fmt::Write;
use std::fs;

use super::failed::{LATE_FAILURE, failing};
use super::program::{folder, rumple, text};
use crate::common::path;
use crate::coupled::DOME;

use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::solve::SolveError;
use rumple::{Error, Simulation};

/// Rows of isosceles triangles, so many times as long as high, pulled apart by what grows on them.
fn needles(aspect: f64) -> String {
    let (columns, rows) = (12, 12);
    let mut obj = String::new();
    for r in 0..rows {
        for c in 0..columns {
            let shift = if r % 2 == 1 { 0.5 } else { 0.0 };
            let x = aspect * (f64::from(c) + shift);
            writeln!(obj, "v {x} {} 0", f64::from(r) * 0.75f64.sqrt()).unwrap();
        }
    }
    let at = |c: i32, r: i32| 1 + r * columns + c;
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let (a, b, d, e) = (at(c, r), at(c + 1, r), at(c, r + 1), at(c + 1, r + 1));
            let pairs = if r % 2 == 0 { [[a, b, d], [b, e, d]] } else { [[a, b, e], [a, e, d]] };
            pairs.iter().for_each(|[a, b, c]| writeln!(obj, "f {a} {b} {c}").unwrap());
        }
    }
    obj
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "no `{part}` in {message}");
    }
}

#[test]
fn needles_are_blamed_on_the_mesh() {
    let folder = folder("");
    fs::write(folder.path().join("needles.obj"), needles(100.0)).unwrap();
    let scene = &path("models/hard/patch.toml");
    let file = format!("sheet.file={}", folder.path().join("needles.obj").display());
    let message = failing(folder.path(), &[scene, "--set", &file, "--out", "a", "--quiet"]);
    assert_says(&message, &["the cause is the mesh", "times as long as high", "mesh check"]);
    let report = fs::read_to_string(folder.path().join("a/failure/report.md")).unwrap();
    assert_says(&report, &["the cause is the mesh"]);
}

#[test]
fn a_load_that_nothing_holds_is_blamed() {
    let folder = folder("");
    let scene = &path("models/hard/free.toml");
    let keys = ["--set", "equilibrium.max_iterations=100", "--set", "sheet.vertices=100"];
    let args = [&[scene, "--out", "a", "--quiet"], &keys[..]].concat();
    let message = failing(folder.path(), &args);
    assert_says(&message, &["the cause is the load", "effect load", "nothing holds it", "pin"]);
}

/// A thousand times what stretches the sheet.
#[test]
fn a_load_beyond_what_the_sheet_can_bear_is_blamed() {
    let folder = folder(DOME);
    let keys = ["--set", "effect.pressure.value=1e7", "--set", "equilibrium.max_iterations=50"];
    let args = [&["scene.toml", "--out", "a", "--quiet"], &keys[..]].concat();
    let message = failing(folder.path(), &args);
    assert_says(
        &message,
        &["the cause is the load", "pressure acts on the sheet at rest", "units"],
    );
}

/// One end of a strip is led towards the other.
const STRIP: &str = r#"
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = { half-space = { point = [-9.9, 0, 0], normal = [-1, 0, 0] } }, axes = "xyz" },
    { kind = "pin", where = { half-space = { point = [9.9, 0, 0], normal = [1, 0, 0] } }, axes = "xyz",
      displacement = [-15.0, 0, 0], ramp = { formula = "t" } },
]
sheet = { shape = "rectangle", width = 20.0, height = 2.0, vertices = 300 }
material = { young = 1e6, poisson = 0.3, thickness = 0.05 }
time = { until = 1.0, integrator = { kind = "staggered", longest_step = 0.1 } }
"#;

#[test]
fn a_flat_start_is_told_of_before_it_is_compressed() {
    let folder = folder(STRIP);
    let done = rumple(folder.path(), &["run", "scene.toml", "--out", "a"]);
    let parts = ["perfectly flat", "under compression", "imperfection", "passes through itself"];
    assert_says(&text(&done.stderr), &parts);
}

/// Forces of the last digits of positions far from the origin.
#[test]
fn a_tolerance_below_round_off_is_blamed() {
    let folder = folder(LATE_FAILURE);
    let keys = ["--set", "equilibrium.tolerance=1e-18", "--set", "equilibrium.max_iterations=60"];
    let args = [&["scene.toml", "--out", "a", "--quiet"], &keys[..]].concat();
    let message = failing(folder.path(), &args);
    assert_says(&message, &["the cause is the tolerance", "16 digits", "equilibrium.tolerance = "]);
}

/// It ended as "stable", with a negative volume.
#[test]
fn a_sphere_that_is_pushed_through_itself_is_no_result() {
    let folder = folder(
        r#"
effect = [
    { kind = "stretching", model = "stvk", modulus = "plate" },
    { kind = "bending" },
    { kind = "pressure", value = -3300.0 },
]
sheet = { shape = "sphere", radius = 10.0, vertices = 362 }
material = { young = 1e6, poisson = 0.3, thickness = 0.5 }
time = { until = 1.0 }
"#,
    );
    let message = failing(folder.path(), &["scene.toml", "--out", "a", "--quiet"]);
    assert_says(&message, &["jumps inside out, through itself", "a smaller load", "step 0"]);
}

/// A closed shell of E = 1e4 and h = 0.1 under a pressure that grows to `pressure`.
fn shell(sheet: &str, pressure: f64) -> String {
    format!(
        r#"
time = {{ until = 1.0, integrator = {{ kind = "staggered", longest_step = 0.05 }} }}
effect = [{{ kind = "stretching" }}, {{ kind = "bending" }}, {{ kind = "pressure", value = {pressure}, ramp = {{ formula = "t" }} }}]

[sheet]
shape = "sphere"
radius = 5.0
{sheet}

[material]
young = 1e4
poisson = 0.3333333333333333
thickness = 0.1
"#
    )
}

#[test]
fn a_balloon_beyond_what_it_holds_ends_at_its_limit_load() {
    let folder = folder(&shell("vertices = 200", 500.0));
    let message = failing(folder.path(), &["scene.toml", "--out", "a", "--quiet"]);
    // The tension of bonds grows to a bound, at 168.75 of 500; beyond, the balloon grows under the drag.
    assert_says(&message, &["limit load", "simultaneous", "stopped at time 0.34"]);
}

/// The message blamed a law, and the advice of the quasi-static run led there.
#[test]
fn a_balloon_that_moves_beyond_its_limit_load_is_no_fault_of_a_law() {
    let folder = folder(&shell("vertices = 200", 500.0));
    let keys = ["--set", "time.policy=\"simultaneous\"", "--set", "material.drag=0.1"];
    let args = [&["scene.toml", "--out", "a", "--quiet"], &keys[..]].concat();
    let message = failing(folder.path(), &args);
    let parts = ["the cause is the load", "pressure has stretched edges", "blows up", "time.until"];
    assert_says(&message, &parts);
}

/// Programs that step by themselves get the same error as runs.
#[test]
fn a_step_that_blows_up_is_an_error() {
    let folder = folder(&shell("vertices = 200", 500.0));
    let set = ["time.policy=\"simultaneous\"", "material.drag=0.1"].map(str::to_owned);
    let scene = Scene::load(&folder.path().join("scene.toml"), &set).unwrap();
    let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[])).unwrap();
    simulation.prepare().unwrap();
    let until = scene.time.span.until.get();
    let error = std::iter::repeat_with(|| simulation.step(until)).find_map(Result::err).unwrap();
    let Error::Solve(SolveError::BlowUp { time }) = error else { panic!("{error}") };
    assert_eq!(time, simulation.state().time);
    assert!(time > 0.3 && time < until, "{time}");
}

/// It folds flat in one step and is turned over in another one.
#[test]
fn a_shell_that_is_turned_over_in_parts_is_no_result() {
    let folder = folder(&shell("irregular = true\nvertices = 400", -10.0));
    let message = failing(folder.path(), &["scene.toml", "--out", "a", "--quiet"]);
    assert_says(&message, &["inside out, through itself"]);
}

#[test]
fn a_species_that_runs_away_is_named_with_the_time() {
    let folder = folder("");
    let scene = &path("models/hard/law.toml");
    let args = [scene, "--out", "a", "--quiet", "--set", "kinetics.rates.c=c^2"];
    let message = failing(folder.path(), &args);
    // 1/c(0) at the vertex with the most.
    let parts = [
        "the cause is the chemistry",
        "species `c` blows up in finite time",
        "a singularity near time 1.2",
    ];
    assert_says(&message, &parts);
}

/// It does so at no great size.
#[test]
fn a_species_that_runs_away_by_an_exponential_is_named_too() {
    let folder = folder("");
    let scene = &path("models/hard/law.toml");
    let args = [scene, "--out", "a", "--quiet", "--set", "kinetics.rates.c=exp(c)"];
    let message = failing(folder.path(), &args);
    assert_says(&message, &["the cause is the chemistry", "species `c` blows up in finite time"]);
}

#[test]
fn a_law_that_chatters_about_a_pole_comes_to_an_end() {
    let folder = folder(LATE_FAILURE);
    let keys = ["kinetics.rates.c=1/(1 - c)", "time.until=5", "sheet.vertices=30"];
    let keys = keys.iter().flat_map(|key| ["--set", *key]);
    let args: Vec<&str> = ["scene.toml", "--out", "a", "--quiet"].into_iter().chain(keys).collect();
    let message = failing(folder.path(), &args);
    assert_says(&message, &["the chemistry is not resolved", "species `c` at vertex", "pole"]);
}

#[test]
fn explicit_steps_beyond_the_limit_of_diffusion_are_told() {
    let folder = folder(LATE_FAILURE);
    let euler = r#"time.integrator={ kind = "staggered", method = "euler", step = 0.1 }"#;
    let keys = ["kinetics.rates.c=-c", "effect[3].coefficient=100", euler];
    let keys = keys.iter().flat_map(|key| ["--set", *key]);
    let args: Vec<&str> = ["run", "scene.toml", "--out", "a"].into_iter().chain(keys).collect();
    let done = rumple(folder.path(), &args);
    let message = text(&done.stderr);
    assert_says(&message, &["longer than diffusion allows", "stable up to about"]);
    let fine = [
        &args[..],
        &["--force", "--set", "time.integrator.step=0.0001", "--set", "time.until=0.001"],
    ];
    let done = rumple(folder.path(), &fine.concat());
    let message = text(&done.stderr);
    assert!(done.status.success() && !message.contains("diffusion allows"), "{message}");
}

#[test]
fn steps_that_shrink_are_told_and_their_causes_are_in_the_ledger() {
    let folder = folder(LATE_FAILURE);
    let message = failing(folder.path(), &["scene.toml", "--out", "a"]);
    assert_says(&message, &["steps have shrunk by a factor of", "rejected for: ", " law"]);
    let ledger = fs::read_to_string(folder.path().join("a/ledger.csv")).unwrap();
    let mut rows = ledger.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let columns = rows.next().unwrap();
    let at =
        |name: &str| columns.iter().position(|c| *c == name).unwrap_or_else(|| panic!("{name}"));
    let causes: Vec<usize> =
        (0..columns.len()).filter(|k| columns[*k].starts_with("rejected for ")).collect();
    assert_eq!(causes.len(), 8, "{columns:?}");
    let (mut law, mut odd) = (0.0, 0.0);
    for row in rows {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let all: f64 = causes.iter().map(|k| number(*k)).sum();
        assert_eq!(all.to_bits(), number(at("rejected")).to_bits(), "{row:?}");
        law += number(at("rejected for law"));
        odd += number(at("values not finite"));
    }
    assert!(law > 0.0 && odd >= law, "{law} tries, {odd} values");
}
