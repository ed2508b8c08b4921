//! Numeric factorisation over the tree of supernodes, subtrees in parallel.

use std::sync::{Mutex, PoisonError, RwLock, RwLockReadGuard};

use faer::MatMut;
use rayon::prelude::*;

use super::fronts::eliminate;
use super::supernodes::Supernodes;
use super::{BlockMatrix, NotPositive, Precision};

/// Columns of a large front that are put together at a time.
const STRIP: usize = 64;

/// Rooms that fronts are put together in, kept from one factorisation to the next: nothing is allocated
/// again.
pub(super) struct FrontWorkspace<T> {
    free: Mutex<Vec<Vec<T>>>,
    /// What every supernode left whose parent is yet to come, if it is the last of its task.
    left: Vec<RwLock<Vec<T>>>,
}

impl<T: Precision> FrontWorkspace<T> {
    pub(super) fn new(tree: &Supernodes) -> Self {
        let left = (0..tree.count()).map(|_| RwLock::new(Vec::new())).collect();
        Self { free: Mutex::new(Vec::new()), left }
    }

    /// One of at least `size` numbers, whatever they are: the smallest that will do.
    fn take(&self, size: usize) -> Vec<T> {
        if size == 0 {
            return Vec::new();
        }
        let mut all = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = all.iter().enumerate().filter(|(_, room)| room.len() >= size);
        let best = fits.min_by_key(|(_, room)| room.len()).map(|(k, _)| k);
        match best {
            Some(k) => all.swap_remove(k),
            None => {
                drop(all);
                vec![T::from_f64(0.0); size]
            }
        }
    }

    fn give(&self, room: Vec<T>) {
        if !room.is_empty() {
            self.free.lock().unwrap_or_else(PoisonError::into_inner).push(room);
        }
    }

    fn leave(&self, s: usize, room: Vec<T>) {
        *self.left[s].write().unwrap_or_else(PoisonError::into_inner) = room;
    }

    fn read(&self, s: usize) -> RwLockReadGuard<'_, Vec<T>> {
        self.left[s].read().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was left by these is not needed any more.
    fn clear(&self, all: &[u32]) {
        for &s in all {
            let mut left = self.left[s as usize].write().unwrap_or_else(PoisonError::into_inner);
            self.give(std::mem::take(&mut *left));
        }
    }
}

/// One factorisation.
pub(super) struct Factorisation<'a, T: Precision> {
    pub(super) tree: &'a Supernodes,
    pub(super) matrix: &'a BlockMatrix,
    /// What the matrix is multiplied by.
    pub(super) scale: f64,
    pub(super) rooms: &'a FrontWorkspace<T>,
}

impl<T: Precision> Factorisation<'_, T> {
    /// Writes the panels of all supernodes to `values`.
    ///
    /// # Errors
    /// [`NotPositive`] where a pivot is not positive.
    pub(super) fn run(&self, values: &mut [T]) -> Result<(), NotPositive> {
        let result = self.below(self.tree.roots(), values);
        self.rooms.clear(self.tree.roots());
        result
    }

    /// The subtrees of `all`, which lie one after the other.
    fn below(&self, all: &[u32], values: &mut [T]) -> Result<(), NotPositive> {
        match all {
            [] => Ok(()),
            [only] => self.subtree(*only as usize, values),
            _ => {
                let (low, high) = all.split_at(all.len() / 2);
                let begin = |s: u32| self.tree.values_before(self.tree.first(s as usize));
                let (left, right) = values.split_at_mut(begin(high[0]) - begin(low[0]));
                let done = rayon::join(|| self.below(low, left), || self.below(high, right));
                done.0.and(done.1)
            }
        }
    }

    fn subtree(&self, s: usize, values: &mut [T]) -> Result<(), NotPositive> {
        let (tree, rooms) = (self.tree, self.rooms);
        if tree.is_serial(s) {
            let mut room = rooms.take(tree.workspace_size(s));
            let result = self.serial(s, values, &mut room);
            rooms.leave(s, room);
            return result;
        }
        let (columns, rest) = (tree.columns(s), tree.rest(s));
        let height = columns + rest;
        let (below, panel) = values.split_at_mut(values.len() - columns * height);
        if let Err(error) = self.below(tree.children(s), below) {
            rooms.clear(tree.children(s));
            return Err(error);
        }
        let mut room = rooms.take(rest * rest);
        let left = &mut room[..rest * rest];
        self.add_entries(s, panel);
        self.add_strips(s, panel, Strip::of_panel(height));
        let matrix = MatMut::from_column_major_slice_mut(panel, height, columns);
        let result = eliminate(matrix, MatMut::from_column_major_slice_mut(left, rest, rest));
        if result.is_ok() {
            self.add_strips(s, left, Strip::of_rest(rest, columns));
        }
        rooms.clear(tree.children(s));
        rooms.leave(s, room);
        result
    }

    /// Adds what the children left, strip by strip, so that no two threads write to the same place.
    fn add_strips(&self, s: usize, numbers: &mut [T], strip: Strip) {
        let step = STRIP * strip.height.max(1);
        numbers.par_chunks_mut(step).enumerate().for_each(|(k, numbers)| {
            let strip = Strip { begin: strip.begin + STRIP * k, ..strip };
            for &child in self.tree.children(s) {
                let left = self.rooms.read(child as usize);
                strip.add_child(self.tree, child as usize, &left, numbers);
            }
        });
    }

    /// The same by one thread; what is left is at the beginning of `room`.
    fn serial(&self, s: usize, values: &mut [T], room: &mut [T]) -> Result<(), NotPositive> {
        let tree = self.tree;
        let (columns, rest) = (tree.columns(s), tree.rest(s));
        let height = columns + rest;
        let (mut below, panel) = values.split_at_mut(values.len() - columns * height);
        let (left, room) = room.split_at_mut(rest * rest);
        self.add_entries(s, panel);
        let mut kept = 0;
        for &child in tree.children(s) {
            let child = child as usize;
            let size = tree.values_before(child + 1) - tree.values_before(tree.first(child));
            let (part, tail) = below.split_at_mut(size);
            self.serial(child, part, &mut room[kept..])?;
            Strip::of_panel(height).add_child(tree, child, &room[kept..], panel);
            kept += tree.rest(child) * tree.rest(child);
            below = tail;
        }
        let panel = MatMut::from_column_major_slice_mut(panel, height, columns);
        eliminate(panel, MatMut::from_column_major_slice_mut(&mut *left, rest, rest))?;
        let mut kept = 0;
        for &child in tree.children(s) {
            let child = child as usize;
            Strip::of_rest(rest, columns).add_child(tree, child, &room[kept..], left);
            kept += tree.rest(child) * tree.rest(child);
        }
        Ok(())
    }

    /// Fills the panel of `s` with the blocks of the matrix.
    fn add_entries(&self, s: usize, panel: &mut [T]) {
        panel.fill(T::from_f64(0.0));
        let axes = self.tree.axes();
        let height = self.tree.columns(s) + self.tree.rest(s);
        for entry in self.tree.entries(s) {
            let block = self.matrix.block(entry.block as usize);
            let at = axes * (entry.column as usize * height + entry.row as usize);
            for column in 0..axes {
                let place = &mut panel[at + column * height..][..axes];
                for (row, place) in place.iter_mut().enumerate() {
                    let from = if entry.upright { (row, column) } else { (column, row) };
                    *place = T::from_f64(self.scale * block[from]);
                }
            }
        }
    }
}

/// Some whole columns of a panel, or of what is left of a front.
#[derive(Clone, Copy)]
struct Strip {
    /// Rows.
    height: usize,
    /// Number of the first column in the front.
    begin: usize,
    /// Rows of the front above the first one here.
    above: usize,
}

impl Strip {
    fn of_panel(height: usize) -> Self {
        Self { height, begin: 0, above: 0 }
    }

    fn of_rest(height: usize, columns: usize) -> Self {
        Self { height, begin: columns, above: columns }
    }

    /// Adds what the child `c` left to `numbers`, as far as it belongs there.
    fn add_child<T: Precision>(self, tree: &Supernodes, c: usize, left: &[T], numbers: &mut [T]) {
        let Self { height, begin, above } = self;
        let (axes, size, runs) = (tree.axes(), tree.rest(c), tree.runs(c));
        let end = begin + numbers.len() / height.max(1);
        // Column of the child that a run begins with.
        let mut first = 0;
        for (k, run) in runs.iter().enumerate() {
            let (place, count) = (axes * run.place as usize, axes * run.count as usize);
            if place >= end {
                break;
            }
            for column in begin.saturating_sub(place)..count.min(end - place) {
                let into = &mut numbers[(place + column - begin) * height..][..height];
                let from = &left[(first + column) * size..][..size];
                // From the diagonal on.
                let at = place + column - above;
                let mut taken = first + count;
                add(&mut into[at..at + count - column], &from[first + column..taken]);
                for run in &runs[k + 1..] {
                    let (at, count) =
                        (axes * run.place as usize - above, axes * run.count as usize);
                    add(&mut into[at..at + count], &from[taken..taken + count]);
                    taken += count;
                }
            }
            first += count;
        }
    }
}

#[inline]
fn add<T: Precision>(into: &mut [T], from: &[T]) {
    for (into, from) in into.iter_mut().zip(from) {
        *into += *from;
    }
}
