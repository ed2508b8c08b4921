//! Whether a law keeps its promises: finite, pure, with the right derivatives, from any thread.
//!
//! [`trial`] inspects the state that a run starts from and costs a few evaluations; [`validate`]
//! looks everywhere in the declared ranges.

mod derivatives;
mod determinism;
mod output_coverage;
mod sample;
mod validate;
mod verdict;

pub use sample::Samples;
pub use validate::{Finding, validate};
pub use verdict::Verdict;

use super::{Batch, Kinetics, KineticsError, Quantity};

/// Points at which a trial compares derivatives with differences.
const TRIAL_POINTS: usize = 64;

/// Inspects a law at given inputs: whether it gives the same result twice and from several threads,
/// whether it writes what it must, and whether its derivatives are those of its rates. What a run can live with is returned as a note.
///
/// # Errors
/// What the law reports, and [`KineticsError::Unsteady`] if results differ.
pub fn trial(kinetics: &dyn Kinetics, batch: &Batch<'_>) -> Result<Vec<String>, KineticsError> {
    determinism::same_twice(kinetics, batch)?;
    let mut notes = Vec::new();
    if batch.count > 0 {
        let every = batch.count.div_ceil(TRIAL_POINTS);
        let picked: Vec<usize> = (0..batch.count).step_by(every).collect();
        let columns = |columns: &[super::Column<'_>]| -> Vec<Vec<f64>> {
            columns.iter().map(|c| picked.iter().map(|p| c.at(*p)).collect()).collect()
        };
        let [species, signals, parameters] =
            [batch.species, batch.signals, batch.parameters].map(columns);
        let [species, signals, parameters] = [&species, &signals, &parameters]
            .map(|all| all.iter().map(Into::into).collect::<Vec<super::Column<'_>>>());
        let part = Batch {
            count: picked.len(),
            first: 0,
            species: &species,
            signals: &signals,
            parameters: &parameters,
            ..*batch
        };
        let number = |error| match error {
            KineticsError::Unwritten { law, call, output, columns, location, point } => {
                let point = batch.first + picked[point];
                KineticsError::Unwritten { law, call, output, columns, location, point }
            }
            other => other,
        };
        output_coverage::check(kinetics, &part).map_err(number)?;
        let law = kinetics.descriptor();
        let mut wrong = Vec::new();
        for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.has_partials(law)) {
            wrong
                .extend(derivatives::compare(kinetics, quantity, &part.inputs_of(quantity))?.wrong);
        }
        notes.extend(wrong.iter().map(|wrong| {
            let point = batch.first + picked[wrong.point];
            let text = wrong.describe(kinetics, &part, point);
            format!("{text}; implicit methods will be slow or fail")
        }));
    }
    Ok(notes)
}
