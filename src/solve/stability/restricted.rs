//! The Hessian on the complement of the rigid motions, by its factor on the whole space.
//!
//! ```text
//! A = H + s M,   V the rigid motions, Vᵀ M V = 1,   Z = A⁻¹ M V,   G = Vᵀ M Z
//! negative(A on the complement) = negative(A) + negative(-G) - k
//! (A on the complement)⁻¹ b     = w - Z G⁻¹ Vᵀ M w,   w = A⁻¹ b
//! ```
//!
//! the inertia of the bordered matrix `[A, M V; Vᵀ M, 0]` by its Schur complement (Haynsworth, Linear
//! Algebra Appl. 1 (1968) 73). So it does not matter on which side of 0 the force left by the
//! relaxation puts the rigid motions.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::product;
use crate::Vec3;
use crate::parallel;
use crate::solve::SolveError;
use crate::solve::linear::{BlockLdlt, BlockMatrix};

/// Largest residual of a solve, relative, that still counts as a sound factor; 10⁻¹⁵ is usual.
const SOUND: f64 = 1e-11;

/// The factor of `H + s M` and what restricts it.
pub(super) struct Restricted<'a> {
    ldlt: &'a mut BlockLdlt,
    matrix: &'a BlockMatrix,
    mass: &'a [f64],
    rigid: Vec<Vec<Vec3>>,
    solved: Vec<Vec<Vec3>>,
    inverse: DMatrix<f64>,
    shift: f64,
}

/// `Σ_i m_i a_i · b_i`.
pub(super) fn inner(mass: &[f64], a: &[Vec3], b: &[Vec3]) -> f64 {
    parallel::sum(a.len(), |i| mass[i] * a[i].dot(&b[i]))
}

fn unsound(what: &str) -> SolveError {
    SolveError::Factorisation(format!("the indefinite factor of the Hessian is {what}"))
}

impl<'a> Restricted<'a> {
    /// Not yet factorised; `rigid` is orthonormal in the mass.
    pub(super) fn new(
        ldlt: &'a mut BlockLdlt,
        matrix: &'a BlockMatrix,
        mass: &'a [f64],
        rigid: Vec<Vec<Vec3>>,
    ) -> Self {
        let (solved, inverse) = (Vec::new(), DMatrix::zeros(0, 0));
        Self { ldlt, matrix, mass, rigid, solved, inverse, shift: 0.0 }
    }

    /// The mass of every vertex.
    pub(super) fn mass(&self) -> &'a [f64] {
        self.mass
    }

    /// s of the last factorisation.
    pub(super) fn shift(&self) -> f64 {
        self.shift
    }

    /// Factorises `H + shift M` and counts the negative eigenvalues of its restriction.
    pub(super) fn factorise(&mut self, shift: f64) -> Result<usize, SolveError> {
        let mass = self.mass;
        self.shift = shift;
        let negative = self.ldlt.factorise(self.matrix, |i| shift * mass[i])?;
        self.check()?;
        let count = self.rigid.len();
        if count == 0 {
            return Ok(negative);
        }
        self.solved.clear();
        for v in &self.rigid {
            let mut z: Vec<Vec3> = (0..v.len()).map(|i| mass[i] * v[i]).collect();
            self.ldlt.solve(&mut z);
            self.solved.push(z);
        }
        let entry = |a: usize, b: usize| inner(mass, &self.rigid[a], &self.solved[b]);
        let gram = DMatrix::from_fn(count, count, |a, b| 0.5 * (entry(a, b) + entry(b, a)));
        let turned =
            SymmetricEigen::new(gram.clone()).eigenvalues.iter().filter(|g| **g > 0.0).count();
        self.inverse = gram.try_inverse().ok_or_else(|| unsound("singular on rigid motions"))?;
        (negative + turned).checked_sub(count).ok_or_else(|| unsound("contradicting itself"))
    }

    /// Compares `A x` with the right-hand side for one solve.
    fn check(&mut self) -> Result<(), SolveError> {
        let (mass, shift) = (self.mass, self.shift);
        let rhs: Vec<Vec3> = mass.iter().map(|m| Vec3::repeat(*m)).collect();
        let mut y = rhs.clone();
        self.ldlt.solve(&mut y);
        let mut left = product(self.matrix, &y);
        parallel::update(&mut left, |i, v| *v += shift * mass[i] * y[i] - rhs[i]);
        let largest = |v: &[Vec3]| parallel::max(v.len(), |i| v[i].norm_squared()).sqrt();
        let scale = self.matrix.mean_diagonal() * largest(&y) + largest(&rhs);
        if largest(&left) <= SOUND * scale { Ok(()) } else { Err(unsound("spoilt by round-off")) }
    }

    /// Replaces `w` by the solution on the complement, which `w` need not lie in.
    pub(super) fn solve(&mut self, w: &mut [Vec3]) {
        self.ldlt.solve(w);
        let count = self.rigid.len();
        if count == 0 {
            return;
        }
        let along = DVector::from_fn(count, |a, _| inner(self.mass, &self.rigid[a], w));
        let share = &self.inverse * along;
        for (z, share) in self.solved.iter().zip(share.iter()) {
            parallel::update(w, |i, w| *w -= *share * z[i]);
        }
    }

    /// The rigid motions.
    pub(super) fn rigid(&self) -> &[Vec<Vec3>] {
        &self.rigid
    }
}
