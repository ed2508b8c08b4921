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

use faer::sparse::SymbolicSparseColMatRef;

/// Unknowns of a strip, and how many strips there are at most. Both are the same for any number of threads:
/// so are the results.
const STRIP: (usize, usize) = (4096, 16);

/// The order, and what of it is what.
pub(super) struct Strips {
    /// Unknown of every row.
    pub(super) order: Vec<usize>,
    /// Rows of the strips, then of the seams.
    pub(super) strips: Vec<Range<usize>>,
    pub(super) seams: Vec<Range<usize>>,
}

impl Strips {
    /// Of the unknowns of a matrix.
    pub(super) fn new(pattern: SymbolicSparseColMatRef<'_, usize>) -> Self {
        let along = cuthill_mckee(pattern);
        let mut count = (along.len() / STRIP.0).clamp(1, STRIP.1);
        loop {
            if let Some(strips) = Self::cut(pattern, &along, count) {
                return strips;
            }
            count /= 2;
        }
    }

    /// Cuts the order `along`; nothing if seams are coupled to each other.
    fn cut(
        pattern: SymbolicSparseColMatRef<'_, usize>,
        along: &[usize],
        count: usize,
    ) -> Option<Self> {
        let n = along.len();
        let mut strip = vec![0; n];
        for (row, &unknown) in along.iter().enumerate() {
            strip[unknown] = row * count / n.max(1);
        }
        let pairs = || {
            (0..n)
                .flat_map(|j| pattern.row_idx()[pattern.col_range(j)].iter().map(move |&i| (i, j)))
        };
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
                order.extend(along[rows].iter().filter(|&&unknown| seam[unknown] == of_seams));
                ranges.push(begin..order.len());
            }
        }
        let [strips, seams] = ranges;
        Some(Self { order, strips, seams })
    }
}

/// The unknowns level by level from one end of the graph, the last level first.
fn cuthill_mckee(pattern: SymbolicSparseColMatRef<'_, usize>) -> Vec<usize> {
    let n = pattern.ncols();
    let neighbours = |j: usize| &pattern.row_idx()[pattern.col_range(j)];
    let mut seen = vec![0usize; n];
    let mut round = 0usize;
    // The level sets from a start; the last of them lie farthest away.
    let mut levels = |start: usize, order: &mut Vec<usize>, round: usize| {
        let first = order.len();
        order.push(start);
        seen[start] = round;
        let mut at = first;
        while at < order.len() {
            let from = order.len();
            for &i in neighbours(order[at]) {
                if seen[i] != round {
                    seen[i] = round;
                    order.push(i);
                }
            }
            order[from..].sort_by_key(|&i| neighbours(i).len());
            at += 1;
        }
    };
    let mut order = Vec::with_capacity(n);
    let mut placed = vec![false; n];
    for unknown in 0..n {
        if placed[unknown] {
            continue;
        }
        // Twice to the far end: nearly the longest way across.
        let mut start = unknown;
        for _ in 0..2 {
            let mut trial = Vec::new();
            round += 1;
            levels(start, &mut trial, round);
            start = trial.last().copied().unwrap_or(start);
        }
        let first = order.len();
        round += 1;
        levels(start, &mut order, round);
        order[first..].iter().for_each(|&i| placed[i] = true);
    }
    order.reverse();
    order
}
