//! GMRES with an incomplete factor, for matrices that diffusion dominates.

use super::LinearError;
use super::Sparse;
use super::gmres::Krylov;
use super::incomplete::Incomplete;
use super::shifted::Difference;
use crate::num::index;
use crate::parallel;

/// An incomplete factor, and the matrix in the same rows: whole rows, as short loops over their halves cost
/// more than their columns.
pub struct Ilu {
    factor: Incomplete,
    column: Vec<u32>,
    value: Vec<f64>,
    pub(super) krylov: Krylov,
    right: Vec<f64>,
}

impl Ilu {
    /// For matrices with the pattern of this one.
    #[must_use]
    pub fn new(matrix: &Sparse) -> Self {
        let factor = Incomplete::new(matrix, 0);
        let mut column = Vec::with_capacity(factor.places(factor.len()).start);
        for i in 0..factor.len() {
            column.extend_from_slice(factor.lower.row(i).0);
            column.push(index(i));
            column.extend_from_slice(factor.upper.row(i).0);
        }
        let (value, right) = (vec![0.0; column.len()], vec![0.0; factor.len()]);
        Self { factor, column, value, krylov: Krylov::default(), right }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: Difference<'_>) -> Result<(), LinearError> {
        let Self { factor, value, krylov, .. } = self;
        krylov.load(matrix);
        factor.load(matrix);
        for i in 0..factor.len() {
            let (lower, upper) = (factor.lower.row(i).1, factor.upper.row(i).1);
            let row = &mut value[factor.places(i)];
            row[..lower.len()].copy_from_slice(lower);
            row[lower.len()] = factor.pivot[i];
            row[lower.len() + 1..].copy_from_slice(upper);
        }
        factor.eliminate()
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let Self { factor, column, value, krylov, right } = self;
        factor.take(x, right);
        let product = |v: &[f64], out: &mut [f64]| {
            parallel::fill(out, |i| {
                let places = factor.places(i);
                let columns = column[places.clone()].iter();
                value[places].iter().zip(columns).map(|(value, &j)| value * v[j as usize]).sum()
            });
        };
        krylov.solve(product, |v| factor.substitute(v), right)?;
        factor.give(right, x);
        Ok(())
    }
}
