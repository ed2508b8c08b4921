//! The memory of a quasi-Newton method: steps, and how the gradient changed along them.
//!
//! ```text
//! H g = Σ_i s_i (α_i - β_i) + M⁻¹ q,    q = g - Σ_i α_i y_i,    ρ_i = 1/(s_i·y_i)
//! α_i = ρ_i (s_i·g - Σ_{j>i} α_j s_i·y_j)
//! β_i = ρ_i (y_i·M⁻¹q + Σ_{j<i} (α_j - β_j) s_j·y_i)
//! ```
//!
//! The two-loop recursion with its products taken apart: those of pairs with one another are
//! remembered, so that every stored vector is read twice less, all of them in one go.
//!
//! Kept with as many numbers a vertex as it has unknowns: it is the largest of what a relaxation keeps
//! besides its factor.
//!
//! Reference: Nocedal & Wright, Numerical Optimization (2006), algorithm 7.4.

use std::collections::VecDeque;

use crate::Vec3;
use crate::parallel;
use crate::parallel::vectors::add_all;
use crate::reduction::Reduction;

/// Curvatures along a step that are below this share of what they could be are round-off.
const ROUND_OFF: f64 = 1e-14;

#[derive(Default)]
struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
    /// `s_i·y` with this change and the steps of all pairs remembered, the last its own.
    products: VecDeque<f64>,
}

impl Pair {
    fn curvature(&self) -> f64 {
        self.products.back().copied().unwrap_or_default()
    }
}

/// The last pairs of a step and a change of the gradient.
pub(super) struct History {
    planar: bool,
    reduction: Reduction,
    longest: usize,
    pairs: VecDeque<Pair>,
    /// Memory of a pair that is forgotten.
    spare: Pair,
    /// What the recursion works on.
    work: Vec<f64>,
}

impl History {
    /// Of at most `longest` pairs, with products by `reduction`.
    pub(super) fn new(planar: bool, longest: usize, reduction: Reduction) -> Self {
        let (spare, work) = (Pair::default(), Vec::new());
        Self { planar, reduction, longest, pairs: VecDeque::new(), spare, work }
    }

    fn dots<'a>(&self, vectors: impl Iterator<Item = &'a [f64]>, w: &[f64]) -> Vec<f64> {
        self.reduction.dots(vectors, w, if self.planar { 2 } else { 3 })
    }

    pub(super) fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Adds the step from one shape to the next and the change of its gradient, if the energy is convex
    /// along it; each as (before, after).
    pub(super) fn remember(&mut self, x: (&[Vec3], &[Vec3]), gradient: (&[Vec3], &[Vec3])) {
        let Pair { mut step, mut change, mut products } = std::mem::take(&mut self.spare);
        self.flatten(x.0.len(), |i| x.1[i] - x.0[i], &mut step);
        self.flatten(x.0.len(), |i| gradient.1[i] - gradient.0[i], &mut change);
        let is_full = self.pairs.len() == self.longest;
        let own = [step.as_slice(), &change].into_iter();
        let steps = self.pairs.iter().skip(usize::from(is_full)).map(|pair| pair.step.as_slice());
        // One reduction for all.
        let per_point = if self.planar { 2 } else { 3 };
        let square = self.reduction.dots_here([step.as_slice()].into_iter(), &step, per_point);
        let mut all = self.reduction.dots_here(own.chain(steps), &change, per_point);
        all.extend(square);
        self.reduction.sum_over_ranks(&mut all);
        let (curvature, size) = (all[0], all[1] * all.pop().unwrap_or_default());
        if !(curvature > ROUND_OFF * size.sqrt()) {
            self.spare = Pair { step, change, products };
            return;
        }
        if is_full {
            self.spare = self.pairs.pop_front().unwrap_or_default();
            for pair in &mut self.pairs {
                pair.products.pop_front();
            }
        }
        products.clear();
        products.extend(&all[2..]);
        products.push_back(curvature);
        self.pairs.push_back(Pair { step, change, products });
    }

    /// The unknowns of `n` vertices in a row.
    fn flatten(&self, n: usize, of: impl Fn(usize) -> Vec3 + Sync, out: &mut Vec<f64>) {
        if self.planar {
            out.resize(2 * n, 0.0);
            let (vertices, _) = out.as_chunks_mut::<2>();
            parallel::fill(vertices, |i| [of(i).x, of(i).y]);
        } else {
            out.resize(3 * n, 0.0);
            let (vertices, _) = out.as_chunks_mut::<3>();
            parallel::fill(vertices, |i| of(i).into());
        }
    }

    /// The reverse of [`Self::flatten`]; z is unchanged on a planar sheet.
    fn unflatten(&self, numbers: &[f64], out: &mut [Vec3]) {
        if self.planar {
            let (vertices, _) = numbers.as_chunks::<2>();
            parallel::update(out, |i, v| [v.x, v.y] = vertices[i]);
        } else {
            let (vertices, _) = numbers.as_chunks::<3>();
            parallel::fill(out, |i| vertices[i].into());
        }
    }

    /// `d` becomes H d, with `first` for the M⁻¹ that it starts from.
    pub(super) fn apply(&mut self, d: &mut [Vec3], first: impl FnOnce(&mut [Vec3])) {
        if self.pairs.is_empty() {
            first(d);
            return;
        }
        let mut q = std::mem::take(&mut self.work);
        self.flatten(d.len(), |i| d[i], &mut q);
        let pairs = &self.pairs;
        let mut alpha = self.dots(pairs.iter().map(|pair| pair.step.as_slice()), &q);
        for j in (0..pairs.len()).rev() {
            alpha[j] /= pairs[j].curvature();
            for i in 0..j {
                alpha[i] -= alpha[j] * pairs[j].products[i];
            }
        }
        add_all(&mut q, pairs.iter().zip(&alpha).map(|(pair, a)| (-a, pair.change.as_slice())));
        self.unflatten(&q, d);
        first(d);
        self.flatten(d.len(), |i| d[i], &mut q);
        // Becomes α - β.
        let beta = self.dots(pairs.iter().map(|pair| pair.change.as_slice()), &q);
        for (i, beta) in beta.into_iter().enumerate() {
            let earlier = alpha.iter().zip(&pairs[i].products).take(i);
            let sum: f64 = earlier.map(|(share, product)| share * product).sum();
            alpha[i] -= (beta + sum) / pairs[i].curvature();
        }
        add_all(&mut q, pairs.iter().zip(&alpha).map(|(pair, a)| (*a, pair.step.as_slice())));
        self.unflatten(&q, d);
        self.work = q;
    }
}
