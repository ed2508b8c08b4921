//! Limited-memory BFGS preconditioned with a Cholesky factor of the Hessian's positive part, or with
//! multigrid.
//!
//! The factor carries the stiff directions (stretching, short bending waves), the memory learns
//! what the positive part leaves out (compressive geometric stiffness). The factor is kept while it
//! serves, across calls too. Rigid motions are fixed by a gauge. Where the metric turns out too soft it is
//! stiffened, and where the iteration stalls it falls back to Newton's method (`newton_fallback`). Steps are limited so that no
//! triangle collapses: the energy of the cotangent curvature jumps there, and a long memory would not
//! survive it.
//!
//! References: Nocedal & Wright, Numerical Optimization (2006), algorithm 7.4; approximate descent
//! test near round-off after Hager & Zhang, SIAM J. Optim. 16 (2005), doi:10.1137/030601880.

mod checkpoint;
mod collapse;
mod iteration;
mod newton_fallback;
mod progress;
mod rollback;
mod spec;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::super::counters::Linear;
use super::gauge::Gauge;
use super::history::History;
use super::preconditioner::{HessianInverse, LARGE_SHEET, Preconditioner};
use crate::Vec3;
use crate::effects::HessianPart;
use crate::linear::{BlockMatrix, LinearError};
use crate::model::{Mechanics, Potential};
use crate::record::Record;
use crate::solve::equilibrium::{Equilibrium, ForceTolerance};
use crate::solve::{EquilibriumSpec, SolveError};

pub use spec::{Collapse, LbfgsSpec};

/// Diagonal shift relative to the mean diagonal, for directions without any stiffness; small against the
/// softest bending of the sheets in use. Rigid motions have the gauge.
const DIAGONAL_SHIFT: f64 = 1e-9;
/// The whole Hessian is tried once the residual is below this; after a failure, below a tenth of
/// the residual then.
const NEARLY_AT_REST: f64 = 1e-2;
/// Shift after a fresh factor gave no step, and by how much it grows from then on. Directions in
/// which the positive part has no stiffness (waves of a free boundary) are why it may be needed.
const MORE_SHIFT: (f64, f64) = (1e-6, 100.0);
/// A shift that was this large and gave no step is not enlarged any more.
const MAX_SHIFT: f64 = 1.0;

/// Iterations between two factorisations of small sheets far from rest, and otherwise. Over many
/// iterations with one factor far from rest, differences in the last digit grow to other minima
/// (`docs/notebook/sensitivity.md`); a fresh one every five needs fewer iterations and no more time where a
/// factor is cheap. Near rest it is the memory that finds what is soft, and a fresh factor empties it.
pub(super) const REFRESH_INTERVALS: (usize, usize) = (5, 15);

/// Whether there is a factor, and how it is made and kept.
#[derive(Debug, Clone, Copy)]
struct FactorState {
    ready: bool,
    /// Least weight of the anchor that it was made with.
    weight: f64,
    /// Diagonal shift, in mean diagonals.
    shift: f64,
    /// Iterations after which it is renewed.
    refresh: usize,
}

/// How the factor was made, besides its matrix.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
pub(super) struct FactorSettings {
    /// At which shape; empty where only the matrix matters.
    pub(super) x: Vec<Vec3>,
    /// Whether it was to succeed at some expense.
    pub(super) insist: bool,
}

/// Where a step began.
#[derive(Debug)]
pub(super) struct RollbackSnapshot {
    factor: FactorState,
    /// All of it; where steps teach nothing, only once the factor goes.
    record: Option<Record>,
}

/// Preconditioned L-BFGS for one sheet.
pub struct Lbfgs {
    options: LbfgsSpec,
    matrix: BlockMatrix,
    /// Of the preconditioner.
    kind: Preconditioner,
    inverse: HessianInverse,
    /// Belongs to the factor.
    gauge: Gauge,
    factor: FactorState,
    made: FactorSettings,
    /// Whether the pattern has pairs that are coupled at the moment.
    of_the_moment: bool,
    /// Whether drag supports the softest waves.
    supported: bool,
    try_full_below: f64,
    history: History,
    /// Vertices of collapsed triangles, fixed.
    fixed: Vec<usize>,
    snapshot: Option<RollbackSnapshot>,
}

impl Lbfgs {
    /// Prepares the sparse factorisation for the effects of `mechanics`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub fn new(mechanics: &Mechanics, options: LbfgsSpec) -> Result<Self, SolveError> {
        let scope = Linear::from_tally(mechanics.tally()).matrix.uncounted_scope();
        let pattern = Arc::clone(mechanics.pattern());
        let matrix = BlockMatrix::zeros(Arc::clone(&pattern));
        drop(scope);
        let reduction = mechanics.sheet().reduction();
        let kind = options.preconditioner.for_ranks(reduction, pattern.rows(), false);
        Ok(Self {
            options,
            matrix,
            kind,
            inverse: HessianInverse::new(kind, options.precision, &pattern, mechanics)?,
            gauge: Gauge::default(),
            factor: FactorState {
                ready: false,
                weight: 0.0,
                shift: DIAGONAL_SHIFT,
                refresh: REFRESH_INTERVALS.1,
            },
            made: FactorSettings::default(),
            of_the_moment: false,
            supported: false,
            try_full_below: NEARLY_AT_REST,
            history: History::new(
                mechanics.is_planar(),
                options.memory.get(),
                mechanics.sheet().reduction().clone(),
            ),
            fixed: Vec::new(),
            snapshot: None,
        })
    }

    /// Renews the factor: of the whole Hessian where it is positive and the shape nearly at rest,
    /// of its positive part otherwise.
    ///
    /// Far from equilibrium the positive part is the better metric even where the Hessian happens
    /// to be positive: from a violent start it led to minima with a third less energy and in a
    /// third of the time.
    fn refactor(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        residual: f64,
    ) -> Result<(), SolveError> {
        self.fit(potential, x)?;
        self.factor.ready = false;
        for part in [HessianPart::Full, HessianPart::Positive] {
            let plain = self.inverse.is_vertexwise() || self.inverse.assumes_positive_definite();
            if part == HessianPart::Full && (plain || residual > self.try_full_below) {
                continue;
            }
            let insist = part == HessianPart::Positive;
            if self.factorise(potential, x, part, insist)? {
                return Ok(());
            }
            self.try_full_below = 0.1 * residual;
        }
        Err(SolveError::Linear(LinearError::new(
            "the positive part of the Hessian is not positive: the shape has degenerate triangles",
        )))
    }

    /// Takes over a part of the Hessian at `x`, with its gauge and shift, if it is positive.
    fn factorise(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        part: HessianPart,
        insist: bool,
    ) -> Result<bool, SolveError> {
        potential.hessian(x, part, &mut self.matrix)?;
        let terms = potential.low_rank(x, part);
        let unit = self.matrix.mean_diagonal();
        self.gauge.support(&mut self.matrix, unit);
        self.matrix.add_diagonal(self.factor.shift * unit);
        if self.inverse.is_additive() {
            self.matrix.pin(&potential.sheet().outermost(), unit);
        }
        self.factor.ready = self.inverse.factorise(&self.matrix, terms, x, insist).is_ok();
        if self.factor.ready {
            let x = if self.inverse.reads_shape() { x } else { &[] };
            self.made = FactorSettings { x: x.to_vec(), insist };
            self.history.clear();
        }
        Ok(self.factor.ready)
    }

    /// Whether the whole Hessian at `x` is positive besides free rigid motions, where a factor can tell; it
    /// serves the next relaxation.
    fn factorise_whole(&mut self, potential: &mut Potential, x: &[Vec3]) -> Option<bool> {
        self.complete_snapshot();
        self.supported = false;
        self.fit(potential, x).ok()?;
        if !self.inverse.detects_indefinite() {
            return None;
        }
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        self.gauge = Gauge::new(potential, x, &gradient, self.options.tolerance.on(potential));
        (self.factor.ready, self.factor.shift, self.factor.weight) = (false, DIAGONAL_SHIFT, 0.0);
        self.factorise(potential, x, HessianPart::Full, false).ok()
    }

    /// Makes room for what is coupled at `x`, and the preconditioner that suits it.
    fn fit(&mut self, potential: &mut Potential, x: &[Vec3]) -> Result<(), SolveError> {
        let pattern = potential.pattern(x);
        let LbfgsSpec { preconditioner, precision, .. } = self.options;
        let kind = preconditioner.for_ranks(potential.reduction(), pattern.rows(), self.supported);
        let other = pattern != *self.matrix.pattern();
        if other || kind != self.kind {
            let mechanics = potential.mechanics();
            let _scope = Linear::from_tally(mechanics.tally()).factors.uncounted_scope();
            self.inverse = HessianInverse::new(kind, precision, &pattern, mechanics)?;
            self.kind = kind;
            self.factor.ready = false;
        }
        if other {
            self.matrix = BlockMatrix::zeros(pattern);
            self.of_the_moment = potential.mechanics().couples_pairs();
        }
        Ok(())
    }

    /// The two-loop recursion: `-H g`.
    fn direction(&mut self, gradient: &[Vec3], d: &mut Vec<Vec3>) {
        d.clear();
        d.extend(gradient.iter().map(|g| -g));
        let Self { history, gauge, inverse, fixed, .. } = self;
        history.apply(d, |d| {
            gauge.project(d);
            inverse.solve(d);
            gauge.project(d);
            for &i in fixed.iter() {
                d[i] = Vec3::zeros();
            }
        });
    }

    /// Energy and gradient, without what acts on fixed vertices.
    fn evaluate(&self, potential: &mut Potential, x: &[Vec3], gradient: &mut [Vec3]) -> f64 {
        let energy = potential.energy_gradient(x, gradient);
        for &i in &self.fixed {
            gradient[i] = Vec3::zeros();
        }
        energy
    }

    /// Enlarges the shift for the next factor.
    fn stiffen(&mut self) {
        self.factor.shift = (self.factor.shift * MORE_SHIFT.1).clamp(MORE_SHIFT.0, MAX_SHIFT);
    }

    /// Whether Newton's method can take over: its factor is affordable and wanted, and it holds no vertices.
    fn may_hand_over(&self) -> bool {
        let affordable = self.matrix.pattern().rows() <= LARGE_SHEET
            && !self.inverse.is_vertexwise()
            && !self.inverse.has_ghosts();
        self.fixed.is_empty() && affordable
    }
}

#[typetag::serialize(name = "lbfgs")]
impl EquilibriumSpec for LbfgsSpec {
    fn name(&self) -> String {
        format!("L-BFGS, preconditioned by {}", self.preconditioner.describe())
    }

    fn tolerance(&self) -> ForceTolerance {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations.get()
    }

    fn supports_ranks(&self) -> bool {
        self.preconditioner != Preconditioner::Multigrid && self.collapse.is_none()
    }

    fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Ok(Box::new(Lbfgs::new(mechanics, *self)?))
    }
}

crate::register_kind!(dyn EquilibriumSpec, "lbfgs", LbfgsSpec);
