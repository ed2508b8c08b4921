//! Processor time of the steps of a member, excluding setup and output.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::kinetics::PluginSearch;
use crate::output::ResultDirectory;
use crate::run::run::Summary;
use crate::run::schedule::OutputSchedule;
use crate::run::{Result, Simulation};
use crate::scene::Scene;
use crate::study::{read_document, write_document};

/// Processor times of a member, s: of one thread the wall time, but for what others do on the machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Of the first relaxation.
    pub start: f64,
    /// Of all steps, as often as they were made.
    pub steps: Vec<f64>,
}

/// Steps that take longer than this are made once, s.
const LONG_RUN: f64 = 3.0;

impl Timing {
    /// Returns the times of the run of `scene` with `summary`, and of `repeats` - 1 more where that was short.
    ///
    /// # Errors
    /// Whatever ends a run.
    pub fn of(
        scene: &Scene,
        search: &PluginSearch,
        summary: &Summary,
        repeats: u16,
    ) -> Result<Self> {
        let Summary { spent, start, .. } = *summary;
        let first = (spent - start).cpu_seconds;
        let mut timing = Self { start: start.cpu_seconds, steps: vec![first] };
        if first < LONG_RUN {
            for _ in 1..repeats {
                timing.steps.push(again(scene, search, summary.time)?);
            }
        }
        Ok(timing)
    }

    /// The median of the steps.
    #[must_use]
    pub fn median(&self) -> f64 {
        let mut all = self.steps.clone();
        all.sort_by(f64::total_cmp);
        match all.len() {
            0 => f64::NAN,
            n => 0.5 * (all[n / 2] + all[(n - 1) / 2]),
        }
    }

    /// The least and the most that the steps took.
    #[must_use]
    pub fn spread(&self) -> (f64, f64) {
        let all = self.steps.iter();
        all.fold((f64::INFINITY, 0.0), |(least, most), s| (s.min(least), s.max(most)))
    }

    /// Writes it into the directory of the run.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, directory: &ResultDirectory) -> Result<()> {
        write_document(&directory.root().join(ResultDirectory::TIMING), self)
    }

    /// Reads that of the run in `directory`, if there is one.
    #[must_use]
    pub fn read(directory: &Path) -> Option<Self> {
        read_document(&directory.join(ResultDirectory::TIMING), "sweep").ok()?
    }
}

/// Processor time of the steps of `scene` to the time `end`, s.
fn again(scene: &Scene, search: &PluginSearch, end: f64) -> Result<f64> {
    let mut simulation = Simulation::new(scene, search)?;
    simulation.prepare()?;
    let start = simulation.spent();
    let mut schedule = OutputSchedule::of(scene);
    while simulation.state().time < end {
        schedule.pass(simulation.state().time);
        simulation.step(schedule.target().min(end))?;
    }
    Ok((simulation.spent() - start).cpu_seconds)
}
