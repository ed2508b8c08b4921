//! The metric that L-BFGS starts from: a Cholesky factor, or multigrid where that is too large; or a plain
//! one, as other codes have it.

use std::sync::Arc;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::super::counters::Linear;
use super::super::linear_solvers::{self, LinearSolverKind};
use super::super::low_rank::LowRankUpdate;
use crate::Vec3;
use crate::effects::RankOneTerm;
use crate::linear::{
    Block, BlockMatrix, BlockPattern, LinearError, LinearSolver, MixedPrecisionCholesky, Multigrid,
    NotPositive, PeriodicSolver,
};
use crate::model::Mechanics;
use crate::num::whole;
use crate::parallel;
use crate::record::{Malformed, Record};
use crate::reduction::Reduction;
use crate::solve::SolveError;

/// How the Hessian's positive part is inverted: `equilibrium.preconditioner` in a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Preconditioner {
    /// Exactly, by a sparse Cholesky factor, whose size grows faster than the sheet.
    Factor,
    /// Approximately, by one multigrid cycle, in memory that grows as the sheet does.
    Multigrid,
    /// Its 3 × 3 blocks on the diagonal, every vertex for itself.
    Blocks,
    /// The factor up to 50 000 vertices, multigrid beyond; under drag multigrid beyond 1000.
    #[default]
    Auto,
    /// By a solver of this name that a crate of the user has registered.
    Registered(&'static str),
}

/// The names of those of the engine.
const NAMES: [(&str, Preconditioner); 4] = [
    ("factor", Preconditioner::Factor),
    ("multigrid", Preconditioner::Multigrid),
    ("blocks", Preconditioner::Blocks),
    ("auto", Preconditioner::Auto),
];

impl Serialize for Preconditioner {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Preconditioner {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let allowed = || linear_solvers::names(&NAMES.map(|(name, _)| name));
        Self::named(&name).ok_or_else(|| D::Error::unknown_variant(&name, allowed()))
    }
}

impl Preconditioner {
    /// The one of this name, of the engine or registered.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let own = NAMES.iter().find(|(own, _)| *own == name).map(|(_, own)| *own);
        own.or_else(|| linear_solvers::find(name).map(|kind| Self::Registered(kind.name)))
    }

    /// The registered solver of this name, for `pattern`.
    ///
    /// # Errors
    /// If none is registered under it, or it cannot do with the pattern.
    pub(super) fn registered(
        self,
        pattern: &Arc<BlockPattern>,
    ) -> Result<Box<dyn LinearSolver>, LinearError> {
        let missing =
            || LinearError::new(format!("`{}` is not a registered linear solver", self.name()));
        let LinearSolverKind { analyse, .. } =
            linear_solvers::find(self.name()).ok_or_else(missing)?;
        analyse(pattern)
    }

    /// Its name in scenes.
    #[must_use]
    pub fn name(self) -> &'static str {
        let own = NAMES.iter().find(|(_, own)| *own == self);
        match self {
            Self::Registered(name) => name,
            _ => own.map_or("", |(name, _)| name),
        }
    }

    /// The choice on a sheet of that many vertices, with or without drag.
    pub(super) fn for_sheet(self, vertices: usize, moving: bool) -> Self {
        let most = if moving { LARGE_UNDER_DRAG } else { LARGE_SHEET };
        match self {
            Self::Auto if vertices <= most => Self::Factor,
            Self::Auto => Self::Multigrid,
            chosen => chosen,
        }
    }

    /// The same on a sheet that may be spread over ranks, of which `rows` vertices are here: there it is multigrid over all
    /// of them where the program has one.
    pub(super) fn for_ranks(self, reduction: &Reduction, rows: usize, moving: bool) -> Self {
        let spread = reduction.ranks().is_some() && self == Self::Auto;
        match linear_solvers::find(DISTRIBUTED_SOLVER) {
            Some(_) if spread => Self::Registered(DISTRIBUTED_SOLVER),
            None if spread => Self::Factor,
            _ => self.for_sheet(whole(reduction.count(rows)), moving),
        }
    }

    /// The solver of this kind, where it is one, for matrices of a pattern.
    fn solver(
        self,
        in_double_precision: bool,
        pattern: &Arc<BlockPattern>,
    ) -> Result<Box<dyn LinearSolver>, LinearError> {
        Ok(match self {
            Self::Multigrid => Box::new(Multigrid::new(pattern)?),
            Self::Registered(_) => self.registered(pattern)?,
            _ if in_double_precision => {
                Box::new(MixedPrecisionCholesky::in_double_precision(Arc::clone(pattern))?)
            }
            _ => Box::new(MixedPrecisionCholesky::new(Arc::clone(pattern))?),
        })
    }

    /// In words, for reports.
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::Factor => "a Cholesky factor",
            Self::Multigrid => "multigrid",
            Self::Blocks => "blocks on the diagonal",
            Self::Auto => "a Cholesky factor or, for large sheets, multigrid",
            Self::Registered(name) => name,
        }
    }
}

/// Precision of the factor: `equilibrium.precision` in a scene. Multigrid is not concerned.
///
/// Single precision does not resolve the softest bending waves, which are 10⁻⁸ times as stiff as the
/// sheet is against stretching: there the factor is round-off, and a snap that goes by these waves can
/// end in another minimum when a number of the scene changes in its seventh digit. In double precision it
/// changes as smoothly as the forces do, for twice the memory and half as much time again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FactorPrecision {
    /// Single, until a matrix is not positive in it.
    Single,
    /// Double.
    Double,
    /// Double up to 6000 vertices, where a factor costs little; single beyond.
    #[default]
    Auto,
}

impl FactorPrecision {
    fn is_double(self, vertices: usize) -> bool {
        match self {
            Self::Single => false,
            Self::Double => true,
            Self::Auto => vertices <= SMALL_SHEET,
        }
    }
}

/// The name of the solver that [`Preconditioner::Auto`] is over ranks, where the program has it.
const DISTRIBUTED_SOLVER: &str = "gamg";

/// Vertices up to which a factor costs little: [`FactorPrecision::Auto`] is double precision, and it is
/// renewed often.
pub(super) const SMALL_SHEET: usize = 6000;

/// Vertices beyond which [`Preconditioner::Auto`] is multigrid. On the smoothly grown disc of the
/// scaling bench it is faster at every size, by a third at 30 000; on a sheet that crumples (race A, noise 1)
/// the factor is faster, and finds a lower minimum. It is kept where it is affordable.
pub(super) const LARGE_SHEET: usize = 50_000;

/// The same under drag, where minima are near and their softest waves supported: multigrid takes as many iterations
/// as the factor there, at less cost (`docs/notebook/performance.md`).
const LARGE_UNDER_DRAG: usize = 1000;

/// The preconditioner of one relaxation.
pub(super) struct HessianInverse {
    sparse: BaseInverse,
    low_rank: LowRankUpdate,
    reduction: Reduction,
    meters: Linear,
}

enum BaseInverse {
    Solver(Box<dyn LinearSolver>),
    /// Inverses of the blocks on the diagonal, and a number for all that is learnt from steps.
    Blocks(Vec<Block>, f64),
}

impl BaseInverse {
    /// Solves over all ranks: by the solver's own means, or else as additive Schwarz method, the sum of the solutions on
    /// the overlapping parts of the sheet.
    fn solve_over(&mut self, reduction: &Reduction, rhs: &mut [Vec3]) {
        if self.is_local() {
            reduction.update_ghosts(rhs);
            self.solve(rhs);
            reduction.add_ghosts_to_owners(rhs);
        } else {
            self.solve(rhs);
        }
        reduction.update_ghosts(rhs);
    }

    /// Whether it solves for the part of this rank by itself.
    fn is_local(&self) -> bool {
        matches!(self, Self::Solver(solver) if !solver.is_distributed())
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        match self {
            Self::Solver(solver) => solver.solve(rhs),
            Self::Blocks(inverses, scale) => {
                parallel::update(rhs, |i, v| *v = *scale * (inverses[i] * *v));
            }
        }
    }
}

impl HessianInverse {
    /// Prepares what depends on the pattern only.
    pub(super) fn new(
        kind: Preconditioner,
        precision: FactorPrecision,
        pattern: &Arc<BlockPattern>,
        mechanics: &Mechanics,
    ) -> Result<Self, SolveError> {
        let reduction = mechanics.sheet().reduction().clone();
        let meters = Linear::from_tally(mechanics.tally());
        let _scope = meters.factors.uncounted_scope();
        let rows = pattern.rows();
        let vertices = whole(reduction.count(rows));
        let sparse = match kind.for_sheet(vertices, false) {
            Preconditioner::Blocks => BaseInverse::Blocks(vec![Block::zeros(); rows], 1.0),
            kind => BaseInverse::Solver(PeriodicSolver::boxed(pattern, |pattern| {
                kind.solver(precision.is_double(vertices), pattern)
            })?),
        };
        Ok(Self { sparse, low_rank: LowRankUpdate::default(), reduction, meters })
    }

    /// Takes over `matrix` and the `terms` of low rank, the Hessian or its positive part at `x`; with
    /// `insist` at some expense rather than fail.
    pub(super) fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        terms: Vec<RankOneTerm>,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        let Self { sparse, low_rank, reduction, meters } = self;
        let _scope = meters.factorise();
        match sparse {
            BaseInverse::Solver(solver) => {
                let made = solver.factorise(matrix, x, insist);
                if !reduction.all(made.is_ok()) {
                    return Err(NotPositive);
                }
            }
            BaseInverse::Blocks(inverses, scale) => {
                *scale = 1.0;
                let unit = matrix.mean_diagonal();
                parallel::update(inverses, |i, inverse| *inverse = inverted(matrix, i, unit));
            }
        }
        let solve = |rhs: &mut [Vec3]| sparse.solve_over(reduction, rhs);
        *low_rank = LowRankUpdate::new(terms, reduction, solve);
        if low_rank.is_positive() { Ok(()) } else { Err(NotPositive) }
    }

    /// Whether vertices are taken for themselves, which makes the whole Hessian no better than its positive
    /// part, and their size is learnt from steps.
    pub(super) fn is_vertexwise(&self) -> bool {
        matches!(self.sparse, BaseInverse::Blocks(..))
    }

    /// Whether it is the sum of solutions on the parts of the ranks, for which what is outermost in each is fixed.
    pub(super) fn is_additive(&self) -> bool {
        self.has_ghosts() && self.sparse.is_local()
    }

    /// Whether it assumes positive definite matrices and gives no descent direction with others.
    pub(super) fn assumes_positive_definite(&self) -> bool {
        matches!(&self.sparse, BaseInverse::Solver(solver)
            if solver.is_distributed() && !solver.detects_indefinite())
    }

    /// Whether the sheet has ghosts: it is spread over ranks, or periodic.
    pub(super) fn has_ghosts(&self) -> bool {
        self.reduction.distribution().is_some()
    }

    /// Whether it detects an indefinite matrix, of the whole sheet.
    pub(super) fn detects_indefinite(&self) -> bool {
        matches!(&self.sparse, BaseInverse::Solver(solver)
            if solver.detects_indefinite() && (solver.is_distributed() || !self.has_ghosts()))
    }

    /// Whether it reads the shape.
    pub(super) fn reads_shape(&self) -> bool {
        matches!(&self.sparse, BaseInverse::Solver(solver) if solver.reads_shape())
    }

    /// Learns from the step from one shape to the next and the change of its gradient, each as (before,
    /// after). Of blocks M it is their size, `s·y / y·M⁻¹y` (Nocedal & Wright, equation 7.20).
    pub(super) fn learn(&mut self, x: (&[Vec3], &[Vec3]), gradient: (&[Vec3], &[Vec3])) {
        match &mut self.sparse {
            BaseInverse::Solver(_) => {}
            BaseInverse::Blocks(inverses, scale) => {
                let change = |i: usize| gradient.1[i] - gradient.0[i];
                let all = inverses.len();
                let along = self.reduction.sum(all, |i| (x.1[i] - x.0[i]).dot(&change(i)));
                let through =
                    self.reduction.sum(all, |i| change(i).dot(&(inverses[i] * change(i))));
                let size = along / through;
                if size > 0.0 && size.is_finite() {
                    *scale = size;
                }
            }
        }
    }

    /// Replaces `rhs` by the solution, or nearly.
    pub(super) fn solve(&mut self, rhs: &mut [Vec3]) {
        let _scope = self.meters.solve();
        self.sparse.solve_over(&self.reduction, rhs);
        self.low_rank.correct(rhs);
    }
}

/// What a [`HessianInverse`] has learnt besides the matrix that it is made of.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Learnt {
    /// The memory of a solver.
    Solver(Record),
    /// The size of blocks.
    Scale(f64),
}

impl HessianInverse {
    /// What it has learnt.
    pub(super) fn learnt(&self) -> Learnt {
        match &self.sparse {
            BaseInverse::Solver(solver) => Learnt::Solver(solver.memory()),
            BaseInverse::Blocks(_, scale) => Learnt::Scale(*scale),
        }
    }

    /// The terms of low rank.
    pub(super) fn terms(&self) -> &[RankOneTerm] {
        self.low_rank.terms()
    }

    /// Takes over what one of the same kind has learnt: a solver before the matrix, others after it.
    pub(super) fn restore(&mut self, learnt: Learnt) -> Result<(), Malformed> {
        match (&mut self.sparse, learnt) {
            (BaseInverse::Solver(solver), Learnt::Solver(memory)) => solver.restore(&memory)?,
            (BaseInverse::Blocks(_, own), Learnt::Scale(scale)) => *own = scale,
            _ => return Err(Malformed),
        }
        Ok(())
    }
}

/// The inverse of block `i` on the diagonal of `matrix`; that of `unit` where it is not positive.
fn inverted(matrix: &BlockMatrix, i: usize, unit: f64) -> Block {
    let mut block = matrix.diagonal(i);
    if matrix.pattern().is_planar() {
        block[(2, 2)] = unit;
    }
    let inverse = block.cholesky().map(|factor| factor.inverse());
    inverse.unwrap_or_else(|| Block::from_diagonal_element(1.0 / unit))
}
