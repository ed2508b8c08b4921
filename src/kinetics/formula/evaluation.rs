//! Evaluation of a compiled law on batches of points.

use super::super::{Batch, Column, Descriptor, Kinetics, Outcome, Quantity};
use super::{FormulaKinetics, Kinks, Programs};
use crate::breakpoints::TimeDependence;

impl FormulaKinetics {
    /// The program of the values of a quantity, and the one with partial derivatives.
    fn programs(&self, quantity: Quantity) -> Option<&Programs> {
        match quantity {
            Quantity::Rates => Some(&self.rates),
            Quantity::Feedback(which) => self
                .feedback
                .iter()
                .find(|(known, _)| *known == which)
                .map(|(_, programs)| programs),
            Quantity::Observables => Some(&self.observables),
        }
    }

    /// The inputs of a call: species, signals, parameters that vary.
    fn inputs<'a>(&'a self, batch: &'a Batch<'a>) -> Vec<Column<'a>> {
        let varying = self.varying.iter().map(|&k| match batch.parameters.get(k) {
            Some(column) => *column,
            None => Column::uniform(&self.parameters[k]),
        });
        batch.inputs().copied().chain(varying).collect()
    }
}

impl Kinetics for FormulaKinetics {
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
        match self.programs(quantity) {
            None => quantity.write_neutral(values, partials),
            Some((program, _)) if partials.is_empty() => {
                program.run(&self.inputs(batch), batch.count, values);
            }
            Some((_, program)) => {
                let mut all: Vec<&mut [f64]> = Vec::with_capacity(values.len() + partials.len());
                all.extend(values.iter_mut().map(|column| &mut **column));
                all.extend(partials.iter_mut().map(|column| &mut **column));
                program.run(&self.inputs(batch), batch.count, &mut all);
            }
        }
        Ok(None)
    }

    fn time_dependence(&self, batch: &Batch<'_>, until: f64, found: &mut TimeDependence) -> bool {
        let first = Kinks::numbers(self.descriptor.species.len())[1];
        let value = |input: usize, point: usize| {
            let column = self.varying.get(input - first).and_then(|&k| batch.parameters.get(k));
            column.map_or(f64::NAN, |column| column.at(point))
        };
        self.kinks.at_points(until, batch.count, value, found)
    }
}
