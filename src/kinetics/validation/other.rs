//! Checks of a law with other parameters than its defaults.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::derivatives::ROUND_OFF;
use super::validate::{Check, Make, Verdict};
use super::{Samples, rates, values};
use crate::descriptor::Default;
use crate::{Batch, Column, Descriptor, Feedback, Kinetics, KineticsError, Quantity};

/// Sets of parameters besides the defaults.
const PARAMETER_SETS: usize = 8;

/// Rates with parameters around their defaults.
pub(super) fn uniform(
    kinetics: &dyn Kinetics,
    make: Option<&Make<'_>>,
    samples: &Samples,
    seed: u64,
) -> Check {
    let descriptor = kinetics.descriptor();
    if descriptor.parameters.is_empty() {
        return Ok(Verdict::Skipped("there are none".into()));
    }
    let Some(make) = make else { return Ok(Verdict::Skipped("the scene gives them".into())) };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut refused = 0;
    for _ in 0..PARAMETER_SETS {
        let set = parameters(descriptor, kinetics.parameters(), &mut random);
        let text: Vec<String> =
            set.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let Some(law) = made(make, &set)? else {
            refused += 1;
            continue;
        };
        let outcome = samples.with(true, |batch| rates(law.as_ref(), batch));
        if let Err(error) = outcome {
            return Ok(Verdict::Fault(format!("{error}; with {}", text.join(", "))));
        }
    }
    let note = if refused == 0 { String::new() } else { format!(", {refused} of them refused") };
    Ok(Verdict::Good(format!("{PARAMETER_SETS} sets from half to twice the defaults{note}")))
}

/// The law with these parameters; `None` if it says that they do not go together.
fn made(
    make: &Make<'_>,
    set: &BTreeMap<String, f64>,
) -> Result<Option<Box<dyn Kinetics>>, KineticsError> {
    match make(set) {
        Ok(law) => Ok(Some(law)),
        Err(KineticsError::Failed { message, .. }) if !message.starts_with("panicked") => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether parameters that differ from point to point do what those of instances do.
pub(super) fn over_the_sheet(
    kinetics: &dyn Kinetics,
    make: Option<&Make<'_>>,
    samples: &Samples,
    seed: u64,
) -> Check {
    let descriptor = kinetics.descriptor();
    if descriptor.parameters.is_empty() {
        return Ok(Verdict::Skipped("there are none".into()));
    }
    if !descriptor.capabilities.parameter_fields {
        return Ok(Verdict::Skipped("one instance for every run of equal values".into()));
    }
    let Some(make) = make else { return given_by_a_scene(kinetics, samples) };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut laws = Vec::new();
    for _ in 0..PARAMETER_SETS {
        let set = parameters(descriptor, kinetics.parameters(), &mut random);
        laws.extend(made(make, &set)?);
    }
    if laws.is_empty() {
        return Ok(Verdict::Skipped("the law refuses all sets that were tried".into()));
    }
    for quantity in compared(descriptor) {
        let compare = |batch: &Batch<'_>| compare(kinetics, &laws, batch, quantity);
        samples.with(quantity == Quantity::Rates, compare)?;
    }
    Ok(Verdict::Good(format!("as instances with {} sets of parameters", laws.len())))
}

fn given_by_a_scene(kinetics: &dyn Kinetics, samples: &Samples) -> Check {
    if samples.with(true, |batch| batch.parameters.is_empty()) {
        return Ok(Verdict::Skipped("the scene has none".into()));
    }
    samples.with(true, |batch| as_instances(kinetics, batch))?;
    Ok(Verdict::Good("as instances".into()))
}

/// Whether the parameters of a batch of the rates do what those of instances do.
pub(super) fn as_instances(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
) -> Result<(), KineticsError> {
    let Some(other) = kinetics.with_parameters_as_instances()? else { return Ok(()) };
    for quantity in compared(kinetics.descriptor()) {
        let batch = &batch.of(quantity);
        let found = values(kinetics, quantity, batch)?;
        let expected = values(other.as_ref(), quantity, batch)?;
        let at = |k: usize, point: usize| (found.column(k)[point], expected.column(k)[point]);
        differ(kinetics, batch, quantity, &at)?;
    }
    Ok(())
}

/// What is compared: the rates, and the length factor if a law gives it.
fn compared(law: &Descriptor) -> impl Iterator<Item = Quantity> {
    let all = [Quantity::Rates, Feedback::LengthFactor.into()];
    all.into_iter().filter(|quantity| quantity.is_given(law))
}

/// Refuses numbers, found and expected `at` output and point, that are not the same but for round-off.
fn differ(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    quantity: Quantity,
    at: &dyn Fn(usize, usize) -> (f64, f64),
) -> Result<(), KineticsError> {
    for column in 0..quantity.outputs(kinetics.descriptor()) {
        // Where terms cancel, little is left to compare.
        let most =
            (0..batch.count).fold(0.0_f64, |most, point| most.max(at(column, point).1.abs()));
        for point in 0..batch.count {
            let (found, expected) = at(column, point);
            if (found - expected).abs() > ROUND_OFF * most {
                return Err(KineticsError::Fields {
                    plugin: kinetics.descriptor().name.clone(),
                    quantity: quantity.describe(kinetics.descriptor(), false, column),
                    point,
                    found,
                    expected,
                });
            }
        }
    }
    Ok(())
}

/// Point k with the parameters of law k, in turn: once all in one call, once each by its own law.
fn compare(
    kinetics: &dyn Kinetics,
    laws: &[Box<dyn Kinetics>],
    batch: &Batch<'_>,
    quantity: Quantity,
) -> Result<(), KineticsError> {
    let of = |point: usize| laws[point % laws.len()].as_ref();
    let columns: Vec<Vec<f64>> = (0..kinetics.descriptor().parameters.len())
        .map(|p| (0..batch.count).map(|point| of(point).parameters()[p]).collect())
        .collect();
    let columns: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
    let found = values(kinetics, quantity, &Batch { parameters: &columns, ..*batch })?;
    let expected = laws
        .iter()
        .map(|law| values(law.as_ref(), quantity, batch))
        .collect::<Result<Vec<_>, _>>()?;
    let at = |column: usize, point: usize| {
        let expected = expected[point % laws.len()].column(column)[point];
        (found.column(column)[point], expected)
    };
    differ(kinetics, batch, quantity, &at)
}

fn parameters(
    descriptor: &Descriptor,
    defaults: &[f64],
    random: &mut ChaCha8Rng,
) -> BTreeMap<String, f64> {
    let mut set = BTreeMap::new();
    for (parameter, default) in descriptor.parameters.iter().zip(defaults) {
        if matches!(parameter.default, Default::SameAs(_)) {
            continue;
        }
        let value = default * 2_f64.powf(random.random_range(-1.0..1.0));
        let value = if parameter.allows(value) { value } else { *default };
        set.insert(parameter.name.clone(), value);
    }
    set
}
