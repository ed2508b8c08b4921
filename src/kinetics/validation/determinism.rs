//! Whether results depend on anything but inputs: on calls before, on neighbours, on threads.

use std::thread;

use super::sample::rates;
use crate::field::{Columns, batch_size};
use crate::{Batch, Kinetics, KineticsError, Quantity};

/// How many threads call at once, and how often each.
const THREADS: usize = 8;
const CALLS_PER_THREAD: usize = 40;

/// Evaluates twice by all threads and once by this one alone.
pub(super) fn same_twice(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<(), KineticsError> {
    let first = rates(kinetics, batch)?;
    let again = rates(kinetics, batch)?;
    compare(kinetics, batch, &first, &again, 0, "one call after the other")?;
    let alone = alone(kinetics, batch)?;
    compare(kinetics, batch, &first, &alone, 0, "by several threads, and by one")
}

/// All batches by this thread.
fn alone(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<Columns, KineticsError> {
    let mut all = Columns::new(kinetics.descriptor().species.len(), batch.count);
    let size = batch_size(batch.count);
    for start in (0..batch.count).step_by(size) {
        let count = size.min(batch.count - start);
        let mut columns = all.slices_mut();
        let mut part: Vec<&mut [f64]> =
            columns.iter_mut().map(|column| &mut column[start..start + count]).collect();
        batch.with_part(start, count, |b| {
            kinetics.evaluate(Quantity::Rates, b, &mut part, &mut [])
        })?;
    }
    Ok(all)
}

/// Every point in a call of its own, the last one first.
pub(super) fn one_by_one(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<(), KineticsError> {
    let together = alone(kinetics, batch)?;
    let mut single = Columns::new(kinetics.descriptor().species.len(), batch.count);
    for point in (0..batch.count).rev() {
        let mut columns = single.slices_mut();
        let mut part: Vec<&mut [f64]> =
            columns.iter_mut().map(|column| &mut column[point..=point]).collect();
        batch.with_part(point, 1, |b| kinetics.evaluate(Quantity::Rates, b, &mut part, &mut []))?;
    }
    compare(kinetics, batch, &together, &single, 0, "in a batch, and on its own")
}

/// Several threads, each at points of its own, over and over.
pub(super) fn threads(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<(), KineticsError> {
    let expected = alone(kinetics, batch)?;
    let share = batch.count.div_ceil(THREADS).max(1);
    let work = |start: usize| -> Result<(), KineticsError> {
        let count = share.min(batch.count - start);
        for _ in 0..CALLS_PER_THREAD {
            let mut found = Columns::new(kinetics.descriptor().species.len(), count);
            batch.with_part(start, count, |b| {
                kinetics.evaluate(Quantity::Rates, b, &mut found.slices_mut(), &mut [])?;
                let how = "called from one thread, and from several at once";
                compare(kinetics, b, &expected, &found, start, how)
            })?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let handles: Vec<_> =
            (0..batch.count).step_by(share).map(|start| scope.spawn(move || work(start))).collect();
        handles.into_iter().try_for_each(|handle| match handle.join() {
            Ok(outcome) => outcome,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })
}

/// Whether the values `found` at the points of `batch` are those `expected`, which begin `offset`
/// points earlier.
fn compare(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    expected: &Columns,
    found: &Columns,
    offset: usize,
    how: &'static str,
) -> Result<(), KineticsError> {
    for (s, species) in kinetics.descriptor().species.iter().enumerate() {
        let expected = &expected.column(s)[offset..offset + batch.count];
        let pairs = expected.iter().zip(found.column(s));
        if let Some((point, (first, second))) =
            pairs.enumerate().find(|(_, (a, b))| a.to_bits() != b.to_bits())
        {
            return Err(KineticsError::Unsteady {
                plugin: kinetics.descriptor().name.clone(),
                call: "rates",
                quantity: format!("the rate of species {}", species.name).into(),
                location: batch.location.noun(),
                point: batch.first + point,
                first: *first,
                second: *second,
                how,
            });
        }
    }
    Ok(())
}
