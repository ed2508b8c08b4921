//! GMRES with an incomplete factor, for matrices that diffusion dominates.

use super::LinearError;
use super::Sparse;
use super::gmres::Krylov;
use super::incomplete::Incomplete;
use super::shifted::Difference;
use crate::parallel;

/// An incomplete factor, and the matrix in the same rows and the same pattern.
pub struct Ilu {
    factor: Incomplete,
    lower: Vec<f64>,
    diagonal: Vec<f64>,
    upper: Vec<f64>,
    pub(super) krylov: Krylov,
    right: Vec<f64>,
}

impl Ilu {
    /// For matrices with the pattern of this one.
    #[must_use]
    pub fn new(matrix: &Sparse) -> Self {
        let factor = Incomplete::new(matrix, 0);
        let right = vec![0.0; factor.len()];
        let (lower, diagonal, upper) = (Vec::new(), Vec::new(), Vec::new());
        Self { factor, lower, diagonal, upper, krylov: Krylov::default(), right }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: Difference<'_>) -> Result<(), LinearError> {
        self.factor.load(matrix);
        self.lower.clone_from(&self.factor.lower.value);
        self.diagonal.clone_from(&self.factor.pivot);
        self.upper.clone_from(&self.factor.upper.value);
        self.factor.eliminate()
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let Self { factor, lower, diagonal, upper, krylov, right } = self;
        factor.take(x, right);
        let product = |v: &[f64], out: &mut [f64]| {
            parallel::fill(out, |i| {
                let below = factor.lower.row(i, lower);
                let sum = below.fold(0.0, |sum, (j, value)| sum + value * v[j]);
                let above = factor.upper.row(i, upper);
                above.fold(sum + diagonal[i] * v[i], |sum, (j, value)| sum + value * v[j])
            });
        };
        krylov.solve(product, |v| factor.substitute(v), right)?;
        factor.give(right, x);
        Ok(())
    }
}
