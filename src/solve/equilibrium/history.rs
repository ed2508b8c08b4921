//! The memory of a quasi-Newton method: steps, and how the gradient changed along them.
//!
//! Kept with as many numbers a vertex as it has unknowns: it is the largest of what a relaxation keeps
//! besides its factor.

use std::collections::VecDeque;

use nalgebra::Vector2;

use crate::Vec3;
use crate::parallel;

/// Vectors with the unknowns of every vertex; what vertices have none of is 0.
enum Stored {
    Space(Vec<Vec3>),
    Plane(Vec<Vector2<f64>>),
}

impl Stored {
    /// The difference of two; z is dropped if vertices move in a plane.
    fn difference(planar: bool, a: &[Vec3], b: &[Vec3]) -> Self {
        if planar {
            let mut all = vec![Vector2::zeros(); a.len()];
            parallel::fill(&mut all, |i| (a[i] - b[i]).xy());
            Self::Plane(all)
        } else {
            let mut all = vec![Vec3::zeros(); a.len()];
            parallel::fill(&mut all, |i| a[i] - b[i]);
            Self::Space(all)
        }
    }

    fn dot(&self, v: &[Vec3]) -> f64 {
        match self {
            Self::Space(all) => parallel::sum(v.len(), |i| all[i].dot(&v[i])),
            Self::Plane(all) => parallel::sum(v.len(), |i| all[i].dot(&v[i].xy())),
        }
    }

    fn dot_stored(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::Space(a), Self::Space(b)) => parallel::sum(a.len(), |i| a[i].dot(&b[i])),
            (Self::Plane(a), Self::Plane(b)) => parallel::sum(a.len(), |i| a[i].dot(&b[i])),
            // Vectors of one history are of one kind.
            (Self::Space(_), Self::Plane(_)) | (Self::Plane(_), Self::Space(_)) => 0.0,
        }
    }

    /// Adds `by` times this to `v`.
    fn add_to(&self, by: f64, v: &mut [Vec3]) {
        match self {
            Self::Space(all) => parallel::update(v, |i, v| *v += by * all[i]),
            Self::Plane(all) => parallel::update(v, |i, v| {
                v.x += by * all[i].x;
                v.y += by * all[i].y;
            }),
        }
    }
}

struct Pair {
    step: Stored,
    change: Stored,
    inverse: f64,
}

/// The last pairs of a step and a change of the gradient.
pub(super) struct History {
    planar: bool,
    longest: usize,
    pairs: VecDeque<Pair>,
}

impl History {
    /// Of at most `longest` pairs.
    pub(super) fn new(planar: bool, longest: usize) -> Self {
        Self { planar, longest, pairs: VecDeque::new() }
    }

    pub(super) fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Adds the step from one shape to the next and the change of its gradient, if the energy is convex
    /// along it; each as (before, after).
    pub(super) fn remember(&mut self, x: (&[Vec3], &[Vec3]), gradient: (&[Vec3], &[Vec3])) {
        let step = Stored::difference(self.planar, x.1, x.0);
        let change = Stored::difference(self.planar, gradient.1, gradient.0);
        let curvature = step.dot_stored(&change);
        let size = step.dot_stored(&step) * change.dot_stored(&change);
        if curvature > 1e-14 * size.sqrt() {
            if self.pairs.len() == self.longest {
                self.pairs.pop_front();
            }
            self.pairs.push_back(Pair { step, change, inverse: 1.0 / curvature });
        }
    }

    /// The two-loop recursion: `d` becomes H d, with `first` for the H that it starts from.
    pub(super) fn apply(&self, d: &mut [Vec3], first: impl FnOnce(&mut [Vec3])) {
        let mut alphas = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let alpha = pair.inverse * pair.step.dot(d);
            pair.change.add_to(-alpha, d);
            alphas.push(alpha);
        }
        first(d);
        for (pair, alpha) in self.pairs.iter().zip(alphas.iter().rev()) {
            let beta = pair.inverse * pair.change.dot(d);
            pair.step.add_to(alpha - beta, d);
        }
    }
}
