//! `D - W J` with a Jacobian J and diagonal D and W: what linearly implicit steps and Newton's method
//! solve with.
//!
//! The matrix is not stored: its entries are computed from those of J where a factor takes them over.

use super::Sparse;

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
