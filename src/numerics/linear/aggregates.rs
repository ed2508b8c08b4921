//! Greedy aggregation of the nodes of a graph.
//!
//! Source: Vaněk, Mandel & Brezina, "Algebraic multigrid by smoothed aggregation for second and
//! fourth order elliptic problems", Computing 56 (1996) 179, doi:10.1007/BF02238511, algorithm 2.
//! Nodes are visited breadth first, so that each new aggregate lies close to those before it.

use std::collections::VecDeque;

use super::symmetric_rows::FullRowPattern;
use crate::num::index;

/// Not in an aggregate yet.
const UNASSIGNED: u32 = u32::MAX;

/// Which aggregate every node belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Aggregates {
    /// Aggregate of every node.
    pub(super) of: Vec<u32>,
    /// Number of aggregates.
    pub(super) count: usize,
}

impl Aggregates {
    /// A node whose neighbours are all free makes an aggregate with them; nodes left over join the
    /// aggregate that most of their neighbours are in (the lowest-numbered of several).
    ///
    /// In the pattern of a sheet neighbours are up to two edges apart: aggregates have some 20
    /// vertices. Sequential, linear in the entries of the pattern.
    pub(super) fn new(rows: &FullRowPattern) -> Self {
        let mut of = vec![UNASSIGNED; rows.len()];
        let mut count = 0;
        for i in breadth_first(rows) {
            let around = rows.row(i as usize);
            if around.iter().all(|&j| of[j as usize] == UNASSIGNED) {
                for &j in around {
                    of[j as usize] = count;
                }
                count += 1;
            }
        }
        let roots = of.clone();
        let mut near = Vec::new();
        for (i, place) in of.iter_mut().enumerate().filter(|(_, place)| **place == UNASSIGNED) {
            near.clear();
            near.extend(
                rows.row(i).iter().map(|&j| roots[j as usize]).filter(|&a| a != UNASSIGNED),
            );
            near.sort_unstable();
            let most = near.chunk_by(|a, b| a == b).rev().max_by_key(|group| group.len());
            // A node that made no aggregate has a neighbour that is in one.
            *place = most.map_or(0, |group| group[0]);
        }
        Self { of, count: count as usize }
    }
}

/// All nodes, part after part of the graph breadth first.
fn breadth_first(rows: &FullRowPattern) -> Vec<u32> {
    let mut order = Vec::with_capacity(rows.len());
    let mut seen = vec![false; rows.len()];
    let mut queue = VecDeque::new();
    for first in 0..rows.len() {
        if !std::mem::replace(&mut seen[first], true) {
            queue.push_back(index(first));
        }
        while let Some(i) = queue.pop_front() {
            order.push(i);
            for &j in rows.row(i as usize) {
                if !std::mem::replace(&mut seen[j as usize], true) {
                    queue.push_back(j);
                }
            }
        }
    }
    order
}
