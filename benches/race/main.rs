//! The race: the solver against the baselines of a folder, on the same sheets and the same energy,
//! in one run, in CPU seconds of one core.
//!
//! `benches/race.sh --bench DIR` installs and builds what is needed and calls this;
//! `docs/notebook/performance.md` says more.

#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

mod baselines;
mod coupled;
mod hard;
mod overdamped;
mod problem;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};

use baselines::Baselines;
use common::Result;

/// Races the solver against the baselines of a folder.
#[derive(Debug, Parser)]
struct Options {
    /// Folder of the baselines (with A, seed and mesh in it).
    #[arg(long, value_name = "DIR")]
    baselines: Option<PathBuf>,
    /// Python with petsc4py, NumPy and SciPy.
    #[arg(long, default_value = "/usr/bin/python3")]
    python: String,
    /// Numbers of vertices.
    #[arg(long, value_delimiter = ',', default_value = "20000")]
    sizes: Vec<usize>,
    /// One of the races; `loose` is run where it is asked for.
    #[arg(long, value_enum, ignore_case = true)]
    only: Option<Part>,
    /// Method of equilibrium by its name in scenes, with the scene's defaults; may be repeated.
    #[arg(long, default_value = "lbfgs")]
    method: Vec<String>,
    /// Override, as in scenes: equilibrium.refresh=15.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// (A) Most iterations of a relaxation; by default the method's.
    #[arg(long)]
    iterations: Option<usize>,
    /// (A) How many random starts.
    #[arg(long, default_value_t = 3)]
    noises: u64,
    /// (A) Also the seed's descent to a relative gradient of 2e-3 (a quarter of an hour at 20 000).
    #[arg(long)]
    descent: bool,
    /// (A) Also the overdamped motion, with this error a step in edge lengths (1e-2; slow).
    #[arg(long, value_name = "ERROR")]
    overdamped: Option<f64>,
    /// (B), loose: end time; without it 60 and 30.
    #[arg(long)]
    until: Option<f64>,
    /// (B) Our force tolerance; the baseline's is 5e-3.
    #[arg(long, default_value_t = 5e-4)]
    tolerance: f64,
    /// Only our side.
    #[arg(long)]
    ours: bool,
    /// Where meshes, runs and the report go.
    #[arg(long, value_name = "DIR", default_value = "target/race")]
    out: PathBuf,
    /// Given by cargo.
    #[arg(long = "bench", hide = true)]
    from_cargo: bool,
}

/// The races.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// One hard relaxation.
    A,
    /// Model I.
    B,
    /// Model I at the loose tolerance of the baseline, in plain metrics as it has them.
    Loose,
}

fn main() -> ExitCode {
    let options = Options::parse();
    match common::on_threads(1, || run(options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("race: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(mut options: Options) -> Result<()> {
    let Some(source) = &options.baselines else {
        println!("race: no baselines are given (benches/race.sh --bench DIR); nothing to do");
        return Ok(());
    };
    fs::create_dir_all(&options.out)?;
    options.out = fs::canonicalize(&options.out)?;
    let scratch = options.out.join("baselines");
    let baselines = Baselines::prepare(source, &scratch, options.python.clone())?;
    let mut report = format!("# Race\n\n{}{}", common::machine(), baselines.versions());
    report += "* CPU seconds of one core, both sides in this run\n";
    for &vertices in &options.sizes {
        if matches!(options.only, None | Some(Part::A)) {
            hard::race(&options, &baselines, vertices, &mut report)?;
        }
        if matches!(options.only, None | Some(Part::B)) {
            coupled::race(&options, &baselines, vertices, &mut report)?;
        }
        if options.only == Some(Part::Loose) {
            coupled::loose(&options, &baselines, vertices, &mut report)?;
        }
    }
    let file = options.out.join("race.md");
    fs::write(&file, &report)?;
    println!("{report}\nwritten to {}", file.display());
    Ok(())
}
