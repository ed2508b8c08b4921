//! What branches are followed of: g(u, λ) = 0, with the linear algebra that belongs to it.

use super::{Block, CriticalMode, Direction, Unknowns, UnstableDirections};
use crate::solve::SolveError;
use crate::tally::Tally;

/// A point at which a system was evaluated, an equilibrium in the end.
pub struct Equilibrium<M> {
    /// u.
    pub at: Unknowns,
    /// λ.
    pub parameter: f64,
    /// The system at λ.
    pub member: M,
    /// g: ∂U/∂x, and the rates of the species with the opposite sign.
    pub imbalance: Unknowns,
    /// U.
    pub energy: f64,
    /// Largest force, in units of the force scale.
    pub residual: f64,
    /// Iterations of the corrector so far.
    pub iterations: usize,
}

/// Equations g(u, λ) = 0 over a parameter.
pub trait System {
    /// Why they have no value, or no member.
    type Error: From<SolveError>;
    /// What they are at one λ.
    type Member;

    /// g at `at` with the fixed directions of `parameter`.
    ///
    /// # Errors
    /// If the system has no value there.
    fn evaluate(
        &mut self,
        at: Unknowns,
        parameter: f64,
    ) -> Result<Equilibrium<Self::Member>, Self::Error>;

    /// Takes over ∂g/∂u at `at`, where forces below `tolerance` count as 0.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if it is not finite, or singular to the last digit.
    fn factorise(
        &mut self,
        at: &mut Equilibrium<Self::Member>,
        tolerance: f64,
    ) -> Result<(), SolveError>;

    /// Solves with ∂g/∂u and the border of a column and a row, for a right-hand side of both.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if that matrix is singular.
    fn solve_bordered(
        &mut self,
        border: (&Unknowns, &Direction),
        right: (&Unknowns, f64),
    ) -> Result<Direction, SolveError>;

    /// The number of directions in which a disturbance of `at` grows.
    ///
    /// # Errors
    /// If it cannot be counted.
    fn unstable_directions(
        &mut self,
        at: &mut Equilibrium<Self::Member>,
    ) -> Result<UnstableDirections, SolveError>;

    /// The lowest `count` eigenvalues of `block` at `at` with their modes, ascending: unstable ones first. Fewer where no more
    /// are known.
    ///
    /// # Errors
    /// If they are not found.
    fn modes(
        &mut self,
        at: &mut Equilibrium<Self::Member>,
        block: Block,
        count: usize,
    ) -> Result<Vec<CriticalMode>, SolveError>;

    /// Of a mode v: τ = 1/(f · (∂g/∂u)⁻¹ f), which is 0 where ∂g/∂u is singular, and (∂g/∂u)⁻¹ f, there its null vector. f is M v
    /// with the rest areas M of the vertices, or B v with the storage B for a mode of [`Block::Coupled`]. None where the modes of
    /// the block are null vectors themselves.
    ///
    /// # Errors
    /// If ∂g/∂u cannot be factorised.
    fn test_function(
        &mut self,
        at: &mut Equilibrium<Self::Member>,
        mode: &CriticalMode,
    ) -> Result<Option<(f64, Unknowns)>, SolveError>;

    /// Whether `at` may go to `next` in one correction.
    fn allows(&self, at: &Equilibrium<Self::Member>, next: &Unknowns) -> bool;

    /// Where its work is counted.
    fn tally(&self) -> &Tally;
}
