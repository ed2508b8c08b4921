//! Evaluation of a compiled law on batches of points.

use super::super::{Batch, Column, Descriptor, Feedback, Kinetics, Outcome};
use super::{FormulaKinetics, Kinks, OfSpecies};

impl FormulaKinetics {
    fn found(&self, which: Feedback) -> Option<&OfSpecies> {
        self.feedback.iter().find(|(known, _)| *known == which).map(|(_, programs)| programs)
    }

    /// Evaluates a function of the species; `neutral` where there is none.
    fn of_species(
        &self,
        programs: Option<&OfSpecies>,
        batch: &Batch<'_>,
        (values, neutral): (&mut [f64], f64),
    ) {
        match programs {
            Some((program, _)) => program.run(&self.inputs(batch), batch.count, &mut [values]),
            None => values.fill(neutral),
        }
    }

    /// The same with partial derivatives.
    fn of_species_partials(
        &self,
        programs: Option<&OfSpecies>,
        batch: &Batch<'_>,
        (values, neutral): (&mut [f64], f64),
        partials: &mut [&mut [f64]],
    ) {
        let Some((_, program)) = programs else {
            values.fill(neutral);
            partials.iter_mut().for_each(|column| column.fill(0.0));
            return;
        };
        let mut all: Vec<&mut [f64]> = vec![values];
        all.extend(partials.iter_mut().map(|column| &mut **column));
        program.run(&self.inputs(batch), batch.count, &mut all);
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

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        self.rates.run(&self.inputs(batch), batch.count, rates);
        Ok(None)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let mut all: Vec<&mut [f64]> = Vec::with_capacity(rates.len() + partials.len());
        all.extend(rates.iter_mut().map(|column| &mut **column));
        all.extend(partials.iter_mut().map(|column| &mut **column));
        self.rate_partials.run(&self.inputs(batch), batch.count, &mut all);
        Ok(None)
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        self.of_species(self.factor.as_ref(), batch, (factor, 1.0));
        Ok(None)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        self.of_species_partials(self.factor.as_ref(), batch, (factor, 1.0), partials);
        Ok(None)
    }

    fn feedback(&self, which: Feedback, batch: &Batch<'_>, values: &mut [f64]) -> Outcome {
        self.of_species(self.found(which), batch, (values, which.neutral()));
        Ok(None)
    }

    fn feedback_partials(
        &self,
        which: Feedback,
        batch: &Batch<'_>,
        values: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        self.of_species_partials(self.found(which), batch, (values, which.neutral()), partials);
        Ok(None)
    }

    fn breakpoints(&self, batch: &Batch<'_>, until: f64, times: &mut Vec<f64>) -> bool {
        let first = Kinks::numbers(self.descriptor.species.len())[1];
        let value = |input: usize, point: usize| {
            let column = self.varying.get(input - first).and_then(|&k| batch.parameters.get(k));
            column.map_or(f64::NAN, |column| column.at(point))
        };
        self.kinks.at_points(until, batch.count, value, times)
    }

    fn observe(&self, batch: &Batch<'_>, values: &mut [&mut [f64]]) -> Outcome {
        self.observables.run(&self.inputs(batch), batch.count, values);
        Ok(None)
    }
}
