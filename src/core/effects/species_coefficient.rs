//! Transports whose coefficient reads species, by the linear one with the coefficient 1.
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
use super::{FieldValues, Operator, TransportTerm, WrongCoefficient};
use crate::Vec3;
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
        let crosses = self.term.read_species() != self.term.species();
        let right = |d: f64| d.is_finite() && (crosses || d >= 0.0);
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

    /// Numbers of the species that the coefficient reads.
    #[must_use]
    pub fn read_by_coefficient(&self) -> &[usize] {
        self.coefficient.as_ref().map_or(&[], SpeciesFormula::species)
    }

    /// Adds the rate of change to `out`.
    ///
    /// # Errors
    /// Where the coefficient or a rate in time is inadmissible.
    pub fn add_rate_of(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        species: &[&[f64]],
        out: &mut [f64],
    ) -> Result<(), WrongCoefficient> {
        let Some(formula) = &self.coefficient else {
            if let Some(wrong) = self.inadmissible((sheet, time)) {
                return Err(wrong);
            }
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
        species: &[&[f64]],
        emit: &mut dyn FnMut(usize, usize, usize, f64),
    ) {
        let by = self.read_species();
        let Some(formula) = &self.coefficient else {
            self.entries((sheet, time), operator, &mut |i, j, value| emit(i, by, j, value));
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

    /// Hands the derivatives of the rate by positions to `emit`, as [`Transport::shape_derivatives`](super::Transport::shape_derivatives).
    pub fn derivatives_by_positions(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        x: &[Vec3],
        species: &[&[f64]],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let Some(formula) = &self.coefficient else {
            return self.shape_derivatives(
                (sheet, time),
                operator,
                x,
                species[self.read_species()],
                emit,
            );
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

    /// A bound on the row sums of the derivatives by the species that is followed and by those that the coefficient reads, 1/time: that of L times
    ///
    /// ```text
    /// max |D| + (max b - min b) Σ_u max |D'|
    /// ```
    #[must_use]
    pub fn bound(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &Operator,
        species: &[&[f64]],
    ) -> f64 {
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
