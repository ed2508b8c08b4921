//! Whole runs of the program on one thread and on two, in turn.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::Options;
use crate::common::{Result, Table, number};

/// Scenes and the overrides that make them short.
const RUNS: [(&str, &str, &[&str]); 6] = [
    ("quasi-static, 20 000 vertices", "models/model-i/spots.toml", &["time.until=0.5"]),
    (
        "quasi-static, 5 000 vertices",
        "models/model-i/spots.toml",
        &["sheet.vertices=5000", "time.until=0.5"],
    ),
    (
        "quasi-static, multigrid, 20 000 vertices",
        "models/model-i/spots.toml",
        &["time.until=0.1", "equilibrium.preconditioner=\"multigrid\""],
    ),
    (
        "simultaneous, BDF, 5 000 vertices",
        "models/policies/bump.toml",
        &["time.until=0.05", "time.integrator={kind=\"monolithic\",rtol=1e-4,atol=1e-4}"],
    ),
    (
        "simultaneous, BDF, 20 000 vertices",
        "models/policies/bump.toml",
        &[
            "sheet.vertices=20000",
            "time.until=0.02",
            "time.integrator={kind=\"monolithic\",rtol=1e-4,atol=1e-4}",
        ],
    ),
    ("chemistry alone, 20 000 vertices", "models/kinetics/schnakenberg-sphere.toml", &[]),
];

/// Titles of the columns.
const TITLES: [&str; 7] = [
    "run",
    "1 thread, wall s",
    "2 threads, wall s",
    "times as fast",
    "1 thread, CPU s",
    "2 threads, CPU s",
    "same bits",
];

/// Runs everything `options.runs` times on each number of threads; medians.
pub fn table(options: &Options) -> Result<Table> {
    let mut table = Table::new(&TITLES);
    for (name, scene, set) in RUNS {
        if options.only.as_ref().is_some_and(|only| !name.contains(only.as_str())) {
            continue;
        }
        let mut walls = [Vec::new(), Vec::new()];
        let mut cpus = [Vec::new(), Vec::new()];
        let mut ratios = Vec::new();
        let mut same = true;
        for _ in 0..options.runs {
            let folders = [1usize, 2].map(|threads| format!("target/race/threads-{threads}"));
            for (k, folder) in folders.iter().enumerate() {
                let (wall, cpu) = run(scene, set, k + 1, folder)?;
                eprintln!("{name}, {} thread(s): {wall:.2} s, {cpu:.2} CPU s", k + 1);
                walls[k].push(wall);
                cpus[k].push(cpu);
            }
            ratios.push(walls[0][walls[0].len() - 1] / walls[1][walls[1].len() - 1]);
            same &= frames(&folders[0])? == frames(&folders[1])?;
        }
        let mut row = vec![name.to_owned()];
        row.extend(walls.iter_mut().chain([&mut ratios]).chain(&mut cpus).map(|v| median(v)));
        row.push(if same { "yes" } else { "NO" }.to_owned());
        table.push(row);
    }
    Ok(table)
}

fn median(values: &mut [f64]) -> String {
    values.sort_by(f64::total_cmp);
    number(values[values.len() / 2])
}

/// Wall and CPU seconds of one run.
fn run(scene: &str, set: &[&str], threads: usize, folder: &str) -> Result<(f64, f64)> {
    let deps = std::env::current_exe()?;
    let program = deps.ancestors().nth(2).ok_or("no target folder")?.join("rumple");
    let (began, cpu) = (Instant::now(), children()?);
    let status = Command::new(&program)
        .args(["run", scene, "--quiet", "--force", "--threads", &threads.to_string()])
        .args(set.iter().flat_map(|key| ["--set", key]))
        .args(["--out", folder])
        .stdout(Stdio::null())
        .status()
        .map_err(|error| format!("{}: {error}; cargo build --release", program.display()))?;
    let wall = began.elapsed().as_secs_f64();
    if !status.success() {
        return Err(format!("{scene}: {status}").into());
    }
    Ok((wall, children()? - cpu))
}

/// CPU seconds of all children that have ended; the kernel counts hundredths.
fn children() -> Result<f64> {
    let text = fs::read_to_string("/proc/self/stat")?;
    let after = text.rsplit(')').next().ok_or("an empty stat")?;
    let ticks: Vec<f64> = after
        .split_whitespace()
        .skip(13)
        .take(2)
        .map(str::parse)
        .collect::<std::result::Result<_, _>>()?;
    Ok(ticks.iter().sum::<f64>() / 100.0)
}

/// What the frames of a run say, file by file.
fn frames(folder: &str) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let mut all = Vec::new();
    for file in fs::read_dir(Path::new(folder).join("frames"))? {
        let path = file?.path();
        let name = path.file_name().map(PathBuf::from).unwrap_or_default();
        all.push((name, fs::read(path)?));
    }
    all.sort();
    Ok(all)
}
