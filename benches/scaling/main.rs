//! How time and memory grow with the sheet, from 1 000 to 1 000 000 vertices.
//!
//! The load: a disc of radius 100 and thickness 2, its boundary fixed vertically, whose middle grows
//! smoothly, Φ = 1 + 0.05 exp(-r²/(2·20²)), from a dome of height 1/2 (default weights). The sheet
//! and its deformation are the same at every size, so only the mesh gets finer.
//!
//! Every size runs in a process of its own, so that the peak of its memory is its own. Meshes come
//! from the generator, or with `--lattice` from a hexagon of equilateral triangles.
//!
//! `cargo bench --bench scaling -- --largest 1000000`
//!
//! With `--runs N` whole runs of the program instead, each N times on one thread and on two, in turn:
//!
//! `cargo build --release && cargo bench --bench scaling -- --runs 3`

#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;

mod measure;
mod runs;

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

use clap::Parser;

use common::{Result, Table, gibibytes, number};

/// Numbers of vertices of the table.
const SIZES: [usize; 7] = [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000];

/// Measures how time and memory grow with the sheet.
#[derive(Debug, Parser)]
struct Options {
    /// Largest number of vertices.
    #[arg(long, default_value_t = 100_000)]
    largest: usize,
    /// These numbers of vertices instead.
    #[arg(long, value_delimiter = ',')]
    sizes: Vec<usize>,
    /// Method of equilibrium, with the scene's defaults.
    #[arg(long, default_value = "lbfgs")]
    method: String,
    /// Method where a factor does not fit into memory; without one such sheets are not relaxed.
    #[arg(long)]
    large_method: Option<String>,
    /// Override, as in scenes: equilibrium.refresh=15.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Threads.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// A regular mesh instead of a generated one.
    #[arg(long)]
    lattice: bool,
    /// Whole runs instead, so many times on one thread and on two.
    #[arg(long, default_value_t = 0)]
    runs: usize,
    /// Only the runs whose name contains this.
    #[arg(long)]
    only: Option<String>,
    /// Where the report goes.
    #[arg(long, value_name = "FILE", default_value = "target/race/scaling.md")]
    out: PathBuf,
    /// Measure one size and print its row: what the parent starts.
    #[arg(long, hide = true)]
    child: Option<usize>,
    /// Given by cargo.
    #[arg(long = "bench", hide = true)]
    from_cargo: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match options.child {
        Some(vertices) => child(&options, vertices),
        None => parent(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("scaling: {error}");
            ExitCode::FAILURE
        }
    }
}

fn child(options: &Options, vertices: usize) -> Result<()> {
    let row = common::on_threads(options.threads, || measure::row(options, vertices))?;
    println!("{}", row.join("\t"));
    Ok(())
}

fn parent(options: &Options) -> Result<()> {
    if options.runs > 0 {
        let table = runs::table(options)?;
        let title = format!("# One thread and two\n\n{}", common::machine());
        return write(options, &format!("{title}\n{}", table.markdown()));
    }
    let sizes: Vec<usize> = if options.sizes.is_empty() {
        SIZES.into_iter().filter(|n| *n <= options.largest).collect()
    } else {
        options.sizes.clone()
    };
    let mut table = Table::new(&measure::TITLES);
    for vertices in sizes {
        eprintln!(
            "{vertices} vertices, {:.1} GiB of memory free",
            gibibytes("/proc/meminfo", "MemAvailable:")?
        );
        let arguments = std::env::args().skip(1).filter(|a| a != "--bench");
        let child = Command::new(std::env::current_exe()?)
            .args(arguments)
            .args(["--child", &vertices.to_string()])
            .stderr(Stdio::inherit())
            .output()?;
        let text = String::from_utf8_lossy(&child.stdout).into_owned();
        let row = match text.trim_end() {
            "" => vec![vertices.to_string(), format!("ended by {}", child.status)],
            row => row.split('\t').map(str::to_owned).collect(),
        };
        eprintln!("  {}", row.join(" | "));
        table.push(row);
    }
    let mut report = format!("# Scaling\n\n{}", common::machine());
    let (threads, method) = (options.threads, &options.method);
    let mesh = if options.lattice { "regular lattices" } else { "generated meshes" };
    writeln!(report, "* {threads} thread(s), {mesh}, method \"{method}\"; times in CPU seconds\n")?;
    report += &table.markdown();
    write(options, &report)
}

fn write(options: &Options, report: &str) -> Result<()> {
    if let Some(folder) = options.out.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(&options.out, report)?;
    println!("{report}\nwritten to {}", options.out.display());
    Ok(())
}

/// Seconds, milliseconds or microseconds, whichever reads best.
fn seconds(value: f64) -> String {
    if value >= 1.0 {
        format!("{} s", number(value))
    } else if value >= 1e-3 {
        format!("{} ms", number(1e3 * value))
    } else {
        format!("{} µs", number(1e6 * value))
    }
}
