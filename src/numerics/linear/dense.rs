//! LU with partial pivoting of matrices of few rows, stored in full: no pattern, no ordering, no search.

use nalgebra::{DMatrix, DVectorViewMut, Dyn, LU};

use super::LinearError;
use super::shifted::ShiftedJacobian;

/// An LU factor of a small matrix.
#[derive(Default)]
pub struct SmallLu(Option<LU<f64, Dyn, Dyn>>);

impl SmallLu {
    /// Rows up to which a factor in full costs less than the bookkeeping of a sparse one.
    pub(super) const MAX_ROWS: usize = 16;

    /// Factorises a matrix.
    ///
    /// # Errors
    /// [`LinearError`] for one with numbers that are not finite. One that is singular shows in the solution.
    pub fn factorise(&mut self, matrix: ShiftedJacobian<'_>) -> Result<(), LinearError> {
        let (n, m) = (matrix.jacobian().rows(), matrix.jacobian().columns());
        let mut full = DMatrix::<f64>::zeros(n, m);
        for i in 0..n {
            matrix.row(i).for_each(|(j, value)| full[(i, j)] += value);
        }
        self.0 = None;
        if !full.iter().all(|v| v.is_finite()) {
            let text = "the Newton matrix has entries that are not finite";
            return Err(LinearError::new(text));
        }
        self.0 = Some(full.lu());
        Ok(())
    }

    /// Solves in place.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let Some(factor) = &self.0 else {
            return Err(LinearError::new("the matrix is not factorised"));
        };
        let n = x.len();
        let solved = factor.solve_mut(&mut DVectorViewMut::from_slice(x, n));
        if solved && x.iter().all(|v| v.is_finite()) {
            Ok(())
        } else {
            Err(LinearError::new("the Newton matrix is singular"))
        }
    }
}
