//! GMRES with an incomplete factor, for matrices that diffusion dominates.

use super::LinearError;
use super::Sparse;
use super::gmres::Krylov;
use super::incomplete::Incomplete;
use super::shifted::ShiftedJacobian;

/// An incomplete factor, and the matrix in the same rows. In single precision: systems are solved to a residual of a
/// hundredth, and Newton's method corrects the rest.
pub struct Ilu {
    factor: Incomplete,
    value: Vec<f32>,
    pub(super) krylov: Krylov<f32>,
    right: Vec<f64>,
}

impl Ilu {
    /// For matrices with the pattern of this one.
    #[must_use]
    pub fn new(matrix: &Sparse) -> Self {
        let factor = Incomplete::new(matrix, 0);
        let (value, right) = (vec![0.0; factor.entries()], vec![0.0; factor.len()]);
        Self { factor, value, krylov: Krylov::default(), right }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: ShiftedJacobian<'_>) -> Result<(), LinearError> {
        let Self { factor, value, krylov, .. } = self;
        krylov.load(matrix);
        factor.load(matrix);
        value.copy_from_slice(factor.values());
        factor.eliminate()
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge; `x` is then anything.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let Self { factor, value, krylov, right } = self;
        factor.take(x, right);
        let product = |v: &[f64], out: &mut [f64]| factor.multiply(value, v, out);
        krylov.solve(product, |v| factor.substitute(v), right, x)?;
        factor.give(right, x);
        Ok(())
    }
}
