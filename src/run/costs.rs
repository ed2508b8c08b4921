//! What a run cost: share of time of every effect, signal, law and part of the solver.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Error, Result, Simulation};
use crate::model::constraint_meter;
use crate::num::real;
use crate::output::{OutputError, ResultDirectory, atomic};
use crate::run::processor_time;
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
    /// The parts, effects first.
    pub parts: Vec<PartCost>,
    /// What no part accounts for.
    pub elsewhere: PartCost,
}

/// What one part cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartCost {
    /// effect, signal, law, geometry, solver, output, preparation or ranks.
    pub group: String,
    /// Which of them.
    pub name: String,
    /// Where the scene lists it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
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

impl PartCost {
    fn new(group: &str, name: &str) -> Self {
        Self {
            group: group.to_owned(),
            name: name.to_owned(),
            place: None,
            seconds: 0.0,
            share: 0.0,
            counts: Vec::new(),
        }
    }

    fn add(&mut self, cost: &Cost) {
        self.seconds += cost.time.as_secs_f64();
        let done = cost.counts.iter().filter(|(_, count)| *count > 0);
        self.counts.extend(done.map(|(name, count)| ((*name).to_owned(), *count)));
    }

    fn is_nothing(&self) -> bool {
        self.counts.is_empty() && self.seconds == 0.0
    }
}

/// Largest resident memory so far of this process, or of the one called `process`, bytes; where the
/// system says it.
#[must_use]
pub fn peak_resident(process: Option<u32>) -> Option<u64> {
    let process = process.map_or("self".to_owned(), |number| number.to_string());
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kibibytes)
}

impl Costs {
    /// Of `simulation`, set up from `scene`, up to now.
    #[must_use]
    pub fn of(scene: &Scene, simulation: &Simulation) -> Self {
        let mut costs = simulation.model().tally().costs();
        let mut parts = effects(scene, simulation, &mut costs);
        costs.retain(|cost| cost.group != "effect");
        for group in &GROUPS[1..] {
            for cost in costs.iter().filter(|cost| cost.group == *group) {
                let mut part = PartCost::new(group, &cost.name);
                part.add(cost);
                parts.push(part);
            }
        }
        parts.extend(communication(simulation));
        parts.retain(|part| part.group == "effect" || !part.is_nothing());
        let seconds = simulation.setup.began.elapsed().as_secs_f64();
        let mut elsewhere = PartCost::new("elsewhere", "what no part accounts for");
        let known: f64 = parts.iter().map(|part| part.seconds).sum();
        elsewhere.seconds = (seconds - known).max(0.0);
        for part in parts.iter_mut().chain([&mut elsewhere]) {
            part.share = if seconds > 0.0 { part.seconds / seconds } else { 0.0 };
        }
        Self {
            scene: scene.name().to_owned(),
            seconds,
            cpu_seconds: processor_time(),
            work: simulation.spent().work,
            threads: rayon::current_num_threads(),
            peak_resident_bytes: peak_resident(None),
            parts,
            elsewhere,
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

/// What this rank has communicated, where the sheet is spread over ranks; PETSc keeps its own account.
fn communication(simulation: &Simulation) -> Option<PartCost> {
    let ranks = simulation.sheet().reduction().ranks()?;
    let mut part = PartCost::new("ranks", "communication");
    part.counts = ranks.traffic.counts().map(|(name, count)| (name.to_owned(), count)).to_vec();
    Some(part)
}

/// The effects of the scene, each with its contribution.
fn effects(scene: &Scene, simulation: &Simulation, costs: &mut Vec<Cost>) -> Vec<PartCost> {
    let model = simulation.model();
    let mut energies = model.mechanics().names().map(str::to_owned);
    let transports: Option<Vec<String>> =
        model.chemistry().map(|c| c.transport_names().map(str::to_owned).collect());
    let mut transports = transports.unwrap_or_default().into_iter();
    let mut constraints = model.mechanics().constraint_names();
    let mut growth = model.growth_names();
    let mut internal = model.internal().iter().map(|term| term.name().to_owned());
    let mut all = Vec::new();
    for (number, (spec, contribution)) in
        scene.effects.iter().zip(&simulation.setup.effects).enumerate()
    {
        let mut part = PartCost::new("effect", &spec.name());
        part.place = scene.written(&format!("effect[{number}]"));
        part.seconds = contribution.took.as_secs_f64();
        let mut names: Vec<String> = energies.by_ref().take(contribution.parts.energies).collect();
        names.extend(transports.by_ref().take(contribution.parts.transports));
        let kept = constraints.by_ref().take(contribution.parts.constraints);
        names.extend(kept.map(constraint_meter));
        names.extend(growth.by_ref().take(contribution.parts.growth));
        names.extend(internal.by_ref().take(contribution.parts.internal));
        for name in names {
            if let Some(k) = costs.iter().position(|c| c.group == "effect" && c.name == name) {
                part.add(&costs.remove(k));
            }
        }
        all.push(part);
    }
    all
}

/// A time for people.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 1e-3 => format!("{:.1} ms", 1e3 * s),
        s => format!("{:.0} µs", 1e6 * s),
    }
}

impl PartCost {
    /// Name, share, time, counts and place, the name padded to `width`.
    fn line(&self, width: usize) -> String {
        let (share, time) = (100.0 * self.share, duration(self.seconds));
        let mut line = format!("  {:width$}  {share:>6.2} %  {time:>8}", self.name);
        let counts: Vec<String> =
            self.counts.iter().map(|(name, count)| format!("{count} × {name}")).collect();
        if !counts.is_empty() {
            line += &format!("  {}", counts.join(", "));
        }
        if let Some(place) = &self.place {
            line += &format!("  ({place})");
        }
        line.trim_end().to_owned()
    }
}

impl std::fmt::Display for Costs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let threads = if self.threads == 1 { "thread" } else { "threads" };
        let steps = if self.work.steps == 1 { "step" } else { "steps" };
        writeln!(
            f,
            "{}: {} in all, {} {steps}, {} {threads}",
            self.scene,
            duration(self.seconds),
            self.work.steps,
            self.threads
        )?;
        let all = self.parts.iter().chain([&self.elsewhere]);
        let width = all.clone().map(|part| part.name.chars().count()).max().unwrap_or(0).min(200);
        let mut group = "";
        for part in all {
            if part.group != group {
                group = &part.group;
                writeln!(f, "{group}")?;
            }
            writeln!(f, "{}", part.line(width))?;
        }
        writeln!(f, "work")?;
        let done = Work::NAMES.iter().zip(self.work.values()).filter(|(_, count)| *count > 0);
        for ((name, what), count) in done {
            writeln!(f, "  {:17}  {count:>12}  {what}", name.replace('_', " "))?;
        }
        if let Some(peak) = self.peak_resident_bytes {
            let megabytes = real(usize::try_from(peak / 1000).unwrap_or(usize::MAX)) / 1e3;
            writeln!(f, "memory: {megabytes:.1} MB resident at most, the program itself included")?;
        }
        writeln!(f, "times are wall times of the calling thread, each moment counted once")
    }
}
