//! Snapshot from which a run starts in the middle of another (`time.from` of its scene), taken before a
//! step, with the state of the solvers.
//!
//! ```text
//! scene      of the run that it was taken from, with all defaults
//! at rest    whether the shape is in equilibrium; otherwise the run begins by relaxing it
//! state      time, step, positions, species, internal variables
//! solvers    what they remember, where that can be stored
//! ```
//!
//! The scene may have been changed since, to find out what helps. Solvers then restart; in the same scene
//! they continue with the same bits.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::checkpoint::SolverMemory;
use super::{Result, Simulation};
use crate::model::State;
use crate::output::checkpoint;
use crate::record::Record;
use crate::scene::Scene;

/// Snapshot of a run before a step.
#[derive(Serialize, Deserialize)]
pub(super) struct Snapshot {
    scene: String,
    at_rest: bool,
    state: State,
    solvers: Option<SolverMemory>,
}

impl Snapshot {
    /// Puts `simulation`, newly made from `scene`, there.
    ///
    /// # Errors
    /// A file that cannot be used, or is of another sheet or other species; with its place in the scene.
    pub(super) fn take(path: &Path, scene: &Scene, simulation: &mut Simulation) -> Result<()> {
        let refuse = |what: String| {
            let message = format!("{}: {what}", path.display());
            let help =
                "it is written beside the replay of a run that failed; give that of this scene";
            scene.error_at("time.from", &message, Some(help))
        };
        let content = checkpoint::read(path).map_err(|error| refuse(format!("it {error}")))?;
        let Ok(read) = content.read() else {
            return Err(refuse("it holds something else than the start of a run".into()).into());
        };
        let Self { scene: before, at_rest, state, solvers } = read;
        let of = |all: &[Vec<f64>]| all.iter().map(Vec::len).collect::<Vec<_>>();
        let lengths = |state: &State| of(&state.species);
        let internal = |state: &State| of(&state.internal);
        let (here, there) = (simulation.state().x.len(), state.x.len());
        if here != there {
            let what = format!("it is of a sheet of {there} vertices, and the scene's has {here}");
            return Err(refuse(what).into());
        }
        if lengths(&state) != lengths(simulation.state()) {
            return Err(refuse("it is of other species than the scene's".into()).into());
        }
        if internal(&state) != internal(simulation.state()) {
            return Err(refuse("it is of other internal variables than the scene's".into()).into());
        }
        if !(state.time < scene.time.span.until.get()) {
            let what = format!("it is of time {}, and the run ends before", state.time);
            return Err(refuse(what).into());
        }
        let same = same(&before, &scene.resolved()?);
        if let Some(solvers) = solvers.filter(|_| same) {
            let taken = solvers.restore(simulation);
            if taken.is_err() {
                return Err(
                    refuse("what it holds of solvers is not that of the scene".into()).into()
                );
            }
        }
        simulation.stepper.state = state;
        simulation.at_rest = at_rest;
        Ok(())
    }

    /// Writes `state`, at rest or not, and what the solvers of `simulation` remember there, of a run of
    /// `scene`, to `path`.
    ///
    /// # Errors
    /// [`OutputError::Write`](crate::output::OutputError) from the operating system.
    pub(super) fn write(
        path: &Path,
        scene: &str,
        simulation: &Simulation,
        (state, at_rest): (&State, bool),
    ) -> Result<()> {
        // Those that have relaxed a start in vain are not as they began.
        let solvers = at_rest && simulation.stepper.integrator.is_storable();
        let solvers = solvers.then(|| SolverMemory::of(simulation));
        let snapshot = Self { scene: scene.to_owned(), at_rest, state: state.clone(), solvers };
        Ok(checkpoint::write(path, &Record::of(&snapshot))?)
    }
}

/// Whether two scenes compute the same, step by step: where one begins does not matter, nor what it writes.
fn same(before: &str, now: &str) -> bool {
    let parsed = |text: &str| -> Option<toml::Table> {
        let mut scene: toml::Table = text.parse().ok()?;
        ["checkpoint", "output"].iter().for_each(|key| drop(scene.remove(*key)));
        if let Some(time) = scene.get_mut("time").and_then(toml::Value::as_table_mut) {
            ["from", "until", "max_steps"].iter().for_each(|key| drop(time.remove(*key)));
        }
        Some(scene)
    };
    parsed(before).is_some_and(|before| Some(before) == parsed(now))
}
