//! Second derivatives of low rank on top of a sparse matrix, by its inverse.
//!
//! ```text
//! B = A + D S Dᵀ,   Z = A⁻¹ D,   C = S⁻¹ + Dᵀ Z
//! B⁻¹ b = w - Z C⁻¹ Dᵀ w,   w = A⁻¹ b                        (Woodbury)
//! negative(B) = negative(A) + positive(C) - positive(S)      (Haynsworth)
//! ```
//!
//! D one column a term, S its stiffnesses. Of a preconditioner that is not quite A⁻¹ this is the same
//! update.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::Vec3;
use crate::effects::RankOneTerm;
use crate::parallel;
use crate::reduction::Reduction;

/// What terms of low rank change in the solutions with a factor.
#[derive(Debug, Default)]
pub(super) struct LowRankUpdate {
    terms: Vec<RankOneTerm>,
    /// Z.
    solved: Vec<Vec<Vec3>>,
    /// C⁻¹; none where C is singular.
    inverse: Option<DMatrix<f64>>,
    /// `positive(C) - positive(S)`.
    turned: isize,
    reduction: Reduction,
}

impl LowRankUpdate {
    /// Of `terms`; `solve` replaces a vector by its solution with A.
    pub(super) fn new(
        mut terms: Vec<RankOneTerm>,
        reduction: &Reduction,
        mut solve: impl FnMut(&mut [Vec3]),
    ) -> Self {
        terms.retain(|term| term.stiffness != 0.0);
        let count = terms.len();
        if count == 0 {
            return Self::default();
        }
        let mut solved = Vec::with_capacity(count);
        for term in &terms {
            let mut z = term.direction.clone();
            solve(&mut z);
            solved.push(z);
        }
        let entry = |a: usize, b: usize| reduction.dot(&terms[a].direction, &solved[b]);
        let small = DMatrix::from_fn(count, count, |a, b| {
            let own = if a == b { 1.0 / terms[a].stiffness } else { 0.0 };
            own + 0.5 * (entry(a, b) + entry(b, a))
        });
        let above = |values: &mut dyn Iterator<Item = f64>| values.filter(|v| *v > 0.0).count();
        let c = above(&mut SymmetricEigen::new(small.clone()).eigenvalues.iter().copied());
        let s = above(&mut terms.iter().map(|term| term.stiffness));
        let turned = c.cast_signed() - s.cast_signed();
        let inverse = small.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()));
        Self { terms, solved, inverse, turned, reduction: reduction.clone() }
    }

    /// The terms.
    pub(super) fn terms(&self) -> &[RankOneTerm] {
        &self.terms
    }

    /// Whether B is positive where A is.
    pub(super) fn is_positive(&self) -> bool {
        self.terms.is_empty() || self.inverse.is_some() && self.turned == 0
    }

    /// `negative(B) - negative(A)`; `None` where B is singular.
    pub(super) fn more_negative(&self) -> Option<isize> {
        (self.terms.is_empty() || self.inverse.is_some()).then_some(self.turned)
    }

    /// Turns the solution with A into the one with B.
    pub(super) fn correct(&self, w: &mut [Vec3]) {
        let Some(inverse) = &self.inverse else { return };
        let along = DVector::from_fn(self.terms.len(), |a, _| {
            self.reduction.dot(&self.terms[a].direction, w)
        });
        let share = inverse * along;
        for (z, share) in self.solved.iter().zip(share.iter()) {
            parallel::update(w, |i, w| *w -= *share * z[i]);
        }
    }

    /// Adds `D S Dᵀ v` to `out`.
    pub(super) fn add_product(&self, v: &[Vec3], out: &mut [Vec3]) {
        for term in &self.terms {
            let share = term.stiffness * self.reduction.dot(&term.direction, v);
            parallel::update(out, |i, out| *out += share * term.direction[i]);
        }
    }
}
