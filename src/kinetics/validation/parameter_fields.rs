//! Whether parameters that differ from point to point do what those of instances do.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Samples;
use super::derivatives::ROUND_OFF;
use super::sample::values;
use super::verdict::{Check, Verdict};
use crate::descriptor::Default;
use crate::{Batch, Feedback, Kinetics, KineticsError, Quantity};

/// Sets of parameters besides the defaults.
const PARAMETER_SETS: usize = 8;

/// Evaluates with the parameters of a scene, or with sets from half to twice the defaults.
pub(super) fn check(kinetics: &dyn Kinetics, samples: &Samples, seed: u64) -> Check {
    if kinetics.descriptor().parameters.is_empty() {
        return Ok(Verdict::Skipped("there are none".into()));
    }
    let of_the_scene = samples.with(true, |batch| !batch.parameters.is_empty());
    let samples = match of_the_scene {
        true => samples.clone(),
        false => samples.clone().with_parameters(&sets(kinetics, seed), seed),
    };
    match samples.with(true, |batch| as_instances(kinetics, batch)) {
        Ok(true) => Ok(Verdict::Good(match of_the_scene {
            true => "as instances".into(),
            false => format!("as instances with {PARAMETER_SETS} sets of parameters"),
        })),
        Ok(false) => Ok(Verdict::Skipped("one instance for every run of equal values".into())),
        // The law says that these do not go together.
        Err(KineticsError::Failed { call: "create", message, .. })
            if !message.starts_with("panicked") =>
        {
            Ok(Verdict::Skipped(format!("the law refuses sets that were tried: {message}")))
        }
        Err(error) => Err(error),
    }
}

/// Whether the law takes parameters as columns.
///
/// # Errors
/// [`KineticsError::Fields`] if those of a batch of the rates do not do what those of instances do.
pub(super) fn as_instances(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
) -> Result<bool, KineticsError> {
    let Some(other) = kinetics.with_parameters_as_instances()? else { return Ok(false) };
    let law = kinetics.descriptor();
    let all = [Quantity::Rates, Feedback::LengthFactor.into()];
    for quantity in all.into_iter().filter(|quantity| quantity.is_given(law)) {
        let batch = &batch.inputs_of(quantity);
        let found = values(kinetics, quantity, batch)?;
        let expected = values(other.as_ref(), quantity, batch)?;
        for column in 0..quantity.outputs(law) {
            // Where terms cancel, little is left to compare.
            let (found, expected) = (found.column(column), expected.column(column));
            let most = expected.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let differ = |(a, b): (&f64, &f64)| (a - b).abs() > ROUND_OFF * most;
            if let Some(point) = found.iter().zip(expected).position(differ) {
                return Err(KineticsError::Fields {
                    plugin: law.name.clone(),
                    quantity: quantity.describe(law, false, column),
                    point,
                    found: found[point],
                    expected: expected[point],
                });
            }
        }
    }
    Ok(true)
}

/// Sets of parameters, as the columns of a field with one place a set.
fn sets(kinetics: &dyn Kinetics, seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for (parameter, default) in kinetics.descriptor().parameters.iter().zip(kinetics.parameters()) {
        let column = match parameter.default {
            Default::SameAs(other) => columns[other].clone(),
            Default::Value(_) => (0..PARAMETER_SETS)
                .map(|_| default * 2_f64.powf(random.random_range(-1.0..1.0)))
                .map(|value| if parameter.allows(value) { value } else { *default })
                .collect(),
        };
        columns.push(column);
    }
    columns
}
