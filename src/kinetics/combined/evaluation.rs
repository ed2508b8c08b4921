//! Rates, feedback and observables of all laws at the points of a batch.

use std::sync::Arc;

use super::{JointKinetics, Part};
use crate::batch::{Batch, Column};
use crate::descriptor::Descriptor;
use crate::field::Columns;
use crate::{Feedback, Kinetics, KineticsError, Outcome};
use rumple_numerics::num::all_finite_from;

impl Part {
    /// Hands this law's view of the inputs to `evaluate`.
    fn with_inputs<R>(&self, batch: &Batch<'_>, evaluate: impl FnOnce(&Batch<'_>) -> R) -> R {
        self.with_signals(&self.signals, batch, evaluate)
    }

    fn with_signals<R>(
        &self,
        signals: &[usize],
        batch: &Batch<'_>,
        evaluate: impl FnOnce(&Batch<'_>) -> R,
    ) -> R {
        let species = take(&self.species, batch.species);
        let signals = take(signals, batch.signals);
        let parameters = batch.parameters.get(self.parameters.clone()).unwrap_or(&[]);
        evaluate(&Batch { species: &species, signals: &signals, parameters, ..*batch })
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

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        rates.iter_mut().for_each(|column| column.fill(0.0));
        let mut warning = None;
        for part in &self.members {
            let mut own = Columns::new(part.species.len(), batch.count);
            let outcome =
                part.with_inputs(batch, |b| part.kinetics.rates(b, &mut own.slices_mut()))?;
            warning = warning.or(outcome);
            for (row, &species) in part.species.iter().enumerate() {
                add(rates[species], own.column(row));
            }
        }
        Ok(warning)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        rates.iter_mut().for_each(|column| column.fill(0.0));
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let (all, width) = (self.descriptor.species.len(), self.descriptor.inputs());
        let mut warning = None;
        for part in &self.members {
            let (n, inputs) = (part.species.len(), part.kinetics.descriptor().inputs());
            let mut own = Columns::new(n, batch.count);
            let mut slopes = Columns::new(n * inputs, batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.rate_partials(b, &mut own.slices_mut(), &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            let signals = part.signals.iter().map(|column| all + column);
            let columns: Vec<usize> = part.species.iter().copied().chain(signals).collect();
            for (row, &species) in part.species.iter().enumerate() {
                add(rates[species], own.column(row));
                for (input, &column) in columns.iter().enumerate() {
                    add(partials[species * width + column], slopes.column(row * inputs + input));
                }
            }
        }
        Ok(warning)
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        factor.fill(1.0);
        let mut own = vec![1.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives_length_factor()) {
            let outcome = part.with_inputs(batch, |b| part.kinetics.length_factor(b, &mut own))?;
            warning = warning.or(outcome);
            factor.iter_mut().zip(&own).for_each(|(all, own)| *all *= own);
        }
        Ok(warning)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        factor.fill(1.0);
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let mut own = vec![1.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives_length_factor()) {
            let mut slopes = Columns::new(part.species.len(), batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.length_factor_partials(b, &mut own, &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            // (Φ Ψ)' = Φ' Ψ + Φ Ψ'
            for column in partials.iter_mut() {
                column.iter_mut().zip(&own).for_each(|(slope, own)| *slope *= own);
            }
            for (row, &species) in part.species.iter().enumerate() {
                let more = slopes.column(row).iter().zip(factor.iter());
                let column = partials[species].iter_mut();
                column.zip(more).for_each(|(slope, (own, before))| *slope += own * before);
            }
            factor.iter_mut().zip(&own).for_each(|(all, own)| *all *= own);
        }
        Ok(warning)
    }

    fn feedback(&self, which: Feedback, batch: &Batch<'_>, values: &mut [f64]) -> Outcome {
        values.fill(which.neutral());
        let mut own = vec![0.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives(which)) {
            let outcome =
                part.with_inputs(batch, |b| part.kinetics.feedback(which, b, &mut own))?;
            warning = warning.or(outcome);
            values.iter_mut().zip(&own).for_each(|(all, own)| *all = which.joined(*all, *own).0);
        }
        Ok(warning)
    }

    fn feedback_partials(
        &self,
        which: Feedback,
        batch: &Batch<'_>,
        values: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        values.fill(which.neutral());
        partials.iter_mut().for_each(|column| column.fill(0.0));
        let mut own = vec![0.0; batch.count];
        let mut warning = None;
        for part in self.members.iter().filter(|p| p.gives(which)) {
            let mut slopes = Columns::new(part.species.len(), batch.count);
            let outcome = part.with_inputs(batch, |b| {
                part.kinetics.feedback_partials(which, b, &mut own, &mut slopes.slices_mut())
            })?;
            warning = warning.or(outcome);
            for (point, (all, own)) in values.iter_mut().zip(&own).enumerate() {
                let (joined, [by_all, by_own]) = which.joined(*all, *own);
                partials.iter_mut().for_each(|column| column[point] *= by_all);
                for (row, &species) in part.species.iter().enumerate() {
                    partials[species][point] += by_own * slopes.column(row)[point];
                }
                *all = joined;
            }
        }
        Ok(warning)
    }

    fn breakpoints(&self, batch: &Batch<'_>, until: f64, times: &mut Vec<f64>) -> bool {
        let of =
            |part: &Part| part.with_inputs(batch, |b| part.kinetics.breakpoints(b, until, times));
        let known: Vec<bool> = self.members.iter().map(of).collect();
        !known.contains(&false)
    }

    fn without_parameter_columns(&self) -> Result<Option<Box<dyn Kinetics>>, KineticsError> {
        let mut members = self.members.clone();
        let mut any = false;
        for part in &mut members {
            if let Some(other) = part.kinetics.without_parameter_columns()? {
                (part.kinetics, any) = (Arc::from(other), true);
            }
        }
        let (descriptor, parameters) = (self.descriptor.clone(), self.parameters.clone());
        Ok(any.then(|| Box::new(Self { descriptor, parameters, members }) as Box<dyn Kinetics>))
    }

    fn offender(&self, rates: bool, batch: &Batch<'_>) -> String {
        let bad = |part: &&Part| {
            part.with_inputs(batch, |b| {
                let mut own = Columns::new(if rates { part.species.len() } else { 1 }, b.count);
                let columns = &mut own.slices_mut();
                let least = if rates { f64::MIN } else { f64::MIN_POSITIVE };
                let outcome = match rates {
                    true => part.kinetics.rates(b, columns),
                    false => part.kinetics.length_factor(b, columns[0]),
                };
                outcome.is_err() || columns.iter().any(|column| !all_finite_from(column, least))
            })
        };
        let found = self.members.iter().find(bad).map(|part| part.kinetics.descriptor());
        found.unwrap_or(&self.descriptor).title()
    }

    fn observe(&self, batch: &Batch<'_>, values: &mut [&mut [f64]]) -> Outcome {
        let mut warning = None;
        for part in self.members.iter().filter(|p| !p.observables.is_empty()) {
            let own = &mut values[part.observables.clone()];
            let outcome =
                part.with_signals(&part.observed, batch, |b| part.kinetics.observe(b, own))?;
            warning = warning.or(outcome);
        }
        Ok(warning)
    }
}

impl Part {
    pub(super) fn gives(&self, which: Feedback) -> bool {
        which.is_given(&self.kinetics.descriptor().capabilities)
    }

    pub(super) fn gives_length_factor(&self) -> bool {
        self.kinetics.descriptor().capabilities.length_factor
    }
}
