//! Transports whose coefficient reads species, by the linear one with the coefficient 1, or whose factor reads signals
//! (`signal_factor.rs`).
//!
//! ```text
//! ∂c/∂t = … + ∇·(D(u) ∇b)         D a formula of the rest position and of species u, b the species that is followed
//! ċ_i = Σ_j L_ij ½ (D_i + D_j) (b_j - b_i) = ½ (L(D b) + D L b - b L D)_i
//! ```
//!
//! L is the matrix for the coefficient 1, whose rows sum to 0. The mean over the ends of an edge is symmetric, so totals are conserved as
//! by L, and of second order. With `D' = ∂D/∂u` at fixed shape
//!
//! ```text
//! ∂ċ_i/∂b_j = L_ij ½ (D_i + D_j)    ∂ċ_i/∂u_j = ½ L_ij D'_j (b_j - b_i)      i ≠ j
//! ∂ċ_i/∂b_i = -Σ_j of these         ∂ċ_i/∂u_i = ½ D'_i Σ_j L_ij (b_j - b_i)
//! ```

use super::field::vertex_places;
use super::signal_factor::{SignalFactor, SignalValues, TransportInputs};
use super::{FieldValues, Operator, TransportTerm, WrongCoefficient};
use crate::Vec3;
use crate::kinetics::Signal;
use crate::kinetics::formula::SpeciesFormula;
use crate::parallel;
use crate::sheet::Sheet;

/// D at the points, without the species.
struct At<'a> {
    term: &'a TransportTerm,
    formula: &'a SpeciesFormula,
    species: &'a [&'a [f64]],
    d: Vec<f64>,
}

impl<'a> At<'a> {
    fn new(
        term: &'a TransportTerm,
        formula: &'a SpeciesFormula,
        sheet: &Sheet,
        species: &'a [&'a [f64]],
    ) -> Self {
        let places = vertex_places(sheet, formula.depends_on_distance());
        let d = formula.evaluate(places, 0.0, |s| species[s]);
        Self { term, formula, species, d }
    }

    /// The species that is followed.
    fn followed(&self) -> &'a [f64] {
        self.species[self.term.read_species()]
    }

    /// Products with D at every point.
    fn times(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.d).map(|(value, d)| value * d).collect()
    }

    /// The first point where it is inadmissible.
    fn wrong(&self) -> Option<WrongCoefficient> {
        let right = |d: f64| d.is_finite() && (!self.term.has_sign() || d >= 0.0);
        let point = self.d.iter().position(|d| !right(*d))?;
        Some(WrongCoefficient { point, value: self.d[point] })
    }

    fn slopes(&self, sheet: &Sheet) -> Vec<Vec<f64>> {
        let places = vertex_places(sheet, self.formula.depends_on_distance());
        self.formula.slopes(places, 0.0, |s| self.species[s])
    }
}

impl TransportTerm {
    /// The same with the coefficient that `formula` gives at the vertices, times that of the transport, which must have rows that sum to 0.
    #[must_use]
    pub fn with_coefficient(mut self, formula: SpeciesFormula) -> Self {
        self.coefficient = Some(formula);
        self
    }

    /// As [`Transport::diffusivity`](super::Transport::diffusivity), where a coefficient that reads `species` is taken in a triangle as the
    /// mean over its corners.
    #[must_use]
    pub fn diffusivity_at(&self, sheet: &Sheet, species: &[&[f64]]) -> Option<FieldValues> {
        let factor = self.transport_diffusivity()?;
        let Some(formula) = &self.coefficient else { return Some(factor) };
        let At { d, .. } = At::new(self, formula, sheet, species);
        let mean = |corners: &[u32; 3]| corners.iter().map(|v| d[*v as usize]).sum::<f64>() / 3.0;
        let each = sheet.triangles().iter().enumerate();
        Some(FieldValues::Each(each.map(|(t, corners)| factor.at(t) * mean(corners)).collect()))
    }

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
    fn factors(&self, on: (&Sheet, f64), signals: SignalValues<'_>) -> Option<Vec<f64>> {
        self.factor.as_ref().map(|factor| factor.evaluate(on, signals))
    }

    /// Whether its coefficient or factor must not be negative.
    #[must_use]
    pub fn has_sign(&self) -> bool {
        match &self.factor {
            Some(factor) => factor.is_nonnegative(),
            None => self.read_species() == self.species(),
        }
    }

    /// Whether its rate may have no value: its coefficient reads species, its factor signals, or its sources may depend on time.
    #[must_use]
    pub(crate) fn may_fail(&self) -> bool {
        self.has_factor() || self.has_sources() || !self.read_by_coefficient().is_empty()
    }

    /// Whether it is multiplied by what reads signals.
    pub(crate) fn has_factor(&self) -> bool {
        self.factor.is_some()
    }

    /// Numbers of the species that the coefficient reads.
    #[must_use]
    pub fn read_by_coefficient(&self) -> &[usize] {
        self.coefficient.as_ref().map_or(&[], SpeciesFormula::species)
    }

    /// Adds the rate of change to `out`.
    ///
    /// # Errors
    /// Where the coefficient, the factor or a rate in time is inadmissible.
    pub fn add_rate_of(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        (species, signals): TransportInputs<'_>,
        out: &mut [f64],
    ) -> Result<(), WrongCoefficient> {
        let on = (sheet, time);
        if let Some(wrong) = self.inadmissible(on) {
            return Err(wrong);
        }
        if let Some(factor) = &self.factor {
            let mut rate = vec![0.0; out.len()];
            self.add_rate(on, operator, species[self.read_species()], &mut rate);
            let added = factor.add_product(on, signals, &rate, out);
            return added.map_err(|(point, value)| WrongCoefficient { point, value });
        }
        let Some(formula) = &self.coefficient else {
            self.add_rate((sheet, time), operator, species[self.read_species()], out);
            return Ok(());
        };
        let at = At::new(self, formula, sheet, species);
        if let Some(wrong) = at.wrong() {
            return Err(wrong);
        }
        let followed = at.followed();
        let linear = |values: &[f64]| {
            let mut rate = vec![0.0; out.len()];
            self.add_rate((sheet, time), operator, values, &mut rate);
            rate
        };
        let [of_product, of_followed, of_d] =
            [linear(&at.times(followed)), linear(followed), linear(&at.d)];
        parallel::update(out, |i, rate| {
            *rate += 0.5 * (of_product[i] + at.d[i] * of_followed[i] - followed[i] * of_d[i]);
        });
        Ok(())
    }

    /// Hands the derivatives of the rate to `emit` as (point, by species, by point, value); order and places depend on the sheet alone,
    /// places may come more than once.
    pub fn derivatives(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        (species, signals): TransportInputs<'_>,
        emit: &mut dyn FnMut(usize, usize, usize, f64),
    ) {
        let by = self.read_species();
        let Some(formula) = &self.coefficient else {
            let factors = self.factors((sheet, time), signals);
            self.entries((sheet, time), operator, &mut |i, j, value| {
                emit(i, by, j, factors.as_ref().map_or(value, |factors| factors[i] * value));
            });
            return;
        };
        let at = At::new(self, formula, sheet, species);
        let (slopes, followed) = (at.slopes(sheet), at.followed());
        self.entries((sheet, time), operator, &mut |i, j, value| {
            if i == j {
                return;
            }
            let flow = value * 0.5 * (at.d[i] + at.d[j]);
            emit(i, by, j, flow);
            emit(i, by, i, -flow);
            let difference = 0.5 * value * (followed[j] - followed[i]);
            for (&read, slope) in formula.species().iter().zip(&slopes) {
                emit(i, read, j, difference * slope[j]);
                emit(i, read, i, difference * slope[i]);
            }
        });
    }

    /// Hands the derivatives of the rate by signals at the same point to `emit` as (point, column among those of the signals given,
    /// value).
    pub fn derivatives_by_signals(
        &self,
        on: (&Sheet, f64),
        operator: &Operator,
        (species, signals): TransportInputs<'_>,
        mut emit: impl FnMut(usize, usize, f64),
    ) {
        let Some(factor) = &self.factor else { return };
        let followed = species[self.read_species()];
        let mut rate = vec![0.0; followed.len()];
        self.add_rate(on, operator, followed, &mut rate);
        for (column, slopes) in factor.slopes(on, signals) {
            let each = rate.iter().zip(slopes).enumerate().filter(|(_, (rate, _))| **rate != 0.0);
            each.for_each(|(point, (rate, slope))| emit(point, column, rate * slope));
        }
    }

    /// Hands the derivatives of the rate by positions to `emit`, as [`Transport::shape_derivatives`](super::Transport::shape_derivatives).
    pub fn derivatives_by_positions(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        x: &[Vec3],
        (species, signals): TransportInputs<'_>,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let Some(formula) = &self.coefficient else {
            let (on, followed) = ((sheet, time), species[self.read_species()]);
            let factors = self.factors(on, signals);
            self.shape_derivatives(on, operator, x, followed, &mut |i, v, by| {
                emit(i, v, factors.as_ref().map_or(by, |factors| factors[i] * by));
            });
            return;
        };
        let at = At::new(self, formula, sheet, species);
        let followed = at.followed();
        self.shape_derivatives((sheet, time), operator, x, &at.times(followed), &mut |i, v, by| {
            emit(i, v, 0.5 * by);
        });
        self.shape_derivatives((sheet, time), operator, x, followed, &mut |i, v, by| {
            emit(i, v, 0.5 * at.d[i] * by);
        });
        self.shape_derivatives((sheet, time), operator, x, &at.d, &mut |i, v, by| {
            emit(i, v, -0.5 * followed[i] * by);
        });
    }

    /// A bound on the row sums of the derivatives by the species that is followed and by those that the coefficient reads, 1/time: with
    /// a factor the largest row sum, else that of L times
    ///
    /// ```text
    /// max |D| + (max b - min b) Σ_u max |D'|
    /// ```
    #[must_use]
    pub fn bound(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        (species, signals): TransportInputs<'_>,
    ) -> f64 {
        if let Some(factors) = self.factors((sheet, time), signals) {
            let mut sums = vec![0.0; factors.len()];
            self.entries((sheet, time), operator, &mut |i, _, value| {
                sums[i] += (factors[i] * value).abs();
            });
            return parallel::max(sums.len(), |i| sums[i]);
        }
        let linear = self.spectral_bound((sheet, time), operator);
        let Some(formula) = &self.coefficient else { return linear };
        let at = At::new(self, formula, sheet, species);
        let largest = |values: &[f64]| parallel::max(values.len(), |i| values[i].abs());
        let followed = at.followed();
        let above = followed.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let below = followed.iter().copied().fold(f64::INFINITY, f64::min);
        let slopes: f64 = at.slopes(sheet).iter().map(|slope| largest(slope)).sum();
        linear * (largest(&at.d) + (above - below).max(0.0) * slopes)
    }
}
