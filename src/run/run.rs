//! Runs of a scene into a directory: new, recorded, continued.

use std::path::Path;

use super::checkpoint::Checkpoint;
use super::costs::Costs;
pub use super::error::Failure;
use super::main_loop::stepped;
use super::observe::Observer;
use super::process::peak_resident;
use super::resume::Resumed;
pub(crate) use super::summary::end;
pub use super::summary::{Ending, Summary, with_status};
use super::{Result, Simulation, provenance};
use crate::num::Short;
use crate::output::{Interrupt, Progress, ResultDirectory, Standing};
use crate::scene::Scene;

/// Runs `simulation` and writes into `directory`.
///
/// Steady means: the largest |dc/dt| over all points, in units of each species' typical
/// magnitude, is below `time.stop_when_steady`.
///
/// # Errors
/// [`Error::Stopped`](super::Error::Stopped) if a step cannot be made; output that cannot be written.
pub fn run(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Summary> {
    observed(scene, simulation, directory, progress, interrupt, (None, &mut []))
}

/// [`run`], from the checkpoint `from` that `simulation` has been brought to, if there is one, and showing every
/// accepted state to `others` as well.
///
/// # Errors
/// As [`run`], those of the observers, and results that are not those of that checkpoint.
pub fn observed(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    (from, others): (Option<&Checkpoint>, &mut [&mut dyn Observer]),
) -> Result<Summary> {
    let outcome = stepped(scene, simulation, directory, progress, interrupt, from, others);
    directory.claim().tell(|reached| {
        // A last step that failed included.
        reached.spent = simulation.spent();
        reached.peak_resident_bytes = peak_resident();
    });
    let written = Costs::new(scene, simulation).write(directory);
    // The first failure is the one to report.
    let summary = outcome?;
    written?;
    Ok(summary)
}

/// [`observed`] as a command makes it: with the record of what the run is made from, of which the file `state` is the
/// start if that is not the scene's; laws tried out at the start; and the status of how it ended.
///
/// # Errors
/// As [`observed`], and a record that cannot be written.
pub fn recorded(
    (scene, state): (&Scene, Option<&Path>),
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    others: &mut [&mut dyn Observer],
) -> Result<Summary> {
    with_status(directory, || {
        provenance::record(scene, state, simulation, directory)?;
        simulation.try_laws()?;
        for note in simulation.notes.iter().chain(&simulation.faults) {
            progress.message(note);
            directory.claim().note(note);
        }
        observed(scene, simulation, directory, progress, interrupt, (None, others))
    })
}

/// Continues the run in `directory` that was set up as `resumed`, showing every accepted state to `others` as well.
///
/// # Errors
/// As [`observed`], and a record that cannot be written.
pub fn continued(
    resumed: &mut Resumed,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    others: &mut [&mut dyn Observer],
) -> Result<Summary> {
    let Resumed { scene, simulation, checkpoint, notes } = resumed;
    let earlier = Standing::read(directory.root()).map(|standing| standing.notes);
    directory.claim().begin()?;
    earlier.iter().flatten().for_each(|note| directory.claim().note(note));
    with_status(directory, || {
        if simulation.sheet().reduction().is_first() {
            provenance::record_resumed(scene, checkpoint, directory)?;
        }
        notes.iter().for_each(|note| progress.message(note));
        let (time, step) = (Short(checkpoint.time()), checkpoint.step());
        progress.message(&format!("going on from time {time}, step {step}"));
        let from = (Some(&*checkpoint), others);
        observed(scene, simulation, directory, progress, interrupt, from)
    })
}
