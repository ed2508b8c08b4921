//! Counters of the work of solvers, and their names.

use crate::tally::{Meter, Scope, Tally};

/// Relaxations without their linear algebra.
pub(crate) const RELAXATION: &str = "relaxation: directions, line search";
/// Integrators of coupled systems.
pub const INTEGRATOR: &str = "integrator of coupled systems";
/// The overdamped motion.
pub(crate) const MOTION: &str = "motion under drag";
/// The integrator of the chemistry.
pub(crate) const CHEMISTRY: &str = "integrator of the chemistry";
/// The integrator of internal variables.
pub(crate) const INTERNAL: &str = "integrator of internal variables";
/// The settling of a chemistry without time scale.
pub const SETTLING: &str = "settling of the chemistry";
/// Explicit steps.
pub(crate) const EXPLICIT: &str = "explicit step";
const FACTORS: &str = "factors of the Hessian";
const SOLUTIONS: &str = "solutions with the Hessian";

/// The scope of one call of a part.
pub fn part(tally: &Tally, name: &str) -> Scope {
    meter(tally, name).scope("calls")
}

/// The meter of a part.
pub fn meter(tally: &Tally, name: &str) -> Meter {
    tally.meter("solver", name)
}

/// The meters of a factor of second derivatives, or what stands for one, and of its solutions.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    pub(super) factors: Meter,
    solutions: Meter,
    /// Of the matrix itself.
    pub(super) matrix: Meter,
    tally: Tally,
}

impl Linear {
    pub(super) fn from_tally(tally: &Tally) -> Self {
        Self {
            factors: tally.meter("solver", FACTORS),
            solutions: tally.meter("solver", SOLUTIONS),
            matrix: tally.meter("solver", "Hessian and its pattern"),
            tally: tally.clone(),
        }
    }

    /// The scope of one factorisation.
    pub(super) fn factorise(&self) -> Scope {
        self.tally.count(|work| work.factorisations += 1);
        self.factors.uncounted_scope()
    }

    /// The scope of one solution.
    pub(super) fn solve(&self) -> Scope {
        self.tally.count(|work| work.solves += 1);
        self.solutions.uncounted_scope()
    }
}
