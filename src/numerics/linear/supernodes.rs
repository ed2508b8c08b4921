//! The pattern of a factor: columns that are alike in one dense panel, and the tree of the panels.
//!
//! ```text
//! front of a supernode = | F₁₁      |   its own unknowns              (a panel of the factor)
//!                        | F₂₁  F₂₂ |   unknowns that it is coupled to, all in fronts above it
//! ```
//!
//! F₂₂ is what elimination leaves for the parent, whose front has all its unknowns (multifrontal method:
//! Duff & Reid, ACM Trans. Math. Softw. 9 (1983) 302, doi:10.1145/356044.356047). Supernodes that share no
//! ancestor below a third have nothing to do with each other: subtrees are worked on in parallel. How the
//! tree is cut into tasks depends on the pattern alone.

use super::dissection::{Elimination, Graph, NONE};
use super::lists::CompressedLists;
use super::panels::{fundamental, merged};
use super::{BlockPattern, LinearError};
use crate::num::{index, real};

/// Tasks that the work is cut into, some more than there may be threads.
const TARGET_TASKS: f64 = 64.0;

/// Multiplications below which handing out work costs more than it gains.
const MIN_PARALLEL_WORK: f64 = 1e6;

/// Where a stored block of the matrix goes.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    /// Its number.
    pub(super) block: u32,
    /// Row and column within the front, in vertices.
    pub(super) row: u32,
    pub(super) column: u32,
    /// Whether it is the block of the matrix, or its transpose.
    pub(super) upright: bool,
}

/// Neighbouring vertices of a front that are neighbours in the front of its parent too.
#[derive(Clone, Copy)]
pub(super) struct Run {
    /// Where the first is in the front of the parent.
    pub(super) place: u32,
    /// How many there are.
    pub(super) count: u32,
}

/// The tree of supernodes, in postorder: the subtree of s is `first[s]..=s`.
pub(super) struct Supernodes {
    axes: usize,
    /// Position → vertex.
    order: Vec<u32>,
    /// Vertex → position.
    rank: Vec<u32>,
    /// First position of every supernode.
    begin: Vec<usize>,
    /// Positions that it is coupled to, above its own, ascending.
    rows: CompressedLists<u32>,
    /// Where these are in the front of the parent.
    runs: CompressedLists<Run>,
    children: CompressedLists<u32>,
    roots: Vec<u32>,
    first: Vec<u32>,
    /// Where its panel begins among the numbers of the factor.
    value_start: Vec<usize>,
    entries: CompressedLists<Entry>,
    /// Whether its subtree is one task.
    serial: Vec<bool>,
    /// Numbers that F₂₂ takes, with those below it that are kept at the same time.
    room: Vec<usize>,
}

impl Supernodes {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if it is too large for the index type.
    pub(super) fn new(pattern: &BlockPattern) -> Result<Self, LinearError> {
        let graph = Graph::new(pattern)?;
        let elimination = Elimination::new(&graph)?;
        let groups = merged(fundamental(&graph, &elimination));
        let axes = pattern.axes();
        let count = groups.len();
        let mut all = Self {
            axes,
            order: elimination.order,
            rank: elimination.rank,
            begin: groups.iter().map(|g| g.begin).collect(),
            rows: CompressedLists::new(),
            runs: CompressedLists::new(),
            children: CompressedLists::new(),
            roots: Vec::new(),
            first: (0..count).map(index).collect(),
            value_start: vec![0],
            entries: CompressedLists::new(),
            serial: Vec::new(),
            room: vec![0; count],
        };
        all.begin.push(pattern.rows());
        for group in groups {
            let columns = axes * (group.end - group.begin);
            let size = columns * (columns + axes * group.rows.len());
            all.value_start.push(all.value_start[all.value_start.len() - 1] + size);
            all.rows.push(group.rows);
        }
        all.find_parents();
        all.find_tasks();
        all.find_entries(pattern);
        Ok(all)
    }

    fn find_parents(&mut self) {
        let count = self.count();
        let holder = |position: u32| {
            index(self.begin.partition_point(|&begin| begin <= position as usize) - 1)
        };
        let parent: Vec<u32> =
            (0..count).map(|s| self.rows(s).first().map_or(NONE, |&row| holder(row))).collect();
        let inner = || (0..count).filter(|&s| parent[s] != NONE);
        self.roots = (0..count).filter(|&s| parent[s] == NONE).map(index).collect();
        for s in 0..count {
            let runs = match parent[s] {
                NONE => Vec::new(),
                parent => self.runs_within(s, parent as usize),
            };
            self.runs.push(runs);
        }
        self.children =
            CompressedLists::sorted(count, || inner().map(|s| (parent[s] as usize, index(s))));
        for s in inner() {
            let p = parent[s] as usize;
            self.first[p] = self.first[p].min(self.first[s]);
        }
    }

    /// Where the rows of `s` are in the front of its parent `p`.
    fn runs_within(&self, s: usize, p: usize) -> Vec<Run> {
        let (begin, end) = (self.begin[p], self.begin[p + 1]);
        let above = self.rows(p);
        let mut known = 0;
        let mut runs: Vec<Run> = Vec::new();
        for &row in self.rows(s) {
            let place = if (row as usize) < end {
                row as usize - begin
            } else {
                known += above[known..].partition_point(|&r| r < row);
                end - begin + known
            };
            match runs.last_mut() {
                // None continues from the parent's own unknowns to others: these stay separate.
                Some(last)
                    if (last.place + last.count) as usize == place && place != end - begin =>
                {
                    last.count += 1;
                }
                _ => runs.push(Run { place: index(place), count: 1 }),
            }
        }
        runs
    }

    fn find_tasks(&mut self) {
        let mut work = vec![0.0; self.count()];
        for s in 0..self.count() {
            let (columns, rows) = (real(self.columns(s)), real(self.rest(s)));
            let own = columns * (columns * columns / 3.0 + columns * rows + rows * rows);
            let below: f64 = self.children(s).iter().map(|&c| work[c as usize]).sum();
            work[s] = own + below;
            let (mut kept, mut most) = (0, 0);
            for &c in self.children(s) {
                most = most.max(kept + self.room[c as usize]);
                kept += self.rest(c as usize) * self.rest(c as usize);
            }
            self.room[s] = self.rest(s) * self.rest(s) + most;
        }
        let all: f64 = self.roots.iter().map(|&s| work[s as usize]).sum();
        let largest = (all / TARGET_TASKS).max(MIN_PARALLEL_WORK);
        self.serial = work.iter().map(|work| *work <= largest).collect();
    }

    fn find_entries(&mut self, pattern: &BlockPattern) {
        let mut of: Vec<u32> = vec![0; pattern.rows()];
        for s in 0..self.count() {
            of[self.begin[s]..self.begin[s + 1]].fill(index(s));
        }
        let ends = |i: usize, j: u32| {
            let (i, j) = (self.rank[i], self.rank[j as usize]);
            (i.min(j), i.max(j), i >= j)
        };
        let blocks = (0..pattern.rows())
            .flat_map(|i| pattern.row(i).iter().enumerate().map(move |(k, &j)| (i, k, j)));
        let entry = |(i, k, j): (usize, usize, u32)| {
            let (column, row, upright) = ends(i, j);
            let s = of[column as usize] as usize;
            let (begin, end) = (self.begin[s], self.begin[s + 1]);
            let row = if (row as usize) < end {
                row as usize - begin
            } else {
                end - begin + self.rows(s).partition_point(|&r| r < row)
            };
            let entry = Entry {
                block: index(pattern.start(i) + k),
                row: index(row),
                column: index(column as usize - begin),
                upright,
            };
            (s, entry)
        };
        self.entries = CompressedLists::sorted(self.count(), || blocks.clone().map(entry));
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.begin.len() - 1
    }

    /// Unknowns of a vertex.
    pub(super) fn axes(&self) -> usize {
        self.axes
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.axes * self.order.len()
    }

    /// Vertices in the order of elimination.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Position of every vertex in that order.
    pub(super) fn rank(&self) -> &[u32] {
        &self.rank
    }

    /// Numbers of the factor before the panel of `s`; all of them for `s` = count.
    pub(super) fn values_before(&self, s: usize) -> usize {
        self.value_start[s]
    }

    /// Unknowns before those of `s`.
    pub(super) fn unknowns_before(&self, s: usize) -> usize {
        self.axes * self.begin[s]
    }

    /// Rows below the panels before that of `s`.
    pub(super) fn rests_before(&self, s: usize) -> usize {
        self.axes * self.rows.start[s]
    }

    /// Its own unknowns: columns of its panel.
    pub(super) fn columns(&self, s: usize) -> usize {
        self.axes * (self.begin[s + 1] - self.begin[s])
    }

    /// Other unknowns of its front: rows of F₂₂.
    pub(super) fn rest(&self, s: usize) -> usize {
        self.axes * self.rows(s).len()
    }

    fn rows(&self, s: usize) -> &[u32] {
        self.rows.list(s)
    }

    /// Where the vertices of F₂₂ are in the front of the parent, ascending; nothing for a root. A run is
    /// either among the own unknowns of the parent or among the others.
    pub(super) fn runs(&self, s: usize) -> &[Run] {
        self.runs.list(s)
    }

    /// Its children, ascending.
    pub(super) fn children(&self, s: usize) -> &[u32] {
        self.children.list(s)
    }

    /// Those without a parent.
    pub(super) fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// The first of its subtree.
    pub(super) fn first(&self, s: usize) -> usize {
        self.first[s] as usize
    }

    /// Whether its subtree is one task.
    pub(super) fn is_serial(&self, s: usize) -> bool {
        self.serial[s]
    }

    /// Numbers that the rests of its subtree take in one task.
    pub(super) fn workspace_size(&self, s: usize) -> usize {
        self.room[s]
    }

    /// The blocks of the matrix that its panel begins with.
    pub(super) fn entries(&self, s: usize) -> &[Entry] {
        self.entries.list(s)
    }
}
