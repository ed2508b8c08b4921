//! Rates, feedback and observables of all laws at the points of a batch.

use super::{JointKinetics, Part};
use crate::batch::{Batch, Column};
use crate::breakpoints::TimeDependence;
use crate::descriptor::Descriptor;
use crate::field::Columns;
use crate::{Feedback, Kinetics, Outcome, Quantity};
use rumple_numerics::num::all_finite_from;

impl Part {
    pub(super) fn gives(&self, quantity: impl Into<Quantity>) -> bool {
        quantity.into().is_given(self.kinetics.descriptor())
    }

    /// Hands this law's view of the inputs of a quantity to `evaluate`.
    fn with_inputs<R>(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        evaluate: impl FnOnce(&Batch<'_>) -> R,
    ) -> R {
        let signals = match quantity {
            Quantity::Observables => &self.observed,
            Quantity::Rates | Quantity::Feedback(_) => &self.signals,
        };
        let species = take(&self.species, batch.species);
        let signals = take(signals, batch.signals);
        let parameters = batch.parameters.get(self.parameters.clone()).unwrap_or(&[]);
        evaluate(&Batch { species: &species, signals: &signals, parameters, ..*batch })
    }

    /// R += R^k, with the derivatives; `all` laws have these numbers of species and inputs.
    fn add_rates(
        &self,
        (species, width): (usize, usize),
        (rates, partials): (&mut [&mut [f64]], &mut [&mut [f64]]),
        (own, slopes): (&Columns, &Columns),
    ) {
        let signals = self.signals.iter().map(|column| species + column);
        let columns: Vec<usize> = self.species.iter().copied().chain(signals).collect();
        for (row, &species) in self.species.iter().enumerate() {
            add(rates[species], own.column(row));
            if partials.is_empty() {
                continue;
            }
            for (input, &column) in columns.iter().enumerate() {
                let slope = slopes.column(row * columns.len() + input);
                add(partials[species * width + column], slope);
            }
        }
    }

    /// Joins feedback with that of the laws before; (Φ Ψ)' = Φ' Ψ + Φ Ψ' for factors.
    fn join(
        &self,
        which: Feedback,
        (values, partials): (&mut [f64], &mut [&mut [f64]]),
        (own, slopes): (&[f64], &Columns),
    ) {
        let joined = |values: &[f64], point: usize| which.joined(values[point], own[point]);
        for column in partials.iter_mut() {
            let each = column.iter_mut().enumerate();
            each.for_each(|(point, slope)| *slope *= joined(values, point).1[0]);
        }
        let rows = if partials.is_empty() { &[][..] } else { &self.species };
        for (row, &species) in rows.iter().enumerate() {
            let each = partials[species].iter_mut().zip(slopes.column(row)).enumerate();
            each.for_each(|(point, (slope, own))| *slope += joined(values, point).1[1] * own);
        }
        (0..values.len()).for_each(|point| values[point] = joined(values, point).0);
    }
}

/// The columns of these numbers.
fn take<'a>(numbers: &[usize], columns: &[Column<'a>]) -> Vec<Column<'a>> {
    numbers.iter().filter_map(|number| columns.get(*number).copied()).collect()
}

fn add(to: &mut [f64], values: &[f64]) {
    to.iter_mut().zip(values).for_each(|(to, value)| *to += value);
}

impl Kinetics for JointKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        quantity.write_neutral(values, partials);
        let all = (self.descriptor.species.len(), self.descriptor.inputs());
        let mut warning = None;
        for part in self.members.iter().filter(|part| part.gives(quantity)) {
            let law = part.kinetics.descriptor();
            if quantity == Quantity::Observables {
                let own = &mut values[part.observables.clone()];
                let outcome = part.with_inputs(quantity, batch, |b| {
                    part.kinetics.evaluate(quantity, b, own, &mut [])
                })?;
                warning = warning.or(outcome);
                continue;
            }
            let (outputs, inputs) = (quantity.outputs(law), quantity.inputs(law));
            let entries = if partials.is_empty() { 0 } else { outputs * inputs };
            let mut own = Columns::new(outputs, batch.count);
            let mut slopes = Columns::new(entries, batch.count);
            let outcome = part.with_inputs(quantity, batch, |b| {
                let (own, slopes) = (&mut own.slices_mut(), &mut slopes.slices_mut());
                part.kinetics.evaluate(quantity, b, own, slopes)
            })?;
            warning = warning.or(outcome);
            match quantity {
                Quantity::Feedback(which) => {
                    part.join(which, (values[0], partials), (own.column(0), &slopes));
                }
                _ => part.add_rates(all, (values, partials), (&own, &slopes)),
            }
        }
        Ok(warning)
    }

    fn set_typical(&self, typical: &[f64]) {
        for part in &self.members {
            let own: Vec<f64> = part.species.iter().map(|species| typical[*species]).collect();
            part.kinetics.set_typical(&own);
        }
    }

    fn time_dependence(&self, batch: &Batch<'_>, until: f64, found: &mut TimeDependence) -> bool {
        let of = |part: &Part| {
            part.with_inputs(Quantity::Rates, batch, |b| {
                part.kinetics.time_dependence(b, until, found)
            })
        };
        let known: Vec<bool> = self.members.iter().map(of).collect();
        !known.contains(&false)
    }

    fn blamed_law(&self, quantity: Quantity, batch: &Batch<'_>) -> String {
        let bad = |part: &&Part| {
            part.with_inputs(quantity, batch, |b| {
                let outputs = quantity.outputs(part.kinetics.descriptor());
                let mut own = Columns::new(outputs, b.count);
                let columns = &mut own.slices_mut();
                let outcome = part.kinetics.evaluate(quantity, b, columns, &mut []);
                let least = quantity.least();
                outcome.is_err() || columns.iter().any(|column| !all_finite_from(column, least))
            })
        };
        let mut givers = self.members.iter().filter(|part| part.gives(quantity));
        let found = givers.find(bad).map(|part| part.kinetics.descriptor());
        found.unwrap_or(&self.descriptor).title()
    }
}
