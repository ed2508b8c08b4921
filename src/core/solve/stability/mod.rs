//! Stability of an equilibrium: how many directions lower the energy, which, and how fast.
//!
//! ```text
//! H v = λ M v        H = ∂²U/∂x² with the fixed directions taken out
//!                    M = diag(A⁰_i), a third of the rest area of the triangles around vertex i
//! ```
//!
//! With this mass λ is a stiffness per rest area, force/length³ (energy/length⁴): moving the sheet by
//! `a v` changes the energy by `½ λ a² Σ_i A⁰_i |v_i|²`. It does not depend on the mesh as this is
//! refined; a bending wave of wavenumber k on a stress-free flat sheet has λ = B k⁴. An equilibrium is
//! stable if no λ is negative; it is a saddle with as many unstable directions as there are.
//!
//! * **Inertia.** The signs of D in `H + s M = L D Lᵀ` count the λ below -s (Sylvester). s is the
//!   *resolution*, 10⁻¹² of the mean diagonal of H over M: what round-off leaves of a zero. Where the
//!   factor is worse, as measured by a solve, the resolution is made coarser until it covers that.
//! * **Rigid motions** that no pin hinders have λ = 0: six of a free sheet, three where only z is fixed.
//!   A motion `v = t + ω × x` is one if it moves no vertex in a fixed direction and `|H v|` is not
//!   above what the force left by the relaxation explains: turning turns forces, `H v = ω × ∂U/∂x`.
//!   They are counted and taken out: inertia and modes are those of H on their complement.
//! * **Modes.** The smallest λ by Lanczos' method for `(H - σ M)⁻¹ M`, σ below all of them, found by
//!   inertia. The file `lanczos.rs` says how multiple eigenvalues are found.
//!
//! References: Parlett, The Symmetric Eigenvalue Problem (SIAM 1998), 3.3 and ch. 13; Ericsson & Ruhe,
//! Math. Comp. 35 (1980) 1251, doi:10.2307/2006390. Not covered: loads that follow the shape without an
//! energy, whose H is not symmetric; sheets too large for a factor.

mod lanczos;
mod restricted;
mod rigid;

use std::sync::Arc;

use self::restricted::{Count, Restricted};
use super::linear_solvers::Analyse;
use super::low_rank::LowRankUpdate;
use super::{Control, SolveError};
use crate::Vec3;
use crate::effects::{HessianPart, RankOneTerm};
use crate::geometry::lumped_areas;
use crate::linear::{BlockLdlt, BlockMatrix, LinearError, LinearSolver, PeriodicSolver};
use crate::model::{Mechanics, Potential};
use crate::num::real;
use crate::reduction::Reduction;
use crate::solve::stability::restricted::product;
use crate::tally::Tally;

/// Resolution relative to the mean diagonal of H over M. Factors leave errors of some 10⁻¹⁵; the
/// softest bending mode of a disc with 100 edges along its radius and half an edge thick is at 10⁻⁹.
const RESOLUTION: f64 = 1e-12;
/// The resolution is at least so many times the backward error of the factor.
const RESOLUTION_MARGIN: f64 = 10.0;
/// A resolution coarser than this, relative as above, says nothing any more.
const COARSEST_RESOLUTION: f64 = 1e-4;
/// σ is lowered by this factor until nothing is below it. Larger factors cost fewer factorisations
/// and more iterations.
const SHIFT_FACTOR: f64 = 10.0;
/// Signs of the eigenvalues at a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Number of negative-curvature modes: eigenvalues below `-resolution`.
    pub negative: usize,
    /// Rigid motions that nothing hinders: zero modes.
    pub rigid: usize,
    /// Eigenvalues nearer to 0 than this count as 0, force/length³.
    pub resolution: f64,
}

/// An eigenvalue with its direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// λ, force/length³.
    pub eigenvalue: f64,
    /// Displacement of every vertex; the largest has length 1, and its largest component is positive.
    pub shape: Vec<Vec3>,
}

/// The low end of the spectrum at a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Signs of all eigenvalues.
    pub inertia: Inertia,
    /// The smallest eigenvalues that are not rigid motions, ascending.
    pub modes: Vec<Mode>,
}

impl Spectrum {
    /// Whether an eigenvalue besides those of rigid motions is as good as 0, and none is negative.
    #[must_use]
    pub fn is_marginal(&self) -> bool {
        let resolution = self.inertia.resolution;
        self.inertia.negative == 0 && self.modes.iter().any(|m| m.eigenvalue <= resolution)
    }
}

/// What the stability of one sheet's shapes is judged with; memory and ordering are reused.
pub struct Stability {
    mass: Vec<f64>,
    matrix: BlockMatrix,
    /// With a multiple of the mass.
    shifted: BlockMatrix,
    solver: Box<dyn LinearSolver>,
    analyse: Analyse,
    tally: Tally,
    reduction: Reduction,
    control: Control,
}

impl Stability {
    /// Prepares the factorisation for the effects of `mechanics`, by LDLᵀ.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub fn new(mechanics: &Mechanics) -> Result<Self, SolveError> {
        Self::with_solver(mechanics, |pattern| Ok(Box::new(BlockLdlt::new(Arc::clone(pattern))?)))
    }

    /// The same with a solver that counts negative eigenvalues ([`LinearSolver::negative_eigenvalues`]).
    ///
    /// # Errors
    /// Those of `analyse`.
    pub fn with_solver(mechanics: &Mechanics, analyse: Analyse) -> Result<Self, SolveError> {
        let sheet = mechanics.sheet();
        let pattern = mechanics.pattern();
        Ok(Self {
            mass: lumped_areas(sheet),
            matrix: BlockMatrix::zeros(Arc::clone(pattern)),
            shifted: BlockMatrix::zeros(Arc::clone(pattern)),
            solver: PeriodicSolver::boxed(pattern, analyse)?,
            analyse,
            tally: mechanics.tally().clone(),
            reduction: sheet.reduction().clone(),
            control: Control::default(),
        })
    }

    /// The same on behalf of `control`, who may interrupt it between two factorisations or solutions.
    #[must_use]
    pub fn with_control(mut self, control: &Control) -> Self {
        self.control = control.clone();
        self
    }

    /// The mass of every vertex: its rest area, length².
    #[must_use]
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Counts the negative-curvature modes at `x`, by one factorisation.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if H is not finite or its factor not sound.
    pub fn inertia(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
    ) -> Result<Inertia, SolveError> {
        self.inertia_below(potential, x, 0.0, None)
    }

    /// The same with a resolution of at least `least`, force/length³. Replaces `forces` by the solution with H on the complement of
    /// the rigid motions.
    pub(in crate::solve) fn inertia_below(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        least: f64,
        forces: Option<&mut [Vec3]>,
    ) -> Result<Inertia, SolveError> {
        let (unit, rigid, terms) = self.assemble(potential, x)?;
        let control = self.control.clone();
        let mut restricted = self.restricted(rigid, terms);
        let inertia = count(&mut restricted, (unit, least), &control)?;
        if let Some(forces) = forces {
            restricted.solve(forces);
            restricted.update_ghosts(forces);
        }
        Ok(inertia)
    }

    /// Replaces `forces`, 0 along fixed directions, by the solution with H at `x` on the complement of the rigid motions.
    ///
    /// # Errors
    /// As for [`Self::inertia`].
    pub(in crate::solve) fn solve(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        forces: &mut [Vec3],
    ) -> Result<Inertia, SolveError> {
        self.inertia_below(potential, x, 0.0, Some(forces))
    }

    /// The `count` smallest eigenvalues at `x` with their modes; fewer if the sheet has no more.
    ///
    /// # Errors
    /// [`SolveError::Linear`] as above; [`SolveError::Modes`] if the iteration does not
    /// converge.
    pub fn spectrum(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        count: usize,
    ) -> Result<Spectrum, SolveError> {
        let (unit, rigid, terms) = self.assemble(potential, x)?;
        let control = self.control.clone();
        let mut restricted = self.restricted(rigid, terms);
        let inertia = self::count(&mut restricted, (unit, 0.0), &control)?;
        let Inertia { negative, resolution, .. } = inertia;
        let (mut shift, mut below) = (resolution, negative);
        while below > 0 {
            shift *= SHIFT_FACTOR;
            if !shift.is_finite() {
                return Err(SolveError::Modes { found: 0, wanted: count });
            }
            control.check()?;
            below = restricted.factorise(shift)?.negative;
        }
        let pairs = lanczos::smallest(&mut restricted, potential.pins(), count, &control)?;
        let found = pairs.iter().filter(|p| p.0 < -resolution).count();
        if found != negative.min(pairs.len()) {
            return Err(SolveError::Linear(LinearError::new(format!(
                "{negative} negative eigenvalues are counted, but {found} found among the \
                 smallest {}",
                pairs.len()
            ))));
        }
        let modes = pairs
            .into_iter()
            .map(|(eigenvalue, shape)| Mode { eigenvalue, shape: normalised(shape) })
            .collect();
        Ok(Spectrum { inertia, modes })
    }

    /// Assembles H; its mean diagonal over the mean mass, the rigid motions (orthonormal in M), and what
    /// of H is of low rank.
    fn assemble(&mut self, potential: &mut Potential, x: &[Vec3]) -> Result<Parts, SolveError> {
        let pattern = potential.pattern(x);
        if pattern != *self.matrix.pattern() {
            self.solver = PeriodicSolver::boxed(&pattern, self.analyse)?;
            self.shifted = BlockMatrix::zeros(Arc::clone(&pattern));
            self.matrix = BlockMatrix::zeros(pattern);
        }
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        potential.hessian(x, HessianPart::Full, &mut self.matrix)?;
        let terms = potential.low_rank(x, HessianPart::Full);
        let diagonal = self.matrix.mean_diagonal();
        let mean_mass = self.mass.iter().sum::<f64>() / real(self.mass.len().max(1));
        let force = self.reduction.dot(&gradient, &gradient).sqrt();
        let limits = rigid::Limits { force, round_off: 10.0 * RESOLUTION * diagonal };
        let whole = LowRankUpdate::new(terms.clone(), &self.reduction, |_| ());
        let image = |v: &[Vec3]| {
            let mut out = product(&self.matrix, v);
            whole.add_product(v, &mut out);
            out
        };
        let motions =
            rigid::motions(x, potential.pins(), &self.mass, &self.reduction, image, &limits);
        Ok((diagonal / mean_mass, motions, terms))
    }

    fn restricted(&mut self, rigid: Vec<Vec<Vec3>>, terms: Vec<RankOneTerm>) -> Restricted<'_> {
        let factor = (&mut *self.solver, &mut self.shifted, &self.tally, &self.reduction);
        Restricted::new(factor, &self.matrix, &self.mass, rigid, terms)
    }
}

/// Scale of the eigenvalues, rigid motions, terms of low rank.
type Parts = (f64, Vec<Vec<Vec3>>, Vec<RankOneTerm>);

/// Counts at the finest resolution from `least` on that the factor bears; `unit` is the scale of the eigenvalues.
fn count(
    restricted: &mut Restricted<'_>,
    (unit, least): (f64, f64),
    control: &Control,
) -> Result<Inertia, SolveError> {
    let mut relative = RESOLUTION.max(least / unit);
    let coarsest = COARSEST_RESOLUTION.max(relative);
    while relative <= coarsest {
        control.check()?;
        let Count { negative, error } = restricted.factorise(relative * unit)?;
        if RESOLUTION_MARGIN * error <= relative {
            let rigid = restricted.rigid().len();
            return Ok(Inertia { negative, rigid, resolution: relative * unit });
        }
        relative = (RESOLUTION_MARGIN * error).max(SHIFT_FACTOR * relative);
    }
    Err(SolveError::Linear(LinearError::new(
        "the factor of the indefinite Hessian is dominated by round-off",
    )))
}

/// Scales the largest displacement to 1 and makes its largest component positive.
fn normalised(mut shape: Vec<Vec3>) -> Vec<Vec3> {
    let (mut at, mut square) = (0, 0.0);
    for (i, v) in shape.iter().enumerate() {
        if v.norm_squared() > square {
            (at, square) = (i, v.norm_squared());
        }
    }
    if square > 0.0 {
        let sign = shape[at][shape[at].iamax()].signum();
        let factor = sign / square.sqrt();
        shape.iter_mut().for_each(|v| *v *= factor);
    }
    shape
}
