//! A symmetric matrix of blocks over the vertices of a mesh, in a fixed pattern.
//!
//! Only blocks (i, j) with j ≥ i are stored, row by row. Which there are is up to those who add to it:
//! vertices up to so many edges apart, and single pairs. Blocks are 3×3; where vertices move in a plane
//! z = const they are 2×2. Who adds or reads sees 3×3 blocks all the same: of what is added the third row
//! and column are dropped, and read as 0.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

use super::BlockPattern;
use crate::Vec3;
use crate::parallel::BLOCK;
use crate::record::Malformed;

/// One 3×3 block.
pub type Block = nalgebra::Matrix3<f64>;

/// One 2×2 block.
pub type PlaneBlock = nalgebra::Matrix2<f64>;

/// The blocks of a matrix, one after the other.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum BlockValues {
    /// Of a matrix in space.
    Space(Vec<Block>),
    /// Of one in a plane.
    Plane(Vec<PlaneBlock>),
}

/// Some of them being filled: one of the two is empty. The check of bounds that every access makes
/// anyhow then says which, so that matrices in space do not pay for those in a plane.
pub(super) struct ValuesMut<'a> {
    pub(super) space: &'a mut [Block],
    pub(super) plane: &'a mut [PlaneBlock],
}

impl<'a> ValuesMut<'a> {
    /// The first `count`, and the others.
    pub(super) fn split_at(self, count: usize) -> (Self, Self) {
        let (space, plane) = (count.min(self.space.len()), count.min(self.plane.len()));
        let (space, plane) = (self.space.split_at_mut(space), self.plane.split_at_mut(plane));
        (Self { space: space.0, plane: plane.0 }, Self { space: space.1, plane: plane.1 })
    }

    /// The same for a while.
    #[inline(always)]
    pub(super) fn reborrow(&mut self) -> ValuesMut<'_> {
        ValuesMut { space: self.space, plane: self.plane }
    }

    /// Adds `block` to number `place`.
    #[inline(always)]
    pub(super) fn add(&mut self, place: usize, block: &Block) {
        if let Some(own) = self.space.get_mut(place) {
            *own += block;
        } else {
            self.plane[place] += block.fixed_view::<2, 2>(0, 0);
        }
    }

    /// One entry of number `place`.
    fn entry(&mut self, place: usize, at: (usize, usize)) -> &mut f64 {
        match self.space.get_mut(place) {
            Some(own) => &mut own[at],
            None => &mut self.plane[place][at],
        }
    }
}

/// A 2×2 block as one of 3×3.
fn widened(block: &PlaneBlock) -> Block {
    let mut wide = Block::zeros();
    wide.fixed_view_mut::<2, 2>(0, 0).copy_from(block);
    wide
}

/// The values in a pattern.
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    pattern: Arc<BlockPattern>,
    value: BlockValues,
    outside: Option<[u32; 2]>,
}

/// One row of a [`BlockMatrix`] being filled.
pub struct RowMut<'a> {
    row: usize,
    column: &'a [u32],
    value: ValuesMut<'a>,
    outside: &'a AtomicU64,
}

impl RowMut<'_> {
    /// Adds `block` at column `j`. A column outside the pattern has no place and is reported
    /// by [`BlockMatrix::outside`].
    #[inline]
    pub fn add(&mut self, j: usize, block: &Block) {
        match self.column.binary_search(&crate::num::index(j)) {
            Ok(place) => self.value.add(place, block),
            Err(_) => {
                // The least of all pairs, whichever thread comes first.
                let pair = (self.row as u64) << 32 | u64::from(crate::num::index(j));
                self.outside.fetch_min(pair, Ordering::Relaxed);
            }
        }
    }
}

impl BlockMatrix {
    /// A zero matrix.
    #[must_use]
    pub fn zeros(pattern: Arc<BlockPattern>) -> Self {
        let count = pattern.column.len();
        let value = if pattern.is_planar() {
            BlockValues::Plane(vec![PlaneBlock::zeros(); count])
        } else {
            BlockValues::Space(vec![Block::zeros(); count])
        };
        Self { pattern, value, outside: None }
    }

    /// The pattern.
    #[must_use]
    #[inline]
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        &self.pattern
    }

    /// Sets all values to zero.
    pub fn clear(&mut self) {
        self.outside = None;
        match &mut self.value {
            BlockValues::Space(all) => crate::parallel::update(all, |_, b| *b = Block::zeros()),
            BlockValues::Plane(all) => {
                crate::parallel::update(all, |_, b| *b = PlaneBlock::zeros())
            }
        }
    }

    /// The first pair of vertices that something was added to since [`BlockMatrix::clear`] and that
    /// the pattern lacks: the values are then wrong.
    #[must_use]
    pub fn outside(&self) -> Option<[u32; 2]> {
        self.outside
    }

    pub(super) fn note_outside(&mut self, pair: Option<[u32; 2]>) {
        self.outside = self.outside.or(pair);
    }

    /// Number `place` of all stored blocks, row by row.
    #[inline]
    pub(super) fn block(&self, place: usize) -> Block {
        match &self.value {
            BlockValues::Space(all) => all[place],
            BlockValues::Plane(all) => widened(&all[place]),
        }
    }

    /// All stored blocks, row by row.
    pub(super) fn values_mut(&mut self) -> ValuesMut<'_> {
        match &mut self.value {
            BlockValues::Space(all) => ValuesMut { space: all, plane: &mut [] },
            BlockValues::Plane(all) => ValuesMut { space: &mut [], plane: all },
        }
    }

    /// Bytes of the values.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.value {
            BlockValues::Space(all) => size_of_val(&**all),
            BlockValues::Plane(all) => size_of_val(&**all),
        }
    }

    /// The values; those of another matrix with the same pattern can be put in their place.
    #[must_use]
    pub fn values(&self) -> &BlockValues {
        &self.value
    }

    /// Takes over the values of `other`, plus `shift(i)` on the diagonal of every row i.
    ///
    /// # Panics
    /// If the pattern of `other` is another one.
    pub fn take_shifted(&mut self, other: &Self, shift: impl Fn(usize) -> f64) {
        assert!(self.pattern == other.pattern, "the matrices have different patterns");
        self.value.clone_from(&other.value);
        for i in 0..self.pattern.rows() {
            for axis in 0..self.pattern.axes() {
                self.add_to_diagonal(i, axis, shift(i));
            }
        }
    }

    /// Replaces the values by those of a matrix with the same pattern.
    ///
    /// # Errors
    /// [`Malformed`] if there are more or fewer.
    pub fn set_values(&mut self, values: BlockValues) -> Result<(), Malformed> {
        match (&self.value, &values) {
            (BlockValues::Space(old), BlockValues::Space(new)) if old.len() == new.len() => {}
            (BlockValues::Plane(old), BlockValues::Plane(new)) if old.len() == new.len() => {}
            _ => return Err(Malformed),
        }
        self.value = values;
        Ok(())
    }

    /// The stored blocks of row `i`, in the order of [`BlockPattern::row`].
    #[inline]
    pub fn row(&self, i: usize) -> impl ExactSizeIterator<Item = Block> + '_ {
        (self.pattern.start[i]..self.pattern.start[i + 1]).map(|place| self.block(place))
    }

    /// The block of row `i` on the diagonal.
    #[must_use]
    #[inline]
    pub fn diagonal(&self, i: usize) -> Block {
        self.block(self.pattern.start[i])
    }

    /// Hands the numbers of the lower triangle to `f`, column by column: all rows of a column (i, a) from
    /// the diagonal on.
    pub(super) fn for_each_lower(&self, mut f: impl FnMut(f64)) {
        match &self.value {
            BlockValues::Space(all) => lower(&self.pattern, all, &mut f),
            BlockValues::Plane(all) => lower(&self.pattern, all, &mut f),
        }
    }

    /// Hands every row to `f`, in parallel.
    pub fn update_rows(&mut self, f: impl Fn(usize, &mut RowMut<'_>) + Sync) {
        let outside = AtomicU64::new(u64::MAX);
        let pattern = Arc::clone(&self.pattern);
        split_rows(&pattern, 0, pattern.rows(), self.values_mut(), &outside, &f);
        let outside = outside.into_inner();
        let half = |bits: u64| u32::try_from(bits & u64::from(u32::MAX)).unwrap_or(u32::MAX);
        self.note_outside((outside != u64::MAX).then(|| [half(outside >> 32), half(outside)]));
    }

    /// Takes directions out of the problem: their rows and columns become those of `scale`·I.
    pub fn pin(&mut self, pinned: &[[bool; 3]], scale: f64) {
        let pattern = Arc::clone(&self.pattern);
        let axes = pattern.axes();
        let free = |pin: &[bool; 3]| !pin[..axes].contains(&true);
        self.update_rows(|i, row| {
            for (place, &j) in pattern.row(i).iter().enumerate() {
                if free(&pinned[i]) && free(&pinned[j as usize]) {
                    continue;
                }
                for a in 0..axes {
                    for b in 0..axes {
                        if pinned[i][a] || pinned[j as usize][b] {
                            let diagonal = i == j as usize && a == b;
                            *row.value.entry(place, (a, b)) = if diagonal { scale } else { 0.0 };
                        }
                    }
                }
            }
        });
    }

    /// Adds `shift` to the diagonal.
    pub fn add_diagonal(&mut self, shift: f64) {
        self.update_rows(|_, row| row.value.add(0, &Block::from_diagonal_element(shift)));
    }

    /// Adds `factor · other`, which has the same pattern.
    ///
    /// # Panics
    /// If it has another.
    pub fn add_scaled(&mut self, factor: f64, other: &Self) {
        assert!(self.pattern == other.pattern, "matrices of different patterns are added");
        match (&mut self.value, &other.value) {
            (BlockValues::Space(all), BlockValues::Space(more)) => {
                crate::parallel::update(all, |k, block| *block += factor * more[k]);
            }
            (BlockValues::Plane(all), BlockValues::Plane(more)) => {
                crate::parallel::update(all, |k, block| *block += factor * more[k]);
            }
            _ => unreachable!("the pattern says which of them it is"),
        }
    }

    /// `vᵀ A v` of the symmetric matrix whose upper half this is.
    #[must_use]
    pub fn quadratic(&self, v: &[Vec3]) -> f64 {
        crate::parallel::sum(self.pattern.rows(), |i| {
            let row = self.pattern.row(i).iter().zip(self.row(i));
            let product = |(&j, block): (&u32, Block)| {
                let twice = if i == j as usize { 1.0 } else { 2.0 };
                twice * v[i].dot(&(block * v[j as usize]))
            };
            row.map(product).sum::<f64>()
        })
    }

    /// Adds `stiffness` to one diagonal entry.
    pub fn add_to_diagonal(&mut self, vertex: usize, axis: usize, stiffness: f64) {
        let place = self.pattern.start[vertex];
        *self.values_mut().entry(place, (axis, axis)) += stiffness;
    }

    /// Mean of the diagonal entries.
    #[must_use]
    pub fn mean_diagonal(&self) -> f64 {
        let rows = self.pattern.rows();
        let trace: f64 = (0..rows).map(|i| self.diagonal(i).trace()).sum();
        trace / crate::num::real(self.pattern.axes() * rows.max(1))
    }
}

/// See [`BlockMatrix::for_each_lower`].
fn lower<const D: usize>(
    pattern: &BlockPattern,
    all: &[nalgebra::SMatrix<f64, D, D>],
    f: &mut impl FnMut(f64),
) {
    for i in 0..pattern.rows() {
        let row = &all[pattern.start[i]..pattern.start[i + 1]];
        for a in 0..D {
            for b in a..D {
                f(row[0][(a, b)]);
            }
            for block in &row[1..] {
                for b in 0..D {
                    f(block[(a, b)]);
                }
            }
        }
    }
}

/// Hands out rows `first..last`, whose values are `value`, halving until blocks are small.
fn split_rows<F: Fn(usize, &mut RowMut<'_>) + Sync>(
    pattern: &BlockPattern,
    first: usize,
    last: usize,
    value: ValuesMut<'_>,
    outside: &AtomicU64,
    f: &F,
) {
    if last - first <= BLOCK {
        let mut rest = value;
        for i in first..last {
            let column = pattern.row(i);
            let (mine, tail) = rest.split_at(column.len());
            f(i, &mut RowMut { row: i, column, value: mine, outside });
            rest = tail;
        }
        return;
    }
    let middle = first + (last - first) / 2;
    let (low, high) = value.split_at(pattern.start[middle] - pattern.start[first]);
    rayon::join(
        || split_rows(pattern, first, middle, low, outside, f),
        || split_rows(pattern, middle, last, high, outside, f),
    );
}
