//! Whether a law writes all of its outputs, and nothing beside them.

use crate::batch::UNWRITTEN_BITS;
use crate::{Batch, Kinetics, KineticsError, Quantity};

/// Numbers around every output that must stay as they are.
const GUARD_NUMBERS: usize = 64;

/// Evaluates everything but the observables; the batch is one of the rates.
pub(super) fn check(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<(), KineticsError> {
    let law = kinetics.descriptor();
    let given = |quantity: &Quantity| quantity.is_given(law) && *quantity != Quantity::Observables;
    for quantity in Quantity::ALL.into_iter().filter(given) {
        let batch = &batch.inputs_of(quantity);
        check_quantity(kinetics, quantity, batch, false)?;
        if quantity.has_partials(law) {
            check_quantity(kinetics, quantity, batch, true)?;
        }
    }
    Ok(())
}

/// Evaluates a quantity, with partial derivatives or without.
pub(super) fn check_quantity(
    kinetics: &dyn Kinetics,
    quantity: Quantity,
    batch: &Batch<'_>,
    partials: bool,
) -> Result<(), KineticsError> {
    let (law, call) = (kinetics.descriptor(), quantity.call(partials));
    let outputs = quantity.outputs(law);
    let columns = outputs * if partials { 1 + quantity.inputs(law) } else { 1 };
    let length = batch.count + 2 * GUARD_NUMBERS;
    let inside = GUARD_NUMBERS..GUARD_NUMBERS + batch.count;
    let mut room = vec![f64::from_bits(UNWRITTEN_BITS); columns * length];
    let mut out: Vec<&mut [f64]> =
        room.chunks_mut(length).map(|column| &mut column[inside.clone()]).collect();
    let (values, slopes) = out.split_at_mut(outputs);
    kinetics.evaluate(quantity, batch, values, slopes)?;
    let untouched = |value: &f64| value.to_bits() == UNWRITTEN_BITS;
    for (number, column) in room.chunks(length).enumerate() {
        let law = kinetics.descriptor().title();
        if !column[..inside.start].iter().chain(&column[inside.end..]).all(untouched) {
            let (output, points) = (number + 1, batch.count);
            return Err(KineticsError::WritesBeyond { law, call, output, points });
        }
        if let Some(point) = column[inside.clone()].iter().position(untouched) {
            let (location, point) = (batch.location.noun(), batch.first + point);
            let output = number + 1;
            return Err(KineticsError::Unwritten { law, call, output, columns, location, point });
        }
    }
    Ok(())
}
