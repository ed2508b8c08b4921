//! The inputs of kinetics at a batch of points, as borrowed columns.

use smallvec::SmallVec;

use super::descriptor::Location;
use rumple_numerics::num::all_finite;

/// What stands in outputs before a call of a plugin, and beside them: a number that no law writes, and none that is
/// finite, so that what is left unwritten never passes for a result.
pub(crate) const UNWRITTEN_BITS: u64 = 0x7ff8_5eed_5eed_5eed;

/// One input at successive points. Stride 0 is one value for all points.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    data: &'a [f64],
    stride: usize,
}

impl<'a> Column<'a> {
    /// One value for all points.
    #[must_use]
    pub fn uniform(value: &'a f64) -> Self {
        Self { data: std::slice::from_ref(value), stride: 0 }
    }

    /// One component of interleaved values: `data[component + point · stride]`.
    #[must_use]
    #[inline]
    pub fn component(data: &'a [f64], component: usize, stride: usize) -> Self {
        Self { data: data.get(component..).unwrap_or(&[]), stride }
    }

    /// The value at a point, counted from the first of the column.
    ///
    /// # Panics
    /// Past the end.
    #[must_use]
    #[inline]
    pub fn at(&self, point: usize) -> f64 {
        self.data[point * self.stride]
    }

    /// The column from a point on.
    #[must_use]
    #[inline]
    pub fn from(&self, point: usize) -> Self {
        Self { data: self.data.get(point * self.stride..).unwrap_or(&[]), stride: self.stride }
    }

    /// The first `count` values, if they are stored one after the other.
    #[must_use]
    #[inline]
    pub fn contiguous(&self, count: usize) -> Option<&'a [f64]> {
        self.data.get(..count).filter(|_| self.stride == 1)
    }

    /// Copies the values from a point on.
    ///
    /// # Panics
    /// Past the end.
    pub(super) fn copy_to(&self, point: usize, out: &mut [f64]) {
        match self.stride {
            1 => out.copy_from_slice(&self.data[point..point + out.len()]),
            _ => out.iter_mut().enumerate().for_each(|(k, out)| *out = self.at(point + k)),
        }
    }

    /// Whether `count` points can be read.
    #[must_use]
    #[inline]
    pub fn covers(&self, count: usize) -> bool {
        match count.checked_sub(1) {
            None => true,
            Some(last) => last.checked_mul(self.stride).is_some_and(|end| end < self.data.len()),
        }
    }

    /// Whether the values at the first `count` points are finite.
    pub(super) fn is_finite(&self, count: usize) -> bool {
        match self.stride {
            0 => all_finite(&self.data[..self.data.len().min(1)]),
            1 => all_finite(&self.data[..count]),
            _ => (0..count).all(|point| self.at(point).is_finite()),
        }
    }

    /// Where the values begin to differ from the one at `start`, at or before `end`.
    pub(super) fn same_until(&self, start: usize, end: usize) -> usize {
        if self.stride == 0 {
            return end;
        }
        let value = self.at(start).to_bits();
        (start + 1..end).find(|at| self.at(*at).to_bits() != value).unwrap_or(end)
    }

    pub(super) fn parts(&self) -> (&'a [f64], usize) {
        (self.data, self.stride)
    }
}

impl<'a> From<&'a [f64]> for Column<'a> {
    fn from(data: &'a [f64]) -> Self {
        Self { data, stride: 1 }
    }
}

impl<'a> From<&'a Vec<f64>> for Column<'a> {
    fn from(data: &'a Vec<f64>) -> Self {
        data.as_slice().into()
    }
}

/// The inputs of kinetics at successive points.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// What the points are, for messages.
    pub location: Location,
    /// Number in the mesh of the first point, for messages.
    pub first: usize,
    /// How many points.
    pub count: usize,
    /// One column a species.
    pub species: &'a [Column<'a>],
    /// The columns of the signals read, in the order of the descriptor; empty for feedback. Time is a [`Column::uniform`].
    pub signals: &'a [Column<'a>],
    /// Where parameters differ from point to point: one column a parameter of the descriptor, in
    /// place of the law's own values. Else empty.
    pub parameters: &'a [Column<'a>],
}

impl Batch<'_> {
    /// Hands `count` of the points, from one on, to `evaluate`.
    pub fn with_part<R>(
        &self,
        start: usize,
        count: usize,
        evaluate: impl FnOnce(&Batch<'_>) -> R,
    ) -> R {
        evaluate(&Batch {
            location: self.location,
            first: self.first + start,
            count,
            species: &from_point(self.species, start),
            signals: &from_point(self.signals, start),
            parameters: &from_point(self.parameters, start),
        })
    }

    /// All input columns, species first.
    #[inline]
    pub fn inputs(&self) -> impl Iterator<Item = &Column<'_>> {
        self.species.iter().chain(self.signals)
    }
}

fn from_point<'a>(columns: &[Column<'a>], start: usize) -> SmallVec<[Column<'a>; 4]> {
    columns.iter().map(|column| column.from(start)).collect()
}
