//! `D - W J` with a Jacobian J and diagonal D and W: what linearly implicit steps and Newton's method
//! solve with.

use faer::sparse::{SparseColMat, SymbolicSparseColMat};

use super::LinearError;
use super::{Displacements, Factor, LinearChoice, Sparse};
use crate::tally::Tally;

/// The matrix for Jacobians of one pattern, and what solves with it.
pub struct Shifted {
    matrix: SparseColMat<usize, f64>,
    /// For every entry its place in the Jacobian, which is by rows.
    place: Vec<u32>,
    /// For every entry its row.
    row: Vec<usize>,
    /// Which entries are on the diagonal.
    diagonal: Vec<bool>,
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
        let (starts, row, place) = jacobian.by_columns();
        let n = jacobian.columns();
        let mut diagonal = vec![false; row.len()];
        for j in 0..n {
            for k in starts[j]..starts[j + 1] {
                diagonal[k] = row[k] == j;
            }
        }
        let values = vec![0.0; row.len()];
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, row.clone());
        let factor = Factor::new(choice, pattern.as_ref(), displacements)?;
        Ok(Self { matrix: SparseColMat::new(pattern, values), place, row, diagonal, factor })
    }

    /// Solves `(D - W J) x = b` in place; `row` gives the entries of D and W. One iteration of Newton's method,
    /// counted with `tally`.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular or the iteration does not converge.
    pub fn solve(
        &mut self,
        jacobian: &Sparse,
        row: impl Fn(usize) -> (f64, f64),
        x: &mut [f64],
        tally: &Tally,
    ) -> Result<(), LinearError> {
        tally.count(|work| work.newton_iterations += 1);
        let from = jacobian.values();
        for (k, value) in self.matrix.val_mut().iter_mut().enumerate() {
            let (shift, weight) = row(self.row[k]);
            let shift = if self.diagonal[k] { shift } else { 0.0 };
            *value = shift - weight * from[self.place[k] as usize];
        }
        self.factor.factorise(self.matrix.as_ref(), tally)?;
        self.factor.solve(x, tally)
    }
}
