//! Factors of transports that read signals of the shape.
//!
//! ```text
//! ċ_i = f_i (L b + s)_i             f a formula of the rest position, the time and the signals σ at the point
//! ∂ċ_i/∂b_j = f_i L_ij              ∂ċ_i/∂σ_i = ∂f_i/∂σ (L b + s)_i
//! ```

use super::field::{check_distance, vertex_places};
use super::{EffectContext, EffectError, Field};
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

    pub(super) fn evaluate(
        &self,
        (sheet, time): (&Sheet, f64),
        signals: SignalValues<'_>,
    ) -> Vec<f64> {
        let places = vertex_places(sheet, self.formula.depends_on_distance());
        self.formula.evaluate(places, time, |k| signals.column(k))
    }

    /// Adds it times `rate` to `out`.
    ///
    /// # Errors
    /// The first point with a rate where it is inadmissible, and its value there.
    pub(super) fn add_product(
        &self,
        on: (&Sheet, f64),
        signals: SignalValues<'_>,
        rate: &[f64],
        out: &mut [f64],
    ) -> Result<(), (usize, f64)> {
        let factor = self.evaluate(on, signals);
        for (point, (value, rate)) in factor.into_iter().zip(rate).enumerate() {
            if *rate == 0.0 {
                continue;
            }
            if !(value.is_finite() && (!self.nonnegative || value >= 0.0)) {
                return Err((point, value));
            }
            out[point] += value * rate;
        }
        Ok(())
    }

    /// Its derivatives at the points by each column that it reads, with the place of this among those of `signals`.
    pub(super) fn slopes(
        &self,
        (sheet, time): (&Sheet, f64),
        signals: SignalValues<'_>,
    ) -> impl Iterator<Item = (usize, Vec<f64>)> {
        let places = vertex_places(sheet, self.formula.depends_on_distance());
        let slopes = self.formula.slopes(places, time, |k| signals.column(k));
        let columns = self.formula.species().iter().filter_map(move |k| signals.place(*k));
        columns.zip(slopes).collect::<Vec<_>>().into_iter()
    }
}

impl EffectContext<'_> {
    /// The factor by a formula that reads signals, which must not be negative where it is `nonnegative`; `None` of a field that reads
    /// none. `key` is to blame.
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
