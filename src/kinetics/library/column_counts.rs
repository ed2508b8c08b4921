//! Whether all columns of a call are there and long enough, so that pointers to them may be given away.

use crate::descriptor::Descriptor;
use crate::{Batch, KineticsError};

/// How many columns a call has of each kind, species apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnCounts {
    pub(super) signals: usize,
    pub(super) values: usize,
    pub(super) partials: usize,
}

impl ColumnCounts {
    /// Of the rates, with or without partial derivatives.
    pub(super) fn of_rates(descriptor: &Descriptor, partials: bool) -> Self {
        let (signals, values) = (descriptor.signal_columns(), descriptor.species.len());
        let partials = if partials { values * descriptor.inputs() } else { 0 };
        Self { signals, values, partials }
    }
}

/// Checks that the columns of a call are as many as `counts` says, and long enough.
///
/// # Errors
/// [`KineticsError::Shape`].
pub(super) fn check_columns(
    descriptor: &Descriptor,
    counts: ColumnCounts,
    batch: &Batch<'_>,
    values: &[&mut [f64]],
    partials: &[&mut [f64]],
) -> Result<(), KineticsError> {
    let check = |what: &'static str, expected: usize, found: usize| {
        if expected == found {
            return Ok(());
        }
        Err(KineticsError::Shape { plugin: descriptor.name.clone(), what, expected, found })
    };
    check("species columns", descriptor.species.len(), batch.species.len())?;
    check("signal columns", counts.signals, batch.signals.len())?;
    check("output columns", counts.values, values.len())?;
    check("derivative columns", counts.partials, partials.len())?;
    for column in batch.inputs().chain(batch.parameters) {
        let readable =
            if column.covers(batch.count) { batch.count } else { column.parts().0.len() };
        check("values of an input", batch.count, readable)?;
    }
    for column in values.iter().chain(partials) {
        check("values of an output", batch.count, column.len())?;
    }
    if !batch.parameters.is_empty() {
        check("parameter columns", descriptor.parameters.len(), batch.parameters.len())?;
    }
    Ok(())
}
