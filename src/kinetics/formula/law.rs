//! A law as text.

use super::parse::FormulaError;
use crate::descriptor::Observable;
use crate::{Feedback, Parameter, Species};

/// One formula of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// The species whose rate it is, or the name that it gets.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// A law as text.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// What the law is called.
    pub name: String,
    /// Species, in order.
    pub species: Vec<Species>,
    /// Parameters.
    pub parameters: Vec<Parameter>,
    /// Their values; `None` for those that differ from point to point.
    pub values: Vec<Option<f64>>,
    /// Names for parts of formulas, in any order.
    pub lets: Vec<Formula>,
    /// Rates; species without one do not react.
    pub rates: Vec<Formula>,
    /// Feedback on the sheet.
    pub feedback: Vec<(Feedback, String)>,
    /// Observables.
    pub observables: Vec<(Observable, String)>,
}

impl Law {
    /// A law without species, to be completed.
    ///
    /// ```
    /// use rumple_kinetics::formula::{FormulaKinetics, Law};
    ///
    /// let law = Law::named("logistic")
    ///     .parameter("r", 2.0)
    ///     .species("u", "r*u*(1 - u)")
    ///     .length_factor("1 + 0.1*u");
    /// let kinetics = FormulaKinetics::new(&law)?;
    /// # Ok::<(), rumple_kinetics::formula::LawError>(())
    /// ```
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            species: Vec::new(),
            parameters: Vec::new(),
            values: Vec::new(),
            lets: Vec::new(),
            rates: Vec::new(),
            feedback: Vec::new(),
            observables: Vec::new(),
        }
    }

    /// Adds a species with its rate: of any value, and without diffusion of its own; change
    /// [`Law::species`] where that does not fit.
    #[must_use]
    pub fn species(mut self, name: &str, rate: &str) -> Self {
        self.species.push(Species::named(name));
        self.rates.push(Formula { name: name.to_owned(), text: rate.to_owned() });
        self
    }

    /// Adds a parameter with its value.
    #[must_use]
    pub fn parameter(mut self, name: &str, value: f64) -> Self {
        self.parameters.push(Parameter::named(name, value));
        self.values.push(Some(value));
        self
    }

    /// Sets the length factor.
    #[must_use]
    pub fn length_factor(self, formula: &str) -> Self {
        self.feedback(Feedback::LengthFactor, formula)
    }

    /// Sets a quantity of [`Feedback`]; a length factor across a fibre goes with the one along it.
    #[must_use]
    pub fn feedback(mut self, which: Feedback, formula: &str) -> Self {
        self.feedback.retain(|(known, _)| *known != which);
        self.feedback.push((which, formula.to_owned()));
        self
    }

    /// Whether a species, a parameter or a `let` has this name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.species.iter().any(|s| s.name == name)
            || self.parameters.iter().any(|p| p.name == name)
            || self.lets.iter().any(|l| l.name == name)
    }

    /// Bytes of all formulas.
    pub(super) fn size(&self) -> usize {
        let named = self.lets.iter().chain(&self.rates).map(|formula| &formula.text);
        let observables = self.observables.iter().map(|(_, text)| text);
        let feedback = self.feedback.iter().map(|(_, text)| text);
        named.chain(feedback).chain(observables).map(String::len).sum()
    }
}

/// Which formula of a law is wrong, and how.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{formula:?}: {error}")]
pub struct LawError {
    /// Which.
    pub formula: FormulaIndex,
    /// How and where in its text.
    pub error: FormulaError,
}

/// A formula of a law.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FormulaIndex {
    /// The k-th of `lets`.
    Let(usize),
    /// The k-th of `rates`.
    Rate(usize),
    /// The k-th of `feedback`.
    Feedback(usize),
    /// The k-th of `observables`.
    Observable(usize),
}
