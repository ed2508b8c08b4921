//! Whether a reference stays on a branch that has become unstable.
//!
//! Two integrators may agree on a saddle that any imperfection would leave: monolithic ones follow a branch beyond the
//! point where it loses its stability. References of sheets in equilibrium therefore watch the directions that
//! lower the energy (`[stability]`), and `events.csv` says from when on there are some.

use std::fs;
use std::path::Path;

use crate::model::Policy;
use crate::output::ResultDirectory;
use crate::scene::Scene;

/// A factor of every state is made; beyond this it would cost more than the steps.
const LARGEST: usize = 20_000;

/// What references of a scene of so many vertices set to be watched; nothing where shapes are not in equilibrium:
/// one that moves falls along negative-curvature directions all the time.
pub(super) fn watched(scene: &Scene, moves: bool, vertices: usize) -> Option<String> {
    let still = moves && scene.time.policy == Policy::QuasiStatic;
    (still && vertices <= LARGEST).then(|| "stability.watch=true".to_owned())
}

/// Time from which on the run in `directory` has been on an unstable branch until its end.
pub(super) fn unstable_from(directory: &Path) -> Option<f64> {
    let events = fs::read_to_string(directory.join(ResultDirectory::EVENTS)).ok()?;
    let mut since = None;
    for line in events.lines().skip(1) {
        let mut columns = line.split(',');
        let time = columns.next()?.parse::<f64>().ok();
        let negative: usize = columns.nth(3)?.parse().ok()?;
        since = if negative > 0 { since.or(time) } else { None };
    }
    since
}
