//! What a run leaves where it failed: a folder to inspect.
//!
//! | file | what is in it |
//! | --- | --- |
//! | `report.md` | what failed, where, the terms there, rejected step attempts, the commands to look and to resume |
//! | `state.vtu` | the last good state, the force of every effect, the rate of every species, the way to the shape where a relaxation stuck |
//!
//! Everything is taken from the last good state: a step that fails leaves it, and what solvers remember, as they were.

mod blame;
mod report;
mod state;

use std::path::PathBuf;

use super::error::Failure;
use super::{Error, Result, Simulation};
use crate::Stepper;
use crate::model::State;
use crate::output::{OutputError, ResultDirectory, atomic};
use crate::scene::Scene;
use crate::solve::{SolveError, diagnosis};
use blame::FailureCause;

/// Writes the failure report of a run of a scene into a directory that stopped with `error`, in the first relaxation of
/// `start` if that is given; an error of output, or of a start that is refused, is returned unchanged.
pub(super) fn report(
    (scene, directory): (&Scene, &ResultDirectory),
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
    let error = diagnosed(scene, simulation, error);
    // A first relaxation that failed leaves the shape where it stuck, which is inspected beside it.
    if let Some(start) = start {
        simulation.stepper.state.clone_from(start);
    }
    match write(scene, simulation, directory, &error) {
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

/// `error` with its cause, where the state of `simulation` shows one that the error does not tell.
fn diagnosed(scene: &Scene, simulation: &mut Simulation, error: Error) -> Error {
    if !matches!(error, Error::Solve(_) | Error::Kinetics(_)) {
        return error;
    }
    let Stepper { workspace, state, .. } = &mut simulation.stepper;
    // Where the model has no value there is nothing to see.
    let limit = diagnosis::explicit_limit(workspace, state).ok().flatten();
    let too_long =
        scene.time.integrator.explicit_step().zip(limit).filter(|(step, limit)| step > limit);
    let seen = match too_long {
        Some((step, limit)) => Some(diagnosis::explicit_limit_message(step, limit)),
        // Stretched without bound, the sheet also dilutes species ever faster.
        None => {
            let unbounded = diagnosis::unbounded(workspace, state).ok().flatten();
            let ill_posed = || diagnosis::ill_posed(&workspace.model, state);
            unbounded.or_else(ill_posed).or_else(|| {
                let seen = diagnosis::runaway(workspace, state);
                seen.ok().flatten()
            })
        }
    };
    let Some(diagnosis) = seen.map(Box::new) else { return error };
    Error::Solve(SolveError::Diagnosed { diagnosis, error: Box::new(error) })
}

/// Writes the folder of a run of `scene` that stopped with `error`; returns its path.
///
/// # Errors
/// A file that cannot be written. A field or a row of the report that has no value there is left out.
fn write(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    error: &Error,
) -> Result<(PathBuf, Option<usize>)> {
    directory.forget_failure()?;
    let folder = directory.root().join(ResultDirectory::FAILURE);
    std::fs::create_dir_all(&folder).map_err(OutputError::write(&folder))?;
    let blame = FailureCause::new(error, simulation);
    // The shape may be where something has no value; the rest is of use all the same.
    let state = folder.join(ResultDirectory::LAST_GOOD_STATE);
    let shown = state::write(&state, scene, simulation).is_ok();
    let files = (directory, shown.then_some(&*state));
    let text = report::text(scene, simulation, error, &blame, files);
    let report = folder.join(ResultDirectory::FAILURE_REPORT);
    atomic::replace(&report, |writer| writer.write_all(text.as_bytes()))?;
    Ok((folder, blame.vertex))
}
