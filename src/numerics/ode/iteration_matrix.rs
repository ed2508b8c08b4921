//! Matrices as diffsol handles them: combinations `a M + b ∂F/∂y`, of which only a and b are stored.
//!
//! diffsol keeps M, ∂F/∂y and the matrix of Newton's method, makes the last of the other two, and hands it
//! to the linear solver. The numbers stay where they are evaluated; [`NewtonSolver`] reads them there, and so
//! do products.
//!
//! [`NewtonSolver`]: super::newton::NewtonSolver

use std::ops::Mul;
use std::sync::{Arc, Mutex, PoisonError};

use diffsol::{LaError, Matrix, MatrixCommon, Scale, Vector, VectorCommon, VectorIndex};
use diffsol_la::{Dense, DenseRef};

use super::error_norm::{Grouping, Places};
use super::unknowns::Unknowns;
use crate::linear::ShiftedJacobian;
use crate::ode::{OdeError, OdeProblem};

/// `a M + b ∂F/∂y`. What diffsol does not ask of a matrix in the methods used here makes its factors NaN,
/// which the linear solver refuses.
#[derive(Debug, Clone)]
pub(super) struct IterationMatrix {
    size: [usize; 2],
    /// a and b.
    factors: [f64; 2],
    /// Where M and ∂F/∂y are; none in a matrix that was not filled.
    shared: Option<Arc<Shared>>,
    context: Grouping,
}

impl IterationMatrix {
    /// a and b.
    pub(super) fn factors(&self) -> [f64; 2] {
        self.factors
    }

    /// Sets a and b, of these M and ∂F/∂y.
    pub(super) fn set(&mut self, shared: &Arc<Shared>, factors: [f64; 2]) {
        self.shared = Some(Arc::clone(shared));
        self.factors = factors;
    }

    fn spoil(&mut self) {
        self.factors = [f64::NAN; 2];
    }
}

impl MatrixCommon for IterationMatrix {
    type V = Unknowns;
    type T = f64;
    type C = Grouping;
    type Inner = [f64; 2];

    fn nrows(&self) -> usize {
        self.size[0]
    }

    fn ncols(&self) -> usize {
        self.size[1]
    }

    fn inner(&self) -> &[f64; 2] {
        &self.factors
    }
}

impl Mul<Scale<f64>> for IterationMatrix {
    type Output = Self;

    fn mul(self, by: Scale<f64>) -> Self {
        &self * by
    }
}

impl Mul<Scale<f64>> for &IterationMatrix {
    type Output = IterationMatrix;

    fn mul(self, by: Scale<f64>) -> IterationMatrix {
        IterationMatrix { factors: self.factors.map(|factor| factor * by.value()), ..self.clone() }
    }
}

impl Matrix for IterationMatrix {
    type Sparsity = Dense<Self>;
    type SparsityRef<'a> = DenseRef<'a, Self>;

    fn sparsity(&self) -> Option<DenseRef<'_, Self>> {
        None
    }

    fn context(&self) -> &Grouping {
        &self.context
    }

    fn inner_mut(&mut self) -> &mut [f64; 2] {
        &mut self.factors
    }

    /// No row counts as one without storage: starts are made consistent before.
    fn partition_indices_by_zero_diagonal(&self) -> (Places, Places) {
        let of = |rows: Vec<usize>| Places::from_vec(rows, self.context.clone());
        (of(Vec::new()), of((0..self.size[0]).collect()))
    }

    fn gemv(&self, alpha: f64, x: &Unknowns, beta: f64, y: &mut Unknowns) {
        let Some(shared) = &self.shared else { return y.fill(f64::NAN) };
        let (x, y) = (x.inner().as_slice(), y.inner_mut().as_mut_slice());
        let product = shared.product(self.factors, x);
        for (y, product) in y.iter_mut().zip(product) {
            *y = alpha * product + if beta == 0.0 { 0.0 } else { beta * *y };
        }
    }

    fn copy_from(&mut self, other: &Self) {
        self.clone_from(other);
    }

    fn zeros(rows: usize, columns: usize, context: Grouping) -> Self {
        Self { size: [rows, columns], factors: [0.0; 2], shared: None, context }
    }

    fn new_from_sparsity(
        rows: usize,
        columns: usize,
        _: Option<Dense<Self>>,
        context: Grouping,
    ) -> Self {
        Self::zeros(rows, columns, context)
    }

    /// M, which is the identity where diffsol makes a diagonal matrix.
    fn from_diagonal(diagonal: &Unknowns) -> Self {
        let values = diagonal.inner().as_slice();
        let factor = if values.iter().all(|v| *v == 1.0) { 1.0 } else { f64::NAN };
        let size = [values.len(); 2];
        Self { size, factors: [factor, 0.0], shared: None, context: diagonal.context().clone() }
    }

    fn set_column(&mut self, _: usize, _: &Unknowns) {
        self.spoil();
    }

    fn add_column_to_vector(&self, _: usize, v: &mut Unknowns) {
        v.fill(f64::NAN);
    }

    fn add_columns_to_batched_vector(&self, v: &mut Unknowns) {
        v.fill(f64::NAN);
    }

    fn set_data_with_indices(&mut self, _: &Places, _: &Places, _: &Unknowns) {
        self.spoil();
    }

    fn gather(&mut self, _: &Self, _: &Places) {
        self.spoil();
    }

    fn scale_add_and_assign(&mut self, x: &Self, beta: f64, y: &Self) {
        self.factors = std::array::from_fn(|k| x.factors[k] + beta * y.factors[k]);
        self.shared = y.shared.clone().or_else(|| x.shared.clone());
    }

    fn triplet_iter(
        &self,
    ) -> (impl Iterator<Item = (usize, usize)> + '_, impl Iterator<Item = f64> + '_) {
        (std::iter::empty(), std::iter::empty())
    }

    fn try_from_triplets(
        _: usize,
        _: usize,
        _: Vec<(usize, usize)>,
        _: Vec<f64>,
        _: Grouping,
    ) -> Result<Self, LaError> {
        Err(LaError::Other("a combination of M and ∂F/∂y has no entries of its own".into()))
    }
}

/// What the linear solver needs as well.
pub(super) struct Shared {
    pub(super) inner: Mutex<Inner>,
    pub(super) differential: Option<Vec<bool>>,
}

pub(super) struct Inner {
    pub(super) problem: Box<dyn OdeProblem>,
    pub(super) error: Option<OdeError>,
    /// Where the last one happened.
    pub(super) failed_at: f64,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Shared {
    pub(super) fn lock(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The diagonal of M.
    pub(super) fn mass(&self, i: usize) -> f64 {
        self.differential
            .as_ref()
            .map_or(1.0, |differential| if differential[i] { 1.0 } else { 0.0 })
    }

    /// The product of `a M + b ∂F/∂y` with `x`, of the last ∂F/∂y.
    pub(super) fn product(&self, [a, b]: [f64; 2], x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        if b != 0.0 {
            self.lock().problem.last_jacobian().multiply(x, &mut product);
        }
        for (i, (product, x)) in product.iter_mut().zip(x).enumerate() {
            *product = a * self.mass(i) * x + b * *product;
        }
        product
    }

    /// Works with the matrix `a M + b ∂F/∂y`, of the last ∂F/∂y.
    pub(super) fn with_matrix<R>(
        &self,
        [a, b]: [f64; 2],
        f: impl FnOnce(ShiftedJacobian<'_>) -> R,
    ) -> R {
        let inner = self.lock();
        f(ShiftedJacobian::new(inner.problem.last_jacobian(), &|i| (a * self.mass(i), -b)))
    }
}
