//! From aggregates to nodes: the smoothed prolongator and the matrix of the coarse level.
//!
//! ```text
//! P̂_i = B_i T_I  (i in aggregate I),  Σ_{i∈I} P̂_iᵀ P̂_i = 1        tentative, 3×M a node
//! P = (1 - ω D⁻¹ A) P̂,   ω = 4 / (3 λmax(D⁻¹A))                    smoothed
//! A_c = Pᵀ A P,   B_c = T⁻¹                                        the coarse level
//! ```
//!
//! The columns of B are motions that cost nearly nothing: the M = 6 rigid motions of the sheet, which
//! are all that a plate or shell has, bending included; M = 3 of a sheet that moves in a plane. D is the
//! block diagonal of A. An aggregate becomes N = M/3 nodes of the coarse level, three unknowns each.
//!
//! Source: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::lists::CompressedLists;
use super::symmetric_rows::{FullRowPattern, split};
use super::{Block, BlockMatrix, BlockPattern};
use crate::Vec3;
use crate::num::index;
use crate::parallel;

/// A motion counts as a combination of others in an aggregate if less than this share of its square
/// is left without them.
const DEPENDENCE_TOLERANCE: f64 = 1e-10;

/// The motions of one node.
pub(super) type Motions<const M: usize> = SMatrix<f64, 3, M>;

/// A number for every pair of motions.
type Pairs<const M: usize> = SMatrix<f64, M, M>;

/// The prolongator of one level.
pub(super) struct Prolongator<const N: usize, const M: usize> {
    aggregates: Aggregates,
    members: CompressedLists<u32>,
    /// Aggregates that a node depends on, and the blocks of P.
    row: CompressedLists<u32>,
    value: Vec<SMatrix<f32, 3, M>>,
    /// Nodes that depend on an aggregate, and where in `value`.
    support: CompressedLists<u32>,
    entry: Vec<u32>,
    /// Nodes with a neighbour in the support.
    reach: CompressedLists<u32>,
    /// Aggregates J ≥ I coupled to aggregate I in the coarse matrix.
    coupled: CompressedLists<u32>,
}

impl<const N: usize, const M: usize> Prolongator<N, M> {
    /// Aggregates the nodes of `rows` and finds which blocks exist.
    pub(super) fn new(rows: &FullRowPattern) -> Self {
        let aggregates = Aggregates::new(rows);
        let mut scratch = Vec::new();
        let mut row = CompressedLists::new();
        for i in 0..rows.len() {
            scratch.extend(rows.row(i).iter().map(|&j| aggregates.of[j as usize]));
            row.push_set(&mut scratch);
        }
        let (support, entry) = transposed(&row, aggregates.count);
        let own =
            CompressedLists { start: (0..=rows.len()).collect(), item: aggregates.of.clone() };
        let (members, _) = transposed(&own, aggregates.count);
        let (mut reach, mut coupled) = (CompressedLists::new(), CompressedLists::new());
        for a in 0..aggregates.count {
            scratch.extend(support.list(a).iter().flat_map(|&i| rows.row(i as usize)));
            reach.push_set(&mut scratch);
            let near = reach.list(a).iter().flat_map(|&k| row.list(k as usize));
            scratch.extend(near.copied().filter(|&b| b as usize >= a));
            coupled.push_set(&mut scratch);
        }
        let value = vec![SMatrix::zeros(); row.item.len()];
        Self { aggregates, members, row, value, support, entry, reach, coupled }
    }

    /// Number of aggregates; each makes N nodes of the coarse level.
    pub(super) fn aggregates(&self) -> usize {
        self.aggregates.count
    }

    pub(super) fn bytes(&self) -> usize {
        let lists = [&self.members, &self.row, &self.support, &self.reach, &self.coupled];
        let lists = lists.map(|l| size_of_val(&*l.start) + size_of_val(&*l.item));
        let numbers = size_of_val(&*self.entry) + size_of_val(&*self.aggregates.of);
        lists.iter().sum::<usize>() + numbers + size_of_val(&*self.value)
    }

    /// Pattern of the coarse matrix.
    pub(super) fn coarse_pattern(&self) -> BlockPattern {
        let nodes = |a: &u32| {
            let first = index(N) * *a;
            first..first + index(N)
        };
        BlockPattern::from_rows((0..N * self.aggregates.count).map(|row| {
            let columns = self.coupled.list(row / N).iter().flat_map(nodes);
            columns.filter(|&j| j as usize >= row).collect()
        }))
    }

    /// Takes over the values of P for `matrix`; the motions of the coarse nodes.
    ///
    /// `motions` become those of the tentative prolongator. `damping` is ω.
    pub(super) fn smooth(
        &mut self,
        rows: &FullRowPattern,
        matrix: &BlockMatrix,
        inverse: &[Block],
        damping: f64,
        motions: &mut [Motions<M>],
    ) -> Vec<Motions<M>> {
        // Directions coupled to nothing (fixed ones) are left to the smoother.
        parallel::update(motions, |i, b| {
            for a in 0..3 {
                let free = rows
                    .blocks(matrix, i)
                    .any(|(j, block)| (0..3).any(|c| block[(a, c)] != 0.0 && (j != i || c != a)));
                if !free {
                    b.row_mut(a).fill(0.0);
                }
            }
        });
        let factors: Vec<(Pairs<M>, Pairs<M>)> = (0..self.aggregates.count)
            .into_par_iter()
            .map(|a| {
                let own = self.members.list(a).iter().map(|&i| &motions[i as usize]);
                orthonormal(&own.map(|b| b.tr_mul(b)).sum())
            })
            .collect();
        let of = &self.aggregates.of;
        parallel::update(motions, |i, b| *b *= factors[of[i] as usize].0);
        let motions = &*motions;
        let row = &self.row;
        let rows_of_p = split(row.start.len() - 1, |i| row.start[i], &mut self.value);
        rows_of_p.into_par_iter().for_each(|(range, mut part)| {
            let mut sum = Vec::new();
            for i in range {
                let columns = row.list(i);
                let slot = |a: u32| columns.binary_search(&a).unwrap_or(0);
                sum.clear();
                sum.resize(columns.len(), Motions::<M>::zeros());
                for (j, block) in rows.blocks(matrix, i) {
                    sum[slot(of[j])] += block * motions[j];
                }
                let (mine, tail) = part.split_at_mut(columns.len());
                for (place, sum) in mine.iter_mut().zip(&mut sum) {
                    *sum = inverse[i] * *sum * -damping;
                    *place = sum.cast();
                }
                let own = slot(of[i]);
                mine[own] = (sum[own] + motions[i]).cast();
                part = tail;
            }
        });
        let triangles = factors.iter().map(|(_, t)| t);
        triangles
            .flat_map(|t| (0..N).map(move |node| t.fixed_rows::<3>(3 * node).into_owned()))
            .collect()
    }

    /// `A_c = Pᵀ A P`; unknowns of motions that an aggregate does not have get the mean stiffness.
    pub(super) fn coarse_matrix(
        &self,
        rows: &FullRowPattern,
        matrix: &BlockMatrix,
        into: &mut BlockMatrix,
    ) {
        let coupled: Vec<Vec<Pairs<M>>> = (0..self.aggregates.count)
            .into_par_iter()
            .map(|a| self.coarse_row(rows, matrix, a))
            .collect();
        into.clear();
        into.update_rows(|row, blocks| {
            let a = row / N;
            for (&b, sum) in self.coupled.list(a).iter().zip(&coupled[a]) {
                for node in 0..N {
                    let column = N * b as usize + node;
                    if column >= row {
                        let block = sum.fixed_view::<3, 3>(3 * (row % N), 3 * node);
                        blocks.add(column, &block.into_owned());
                    }
                }
            }
        });
        let scale = into.mean_diagonal();
        into.update_rows(|row, blocks| {
            let diagonal = &coupled[row / N][0];
            let missing = |k: usize| if diagonal[(k, k)] == 0.0 { scale } else { 0.0 };
            let first = 3 * (row % N);
            let missing = Vec3::new(missing(first), missing(first + 1), missing(first + 2));
            blocks.add(row, &Block::from_diagonal(&missing));
        });
    }

    /// Blocks (a, b) of the coarse matrix, b as in `coupled`.
    fn coarse_row(&self, rows: &FullRowPattern, matrix: &BlockMatrix, a: usize) -> Vec<Pairs<M>> {
        let columns = self.coupled.list(a);
        let mut sums = vec![Pairs::<M>::zeros(); columns.len()];
        for &k in self.reach.list(a) {
            let mut image = Motions::<M>::zeros();
            for (j, block) in rows.blocks(matrix, k as usize) {
                if let Some(entry) = self.entry_at(j, index(a)) {
                    image += block * self.value[entry].cast::<f64>();
                }
            }
            let first = self.row.start[k as usize];
            for (slot, b) in self.row.list(k as usize).iter().enumerate() {
                if let Ok(place) = columns.binary_search(b) {
                    sums[place] += image.tr_mul(&self.value[first + slot].cast::<f64>());
                }
            }
        }
        // Round-off apart, the diagonal block is symmetric already.
        sums[0] = 0.5 * (sums[0] + sums[0].transpose());
        sums
    }

    fn entry_at(&self, node: usize, aggregate: u32) -> Option<usize> {
        let place = self.row.list(node).iter().position(|&b| b == aggregate)?;
        Some(self.row.start[node] + place)
    }

    /// `coarse = Pᵀ fine`.
    pub(super) fn restrict(&self, fine: &[Vec3], coarse: &mut [[Vec3; N]]) {
        parallel::fill(coarse, |a| {
            let range = self.support.start[a]..self.support.start[a + 1];
            let mut sum = SVector::<f64, M>::zeros();
            for (&i, &entry) in self.support.list(a).iter().zip(&self.entry[range]) {
                sum += self.value[entry as usize].cast::<f64>().tr_mul(&fine[i as usize]);
            }
            std::array::from_fn(|node| sum.fixed_rows::<3>(3 * node).into_owned())
        });
    }

    /// `fine = P coarse`.
    pub(super) fn prolong(&self, coarse: &[[Vec3; N]], fine: &mut [Vec3]) {
        parallel::fill(fine, |i| {
            let range = self.row.start[i]..self.row.start[i + 1];
            let mut sum = Vec3::zeros();
            for (&a, block) in self.row.list(i).iter().zip(&self.value[range]) {
                let block = block.cast::<f64>();
                let mut all = Vec3::zeros();
                for (node, value) in coarse[a as usize].iter().enumerate() {
                    all += block.fixed_columns::<3>(3 * node) * value;
                }
                sum += all;
            }
            sum
        });
    }
}

/// For every number below `count` the lists it is in, and where in all items.
fn transposed(lists: &CompressedLists<u32>, count: usize) -> (CompressedLists<u32>, Vec<u32>) {
    let all = || {
        let of = |i| lists.list(i).iter().zip(lists.start[i]..);
        (0..lists.start.len() - 1)
            .flat_map(move |i| of(i).map(move |(&a, k)| (a as usize, (index(i), index(k)))))
    };
    let CompressedLists { start, item } = CompressedLists::sorted(count, all);
    let (item, entry) = item.into_iter().unzip();
    (CompressedLists { start, item }, entry)
}

/// T and R with `Tᵀ gram T = 1` and `R = T⁻¹`, upper triangular, by Cholesky; dependent columns are
/// zero in both.
fn orthonormal<const M: usize>(gram: &Pairs<M>) -> (Pairs<M>, Pairs<M>) {
    let mut upper = Pairs::<M>::zeros();
    let mut inverse = Pairs::<M>::zeros();
    for c in 0..M {
        // Column c of the inverse starts as the unit vector, made orthogonal to those before.
        let mut rest = gram[(c, c)];
        for r in 0..c {
            let along = (inverse.column(r).transpose() * gram.column(c))[0];
            upper[(r, c)] = along;
            rest -= along * along;
        }
        if !(rest > DEPENDENCE_TOLERANCE * gram[(c, c)]) {
            continue;
        }
        let norm = rest.sqrt();
        upper[(c, c)] = norm;
        let mut column = SVector::<f64, M>::zeros();
        column[c] = 1.0;
        for r in 0..c {
            column -= upper[(r, c)] * inverse.column(r);
        }
        inverse.set_column(c, &(column / norm));
    }
    (inverse, upper)
}
