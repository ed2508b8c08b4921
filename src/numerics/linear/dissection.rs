//! The order in which the vertices of a sheet are eliminated, and the tree that it makes.
//!
//! The order is nested dissection on the graph of the vertices (not of the two or three times as many
//! unknowns), found once for a pattern. A vertex must wait for those below it in the elimination tree and
//! for no other (Liu, SIAM J. Matrix Anal. Appl. 11 (1990) 134, doi:10.1137/0611010).

use feral_metis::{CscPattern, metis_order};

use super::BlockPattern;
use super::LinearError;
use super::lists::CompressedLists;
use crate::num::index;

/// Stands for no vertex.
pub(super) const NONE: u32 = u32::MAX;

/// Neighbours of every vertex, ascending, itself not among them.
pub(super) struct Graph {
    start: Vec<i32>,
    neighbour: Vec<i32>,
}

impl Graph {
    /// Of the blocks of `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if it is too large for the index type.
    pub(super) fn new(pattern: &BlockPattern) -> Result<Self, LinearError> {
        let n = pattern.rows();
        // Rows above come first, so every list is filled in ascending order.
        let pairs = || {
            (0..n).flat_map(|i| {
                let neighbours =
                    pattern.row(i).iter().map(|&j| j as usize).filter(move |&j| j != i);
                neighbours.flat_map(move |j| [(i, j), (j, i)])
            })
        };
        let CompressedLists { start, item } = CompressedLists::sorted(n, pairs);
        let narrow = |k: usize| i32::try_from(k).map_err(|_| no_order(n));
        let neighbour = item.into_iter().map(narrow).collect::<Result<_, _>>()?;
        let start = start.into_iter().map(narrow).collect::<Result<_, _>>()?;
        Ok(Self { start, neighbour })
    }

    fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The neighbours of vertex `i`.
    pub(super) fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        let at = |k: usize| usize::try_from(self.start[k]).unwrap_or_default();
        self.neighbour[at(i)..at(i + 1)].iter().map(|&j| usize::try_from(j).unwrap_or_default())
    }
}

/// Vertices in the order of elimination, and the tree.
pub(super) struct Elimination {
    /// Position → vertex, children before their parents and every subtree in one piece.
    pub(super) order: Vec<u32>,
    /// Vertex → position.
    pub(super) rank: Vec<u32>,
    /// Position → position of the parent, or [`NONE`].
    pub(super) parent: Vec<u32>,
}

impl Elimination {
    /// By nested dissection of `graph`.
    ///
    /// # Errors
    /// [`LinearError`] if no order is found.
    pub(super) fn new(graph: &Graph) -> Result<Self, LinearError> {
        let n = graph.len();
        let pattern = CscPattern::new(n, &graph.start, &graph.neighbour);
        let order = metis_order(&pattern.ok_or_else(|| no_order(n))?).map_err(|_| no_order(n))?;
        let order: Result<Vec<u32>, _> = order.into_iter().map(u32::try_from).collect();
        let order = order.map_err(|_| no_order(n))?;
        let parent = tree(graph, &order, &inverse(&order));
        let (after, parent) = in_postorder(&parent);
        let order: Vec<u32> = after.iter().map(|&k| order[k as usize]).collect();
        let rank = inverse(&order);
        Ok(Self { order, rank, parent })
    }
}

fn no_order(n: usize) -> LinearError {
    LinearError::new(format!("no ordering for {n} vertices"))
}

fn inverse(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![0; order.len()];
    for (position, &vertex) in order.iter().enumerate() {
        inverse[vertex as usize] = index(position);
    }
    inverse
}

/// Parents in the elimination tree of this order.
fn tree(graph: &Graph, order: &[u32], rank: &[u32]) -> Vec<u32> {
    let mut parent = vec![NONE; order.len()];
    // Shortcuts upwards.
    let mut ancestor = parent.clone();
    for (i, &vertex) in order.iter().enumerate() {
        for neighbour in graph.neighbours(vertex as usize) {
            let mut k = rank[neighbour] as usize;
            while k < i {
                let next = std::mem::replace(&mut ancestor[k], index(i));
                if next == NONE {
                    parent[k] = index(i);
                    break;
                }
                k = next as usize;
            }
        }
    }
    parent
}

/// A postorder of the tree: new position → old, and the parents by new positions. The largest subtree
/// comes last: it can become one with its parent.
fn in_postorder(parent: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = parent.len();
    let mut size = vec![1u32; n];
    for (k, &p) in parent.iter().enumerate() {
        if p != NONE {
            size[p as usize] += size[k];
        }
    }
    let mut children: Vec<u32> = (0..n).map(index).collect();
    children.sort_by_key(|&k| (parent[k as usize], size[k as usize]));
    let begin = |p: u32| children.partition_point(|&k| parent[k as usize] < p);
    let mut order = Vec::with_capacity(n);
    // Parents before children from the last position on, turned round at the end.
    let mut waiting: Vec<u32> = children[begin(NONE)..].to_vec();
    while let Some(k) = waiting.pop() {
        order.push(k);
        let first = begin(k);
        waiting.extend(children[first..].iter().take_while(|&&c| parent[c as usize] == k));
    }
    order.reverse();
    let rank = inverse(&order);
    let of = |&k: &u32| match parent[k as usize] {
        NONE => NONE,
        p => rank[p as usize],
    };
    let parents = order.iter().map(of).collect();
    (order, parents)
}
