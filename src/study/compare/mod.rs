//! One scene under several policies and integrators, from the same start.
//!
//! Every member is a run of its own, with frames and ledger. At the output times all have in common they
//! are measured: before shapes diverge at a bifurcation by the distance of their fields, after it by what
//! does not hang on which of equal branches was taken (energy, number of spots, separation, amplitude).

mod pictures;
mod timescales;

pub use pictures::{contact_sheet, figure};
pub use timescales::Timescales;

use std::sync::Arc;

use super::differences::{Difference, Norm};
use super::measures::{Measures, measure};
use crate::kinetics::Search;
use crate::model::{Evaluation, State};
use crate::output::{Interrupt, OutputError, Progress, ResultDirectory};
use crate::run::run::{self, Ending, Summary};
use crate::run::{Error, Observer, Result, Simulation, StepInfo};
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::SolveError;
use crate::tally::Work;

/// Relative distance of shapes or species beyond which two runs count as diverged: on different
/// branches of a bifurcation, or too far apart for the distance to mean more.
pub const DIVERGED: f64 = 0.2;

/// One member of a comparison.
pub struct Member {
    /// `policy, integrator`.
    pub name: String,
    /// What became of it.
    pub outcome: Result<Ran>,
}

/// A member that ran.
pub struct Ran {
    /// Work and times.
    pub summary: Summary,
    /// States at the output times.
    pub states: Vec<State>,
    /// Measures at the output times.
    pub measures: Vec<Measures>,
    /// Names of the species.
    pub species: Vec<String>,
    /// What its states are compared by.
    pub norm: Norm,
    /// The first species of every state at the vertices, if there are species.
    pub shown: Vec<Vec<f64>>,
    /// The sheet.
    pub sheet: Arc<Sheet>,
}

/// Distance of one run from another over the output times they have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// Time, distance of shapes, distance of species.
    pub course: Vec<(f64, f64, f64)>,
    /// Largest distances before the runs diverge: of shapes, of species; none if they begin apart.
    pub largest: Option<(f64, f64)>,
    /// Where a distance is first beyond [`DIVERGED`].
    pub diverged: Option<Divergence>,
}

/// Where two runs diverge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Divergence {
    /// The time.
    pub time: f64,
    /// The number of the species that differs most; `None` where shapes differ more.
    pub species: Option<usize>,
    /// By how much.
    pub by: Difference,
}

impl Ran {
    /// How far this run is from `reference`.
    #[must_use]
    pub fn deviations(&self, reference: &Self) -> Deviations {
        let mut deviations = Deviations { course: Vec::new(), largest: None, diverged: None };
        for state in &self.states {
            let Some(same) = reference.states.iter().find(|r| r.time == state.time) else {
                continue;
            };
            let found = self.norm.differences(state, same);
            let shape = found.shape.relative();
            let worst = found.worst_species();
            let species = worst.map_or(0.0, |(_, by)| by.relative());
            deviations.course.push((state.time, shape, species));
            if deviations.diverged.is_none() {
                if shape > DIVERGED || species > DIVERGED {
                    let (species, by) = match worst {
                        Some((which, by)) if species > shape => (Some(which), by),
                        _ => (None, found.shape),
                    };
                    deviations.diverged = Some(Divergence { time: state.time, species, by });
                } else {
                    let (a, b) = deviations.largest.unwrap_or((0.0, 0.0));
                    deviations.largest = Some((a.max(shape), b.max(species)));
                }
            }
        }
        deviations
    }

    /// Work of the steps, without the first relaxation.
    #[must_use]
    pub fn work(&self) -> Work {
        self.summary.spent.work - self.summary.start.work
    }

    /// Wall time of the steps: without the first relaxation and without output.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        (self.summary.spent - self.summary.start).wall_seconds
    }
}

/// Keeps what is compared of the states at the output times.
#[derive(Default)]
struct Kept {
    states: Vec<State>,
    measures: Vec<Measures>,
    shown: Vec<Vec<f64>>,
}

impl Observer for Kept {
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
    search: &Search,
    room: &mut dyn FnMut() -> Result<ResultDirectory, OutputError>,
    record: &dyn Fn(&Simulation, &ResultDirectory) -> Result<()>,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Ran> {
    let mut simulation = Simulation::new(scene, search)?;
    let directory = room()?;
    let names = simulation.model().chemistry().map(|c| &c.descriptor().species);
    let species = names.into_iter().flatten().map(|s| s.name.clone()).collect();
    let norm = Norm::of(simulation.model());
    let mut kept = Kept::default();
    let summary = run::with_status(&directory, || {
        record(&simulation, &directory)?;
        let observers: &mut [&mut dyn Observer] = &mut [&mut kept];
        let all = (None, observers);
        run::observed(scene, &mut simulation, &directory, progress, interrupt, all)
    })?;
    if summary.ending == Ending::Interrupted {
        return Err(Error::Solve(SolveError::Interrupted));
    }
    let Kept { states, measures, shown } = kept;
    let sheet = Arc::clone(simulation.sheet());
    Ok(Ran { summary, states, measures, species, norm, shown, sheet })
}
