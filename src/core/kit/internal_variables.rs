//! Internal variables: places, initial values, rates against their bound, threads.

use std::sync::Arc;

use rand::RngExt;

use super::report::{DIFFERENCE_STEP, Report, crumpled, exceeds, on_threads};
use crate::effects::InternalVariables;
use crate::kinetics::Location;
use crate::model::{Mechanics, ModelError, Potential};
use crate::num::real;
use crate::sheet::Sheet;

/// By how much values are moved from the initial ones, in units of what matters of them.
const PERTURBATION: f64 = 0.1;
/// By how much rates may exceed the bound of their derivatives, relative.
const RATE_BOUND_SLACK: f64 = 1e-3;

/// Everything about the internal variables of one kind.
pub(super) fn of_internal(
    report: &mut Report,
    term: &dyn InternalVariables,
    sheet: &Arc<Sheet>,
) -> Result<(), ModelError> {
    let mut fault = |what: &str| report.faults.push(format!("{}: {what}", term.name()));
    let initial: Vec<f64> = (0..term.count(sheet)).map(|i| term.initial(i)).collect();
    match declared(term, &initial) {
        Some(what) => fault(what),
        None => of_rates(term, &initial, sheet, &mut fault)?,
    }
    Ok(())
}

/// What is wrong with what the variables say of themselves.
fn declared(term: &dyn InternalVariables, initial: &[f64]) -> Option<&'static str> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    let usable = |q: &f64| q.is_finite() && (*q > 0.0 || !term.multiplies_lengths());
    let bound = term.spectral_bound();
    if term.multiplies_lengths() && term.location() != Location::Edge {
        Some("they multiply lengths, and are not on edges")
    } else if !positive(term.typical()) {
        Some("the change that matters is not a number > 0")
    } else if !initial.iter().all(usable) {
        Some("an initial value is not finite, or a length factor not positive")
    } else if !(bound >= 0.0 && bound.is_finite()) {
        Some("the spectral bound is not a number from 0")
    } else {
        None
    }
}

/// Rates on a crumpled shape, near the initial values.
fn of_rates(
    term: &dyn InternalVariables,
    initial: &[f64],
    sheet: &Arc<Sheet>,
    fault: &mut impl FnMut(&str),
) -> Result<(), ModelError> {
    let (name, typical, bound) = (term.name(), term.typical(), term.spectral_bound());
    let mechanics = Mechanics::new(Arc::clone(sheet), Vec::new(), Vec::new())?;
    let mut potential = Potential::new(&mechanics);
    let (x, mut random) = crumpled(sheet, mechanics.reference().mean_edge());
    let mut noise = |size: f64| -> Vec<f64> {
        initial.iter().map(|_| size * random.random_range(-1.0..=1.0)).collect()
    };
    let sum = |a: &[f64], b: &[f64], share: f64| -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + share * b).collect()
    };
    let values = sum(initial, &noise(PERTURBATION * typical), 1.0);
    let direction = noise(typical);
    let ones = vec![1.0; sheet.edges().len()];
    let mut rates = |values: &Vec<f64>| {
        potential.set_fields(std::iter::once((name, values)));
        let factor = if term.multiplies_lengths() { values } else { &ones };
        potential.set_conditions(Some(factor), 0.0);
        let mut out = vec![0.0; values.len()];
        term.rates(&potential.shape(&x), values, &mut out);
        out
    };
    let there = on_threads(1, || rates(&values));
    if !there.iter().all(|rate| rate.is_finite()) {
        fault("a rate is not finite");
        return Ok(());
    }
    if on_threads(4, || rates(&values)) != there {
        fault("rates differ with the number of threads");
    }
    let after = rates(&sum(&values, &direction, DIFFERENCE_STEP));
    let before = rates(&sum(&values, &direction, -DIFFERENCE_STEP));
    let size = |a: &[f64]| (a.iter().map(|a| a * a).sum::<f64>() / real(a.len().max(1))).sqrt();
    let moved = DIFFERENCE_STEP * size(&direction);
    let slope = size(&sum(&after, &before, -1.0)) / (2.0 * moved);
    // Differences of rates lose digits.
    let round_off = 10.0 * f64::EPSILON * size(&there) / moved;
    if exceeds(slope, bound * (1.0 + RATE_BOUND_SLACK) + round_off) {
        fault(&format!(
            "rates change by {slope:e} per change of the values, above the spectral bound {bound:e}"
        ));
    }
    Ok(())
}
