//! Multigrid by smoothed aggregation: an approximate inverse whose memory grows with the sheet as
//! the matrix itself does.
//!
//! ```text
//! z ← q(D⁻¹A) D⁻¹ r                     Chebyshev polynomial q: the rough part
//! z ← z + P A_c⁻¹ Pᵀ (r - A z)          the smooth part, on the coarse level by the same cycle
//! z ← z + q(D⁻¹A) D⁻¹ (r - A z)         the rough part again, which makes the cycle symmetric
//! ```
//!
//! A coarse level has three unknowns for every three of the motions that cost little: an aggregate of a
//! sheet in space becomes two nodes, one of a sheet that moves in a plane becomes one.
//!
//! The coarsest matrix is factorised. The cycle is positive definite if that matrix is, whatever A:
//! with s(λ) = 1 - λ q(λ) it is (1 - s²)/λ + s P A_c⁻¹ Pᵀ s, and the first term is positive up to the
//! largest eigenvalue, for negative λ too.
//!
//! Sources: Vaněk, Mandel & Brezina, Computing 56 (1996) 179, doi:10.1007/BF02238511; Chebyshev
//! smoothers: Adams, Brezina, Hu & Tuminaro, J. Comput. Phys. 188 (2003) 593,
//! doi:10.1016/S0021-9991(03)00194-3.

use std::sync::Arc;

use super::LinearError;
use super::prolongator::{Motions, Prolongator};
use super::symmetric_rows::{FullRowPattern, SinglePrecisionRows};
use super::{Block, BlockCholesky, BlockMatrix, BlockPattern, NotPositive};
use crate::Vec3;
use crate::num::real;
use crate::parallel;

/// Degree of the smoother: products with A on either side of the coarse level.
const DEGREE: usize = 2;
/// The smoother acts on eigenvalues of D⁻¹A down to this share of the largest.
const SMOOTHED_SHARE: f64 = 1.0 / 15.0;
/// Steps of the power iteration, and what its result is multiplied by: it comes from below, and the
/// smoother must not meet an eigenvalue beyond its bound.
const POWER_ITERATION: (usize, f64) = (20, 1.2);
/// Nodes of a level that is factorised rather than made coarser. A third level more than doubles the
/// number of iterations; with two a million vertices take 2.7 GiB, the coarse factor included.
const MAX_COARSEST_NODES: usize = 120_000;
/// Cycles on each level below the finest.
const COARSE_CYCLES: usize = 3;
/// A matrix that must be positive gets a growing shift, relative to its mean diagonal: first, factor,
/// last.
const SHIFT_SCHEDULE: (f64, f64, f64) = (1e-9, 100.0, 1e-3);

/// One level above the coarsest; an aggregate has M motions, which become N = M/3 nodes.
struct Level<const N: usize, const M: usize> {
    rows: FullRowPattern,
    single: SinglePrecisionRows,
    /// D⁻¹.
    inverse: Vec<Block>,
    /// Largest eigenvalue of D⁻¹A, or a little more.
    largest: f64,
    prolongator: Prolongator<N, M>,
    coarse: BlockMatrix,
    solution: Vec<Vec3>,
    step: Vec<Vec3>,
    coarse_vector: Vec<[Vec3; N]>,
}

impl<const N: usize, const M: usize> Level<N, M> {
    fn new(pattern: &BlockPattern) -> Self {
        let rows = FullRowPattern::new(pattern);
        let prolongator = Prolongator::new(&rows);
        let n = rows.len();
        Self {
            single: SinglePrecisionRows::default(),
            inverse: vec![Block::zeros(); n],
            largest: 0.0,
            coarse: BlockMatrix::zeros(Arc::new(prolongator.coarse_pattern())),
            solution: vec![Vec3::zeros(); n],
            step: vec![Vec3::zeros(); n],
            coarse_vector: vec![[Vec3::zeros(); N]; prolongator.aggregates()],
            rows,
            prolongator,
        }
    }

    /// Everything for `matrix`; the motions of the coarse level.
    fn load(
        &mut self,
        matrix: &BlockMatrix,
        motions: &mut [Motions<M>],
    ) -> Result<Vec<Motions<M>>, NotPositive> {
        self.single.load(&self.rows, matrix);
        let planar = matrix.pattern().is_planar();
        parallel::fill(&mut self.inverse, |i| {
            let mut block = matrix.diagonal(i);
            if planar {
                // The force on a fixed component is zero.
                block[(2, 2)] = 1.0;
            }
            let cholesky = nalgebra::Cholesky::new(block);
            cholesky.map_or_else(Block::zeros, |c| c.inverse())
        });
        if self.inverse.iter().any(|block| block[(0, 0)] == 0.0) {
            return Err(NotPositive);
        }
        self.largest_eigenvalue();
        if !(self.largest > 0.0 && self.largest.is_finite()) {
            return Err(NotPositive);
        }
        let damping = 4.0 / (3.0 * self.largest);
        let coarse = self.prolongator.smooth(&self.rows, matrix, &self.inverse, damping, motions);
        self.prolongator.coarse_matrix(&self.rows, matrix, &mut self.coarse);
        Ok(coarse)
    }

    fn bytes(&self) -> usize {
        let nodes = self.inverse.len() * (size_of::<Block>() + 2 * size_of::<Vec3>());
        nodes
            + self.coarse.bytes()
            + self.rows.bytes()
            + self.single.bytes()
            + self.prolongator.bytes()
    }

    /// Power iteration, always from the same vector: what is found depends on the matrix alone.
    fn largest_eigenvalue(&mut self) {
        let norm = |v: &[Vec3]| parallel::sum(v.len(), |i| v[i].norm_squared()).sqrt();
        // Any vector that is not smooth.
        parallel::fill(&mut self.solution, |i| {
            Vec3::from_fn(|a, _| (2.399_963 * real(3 * i + a)).sin())
        });
        for _ in 0..POWER_ITERATION.0 {
            let (vector, length) = (&self.solution, norm(&self.solution));
            parallel::fill(&mut self.step, |i| {
                self.inverse[i] * self.single.times(&self.rows, i, vector) / length
            });
            std::mem::swap(&mut self.solution, &mut self.step);
        }
        self.largest = POWER_ITERATION.1 * norm(&self.solution);
    }

    /// `residual -= A step`.
    fn subtract(&self, residual: &mut [Vec3]) {
        parallel::update(residual, |i, r| *r -= self.single.times(&self.rows, i, &self.step));
    }

    /// Adds the Chebyshev polynomial of `residual` to the solution; all but its last step is
    /// subtracted from the residual.
    fn smooth(&mut self, residual: &mut [Vec3]) {
        let (low, high) = (SMOOTHED_SHARE * self.largest, self.largest);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let mut ratio = half / middle;
        let inverse = &self.inverse;
        parallel::update(&mut self.step, |i, d| *d = inverse[i] * residual[i] / middle);
        let step = &self.step;
        parallel::update(&mut self.solution, |i, z| *z += step[i]);
        for _ in 1..DEGREE {
            self.subtract(residual);
            let next = (2.0 * middle / half - ratio).recip();
            let inverse = &self.inverse;
            parallel::update(&mut self.step, |i, d| {
                *d = next * ratio * *d + 2.0 * next / half * (inverse[i] * residual[i]);
            });
            let step = &self.step;
            parallel::update(&mut self.solution, |i, z| *z += step[i]);
            ratio = next;
        }
    }
}

/// Hierarchy of levels for matrices of one pattern.
pub struct Multigrid(Kind);

enum Kind {
    Space(Hierarchy<2, 6>),
    Plane(Hierarchy<1, 3>),
}

impl Multigrid {
    /// Aggregates the nodes of `pattern`, level after level, and orders the coarsest.
    ///
    /// # Errors
    /// [`LinearError`] if the coarsest level is too large for a factor.
    pub fn new(pattern: &Arc<BlockPattern>) -> Result<Self, LinearError> {
        Self::with_coarsest(pattern, MAX_COARSEST_NODES)
    }

    /// As [`Multigrid::new`], with levels down to one of at most `coarsest` nodes; two at least.
    ///
    /// # Errors
    /// As [`Multigrid::new`].
    pub fn with_coarsest(
        pattern: &Arc<BlockPattern>,
        coarsest: usize,
    ) -> Result<Self, LinearError> {
        Ok(Self(if pattern.is_planar() {
            Kind::Plane(Hierarchy::new(pattern, coarsest)?)
        } else {
            Kind::Space(Hierarchy::new(pattern, coarsest)?)
        }))
    }

    /// Takes over `matrix`, which must have the pattern this was made for, at the shape `x` whose
    /// rigid motions cost little. With `insist` a coarsest matrix that is not positive is shifted
    /// until it is.
    ///
    /// # Errors
    /// [`NotPositive`] if the coarsest matrix is not positive definite, or a block of a diagonal.
    pub fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        match &mut self.0 {
            Kind::Space(all) => all.factorise(matrix, rigid_motions(x), insist),
            Kind::Plane(all) => all.factorise(matrix, plane_motions(x), insist),
        }
    }

    /// Replaces `rhs` by one cycle's approximation of the solution for the last matrix taken over.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        match &mut self.0 {
            Kind::Space(all) => cycle(&mut all.levels, &mut all.coarsest, rhs, 1),
            Kind::Plane(all) => cycle(&mut all.levels, &mut all.coarsest, rhs, 1),
        }
    }

    /// Bytes of all levels and of the factor of the coarsest.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.0 {
            Kind::Space(all) => all.bytes(),
            Kind::Plane(all) => all.bytes(),
        }
    }
}

struct Hierarchy<const N: usize, const M: usize> {
    levels: Vec<Level<N, M>>,
    coarsest: BlockCholesky,
}

impl<const N: usize, const M: usize> Hierarchy<N, M> {
    fn new(pattern: &Arc<BlockPattern>, coarsest: usize) -> Result<Self, LinearError> {
        let mut pattern = Arc::clone(pattern);
        let mut levels: Vec<Level<N, M>> = Vec::new();
        while levels.is_empty() || pattern.rows() > coarsest {
            let level = Level::new(&pattern);
            // Parts too small to be coarsened would be repeated without end.
            if 3 * level.coarse.pattern().rows() > 2 * pattern.rows() {
                break;
            }
            pattern = Arc::clone(level.coarse.pattern());
            levels.push(level);
        }
        Ok(Self { levels, coarsest: BlockCholesky::new(pattern)? })
    }

    fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        mut motions: Vec<Motions<M>>,
        insist: bool,
    ) -> Result<(), NotPositive> {
        let mut matrix = matrix;
        for level in &mut self.levels {
            motions = level.load(matrix, &mut motions)?;
            matrix = &level.coarse;
        }
        let result = self.coarsest.factorise(matrix);
        if result.is_ok() || !insist {
            return result;
        }
        let mut shifted = matrix.clone();
        let (mut shift, unit) = (SHIFT_SCHEDULE.0, matrix.mean_diagonal());
        while shift <= SHIFT_SCHEDULE.2 {
            shifted.add_diagonal(shift * unit);
            if self.coarsest.factorise(&shifted).is_ok() {
                return Ok(());
            }
            shift *= SHIFT_SCHEDULE.1;
        }
        Err(NotPositive)
    }

    fn bytes(&self) -> usize {
        self.levels.iter().map(Level::bytes).sum::<usize>() + 8 * self.coarsest.factor_size()
    }
}

/// Replaces `residual` by the solution of the finest of `levels`, or what `visits` cycles make of it.
fn cycle<const N: usize, const M: usize>(
    levels: &mut [Level<N, M>],
    coarsest: &mut BlockCholesky,
    residual: &mut [Vec3],
    visits: usize,
) {
    let Some((level, coarser)) = levels.split_first_mut() else {
        coarsest.solve(residual);
        return;
    };
    parallel::update(&mut level.solution, |_, z| *z = Vec3::zeros());
    for visit in 0..visits {
        if visit > 0 {
            level.subtract(residual);
        }
        level.smooth(residual);
        level.subtract(residual);
        level.prolongator.restrict(residual, &mut level.coarse_vector);
        cycle(coarser, coarsest, level.coarse_vector.as_flattened_mut(), COARSE_CYCLES);
        level.prolongator.prolong(&level.coarse_vector, &mut level.step);
        let step = &level.step;
        parallel::update(&mut level.solution, |i, z| *z += step[i]);
        level.subtract(residual);
        level.smooth(residual);
    }
    residual.copy_from_slice(&level.solution);
}

/// Translations, and rotations about the mean position, of every vertex: `[1 | -[r]×/R]`.
fn rigid_motions(x: &[Vec3]) -> Vec<Motions<6>> {
    let centre = x.iter().sum::<Vec3>() / real(x.len().max(1));
    let radius = x.iter().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let mut motions = vec![Motions::<6>::zeros(); x.len()];
    parallel::fill(&mut motions, |i| {
        let mut motion = Motions::<6>::zeros();
        motion.fixed_columns_mut::<3>(0).copy_from(&Block::identity());
        let turn = -((x[i] - centre) / radius).cross_matrix();
        motion.fixed_columns_mut::<3>(3).copy_from(&turn);
        motion
    });
    motions
}

/// Translations in the plane z = const, and the rotation about the mean position.
fn plane_motions(x: &[Vec3]) -> Vec<Motions<3>> {
    let in_plane = |motion: &Motions<6>| Motions::<3>::from_fn(|a, k| motion[(a, [0, 1, 5][k])]);
    rigid_motions(x).iter().map(in_plane).collect()
}
