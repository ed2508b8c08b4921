//! GMRES with an incomplete factor, for matrices that diffusion dominates.

use super::LinearError;
use super::Sparse;
use super::gmres::Krylov;
use super::incomplete_lu::IncompleteLu;
use super::shifted::ShiftedJacobian;

/// GMRES preconditioned by ILU(0): the incomplete factor, and the matrix in the same rows. In single precision: systems
/// are solved to a residual of a hundredth, and Newton's method corrects the rest.
pub struct IluGmres {
    factor: IncompleteLu,
    value: Vec<f32>,
    pub(super) krylov: Krylov<f32>,
    right: Vec<f64>,
}

impl IluGmres {
    /// For matrices with the pattern of this one.
    #[must_use]
    pub fn new(matrix: &Sparse) -> Self {
        let factor = IncompleteLu::new(matrix, 0);
        let (value, right) = (vec![0.0; factor.entry_count()], vec![0.0; factor.len()]);
        Self { factor, value, krylov: Krylov::default(), right }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: ShiftedJacobian<'_>) -> Result<(), LinearError> {
        let Self { factor, value, krylov, .. } = self;
        krylov.set_tolerance(matrix);
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
        factor.rhs_to_rows(x, right);
        let product = |v: &[f64], out: &mut [f64]| factor.multiply(value, v, out);
        krylov.solve(product, |v| factor.substitute(v), right, x)?;
        factor.rows_to_unknowns(right, x);
        Ok(())
    }
}
