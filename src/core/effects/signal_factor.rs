//! Factors of transports that read signals of the shape.
//!
//! ```text
//! ċ_i = f_i (L b + s)_i             f a formula of the rest position, the time and the signals σ at the point
//! ∂ċ_i/∂b_j = f_i L_ij              ∂ċ_i/∂σ_i = ∂f_i/∂σ (L b + s)_i
//! ```

use super::field::{check_distance, vertex_places};
use super::{EffectContext, EffectError, Field, Operator, TransportTerm, WrongCoefficient};
use crate::kinetics::formula::SpeciesFormula;
use crate::kinetics::{Location, Signal};
use crate::sheet::Sheet;

/// Signals with their columns at the points.
#[derive(Debug, Clone, Copy)]
pub struct SignalValues<'a> {
    signals: &'a [Signal],
    columns: &'a [Vec<f64>],
}

impl<'a> SignalValues<'a> {
    /// These signals, with the columns of all of them in their order.
    #[must_use]
    pub fn new(signals: &'a [Signal], columns: &'a [Vec<f64>]) -> Self {
        Self { signals, columns }
    }

    /// The place among the columns of that with this number among the columns of all signals.
    #[must_use]
    pub(crate) fn place(&self, number: usize) -> Option<usize> {
        let name = Signal::ALL.iter().flat_map(|s| s.columns()).nth(number)?;
        self.signals.iter().flat_map(|s| s.columns()).position(|column| column == name)
    }

    fn column(&self, number: usize) -> &'a [f64] {
        self.place(number).and_then(|place| self.columns.get(place)).map_or(&[], Vec::as_slice)
    }
}

/// Species and signals that a transport reads.
pub type TransportInputs<'a> = (&'a [&'a [f64]], SignalValues<'a>);

/// A factor at the vertices that reads signals.
#[derive(Debug, Clone)]
pub struct SignalFactor {
    formula: SpeciesFormula,
    nonnegative: bool,
}

impl SignalFactor {
    /// Whether it must not be negative.
    pub(super) fn is_nonnegative(&self) -> bool {
        self.nonnegative
    }

    /// The signals that it reads.
    pub(super) fn signals(&self) -> impl Iterator<Item = Signal> + '_ {
        let columns = Signal::ALL.iter().flat_map(|s| s.columns().iter().map(move |_| *s));
        let read = self.formula.species();
        columns.enumerate().filter(|(k, _)| read.contains(k)).map(|(_, signal)| signal)
    }

    fn evaluate(&self, (sheet, time): (&Sheet, f64), signals: SignalValues<'_>) -> Vec<f64> {
        let places = vertex_places(sheet, self.formula.depends_on_distance());
        self.formula.evaluate(places, time, |k| signals.column(k))
    }

    /// Adds it times `rate` to `out`.
    ///
    /// # Errors
    /// Where it is inadmissible at a point with a rate.
    pub(super) fn add_product(
        &self,
        on: (&Sheet, f64),
        signals: SignalValues<'_>,
        rate: &[f64],
        out: &mut [f64],
    ) -> Result<(), WrongCoefficient> {
        let factor = self.evaluate(on, signals);
        for (point, (value, rate)) in factor.into_iter().zip(rate).enumerate() {
            if *rate == 0.0 {
                continue;
            }
            if !(value.is_finite() && (!self.nonnegative || value >= 0.0)) {
                return Err(WrongCoefficient { point, value });
            }
            out[point] += value * rate;
        }
        Ok(())
    }
}

impl TransportTerm {
    /// The same times a factor that reads signals.
    #[must_use]
    pub(super) fn with_factor(mut self, factor: Option<SignalFactor>) -> Self {
        self.factor = factor;
        self
    }

    /// The signals that its factor reads.
    pub fn read_signals(&self) -> impl Iterator<Item = Signal> + '_ {
        self.factor.iter().flat_map(SignalFactor::signals)
    }

    /// The factor at the points; `None` where there is none.
    pub(super) fn factors(&self, on: (&Sheet, f64), signals: SignalValues<'_>) -> Option<Vec<f64>> {
        self.factor.as_ref().map(|factor| factor.evaluate(on, signals))
    }

    /// Hands the derivatives of the rate by signals at the same point to `emit` as (point, column among those of the signals given,
    /// value).
    pub fn derivatives_by_signals(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        (species, signals): TransportInputs<'_>,
        mut emit: impl FnMut(usize, usize, f64),
    ) {
        let Some(SignalFactor { formula, .. }) = &self.factor else { return };
        let followed = species[self.read_species()];
        let mut rate = vec![0.0; followed.len()];
        self.add_rate((sheet, time), operator, followed, &mut rate);
        let places = vertex_places(sheet, formula.depends_on_distance());
        let slopes = formula.slopes(places, time, |k| signals.column(k));
        for (number, slopes) in formula.species().iter().zip(slopes) {
            let Some(column) = signals.place(*number) else { continue };
            let each = rate.iter().zip(slopes).enumerate().filter(|(_, (rate, _))| **rate != 0.0);
            each.for_each(|(point, (rate, slope))| emit(point, column, rate * slope));
        }
    }
}

impl EffectContext<'_> {
    /// The factor by a formula that reads signals, which must not be negative where it is `nonnegative`; `None` of a field that reads none. `key` is to blame.
    ///
    /// # Errors
    /// A formula with a name that is neither position, time nor a signal; one of species on faces, or of the tension without a
    /// material.
    pub(super) fn signal_factor<N>(
        &self,
        field: &Field<N>,
        (key, nonnegative): (&'static str, bool),
        location: Location,
    ) -> Result<Option<SignalFactor>, EffectError> {
        let Field::Formula(text) = field else { return Ok(None) };
        let formula = SpeciesFormula::of_signals(text).and_then(|formula| {
            check_distance(self.sheet, text, formula.depends_on_distance()).map(|()| formula)
        });
        let formula = formula.map_err(|e| EffectError { key, message: e.message, help: e.help })?;
        if formula.species().is_empty() {
            return Ok(None);
        }
        if location != Location::Vertex {
            return Err(EffectError {
                key,
                message: "a formula that reads signals is for species on vertices".into(),
                help: Some("use kinetics.location = \"vertex\"".into()),
            });
        }
        let factor = SignalFactor { formula, nonnegative };
        if factor.signals().any(|signal| signal == Signal::Tension) && self.material.is_none() {
            return Err(EffectError {
                key,
                message: "it reads the signal tension, which needs a material".into(),
                help: Some("add [material] with young, poisson and thickness".into()),
            });
        }
        Ok(Some(factor))
    }
}
