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

use super::{Error, Result, Simulation};
use crate::Stepper;
use crate::output::{OutputError, ResultDirectory, atomic};
use crate::scene::Scene;
use crate::solve::{SolveError, diagnosis};
use blame::FailureCause;

/// `error` with its cause, where the state of `simulation` shows one that the error does not tell.
pub(super) fn diagnosed(scene: &Scene, simulation: &mut Simulation, error: Error) -> Error {
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
pub(super) fn write(
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
    let text = report::report(scene, simulation, error, &blame, files);
    let report = folder.join(ResultDirectory::FAILURE_REPORT);
    atomic::replace(&report, |writer| writer.write_all(text.as_bytes()))?;
    Ok((folder, blame.vertex))
}
