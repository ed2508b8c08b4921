//! Checks of a law with other parameters than its defaults.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::validate::{Check, Make, Verdict};
use super::{Samples, rates};
use crate::kinetics::descriptor::Default;
use crate::kinetics::field::{self, Columns};
use crate::kinetics::{Batch, Column, Descriptor, Kinetics, KineticsError};

/// Sets of parameters besides the defaults.
const SETS: usize = 8;
/// Two ways to the same number may differ by this share of it.
const ROUND_OFF: f64 = 1e-9;

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
    for _ in 0..SETS {
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
    Ok(Verdict::Good(format!("{SETS} sets from half to twice the defaults{note}")))
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
        return Ok(Verdict::Skipped("by an instance for every stretch of equal values".into()));
    }
    let Some(make) = make else { return Ok(Verdict::Skipped("the scene gives them".into())) };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut laws = Vec::new();
    for _ in 0..SETS {
        let set = parameters(descriptor, kinetics.parameters(), &mut random);
        laws.extend(made(make, &set)?);
    }
    if laws.is_empty() {
        return Ok(Verdict::Skipped("the law refuses all sets that were tried".into()));
    }
    samples.with(true, |batch| {
        let all = |law: &dyn Kinetics, batch: &Batch<'_>| rates(law, batch);
        let quantity = |s: usize| format!("the rate of {}", descriptor.species[s].name);
        compare(kinetics, &laws, batch, descriptor.species.len(), &all, &quantity)
    })?;
    if descriptor.capabilities.length_factor {
        samples.with(false, |batch| {
            let all = |law: &dyn Kinetics, batch: &Batch<'_>| {
                let mut factor = Columns::new(1, batch.count);
                field::length_factor(law, batch, factor.slices_mut()[0]).map(|_| factor)
            };
            compare(kinetics, &laws, batch, 1, &all, &|_| "the length factor".to_owned())
        })?;
    }
    Ok(Verdict::Good(format!("as instances with {} sets of parameters", laws.len())))
}

type Evaluate<'a> = dyn Fn(&dyn Kinetics, &Batch<'_>) -> Result<Columns, KineticsError> + 'a;

/// Point k with the parameters of law k, in turn: once all in one call, once each by its own law.
fn compare(
    kinetics: &dyn Kinetics,
    laws: &[Box<dyn Kinetics>],
    batch: &Batch<'_>,
    outputs: usize,
    evaluate: &Evaluate<'_>,
    quantity: &dyn Fn(usize) -> String,
) -> Result<(), KineticsError> {
    let of = |point: usize| laws[point % laws.len()].as_ref();
    let columns: Vec<Vec<f64>> = (0..kinetics.descriptor().parameters.len())
        .map(|p| (0..batch.count).map(|point| of(point).parameters()[p]).collect())
        .collect();
    let columns: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
    let found = evaluate(kinetics, &Batch { parameters: &columns, ..*batch })?;
    let expected =
        laws.iter().map(|law| evaluate(law.as_ref(), batch)).collect::<Result<Vec<_>, _>>()?;
    for column in 0..outputs {
        for point in 0..batch.count {
            let one = found.column(column)[point];
            let other = expected[point % laws.len()].column(column)[point];
            if (one - other).abs() > ROUND_OFF * one.abs().max(other.abs()) {
                return Err(KineticsError::Fields {
                    plugin: kinetics.descriptor().name.clone(),
                    quantity: quantity(column),
                    point,
                    found: one,
                    expected: other,
                });
            }
        }
    }
    Ok(())
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
