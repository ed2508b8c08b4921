//! Where the second derivatives of elements go in a [`BlockMatrix`].
//!
//! An element (an edge, a triangle, a vertex with its ring) couples the vertices of its stencil. The
//! place of every pair in the matrix is looked up once; the assembly then adds without searching.
//! As in [`crate::parallel::element_blocks`], rows are cut into blocks, each with the list of elements that
//! touch it; an element on the border of two is computed in both, and the order of the sums does
//! not depend on the number of threads.

use std::sync::Arc;

use super::block_matrix::ValuesMut;
use super::{Block, BlockMatrix, BlockPattern};
use crate::num::index;
use crate::parallel::simd::{LANES, Lanes, Simd, Task, dispatch};

/// Rows per block.
const BLOCK_ROWS: usize = 512;

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
    /// The first pair that the pattern lacks.
    outside: Option<[u32; 2]>,
}

/// Takes the blocks of one element.
pub struct Sink<'a> {
    vertex: &'a [u32],
    place: &'a [u32],
    first_row: usize,
    last_row: usize,
    first_place: usize,
    value: ValuesMut<'a>,
}

/// Takes the blocks of the elements that touch some rows.
pub struct Rows<'a> {
    stencils: &'a Stencils,
    first: usize,
    last: usize,
    value: ValuesMut<'a>,
}

/// The nine entries of a block, column by column, in two registers and a number.
#[derive(Clone, Copy)]
pub struct Packed<L>(pub [L; 2], pub f64);

/// Elements whose blocks are computed on wide registers: see [`Stencils::assemble_wide`].
pub trait Elements: Sync {
    /// Adds the blocks of `elements` to `rows`. Implementations must be `#[inline(always)]`.
    fn add<S: Simd>(&self, simd: S, elements: &[u32], rows: &mut Rows<'_>);
}

struct OneBlock<'a, 'b, E> {
    elements: &'a E,
    numbers: &'a [u32],
    rows: Rows<'b>,
}

impl<E: Elements> Task for OneBlock<'_, '_, E> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        self.elements.add(simd, self.numbers, &mut self.rows);
    }
}

impl Rows<'_> {
    /// The vertices of element `e`, ascending.
    #[inline(always)]
    #[must_use]
    pub fn vertices(&self, e: u32) -> &[u32] {
        self.stencils.vertices(e as usize)
    }

    /// Where the blocks of element `e` go.
    #[inline(always)]
    pub fn sink(&mut self, e: u32) -> Sink<'_> {
        let stencils = self.stencils;
        let e = e as usize;
        Sink {
            vertex: stencils.vertices(e),
            place: &stencils.place
                [stencils.pair_start[e] as usize..stencils.pair_start[e + 1] as usize],
            first_row: self.first,
            last_row: self.last,
            first_place: stencils.pattern.start(self.first),
            value: self.value.reborrow(),
        }
    }
}

impl Sink<'_> {
    /// The vertices of the element, ascending.
    #[must_use]
    #[inline]
    pub fn vertices(&self) -> &[u32] {
        self.vertex
    }

    /// Whether the block (p, q) of the element, p ≤ q in the order of [`Sink::vertices`], belongs to
    /// the rows being summed; others need not be computed.
    #[must_use]
    #[inline]
    pub fn wants(&self, p: usize) -> bool {
        (self.first_row..self.last_row).contains(&(self.vertex[p] as usize))
    }

    /// Adds block (p, q), p ≤ q.
    #[inline]
    pub fn add(&mut self, p: usize, q: usize, block: &Block) {
        if self.wants(p) {
            self.value.add(self.place(p, q), block);
        }
    }

    /// Adds block (p, q), p ≤ q.
    #[inline(always)]
    pub fn add_packed<S: Simd>(&mut self, simd: S, p: usize, q: usize, block: Packed<S::Lanes>) {
        if !self.wants(p) {
            return;
        }
        let place = self.place(p, q);
        let Packed([low, high], last) = block;
        if let Some(own) = self.value.space.get_mut(place) {
            let [[a, b, c], [d, e, f], [g, h, i]] = &mut own.data.0;
            [*a, *b, *c, *d] = (simd.load([*a, *b, *c, *d]) + low).array();
            [*e, *f, *g, *h] = (simd.load([*e, *f, *g, *h]) + high).array();
            *i += last;
        } else {
            let ([a, b, _, d], [e, ..]) = (low.array(), high.array());
            self.value.plane[place] += nalgebra::Matrix2::new(a, d, b, e);
        }
    }

    /// Where block (p, q) is among the values.
    #[inline(always)]
    fn place(&self, p: usize, q: usize) -> usize {
        let m = self.vertex.len();
        let pair = p * m - p * p.saturating_sub(1) / 2 + (q - p);
        self.place[pair] as usize - self.first_place
    }
}

impl Stencils {
    /// Looks up the places of `elements`, each a list of vertices in ascending order.
    ///
    /// A pair that is not in the pattern has no place and is reported by every matrix
    /// assembled with these stencils: [`BlockMatrix::outside`].
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
            touching: vec![Vec::new(); pattern.rows().div_ceil(BLOCK_ROWS)],
            outside: None,
        };
        for (number, element) in elements.enumerate() {
            let vertices = element.as_ref();
            debug_assert!(vertices.is_sorted());
            for (p, &row) in vertices.iter().enumerate() {
                let first = pattern.start(row as usize);
                let columns = pattern.row(row as usize);
                for column in &vertices[p..] {
                    let found = columns.binary_search(column);
                    if found.is_err() {
                        stencils.outside.get_or_insert([row, *column]);
                    }
                    stencils.place.push(index(first + found.unwrap_or(0)));
                }
                let block = row as usize / BLOCK_ROWS;
                if p == 0 || vertices[p - 1] as usize / BLOCK_ROWS != block {
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

    /// Lets `element` add the blocks of every element to `matrix`, one after the other.
    pub fn assemble(
        &self,
        matrix: &mut BlockMatrix,
        element: impl Fn(usize, &mut Sink<'_>) + Sync,
    ) {
        matrix.note_outside(self.outside);
        by_rows(matrix, &|block, first, last, value| {
            let mut rows = Rows { stencils: self, first, last, value };
            for &number in &self.touching[block] {
                element(number as usize, &mut rows.sink(number));
            }
        });
    }

    /// Lets the elements of two kinds add their blocks to `matrix` on wide registers. Both go
    /// through the rows together, so that these come from the memory once.
    pub fn assemble_wide(
        matrix: &mut BlockMatrix,
        (one, elements): (&Self, &impl Elements),
        other: Option<(&Self, &impl Elements)>,
    ) {
        matrix.note_outside(one.outside);
        matrix.note_outside(other.and_then(|(stencils, _)| stencils.outside));
        by_rows(matrix, &|block, first, last, mut value| {
            let numbers = &one.touching[block];
            let rows = Rows { stencils: one, first, last, value: value.reborrow() };
            dispatch(OneBlock { elements, numbers, rows });
            if let Some((stencils, elements)) = other {
                let numbers = &stencils.touching[block];
                let rows = Rows { stencils, first, last, value };
                dispatch(OneBlock { elements, numbers, rows });
            }
        });
    }

    #[inline(always)]
    fn vertices(&self, e: usize) -> &[u32] {
        &self.vertex[self.start[e] as usize..self.start[e + 1] as usize]
    }
}

/// Hands every block of rows (its number, first row, end, values) to `add`, in parallel.
fn by_rows(matrix: &mut BlockMatrix, add: &(impl Fn(usize, usize, usize, ValuesMut<'_>) + Sync)) {
    let pattern = Arc::clone(matrix.pattern());
    halve(&pattern, 0, pattern.rows().div_ceil(BLOCK_ROWS), matrix.values_mut(), add);
}

fn halve(
    pattern: &BlockPattern,
    first: usize,
    last: usize,
    value: ValuesMut<'_>,
    add: &(impl Fn(usize, usize, usize, ValuesMut<'_>) + Sync),
) {
    let row = |block: usize| (block * BLOCK_ROWS).min(pattern.rows());
    if last - first > 1 {
        let middle = first.midpoint(last);
        let size = pattern.start(row(middle)) - pattern.start(row(first));
        let (low, high) = value.split_at(size);
        rayon::join(
            || halve(pattern, first, middle, low, add),
            || halve(pattern, middle, last, high, add),
        );
    } else if last > first {
        add(first, row(first), row(last), value);
    }
}

/// Four blocks, one per lane, from their nine entries column by column.
#[inline(always)]
pub fn pack<S: Simd>(simd: S, entry: [S::Lanes; 9]) -> [Packed<S::Lanes>; LANES] {
    let [a, b, c, d, e, f, g, h, i] = entry;
    let low = simd.transpose([a, b, c, d]);
    let high = simd.transpose([e, f, g, h]);
    let last = i.array();
    [
        Packed([low[0], high[0]], last[0]),
        Packed([low[1], high[1]], last[1]),
        Packed([low[2], high[2]], last[2]),
        Packed([low[3], high[3]], last[3]),
    ]
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
