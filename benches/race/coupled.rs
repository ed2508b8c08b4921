//! (B) Model I with explicit Euler steps, as `coupled_tao.py` has it, through the whole engine.
//!
//! Same mesh, start, rates, printed energy and step; species on triangles, carried to vertices with
//! weights 1/distance. Their relaxations stop at a largest force of 5·10⁻³ Y/(mean edge), ours at
//! `--tolerance` of it; in the loose race at the same, in a plain metric as theirs is. One difference
//! remains: their mean curvature divides by barycentric areas, ours by Voronoi areas of the rest triangles.

use std::fs;

use rumple::Simulation;
use rumple::Vec3;
use rumple::kinetics::PluginSearch;
use rumple::num::real;
use rumple::output::{Interrupt, Mode, Progress, ResultDirectory};
use rumple::run::run;
use rumple::scene::Scene;

use crate::common::{Result, Table, cpu_seconds, number};
use crate::problem::{MATERIAL, read_positions, read_sheet, smallest_angle};
use crate::{Baselines, Options};

/// The paper's time step.
const STEP: f64 = 0.5;

/// Force tolerance of the baseline, in units of Y/(mean edge).
const THEIR_TOLERANCE: f64 = 5e-3;

/// Species above this have expanded the sheet.
const EXPANSION_THRESHOLD: f64 = 0.1;

/// One of our sides.
struct Entry {
    /// Name.
    label: String,
    method: String,
    /// Force tolerance, in the same units.
    tolerance: f64,
    /// Overrides before those of the command line.
    set: Vec<String>,
}

/// Model I by the methods that are asked for, at our tolerance; appended to `report`.
pub fn race(
    options: &Options,
    baselines: &Baselines,
    vertices: usize,
    report: &mut String,
) -> Result<()> {
    let entries = options.method.iter().map(|method| Entry {
        label: method.clone(),
        method: method.clone(),
        tolerance: options.tolerance,
        set: Vec::new(),
    });
    let until = options.until.unwrap_or(60.0);
    compare(options, &entries.collect::<Vec<_>>(), baselines, (vertices, until), report)
}

/// Model I in a plain metric at the tolerance of the baseline; appended to `report`.
pub fn loose(
    options: &Options,
    baselines: &Baselines,
    vertices: usize,
    report: &mut String,
) -> Result<()> {
    let entry = Entry {
        label: "blocks".to_owned(),
        method: "lbfgs".to_owned(),
        tolerance: THEIR_TOLERANCE,
        set: vec![
            "equilibrium.preconditioner=\"blocks\"".to_owned(),
            "equilibrium.collapse=\"turn\"".to_owned(),
        ],
    };
    let until = options.until.unwrap_or(30.0);
    compare(options, &[entry], baselines, (vertices, until), report)
}

fn compare(
    options: &Options,
    entries: &[Entry],
    baselines: &Baselines,
    (vertices, until): (usize, f64),
    report: &mut String,
) -> Result<()> {
    let titles = [
        "solver",
        "CPU s",
        "steps",
        "CPU s a step",
        "iterations",
        "evaluations",
        "factorisations",
        "failed relaxations",
        "tolerance",
        "last residual",
        "energy",
        "share c > 0.1",
        "smallest angle °",
        "times ours, a step",
    ];
    let mut table = Table::new(&titles);
    let mut reference = None;
    for entry in entries {
        let (a_step, mut row) = ours(options, entry, baselines, (vertices, until))?;
        row.push(number(a_step / *reference.get_or_insert(a_step)));
        table.push(row);
        eprintln!("{}", table.markdown());
    }
    if !options.ours {
        let them = baselines.coupled(vertices, STEP, until)?;
        table.push(vec![
            "PETSc TAO blmvm, explicit Euler".into(),
            number(them.cpu),
            number(them.steps),
            number(them.cpu / them.steps),
            String::new(),
            number(them.evaluations),
            "0".into(),
            number(them.failed),
            format!("{THEIR_TOLERANCE:.0e}"),
            String::new(),
            format!("{:.4e}", them.energy),
            format!("{:.4}", them.share),
            String::new(),
            number(them.cpu / them.steps / reference.unwrap_or(f64::NAN)),
        ]);
    }
    *report += &format!("\n## (B) Model I to t = {until}, {vertices} vertices\n\n");
    *report += &table.markdown();
    Ok(())
}

/// The scene that `rumple run` would take; its start is replaced by the baseline's.
fn scene_text(entry: &Entry, until: f64, mesh: &str) -> String {
    let (young, poisson, thickness) = (MATERIAL.young, MATERIAL.poisson, MATERIAL.thickness);
    let Entry { method, tolerance, .. } = entry;
    format!(
        r#"[sheet]
file = "{mesh}"
imperfection = {{ amplitude = 1e-3, seed = 7 }}
bump = {{ amplitude = 0.5, width = 8.0 }}

[material]
young = {young:?}
poisson = {poisson:?}
thickness = {thickness:?}

[[effect]]
kind = "stretching"
weight = "paper"

[[effect]]
kind = "bending"
weight = "paper"
area = "barycentric"

[[effect]]
kind = "pin"
where = "rim"
axes = "z"

[kinetics]
plugin = "curvature-feedback"
location = "face"
parameters = {{ c_star = {EXPANSION_THRESHOLD:?} }}
initial.c = {{ gaussian = {{ width = 8.0, amplitude = 0.3 }} }}

[time]
policy = "quasi-static"
integrator = {{ kind = "staggered", method = "euler", step = {STEP:?} }}
until = {until:?}

[equilibrium]
method = "{method}"
tolerance = {tolerance:?}
"#
    )
}

/// CPU seconds a step (a run may stop early) and the row of our run.
fn ours(
    options: &Options,
    entry: &Entry,
    baselines: &Baselines,
    (vertices, until): (usize, f64),
) -> Result<(f64, Vec<String>)> {
    let name = format!("model-i-{vertices}-{}", entry.label);
    let mesh = options.out.join(format!("disc_{vertices}.obj"));
    let sheet = read_sheet(&baselines.mesh(vertices)?)?;
    rumple::sheet::write::obj(&sheet, &mut fs::File::create(&mesh)?)?;
    let start = read_positions(&baselines.coupled_start(vertices)?, vertices)?;
    let path = options.out.join(format!("{name}.toml"));
    fs::write(&path, scene_text(entry, until, &format!("disc_{vertices}.obj")))?;

    let scene = Scene::load(&path, &[&entry.set[..], &options.set].concat())?;
    // The bench runs from target/release/deps; the plugins are one level up.
    let executable = std::env::current_exe()?;
    let folder = executable.ancestors().nth(2).ok_or("no target directory")?.to_owned();
    let began = cpu_seconds()?;
    let mut simulation = Simulation::new(&scene, &PluginSearch::in_directories(vec![folder]))?;
    simulation.state_mut().x.copy_from_slice(&start);
    let directory = ResultDirectory::prepare(&options.out.join(&name), true)?;
    let mut progress = Progress::new(Mode::Lines, until);
    let interrupt = Interrupt::install()?;
    let done = run::run(&scene, &mut simulation, &directory, &mut progress, interrupt);
    let cpu = cpu_seconds()? - began;
    progress.finish();
    if let Err(error) = &done {
        eprintln!("  {}: {error}", entry.label);
    }
    let work = simulation.spent().work;
    let mut at = simulation.evaluate();
    let state = at.state();
    let mut gradient = vec![Vec3::zeros(); vertices];
    let energy = at.potential()?.energy_gradient(&state.x, &mut gradient);
    let residual = at.potential()?.residual(&gradient);
    let share = match at.species_at_vertices().first() {
        None => f64::NAN,
        Some(c) => real(c.iter().filter(|c| **c > EXPANSION_THRESHOLD).count()) / real(vertices),
    };
    let steps = real(usize::try_from(state.step)? + 1);
    let failed = match &done {
        Ok(_) => "0".into(),
        Err(_) => format!("stopped at t = {}", state.time),
    };
    let row = vec![
        format!("rumple, {}", entry.label),
        number(cpu),
        number(steps),
        number(cpu / steps),
        work.iterations.to_string(),
        work.evaluations().to_string(),
        work.factorisations.to_string(),
        failed,
        format!("{:.0e}", entry.tolerance),
        format!("{residual:.1e}"),
        format!("{energy:.4e}"),
        format!("{share:.4}"),
        format!("{:.1}", smallest_angle(&sheet, &state.x)),
    ];
    Ok((cpu / steps, row))
}
