//! `D - W J` with a Jacobian J and diagonal D and W: what linearly implicit steps and Newton's method
//! solve with.
//!
//! The matrix is not stored: its entries are computed from those of J where a factor takes them over.

use super::LinearError;
use super::{Displacements, Factor, LinearChoice, Sparse};
use crate::tally::Tally;

/// The entries of `D - W J`; rows are those of J.
#[derive(Clone, Copy)]
pub struct ShiftedJacobian<'a> {
    jacobian: &'a Sparse,
    diagonals: &'a (dyn Fn(usize) -> (f64, f64) + Sync),
}

impl<'a> ShiftedJacobian<'a> {
    /// With this J; `diagonals` gives the entries of D and W of an unknown.
    #[must_use]
    pub fn new(jacobian: &'a Sparse, diagonals: &'a (dyn Fn(usize) -> (f64, f64) + Sync)) -> Self {
        Self { jacobian, diagonals }
    }

    /// J.
    #[must_use]
    pub fn jacobian(self) -> &'a Sparse {
        self.jacobian
    }

    /// Columns and values of row `i`.
    pub(super) fn row(self, i: usize) -> impl Iterator<Item = (usize, f64)> + 'a {
        let (shift, weight) = (self.diagonals)(self.jacobian.unknown(i));
        self.jacobian.row(i).map(move |(j, value)| {
            let shift = if j == i { shift } else { 0.0 };
            (j, shift - weight * value)
        })
    }

    /// The entry in the row of this unknown whose value J stores in `slot`.
    pub(super) fn entry(self, unknown: usize, slot: usize, on_diagonal: bool) -> f64 {
        let (shift, weight) = (self.diagonals)(unknown);
        let shift = if on_diagonal { shift } else { 0.0 };
        shift - weight * self.jacobian.value(slot)
    }

    /// Magnitude of the diagonal entry of row `i`; 1 where it is absent or 0.
    pub(super) fn diagonal_scale(self, i: usize) -> f64 {
        let size = self.row(i).find(|&(j, _)| j == i).map_or(0.0, |(_, value)| value.abs());
        if size > 0.0 { size } else { 1.0 }
    }

    /// Whether no entry of D is 0: every row has a rate of change, none is an algebraic equation.
    pub(super) fn has_no_algebraic_rows(self) -> bool {
        (0..self.jacobian.rows()).all(|i| (self.diagonals)(i).0 != 0.0)
    }

    /// Whether all entries are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        (0..self.jacobian.rows()).all(|i| self.row(i).all(|(_, value)| value.is_finite()))
    }
}

/// A solver for such matrices with Jacobians of one pattern.
pub struct Shifted {
    factor: Factor,
}

impl Shifted {
    /// For Jacobians with the pattern of this one; `displacements` if some of the unknowns are.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(
        jacobian: &Sparse,
        choice: LinearChoice,
        displacements: Option<&Displacements>,
    ) -> Result<Self, LinearError> {
        Ok(Self { factor: Factor::new(choice, jacobian, displacements)? })
    }

    /// Solves `(D - W J) x = b` in place; `diagonals` gives the entries of D and W. One iteration of Newton's method,
    /// counted with `tally`.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular or the iteration does not converge.
    pub fn solve(
        &mut self,
        jacobian: &Sparse,
        diagonals: impl Fn(usize) -> (f64, f64) + Sync,
        x: &mut [f64],
        tally: &Tally,
    ) -> Result<(), LinearError> {
        tally.count(|work| work.newton_iterations += 1);
        self.factor.factorise(ShiftedJacobian::new(jacobian, &diagonals), tally)?;
        self.factor.solve(x, tally)
    }
}
