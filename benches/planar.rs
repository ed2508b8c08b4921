//! Planar and frozen scenes beside their twins in space: time and memory of both, and their ratios.
//!
//! The load is Model II on a disc of radius 100: a spot of motors in the middle contracts it. The twin of
//! the planar scene is the same scene without `sheet.planar` and with z pinned everywhere; that of the
//! frozen scene, which has no mechanics, is the same with stretching and everything pinned. Every member
//! runs in a process of its own, so that the peak of its memory is its own.
//!
//! `cargo build --release && cargo bench --bench planar -- --vertices 20000`

#![allow(missing_docs)]

#[path = "common/mod.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod common;

use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;

use clap::Parser;
use rumple::effects::HessianPart;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::{Simulation, Vec3};
use rumple_numerics::linear::{BlockCholesky, BlockMatrix};

use common::{Result, Table, cpu_seconds, gibibytes, number};

/// Compares planar and frozen scenes with their twins.
#[derive(Debug, Parser)]
struct Options {
    /// Number of vertices.
    #[arg(long, default_value_t = 20_000)]
    vertices: usize,
    /// Time until which every member runs.
    #[arg(long, default_value_t = 0.2)]
    until: f64,
    /// These cases alone.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Run one member and print its numbers: what the parent starts.
    #[arg(long, hide = true, num_args = 2)]
    child: Option<Vec<String>>,
    /// Given by cargo.
    #[arg(long = "bench", hide = true)]
    from_cargo: bool,
}

/// Name, and what it overrides.
const CASES: [(&str, &str, &str); 4] = [
    ("factor", "quasi-static", "equilibrium.preconditioner=\"factor\""),
    ("multigrid", "quasi-static", "equilibrium.preconditioner=\"multigrid\""),
    ("monolithic", "simultaneous", "time.integrator={kind=\"monolithic\"}"),
    ("frozen", "quasi-static", "time.integrator={kind=\"staggered\"}"),
];

/// What a child prints, in this order.
const QUANTITIES: [&str; 9] = [
    "energy and gradient, ms",
    "Hessian, ms",
    "factorisation, ms",
    "solve, ms",
    "Hessian, MiB",
    "factor, MiB",
    "run, CPU s",
    "peak memory, MiB",
    "steps",
];

/// Time over which something short is repeated.
const LONG_ENOUGH: f64 = 0.5;

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match &options.child {
        Some(member) => common::on_threads(1, || child(&options, &member[0], member[1] == "small")),
        None => parent(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("planar: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The scene of one member; the small one is planar or frozen.
fn scene(options: &Options, case: &str, small: bool) -> Result<Scene> {
    let (planar, mechanics) = match (case, small) {
        ("frozen", true) => ("", ""),
        ("frozen", false) => {
            ("", "{ kind = 'stretching' }, { kind = 'pin', where = 'all', axes = 'xyz' },")
        }
        (_, true) => (", planar = true", "{ kind = 'stretching' },"),
        (_, false) => ("", "{ kind = 'stretching' }, { kind = 'pin', where = 'all', axes = 'z' },"),
    };
    let (_, policy, set) = CASES.iter().find(|c| c.0 == case).ok_or("no such case")?;
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 100.0, vertices = {}{planar} }}\n\
         material = {{ young = 1e6, poisson = 0.3333333333333333, thickness = 0.5, drag = 100.0 }}\n\
         effect = [ {mechanics} {{ kind = 'diffusion', species = 'm', coefficient = 1.0 }} ]\n\
         time = {{ until = {:?}, policy = '{policy}' }}\nequilibrium = {{ method = 'lbfgs' }}\n\
         [kinetics]\ntension = 'paper'\nlength_factor = '1 - 0.2*m'\n\
         rates.m = '0.2*(1 - m) - 10*exp(-1e-4*pos(tension))*m'\n\
         initial.m = {{ gaussian = {{ width = 20.0, amplitude = 1.0 }} }}\n",
        options.vertices, options.until
    );
    Ok(Scene::parse(&text, case, &[(*set).to_owned()]).map_err(|e| e.rendered(false))?)
}

fn child(options: &Options, case: &str, small: bool) -> Result<()> {
    let scene = scene(options, case, small)?;
    let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[]))?;
    let start = cpu_seconds()?;
    simulation.prepare()?;
    while simulation.state().time < options.until {
        simulation.step(options.until)?;
    }
    let run = cpu_seconds()? - start;
    let peak = 1024.0 * gibibytes("/proc/self/status", "VmHWM:")?;
    let kernels = if case == "frozen" { [f64::NAN; 6] } else { kernels(&mut simulation)? };
    let steps = rumple::num::real(usize::try_from(simulation.state().step)?);
    let energy: f64 = simulation.energies()?.iter().map(|e| e.1).sum();
    let amount: f64 = simulation.state().species[0].iter().sum();
    for value in kernels.into_iter().chain([run, peak, steps, energy, amount]) {
        println!("{value:e}");
    }
    Ok(())
}

/// The pieces of a relaxation, at the last shape.
fn kernels(simulation: &mut Simulation) -> Result<[f64; 6]> {
    let x: Vec<Vec3> = simulation.state().x.to_vec();
    let mut at = simulation.evaluate();
    let potential = at.potential()?;
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let evaluation = repeated(|| {
        potential.energy_gradient(&x, &mut gradient);
    })?;
    let mut hessian = BlockMatrix::zeros(potential.pattern(&x));
    let assembly = repeated(|| {
        let _ = potential.hessian(&x, HessianPart::Positive, &mut hessian);
    })?;
    hessian.add_diagonal(1e-6 * hessian.mean_diagonal());
    let mut cholesky = <BlockCholesky>::new(Arc::clone(hessian.pattern()))?;
    let mut positive = true;
    let factorisation = repeated(|| positive &= cholesky.factorise(&hessian).is_ok())?;
    if !positive {
        return Err("the positive part of the Hessian is not positive".into());
    }
    gradient.iter_mut().zip(&x).for_each(|(g, x)| *g = Vec3::new(x.x, x.y, 0.0));
    let mut solution = gradient.clone();
    let solve = repeated(|| {
        solution.copy_from_slice(&gradient);
        cholesky.solve(&mut solution);
    })?;
    let mebibytes = |bytes: usize| rumple::num::real(bytes) / f64::from(1 << 20);
    let ms = [evaluation, assembly, factorisation, solve].map(|s| 1e3 * s);
    let sizes = [mebibytes(hessian.bytes()), mebibytes(8 * cholesky.factor_size())];
    Ok([ms[0], ms[1], ms[2], ms[3], sizes[0], sizes[1]])
}

/// CPU seconds of one call.
fn repeated(mut work: impl FnMut()) -> Result<f64> {
    work();
    let start = cpu_seconds()?;
    let mut calls = 0.0;
    loop {
        work();
        calls += 1.0;
        let elapsed = cpu_seconds()? - start;
        if elapsed > LONG_ENOUGH {
            return Ok(elapsed / calls);
        }
    }
}

fn parent(options: &Options) -> Result<()> {
    println!("# Planar and frozen scenes beside their twins\n\n{}", common::machine());
    println!("* {} vertices, to t = {}, one thread", options.vertices, options.until);
    for (case, policy, set) in CASES {
        if !options.only.is_empty() && !options.only.iter().any(|only| only == case) {
            continue;
        }
        let member = |kind: &str| -> Result<Vec<f64>> {
            let arguments = std::env::args().skip(1).filter(|a| a != "--bench");
            let child = Command::new(std::env::current_exe()?)
                .args(arguments)
                .args(["--child", case, kind])
                .stderr(Stdio::inherit())
                .output()?;
            let text = String::from_utf8_lossy(&child.stdout).into_owned();
            let values: std::result::Result<Vec<f64>, _> = text.lines().map(str::parse).collect();
            let values = values?;
            if values.len() == QUANTITIES.len() + 2 {
                Ok(values)
            } else {
                Err(format!("{case}, {kind}: ended by {}", child.status).into())
            }
        };
        let (small, twin) = (member("small")?, member("twin")?);
        let name = if case == "frozen" { "frozen" } else { "planar" };
        println!("\n## {case}: {policy}, {set}\n");
        let mut table = Table::new(&["", name, "twin", "ratio"]);
        for (k, what) in QUANTITIES.iter().enumerate().filter(|(k, _)| small[*k].is_finite()) {
            let ratio = format!("{:.2}", small[k] / twin[k]);
            table.push(vec![(*what).to_owned(), number(small[k]), number(twin[k]), ratio]);
        }
        println!("{}", table.markdown());
        let apart = |k: usize| (small[k] / twin[k] - 1.0).abs();
        let last = QUANTITIES.len();
        if case != "frozen" {
            println!("relative difference of the energies at the end: {:.1e}", apart(last));
        }
        println!("relative difference of the sums of the species: {:.1e}", apart(last + 1));
    }
    Ok(())
}
