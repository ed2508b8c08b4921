//! Relaxations of all kinds, raced by all methods: what the default is measured by.
//!
//! `list.toml` has the scenes. Each relaxes once, or at several times in turn, or while chemistry makes some
//! steps; each method in a process of its own with a limit of time, so that what hangs or crashes is a row too.
//! Results are kept in `target/relaxations/results.tsv` by scene and method: what is not run again stays in the
//! table.
//!
//! `cargo build --release && cargo bench --bench relaxations -- [--only NAME] [--methods default,newton]`

#![allow(missing_docs)]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod common;
#[path = "../../examples/indenter/src/main.rs"]
#[allow(dead_code, reason = "its effect alone is used")]
mod indenter;
mod list;
mod report;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Mutex;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Parser;
use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::sheet::quality::triangle_angles;
use rumple::solve::Control;

use common::{Result, cpu_seconds};
use list::Entry;
use report::{Outcome, Results};

/// Name and overrides; the first is what a scene without `[equilibrium]` gets.
pub const METHODS: [(&str, &str); 4] = [
    ("default", ""),
    ("multigrid", "equilibrium.preconditioner=\"multigrid\""),
    ("newton", "equilibrium.method=\"newton\""),
    ("descent", "equilibrium.method=\"descent\""),
];

/// Races all methods over the list of relaxations.
#[derive(Debug, Parser)]
struct Options {
    /// Run these methods only.
    #[arg(long, value_delimiter = ',')]
    methods: Vec<String>,
    /// Run those relaxations only whose names contain one of these.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Run what has no result yet, and nothing else.
    #[arg(long)]
    missing: bool,
    /// Run nothing: write the tables from the results there are.
    #[arg(long)]
    none: bool,
    /// CPU seconds that a relaxation may take.
    #[arg(long, default_value_t = 60.0)]
    limit: f64,
    /// The same in units of what the default took, where it succeeded; at least a second.
    #[arg(long, default_value_t = 10.0)]
    times: f64,
    /// Override for all scenes and methods, as in scenes: equilibrium.largest_move=0.2.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Where results and tables go.
    #[arg(long, value_name = "DIR", default_value = "target/relaxations")]
    out: PathBuf,
    /// Run one relaxation by one method: what the parent starts.
    #[arg(long, hide = true, num_args = 2)]
    child: Option<Vec<String>>,
    /// Given by cargo.
    #[arg(long = "bench", hide = true)]
    from_cargo: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match &options.child {
        Some(member) => common::on_threads(1, || child(&options, &member[0], &member[1])),
        None => parent(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("relaxations: {error}");
            ExitCode::FAILURE
        }
    }
}

fn child(options: &Options, name: &str, method: &str) -> Result<()> {
    let entries = list::read(&options.out)?;
    let entry = entries.into_iter().find(|e| e.name == name).ok_or("no such relaxation")?;
    let (_, set) = METHODS.iter().find(|m| m.0 == method).ok_or("no such method")?;
    let mut keys = options.set.clone();
    keys.extend((!set.is_empty()).then(|| (*set).to_owned()));
    let scene = entry.scene(&keys)?;
    let release = Path::new("target/release").to_owned();
    let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[release]))?;
    let tolerance = simulation.force_tolerance();
    let before = cpu_seconds()?;
    simulation.set_control(limited(before + options.limit));
    let ended = run(&entry, &mut simulation);
    let seconds = cpu_seconds()? - before;
    let work = simulation.model().tally().work();
    let energy = simulation.energies().map_or(f64::NAN, |all| all.iter().map(|e| e.1).sum());
    let x = &simulation.state().x;
    let corners = simulation.sheet().triangles().iter().map(|t| t.map(|v| x[v as usize]));
    let angle = corners.flat_map(triangle_angles).fold(f64::INFINITY, f64::min).to_degrees();
    let failure = ended.err().map(|error| error.to_string());
    let outcome = Outcome {
        vertices: x.len(),
        tolerance,
        seconds,
        iterations: work.iterations,
        factorisations: work.factorisations,
        energy,
        angle,
        failure: failure.map(|text| match text.as_str() {
            "interrupted" => format!("more than {:.0} s", options.limit),
            _ => text,
        }),
    };
    println!("{outcome}");
    Ok(())
}

/// Interrupts after so many CPU seconds of this process.
fn limited(limit: f64) -> Control {
    // Reading the clock of the process costs more than a small evaluation.
    let next = Mutex::new(Instant::now());
    let over = move || {
        let Ok(mut next) = next.lock() else { return true };
        if Instant::now() < *next {
            return false;
        }
        *next = Instant::now() + Duration::from_millis(20);
        !cpu_seconds().is_ok_and(|now| now < limit)
    };
    Control::new(over, |_| ())
}

/// What the entry asks for.
fn run(entry: &Entry, simulation: &mut Simulation) -> Result<()> {
    if let Some(until) = entry.steps_until {
        simulation.prepare()?;
        while simulation.state().time < until {
            simulation.step(until)?;
        }
        return Ok(());
    }
    for time in &entry.at {
        simulation.state_mut().time = *time;
        simulation.relax()?;
    }
    Ok(())
}

fn parent(options: &Options) -> Result<()> {
    fs::create_dir_all(&options.out)?;
    let entries = list::read(&options.out)?;
    let mut results = Results::load(&options.out)?;
    let asked = |all: &[String], name: &str| all.is_empty() || all.iter().any(|a| name.contains(a));
    for entry in entries.iter().filter(|e| !options.none && asked(&options.only, &e.name)) {
        for (method, _) in METHODS {
            if !options.methods.is_empty() && !options.methods.iter().any(|m| m == method) {
                continue;
            }
            if options.missing && results.get(&entry.name, method).is_some() {
                continue;
            }
            let own = results.get(&entry.name, METHODS[0].0).filter(|o| o.failure.is_none());
            let own = own
                .filter(|_| method != METHODS[0].0)
                .map(|o| (options.times * o.seconds).max(1.0));
            let limit = own.unwrap_or(options.limit).min(options.limit);
            let outcome = start(options, entry, method, limit)?;
            eprintln!("{}, {method}: {}", entry.name, outcome.words());
            results.put(&entry.name, method, outcome);
            results.save(&options.out)?;
        }
    }
    let text = format!("# Relaxations\n\n{}\n{}", common::machine(), results.tables(&entries));
    fs::write(options.out.join("relaxations.md"), &text)?;
    println!("{text}\nwritten to {}", options.out.join("relaxations.md").display());
    Ok(())
}

/// One relaxation by one method in a process of its own.
fn start(options: &Options, entry: &Entry, method: &str, limit: f64) -> Result<Outcome> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["--child", &entry.name, method, "--limit", &limit.to_string(), "--out"]);
    command.arg(&options.out);
    for set in &options.set {
        command.args(["--set", set]);
    }
    let file = options.out.join(format!("child-{}.txt", std::process::id()));
    let output = fs::File::create(&file)?;
    let mut child = command.stdout(output).stderr(Stdio::piped()).spawn()?;
    let begun = Instant::now();
    let latest = Duration::from_secs_f64(10.0 * limit + 60.0);
    let ended = loop {
        if let Some(status) = child.try_wait()? {
            break status.to_string();
        }
        if begun.elapsed() > latest {
            child.kill()?;
            child.wait()?;
            break "does not end".to_owned();
        }
        sleep(Duration::from_millis(5));
    };
    let mut words = String::new();
    if let Some(mut errors) = child.stderr.take() {
        std::io::Read::read_to_string(&mut errors, &mut words)?;
    }
    let printed = fs::read_to_string(&file)?;
    fs::remove_file(&file)?;
    Ok(Outcome::parse(&printed).unwrap_or_else(|| {
        let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
        Outcome::broken(format!("{words} ({ended})"))
    }))
}
