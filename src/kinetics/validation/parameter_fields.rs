//! Whether parameters that differ from point to point do what those of instances do.

use super::Samples;
use super::derivatives::ROUND_OFF;
use super::sample::values;
use super::verdict::{Check, Verdict};
use crate::{Batch, Feedback, Kinetics, KineticsError, Quantity};

/// Evaluates with the parameters of a scene.
pub(super) fn check(kinetics: &dyn Kinetics, samples: &Samples) -> Check {
    if samples.with(true, |batch| batch.parameters.is_empty()) {
        return Ok(Verdict::Skipped("no scene gives some".into()));
    }
    Ok(match samples.with(true, |batch| as_instances(kinetics, batch))? {
        true => Verdict::Good("as instances".into()),
        false => Verdict::Skipped("one instance for every run of equal values".into()),
    })
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
