//! Solution with the panels of a factor, subtrees in parallel.
//!
//! ```text
//! L y = b      from the leaves: y₁ = L₁₁⁻¹ b₁, what L₂₁ y₁ takes from other unknowns goes to the parent
//! Lᵀ x = y     from the roots:  x₁ = L₁₁⁻ᵀ (y₁ - L₂₁ᵀ x₂), x₂ from the parent
//! ```

use super::Precision;
use super::supernodes::Supernodes;

/// Numbers that [`Substitution::solve`] needs as workspace.
pub(super) fn workspace(tree: &Supernodes) -> usize {
    tree.rests_before(tree.count())
}

/// A factor, read only.
pub(super) struct Substitution<'a, T> {
    pub(super) tree: &'a Supernodes,
    pub(super) values: &'a [T],
}

/// The numbers of one subtree.
struct Part<'a, T> {
    /// Its unknowns.
    own: &'a mut [T],
    /// The other unknowns of its fronts, one front after the other.
    rest: &'a mut [T],
}

impl<'a, T> Part<'a, T> {
    fn split(self, own: usize, rest: usize) -> (Self, Self) {
        let (own, rest) = (self.own.split_at_mut(own), self.rest.split_at_mut(rest));
        (Part { own: own.0, rest: rest.0 }, Part { own: own.1, rest: rest.1 })
    }
}

impl<T: Precision> Substitution<'_, T> {
    /// Replaces `x`, in the order of elimination, by the solution.
    pub(super) fn solve(&self, x: &mut [T], workspace: &mut [T]) {
        let all = || self.tree.roots();
        let part = Part { own: &mut *x, rest: &mut *workspace };
        self.each(all(), part, &|s, part| self.forward(s, part));
        self.each(all(), Part { own: x, rest: workspace }, &|s, part| self.backward(s, part));
    }

    /// Hands the subtrees of `all`, which lie one after the other, to `f`.
    fn each(&self, all: &[u32], part: Part<'_, T>, f: &(dyn Fn(usize, Part<'_, T>) + Sync)) {
        match all {
            [] => {}
            [only] => f(*only as usize, part),
            _ => {
                let (low, high) = all.split_at(all.len() / 2);
                let (first, last) = (self.tree.first(low[0] as usize), high[0] as usize);
                let middle = self.tree.first(last);
                let own = self.tree.unknowns_before(middle) - self.tree.unknowns_before(first);
                let rest = self.tree.rests_before(middle) - self.tree.rests_before(first);
                let (left, right) = part.split(own, rest);
                rayon::join(|| self.each(low, left, f), || self.each(high, right, f));
            }
        }
    }

    /// The subtree of `s` apart from its own front, and that.
    fn split<'a>(&self, s: usize, part: Part<'a, T>) -> (Part<'a, T>, Part<'a, T>) {
        let (own, rest) = (part.own.len(), part.rest.len());
        part.split(own - self.tree.columns(s), rest - self.tree.rest(s))
    }

    fn forward(&self, s: usize, part: Part<'_, T>) {
        if self.tree.is_serial(s) {
            let first = self.tree.first(s);
            let (own, rest) = (self.tree.unknowns_before(first), self.tree.rests_before(first));
            for k in first..=s {
                let own = self.tree.unknowns_before(k + 1) - own;
                let rest = self.tree.rests_before(k + 1) - rest;
                let part = Part { own: &mut part.own[..own], rest: &mut part.rest[..rest] };
                let (below, front) = self.split(k, part);
                self.forward_front(k, rest, below.rest, front);
            }
            return;
        }
        let (own, rest) = (&mut *part.own, &mut *part.rest);
        let (below, _) = self.split(s, Part { own, rest });
        self.each(self.tree.children(s), below, &|c, part| self.forward(c, part));
        let end = part.rest.len();
        let (below, front) = self.split(s, part);
        self.forward_front(s, end, below.rest, front);
    }

    /// `below` are the rests of all fronts of a task up to this one, `end` where those of this one end.
    fn forward_front(&self, s: usize, end: usize, below: &mut [T], front: Part<'_, T>) {
        let (tree, axes) = (self.tree, self.tree.axes());
        front.rest.fill(T::from_f64(0.0));
        let columns = front.own.len();
        for &c in tree.children(s) {
            let c = c as usize;
            let begin = end - (tree.rests_before(s + 1) - tree.rests_before(c));
            let mut from = &below[begin..begin + tree.rest(c)];
            for run in tree.runs(c) {
                let (at, count) = (axes * run.place as usize, axes * run.count as usize);
                let into = if at < columns {
                    &mut front.own[at..at + count]
                } else {
                    &mut front.rest[at - columns..at - columns + count]
                };
                let (taken, tail) = from.split_at(count);
                for (into, from) in into.iter_mut().zip(taken) {
                    *into += *from;
                }
                from = tail;
            }
        }
        let panel = &self.values[tree.values_before(s)..tree.values_before(s + 1)];
        widest(Eliminate { panel, own: front.own, rest: front.rest });
    }

    fn backward(&self, s: usize, part: Part<'_, T>) {
        if self.tree.is_serial(s) {
            let first = self.tree.first(s);
            let (own, rest) = (self.tree.unknowns_before(first), self.tree.rests_before(first));
            for k in (first..=s).rev() {
                let own = self.tree.unknowns_before(k + 1) - own;
                let rest = self.tree.rests_before(k + 1) - rest;
                let part = Part { own: &mut part.own[..own], rest: &mut part.rest[..rest] };
                let (below, front) = self.split(k, part);
                self.backward_front(k, rest, below.rest, front);
            }
            return;
        }
        let end = part.rest.len();
        {
            let (own, rest) = (&mut *part.own, &mut *part.rest);
            let (below, front) = self.split(s, Part { own, rest });
            self.backward_front(s, end, below.rest, front);
        }
        let (below, _) = self.split(s, part);
        self.each(self.tree.children(s), below, &|c, part| self.backward(c, part));
    }

    /// As [`Substitution::forward_front`].
    fn backward_front(&self, s: usize, end: usize, below: &mut [T], front: Part<'_, T>) {
        let (tree, axes) = (self.tree, self.tree.axes());
        let panel = &self.values[tree.values_before(s)..tree.values_before(s + 1)];
        widest(Replace { panel, own: &mut *front.own, rest: front.rest });
        let columns = front.own.len();
        for &c in tree.children(s) {
            let c = c as usize;
            let begin = end - (tree.rests_before(s + 1) - tree.rests_before(c));
            let mut into = &mut below[begin..begin + tree.rest(c)];
            for run in tree.runs(c) {
                let (at, count) = (axes * run.place as usize, axes * run.count as usize);
                let (taken, tail) = into.split_at_mut(count);
                taken.copy_from_slice(if at < columns {
                    &front.own[at..at + count]
                } else {
                    &front.rest[at - columns..at - columns + count]
                });
                into = tail;
            }
        }
    }
}

/// Does it with wide registers where the processor has them.
#[inline]
fn widest(task: impl pulp::NullaryFnOnce<Output = ()>) {
    #[cfg(target_arch = "x86_64")]
    if let Some(token) = pulp::x86::V3::try_new() {
        token.vectorize(task);
        return;
    }
    task.call();
}

/// `y₁ = L₁₁⁻¹ b₁`, `rest -= L₂₁ y₁`.
struct Eliminate<'a, T> {
    panel: &'a [T],
    own: &'a mut [T],
    rest: &'a mut [T],
}

impl<T: Precision> pulp::NullaryFnOnce for Eliminate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { panel, own, rest } = self;
        let (columns, height) = (own.len(), own.len() + rest.len());
        let mut j = 0;
        while j + 4 <= columns {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &panel[(j + k) * height + j..][..height - j]);
            let y0 = own[j] / a[0];
            let y1 = (own[j + 1] - a[1] * y0) / b[1];
            let y2 = (own[j + 2] - a[2] * y0 - b[2] * y1) / c[2];
            let y3 = (own[j + 3] - a[3] * y0 - b[3] * y1 - c[3] * y2) / d[3];
            own[j..j + 4].copy_from_slice(&[y0, y1, y2, y3]);
            let y = [y0, y1, y2, y3];
            let split = columns - j;
            let upper = [a, b, c, d].map(|l| &l[4..split]);
            subtract_four(&mut own[j + 4..], upper, y);
            subtract_four(rest, [a, b, c, d].map(|l| &l[split..]), y);
            j += 4;
        }
        while j < columns {
            let column = &panel[j * height + j..][..height - j];
            let y = own[j] / column[0];
            own[j] = y;
            let (upper, lower) = column[1..].split_at(columns - j - 1);
            for (x, l) in own[j + 1..].iter_mut().zip(upper) {
                *x -= *l * y;
            }
            for (x, l) in rest.iter_mut().zip(lower) {
                *x -= *l * y;
            }
            j += 1;
        }
    }
}

#[inline(always)]
fn subtract_four<T: Precision>(x: &mut [T], [a, b, c, d]: [&[T]; 4], y: [T; 4]) {
    let n = x.len();
    let (a, b, c, d) = (&a[..n], &b[..n], &c[..n], &d[..n]);
    for i in 0..n {
        x[i] -= (a[i] * y[0] + b[i] * y[1]) + (c[i] * y[2] + d[i] * y[3]);
    }
}

/// `x₁ = L₁₁⁻ᵀ (y₁ - L₂₁ᵀ x₂)`.
struct Replace<'a, T> {
    panel: &'a [T],
    own: &'a mut [T],
    rest: &'a [T],
}

impl<T: Precision> pulp::NullaryFnOnce for Replace<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { panel, own, rest } = self;
        let (columns, height) = (own.len(), own.len() + rest.len());
        // Four columns at a time read `own` and `rest` once, and their sums are reduced once.
        let mut j = columns;
        while j >= 4 {
            j -= 4;
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &panel[(j + k) * height + j..][..height - j]);
            let split = columns - j;
            let mut sums = Sums::default();
            sums.add(&own[j + 4..], [a, b, c, d].map(|l| &l[4..split]));
            sums.add(rest, [a, b, c, d].map(|l| &l[split..]));
            let [s0, s1, s2, s3] = sums.total();
            let x3 = (own[j + 3] - s3) / d[3];
            let x2 = (own[j + 2] - s2 - c[3] * x3) / c[2];
            let x1 = (own[j + 1] - s1 - b[3] * x3 - b[2] * x2) / b[1];
            let x0 = (own[j] - s0 - a[3] * x3 - a[2] * x2 - a[1] * x1) / a[0];
            own[j..j + 4].copy_from_slice(&[x0, x1, x2, x3]);
        }
        for j in (0..j).rev() {
            let column = &panel[j * height + j..][..height - j];
            let (upper, lower) = column[1..].split_at(columns - j - 1);
            let mut sum = T::from_f64(0.0);
            for (x, l) in own[j + 1..].iter().zip(upper).chain(rest.iter().zip(lower)) {
                sum += *x * *l;
            }
            own[j] = (own[j] - sum) / column[0];
        }
    }
}

/// Numbers that are added side by side.
const LANES: usize = 8;

/// Products of four columns with one vector.
struct Sums<T> {
    whole: [[T; LANES]; 4],
    left: [T; 4],
}

impl<T: Precision> Default for Sums<T> {
    #[inline(always)]
    fn default() -> Self {
        Self { whole: [[T::from_f64(0.0); LANES]; 4], left: [T::from_f64(0.0); 4] }
    }
}

impl<T: Precision> Sums<T> {
    #[inline(always)]
    fn add(&mut self, x: &[T], columns: [&[T]; 4]) {
        let n = x.len();
        let [a, b, c, d] = columns.map(|l| l[..n].as_chunks::<LANES>());
        let (whole, left) = x.as_chunks::<LANES>();
        let m = whole.len();
        let (wa, wb, wc, wd) = (&a.0[..m], &b.0[..m], &c.0[..m], &d.0[..m]);
        let [mut s0, mut s1, mut s2, mut s3] = self.whole;
        for i in 0..m {
            for k in 0..LANES {
                s0[k] += wa[i][k] * whole[i][k];
                s1[k] += wb[i][k] * whole[i][k];
                s2[k] += wc[i][k] * whole[i][k];
                s3[k] += wd[i][k] * whole[i][k];
            }
        }
        self.whole = [s0, s1, s2, s3];
        let m = left.len();
        for (sum, l) in self.left.iter_mut().zip([a.1, b.1, c.1, d.1]) {
            for (x, l) in left.iter().zip(&l[..m]) {
                *sum += *l * *x;
            }
        }
    }

    #[inline(always)]
    fn total(self) -> [T; 4] {
        let mut total = self.left;
        for (total, sums) in total.iter_mut().zip(self.whole) {
            let mut sums = sums;
            let mut width = LANES;
            while width > 1 {
                width /= 2;
                for k in 0..width {
                    let other = sums[k + width];
                    sums[k] += other;
                }
            }
            *total += sums[0];
        }
        total
    }
}
