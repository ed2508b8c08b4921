//! Kinetics on a whole field: in parallel batches, and no bad number passes.
//!
//! Sizes of batches follow from the number of points, and errors are taken in the order of points,
//! so results and messages are the same for any number of threads.

use rayon::prelude::*;
use smallvec::SmallVec;

use super::batch::Batch;
use super::descriptor::{self, Descriptor, SignalRead};
use super::error::KineticsError;
use super::site::{BadValue, LENGTH_FACTOR, Site};
use super::{Feedback, Kinetics, Outcome};
use rumple_numerics::num::{all_finite, all_finite_from};

/// The most points in a batch. What a call costs by itself is as much as a cheap law at a hundred
/// points; this many values of a dozen columns still fit into the second-level cache.
const BATCH: usize = 4096;

/// Points in a batch of a field of `count` points: every thread gets some.
pub(super) fn batch_size(count: usize) -> usize {
    const LEAST: usize = 512;
    const BATCHES: usize = 8;
    count.div_ceil(BATCHES).clamp(LEAST, BATCH)
}

/// Columns of equal length, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    count: usize,
    data: Vec<f64>,
}

impl Columns {
    /// This many columns for this many points, all zero.
    #[must_use]
    pub fn new(columns: usize, count: usize) -> Self {
        Self { count, data: vec![0.0; columns * count] }
    }

    /// How many columns there are; none where there are no points.
    pub(super) fn width(&self) -> usize {
        self.data.len() / self.count.max(1)
    }

    /// One column.
    ///
    /// # Panics
    /// The column does not exist.
    #[must_use]
    #[inline]
    pub fn column(&self, column: usize) -> &[f64] {
        &self.data[column * self.count..(column + 1) * self.count]
    }

    /// All columns, to be written. Without points there are no columns to be seen.
    pub fn slices_mut(&mut self) -> Vec<&mut [f64]> {
        self.data.chunks_mut(self.count.max(1)).collect()
    }

    /// The values, one column after the other.
    #[must_use]
    pub fn into_inner(self) -> Vec<f64> {
        self.data
    }
}

/// The rate of each species: `rates[s][point]`.
///
/// # Errors
/// [`KineticsError::BadInput`], [`KineticsError::BadOutput`], [`KineticsError::Retry`],
/// [`KineticsError::Failed`], [`KineticsError::Shape`].
pub fn rates(kinetics: &dyn Kinetics, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
    evaluate(kinetics, Quantity::Rates, batch, rates, &mut [])
}

/// Rates and their partial derivatives; layout as in [`Kinetics::rate_partials`].
///
/// # Errors
/// As for [`rates`].
pub fn rate_partials(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    rates: &mut [&mut [f64]],
    partials: &mut [&mut [f64]],
) -> Outcome {
    evaluate(kinetics, Quantity::RatePartials, batch, rates, partials)
}

/// The length factor Φ > 0; the batch has no signals.
///
/// # Errors
/// As for [`rates`]; also [`KineticsError::BadOutput`] if Φ <= 0.
pub fn length_factor(kinetics: &dyn Kinetics, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
    evaluate(kinetics, Quantity::LengthFactor, batch, &mut [factor], &mut [])
}

/// The length factor and ∂Φ/∂c: `partials[s][point]`.
///
/// # Errors
/// As for [`length_factor`].
pub fn length_factor_partials(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    factor: &mut [f64],
    partials: &mut [&mut [f64]],
) -> Outcome {
    evaluate(kinetics, Quantity::LengthFactorPartials, batch, &mut [factor], partials)
}

/// A quantity of [`Feedback`]; the batch has no signals.
///
/// # Errors
/// As for [`rates`]; also [`KineticsError::BadOutput`] for a length factor <= 0.
pub fn feedback(
    kinetics: &dyn Kinetics,
    which: Feedback,
    batch: &Batch<'_>,
    values: &mut [f64],
) -> Outcome {
    evaluate(kinetics, Quantity::Feedback(which), batch, &mut [values], &mut [])
}

/// The same with its derivatives by the species: `partials[s][point]`.
///
/// # Errors
/// As for [`feedback`].
pub fn feedback_partials(
    kinetics: &dyn Kinetics,
    which: Feedback,
    batch: &Batch<'_>,
    values: &mut [f64],
    partials: &mut [&mut [f64]],
) -> Outcome {
    evaluate(kinetics, Quantity::FeedbackPartials(which), batch, &mut [values], partials)
}

/// The observables: `values[o][point]`.
///
/// # Errors
/// As for [`rates`].
pub fn observe(kinetics: &dyn Kinetics, batch: &Batch<'_>, values: &mut [&mut [f64]]) -> Outcome {
    evaluate(kinetics, Quantity::Observables, batch, values, &mut [])
}

#[derive(Clone, Copy)]
enum Quantity {
    Observables,
    Rates,
    RatePartials,
    LengthFactor,
    LengthFactorPartials,
    Feedback(Feedback),
    FeedbackPartials(Feedback),
}

impl Quantity {
    /// Whether signals are read.
    fn reads_signals(self) -> bool {
        matches!(self, Self::Rates | Self::RatePartials | Self::Observables)
    }

    /// The signals that are read.
    fn signals(self, descriptor: &Descriptor) -> &[SignalRead] {
        match self {
            Self::Rates | Self::RatePartials => &descriptor.signals,
            Self::Observables => &descriptor.observed,
            _ => &[],
        }
    }

    /// The name of the call.
    fn call(self) -> &'static str {
        match self {
            Self::Observables => "observe",
            Self::Rates => "rates",
            Self::RatePartials => "rate_partials",
            Self::LengthFactor => "length_factor",
            Self::LengthFactorPartials => "length_factor_partials",
            Self::Feedback(which) => which.name(),
            Self::FeedbackPartials(which) => which.partials_name(),
        }
    }

    /// The least value allowed.
    fn least(self) -> f64 {
        match self {
            Self::LengthFactor | Self::LengthFactorPartials => f64::MIN_POSITIVE,
            Self::Feedback(which) | Self::FeedbackPartials(which) => which.least(),
            _ => f64::MIN,
        }
    }

    /// Numbers of value columns and of partial columns.
    fn columns(self, kinetics: &dyn Kinetics) -> (usize, usize) {
        let descriptor = kinetics.descriptor();
        let species = descriptor.species.len();
        match self {
            Self::Observables => (descriptor.observables.len(), 0),
            Self::Rates => (species, 0),
            Self::RatePartials => (species, species * descriptor.inputs()),
            Self::LengthFactor | Self::Feedback(_) => (1, 0),
            Self::LengthFactorPartials | Self::FeedbackPartials(_) => (1, species),
        }
    }

    fn evaluate(
        self,
        kinetics: &dyn Kinetics,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        match (self, values) {
            (Self::Observables, values) => kinetics.observe(batch, values),
            (Self::Rates, rates) => kinetics.rates(batch, rates),
            (Self::RatePartials, rates) => kinetics.rate_partials(batch, rates, partials),
            (Self::LengthFactor, [factor]) => kinetics.length_factor(batch, factor),
            (Self::LengthFactorPartials, [factor]) => {
                kinetics.length_factor_partials(batch, factor, partials)
            }
            (Self::Feedback(which), [values]) => kinetics.feedback(which, batch, values),
            (Self::FeedbackPartials(which), [values]) => {
                kinetics.feedback_partials(which, batch, values, partials)
            }
            _ => Ok(None),
        }
    }

    /// What an output column is, in words.
    fn describe(self, kinetics: &dyn Kinetics, partial: Option<usize>, column: usize) -> String {
        let descriptor = kinetics.descriptor();
        let input = |at: usize| descriptor.input_names().nth(at).unwrap_or("?").to_owned();
        let rate = |at: usize| format!("the rate of species {}", input(at));
        let factor = match self {
            Self::Feedback(which) | Self::FeedbackPartials(which) => which.describe(),
            _ => LENGTH_FACTOR,
        };
        if let (Self::Observables, Some(known)) = (self, descriptor.observables.get(column)) {
            return format!("the observable {}", known.name);
        }
        match (self.reads_signals(), partial) {
            (true, None) => rate(column),
            (false, None) => factor.to_owned(),
            (true, Some(entry)) => {
                let width = descriptor.inputs();
                format!("the derivative by {} of {}", input(entry % width), rate(entry / width))
            }
            (false, Some(entry)) => format!("the derivative by {} of {factor}", input(entry)),
        }
    }
}

fn evaluate(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
    values: &mut [&mut [f64]],
    partials: &mut [&mut [f64]],
) -> Outcome {
    if batch.count == 0 {
        return Ok(None);
    }
    check_shapes(kinetics, quantity, batch, values, partials)?;
    let size = batch_size(batch.count);
    let call = |part: &Batch<'_>, values: &mut [&mut [f64]], partials: &mut [&mut [f64]]| {
        check_inputs(kinetics, quantity, part)?;
        let outcome = quantity.evaluate(kinetics, part, values, partials)?;
        check_outputs(kinetics, quantity, part, values, partials)?;
        Ok(outcome)
    };
    // Where points are few, to hand out batches would cost more than the law.
    if batch.count <= size {
        return call(batch, values, partials);
    }
    let outcomes: Vec<Outcome> = blocks(batch.count, values)
        .into_par_iter()
        .zip(blocks(batch.count, partials))
        .enumerate()
        .map(|(block, (mut values, mut partials))| {
            let start = block * size;
            let count = size.min(batch.count - start);
            batch.with_part(start, count, |part| call(part, &mut values, &mut partials))
        })
        .collect();
    outcomes.into_iter().try_fold(None, |first, outcome| Ok(first.or(outcome?)))
}

/// The columns cut into blocks of [`batch_size`] points: `blocks[b][column]`.
fn blocks<'a>(count: usize, columns: &'a mut [&mut [f64]]) -> Vec<SmallVec<[&'a mut [f64]; 4]>> {
    let mut blocks = Vec::new();
    let size = batch_size(count);
    blocks.resize_with(count.div_ceil(size), SmallVec::new);
    for column in columns {
        for (block, part) in blocks.iter_mut().zip(column.chunks_mut(size)) {
            block.push(part);
        }
    }
    blocks
}

fn check_shapes(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
    values: &[&mut [f64]],
    partials: &[&mut [f64]],
) -> Result<(), KineticsError> {
    let descriptor = kinetics.descriptor();
    let check = |what, expected, found| {
        if expected == found {
            return Ok(());
        }
        let plugin = descriptor.name.clone();
        Err(KineticsError::Shape { plugin, what, expected, found })
    };
    let (value_columns, partial_columns) = quantity.columns(kinetics);
    let signals = descriptor::columns(quantity.signals(descriptor)).count();
    check("species columns", descriptor.species.len(), batch.species.len())?;
    check("signal columns", signals, batch.signals.len())?;
    if !batch.parameters.is_empty() {
        check("parameter columns", descriptor.parameters.len(), batch.parameters.len())?;
    }
    check("value columns", value_columns, values.len())?;
    check("derivative columns", partial_columns, partials.len())?;
    for column in batch.inputs().chain(batch.parameters) {
        let found = if column.covers(batch.count) { batch.count } else { column.parts().0.len() };
        check("values of an input", batch.count, found)?;
    }
    for column in values.iter().chain(partials) {
        check("values of an output", batch.count, column.len())?;
    }
    Ok(())
}

fn check_inputs(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
) -> Result<(), KineticsError> {
    if batch.inputs().all(|column| column.is_finite(batch.count)) {
        return Ok(());
    }
    for point in 0..batch.count {
        if let Some((input, column)) =
            batch.inputs().enumerate().find(|(_, column)| !column.at(point).is_finite())
        {
            let descriptor = kinetics.descriptor();
            let mut names = descriptor.names_with(quantity.signals(descriptor));
            return Err(KineticsError::BadInput {
                input: names.nth(input).unwrap_or("?").to_owned(),
                value: column.at(point),
                location: batch.location.noun(),
                point: batch.first + point,
            });
        }
    }
    Ok(())
}

/// Blames the first bad point, and at it values before derivatives.
fn check_outputs(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
    values: &[&mut [f64]],
    partials: &[&mut [f64]],
) -> Result<(), KineticsError> {
    let least = quantity.least();
    if all_within(values, least) && all_within(partials, f64::MIN) {
        return Ok(());
    }
    let first = |columns: &[&mut [f64]], least: f64| {
        columns
            .iter()
            .enumerate()
            .filter_map(|(at, column)| {
                let point = column.iter().position(|value| !(least..=f64::MAX).contains(value))?;
                Some((point, at, column[point]))
            })
            .min_by_key(|(point, at, _)| (*point, *at))
    };
    let value = first(values, least).map(|(point, at, value)| (point, None, at, value));
    let partial = first(partials, f64::MIN).map(|(point, at, value)| (point, Some(at), at, value));
    let Some((point, partial, column, value)) =
        value.into_iter().chain(partial).min_by_key(|(point, partial, ..)| (*point, *partial))
    else {
        return Ok(());
    };
    let descriptor = kinetics.descriptor();
    Err(KineticsError::BadOutput(Box::new(BadValue {
        law: match quantity {
            Quantity::Observables | Quantity::Feedback(_) | Quantity::FeedbackPartials(_) => {
                descriptor.title()
            }
            _ => kinetics.offender(quantity.reads_signals(), batch),
        },
        call: quantity.call(),
        quantity: quantity.describe(kinetics, partial, column),
        value,
        site: Site::of(batch, descriptor, quantity.signals(descriptor), point),
    })))
}

/// Whether no value is less than `least`, infinite or NaN.
fn all_within(columns: &[&mut [f64]], least: f64) -> bool {
    match least {
        f64::MIN => columns.iter().all(|column| all_finite(column)),
        _ => columns.iter().all(|column| all_finite_from(column, least)),
    }
}
