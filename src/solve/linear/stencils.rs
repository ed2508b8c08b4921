//! Where the second derivatives of elements go in a [`BlockMatrix`].
//!
//! An element (an edge, a triangle, a vertex with its ring) couples the vertices of its stencil. The
//! place of every pair in the matrix is looked up once; the assembly then adds without searching.
//! As in [`crate::parallel::patches`], rows are cut into blocks, each with the list of elements that
//! touch it; an element on the border of two is computed in both, and the order of the sums does
//! not depend on the number of threads.

use std::sync::Arc;

use super::{Block, BlockMatrix, BlockPattern};
use crate::num::index;

/// Rows per block.
const ROWS: usize = 512;

/// The stencils of one kind of element in one pattern.
#[derive(Debug)]
pub struct Stencils {
    pattern: Arc<BlockPattern>,
    start: Vec<u32>,
    vertex: Vec<u32>,
    /// First pair of every element, and the place of each pair (p, q), p ≤ q.
    pair_start: Vec<u32>,
    place: Vec<u32>,
    /// For every block of rows the elements that touch it.
    touching: Vec<Vec<u32>>,
}

/// Takes the blocks of one element.
pub struct Sink<'a> {
    vertex: &'a [u32],
    place: &'a [u32],
    first_row: usize,
    last_row: usize,
    first_place: usize,
    value: &'a mut [Block],
}

impl Sink<'_> {
    /// The vertices of the element, ascending.
    #[must_use]
    pub fn vertices(&self) -> &[u32] {
        self.vertex
    }

    /// Whether the block (p, q) of the element, p ≤ q in the order of [`Sink::vertices`], belongs to
    /// the rows being summed; others need not be computed.
    #[must_use]
    pub fn wants(&self, p: usize) -> bool {
        (self.first_row..self.last_row).contains(&(self.vertex[p] as usize))
    }

    /// Adds block (p, q), p ≤ q.
    pub fn add(&mut self, p: usize, q: usize, block: &Block) {
        if self.wants(p) {
            let m = self.vertex.len();
            let pair = p * m - p * p.saturating_sub(1) / 2 + (q - p);
            self.value[self.place[pair] as usize - self.first_place] += block;
        }
    }
}

impl Stencils {
    /// Looks up the places of `elements`, each a list of vertices in ascending order.
    ///
    /// A pair that is not in the pattern has no place and is a fault of the caller; it is given the
    /// place of the row's diagonal, and a debug assertion fails.
    #[must_use]
    pub fn new<I: AsRef<[u32]>>(
        pattern: &Arc<BlockPattern>,
        elements: impl Iterator<Item = I>,
    ) -> Self {
        let mut stencils = Self {
            pattern: Arc::clone(pattern),
            start: vec![0],
            vertex: Vec::new(),
            pair_start: vec![0],
            place: Vec::new(),
            touching: vec![Vec::new(); pattern.rows().div_ceil(ROWS)],
        };
        for (number, element) in elements.enumerate() {
            let vertices = element.as_ref();
            debug_assert!(vertices.is_sorted());
            for (p, &row) in vertices.iter().enumerate() {
                let first = pattern.start(row as usize);
                let columns = pattern.row(row as usize);
                for column in &vertices[p..] {
                    let found = columns.binary_search(column);
                    debug_assert!(found.is_ok(), "({row}, {column}) is not in the pattern");
                    stencils.place.push(index(first + found.unwrap_or(0)));
                }
                let block = row as usize / ROWS;
                if p == 0 || vertices[p - 1] as usize / ROWS != block {
                    stencils.touching[block].push(index(number));
                }
            }
            stencils.vertex.extend_from_slice(vertices);
            stencils.start.push(index(stencils.vertex.len()));
            stencils.pair_start.push(index(stencils.place.len()));
        }
        stencils
    }

    /// Whether the places are those of `pattern`.
    #[must_use]
    pub fn fit(&self, pattern: &Arc<BlockPattern>) -> bool {
        Arc::ptr_eq(&self.pattern, pattern)
    }

    /// Lets `element` add the blocks of every element to `matrix`.
    pub fn assemble(
        &self,
        matrix: &mut BlockMatrix,
        element: impl Fn(usize, &mut Sink<'_>) + Sync,
    ) {
        debug_assert!(self.fit(matrix.pattern()));
        self.halve(0, self.touching.len(), matrix.values_mut(), &element);
    }

    fn halve(
        &self,
        first: usize,
        last: usize,
        value: &mut [Block],
        element: &(impl Fn(usize, &mut Sink<'_>) + Sync),
    ) {
        let row = |block: usize| (block * ROWS).min(self.pattern.rows());
        if last - first > 1 {
            let middle = first.midpoint(last);
            let size = self.pattern.start(row(middle)) - self.pattern.start(row(first));
            let (low, high) = value.split_at_mut(size);
            rayon::join(
                || self.halve(first, middle, low, element),
                || self.halve(middle, last, high, element),
            );
            return;
        }
        for block in first..last {
            for &number in &self.touching[block] {
                let e = number as usize;
                let mut sink = Sink {
                    vertex: &self.vertex[self.start[e] as usize..self.start[e + 1] as usize],
                    place: &self.place
                        [self.pair_start[e] as usize..self.pair_start[e + 1] as usize],
                    first_row: row(block),
                    last_row: row(block + 1),
                    first_place: self.pattern.start(row(block)),
                    value: &mut *value,
                };
                element(e, &mut sink);
            }
        }
    }
}

/// The stencils of an effect, made when a Hessian is first asked for.
#[derive(Debug, Default)]
pub struct LazyStencils(Option<Stencils>);

impl LazyStencils {
    /// The stencils for `pattern`, made from `elements` if there are none yet for it.
    pub fn for_pattern<I: AsRef<[u32]>, E: Iterator<Item = I>>(
        &mut self,
        pattern: &Arc<BlockPattern>,
        elements: impl FnOnce() -> E,
    ) -> &Stencils {
        if !self.0.as_ref().is_some_and(|stencils| stencils.fit(pattern)) {
            self.0 = None;
        }
        self.0.get_or_insert_with(|| Stencils::new(pattern, elements()))
    }
}
