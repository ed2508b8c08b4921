//! One scene under several policies and integrators, from the same start.
//!
//! Every member is a run in this process, with frames and ledger. At the output times all have in common they
//! are measured: before shapes diverge at a bifurcation by the distance of their fields, after it by what
//! does not depend on which of equal branches was taken (energy, number of regions, separation, amplitude).

mod begin;
mod plots;
mod table;
mod timescales;

pub use begin::{Comparison, Planned, Reports, TABLE};
pub use plots::figure;
use table::{csv, table};
pub use timescales::Timescales;

use std::sync::Arc;

use super::gather::{DIVERGED, Distance, Measures, Norm, first_beyond, measure};
use crate::kinetics::PluginSearch;
use crate::model::{Evaluation, State};
use crate::output::{Interrupt, OutputError, Progress, ResultDirectory};
use crate::run::run::{self, Ending, Summary};
use crate::run::{Error, Observer, Result, Simulation, StepInfo};
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::SolveError;
use crate::tally::Work;

/// One member of a comparison.
pub struct Member {
    /// `policy, integrator`.
    pub name: String,
    /// Its results, or the error that ended it.
    pub outcome: Result<MemberRun>,
}

/// A member that ran.
pub struct MemberRun {
    /// Work and times.
    pub summary: Summary,
    /// States at the output times.
    pub states: Vec<State>,
    /// Measures at the output times.
    pub measures: Vec<Measures>,
    /// Names of the species.
    pub species: Vec<String>,
    /// Norm of its fields.
    pub norm: Norm,
    /// The first species of every state at the vertices, if there are species.
    pub shown: Vec<Vec<f64>>,
    /// The sheet.
    pub sheet: Arc<Sheet>,
}

/// Distance of one run from another over the output times they have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// At every time.
    pub course: Vec<Distance>,
    /// Largest distances before the runs diverge: of shapes, of species; none if they begin apart.
    pub largest: Option<(f64, f64)>,
    /// The first distance beyond [`DIVERGED`].
    pub diverged: Option<Distance>,
}

impl MemberRun {
    /// Distance of this run from `reference`.
    #[must_use]
    pub fn deviations(&self, reference: &Self) -> Deviations {
        let course = self.norm.course(&self.states, &reference.states);
        let diverged = first_beyond(&course, DIVERGED).copied();
        let before = course.iter().take_while(|d| diverged.is_none_or(|at| d.time < at.time));
        let larger = |(a, b): (f64, f64), (c, d): (f64, f64)| (a.max(c), b.max(d));
        let largest = before.map(|d| (d.of_shape(), d.of_species())).reduce(larger);
        Deviations { course, largest, diverged }
    }

    /// Work of the steps, without the first relaxation.
    pub(crate) fn work(&self) -> Work {
        self.summary.spent.work - self.summary.start.work
    }

    /// Wall time of the steps: without the first relaxation and without output.
    pub(crate) fn seconds(&self) -> f64 {
        (self.summary.spent - self.summary.start).wall_seconds
    }
}

/// Observer that keeps what is compared at the output times.
#[derive(Default)]
struct Record {
    states: Vec<State>,
    measures: Vec<Measures>,
    shown: Vec<Vec<f64>>,
}

impl Observer for Record {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if info.frame {
            self.measures.push(measure(at, None)?);
            self.shown.extend(at.species_at_vertices().into_iter().next());
            self.states.push(at.state().clone());
        }
        Ok(())
    }
}

/// Runs one member into the directory that `room` makes; `record` writes down what it was made from.
///
/// # Errors
/// Whatever ends a run, and pairings that make no sense.
pub fn member(
    scene: &Scene,
    search: &PluginSearch,
    room: &mut dyn FnMut() -> Result<ResultDirectory, OutputError>,
    record: &dyn Fn(&Simulation, &ResultDirectory) -> Result<()>,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<MemberRun> {
    let mut simulation = Simulation::new(scene, search)?;
    let directory = room()?;
    let names = simulation.model().chemistry().map(|c| &c.descriptor().species);
    let species = names.into_iter().flatten().map(|s| s.name.clone()).collect();
    let norm = Norm::of(simulation.model());
    let mut kept = Record::default();
    let summary = run::with_status(&directory, || {
        record(&simulation, &directory)?;
        let observers: &mut [&mut dyn Observer] = &mut [&mut kept];
        let all = (None, observers);
        run::observed(scene, &mut simulation, &directory, progress, interrupt, all)
    })?;
    if summary.ending == Ending::Interrupted {
        return Err(Error::Solve(SolveError::Interrupted));
    }
    let Record { states, measures, shown } = kept;
    let sheet = Arc::clone(simulation.sheet());
    Ok(MemberRun { summary, states, measures, species, norm, shown, sheet })
}
