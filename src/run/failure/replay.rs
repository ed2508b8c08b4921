//! The scene that begins where a run failed.

use std::path::Path;

use crate::model::State;
use crate::run::snapshot::Snapshot;
use crate::run::{Result, Simulation};
use crate::scene::Scene;

/// The text of the scene; where it begins is written to `start`, beside it: the state of `simulation`, or `from`,
/// which is yet to be relaxed.
pub(super) fn write(
    start: &Path,
    scene: &Scene,
    simulation: &Simulation,
    from: Option<&State>,
) -> Result<String> {
    let resolved = with_plugins(&scene.resolved()?, simulation);
    let at = from.map_or((simulation.state(), true), |state| (state, false));
    Snapshot::write(start, &resolved, simulation, at)?;
    let name = start.file_name().unwrap_or_default().to_string_lossy();
    let mut table: toml::Table = resolved.parse().unwrap_or_default();
    if let Some(time) = table.get_mut("time").and_then(toml::Value::as_table_mut) {
        time.insert("from".into(), name.into_owned().into());
    }
    let (time, step) = (at.0.time, at.0.step);
    Ok(format!(
        "# Begins where a run failed, at time {time}, step {step}, and fails again; report.md beside it says \
         more.\n\n{table}"
    ))
}

/// The scene with the files of its plugins in place of their names: where they are looked for may differ.
fn with_plugins(scene: &str, simulation: &Simulation) -> String {
    let Ok(mut table) = scene.parse::<toml::Table>() else { return scene.to_owned() };
    let laws = match table.get_mut("kinetics") {
        Some(toml::Value::Array(all)) => all.iter_mut().collect(),
        Some(one) => vec![one],
        None => Vec::new(),
    };
    let host_law = simulation.host_law.as_ref().map(|[name, _]| name.as_str());
    let named = laws.into_iter().filter_map(|law| law.get_mut("plugin"));
    let named = named.filter(|name| host_law.is_none() || name.as_str() != host_law);
    for (name, file) in named.zip(simulation.plugins()) {
        *name = file.to_string_lossy().into_owned().into();
    }
    table.to_string()
}
