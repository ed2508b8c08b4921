//! Whole rows of symmetric block matrices, of which only the upper triangle is stored.
//!
//! A product in parallel gathers, so it needs the blocks left of the diagonal as well. Where they
//! are is found once for a pattern. For products that are repeated many times with one matrix, whole
//! rows are copied in single precision: they are read in one stream, and half the memory is moved.

use std::ops::Range;

use nalgebra::{Matrix2, Matrix3, Vector2};
use rayon::prelude::*;

use super::lists::CompressedLists;
use super::{Block, BlockMatrix, BlockPattern};
use crate::Vec3;
use crate::num::index;
use crate::parallel;

/// Columns of whole rows, and where their blocks are stored.
pub(super) struct FullRowPattern {
    start: Vec<usize>,
    column: Vec<u32>,
    place: Vec<u32>,
}

impl FullRowPattern {
    /// Mirrors `pattern`.
    pub(super) fn new(pattern: &BlockPattern) -> Self {
        // Rows above come first, so every row is filled in ascending order.
        let blocks = || {
            (0..pattern.rows()).flat_map(|i| {
                pattern.row(i).iter().zip(pattern.start(i)..).flat_map(move |(&j, place)| {
                    let mirrored = (j as usize != i).then_some((j as usize, i));
                    let both = std::iter::once((i, j as usize)).chain(mirrored);
                    both.map(move |(row, column)| (row, (index(column), index(place))))
                })
            })
        };
        let CompressedLists { start, item } = CompressedLists::sorted(pattern.rows(), blocks);
        let (column, place) = item.into_iter().unzip();
        Self { start, column, place }
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Columns of row `i`, ascending, `i` among them.
    pub(super) fn row(&self, i: usize) -> &[u32] {
        &self.column[self.start[i]..self.start[i + 1]]
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.start) + size_of_val(&*self.column) + size_of_val(&*self.place)
    }

    /// Blocks of row `i` of `matrix`, with their columns.
    pub(super) fn blocks<'a>(
        &'a self,
        matrix: &'a BlockMatrix,
        i: usize,
    ) -> impl Iterator<Item = (usize, Block)> + 'a {
        let places = &self.place[self.start[i]..self.start[i + 1]];
        self.row(i).iter().zip(places).map(move |(&j, &place)| {
            let block = matrix.block(place as usize);
            (j as usize, if (j as usize) < i { block.transpose() } else { block })
        })
    }
}

/// A copy of a matrix in single precision, by whole rows.
#[derive(Default)]
pub(super) struct SinglePrecisionRows {
    value: SinglePrecisionBlocks,
    /// What the entries were divided by: single precision has a narrow range.
    unit: f64,
}

/// Blocks of space, or of a plane.
enum SinglePrecisionBlocks {
    Space(Vec<Matrix3<f32>>),
    Plane(Vec<Matrix2<f32>>),
}

impl Default for SinglePrecisionBlocks {
    fn default() -> Self {
        Self::Space(Vec::new())
    }
}

impl SinglePrecisionRows {
    /// Copies `matrix`.
    pub(super) fn load(&mut self, rows: &FullRowPattern, matrix: &BlockMatrix) {
        self.unit = matrix.mean_diagonal();
        let scale = self.unit.recip();
        let count = rows.column.len();
        if matrix.pattern().is_planar() && !matches!(self.value, SinglePrecisionBlocks::Plane(_)) {
            self.value = SinglePrecisionBlocks::Plane(Vec::new());
        }
        match &mut self.value {
            SinglePrecisionBlocks::Space(all) => {
                all.resize(count, Matrix3::zeros());
                copy(rows, matrix, all, |block| (scale * block).cast());
            }
            SinglePrecisionBlocks::Plane(all) => {
                all.resize(count, Matrix2::zeros());
                let corner = |block: Block| block.fixed_view::<2, 2>(0, 0).into_owned();
                copy(rows, matrix, all, |block| (scale * corner(block)).cast());
            }
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match &self.value {
            SinglePrecisionBlocks::Space(all) => size_of_val(&**all),
            SinglePrecisionBlocks::Plane(all) => size_of_val(&**all),
        }
    }

    /// Row `i` of the product with `x`.
    pub(super) fn times(&self, rows: &FullRowPattern, i: usize, x: &[Vec3]) -> Vec3 {
        let range = rows.start[i]..rows.start[i + 1];
        let columns = rows.row(i).iter();
        match &self.value {
            SinglePrecisionBlocks::Space(all) => {
                let mut sum = Vec3::zeros();
                for (j, block) in columns.zip(&all[range]) {
                    sum += block.cast::<f64>() * x[*j as usize];
                }
                self.unit * sum
            }
            SinglePrecisionBlocks::Plane(all) => {
                let mut sum = Vector2::zeros();
                for (j, block) in columns.zip(&all[range]) {
                    sum += block.cast::<f64>() * x[*j as usize].xy();
                }
                self.unit * Vec3::new(sum.x, sum.y, 0.0)
            }
        }
    }
}

/// Writes what `of` makes of every block, by whole rows.
fn copy<T: Send>(
    rows: &FullRowPattern,
    matrix: &BlockMatrix,
    into: &mut [T],
    of: impl Fn(Block) -> T + Sync,
) {
    split(rows.len(), |i| rows.start[i], into).into_par_iter().for_each(|(range, part)| {
        let blocks = range.flat_map(|i| rows.blocks(matrix, i));
        for (place, (_, block)) in part.iter_mut().zip(blocks) {
            *place = of(block);
        }
    });
}

/// Cuts values kept list after list, list i of `lists` from `start(i)`, into parts of several lists.
pub(super) fn split<T>(
    lists: usize,
    start: impl Fn(usize) -> usize,
    value: &mut [T],
) -> Vec<(Range<usize>, &mut [T])> {
    let (mut parts, mut rest) = (Vec::new(), value);
    for first in (0..lists).step_by(parallel::BLOCK) {
        let last = (first + parallel::BLOCK).min(lists);
        let (part, tail) = rest.split_at_mut(start(last) - start(first));
        parts.push((first..last, part));
        rest = tail;
    }
    parts
}
