//! The internal variables of effects over one step of the coupling.
//!
//! ```text
//! dq/dt = f(q, x(t), c(t), t),     x and c on straight lines from one state to another
//! ```
//!
//! by the stabilised explicit method of [`chemistry::chebyshev`](super::chemistry::chebyshev) under error control, with
//! what they have changed by since nothing had happened to the sheet as unknowns: relative tolerances are those of strains.

use std::sync::Arc;

use super::chemistry::chebyshev::{Chebyshev, Tolerance};
use super::route::Route;
use super::{Result, SolveError, Workspace, counters, under_way};
use crate::model::{Model, State};
use crate::tally::Work;

/// An integrator of internal variables, with its work arrays.
#[derive(Default)]
pub(super) struct InternalSteps {
    chebyshev: Chebyshev,
}

impl InternalSteps {
    /// The internal variables of `from` carried on to the time of `to`, while shape and species go from those of the
    /// one to those of the other; nothing is done without any.
    ///
    /// # Errors
    /// If the model has no value on the way, or the integrator fails.
    pub(super) fn advance(
        &mut self,
        workspace: &mut Workspace,
        (from, to): (&State, &State),
        (rtol, atol): (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        let model = Arc::clone(&workspace.model);
        if model.internal().is_empty() || !(to.time > from.time) {
            return Ok(from.internal.clone());
        }
        let _scope = counters::part(model.tally(), counters::INTERNAL);
        let initial = model.initial_internal();
        let mut y = packed(&from.internal, &initial);
        let absolute = tolerances(&model, &initial, atol);
        let tolerance = Tolerance { relative: rtol, absolute: &absolute };
        let bound = model.internal().iter().map(|term| term.spectral_bound()).fold(0.0, f64::max);
        let (route, still) = (Route::in_time(from, to), from.x == to.x);
        let control = workspace.control.clone();
        let span = (from.time, to.time);
        let rate = |t: f64, y: &[f64], out: &mut [f64]| {
            control.report(|| under_way("integrating internal variables", (span.0, t, span.1)));
            control.check()?;
            let mut at = route.conditions_at(t, from);
            if !still {
                let share = (t - span.0) / (span.1 - span.0);
                at.x.iter_mut().zip(&to.x).for_each(|(x, to)| *x += share * (to - *x));
            }
            at.internal = unpacked(y, &initial);
            let rates = workspace.at(&at).internal_rates()?;
            out.iter_mut().zip(rates.iter().flatten()).for_each(|(out, rate)| *out = *rate);
            Ok(())
        };
        let before = self.chebyshev.work();
        let done = self.chebyshev.integrate(span.0, span.1, &mut y, &tolerance, bound, rate);
        let more = self.chebyshev.work() - before;
        model.tally().count(|work: &mut Work| *work += more);
        done.map_err(|error| named(error, &model, &initial))?;
        Ok(unpacked(&y, &initial))
    }
}

/// What has changed since nothing had happened to the sheet, one variable after the other.
fn packed(values: &[Vec<f64>], initial: &[Vec<f64>]) -> Vec<f64> {
    let all = values.iter().flatten().zip(initial.iter().flatten());
    all.map(|(value, initial)| value - initial).collect()
}

fn unpacked(y: &[f64], initial: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut y = y.iter();
    initial
        .iter()
        .map(|all| all.iter().zip(&mut y).map(|(initial, y)| initial + y).collect())
        .collect()
}

/// Absolute tolerances: `atol` in units of what matters of each.
fn tolerances(model: &Model, initial: &[Vec<f64>], atol: f64) -> Vec<f64> {
    let each = model.internal().iter().zip(initial);
    each.flat_map(|(term, all)| std::iter::repeat_n(atol * term.typical(), all.len())).collect()
}

/// `error` with the name of the variable that it blames.
fn named(mut error: SolveError, model: &Model, initial: &[Vec<f64>]) -> SolveError {
    if let SolveError::Unresolved { unknown, what, .. } = &mut error {
        let mut place = *unknown;
        for (term, all) in model.internal().iter().zip(initial) {
            if place < all.len() {
                let noun = term.location().noun();
                *what = format!("the internal variable {} at {noun} {place}", term.name());
                break;
            }
            place -= all.len();
        }
    }
    error
}
