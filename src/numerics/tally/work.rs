//! What has been done, in numbers that depend neither on the machine nor on the number of threads.

use std::ops::{Add, AddAssign, Sub};

use serde::{Deserialize, Serialize};

/// Declares [`Work`] once: fields, their explanations, and sums.
macro_rules! work {
    ($($(#[doc = $what:literal])+ $name:ident,)+) => {
        /// Counts of work: they add up, and the difference of two readings is what was done between them.
        ///
        /// Each piece of work adds to [`Tally::count`](super::Tally::count). An evaluation of forces or
        /// of rates is one of `energies`, `gradients` and `right_hand_sides`; of all else what a piece is made of
        /// is counted as well: one iteration of L-BFGS is also a solution. The names of the fields are those of
        /// every table and file.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct Work {
            $($(#[doc = $what])+ pub $name: u64,)+
        }

        impl Work {
            /// Every name with what it counts.
            pub const NAMES: &[(&str, &str)] = &[$((stringify!($name), concat!($($what),+).trim_ascii())),+];

            /// Of counts in the order of [`Work::NAMES`].
            #[must_use]
            pub fn from_counts([$($name),+]: [u64; Self::NAMES.len()]) -> Self {
                Self { $($name),+ }
            }

            /// The counts, in the order of [`Work::NAMES`].
            #[must_use]
            pub fn values(&self) -> [u64; Self::NAMES.len()] {
                [$(self.$name),+]
            }
        }

        impl Add for Work {
            type Output = Self;

            fn add(self, more: Self) -> Self {
                Self { $($name: self.$name + more.$name),+ }
            }
        }

        impl Sub for Work {
            type Output = Self;

            /// What was done since the reading `before`.
            fn sub(self, before: Self) -> Self {
                Self { $($name: self.$name.saturating_sub(before.$name)),+ }
            }
        }
    };
}

work! {
    /// Accepted steps.
    steps,
    /// Steps tried and rejected.
    rejected,
    /// Accepted steps of an integrator of the chemistry, or of the shape, within a step.
    substeps,
    /// Such steps tried and rejected.
    rejected_substeps,
    /// Iterations of relaxations and minimisations of the shape.
    iterations,
    /// Iterations of Newton's method in implicit integrators, and steps to a steady chemistry.
    newton_iterations,
    /// Evaluations of the energy without its gradient.
    energies,
    /// Evaluations of the energy and its gradient, but for those within a right-hand side.
    gradients,
    /// Assemblies of the second derivatives.
    hessians,
    /// Evaluations of F in M dy/dt = F(t, y): of rates, of forces where the shape moves, or of both at once.
    right_hand_sides,
    /// Evaluations of ∂F/∂y.
    jacobians,
    /// Calls of the law for all its points: rates, their derivatives, length factors.
    law_calls,
    /// Points of these calls.
    law_sites,
    /// Factorisations, or preparations of what stands for a factor, failed ones included.
    factorisations,
    /// Solutions of linear systems with them.
    solves,
    /// Products with a matrix in Krylov methods.
    krylov_iterations,
}

impl Work {
    /// Evaluations of forces and of rates, every one once, whatever comes out of it: energies, gradients,
    /// right-hand sides.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.energies + self.gradients + self.right_hand_sides
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, more: Self) {
        *self = *self + more;
    }
}

/// Work with the time that it took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// What was done.
    pub work: Work,
    /// Processor time of all threads, user and system, s; NaN where the system does not say it.
    pub cpu_seconds: f64,
    /// Wall time, s.
    pub wall_seconds: f64,
}

impl AddAssign for Spent {
    fn add_assign(&mut self, more: Self) {
        self.work += more.work;
        self.cpu_seconds += more.cpu_seconds;
        self.wall_seconds += more.wall_seconds;
    }
}

impl Sub for Spent {
    type Output = Self;

    /// What was spent since the reading `before`.
    fn sub(self, before: Self) -> Self {
        Self {
            work: self.work - before.work,
            cpu_seconds: self.cpu_seconds - before.cpu_seconds,
            wall_seconds: self.wall_seconds - before.wall_seconds,
        }
    }
}
