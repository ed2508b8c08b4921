//! Sums over elements (edges, triangles) that end up at vertices.
//!
//! The vertices are cut into blocks of consecutive numbers. Each block has the list of all elements
//! that touch it, so that one thread can sum for its own vertices without asking others: an element
//! between two blocks is computed in both. Within a block the order is fixed, so the result does
//! not depend on the number of threads. Elements come in groups of four for [`super::simd`].

use super::simd::{LANES, Lanes, Simd, Task, dispatch};
use crate::num::index;

/// Vertices per block. Larger blocks compute fewer elements twice (a sheet's block of n vertices
/// has some 4√n elements on its border), smaller ones stay in the first-level cache.
pub const VERTICES_PER_BLOCK: usize = 1024;

/// Four elements of K corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Group<const K: usize> {
    /// Their numbers; the last ones are repeated where fewer than four are left.
    pub element: [u32; LANES],
    /// Vertices, corner by corner.
    pub vertex: [[u32; LANES]; K],
    /// Where in the block each corner is summed; [`VERTICES_PER_BLOCK`] for vertices of other blocks.
    target: [[u16; LANES]; K],
    /// How many of the four are counted in a total: each element is in one block only.
    counted: u8,
}

/// The elements of a sheet, block by block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementBlocks<const K: usize> {
    vertices: usize,
    block: Vec<Vec<Group<K>>>,
}

/// Four numbers that are summed together, in one register.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(align(32))]
pub struct F64x4(pub [f64; LANES]);

/// What four elements give to their corners.
pub trait Kernel<const K: usize, const Q: usize>: Sync {
    /// The numbers to total and 4Q numbers for each corner of `group`. Implementations should be
    /// `#[inline(always)]`.
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<K>) -> (S::Lanes, Corners<S::Lanes, K, Q>);
}

/// For each of K corners Q times four numbers, for four elements at once.
pub type Corners<L, const K: usize, const Q: usize> = [[[L; LANES]; Q]; K];

impl<const K: usize> ElementBlocks<K> {
    /// Sorts `elements` by the blocks that they touch; in totals those are counted that `counts` says.
    #[must_use]
    pub fn new(vertices: usize, elements: &[[u32; K]], counts: impl Fn(&[u32; K]) -> bool) -> Self {
        // The elements of which the block has the first vertex and which are counted, and the others.
        let mut own: Vec<Vec<u32>> = vec![Vec::new(); vertices.div_ceil(VERTICES_PER_BLOCK)];
        let mut foreign = own.clone();
        for (number, corners) in elements.iter().enumerate() {
            let blocks = corners.map(|v| v as usize / VERTICES_PER_BLOCK);
            let first = if counts(corners) { &mut own } else { &mut foreign };
            first[blocks[0]].push(index(number));
            for k in 1..K {
                if !blocks[..k].contains(&blocks[k]) {
                    foreign[blocks[k]].push(index(number));
                }
            }
        }
        let block = own.iter().zip(&foreign).enumerate().map(|(b, (own, foreign))| {
            let groups = |list: &[u32], counts: bool| -> Vec<Group<K>> {
                list.chunks(LANES).map(|four| group(b, four, elements, counts)).collect()
            };
            [groups(own, true), groups(foreign, false)].concat()
        });
        Self { vertices, block: block.collect() }
    }

    /// Sums what `kernel` gives to each vertex and hands it to `write`, vertex by vertex;
    /// returns the total.
    pub fn accumulate<const Q: usize, T: Send>(
        &self,
        kernel: &impl Kernel<K, Q>,
        out: &mut [T],
        write: impl Fn(&mut T, &[F64x4; Q]) + Sync,
    ) -> f64 {
        debug_assert_eq!(out.len(), self.vertices);
        split(&self.block, out, &|groups: &[Group<K>], mine: &mut [T]| {
            // One place more than there are vertices: what belongs to other blocks.
            let mut sum = [[F64x4::default(); Q]; VERTICES_PER_BLOCK + 1];
            let total = dispatch(OneBlock { groups, kernel, sum: &mut sum });
            for (place, sum) in mine.iter_mut().zip(&sum) {
                write(place, sum);
            }
            total
        })
    }

    /// The total of `kernel` alone.
    pub fn total(&self, kernel: &impl Kernel<K, 0>) -> f64 {
        super::reduce(
            self.block.len(),
            &|b| {
                dispatch(OneBlock {
                    groups: &self.block[b],
                    kernel,
                    sum: &mut [[]; VERTICES_PER_BLOCK + 1],
                })
            },
            &|a, b| a + b,
        )
        .unwrap_or(0.0)
    }
}

fn group<const K: usize>(
    block: usize,
    four: &[u32],
    elements: &[[u32; K]],
    counts: bool,
) -> Group<K> {
    let outside = VERTICES_PER_BLOCK;
    let at = |lane: usize| four[lane.min(four.len() - 1)];
    let corner = |k: usize, lane: usize| elements[at(lane) as usize][k];
    let target = |k: usize, lane: usize| {
        let v = corner(k, lane) as usize;
        let place = if lane < four.len() && v / VERTICES_PER_BLOCK == block {
            v - block * VERTICES_PER_BLOCK
        } else {
            outside
        };
        u16::try_from(place).unwrap_or(u16::MAX)
    };
    Group {
        element: std::array::from_fn(at),
        vertex: std::array::from_fn(|k| std::array::from_fn(|lane| corner(k, lane))),
        target: std::array::from_fn(|k| std::array::from_fn(|lane| target(k, lane))),
        counted: if counts { u8::try_from(four.len()).unwrap_or(0) } else { 0 },
    }
}

struct OneBlock<'a, const K: usize, const Q: usize, F> {
    groups: &'a [Group<K>],
    kernel: &'a F,
    sum: &'a mut [[F64x4; Q]; VERTICES_PER_BLOCK + 1],
}

impl<const K: usize, const Q: usize, F: Kernel<K, Q>> Task for OneBlock<'_, K, Q, F> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> f64 {
        let mut total = simd.splat(0.0);
        let mut rest = 0.0;
        for group in self.groups {
            let (term, corner) = self.kernel.evaluate(simd, group);
            if usize::from(group.counted) == LANES {
                total = total + term;
            } else if group.counted > 0 {
                for value in term.array().iter().take(group.counted.into()) {
                    rest += value;
                }
            }
            for k in 0..K {
                for q in 0..Q {
                    let value = simd.transpose(corner[k][q]);
                    for lane in 0..LANES {
                        // The minimum changes nothing; it tells the compiler that the place exists.
                        let place = usize::from(group.target[k][lane]).min(VERTICES_PER_BLOCK);
                        let F64x4(place) = &mut self.sum[place][q];
                        *place = (simd.load(*place) + value[lane]).array();
                    }
                }
            }
        }
        let [a, b, c, d] = total.array();
        (a + b) + (c + d) + rest
    }
}

/// Hands every block and its vertices to `f`, halving; sums in a fixed order.
fn split<const K: usize, T: Send>(
    block: &[Vec<Group<K>>],
    out: &mut [T],
    f: &(dyn Fn(&[Group<K>], &mut [T]) -> f64 + Sync),
) -> f64 {
    match block {
        [] => 0.0,
        [one] => f(one, out),
        _ => {
            let middle = block.len() / 2;
            let (low, high) = block.split_at(middle);
            let (left, right) = out.split_at_mut(middle * VERTICES_PER_BLOCK);
            let (a, b) = rayon::join(|| split(low, left, f), || split(high, right, f));
            a + b
        }
    }
}
