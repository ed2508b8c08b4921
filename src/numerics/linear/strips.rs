//! An order of unknowns for incomplete factors, cut into strips that can be worked on side by side.
//!
//! The order is that of Cuthill and McKee, reversed: level by level from one end of the mesh to the other,
//! however a mesh file numbers its vertices. Cut into strips of as many unknowns each, those at the end of a
//! strip that are coupled to a later one come last of all: without them no strip knows of another.
//!
//! ```text
//! strip 0 | strip 1 | … | seam 0 | seam 1 | …       a seam is coupled to the strips beside it
//! ```

use std::ops::Range;

use super::row_pattern::Pattern;
use crate::num::index;

/// Unknowns of a strip, and how many strips there are at most. Both are the same for any number of threads:
/// so are the results.
const STRIP_LIMITS: (usize, usize) = (4096, 16);

/// The square block of a pattern from an unknown on.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) pattern: &'a Pattern,
    pub(super) first: usize,
}

impl<'a> Block<'a> {
    pub(super) fn len(self) -> usize {
        self.pattern.rows() - self.first
    }

    /// Columns of row `i`, both counted from the first, ascending.
    pub(super) fn row(self, i: usize) -> impl Iterator<Item = usize> + 'a {
        let columns = self.pattern.row(self.first + i).iter();
        columns.filter_map(move |&j| (j as usize).checked_sub(self.first))
    }
}

/// The order, and what of it is what.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Strips {
    /// Unknown of every row, counted from the first.
    pub(super) order: Vec<u32>,
    /// Row of every unknown.
    pub(super) row: Vec<u32>,
    /// Rows of the strips, then of the seams.
    pub(super) strips: Vec<Range<usize>>,
    pub(super) seams: Vec<Range<usize>>,
}

impl Strips {
    /// Of the unknowns of a block.
    pub(super) fn new(block: Block<'_>) -> Self {
        let along = cuthill_mckee(block);
        let mut count = (along.len() / STRIP_LIMITS.0).clamp(1, STRIP_LIMITS.1);
        loop {
            if let Some(strips) = Self::cut(block, &along, count) {
                return strips;
            }
            count /= 2;
        }
    }

    /// Cuts the order `along`; nothing if seams are coupled to each other.
    fn cut(block: Block<'_>, along: &[u32], count: usize) -> Option<Self> {
        let n = along.len();
        let mut strip = vec![0; n];
        for (row, &unknown) in along.iter().enumerate() {
            strip[unknown as usize] = row * count / n.max(1);
        }
        let pairs = || (0..n).flat_map(|i| block.row(i).map(move |j| (i, j)));
        let mut seam = vec![false; n];
        for (i, j) in pairs().filter(|&(i, j)| strip[i] != strip[j]) {
            seam[if strip[i] < strip[j] { i } else { j }] = true;
        }
        if pairs().any(|(i, j)| seam[i] && seam[j] && strip[i] != strip[j]) {
            return None;
        }
        let mut order = Vec::with_capacity(n);
        let mut ranges = [Vec::new(), Vec::new()];
        for (of_seams, ranges) in [false, true].into_iter().zip(&mut ranges) {
            for k in 0..count {
                let begin = order.len();
                let rows = (k * n).div_ceil(count)..((k + 1) * n).div_ceil(count);
                order.extend(
                    along[rows].iter().filter(|&&unknown| seam[unknown as usize] == of_seams),
                );
                ranges.push(begin..order.len());
            }
        }
        let [strips, seams] = ranges;
        let mut row = vec![0; n];
        for (rank, &unknown) in order.iter().enumerate() {
            row[unknown as usize] = index(rank);
        }
        Some(Self { order, row, strips, seams })
    }
}

impl Strips {
    /// The pattern of a block with its rows and columns in this order, every row with its diagonal.
    pub(super) fn reorder(&self, block: Block<'_>) -> Pattern {
        let n = block.len();
        let with_diagonal = |unknown: usize| {
            let there = usize::from(block.row(unknown).any(|j| j == unknown));
            block.row(unknown).count() + 1 - there
        };
        let entries = (0..n).map(with_diagonal).sum();
        Pattern::new(n, n, entries, &mut |i, columns| {
            columns.extend(block.row(self.order[i] as usize).map(|j| self.row[j]));
            columns.push(index(i));
            columns.sort_unstable();
            columns.dedup();
        })
    }
}

/// The unknowns level by level from one end of the graph, the last level first.
fn cuthill_mckee(block: Block<'_>) -> Vec<u32> {
    let n = block.len();
    let degree = |i: u32| block.row(i as usize).count();
    let mut seen = vec![0u32; n];
    let mut round = 0;
    let mut placed = vec![false; n];
    // The level sets from a start; the last of them lie farthest away.
    let mut levels = |start: u32, order: &mut Vec<u32>, placed: &[bool]| {
        round += 1;
        let mut at = order.len();
        order.push(start);
        seen[start as usize] = round;
        while at < order.len() {
            let from = order.len();
            for i in block.row(order[at] as usize) {
                if seen[i] != round && !placed[i] {
                    seen[i] = round;
                    order.push(index(i));
                }
            }
            order[from..].sort_by_key(|&i| degree(i));
            at += 1;
        }
    };
    let mut order = Vec::with_capacity(n);
    for unknown in 0..n {
        if placed[unknown] {
            continue;
        }
        // Twice to the far end: nearly the longest way across.
        let mut start = index(unknown);
        for _ in 0..2 {
            let mut trial = Vec::new();
            levels(start, &mut trial, &placed);
            start = trial.last().copied().unwrap_or(start);
        }
        let first = order.len();
        levels(start, &mut order, &placed);
        order[first..].iter().for_each(|&i| placed[i as usize] = true);
    }
    order.reverse();
    order
}
