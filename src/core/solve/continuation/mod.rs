//! Branches of equilibria over a parameter, by pseudo-arc-length continuation.
//!
//! ```text
//! g(x, λ) = ∂U/∂x (x; λ) = 0
//! H ẋ + g_λ λ̇ = 0,   ⟨t, t⟩ = 1          the tangent t = (ẋ, λ̇) with the arc length of `metric.rs`
//! u = u₀ + h t                            predictor
//! g(u) = 0,   ⟨t, u - u₀⟩ = h             corrector: Newton's method with a bordered matrix
//! ```
//!
//! A branch passes folds, where λ turns back: it is parametrised by s, not by λ. Every point has the number of
//! negative eigenvalues of H (`stability`), and between two points are looked for
//!
//! * **folds** (limit points), where λ̇ changes sign and with it one eigenvalue: found as the zero of λ̇;
//! * **bifurcations**, where the number of negative eigenvalues changes and λ̇ does not: found as the zero of the
//!   eigenvalue. Its mode is the direction of the other branch ([`Continuation::switch`]).
//!
//! A step over more bifurcations than are located one by one is shortened until they come apart. Those that stay together,
//! as where a sphere buckles in many modes at once, are one point with all their modes.
//!
//! An even number of changes within one step, as one eigenvalue down and another up, is not seen; shorter steps see it.
//! With species u = (x, c), g = (∂U/∂x, -dc/dt) and no symmetry: [`Continuation::of_species`].
//! Not covered: constraints, pairs of contact; branches of points of special kind (folds in two parameters).
//!
//! References: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977), in Rabinowitz (ed.),
//! Applications of Bifurcation Theory; Allgower & Georg, Introduction to Numerical Continuation Methods (SIAM 2003),
//! doi:10.1137/1.9780898719154; Seydel, Practical Bifurcation and Stability Analysis (2010), chapters 4 and 5,
//! doi:10.1007/978-1-4419-1740-9.

mod bifurcations;
mod bordered;
mod branch;
mod corrector;
mod elastic;
mod metric;
mod special;
mod spectrum;
mod steady_state;
mod system;
mod unknowns;

use std::ops::RangeInclusive;

use super::SolveError;
use super::stability::Mode;
use crate::effects::{EnergyTerm, Interaction};
use crate::geometry;
use crate::model::Mechanics;

pub use self::branch::Continuation;
pub use self::elastic::Elastic;
pub use self::steady_state::{SteadyStateSystem, imbalance};
pub(super) use self::steady_state::{flatten, unflatten};
pub use self::system::{Equilibrium, System};
pub use self::unknowns::{Direction, Unknowns};

/// How a branch is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Values of λ; the branch ends where it leaves them.
    pub range: RangeInclusive<f64>,
    /// L: the root mean square displacement that counts as much as the whole range of λ.
    pub length: f64,
    /// Arc length of the first step.
    pub first_step: f64,
    /// Arc length of the longest step.
    pub longest_step: f64,
    /// Arc length of the shortest step.
    pub least_step: f64,
    /// Largest force on a vertex that counts as 0, in units of the force scale.
    pub tolerance: f64,
}

impl Settings {
    /// L, and the width of the range of λ.
    fn scales(&self) -> (f64, f64) {
        (self.length, (self.range.end() - self.range.start()).abs())
    }

    /// First step, longest step, and shortest step if nothing else is said.
    pub const STEPS: [f64; 3] = [0.02, 0.1, 1e-6];

    /// Over `range`, with L a tenth of the square root of the sheet's area.
    #[must_use]
    pub fn over(range: RangeInclusive<f64>, mechanics: &Mechanics) -> Self {
        let sheet = mechanics.sheet();
        let area = geometry::area(sheet, sheet.rest());
        let [first_step, longest_step, least_step] = Self::STEPS;
        // A point has no area, and no shape.
        let length = if area > 0.0 { LENGTH_SCALE_SHARE * area.sqrt() } else { 1.0 };
        Self { range, length, first_step, longest_step, least_step, tolerance: 1e-6 }
    }
}

/// L in units of the square root of the area: sheets buckle and snap by displacements of this order or less.
const LENGTH_SCALE_SHARE: f64 = 0.1;
/// What is special about a point.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Event {
    /// Nothing.
    #[default]
    None,
    /// The branch begins.
    Start,
    /// λ turns back.
    Fold,
    /// Other branches pass, along these modes: those whose eigenvalues change their sign here.
    Bifurcation(Vec<CriticalMode>),
    /// The shape at given species gains or loses stability along these modes, and the Jacobian of shape and species is
    /// regular: no other branch passes. A growth rate of the quasi-static system goes through infinity here.
    Singularity(Vec<CriticalMode>),
    /// So many eigenvalues changed their sign in the step to this point; where was not located.
    Passed(usize),
    /// The branch leaves the range of λ.
    End,
}

/// Which derivative of the imbalance a critical mode makes singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// H = ∂²U/∂x², the shape at given species: disturbances are of the shape alone. Without species, or where the policy
    /// gives the shape no storage.
    Shape,
    /// The Jacobian of shape and species; the shape follows the species where it has no storage.
    Coupled,
}

impl Block {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::Shape, Self::Coupled];
}

/// How many disturbances of an equilibrium grow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnstableDirections {
    /// Those of [`Block::Shape`].
    pub shape: usize,
    /// Those of [`Block::Coupled`].
    pub coupled: usize,
}

impl UnstableDirections {
    /// All of them: 0 where the equilibrium is stable.
    #[must_use]
    pub fn total(self) -> usize {
        self.shape + self.coupled
    }

    /// Those of `block`.
    pub(super) fn in_block(self, block: Block) -> usize {
        match block {
            Block::Shape => self.shape,
            Block::Coupled => self.coupled,
        }
    }

    /// How many are more or fewer than in `other`.
    pub(super) fn distance(self, other: Self) -> usize {
        self.shape.abs_diff(other.shape) + self.coupled.abs_diff(other.coupled)
    }
}

/// A direction in which a disturbance of an equilibrium grows, or would beyond a bifurcation.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalMode {
    /// What is singular where the eigenvalue is 0.
    pub block: Block,
    /// Below 0 where the disturbance grows: of [`Block::Shape`] the eigenvalue of H, force/length³; of [`Block::Coupled`] minus
    /// the rate of growth, 1/time.
    pub eigenvalue: f64,
    /// Angular frequency at which the disturbance oscillates, 1/time; 0 at a bifurcation of steady states.
    pub frequency: f64,
    /// The disturbance: the largest displacement has length 1, or the largest change of a species in units of its typical
    /// magnitude where no shape moves.
    pub shape: Unknowns,
}

impl CriticalMode {
    /// Of the shape alone, with these changes of the species.
    fn of_shape(mode: Mode, species: Vec<Vec<f64>>) -> Self {
        let shape = Unknowns { x: mode.shape, species };
        Self { block: Block::Shape, eigenvalue: mode.eigenvalue, frequency: 0.0, shape }
    }
}

/// An equilibrium on a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Arc length from the start.
    pub arc: f64,
    /// λ.
    pub parameter: f64,
    /// The shape and the species.
    pub at: Unknowns,
    /// Energy U.
    pub energy: f64,
    /// Largest force left, in units of the force scale.
    pub residual: f64,
    /// Eigenvalues below 0 ([`CriticalMode::eigenvalue`]) of both blocks: 0 where the equilibrium is stable. With species of
    /// those that are nearest to 0 ([`SteadyStateSystem`]).
    pub negative: usize,
    /// Of them those of [`Block::Shape`].
    pub negative_of_shape: usize,
    /// Iterations of the corrector.
    pub iterations: usize,
    /// What is special about it.
    pub event: Event,
}

/// Refuses effects whose branches are not followed.
///
/// # Errors
/// [`SolveError::NotFollowed`] for a constraint, and for an effect that couples pairs of the moment or limits steps.
pub fn check(mechanics: &Mechanics) -> Result<(), SolveError> {
    let refuse = |effect: &str, why: &str| {
        let (effect, why) = (effect.to_owned(), why.to_owned());
        Err(SolveError::NotFollowed { effect, why })
    };
    if let Some(name) = mechanics.constraint_names().next() {
        return refuse(name, "it is a constraint, whose multiplier is not an unknown of a branch");
    }
    let contact = |term: &EnergyTerm| term.interaction() != Interaction::default();
    match mechanics.terms().iter().position(contact) {
        Some(k) => refuse(
            mechanics.names().nth(k).unwrap_or_default(),
            "what it couples changes with the shape, and branches have kinks there",
        ),
        None => Ok(()),
    }
}
