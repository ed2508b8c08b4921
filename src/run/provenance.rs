//! Record of what a run is made from: files that it reads, the resolved scene, versions.

use std::path::{Path, PathBuf};

use super::{Checkpoint, Result, Simulation};
use crate::output::provenance::FileRecord;
use crate::output::{Inputs, Provenance, ResultDirectory, atomic};
use crate::scene::Scene;

/// Returns the files that `scene` reads, with its `plugins` as far as they are known.
#[must_use]
pub fn inputs(scene: &Scene, plugins: &[PathBuf]) -> Inputs {
    let mut inputs = Inputs::default();
    inputs.add("the scene", scene.file());
    for (key, path) in scene.files() {
        inputs.add(key, path);
    }
    for plugin in plugins {
        inputs.add("a plugin", plugin);
    }
    inputs
}

/// Writes what a run is made from into `directory`: every default of its scene, the file `state` that it starts from if
/// that is not the scene's, files, versions.
///
/// # Errors
/// A file that cannot be read or written.
pub fn record(
    scene: &Scene,
    state: Option<&Path>,
    simulation: &Simulation,
    directory: &ResultDirectory,
) -> Result<()> {
    let mut provenance = Provenance::new(simulation.mesh());
    provenance.version = format!("rumple {}", crate::VERSION);
    // A scene that was parsed has no file.
    let file = Some(scene.file()).filter(|file| !file.as_os_str().is_empty());
    provenance.scene = file.map(FileRecord::new).transpose()?;
    provenance.state = state.map(FileRecord::new).transpose()?;
    provenance.start_time = simulation.state().time;
    for plugin in simulation.plugins() {
        provenance.plugins.push(FileRecord::new(plugin)?);
    }
    provenance.write(directory, &scene.resolved()?)?;
    Ok(())
}

/// Writes that the run in `directory` continues at the checkpoint `from`, and to where.
///
/// # Errors
/// A file that cannot be read or written.
pub fn record_resumed(scene: &Scene, from: &Checkpoint, directory: &ResultDirectory) -> Result<()> {
    Provenance::resumed(directory, from.time(), from.step())?;
    let text = scene.resolved()?;
    Ok(atomic::replace(&directory.resolved(), |writer| writer.write_all(text.as_bytes()))?)
}
