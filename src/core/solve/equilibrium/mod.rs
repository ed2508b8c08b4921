//! Mechanical equilibrium: `0 = -∂U/∂x` at fixed chemistry.
//!
//! Which of several minima is found is physics, so every method goes downhill from the shape it is
//! given by limited steps.

mod constrained;
mod descent;
mod displacement_loading;
mod force_tolerance;
mod gauge;
mod history;
mod lbfgs;
mod newton;
mod preconditioner;
mod stop;

pub use constrained::relax;
pub use descent::{Descent, DescentSpec};
pub(super) use displacement_loading::{MIN_AREA_SHARE, load_incrementally};
pub use force_tolerance::{FELT_LOAD_RATIO, ForceTolerance, largest_load};
pub(in crate::solve) use gauge::Gauge;
pub use lbfgs::{Collapse, Lbfgs, LbfgsSpec};
pub use newton::{Newton, NewtonSpec};
pub use preconditioner::{FactorPrecision, Preconditioner};
pub use stop::explained;

use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::record::{Malformed, Record};
use crate::reduction::Reduction;
use crate::solve::{Result, SolveError};

/// Largest |g| of a constraint that is met.
pub const CONSTRAINT_TOLERANCE: f64 = 1e-9;

/// Round-off of a distance, relative to it.
const ROUND_OFF: f64 = 1e-9;

/// When a relaxation may stop.
#[derive(Clone, Copy)]
pub struct Goal<'a> {
    /// Largest force on a vertex, in units of [`Potential::force_scale`].
    pub tolerance: f64,
    /// Most iterations before it counts as failed.
    pub max_iterations: usize,
    /// Asked now and then; `true` gives up with [`SolveError::Interrupted`].
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Told in every iteration how far it is.
    pub report: &'a (dyn Fn(&Relaxation) + Sync),
    /// Largest distance to the equilibrium, as the metric estimates it, that counts as rest: a small force may
    /// leave a soft mode far from it. Infinite where forces alone decide.
    pub distance_tolerance: f64,
    /// Asked of the shape in every iteration; `true` gives up with [`SolveError::Departed`].
    pub lost: &'a (dyn Fn(&[Vec3]) -> bool + Sync),
    /// The trust region, if there is one: leaving it gives up with [`SolveError::Departed`].
    pub trust: Option<TrustRegion<'a>>,
    /// Whether rigid motions that pins leave free change no energy but that of an anchor.
    pub floats: bool,
}

impl Default for Goal<'_> {
    /// The defaults of `lbfgs`; neither interrupted nor reported.
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_iterations: 3000,
            interrupted: &|| false,
            report: &|_| (),
            lost: &|_| false,
            distance_tolerance: f64::INFINITY,
            trust: None,
            floats: false,
        }
    }
}

/// A ball about a shape: every vertex within the same distance of where it is there.
#[derive(Clone, Copy)]
pub struct TrustRegion<'a> {
    /// The shape.
    pub centre: &'a [Vec3],
    /// The distance.
    pub radius: f64,
}

impl TrustRegion<'_> {
    /// Whether `x` lies within; a step that is shortened to the boundary ends there but for round-off, which decides nothing.
    fn contains(&self, x: &[Vec3], reduction: &Reduction) -> bool {
        !(reduction.distance(self.centre, x) > self.radius * (1.0 + ROUND_OFF))
    }

    /// The largest t up to `most` for which `x + t d` lies within, if `x` does.
    fn longest(&self, x: &[Vec3], d: &[Vec3], most: f64, reduction: &Reduction) -> f64 {
        // |p + t d|² = r² of every vertex, with p = x - c.
        let of = |i: usize| {
            let (p, d) = (x[i] - self.centre[i], d[i]);
            let (a, b) = (d.norm_squared(), p.dot(&d));
            let c = (self.radius * self.radius - p.norm_squared()).max(0.0);
            // Its inverse: a maximum is what there is.
            a / ((b * b + a * c).sqrt() - b).max(f64::MIN_POSITIVE)
        };
        (1.0 / reduction.max(x.len(), of)).min(most)
    }
}

/// Whether a sheet lies in a plane z = const: no motion leads out of it, and the scene says how symmetry is broken.
pub(in crate::solve) fn is_flat(x: &[Vec3], reduction: &Reduction) -> bool {
    let highest = reduction.max(x.len(), |i| x[i].z);
    highest == -reduction.max(x.len(), |i| -x[i].z)
}

/// What a relaxation did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Relaxation {
    /// Steps taken.
    pub iterations: usize,
    /// Largest force left, in units of the force scale.
    pub residual: f64,
    /// Energy reached.
    pub energy: f64,
    /// Triangles that collapsed and were fixed.
    pub collapsed: usize,
    /// Work that the drag took up.
    pub dissipated: f64,
    /// Energy that growth, loads and what is prescribed supplied, where the shape is quasi-static.
    pub supplied: f64,
    /// Share of the energy supplied since the start of the run that a stabilising drag has taken up outside of snaps.
    pub drag_share: f64,
    /// Snaps that ended.
    pub snaps: usize,
    /// Energy that they released.
    pub released: f64,
    /// The vertex that moved most in the last of them.
    pub snapped: Option<usize>,
    /// Whether a quasi-static shape is under way, rather than at rest.
    pub moving: bool,
    /// Pairs of a start that were moved apart before, and by how much at most.
    pub separated: (usize, f64),
}

impl Relaxation {
    /// Adds the steps of a later relaxation, and takes over what it reached.
    pub fn add(&mut self, later: &Self) {
        self.iterations += later.iterations;
        self.residual = later.residual;
        self.energy = later.energy;
        self.collapsed = later.collapsed;
    }

    /// Of so many iterations that led to nothing else.
    #[must_use]
    pub(crate) fn of_iterations(iterations: usize) -> Self {
        Self { iterations, ..Self::default() }
    }
}

/// A method that finds the equilibrium nearest downhill.
pub trait Equilibrium: Send {
    /// Relaxes `x` in place; on an error `x` is the last good shape.
    ///
    /// # Errors
    /// [`SolveError`] if the goal is not reached.
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError>;

    /// Whether it ends at rest, rather than after so many steps.
    fn reaches_rest(&self) -> bool {
        true
    }

    /// Whether `x`, an equilibrium, is a minimum, where the method can tell at little expense.
    fn is_minimum(&mut self, _potential: &mut Potential, _x: &[Vec3]) -> Option<bool> {
        None
    }

    /// A step begins.
    fn begin_step(&mut self) {}

    /// That step has failed: later relaxations have the bits of one that was never made.
    fn roll_back(&mut self, _mechanics: &Mechanics) {}

    /// All that a later relaxation depends on besides its arguments.
    fn memory(&self) -> Record {
        Record::default()
    }

    /// Takes over the memory of one of the same kind, for the same `mechanics`: later relaxations have the same
    /// bits.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    fn restore(&mut self, _memory: &Record, _mechanics: &Mechanics) -> Result<(), Malformed> {
        Ok(())
    }
}

/// A method with its settings, as `[equilibrium]` of a scene has it.
pub struct Method(Box<dyn EquilibriumSpec>);

impl Method {
    /// The method of these settings.
    #[must_use]
    pub fn new(spec: Box<dyn EquilibriumSpec>) -> Self {
        Self(spec)
    }

    /// Its name in results.
    #[must_use]
    pub fn name(&self) -> String {
        self.0.name()
    }

    /// Largest force on a vertex that counts as rest.
    #[must_use]
    pub fn tolerance(&self) -> ForceTolerance {
        self.0.tolerance()
    }

    /// Iterations after which a relaxation has failed.
    #[must_use]
    pub fn max_iterations(&self) -> usize {
        self.0.max_iterations()
    }

    /// Makes it ready for the effects of a sheet.
    ///
    /// # Errors
    /// If the sheet is too large for it.
    pub fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        self.0.build(mechanics)
    }
}

/// A way to find mechanical equilibrium as a scene names it.
#[typetag::serialize(tag = "method")]
pub trait EquilibriumSpec: std::fmt::Debug + Send + Sync {
    /// What the method is called in results.
    fn name(&self) -> String;

    /// Largest force on a vertex that counts as rest.
    fn tolerance(&self) -> ForceTolerance;

    /// Iterations after which a relaxation has failed.
    fn max_iterations(&self) -> usize;

    /// Whether it relaxes a sheet that is spread over ranks.
    fn supports_ranks(&self) -> bool {
        false
    }

    /// Makes it ready for the effects of a sheet.
    ///
    /// # Errors
    /// If the sheet is too large for it.
    fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>>;
}

crate::family!(dyn EquilibriumSpec, "equilibrium method", "method");
