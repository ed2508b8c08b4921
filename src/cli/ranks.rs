//! The ranks of a program that is started by `mpirun` or `srun`: with the feature `mpi`.

use std::process::ExitCode;
use std::sync::Arc;

use crate::Result;
use crate::reduction::Communicator;

/// The variable of the environment by which srun says how many processes it has started.
const TASKS_OF_SLURM: &str = "SLURM_STEP_NUM_TASKS";

/// How many processes a launcher says that it has started, if there is more than one.
fn several(variables: &[&str]) -> Option<usize> {
    variables.iter().find_map(|name| {
        let size: usize = std::env::var(name).ok()?.parse().ok()?;
        (size > 1).then_some(size)
    })
}

/// The ranks, if there is more than one.
///
/// # Errors
/// If MPI cannot be started; if Slurm has started several processes that do not find one another.
#[cfg(feature = "mpi")]
pub(super) fn all() -> Result<Option<Arc<dyn Communicator>>> {
    if !rumple_ranks::is_launched() {
        return match several(&[TASKS_OF_SLURM]) {
            None => Ok(None),
            Some(size) => Err(crate::Error::Refused(format!(
                "this is one of {size} processes of srun, which MPI cannot connect: each would run the whole scene; start \
                 them by `srun --mpi=pmix` (`srun --mpi=list` prints what there is) or by mpirun"
            ))),
        };
    }
    let world = rumple_ranks::world().map_err(crate::Error::Refused)?;
    Ok((world.size() > 1).then_some(world as Arc<dyn Communicator>))
}

/// The ranks, if there is more than one.
///
/// # Errors
/// If there are several: this program knows no MPI.
#[cfg(not(feature = "mpi"))]
pub(super) fn all() -> Result<Option<Arc<dyn Communicator>>> {
    match several(&["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", TASKS_OF_SLURM]) {
        None => Ok(None),
        Some(size) => Err(crate::Error::Refused(format!(
            "this is one of {size} processes, and the program was built without MPI: each would run the whole scene; \
             build it with `cargo build --release --features mpi`"
        ))),
    }
}

/// Ends the ranks together: texts of errors are printed once, by the first, and all have the worst exit code.
pub(super) fn end(code: u8, text: &str) -> ExitCode {
    #[cfg(feature = "mpi")]
    if rumple_ranks::is_launched()
        && let Ok(world) = rumple_ranks::world()
        && world.size() > 1
    {
        let (code, texts) = world.conclude(code, text);
        texts.iter().for_each(|text| super::warn(text));
        rumple_ranks::end();
        return ExitCode::from(code);
    }
    if !text.is_empty() {
        super::warn(text);
    }
    #[cfg(feature = "mpi")]
    rumple_ranks::end();
    ExitCode::from(code)
}
