//! References of a case: the choice of one, how well another confirms it, and what it can be used for.
//!
//! Two integrators may agree on a saddle that any imperfection would leave: monolithic ones follow a branch beyond the
//! point where it loses its stability. References of sheets in equilibrium therefore monitor the negative-curvature
//! modes (`[stability]`), and `events.csv` says from when on there are some.

use std::fs;
use std::path::Path;

use super::errors::{OfQuantities, errors};
use crate::model::{Policy, State};
use crate::output::ResultDirectory;
use crate::scene::Scene;
use crate::study::extent;
use crate::study::gather::{Distance, Norm, REFERENCES_DIVERGED, Run, first_beyond};
use crate::study::plan::Plan;

/// Changes below this, relative to what changes, are none.
const NEGLIGIBLE_CHANGE: f64 = 1e-6;

/// Reference of a case.
pub(super) struct Reference {
    /// Integrator and tolerance that made it.
    pub(super) name: String,
    /// Another one, and the errors of that relative to it.
    pub(super) confirmed: Option<(String, OfQuantities)>,
    /// Whether both are of one method.
    pub(super) alike: bool,
    /// Whether they differ in their stabilisation.
    pub(super) stabilised: bool,
    /// The output time from which on references are on different branches.
    pub(super) diverged: Option<f64>,
    /// The time from which on it is on a branch that has become unstable.
    pub(super) unstable: Option<f64>,
    /// Whether nothing changes in it.
    pub(super) still: bool,
    /// Other references, and their largest distances from this one.
    pub(super) others: Vec<(String, f64)>,
    /// Its results.
    pub(super) run: Run,
}

/// A reference that is complete.
pub(super) struct Candidate {
    /// Integrator and tolerance.
    pub(super) name: String,
    /// Its method.
    pub(super) method: String,
    /// Its stabilisation, if it is one of the two that differ in it.
    pub(super) stabilisation: Option<f64>,
    /// Its number in the study.
    pub(super) member: usize,
    /// Its results.
    pub(super) run: Run,
}

/// The best of the `candidates`; those that cannot be compared with it are added to `lost`.
pub(super) fn choose(
    norm: &Norm,
    (plan, root): (&Plan, &Path),
    mut candidates: Vec<Candidate>,
    lost: &mut Vec<(String, String)>,
) -> Option<Reference> {
    let pair = stabilised_pair(&candidates);
    let stabilised = pair.is_some();
    let (first, second) = pair.or_else(|| closest(norm, &candidates))?;
    let Candidate { method, member, run: truth, .. } = &candidates[first];
    // One that is elsewhere is on another branch, however well two others agree.
    let mut diverged: Option<f64> = None;
    let mut others = Vec::new();
    for (k, other) in candidates.iter().enumerate().filter(|(k, _)| *k != first) {
        let Candidate { name, run, .. } = other;
        let course = norm.course(&run.states, &truth.states);
        let Some(distance) = course.iter().map(Distance::largest).reduce(f64::max) else {
            lost.push((name.clone(), "has no states at the same output times".to_owned()));
            continue;
        };
        let from = first_beyond(&course, REFERENCES_DIVERGED).map(|distance| distance.time);
        // Without drag nothing leads off a branch that loses its stability.
        let from = from.filter(|_| !stabilised || Some(k) == second);
        diverged = diverged.into_iter().chain(from).reduce(f64::min);
        if Some(k) != second {
            others.push((name.clone(), distance));
        }
    }
    let confirmed = second.map(|second| {
        let Candidate { name, run, .. } = &candidates[second];
        (name.clone(), errors(norm, run, truth, diverged))
    });
    let alike = second.is_some_and(|second| candidates[second].method == *method);
    // Under drag shapes fall along negative-curvature directions all the time.
    let resting = plan.scene(*member).is_ok_and(|s| s.time.policy == Policy::QuasiStatic);
    let unstable = resting.then(|| unstable_from(&plan.directory(root, *member)));
    let (unstable, still) = (unstable.flatten(), is_still(norm, truth));
    let Candidate { name, run, .. } = candidates.swap_remove(first);
    Some(Reference { name, confirmed, alike, stabilised, diverged, unstable, still, others, run })
}

/// The two references with the least stabilisations, the least first; none if not both are complete.
fn stabilised_pair(references: &[Candidate]) -> Option<(usize, Option<usize>)> {
    let known = references.iter().enumerate().filter_map(|(k, r)| Some((k, r.stabilisation?)));
    let mut known: Vec<(usize, f64)> = known.collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [first, second, ..] = known[..] else { return None };
    Some((first.0, Some(second.0)))
}

/// The two references with the least distance, two of different methods if there are any, the one that is
/// preferred first; or the only one.
fn closest(norm: &Norm, references: &[Candidate]) -> Option<(usize, Option<usize>)> {
    let count = references.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let ranked = pairs.filter_map(|(a, b)| {
        let [first, second] = [a, b].map(|k| &references[k]);
        let course = norm.course(&second.run.states, &first.run.states);
        let distance = course.iter().map(Distance::largest).reduce(f64::max)?;
        Some((first.method == second.method, distance, a, b))
    });
    match ranked.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))) {
        Some((.., a, b)) => Some((a, Some(b))),
        None => (count > 0).then_some((0, None)),
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
pub(super) fn unstable_from(directory: &Path) -> Option<f64> {
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
