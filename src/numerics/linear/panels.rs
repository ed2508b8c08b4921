//! Which columns of a factor make a dense panel together.

use super::dissection::{Elimination, Graph, NONE};
use crate::num::{index, real};

/// A supernode and its last child become one if together they have at most so many vertices and at most
/// that share of zeros: few large panels are faster than many small ones.
const MERGE_LIMITS: [(usize, f64); 4] = [(3, 1.0), (8, 0.5), (24, 0.15), (usize::MAX, 0.05)];

/// Columns from `begin` to `end`, and their rows below.
pub(super) struct Group {
    pub(super) begin: usize,
    pub(super) end: usize,
    pub(super) rows: Vec<u32>,
    /// Blocks of the factor that are not zero.
    filled: usize,
}

/// Chains of vertices that have the same rows below.
pub(super) fn fundamental(graph: &Graph, elimination: &Elimination) -> Vec<Group> {
    let Elimination { order, rank, parent } = elimination;
    let n = order.len();
    let mut children: Vec<u32> = vec![0; n];
    for &p in parent.iter().filter(|&&p| p != NONE) {
        children[p as usize] += 1;
    }
    let mut groups: Vec<Group> = Vec::new();
    // The groups whose parent is yet to come, the last ones first.
    let mut waiting: Vec<usize> = Vec::new();
    let mut seen = vec![NONE; n];
    for j in 0..n {
        let mut rows: Vec<u32> = Vec::new();
        seen[j] = index(j);
        let mut see = |row: u32| {
            if row as usize > j && seen[row as usize] != index(j) {
                seen[row as usize] = index(j);
                rows.push(row);
            }
        };
        graph.neighbours(order[j] as usize).for_each(|neighbour| see(rank[neighbour]));
        let below = waiting.split_off(waiting.len() - children[j] as usize);
        for &child in &below {
            groups[child].rows.iter().for_each(|&row| see(row));
        }
        let filled = rows.len() + 1;
        match (below.as_slice(), groups.last_mut()) {
            ([_], Some(only)) if only.rows.len() == rows.len() + 1 => {
                only.end = j + 1;
                only.rows = rows;
                only.filled += filled;
            }
            _ => groups.push(Group { begin: j, end: j + 1, rows, filled }),
        }
        if parent[j] != NONE {
            waiting.push(groups.len() - 1);
        }
    }
    groups.iter_mut().for_each(|group| group.rows.sort_unstable());
    groups
}

/// The groups with children merged into their parents where that adds few zeros.
pub(super) fn merged(groups: Vec<Group>) -> Vec<Group> {
    let mut all: Vec<Group> = Vec::new();
    for mut group in groups {
        while let Some(before) = all.last() {
            // Is it a child? Then its first row is a column here.
            if before.rows.first().is_none_or(|&row| row as usize >= group.end) {
                break;
            }
            let columns = group.end - before.begin;
            let size = columns * (columns + 1) / 2 + columns * group.rows.len();
            let zeros = 1.0 - real(before.filled + group.filled) / real(size);
            if !MERGE_LIMITS.iter().any(|&(most, share)| columns <= most && zeros <= share) {
                break;
            }
            group.begin = before.begin;
            group.filled += before.filled;
            all.pop();
        }
        all.push(group);
    }
    all
}
