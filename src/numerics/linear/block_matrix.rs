//! A symmetric matrix of 3×3 blocks over the vertices of a mesh, in a fixed pattern.
//!
//! Only blocks (i, j) with j ≥ i are stored, row by row. Which there are is up to those who add to it:
//! vertices up to so many edges apart, and single pairs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::Vec3;
use crate::parallel::BLOCK;

/// One 3×3 block.
pub type Block = nalgebra::Matrix3<f64>;

/// Hands the vertices an edge away from a given one to a function.
pub type Neighbours<'a> = dyn Fn(usize, &mut dyn FnMut(u32)) + 'a;

/// Which blocks exist.
#[derive(Debug, PartialEq, Eq)]
pub struct BlockPattern {
    start: Vec<usize>,
    column: Vec<u32>,
}

impl BlockPattern {
    /// Pairs of vertices up to `rings` edges apart, 0 for none but the vertices themselves, and
    /// besides these `pairs`, in any order. `neighbours` hands out the vertices an edge away.
    #[must_use]
    pub fn of_rings(
        vertices: usize,
        rings: usize,
        neighbours: &Neighbours<'_>,
        pairs: &[[u32; 2]],
    ) -> Self {
        let mut further: Vec<[u32; 2]> =
            pairs.iter().map(|[a, b]| [*a.min(b), *a.max(b)]).collect();
        further.sort_unstable();
        let mut further = further.as_slice();
        let (mut start, mut column) = (vec![0], Vec::new());
        let mut row = Vec::new();
        for i in 0..vertices {
            let own = crate::num::index(i);
            row.clear();
            row.push(own);
            let mut known = 0;
            for _ in 0..rings {
                let last = known..row.len();
                known = row.len();
                for place in last {
                    neighbours(row[place] as usize, &mut |j| row.push(j));
                }
            }
            while let [[first, second], rest @ ..] = further
                && *first == own
            {
                row.push(*second);
                further = rest;
            }
            row.retain(|&j| j >= own);
            row.sort_unstable();
            row.dedup();
            column.extend_from_slice(&row);
            start.push(column.len());
        }
        Self { start, column }
    }

    /// The columns of every row, ascending from its own number.
    pub(super) fn from_rows(rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let mut start = vec![0];
        let mut column = Vec::new();
        for mut row in rows {
            column.append(&mut row);
            start.push(column.len());
        }
        Self { start, column }
    }

    /// Number of block rows.
    #[must_use]
    #[inline]
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// Place of the first block of row `i`, its diagonal, among all blocks; for `i` = rows, how many
    /// blocks there are.
    #[must_use]
    #[inline]
    pub fn start(&self, i: usize) -> usize {
        self.start[i]
    }

    /// Columns of row `i`, ascending from `i` itself.
    #[must_use]
    #[inline]
    pub fn row(&self, i: usize) -> &[u32] {
        &self.column[self.start[i]..self.start[i + 1]]
    }
}

/// The values in a pattern.
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    pattern: Arc<BlockPattern>,
    value: Vec<Block>,
    outside: Option<[u32; 2]>,
}

/// One row of a [`BlockMatrix`] being filled.
pub struct RowMut<'a> {
    row: usize,
    column: &'a [u32],
    value: &'a mut [Block],
    outside: &'a AtomicU64,
}

impl RowMut<'_> {
    /// Adds `block` at column `j`. A column outside the pattern has no place: the matrix then says so,
    /// by [`BlockMatrix::outside`].
    #[inline]
    pub fn add(&mut self, j: usize, block: &Block) {
        match self.column.binary_search(&crate::num::index(j)) {
            Ok(place) => self.value[place] += block,
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
        let value = vec![Block::zeros(); pattern.column.len()];
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
        crate::parallel::update(&mut self.value, |_, block| *block = Block::zeros());
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

    /// All stored blocks, row by row.
    pub(super) fn values(&self) -> &[Block] {
        &self.value
    }

    /// All stored blocks, row by row.
    pub(super) fn values_mut(&mut self) -> &mut [Block] {
        &mut self.value
    }

    /// The stored blocks of row `i`, in the order of [`BlockPattern::row`].
    #[must_use]
    #[inline]
    pub fn row(&self, i: usize) -> &[Block] {
        &self.value[self.pattern.start[i]..self.pattern.start[i + 1]]
    }

    /// Hands every row to `f`, in parallel.
    pub fn update_rows(&mut self, f: impl Fn(usize, &mut RowMut<'_>) + Sync) {
        let outside = AtomicU64::new(u64::MAX);
        split_rows(&self.pattern, 0, self.pattern.rows(), &mut self.value, &outside, &f);
        let outside = outside.into_inner();
        let half = |bits: u64| u32::try_from(bits & u64::from(u32::MAX)).unwrap_or(u32::MAX);
        self.note_outside((outside != u64::MAX).then(|| [half(outside >> 32), half(outside)]));
    }

    /// Takes directions out of the problem: their rows and columns become those of `scale`·I.
    pub fn pin(&mut self, pinned: &[[bool; 3]], scale: f64) {
        let pattern = Arc::clone(&self.pattern);
        let free = [false; 3];
        self.update_rows(|i, row| {
            for (place, &j) in pattern.row(i).iter().enumerate() {
                if pinned[i] == free && pinned[j as usize] == free {
                    continue;
                }
                let block = &mut row.value[place];
                for a in 0..3 {
                    for b in 0..3 {
                        if pinned[i][a] || pinned[j as usize][b] {
                            let diagonal = i == j as usize && a == b;
                            block[(a, b)] = if diagonal { scale } else { 0.0 };
                        }
                    }
                }
            }
        });
    }

    /// Adds `shift` to the diagonal.
    pub fn add_diagonal(&mut self, shift: f64) {
        self.update_rows(|_, row| row.value[0] += Block::from_diagonal_element(shift));
    }

    /// Adds `factor · other`, which has the same pattern.
    ///
    /// # Panics
    /// If it has another.
    pub fn add_scaled(&mut self, factor: f64, other: &Self) {
        assert!(self.pattern == other.pattern, "matrices of different patterns are added");
        crate::parallel::update(&mut self.value, |k, block| *block += factor * other.value[k]);
    }

    /// `vᵀ A v` of the symmetric matrix whose upper half this is.
    #[must_use]
    pub fn quadratic(&self, v: &[Vec3]) -> f64 {
        crate::parallel::sum(self.pattern.rows(), |i| {
            let row = self.pattern.row(i).iter().zip(self.row(i));
            let product = |(&j, block): (&u32, &Block)| {
                let twice = if i == j as usize { 1.0 } else { 2.0 };
                twice * v[i].dot(&(block * v[j as usize]))
            };
            row.map(product).sum()
        })
    }

    /// Adds `stiffness` to one diagonal entry.
    pub fn stiffen(&mut self, vertex: usize, axis: usize, stiffness: f64) {
        self.value[self.pattern.start[vertex]][(axis, axis)] += stiffness;
    }

    /// Mean of the diagonal entries.
    #[must_use]
    pub fn mean_diagonal(&self) -> f64 {
        let rows = self.pattern.rows();
        let trace: f64 = (0..rows).map(|i| self.row(i)[0].trace()).sum();
        trace / crate::num::real(3 * rows.max(1))
    }
}

/// Hands out rows `first..last`, whose values are `value`, halving until blocks are small.
fn split_rows<F: Fn(usize, &mut RowMut<'_>) + Sync>(
    pattern: &BlockPattern,
    first: usize,
    last: usize,
    value: &mut [Block],
    outside: &AtomicU64,
    f: &F,
) {
    if last - first <= BLOCK {
        let mut rest = value;
        for i in first..last {
            let column = pattern.row(i);
            let (mine, tail) = rest.split_at_mut(column.len());
            f(i, &mut RowMut { row: i, column, value: mine, outside });
            rest = tail;
        }
        return;
    }
    let middle = first + (last - first) / 2;
    let (low, high) = value.split_at_mut(pattern.start[middle] - pattern.start[first]);
    rayon::join(
        || split_rows(pattern, first, middle, low, outside, f),
        || split_rows(pattern, middle, last, high, outside, f),
    );
}
