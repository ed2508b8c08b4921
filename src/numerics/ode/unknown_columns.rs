//! Dense columns of unknowns: differences of BDF, stages of Runge-Kutta methods.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

use diffsol_la::{
    DefaultDenseMatrix, Dense, DenseMatrix, DenseRef, LaError, Matrix, MatrixCommon, Scale, Vector,
    VectorCommon, VectorIndex,
};

use super::error_norm::{Grouping, Places};
use super::unknowns::{Unknowns, View, ViewMut, combine};

/// Columns, one after the other.
#[derive(Debug, Clone)]
pub(super) struct UnknownColumns {
    size: [usize; 2],
    values: Vec<f64>,
    context: Grouping,
}

impl UnknownColumns {
    fn column_values(&self, j: usize) -> &[f64] {
        &self.values[j * self.size[0]..][..self.size[0]]
    }

    fn column_values_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * self.size[0]..][..self.size[0]]
    }

    /// `self[:, to] = f(self[:, to], self[:, from])`.
    fn between(&mut self, to: usize, from: usize, f: impl Fn(f64, f64) -> f64) {
        let rows = self.size[0];
        for i in 0..rows {
            self.values[to * rows + i] =
                f(self.values[to * rows + i], self.values[from * rows + i]);
        }
    }

    fn zip(&mut self, other: &Self, f: impl Fn(f64, f64) -> f64) {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a = f(*a, *b));
    }
}

impl MatrixCommon for UnknownColumns {
    type V = Unknowns;
    type T = f64;
    type C = Grouping;
    type Inner = Vec<f64>;

    fn nrows(&self) -> usize {
        self.size[0]
    }

    fn ncols(&self) -> usize {
        self.size[1]
    }

    fn inner(&self) -> &Vec<f64> {
        &self.values
    }
}

impl AddAssign<&Self> for UnknownColumns {
    fn add_assign(&mut self, by: &Self) {
        self.zip(by, |a, b| a + b);
    }
}

impl SubAssign<&Self> for UnknownColumns {
    fn sub_assign(&mut self, by: &Self) {
        self.zip(by, |a, b| a - b);
    }
}

impl Add<&Self> for UnknownColumns {
    type Output = Self;
    fn add(mut self, by: &Self) -> Self {
        self += by;
        self
    }
}

impl Sub<&Self> for UnknownColumns {
    type Output = Self;
    fn sub(mut self, by: &Self) -> Self {
        self -= by;
        self
    }
}

impl Mul<Scale<f64>> for UnknownColumns {
    type Output = Self;
    fn mul(mut self, by: Scale<f64>) -> Self {
        self.values.iter_mut().for_each(|value| *value *= by.value());
        self
    }
}

impl Mul<Scale<f64>> for &UnknownColumns {
    type Output = UnknownColumns;
    fn mul(self, by: Scale<f64>) -> UnknownColumns {
        self.clone() * by
    }
}

impl Matrix for UnknownColumns {
    type Sparsity = Dense<Self>;
    type SparsityRef<'a> = DenseRef<'a, Self>;

    fn sparsity(&self) -> Option<DenseRef<'_, Self>> {
        None
    }

    fn context(&self) -> &Grouping {
        &self.context
    }

    fn inner_mut(&mut self) -> &mut Vec<f64> {
        &mut self.values
    }

    fn partition_indices_by_zero_diagonal(&self) -> (Places, Places) {
        let rows = self.size[0];
        let (zero, other) = (0..rows).partition(|i| self.values[i * rows + i] == 0.0);
        let of = |rows| Places::from_vec(rows, self.context.clone());
        (of(zero), of(other))
    }

    fn gemv(&self, alpha: f64, x: &Unknowns, beta: f64, y: &mut Unknowns) {
        *y *= Scale(beta);
        for (j, x) in x.inner().iter().enumerate() {
            combine(alpha * x, self.column_values(j), 1.0, y.inner_mut());
        }
    }

    fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    fn zeros(rows: usize, columns: usize, context: Grouping) -> Self {
        Self { size: [rows, columns], values: vec![0.0; rows * columns], context }
    }

    fn new_from_sparsity(
        rows: usize,
        columns: usize,
        _: Option<Dense<Self>>,
        context: Grouping,
    ) -> Self {
        Self::zeros(rows, columns, context)
    }

    fn from_diagonal(diagonal: &Unknowns) -> Self {
        let rows = diagonal.len();
        let mut all = Self::zeros(rows, rows, diagonal.context().clone());
        for (i, value) in diagonal.inner().iter().enumerate() {
            all.values[i * rows + i] = *value;
        }
        all
    }

    fn set_column(&mut self, j: usize, v: &Unknowns) {
        self.column_values_mut(j).copy_from_slice(v.inner());
    }

    fn add_column_to_vector(&self, j: usize, v: &mut Unknowns) {
        combine(1.0, self.column_values(j), 1.0, v.inner_mut());
    }

    /// There are no batches but that of a single column.
    fn add_columns_to_batched_vector(&self, v: &mut Unknowns) {
        self.add_column_to_vector(0, v);
    }

    fn set_data_with_indices(&mut self, to: &Places, from: &Places, data: &Unknowns) {
        to.iter().zip(from.iter()).for_each(|(to, from)| self.values[to] = data.inner()[from]);
    }

    fn gather(&mut self, other: &Self, places: &Places) {
        self.values.iter_mut().zip(places.iter()).for_each(|(value, i)| *value = other.values[i]);
    }

    fn scale_add_and_assign(&mut self, x: &Self, beta: f64, y: &Self) {
        self.values.copy_from_slice(&x.values);
        self.zip(y, |a, b| a + beta * b);
    }

    fn triplet_iter(
        &self,
    ) -> (impl Iterator<Item = (usize, usize)> + '_, impl Iterator<Item = f64> + '_) {
        let [rows, columns] = self.size;
        let places = (0..columns).flat_map(move |j| (0..rows).map(move |i| (i, j)));
        (places, self.values.iter().copied())
    }

    fn try_from_triplets(
        rows: usize,
        columns: usize,
        places: Vec<(usize, usize)>,
        values: Vec<f64>,
        context: Grouping,
    ) -> Result<Self, LaError> {
        let mut all = Self::zeros(rows, columns, context);
        for ((i, j), value) in places.into_iter().zip(values) {
            all.values[j * rows + i] = value;
        }
        Ok(all)
    }
}

impl DenseMatrix for UnknownColumns {
    fn update_backward_diff(&mut self, order: usize, d: &Unknowns) {
        self.set_column(order + 2, d);
        self.between(order + 2, order + 1, |d, last| d - last);
        for i in (0..=order + 1).rev() {
            self.between(i, i + 1, |a, b| a + b);
        }
    }

    fn mul_cols_by(&mut self, columns: usize, by: &[f64]) {
        let rows = self.size[0];
        let old = self.values[..rows * columns].to_vec();
        for j in 0..columns {
            let column = self.column_values_mut(j);
            column.fill(0.0);
            for (k, factor) in by[j * columns..][..columns].iter().enumerate() {
                combine(*factor, &old[k * rows..][..rows], 1.0, column);
            }
        }
    }

    fn gemv_cols(
        &self,
        start: usize,
        end: usize,
        alpha: f64,
        x: &[f64],
        beta: f64,
        y: &mut Unknowns,
    ) {
        let y = y.inner_mut();
        if beta == 0.0 {
            y.fill(0.0);
        } else if beta != 1.0 {
            y.iter_mut().for_each(|y| *y *= beta);
        }
        for (j, x) in (start..end).zip(x) {
            combine(alpha * x, self.column_values(j), 1.0, y);
        }
    }

    fn column(&self, j: usize) -> View<'_> {
        View::new(self.column_values(j), &self.context)
    }

    fn column_mut(&mut self, j: usize) -> ViewMut<'_> {
        let rows = self.size[0];
        ViewMut::new(&mut self.values[j * rows..][..rows])
    }

    fn set_index(&mut self, i: usize, j: usize, value: f64) {
        self.column_values_mut(j)[i] = value;
    }

    fn set_index_batch(&mut self, _: usize, i: usize, j: usize, value: f64) {
        self.column_values_mut(j)[i] = value;
    }

    fn get_index(&self, i: usize, j: usize) -> f64 {
        self.column_values(j)[i]
    }

    fn resize_cols(&mut self, columns: usize) {
        self.values.resize(self.size[0] * columns, 0.0);
        self.size[1] = columns;
    }

    fn from_vec(rows: usize, columns: usize, values: Vec<f64>, context: Grouping) -> Self {
        Self { size: [rows, columns], values, context }
    }
}

impl DefaultDenseMatrix for Unknowns {
    type M = UnknownColumns;
}
