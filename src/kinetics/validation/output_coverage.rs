//! Whether a law writes all of its outputs, and nothing beside them.

use crate::batch::UNTOUCHED;
use crate::{Batch, Feedback, Kinetics, KineticsError, Outcome};

/// Numbers around every output that must stay as they are.
const MARGIN: usize = 64;

/// Calls everything but the observables; the batch is one of the rates.
pub(super) fn check(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<(), KineticsError> {
    let d = kinetics.descriptor();
    let (species, inputs) = (d.species.len(), d.inputs());
    let still = &Batch { signals: &[], ..*batch };
    look(kinetics, "rates", batch, species, |out| kinetics.rates(batch, out))?;
    if d.capabilities.rate_partials {
        look(kinetics, "rate_partials", batch, species * (1 + inputs), |out| {
            let (values, partials) = out.split_at_mut(species);
            kinetics.rate_partials(batch, values, partials)
        })?;
    }
    if d.capabilities.length_factor {
        look(kinetics, "length_factor", still, 1, |out| kinetics.length_factor(still, out[0]))?;
    }
    if d.capabilities.length_factor_partials {
        look(kinetics, "length_factor_partials", still, 1 + species, |out| {
            let (values, partials) = out.split_at_mut(1);
            kinetics.length_factor_partials(still, values[0], partials)
        })?;
    }
    for which in Feedback::ALL.into_iter().filter(|which| which.is_given(&d.capabilities)) {
        let (call, with_partials) = (which.name(), which.partials_name());
        look(kinetics, call, still, 1, |out| kinetics.feedback(which, still, out[0]))?;
        look(kinetics, with_partials, still, 1 + species, |out| {
            let (values, partials) = out.split_at_mut(1);
            kinetics.feedback_partials(which, still, values[0], partials)
        })?;
    }
    Ok(())
}

/// Calls the observables, if there are any; the batch is one of theirs.
pub(super) fn check_observables(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
) -> Result<(), KineticsError> {
    let count = kinetics.descriptor().observables.len();
    look(kinetics, "observe", batch, count, |out| kinetics.observe(batch, out))
}

fn look(
    kinetics: &dyn Kinetics,
    call: &'static str,
    batch: &Batch<'_>,
    columns: usize,
    evaluate: impl FnOnce(&mut [&mut [f64]]) -> Outcome,
) -> Result<(), KineticsError> {
    let length = batch.count + 2 * MARGIN;
    let inside = MARGIN..MARGIN + batch.count;
    let mut room = vec![f64::from_bits(UNTOUCHED); columns * length];
    let mut out: Vec<&mut [f64]> =
        room.chunks_mut(length).map(|column| &mut column[inside.clone()]).collect();
    evaluate(&mut out)?;
    let untouched = |value: &f64| value.to_bits() == UNTOUCHED;
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
