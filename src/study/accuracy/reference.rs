//! Reference of a study: how well another one confirms it, and what it can be used for.
//!
//! Two integrators may agree on a saddle that any imperfection would leave: monolithic ones follow a branch beyond the
//! point where it loses its stability. References of sheets in equilibrium therefore monitor the negative-curvature
//! modes (`[stability]`), and `events.csv` says from when on there are some.

use std::fs;
use std::path::Path;

use super::quantity::{OfQuantities, Quantity};
use crate::model::{Policy, State};
use crate::output::ResultDirectory;
use crate::scene::Scene;
use crate::study::extent;
use crate::study::gather::{Norm, REFERENCES_DIVERGED, Run, first_beyond, largest};
use crate::study::plan::Plan;

/// Changes below this, relative to what changes, are none.
const NEGLIGIBLE_CHANGE: f64 = 1e-6;

/// Reference of a study.
pub(super) struct Reference {
    /// Integrator and tolerance that made it.
    pub(super) name: String,
    /// Another one, and the errors of that relative to it.
    pub(super) confirmed: Option<(String, OfQuantities)>,
    /// The output time from which on references are on different branches.
    pub(super) diverged: Option<f64>,
    /// The time from which on it is on a branch that has become unstable.
    pub(super) unstable: Option<f64>,
    /// Whether nothing changes in it.
    pub(super) still: bool,
    /// Its results.
    pub(super) run: Run,
}

impl Reference {
    /// The first of the complete `references` (name, number, results), confirmed by the second.
    pub(super) fn choose(
        norm: &Norm,
        (plan, root): (&Plan, &Path),
        references: Vec<(String, usize, Run)>,
    ) -> Option<Self> {
        let mut references = references.into_iter();
        let (name, number, run) = references.next()?;
        let mut diverged = None;
        let confirmed = references.next().map(|(name, _, other)| {
            let course = norm.course(&other.states, &run.states);
            diverged = first_beyond(&course, REFERENCES_DIVERGED).map(|distance| distance.time);
            (name, errors(norm, &other, &run, diverged))
        });
        // Under drag shapes fall along negative-curvature directions all the time.
        let resting = plan.scene(number).is_ok_and(|s| s.time.policy == Policy::QuasiStatic);
        let unstable = resting.then(|| unstable_from(&plan.directory(root, number))).flatten();
        let still = is_still(norm, &run);
        Some(Self { name, confirmed, diverged, unstable, still, run })
    }
}

/// Whether neither species nor shape change along a run.
fn is_still(norm: &Norm, run: &Run) -> bool {
    let Some(first) = run.states.first() else { return false };
    let species = |state: &State| norm.distance(state, first).of_species();
    let (least, most) = extent(run.found.measures.iter().map(|m| m.amplitude));
    run.states.iter().all(|state| species(state) <= NEGLIGIBLE_CHANGE)
        && !(most - least > NEGLIGIBLE_CHANGE * most)
}

/// A factor of every state is made; beyond this it would cost more than the steps.
const MAX_VERTICES: usize = 20_000;

/// Returns the override by which references of a scene of so many vertices watch their stability; none where shapes
/// are not in equilibrium: one that moves falls along negative-curvature directions all the time.
pub(super) fn stability_override(scene: &Scene, moves: bool, vertices: usize) -> Option<String> {
    let still = moves && scene.time.policy == Policy::QuasiStatic;
    (still && vertices <= MAX_VERTICES).then(|| "stability.watch=true".to_owned())
}

/// Time from which on the run in `directory` has been on an unstable branch until its end.
fn unstable_from(directory: &Path) -> Option<f64> {
    let events = fs::read_to_string(directory.join(ResultDirectory::EVENTS)).ok()?;
    let mut since = None;
    for line in events.lines().skip(1) {
        let mut columns = line.split(',');
        let time = columns.next()?.parse::<f64>().ok();
        // A snap has none.
        let Ok(negative) = columns.nth(3)?.parse::<usize>() else { continue };
        since = if negative > 0 { since.or(time) } else { None };
    }
    since
}

/// Errors of `run` relative to `truth`: of fields the largest before references diverge at the time `diverged`.
pub(super) fn errors(norm: &Norm, run: &Run, truth: &Run, diverged: Option<f64>) -> OfQuantities {
    let course = norm.course(&run.states, &truth.states);
    let before = course.iter().filter(|d| d.time > 0.0 && diverged.is_none_or(|at| d.time < at));
    let fields = largest(before);
    Quantity::ALL.map(|quantity| match quantity {
        Quantity::Species => Some(fields.filter(|_| norm.has_species())?.1),
        Quantity::Shape => Some(fields.filter(|_| norm.shape_moves())?.0),
        measure => measure.error(&run.found.measures, &truth.found.measures),
    })
}
