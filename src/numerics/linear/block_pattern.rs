//! Which blocks a symmetric matrix over the vertices of a mesh has.
//!
//! Of the blocks (i, j) those with j ≥ i, row by row: vertices up to so many edges apart, and single pairs.

use crate::reduction::Reduction;

/// Hands the vertices an edge away from a given one to a function.
pub type Neighbours<'a> = dyn Fn(usize, &mut dyn FnMut(u32)) + 'a;

/// Which blocks exist, and how large they are.
#[derive(Debug, PartialEq, Eq)]
pub struct BlockPattern {
    pub(super) start: Vec<usize>,
    pub(super) column: Vec<u32>,
    planar: bool,
    reduction: Reduction,
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
        Self { start, column, planar: false, reduction: Reduction::default() }
    }

    /// The columns of every row, ascending from its own number.
    pub(super) fn from_rows(rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let mut start = vec![0];
        let mut column = Vec::new();
        for mut row in rows {
            column.append(&mut row);
            start.push(column.len());
        }
        Self { start, column, planar: false, reduction: Reduction::default() }
    }

    /// The same with blocks of 2×2, for vertices that move in a plane z = const.
    #[must_use]
    pub fn in_plane(self) -> Self {
        Self { planar: true, ..self }
    }

    /// The same over the vertices of a sheet that is spread over ranks: rows of what is owned are complete.
    #[must_use]
    pub fn over(self, reduction: &Reduction) -> Self {
        Self { reduction: reduction.clone(), ..self }
    }

    /// What sums over all rows are taken over.
    #[must_use]
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// Whether blocks are 2×2.
    #[must_use]
    #[inline]
    pub fn is_planar(&self) -> bool {
        self.planar
    }

    /// Unknowns of a vertex: rows of a block.
    #[must_use]
    #[inline]
    pub fn axes(&self) -> usize {
        if self.planar { 2 } else { 3 }
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
