//! Vectors of unknowns as diffsol handles them, with the [error norm](super::error_norm) of this program.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub, SubAssign};

use diffsol_la::{Scale, Vector, VectorCommon, VectorView, VectorViewMut};

use super::error_norm::{Grouping, Places};

/// Unknowns, or something of each of them.
#[derive(Debug, Clone)]
pub(super) struct Unknowns {
    values: Vec<f64>,
    context: Grouping,
}

/// A view of such a vector, or of a column.
#[derive(Debug)]
pub(super) struct View<'a> {
    values: &'a [f64],
    context: &'a Grouping,
}

/// A view that can be written.
#[derive(Debug)]
pub(super) struct ViewMut<'a> {
    values: &'a mut [f64],
}

impl<'a> View<'a> {
    pub(super) fn new(values: &'a [f64], context: &'a Grouping) -> Self {
        Self { values, context }
    }
}

impl<'a> ViewMut<'a> {
    pub(super) fn new(values: &'a mut [f64]) -> Self {
        Self { values }
    }
}

/// What has values, owned or not.
pub(super) trait Values {
    /// The values.
    fn values(&self) -> &[f64];
}

impl Values for Unknowns {
    fn values(&self) -> &[f64] {
        &self.values
    }
}

impl Values for View<'_> {
    fn values(&self) -> &[f64] {
        self.values
    }
}

impl<V: Values> Values for &V {
    fn values(&self) -> &[f64] {
        V::values(self)
    }
}

/// Writes `f(a, b)` into `a`.
fn each(a: &mut [f64], b: &[f64], f: impl Fn(f64, f64) -> f64) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = f(*a, *b);
    }
}

macro_rules! operators {
    ($binary:ident, $method:ident, $assign:ident, $in_place:ident, $f:expr) => {
        impl<R: Values> $binary<R> for Unknowns {
            type Output = Self;
            fn $method(mut self, by: R) -> Self {
                each(&mut self.values, by.values(), $f);
                self
            }
        }
        impl<R: Values> $binary<R> for &Unknowns {
            type Output = Unknowns;
            fn $method(self, by: R) -> Unknowns {
                $binary::$method(self.clone(), by)
            }
        }
        impl<R: Values> $binary<R> for View<'_> {
            type Output = Unknowns;
            fn $method(self, by: R) -> Unknowns {
                $binary::$method(self.into_owned(), by)
            }
        }
        impl<R: Values> $assign<R> for Unknowns {
            fn $in_place(&mut self, by: R) {
                each(&mut self.values, by.values(), $f);
            }
        }
        impl<R: Values> $assign<R> for ViewMut<'_> {
            fn $in_place(&mut self, by: R) {
                each(self.values, by.values(), $f);
            }
        }
    };
}
operators!(Add, add, AddAssign, add_assign, |a, b| a + b);
operators!(Sub, sub, SubAssign, sub_assign, |a, b| a - b);

impl MulAssign<Scale<f64>> for Unknowns {
    fn mul_assign(&mut self, by: Scale<f64>) {
        self.as_view_mut().mul_assign(by);
    }
}

impl MulAssign<Scale<f64>> for ViewMut<'_> {
    fn mul_assign(&mut self, by: Scale<f64>) {
        self.values.iter_mut().for_each(|value| *value *= by.value());
    }
}

impl Mul<Scale<f64>> for Unknowns {
    type Output = Self;
    fn mul(mut self, by: Scale<f64>) -> Self {
        self *= by;
        self
    }
}

impl Mul<Scale<f64>> for &Unknowns {
    type Output = Unknowns;
    fn mul(self, by: Scale<f64>) -> Unknowns {
        self.clone() * by
    }
}

impl Mul<Scale<f64>> for View<'_> {
    type Output = Unknowns;
    fn mul(self, by: Scale<f64>) -> Unknowns {
        self.into_owned() * by
    }
}

impl Div<Scale<f64>> for Unknowns {
    type Output = Self;
    fn div(self, by: Scale<f64>) -> Self {
        self * Scale(1.0 / by.value())
    }
}

macro_rules! common {
    ($name:ty, $inner:ty) => {
        impl<'a> VectorCommon for $name {
            type T = f64;
            type C = Grouping;
            type Inner = $inner;
            fn inner(&self) -> &$inner {
                &self.values
            }
        }
    };
}
common!(View<'a>, &'a [f64]);
common!(ViewMut<'a>, &'a mut [f64]);

impl VectorCommon for Unknowns {
    type T = f64;
    type C = Grouping;
    type Inner = Vec<f64>;

    fn inner(&self) -> &Vec<f64> {
        &self.values
    }
}

impl<'a> VectorView<'a> for View<'a> {
    type Owned = Unknowns;

    fn get_index(&self, i: usize) -> f64 {
        self.values[i]
    }

    fn squared_norm(&self, y: &Unknowns, atol: &Unknowns, rtol: f64) -> f64 {
        self.context.squared_norm(self.values, &y.values, (&atol.values, rtol))
    }

    fn into_owned(self) -> Unknowns {
        Unknowns { values: self.values.to_vec(), context: self.context.clone() }
    }
}

/// `a x + b y` in `y`, which is not read where b is 0.
pub(super) fn combine(a: f64, x: &[f64], b: f64, y: &mut [f64]) {
    if b == 0.0 {
        each(y, x, |_, x| a * x);
    } else {
        each(y, x, |y, x| a * x + b * y);
    }
}

impl<'a> VectorViewMut<'a> for ViewMut<'a> {
    type Owned = Unknowns;
    type View = View<'a>;
    type Index = Places;

    fn copy_from(&mut self, other: &Unknowns) {
        self.values.copy_from_slice(&other.values);
    }

    fn copy_from_view(&mut self, other: &View<'a>) {
        self.values.copy_from_slice(other.values);
    }

    fn axpy(&mut self, a: f64, x: &Unknowns, b: f64) {
        combine(a, &x.values, b, self.values);
    }

    fn set_index(&mut self, i: usize, value: f64) {
        self.values[i] = value;
    }

    fn fill_index(&mut self, i: usize, value: f64) {
        self.values[i] = value;
    }
}

impl Vector for Unknowns {
    type View<'a> = View<'a>;
    type ViewMut<'a> = ViewMut<'a>;
    type Index = Places;

    fn context(&self) -> &Grouping {
        &self.context
    }

    fn inner_mut(&mut self) -> &mut Vec<f64> {
        &mut self.values
    }

    fn set_index(&mut self, i: usize, value: f64) {
        self.values[i] = value;
    }

    fn fill_index(&mut self, i: usize, value: f64) {
        self.values[i] = value;
    }

    fn get_index(&self, i: usize) -> f64 {
        self.values[i]
    }

    fn norm(&self, k: i32) -> f64 {
        let sum: f64 = self.values.iter().map(|value| value.abs().powi(k)).sum();
        sum.powf(1.0 / f64::from(k))
    }

    fn squared_norm(&self, y: &Self, atol: &Self, rtol: f64) -> f64 {
        self.context.squared_norm(&self.values, &y.values, (&atol.values, rtol))
    }

    fn len(&self) -> usize {
        self.values.len()
    }

    fn from_element(len: usize, value: f64, context: Grouping) -> Self {
        Self { values: vec![value; len], context }
    }

    fn fill(&mut self, value: f64) {
        self.values.fill(value);
    }

    fn as_view(&self) -> View<'_> {
        View::new(&self.values, &self.context)
    }

    fn as_view_mut(&mut self) -> ViewMut<'_> {
        ViewMut::new(&mut self.values)
    }

    fn get_batch(&self, _: usize) -> View<'_> {
        self.as_view()
    }

    fn get_batch_mut(&mut self, _: usize) -> ViewMut<'_> {
        self.as_view_mut()
    }

    fn for_each_batch_mut_host<const M: usize, const N: usize>(
        outputs: [&mut Self; M],
        inputs: [&Self; N],
        mut f: impl FnMut([&mut [f64]; M], [&[f64]; N], usize),
    ) {
        f(outputs.map(|v| v.values.as_mut_slice()), inputs.map(|v| v.values.as_slice()), 0);
    }

    fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    fn copy_from_view(&mut self, other: &View<'_>) {
        self.values.copy_from_slice(other.values);
    }

    fn from_vec(values: Vec<f64>, context: Grouping) -> Self {
        Self { values, context }
    }

    fn from_slice(values: &[f64], context: Grouping) -> Self {
        Self { values: values.to_vec(), context }
    }

    fn clone_as_vec(&self) -> Vec<f64> {
        self.values.clone()
    }

    fn axpy(&mut self, a: f64, x: &Self, b: f64) {
        combine(a, &x.values, b, &mut self.values);
    }

    fn axpy_v(&mut self, a: f64, x: &View<'_>, b: f64) {
        combine(a, x.values, b, &mut self.values);
    }

    fn batched_axpy(&mut self, a: &Self, x: &Self, b: f64) {
        combine(a.values[0], &x.values, b, &mut self.values);
    }

    fn component_mul_assign(&mut self, other: &Self) {
        each(&mut self.values, &other.values, |a, b| a * b);
    }

    fn component_div_assign(&mut self, other: &Self) {
        each(&mut self.values, &other.values, |a, b| a / b);
    }

    /// No events are looked for.
    fn root_finding(&self, _: &Self) -> (bool, f64, i32) {
        (false, 0.0, -1)
    }

    fn assign_at_indices(&mut self, places: &Places, value: f64) {
        places.iter().for_each(|i| self.values[i] = value);
    }

    fn copy_from_indices(&mut self, other: &Self, places: &Places) {
        places.iter().for_each(|i| self.values[i] = other.values[i]);
    }

    fn gather(&mut self, other: &Self, places: &Places) {
        self.values.iter_mut().zip(places.iter()).for_each(|(value, i)| *value = other.values[i]);
    }

    fn scatter(&self, places: &Places, other: &mut Self) {
        self.values.iter().zip(places.iter()).for_each(|(value, i)| other.values[i] = *value);
    }
}
