//! Restarted GMRES, preconditioned from the right, so that the residual that is watched is the true
//! one. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003), algorithms 9.5 and 9.6.
//!
//! Where a preconditioner costs much, the preconditioned vectors are kept as well as the basis (the flexible
//! form), so that the solution does not need it once more. Where rows are of one size the basis may be kept in single
//! precision, which is far finer than the residual that is asked for.

use super::{LinearError, ShiftedJacobian};
use crate::num::single;
use crate::parallel;

/// Residual, relative to the right-hand side, at which a solution is good enough for Newton's
/// method, which corrects it, where every unknown has storage. Rows are divided by their diagonals first, so that
/// the unknowns count by their own errors, whatever their units.
const TOLERANCE: f64 = 1e-2;
/// The same where some rows are equations of equilibrium: their matrix does not come nearer to a diagonal as steps get
/// shorter, and a small residual may be that of a large error. Newton's method then fails at any step.
const TOLERANCE_OF_EQUILIBRIUM: f64 = 1e-4;
/// Iterations before the basis is dropped.
const RESTART: usize = 40;
/// Iterations after which the preconditioner has failed.
const MAX_ITERATIONS: u64 = 400;
/// Vectors of a kind that are kept for the next system: few systems need more.
const KEPT_VECTORS: usize = 8;

/// Numbers of a vector that one thread works on at a time.
const CHUNK: usize = 4096;

/// Euclidean norm.
pub fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// Scalar product: pieces in parallel, added in a fixed order.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    mixed_dot(a, b)
}

/// The same with `b` in whatever precision.
fn mixed_dot<T: Copy + Into<f64> + Sync>(a: &[f64], b: &[T]) -> f64 {
    if a.len() <= CHUNK {
        return piece(a, b);
    }
    let (first, last) = a.split_at(half(a.len()));
    let (other, rest) = b.split_at(first.len());
    let (first, last) = rayon::join(|| mixed_dot(first, other), || mixed_dot(last, rest));
    first + last
}

/// Eight sums that do not wait for one another.
#[inline]
fn piece<T: Copy + Into<f64>>(a: &[f64], b: &[T]) -> f64 {
    let mut sums = [0.0; 8];
    let (whole_a, whole_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = {
        let rest = whole_a.remainder().iter().zip(whole_b.remainder());
        rest.map(|(a, b)| a * (*b).into()).sum()
    };
    for (a, b) in whole_a.zip(whole_b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k].into();
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Half of the pieces.
fn half(n: usize) -> usize {
    n.div_ceil(CHUNK).div_ceil(2) * CHUNK
}

/// `w ← w - h v`, and then `w·next`, or `w·w`.
fn subtract_and_dot<T: StoredScalar>(w: &mut [f64], h: f64, v: &[T], next: Option<&[T]>) -> f64 {
    if w.len() <= CHUNK {
        w.iter_mut().zip(v).for_each(|(w, v)| *w -= h * (*v).into());
        return next.map_or_else(|| piece(w, w), |next| piece(w, next));
    }
    let middle = half(w.len());
    let ((w, w_last), (v, v_last)) = (w.split_at_mut(middle), v.split_at(middle));
    let (next, next_last) = match next.map(|next| next.split_at(middle)) {
        Some((next, last)) => (Some(next), Some(last)),
        None => (None, None),
    };
    let (first, last) = rayon::join(
        || subtract_and_dot(w, h, v, next),
        || subtract_and_dot(w_last, h, v_last, next_last),
    );
    first + last
}

/// How vectors are kept. In single precision only where the unknowns of a row count alike: what is lost of a soft mode
/// of a sheet would be a large force.
pub(super) trait StoredScalar: Copy + Default + Into<f64> + Send + Sync {
    /// Whether digits are lost; then memory counts, and the basis alone is kept.
    const LOSES_DIGITS: bool;

    /// From double precision.
    fn from_f64(value: f64) -> Self;
}

impl StoredScalar for f64 {
    const LOSES_DIGITS: bool = false;

    fn from_f64(value: f64) -> Self {
        value
    }
}

impl StoredScalar for f32 {
    const LOSES_DIGITS: bool = true;

    fn from_f64(value: f64) -> Self {
        single(value)
    }
}

/// Room for the vectors, kept from one system to the next.
#[derive(Default)]
pub(super) struct Krylov<T: StoredScalar> {
    /// Whether rows without storage are among those of the last matrix.
    equilibrium: bool,
    basis: Vec<Vec<T>>,
    /// The basis after the preconditioner, in the flexible form.
    preconditioned_basis: Vec<Vec<T>>,
    /// The vector that becomes the next of the basis.
    next: Vec<f64>,
    /// Of the last system.
    pub(super) iterations: u64,
}

impl<T: StoredScalar> Krylov<T> {
    /// Takes from a matrix how exact its solutions have to be.
    pub(super) fn set_tolerance(&mut self, matrix: ShiftedJacobian<'_>) {
        self.equilibrium = !matrix.has_no_algebraic_rows();
    }

    /// Solves `A x = b`, from x = 0; `x` is b before and the solution after. `preconditioned` is memory of the same size.
    ///
    /// # Errors
    /// [`LinearError`] if the residual does not fall far enough.
    pub(super) fn solve(
        &mut self,
        multiply: impl FnMut(&[f64], &mut [f64]),
        precondition: impl FnMut(&mut [f64]),
        x: &mut [f64],
        preconditioned: &mut [f64],
    ) -> Result<(), LinearError> {
        let result = self.iterate(multiply, precondition, x, preconditioned);
        self.basis.truncate(KEPT_VECTORS);
        self.preconditioned_basis.truncate(KEPT_VECTORS);
        result
    }

    fn iterate(
        &mut self,
        mut multiply: impl FnMut(&[f64], &mut [f64]),
        mut precondition: impl FnMut(&mut [f64]),
        x: &mut [f64],
        preconditioned: &mut [f64],
    ) -> Result<(), LinearError> {
        // The residual, where a basis begins.
        self.next.clear();
        self.next.extend_from_slice(x);
        let mut size = norm(&self.next);
        let tolerance = if self.equilibrium { TOLERANCE_OF_EQUILIBRIUM } else { TOLERANCE };
        let goal = tolerance * size;
        self.iterations = 0;
        // The right-hand side of systems that need a second basis.
        let mut b: Option<Vec<f64>> = None;
        loop {
            if size <= goal {
                return Ok(());
            }
            if self.iterations >= MAX_ITERATIONS || !size.is_finite() {
                return Err(LinearError::new(format!(
                    "the linear solver has a residual of {:.1e} after {} iterations",
                    size / (goal / tolerance),
                    self.iterations
                )));
            }
            let hessenberg =
                self.arnoldi(&mut multiply, &mut precondition, preconditioned, (size, goal));
            let (y, left) = (hessenberg.solve(), hessenberg.residual());
            // Of vectors that were rounded the residual is computed where it is to be small.
            let known = !(T::LOSES_DIGITS && self.equilibrium);
            let done = known && left <= goal && y.iter().all(|y| y.is_finite());
            if b.is_none() {
                b = (!done).then(|| x.to_vec());
                x.fill(0.0);
            }
            self.add(&y, &mut precondition, x, preconditioned);
            let Some(b) = b.as_ref().filter(|_| !done) else { return Ok(()) };
            multiply(x, &mut self.next);
            parallel::update(&mut self.next, |i, r| *r = b[i] - *r);
            size = norm(&self.next);
        }
    }

    /// Arnoldi's basis from the residual `next` of norm `size`, until that is below `goal`: the triangle that Givens
    /// rotations make of its Hessenberg matrix.
    fn arnoldi(
        &mut self,
        multiply: &mut impl FnMut(&[f64], &mut [f64]),
        precondition: &mut impl FnMut(&mut [f64]),
        preconditioned: &mut [f64],
        (size, goal): (f64, f64),
    ) -> TriangularHessenberg {
        let n = preconditioned.len();
        let Self { basis: all, preconditioned_basis: all_preconditioned, next, iterations, .. } =
            self;
        parallel::fill(room(all, 0, n), |i| T::from_f64(next[i] / size));
        let mut hessenberg = TriangularHessenberg::new(size);
        for k in 0..RESTART {
            let basis = &all[k];
            parallel::fill(preconditioned, |i| basis[i].into());
            precondition(preconditioned);
            if !T::LOSES_DIGITS {
                parallel::fill(room(all_preconditioned, k, n), |i| T::from_f64(preconditioned[i]));
            }
            multiply(preconditioned, next);
            *iterations += 1;
            let known = &all[..=k];
            let mut column = vec![mixed_dot(next, &known[0])];
            for i in 0..=k {
                let then = known.get(i + 1).map(Vec::as_slice);
                column.push(subtract_and_dot(next, column[i], &known[i], then));
            }
            let last = column.pop().unwrap_or_default().sqrt();
            let left = hessenberg.push(column, last);
            if left <= goal || last == 0.0 || !last.is_finite() {
                break;
            }
            parallel::fill(room(all, k + 1, n), |i| T::from_f64(next[i] / last));
        }
        hessenberg
    }

    /// Adds the sum of the basis with the weights `y` to `x`, after the preconditioner.
    fn add(
        &self,
        y: &[f64],
        precondition: &mut impl FnMut(&mut [f64]),
        x: &mut [f64],
        preconditioned: &mut [f64],
    ) {
        let sum = |of: &[Vec<T>], i: usize| -> f64 {
            of[..y.len()].iter().zip(y).map(|(v, y)| y * v[i].into()).sum()
        };
        if T::LOSES_DIGITS {
            parallel::fill(preconditioned, |i| sum(&self.basis, i));
            precondition(preconditioned);
            parallel::update(x, |i, x| *x += preconditioned[i]);
        } else {
            parallel::update(x, |i, x| *x += sum(&self.preconditioned_basis, i));
        }
    }
}

/// The Hessenberg matrix of a basis, made triangular by Givens rotations as it grows, with its right-hand side.
struct TriangularHessenberg {
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
    right: Vec<f64>,
}

impl TriangularHessenberg {
    /// For a residual of this `size`.
    fn new(size: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), right: vec![size] }
    }

    /// Adds a column with `last` below its diagonal; the residual that is left.
    fn push(&mut self, mut column: Vec<f64>, last: f64) -> f64 {
        let k = self.columns.len();
        for (i, (c, s)) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let length = column[k].hypot(last);
        let (c, s) = if length > 0.0 { (column[k] / length, last / length) } else { (1.0, 0.0) };
        column[k] = length;
        self.rotations.push((c, s));
        self.columns.push(column);
        self.right.push(-s * self.right[k]);
        self.right[k] *= c;
        self.residual()
    }

    /// The residual of the least-squares solution.
    fn residual(&self) -> f64 {
        self.right.last().map_or(0.0, |last| last.abs())
    }

    /// The shares of the basis, by backward substitution.
    fn solve(&self) -> Vec<f64> {
        let m = self.columns.len();
        let mut y = self.right[..m].to_vec();
        for i in (0..m).rev() {
            for j in i + 1..m {
                y[i] -= self.columns[j][i] * y[j];
            }
            y[i] /= self.columns[i][i];
        }
        y
    }
}

/// Vector number `k`, made if there is none.
fn room<T: StoredScalar>(all: &mut Vec<Vec<T>>, k: usize, n: usize) -> &mut Vec<T> {
    while all.len() <= k {
        all.push(Vec::new());
    }
    all[k].resize(n, T::default());
    &mut all[k]
}
