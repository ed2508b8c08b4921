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
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::low_rank::LowRankUpdate;
use crate::Vec3;
use crate::effects::RankOneTerm;
use crate::linear::{BlockMatrix, LinearError, LinearSolver};
use crate::parallel;
use crate::reduction::Reduction;
use crate::solve::SolveError;
use crate::tally::Tally;

/// What a factorisation says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Count {
    /// Negative eigenvalues.
    pub(super) negative: usize,
    /// Backward error: the residual of a solve relative to the mean diagonal. 10⁻¹⁵ is usual; rows are
    /// exchanged within supernodes only, so far beyond buckling it can be much more.
    pub(super) error: f64,
}

/// A solver with its matrix, and what counts and sums.
pub(super) type Factor<'a> =
    (&'a mut (dyn LinearSolver + 'static), &'a mut BlockMatrix, &'a Tally, &'a Reduction);

/// The factor of `H + s M` and what restricts it.
pub(super) struct Restricted<'a> {
    solver: &'a mut (dyn LinearSolver + 'static),
    /// H + s M.
    shifted: &'a mut BlockMatrix,
    tally: &'a Tally,
    reduction: &'a Reduction,
    matrix: &'a BlockMatrix,
    mass: &'a [f64],
    rigid: Vec<Vec<Vec3>>,
    terms: Vec<RankOneTerm>,
    update: LowRankUpdate,
    solved: Vec<Vec<Vec3>>,
    inverse: DMatrix<f64>,
    shift: f64,
}

impl<'a> Restricted<'a> {
    /// Not yet factorised; `rigid` is orthonormal in the mass.
    pub(super) fn new(
        (solver, shifted, tally, reduction): Factor<'a>,
        matrix: &'a BlockMatrix,
        mass: &'a [f64],
        rigid: Vec<Vec<Vec3>>,
        terms: Vec<RankOneTerm>,
    ) -> Self {
        let (solved, inverse) = (Vec::new(), DMatrix::zeros(0, 0));
        let update = LowRankUpdate::default();
        Self {
            solver,
            shifted,
            tally,
            reduction,
            matrix,
            mass,
            rigid,
            terms,
            update,
            solved,
            inverse,
            shift: 0.0,
        }
    }

    /// `Σ_i m_i a_i · b_i`.
    pub(super) fn inner(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        self.reduction.sum(a.len(), |i| self.mass[i] * a[i].dot(&b[i]))
    }

    /// Brings images to what their owners have.
    pub(super) fn update_ghosts(&self, v: &mut [Vec3]) {
        self.reduction.update_ghosts(v);
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
    pub(super) fn factorise(&mut self, shift: f64) -> Result<Count, SolveError> {
        let mass = self.mass;
        self.shift = shift;
        self.tally.count(|work| work.factorisations += 1);
        self.shifted.take_shifted(self.matrix, |i| shift * mass[i]);
        let solver = &mut *self.solver;
        let unsound = || LinearError::new("a pivot of the Hessian is zero or not finite");
        solver.factorise(self.shifted, &[], false).map_err(|_| unsound())?;
        let sparse = solver.negative_eigenvalues().ok_or_else(unsound)?;
        self.update =
            LowRankUpdate::new(self.terms.clone(), self.reduction, |rhs| solver.solve(rhs));
        let more = self.update.more_negative();
        let Some(negative) = more.and_then(|more| sparse.checked_add_signed(more)) else {
            return Ok(Count { negative: sparse, error: f64::NAN });
        };
        let error = self.error();
        let count = self.rigid.len();
        if count == 0 {
            return Ok(Count { negative, error });
        }
        self.solved.clear();
        for k in 0..count {
            let mut z: Vec<Vec3> = self.rigid[k].iter().zip(mass).map(|(v, m)| *m * v).collect();
            self.solve_whole(&mut z);
            self.solved.push(z);
        }
        let entry = |a: usize, b: usize| self.inner(&self.rigid[a], &self.solved[b]);
        let gram = DMatrix::from_fn(count, count, |a, b| 0.5 * (entry(a, b) + entry(b, a)));
        let turned =
            SymmetricEigen::new(gram.clone()).eigenvalues.iter().filter(|g| **g > 0.0).count();
        // Counts that contradict each other, or a singular G, are the work of round-off.
        let (inverse, rest) = (gram.try_inverse(), (negative + turned).checked_sub(count));
        Ok(match (inverse, rest) {
            (Some(inverse), Some(negative)) => {
                self.inverse = inverse;
                Count { negative, error }
            }
            _ => Count { negative, error: f64::NAN },
        })
    }

    /// Relative residual of one solve with the last factor.
    fn error(&mut self) -> f64 {
        let (mass, shift) = (self.mass, self.shift);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let axes = self.matrix.pattern().axes();
        let mut component = |a: usize| {
            let value: f64 = random.random_range(-1.0..=1.0);
            if a < axes { value } else { 0.0 }
        };
        let rhs: Vec<Vec3> = mass.iter().map(|m| *m * Vec3::from_fn(|a, _| component(a))).collect();
        let mut y = rhs.clone();
        self.solve_whole(&mut y);
        let mut left = product(self.matrix, &y);
        self.update.add_product(&y, &mut left);
        parallel::update(&mut left, |i, v| *v += shift * mass[i] * y[i] - rhs[i]);
        let largest = |v: &[Vec3]| self.reduction.largest(v);
        largest(&left) / (self.matrix.mean_diagonal() * largest(&y) + largest(&rhs))
    }

    /// Replaces `w` by the solution on the whole space.
    fn solve_whole(&mut self, w: &mut [Vec3]) {
        self.tally.count(|work| work.solves += 1);
        self.solver.solve(w);
        self.update.correct(w);
    }

    /// Replaces `w` by the solution on the complement, which `w` need not lie in.
    pub(super) fn solve(&mut self, w: &mut [Vec3]) {
        self.solve_whole(w);
        let count = self.rigid.len();
        if count == 0 {
            return;
        }
        let along = DVector::from_fn(count, |a, _| self.inner(&self.rigid[a], w));
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

/// `H v` for the stored upper half of H.
pub(super) fn product(matrix: &BlockMatrix, v: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); v.len()];
    for i in 0..v.len() {
        let columns = matrix.pattern().row(i);
        for (block, &j) in matrix.row(i).zip(columns) {
            let j = j as usize;
            out[i] += block * v[j];
            if j != i {
                out[j] += block.tr_mul(&v[i]);
            }
        }
    }
    out
}
