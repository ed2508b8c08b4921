//! (A) One hard relaxation: the inner part of a flat disc grows by half, to a relative gradient.
//!
//! The baselines stop by the Euclidean norm, `|g| ≤ ε |g₀|`; our relaxations by the largest force
//! on a vertex. `max_i |g_i| ≤ ε |g₀|/√N` is enough, but more than is asked, for the last forces sit
//! on few vertices. So a first relaxation aims at `ε |g₀|/3`, and where that was not enough, further
//! ones go on from there; all of them count.

use std::path::Path;
use std::sync::Arc;

use rumple::num::real;
use rumple::sheet::Sheet;
use rumple::solve::equilibrium::Goal;

use crate::common::{Result, Table, cpu_seconds, equilibrium, number};
use crate::problem::{
    energy_and_norm, grow, mechanics, read_positions, read_sheet, smallest_angle,
};
use crate::{Baselines, Options, overdamped};

/// What all sides are asked for.
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// What the seed's descent reaches in some minutes.
const DESCENT_REACHES: f64 = 2e-3;

/// One solver's way from one start.
struct Row {
    solver: String,
    cpu: f64,
    work: [f64; 3],
    energy: f64,
    relative: f64,
    angle: f64,
}

/// Everything at one size; appended to `report`.
pub fn race(
    options: &Options,
    baselines: &Baselines,
    vertices: usize,
    report: &mut String,
) -> Result<()> {
    let titles = [
        "noise",
        "solver",
        "CPU s",
        "iterations",
        "evaluations",
        "factorisations",
        "energy",
        "relative gradient",
        "smallest angle °",
        "times ours",
    ];
    let mut table = Table::new(&titles);
    let mut checks = String::new();
    for noise in 1..=options.noises {
        let (name, start) = baselines.start(vertices, noise)?;
        let sheet = read_sheet(&baselines.mesh(vertices)?)?;
        checks += &check(baselines, &name, &sheet, &start, noise)?;
        let mut rows = Vec::new();
        for method in &options.method {
            rows.push(ours(options, method, &sheet, &start, RELATIVE_TOLERANCE)?);
        }
        if !options.ours {
            let (reached, positions) = baselines.tao(&name, "blmvm")?;
            let x = read_positions(&positions, vertices)?;
            rows.push(Row {
                solver: "PETSc TAO blmvm".into(),
                cpu: reached.cpu,
                work: [f64::NAN, reached.evaluations, 0.0],
                energy: reached.energy,
                relative: reached.relative,
                angle: smallest_angle(&sheet, &x),
            });
        }
        if let Some(tolerance) = options.overdamped {
            rows.push(slow_motion(&sheet, &start, tolerance)?);
        }
        let reference = rows[0].cpu;
        push(&mut table, noise, &rows, reference);
        if options.descent {
            let mine = ours(options, &options.method[0], &sheet, &start, DESCENT_REACHES)?;
            let reached = baselines.descent(&name, DESCENT_REACHES)?;
            let reference = mine.cpu;
            let theirs = Row {
                solver: "seed's descent, analytic gradient".into(),
                cpu: reached.cpu,
                work: [reached.evaluations, f64::NAN, 0.0],
                energy: reached.energy,
                relative: reached.relative,
                angle: f64::NAN,
            };
            push(&mut table, noise, &[mine, theirs], reference);
        }
        eprintln!("{}", table.markdown());
    }
    *report += &format!("\n## (A) Hard relaxation, {vertices} vertices\n\n{checks}\n");
    *report += &table.markdown();
    Ok(())
}

fn push(table: &mut Table, noise: u64, rows: &[Row], reference: f64) {
    for row in rows {
        let count = |n: f64| if n.is_nan() { String::new() } else { format!("{n:.0}") };
        let mut cells = vec![noise.to_string(), row.solver.clone(), number(row.cpu)];
        cells.extend(row.work.map(count));
        cells.push(format!("{:.6e}", row.energy));
        cells.push(format!("{:.1e}", row.relative));
        cells.push(if row.angle.is_nan() { String::new() } else { format!("{:.1}", row.angle) });
        cells.push(format!("{:.2}", row.cpu / reference));
        table.push(cells);
    }
}

/// Compares energy and gradient at the start, theirs and ours.
fn check(
    baselines: &Baselines,
    name: &str,
    sheet: &Arc<Sheet>,
    start: &Path,
    noise: u64,
) -> Result<String> {
    let x = read_positions(start, sheet.vertex_count())?;
    let mut mechanics = mechanics(sheet)?;
    grow(&mut mechanics);
    let (energy, norm) = energy_and_norm(&mut mechanics, &x);
    let (their_energy, their_norm) = baselines.energy_at_start(name)?;
    let difference = (energy / their_energy - 1.0).abs();
    if difference > 1e-12 {
        return Err(format!("energies differ at the start: {energy} and {their_energy}").into());
    }
    Ok(format!(
        "* noise {noise}: energy at the start {energy:.10e}, by their code {difference:.1e} away; \
         norm of the gradient {norm:.6e}, {:.1e} away\n",
        (norm / their_norm - 1.0).abs()
    ))
}

/// Our relaxation to `relative`; the time includes making the solver ready.
fn ours(
    options: &Options,
    method: &str,
    sheet: &Arc<Sheet>,
    start: &Path,
    relative: f64,
) -> Result<Row> {
    let spec = equilibrium(method, &options.set)?;
    let mut x = read_positions(start, sheet.vertex_count())?;
    let mut mechanics = mechanics(sheet)?;
    grow(&mut mechanics);
    eprintln!("  ours: {}", spec.name());
    let began = cpu_seconds()?;
    let (_, norm) = energy_and_norm(&mut mechanics, &x);
    let asked = relative * norm / mechanics.force_scale();
    let enough = asked / real(x.len()).sqrt();
    let mut solver = spec.build(mechanics.mechanics())?;
    let before = mechanics.mechanics().tally().work();
    let (mut failure, mut now) = (None, (f64::NAN, f64::NAN));
    for tolerance in [asked / 3.0, asked / 30.0, enough] {
        let max_iterations = options.iterations.unwrap_or(spec.max_iterations());
        let goal = Goal { tolerance, max_iterations, ..Goal::default() };
        let done = solver.relax(&mut mechanics, &mut x, &goal);
        now = energy_and_norm(&mut mechanics, &x);
        failure = done.err().map(|error| error.to_string());
        if now.1 <= relative * norm || failure.is_some() {
            break;
        }
    }
    let cpu = cpu_seconds()? - began;
    let work = mechanics.mechanics().tally().work() - before;
    if let Some(failure) = &failure {
        eprintln!("  {method}: {failure}");
    }
    let stopped = if failure.is_some() { " (failed)" } else { "" };
    Ok(Row {
        solver: format!("rumple, {method}{stopped}"),
        cpu,
        work: [work.iterations, work.gradients, work.factorisations]
            .map(|n| real(usize::try_from(n).unwrap_or(usize::MAX))),
        energy: now.0,
        relative: now.1 / norm,
        angle: smallest_angle(sheet, &x),
    })
}

/// The energy that the overdamped motion reaches, to compare energies with.
fn slow_motion(sheet: &Arc<Sheet>, start: &Path, tolerance: f64) -> Result<Row> {
    let mut x = read_positions(start, sheet.vertex_count())?;
    let mut mechanics = mechanics(sheet)?;
    grow(&mut mechanics);
    let (_, norm) = energy_and_norm(&mut mechanics, &x);
    let began = cpu_seconds()?;
    let done = overdamped::follow(&mut mechanics, &mut x, tolerance, RELATIVE_TOLERANCE)?;
    let cpu = cpu_seconds()? - began;
    let (energy, last) = energy_and_norm(&mut mechanics, &x);
    let stopped = match (done.collapsed, last <= RELATIVE_TOLERANCE * norm) {
        (true, _) => ": a triangle collapses",
        (false, true) => "",
        (false, false) => ": no step can be made",
    };
    Ok(Row {
        solver: format!("overdamped motion, step error {tolerance:e} edges{stopped}"),
        cpu,
        work: [done.steps, done.evaluations, done.factorisations].map(real),
        energy,
        relative: last / norm,
        angle: smallest_angle(sheet, &x),
    })
}
