//! Kinetics on a whole field: in parallel batches, and no bad number passes.
//!
//! Sizes of batches follow from the number of points, and errors are taken in the order of points,
//! so results and messages are the same for any number of threads.

use rayon::prelude::*;
use smallvec::SmallVec;

use super::batch::Batch;
use super::error::KineticsError;
use super::site::{BadValue, Site};
use super::{Kinetics, Outcome, Quantity};
use rumple_numerics::num::{all_finite, all_finite_from};

/// The most points in a batch. What a call costs by itself is as much as a cheap law at a hundred
/// points; this many values of a dozen columns still fit into the second-level cache.
const MAX_BATCH: usize = 4096;

/// Points in a batch of a field of `count` points: every thread gets some.
pub(super) fn batch_size(count: usize) -> usize {
    const MIN_BATCH: usize = 512;
    const BATCHES: usize = 8;
    count.div_ceil(BATCHES).clamp(MIN_BATCH, MAX_BATCH)
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

/// A quantity of a law at every point of a batch, with its partial derivatives unless `partials` is empty; shapes as for
/// [`Kinetics::evaluate`].
///
/// # Errors
/// [`KineticsError::BadInput`], [`KineticsError::BadOutput`] also for a length factor <= 0,
/// [`KineticsError::Retry`], [`KineticsError::Failed`], [`KineticsError::Shape`].
pub fn evaluate(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
    values: &mut [&mut [f64]],
    partials: &mut [&mut [f64]],
) -> Outcome {
    if batch.count == 0 {
        return Ok(None);
    }
    quantity.check_shapes(kinetics.descriptor(), batch, values, partials)?;
    let size = batch_size(batch.count);
    let call = |part: &Batch<'_>, values: &mut [&mut [f64]], partials: &mut [&mut [f64]]| {
        check_inputs(kinetics, quantity, part)?;
        let outcome = kinetics.evaluate(quantity, part, values, partials)?;
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
    let value = first(values, least).map(|(point, at, value)| (point, false, at, value));
    let partial = first(partials, f64::MIN).map(|(point, at, value)| (point, true, at, value));
    let Some((point, of_partials, column, value)) = value
        .into_iter()
        .chain(partial)
        .min_by_key(|(point, of_partials, ..)| (*point, *of_partials))
    else {
        return Ok(());
    };
    let descriptor = kinetics.descriptor();
    Err(KineticsError::BadOutput(Box::new(BadValue {
        law: kinetics.blamed_law(quantity, batch),
        call: quantity.call(!partials.is_empty()),
        quantity: quantity.describe(descriptor, of_partials, column),
        value,
        site: Site::new(batch, descriptor, quantity.signals(descriptor), point),
    })))
}

/// Whether no value is less than `least`, infinite or NaN.
fn all_within(columns: &[&mut [f64]], least: f64) -> bool {
    match least {
        f64::MIN => columns.iter().all(|column| all_finite(column)),
        _ => columns.iter().all(|column| all_finite_from(column, least)),
    }
}
