//! Steps that make a species negative where its law does not.
//!
//! A law keeps a species nonnegative where its rate at c_i = 0 is not negative: what uses a species up needs some of it.
//! Errors below the absolute tolerance lead below 0 all the same, and from there many laws lead to -∞, as
//! `c' = -k c²` does in the time 1/(k|c|). No estimate of the error of one step sees that. A step in which a species
//! falls below its tolerance is therefore rejected, if its rate at 0 is not negative at both ends of the step, and tried
//! again from a start whose errors below 0 are raised to 0.

use super::{Result, SolveError, Workspace};
use crate::model::{ModelError, State};

/// The absolute values that species may fall below 0 by.
fn slacks(workspace: &Workspace, state: &State, (rtol, atol): (f64, f64)) -> Vec<f64> {
    let Some(chemistry) = workspace.model.chemistry() else { return Vec::new() };
    let largest = |c: &Vec<f64>| c.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let species = chemistry.all_typical().into_iter().zip(&state.species);
    species.map(|(typical, c)| atol * typical + rtol * largest(c)).collect()
}

/// Rates of the species at `state`, those in which `raised` holds of species, point and value at 0.
fn rates_at_zero(
    workspace: &mut Workspace,
    state: &State,
    raised: impl Fn(usize, usize, f64) -> bool,
) -> Result<Vec<Vec<f64>>> {
    let mut state = state.clone();
    for (s, values) in state.species.iter_mut().enumerate() {
        for (i, c) in values.iter_mut().enumerate() {
            if raised(s, i, *c) {
                *c = 0.0;
            }
        }
    }
    Ok(workspace.at(&state).rates()?.to_vec())
}

/// Refuses a step from `start` to `end` that makes a species negative beyond the tolerance where its law does not.
///
/// # Errors
/// [`ModelError::Negative`]; errors of laws.
pub(super) fn check(
    workspace: &mut Workspace,
    start: &State,
    end: &State,
    tolerance: (f64, f64),
) -> Result<()> {
    if !end.species.iter().flatten().any(|c| *c < 0.0) {
        return Ok(());
    }
    let slack = slacks(workspace, start, tolerance);
    let within = |s: usize, i: usize| start.species[s][i] >= -slack[s];
    let fallen = |s: usize, i: usize| end.species[s][i] < -slack[s] && within(s, i);
    let points = |s: usize| 0..end.species[s].len();
    if !(0..slack.len()).any(|s| points(s).any(|i| fallen(s, i))) {
        return Ok(());
    }
    let raised = |s: usize, i: usize, c: f64| c < 0.0 && within(s, i);
    let first = rates_at_zero(workspace, start, |s, i, c| raised(s, i, c) || fallen(s, i))?;
    let last = rates_at_zero(workspace, end, raised)?;
    let kept = |s: usize, i: usize| fallen(s, i) && first[s][i] >= 0.0 && last[s][i] >= 0.0;
    let found = (0..slack.len()).find_map(|s| Some((s, points(s).find(|i| kept(s, *i))?)));
    let model = &workspace.model;
    match (found, model.chemistry()) {
        (Some((s, point)), Some(chemistry)) => Err(SolveError::Model(ModelError::Negative {
            species: chemistry.descriptor().species[s].name.clone(),
            location: chemistry.location(),
            point,
            value: end.species[s][point],
            time: end.time,
        })),
        _ => Ok(()),
    }
}

/// `state` with species that are negative within the tolerance, and whose law does not make them so, at 0.
///
/// # Errors
/// Errors of laws.
pub(super) fn raised(
    workspace: &mut Workspace,
    state: &State,
    tolerance: (f64, f64),
) -> Result<State> {
    let slack = slacks(workspace, state, tolerance);
    let below = |s: usize, _: usize, c: f64| c < 0.0 && c >= -slack[s];
    let rates = rates_at_zero(workspace, state, below)?;
    let mut raised = state.clone();
    for (s, values) in raised.species.iter_mut().enumerate() {
        for (i, c) in values.iter_mut().enumerate() {
            if below(s, i, *c) && rates[s][i] >= 0.0 {
                *c = 0.0;
            }
        }
    }
    Ok(raised)
}
