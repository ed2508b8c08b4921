//! A run that is under way: its scene, directory and progress, and the failure report that it leaves.

use super::{Error, Simulation, failure};
use crate::model::State;
use crate::output::{Interrupt, Progress, ResultDirectory};
use crate::run::error::Failure;
use crate::scene::Scene;
use crate::solve::SolveError;

/// What all stages of a run share.
pub(super) struct Session<'a> {
    pub(super) scene: &'a Scene,
    pub(super) directory: &'a ResultDirectory,
    pub(super) progress: &'a mut Progress,
    pub(super) interrupt: Interrupt,
}

impl Session<'_> {
    /// Says what a reader of the results should know, and records it.
    pub(super) fn note(&mut self, text: &str) {
        self.progress.message(text);
        self.directory.claim().note(text);
    }

    /// Writes the failure report of a run that stopped with `error`, in the first relaxation of `start` if that is given; an
    /// error of output, or of a start that is refused, is returned unchanged.
    pub(super) fn report_failure(
        &self,
        simulation: &mut Simulation,
        error: Error,
        start: Option<&State>,
    ) -> Error {
        if matches!(error, Error::Output(_) | Error::Solve(SolveError::Start { .. })) {
            return error;
        }
        let error = super::located(error, simulation.sheet(), &simulation.stepper.state.x);
        if simulation.sheet().reduction().ranks().is_some() {
            // The cause may be known to another rank only.
            return error;
        }
        let error = failure::diagnosed(self.scene, simulation, error);
        // A first relaxation that failed leaves the shape where it stuck, which is inspected beside it.
        if let Some(start) = start {
            simulation.stepper.state.clone_from(start);
        }
        match failure::write(self.scene, simulation, self.directory, &error) {
            // The first failure is the one to report.
            Err(_) => error,
            Ok((folder, vertex)) => Error::Stopped(Failure {
                error: Box::new(error),
                time: simulation.stepper.state.time,
                step: simulation.stepper.state.step,
                vertex,
                folder,
            }),
        }
    }
}
