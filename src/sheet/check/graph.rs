//! Edges of a soup that need not be manifold, and disjoint sets.

use rumple_numerics::num::index;

/// One side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct HalfEdge {
    pub(super) low: u32,
    pub(super) high: u32,
    pub(super) triangle: usize,
    pub(super) side: usize,
    /// Whether it runs from `low` to `high`.
    pub(super) forward: bool,
}

/// All sides, those of one edge next to one another.
pub(super) struct Edges(Vec<HalfEdge>);

impl Edges {
    pub(super) fn new(triangles: &[[u32; 3]]) -> Self {
        let mut half = Vec::with_capacity(3 * triangles.len());
        for (triangle, tri) in triangles.iter().enumerate() {
            for side in 0..3 {
                let (a, b) = (tri[side], tri[(side + 1) % 3]);
                let (low, high) = (a.min(b), a.max(b));
                half.push(HalfEdge { low, high, triangle, side, forward: a < b });
            }
        }
        half.sort_unstable();
        Self(half)
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.0.chunk_by(|p, q| (p.low, p.high) == (q.low, q.high))
    }
}

/// Disjoint sets; the root of a set is its smallest member.
pub(super) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    pub(super) fn new(size: usize) -> Self {
        Self((0..size).map(index).collect())
    }

    pub(super) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = index(a.min(b));
    }
}
