//! What a run cost: counts and times of every effect, signal, law and part of the solver, as their meters have them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::process::{peak_resident, processor_time};
use super::{Error, Result, Simulation};
use crate::num::real;
use crate::output::{OutputError, ResultDirectory, atomic};
use crate::scene::Scene;
use crate::tally::{Cost, Work};

/// What a run cost, as `costs.json` has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Costs {
    /// The scene's file.
    pub scene: String,
    /// Wall time since the scene began to be set up, s.
    pub seconds: f64,
    /// Processor time of all threads of the process, s, where the system says it.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
    /// What was done to relax the start and in all steps.
    pub work: Work,
    /// Threads that computed.
    pub threads: usize,
    /// Largest resident memory of the process, bytes, where the system says it.
    pub peak_resident_bytes: Option<u64>,
    /// The parts, effects first; what no meter accounts for is the last one.
    pub parts: Vec<PartCost>,
}

/// What one part cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartCost {
    /// effect, signal, law, geometry, solver, output, preparation, ranks or elsewhere.
    pub group: String,
    /// Which of them.
    pub name: String,
    /// Wall time of the calling thread without that of parts called within, s.
    pub seconds: f64,
    /// Its share of all time.
    pub share: f64,
    /// How often what was done.
    pub counts: Vec<(String, u64)>,
}

/// Groups in the order in which they are shown.
const GROUPS: [&str; 7] =
    ["effect", "signal", "law", "geometry", "solver", "output", "preparation"];

fn part(group: &str, name: &str, seconds: f64, counts: &[(&'static str, u64)]) -> PartCost {
    let done = counts.iter().filter(|(_, count)| *count > 0);
    let counts = done.map(|(name, count)| ((*name).to_owned(), *count)).collect();
    PartCost { group: group.to_owned(), name: name.to_owned(), seconds, share: 0.0, counts }
}

impl Costs {
    /// Returns those of `simulation`, set up from `scene`, up to now.
    #[must_use]
    pub fn new(scene: &Scene, simulation: &Simulation) -> Self {
        let seconds = simulation.began.elapsed().as_secs_f64();
        let mut meters = simulation.model().tally().costs();
        meters.sort_by_key(|cost| GROUPS.iter().position(|group| cost.group == *group));
        let mut parts: Vec<PartCost> = meters
            .iter()
            .map(|Cost { group, name, counts, time }| part(group, name, time.as_secs_f64(), counts))
            .filter(|part| part.seconds > 0.0 || !part.counts.is_empty())
            .collect();
        // PETSc keeps its own account.
        if let Some(ranks) = simulation.sheet().reduction().ranks() {
            parts.push(part("ranks", "communication", 0.0, &ranks.traffic.counts()));
        }
        let known: f64 = parts.iter().map(|part| part.seconds).sum();
        let rest = (seconds - known).max(0.0);
        parts.push(part("elsewhere", "what no part accounts for", rest, &[]));
        parts.iter_mut().for_each(|part| part.share = part.seconds / seconds);
        Self {
            scene: scene.name().to_owned(),
            seconds,
            cpu_seconds: processor_time(),
            work: simulation.spent().work,
            threads: rayon::current_num_threads(),
            peak_resident_bytes: peak_resident(),
            parts,
        }
    }

    /// Writes `costs.json`.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system.
    pub fn write(&self, directory: &ResultDirectory) -> Result<()> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        Ok(atomic::replace(&directory.costs(), |writer| writeln!(writer, "{text}"))?)
    }

    /// Reads those of the run whose results are in `directory`.
    ///
    /// # Errors
    /// If there is no `costs.json`, or it is not one.
    pub fn read(directory: &Path) -> Result<Self> {
        let path = ResultDirectory::costs_in(directory);
        let text = std::fs::read_to_string(&path).map_err(|source| {
            if source.kind() == std::io::ErrorKind::NotFound {
                let what = "no costs.json: expected the directory of one run (a comparison has one for each \
                            member), and of a run that ended or was interrupted";
                return Error::Refused(format!("{}: {what}", directory.display()));
            }
            OutputError::Read { path: path.clone(), source }.into()
        })?;
        serde_json::from_str(&text).map_err(|error| {
            Error::Refused(format!("{}: is not what a run writes: {error}", path.display()))
        })
    }
}

/// A time for people.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 1e-3 => format!("{:.1} ms", 1e3 * s),
        s => format!("{:.0} µs", 1e6 * s),
    }
}

/// One table: group, part, share, time, counts.
impl std::fmt::Display for Costs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { scene, threads, work, parts, .. } = self;
        let seconds = duration(self.seconds);
        let steps = if work.steps == 1 { "step" } else { "steps" };
        writeln!(f, "{scene}: {seconds} in all, {} {steps}, threads: {threads}", work.steps)?;
        let names = parts.iter().map(|part| part.name.chars().count());
        let width = names.max().unwrap_or(0).min(200);
        for PartCost { group, name, seconds, share, counts } in parts {
            let time = duration(*seconds);
            let counts = counts.iter().map(|(name, count)| format!("  {count} × {name}"));
            let counts = counts.collect::<String>();
            writeln!(f, "{group:<11} {name:width$} {:>6.2} % {time:>8}{counts}", 100.0 * share)?;
        }
        for ((name, what), count) in Work::NAMES.iter().zip(work.values()) {
            if count > 0 {
                let name = name.replace('_', " ");
                writeln!(f, "{:<11} {name:17} {count:>12}  {what}", "work")?;
            }
        }
        if let Some(peak) = self.peak_resident_bytes {
            let megabytes = real(usize::try_from(peak / 1000).unwrap_or(usize::MAX)) / 1e3;
            writeln!(f, "memory: {megabytes:.1} MB resident at most, the program itself included")?;
        }
        writeln!(f, "times are wall times of the calling thread, each moment counted once")
    }
}
