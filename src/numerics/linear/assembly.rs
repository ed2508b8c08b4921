//! Matrices by rows that are filled by lists of entries.
//!
//! Who assembles a matrix names its entries in an order that depends on the mesh alone. The first
//! time their places are looked up ([`Assembly::new`]); from then on values are added without a
//! search or an allocation.

use rayon::prelude::*;

use super::row_pattern::Pattern;
use super::sparse::{Sparse, StoredValues};
use crate::num::index;
use crate::parallel;

/// Takes entries: their places at first, their values later.
pub struct Entries<'a>(Mode<'a>);

enum Mode<'a> {
    Collect(&'a mut Vec<(u32, u32)>),
    Fill {
        start: &'a [u32],
        offset: NextOffset<'a>,
        value: &'a mut [f64],
    },
    /// Looks places up every time: matrices in strips are filled seldom.
    Find(&'a mut Sparse),
    Keep(std::slice::IterMut<'a, f64>),
    /// Looks for the largest size.
    Measure(&'a mut f64),
}

/// One of the lists that a matrix is filled from: it names its entries in an order of its own.
pub type Contribution<'a> = dyn Fn(&mut Entries<'_>) + Sync + 'a;

impl Entries<'_> {
    /// Adds `value` at (`row`, `column`).
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        match &mut self.0 {
            Mode::Collect(all) => all.push((index(row), index(column))),
            Mode::Measure(largest) => **largest = largest.max(value.abs()),
            Mode::Fill { start, offset, value: all } => {
                let offset = offset.next();
                debug_assert!(offset.is_some(), "more entries than at first");
                if let Some(offset) = offset {
                    all[start[row] as usize + offset] += value;
                }
            }
            Mode::Find(matrix) => {
                let found = matrix.add(row, column, value);
                debug_assert!(found, "an entry that was not there at first");
            }
            Mode::Keep(all) => {
                let place = all.next();
                debug_assert!(place.is_some(), "more entries than at first");
                if let Some(place) = place {
                    *place = value;
                }
            }
        }
    }
}

/// Places within rows, one after the other: a byte each where no row is long.
#[derive(Debug, Clone)]
enum Offsets {
    Near(Vec<u8>),
    Far(Vec<u32>),
}

impl Default for Offsets {
    fn default() -> Self {
        Self::Near(Vec::new())
    }
}

impl Offsets {
    /// `of` gives so many of them, in rows of at most `longest` entries.
    fn new(count: usize, longest: usize, of: impl Fn(usize) -> usize + Sync) -> Self {
        if longest > usize::from(u8::MAX) + 1 {
            let mut all = vec![0; count];
            parallel::fill(&mut all, |k| index(of(k)));
            return Self::Far(all);
        }
        let mut all = vec![0; count];
        parallel::fill(&mut all, |k| u8::try_from(of(k)).unwrap_or_default());
        Self::Near(all)
    }

    fn iter(&self) -> NextOffset<'_> {
        match self {
            Self::Near(all) => NextOffset::Near(all.iter()),
            Self::Far(all) => NextOffset::Far(all.iter()),
        }
    }
}

enum NextOffset<'a> {
    Near(std::slice::Iter<'a, u8>),
    Far(std::slice::Iter<'a, u32>),
}

impl NextOffset<'_> {
    #[inline]
    fn next(&mut self) -> Option<usize> {
        match self {
            Self::Near(all) => all.next().map(|offset| usize::from(*offset)),
            Self::Far(all) => all.next().map(|offset| *offset as usize),
        }
    }
}

/// A matrix that is filled from a list of entries.
#[derive(Debug, Clone, Default)]
pub struct Assembly {
    /// Of what no part names.
    offset: Offsets,
    matrix: Sparse,
    /// Where the list of every part ends.
    ends: Vec<usize>,
    /// The values that parts name, and which of them every entry of the matrix is the sum of.
    named: Vec<f64>,
    sum_start: Vec<u32>,
    sum: Vec<u32>,
}

/// The pattern of a matrix with these entries, of which some may be repeated.
fn pattern(entries: &[(u32, u32)], rows: usize, columns: usize) -> Pattern {
    // The list row by row, then every row sorted and without repetition.
    let mut first = vec![0u32; rows + 1];
    entries.iter().for_each(|&(row, _)| first[row as usize + 1] += 1);
    for i in 0..rows {
        first[i + 1] += first[i];
    }
    let mut next = first.clone();
    let mut listed = vec![0u32; entries.len()];
    for &(row, column) in entries {
        let at = &mut next[row as usize];
        listed[*at as usize] = column;
        *at += 1;
    }
    drop(next);
    Pattern::new(columns, rows, entries.len(), &mut |i, row| {
        row.extend_from_slice(&listed[first[i] as usize..first[i + 1] as usize]);
        row.sort_unstable();
        row.dedup();
    })
}

/// The numbers below `count`, grouped by the place below `places` that each has: where a group starts, and the numbers.
fn grouped(
    count: usize,
    places: usize,
    place: impl Fn(usize) -> usize + Sync,
) -> (Vec<u32>, Vec<u32>) {
    let (mut start, mut grouped) = (vec![0; places + 1], vec![0; count]);
    let mut listed = vec![0; count];
    parallel::fill(&mut listed, |k| index(place(k)));
    listed.iter().for_each(|&k| start[k as usize + 1] += 1);
    for k in 0..places {
        start[k + 1] += start[k];
    }
    let mut next = start.clone();
    for (number, &k) in listed.iter().enumerate() {
        grouped[next[k as usize] as usize] = index(number);
        next[k as usize] += 1;
    }
    (start, grouped)
}

impl Assembly {
    /// Looks up the places of the entries that `name` gives.
    #[must_use]
    pub fn new(rows: usize, columns: usize, name: impl FnOnce(&mut Entries<'_>)) -> Self {
        Self::in_parts(rows, columns, &[], name)
    }

    /// The same of a square matrix in single precision whose rows and columns are in the order of incomplete
    /// factors, which then need no pattern of their own.
    #[must_use]
    pub fn for_incomplete_factor(rows: usize, name: impl FnOnce(&mut Entries<'_>)) -> Self {
        Self::look_up((rows, rows), &[], name, true)
    }

    /// The same for `parts`, which are filled in parallel, and for `name` after them.
    #[must_use]
    pub fn in_parts(
        rows: usize,
        columns: usize,
        parts: &[&Contribution<'_>],
        name: impl FnOnce(&mut Entries<'_>),
    ) -> Self {
        Self::look_up((rows, columns), parts, name, false)
    }

    fn look_up(
        (rows, columns): (usize, usize),
        parts: &[&Contribution<'_>],
        name: impl FnOnce(&mut Entries<'_>),
        in_strips: bool,
    ) -> Self {
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for part in parts {
            part(&mut Entries(Mode::Collect(&mut all)));
            ends.push(all.len());
        }
        name(&mut Entries(Mode::Collect(&mut all)));
        let pattern = pattern(&all, rows, columns);
        if in_strips {
            drop(all);
            return Self {
                matrix: Sparse::zeros_for_incomplete_factor(&pattern),
                ..Self::default()
            };
        }
        let matrix = Sparse::zeros(pattern);
        let offset = |(row, column): (u32, u32)| {
            matrix.pattern.row(row as usize).binary_search(&column).unwrap_or_default()
        };
        let named = vec![0.0; ends.last().copied().unwrap_or(0)];
        let place = |k: usize| matrix.pattern.places(all[k].0 as usize).start + offset(all[k]);
        let (sum_start, sum) = match named.len() {
            0 => (Vec::new(), Vec::new()),
            count => grouped(count, matrix.entry_count(), place),
        };
        let rest = &all[named.len()..];
        let longest = (0..rows).map(|i| matrix.pattern.places(i).len()).max().unwrap_or(0);
        let offset = Offsets::new(rest.len(), longest, |k| offset(rest[k]));
        Self { offset, matrix, ends, named, sum_start, sum }
    }

    /// Fills the matrix with the values that `name` gives, in the same order as at first.
    pub fn fill(&mut self, name: impl FnMut(&mut Entries<'_>)) {
        self.fill_in_parts(&[], name);
    }

    /// The same for `parts`, as many as at first.
    pub fn fill_in_parts(
        &mut self,
        parts: &[&Contribution<'_>],
        mut name: impl FnMut(&mut Entries<'_>),
    ) {
        let (mut lists, mut rest, mut begin) = (Vec::new(), &mut *self.named, 0);
        for (part, &end) in parts.iter().zip(&self.ends) {
            let (list, tail) = rest.split_at_mut(end - begin);
            lists.push((part, list));
            (rest, begin) = (tail, end);
        }
        lists.into_par_iter().for_each(|(part, list)| {
            part(&mut Entries(Mode::Keep(list.iter_mut())));
        });
        let Self { named, sum_start, sum, matrix, offset, .. } = self;
        let StoredValues::Double(value) = &mut matrix.value else {
            matrix.clear_and_scale(|largest| name(&mut Entries(Mode::Measure(largest))));
            return name(&mut Entries(Mode::Find(matrix)));
        };
        if named.is_empty() {
            value.fill(0.0);
        } else {
            parallel::fill(value, |k| {
                let own = &sum[sum_start[k] as usize..sum_start[k + 1] as usize];
                own.iter().map(|&number| named[number as usize]).sum()
            });
        }
        let start = &matrix.pattern.start;
        name(&mut Entries(Mode::Fill { start, offset: offset.iter(), value }));
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Sparse {
        &self.matrix
    }

    /// The matrix, to be changed until it is filled again.
    pub fn matrix_mut(&mut self) -> &mut Sparse {
        &mut self.matrix
    }
}
