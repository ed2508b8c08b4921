//! What a law is evaluated for, with the shape of its columns.
//!
//! | quantity | values | partial derivatives by | signals of the batch |
//! | --- | --- | --- | --- |
//! | rates | one column a species | species and signal columns | those of the rates |
//! | feedback | one column | species | none |
//! | observables | one column an observable | nothing | those of the observables |
//!
//! Partial derivatives have one column an output and input, `partials[output · inputs + input]`.

use super::descriptor::{self, Descriptor, SignalRead};
use super::{Batch, Feedback, KineticsError};

/// A quantity that a law gives at every point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// The rate of each species, 1/time times its unit.
    Rates,
    /// A function of the species and the parameters.
    Feedback(Feedback),
    /// The observables of the descriptor.
    Observables,
}

impl From<Feedback> for Quantity {
    fn from(which: Feedback) -> Self {
        Self::Feedback(which)
    }
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Rates,
        Self::Feedback(Feedback::LengthFactor),
        Self::Feedback(Feedback::Curvature),
        Self::Feedback(Feedback::FactorAcross),
        Self::Observables,
    ];

    /// The name of the call, with or without partial derivatives.
    #[must_use]
    pub fn call(self, partials: bool) -> &'static str {
        match (self, partials) {
            (Self::Rates, false) => "rates",
            (Self::Rates, true) => "rate_partials",
            (Self::Feedback(which), false) => which.name(),
            (Self::Feedback(which), true) => which.partials_name(),
            (Self::Observables, _) => "observe",
        }
    }

    /// Whether a law gives it.
    #[must_use]
    pub fn is_given(self, law: &Descriptor) -> bool {
        match self {
            Self::Rates => true,
            Self::Feedback(which) => which.is_given(&law.capabilities),
            Self::Observables => !law.observables.is_empty(),
        }
    }

    /// Whether a law gives its partial derivatives; else they are taken by differences.
    #[must_use]
    pub fn has_partials(self, law: &Descriptor) -> bool {
        match self {
            Self::Rates => law.capabilities.rate_partials,
            Self::Feedback(Feedback::LengthFactor) => law.capabilities.length_factor_partials,
            Self::Feedback(which) => which.is_given(&law.capabilities),
            Self::Observables => false,
        }
    }

    /// Number of value columns.
    #[must_use]
    pub fn outputs(self, law: &Descriptor) -> usize {
        match self {
            Self::Rates => law.species.len(),
            Self::Feedback(_) => 1,
            Self::Observables => law.observables.len(),
        }
    }

    /// Number of inputs by which each output is differentiated.
    #[must_use]
    pub fn inputs(self, law: &Descriptor) -> usize {
        match self {
            Self::Rates => law.inputs(),
            Self::Feedback(_) => law.species.len(),
            Self::Observables => 0,
        }
    }

    /// The signals that are read.
    pub(super) fn signals(self, law: &Descriptor) -> &[SignalRead] {
        match self {
            Self::Rates => &law.signals,
            Self::Feedback(_) => &[],
            Self::Observables => &law.observed,
        }
    }

    /// The least value allowed.
    pub(super) fn least(self) -> f64 {
        match self {
            Self::Feedback(which) => which.least(),
            Self::Rates | Self::Observables => f64::MIN,
        }
    }

    /// Writes what stands for a quantity that a law does not give: no reaction, no feedback, and NaN for observables.
    pub fn write_neutral(self, values: &mut [&mut [f64]], partials: &mut [&mut [f64]]) {
        let neutral = match self {
            Self::Rates => 0.0,
            Self::Feedback(which) => which.neutral(),
            Self::Observables => f64::NAN,
        };
        values.iter_mut().for_each(|column| column.fill(neutral));
        partials.iter_mut().for_each(|column| column.fill(0.0));
    }

    /// What an output column is, in words: of the values, or of the partial derivatives.
    pub(super) fn describe(self, law: &Descriptor, partials: bool, column: usize) -> String {
        let inputs = self.inputs(law).max(1);
        let output = if partials { column / inputs } else { column };
        let value = match self {
            Self::Rates => {
                let species = law.species.get(output).map_or("?", |species| &species.name);
                format!("the rate of species {species}")
            }
            Self::Feedback(which) => which.describe().to_owned(),
            Self::Observables => {
                let observable = law.observables.get(output).map_or("?", |known| &known.name);
                format!("the observable {observable}")
            }
        };
        if !partials {
            return value;
        }
        let input = law.input_names().nth(column % inputs).unwrap_or("?");
        format!("the derivative by {input} of {value}")
    }

    /// Checks that the columns of a call are as many as needed and long enough, so that pointers to them may be
    /// given away. Without derivative columns only values are wanted.
    ///
    /// # Errors
    /// [`KineticsError::Shape`].
    pub(super) fn check_shapes(
        self,
        law: &Descriptor,
        batch: &Batch<'_>,
        values: &[&mut [f64]],
        partials: &[&mut [f64]],
    ) -> Result<(), KineticsError> {
        let check = |what, expected, found| {
            if expected == found {
                return Ok(());
            }
            Err(KineticsError::Shape { plugin: law.name.clone(), what, expected, found })
        };
        let outputs = self.outputs(law);
        check("species columns", law.species.len(), batch.species.len())?;
        let signals = descriptor::columns(self.signals(law)).count();
        check("signal columns", signals, batch.signals.len())?;
        if !batch.parameters.is_empty() {
            check("parameter columns", law.parameters.len(), batch.parameters.len())?;
        }
        check("value columns", outputs, values.len())?;
        if !partials.is_empty() {
            check("derivative columns", outputs * self.inputs(law), partials.len())?;
        }
        for column in batch.inputs().chain(batch.parameters) {
            let covered = column.covers(batch.count);
            let found = if covered { batch.count } else { column.parts().0.len() };
            check("values of an input", batch.count, found)?;
        }
        for column in values.iter().chain(partials) {
            check("values of an output", batch.count, column.len())?;
        }
        Ok(())
    }
}

impl Batch<'_> {
    /// The inputs that a quantity of the rates' signals, or of none, reads.
    pub(super) fn inputs_of(&self, quantity: Quantity) -> Self {
        match quantity {
            Quantity::Feedback(_) => Self { signals: &[], ..*self },
            Quantity::Rates | Quantity::Observables => *self,
        }
    }
}
