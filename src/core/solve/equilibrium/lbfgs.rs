//! Limited-memory BFGS preconditioned with a Cholesky factor of the Hessian's positive part, or with
//! multigrid.
//!
//! The factor carries the stiff directions (stretching, short bending waves), the memory learns
//! what the positive part leaves out (compressive geometric stiffness). The factor is kept while it
//! serves, across calls too. Rigid motions are fixed by a gauge. Where the metric turns out too soft it is
//! stiffened, and where the iteration gets nowhere Newton's method has a turn (`turns`). Steps are limited so that no
//! triangle collapses: the energy of the cotangent curvature jumps there, and a long memory would not
//! survive it.
//!
//! References: Nocedal & Wright, Numerical Optimization (2006), algorithm 7.4; approximate descent
//! test near round-off after Hager & Zhang, SIAM J. Optim. 16 (2005), doi:10.1137/030601880.

mod collapse;
mod newton_fallback;
mod progress;
mod rollback;
mod spec;
mod stored;

use std::sync::Arc;

pub use spec::{Collapse, LbfgsSpec};

use progress::{Outcome, Progress};
use rollback::Mark;
use stored::Made;

use super::super::counters::Linear;
use super::gauge::Gauge;
use super::history::History;
use super::preconditioner::{Inverse, LARGE, Preconditioner, SMALL};
use super::stop::{COLLAPSED, FLOOR, dot, iterated, largest, level, reached};
use super::{Goal, Relaxation};
use crate::Vec3;
use crate::effects::HessianPart;
use crate::linear::{BlockMatrix, LinearError};
use crate::model::{Mechanics, Potential};
use crate::num::checked::AtLeast;
use crate::parallel;
use crate::solve::SolveError;

/// Diagonal shift relative to the mean diagonal, for directions without any stiffness; small against the
/// softest bending of the sheets in use. Rigid motions have the gauge.
const SHIFT: f64 = 1e-9;
/// The whole Hessian is tried once the residual is below this; after a failure, below a tenth of
/// the residual then.
const NEARLY_AT_REST: f64 = 1e-2;
/// Iterations between two factorisations of small sheets far from rest, and otherwise. Over many
/// iterations with one factor far from rest, differences in the last digit grow to other minima
/// (`docs/notebook/sensitivity.md`); a fresh one every five needs fewer iterations and no more time where a
/// factor is cheap. Near rest it is the memory that finds what is soft, and a fresh factor empties it.
const REFRESH: (usize, usize) = (5, 15);
/// The same for a plain metric, by whether it is learnt from steps alone, which a start from nothing costs some
/// steps. On Model I, loosely relaxed, 30 needed a seventh less iterations than 100 with blocks.
const REFRESH_PLAIN: (usize, usize) = (30, 100);
/// Sufficient decrease.
const ARMIJO: f64 = 1e-4;
/// Shift after a fresh factor gave no step, and by how much it grows from then on. Directions in
/// which the positive part has no stiffness (waves of a free boundary) are why it may be needed.
const MORE_SHIFT: (f64, f64) = (1e-6, 100.0);
/// A shift that was this large and gave no step is not enlarged any more.
const MOST_SHIFT: f64 = 1.0;
/// Halvings of a step that the energy asked for, on average between two factorisations, from which on the
/// metric is too soft: the shift grows.
const SOFT: usize = 3;
/// A factor made for weights of an anchor that differ by less than this serves. Not the factor by which steps
/// grow: there the last digit would decide.
const OTHER_WEIGHT: f64 = 2.5;
/// Weights below this, in units of the stretching stiffness, are as good as none where a path is followed, by one
/// minimisation with a weight and one without in turn.
const NO_WEIGHT: f64 = 1e-5;
/// Most iterations at forces below the tolerance, where displacements are bounded as well: a floppy sheet has modes
/// without stiffness.
const AT_REST: usize = 50;
/// A relaxation leaves its trust region where this allows less than such a share of a step.
const LEAVES: f64 = 0.02;
/// Falls of the energy below this share of it count as none where a triangle has collapsed.
const NO_FALL: f64 = 1e-6;
/// Iterations after which an iteration that may turn triangles over is taken to go around the kink of one.
const KINK: usize = 25;
/// Shortest step tried, as a share of the proposed one.
const SHORTEST: f64 = 1e-8;

/// Preconditioned L-BFGS for one sheet.
pub struct Lbfgs {
    options: LbfgsSpec,
    matrix: BlockMatrix,
    /// Of the preconditioner.
    kind: Preconditioner,
    inverse: Inverse,
    /// Belongs to the factor.
    gauge: Gauge,
    factored: bool,
    made: Made,
    /// Whether the pattern has pairs that are coupled at the moment.
    of_the_moment: bool,
    /// Least weight of the anchor that the factor was made with.
    weight: f64,
    /// Whether drag supports the softest waves.
    supported: bool,
    /// Iterations after which the factor is renewed.
    refresh: usize,
    shift: f64,
    try_full_below: f64,
    history: History,
    /// Vertices of collapsed triangles, fixed.
    fixed: Vec<usize>,
    mark: Option<Mark>,
}

impl Lbfgs {
    /// Prepares the sparse factorisation for the effects of `mechanics`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub fn new(mechanics: &Mechanics, options: LbfgsSpec) -> Result<Self, SolveError> {
        let scope = Linear::of(mechanics.tally()).matrix.kept();
        let pattern = Arc::clone(mechanics.pattern());
        let matrix = BlockMatrix::zeros(Arc::clone(&pattern));
        drop(scope);
        let kind = options.preconditioner.on(pattern.rows(), false);
        Ok(Self {
            options,
            matrix,
            kind,
            inverse: Inverse::new(kind, options.precision, &pattern, mechanics.tally())?,
            gauge: Gauge::default(),
            factored: false,
            made: Made::default(),
            of_the_moment: false,
            weight: 0.0,
            supported: false,
            refresh: REFRESH.1,
            shift: SHIFT,
            try_full_below: NEARLY_AT_REST,
            history: History::new(mechanics.is_planar(), options.memory.get()),
            fixed: Vec::new(),
            mark: None,
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
        let weight = potential.anchor().map_or(0.0, |anchor| anchor.weights.least());
        let unit = potential.force_scale() / potential.metric().mean_edge() + weight;
        // What has been learnt is forgotten only where no step was found with it.
        if (self.factored && self.inverse.is_learnt()) || self.inverse.begins_with(unit) {
            self.factored = true;
            self.history.clear();
            return Ok(());
        }
        self.factored = false;
        for part in [HessianPart::Full, HessianPart::Positive] {
            let plain = self.inverse.is_plain();
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
        self.matrix.add_diagonal(self.shift * unit);
        self.factored = self.inverse.factorise(&self.matrix, terms, x, insist).is_ok();
        if self.factored {
            let x = if self.inverse.reads_shape() { x } else { &[] };
            self.made = Made { x: x.to_vec(), insist };
            self.history.clear();
        }
        Ok(self.factored)
    }

    /// Whether the whole Hessian at `x` is positive besides free rigid motions, where a factor can tell; it
    /// serves the next relaxation.
    fn factorise_whole(&mut self, potential: &mut Potential, x: &[Vec3]) -> Option<bool> {
        self.keep_marked();
        self.supported = false;
        self.fit(potential, x).ok()?;
        if !self.inverse.detects_indefinite() {
            return None;
        }
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        self.gauge = Gauge::new(potential, x, &gradient, self.options.tolerance.get());
        (self.factored, self.shift, self.weight) = (false, SHIFT, 0.0);
        self.factorise(potential, x, HessianPart::Full, false).ok()
    }

    /// Makes room for what is coupled at `x`, and the preconditioner that suits it.
    fn fit(&mut self, potential: &mut Potential, x: &[Vec3]) -> Result<(), SolveError> {
        let pattern = potential.pattern(x);
        let LbfgsSpec { preconditioner, precision, .. } = self.options;
        let kind = preconditioner.on(pattern.rows(), self.supported);
        let other = pattern != *self.matrix.pattern();
        if other || kind != self.kind {
            let tally = potential.mechanics().tally();
            let _scope = Linear::of(tally).factors.kept();
            self.inverse = Inverse::new(kind, precision, &pattern, tally)?;
            self.kind = kind;
            self.factored = false;
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
        self.shift = (self.shift * MORE_SHIFT.1).clamp(MORE_SHIFT.0, MOST_SHIFT);
    }

    /// Whether Newton's method can take over: its factor is affordable and wanted, and it holds no vertices.
    fn may_hand_over(&self) -> bool {
        let affordable = self.matrix.pattern().rows() <= LARGE && !self.inverse.is_plain();
        self.fixed.is_empty() && affordable
    }

    fn iterate(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
        patience: usize,
    ) -> Result<(Relaxation, Outcome), SolveError> {
        let n = x.len();
        let small = n <= SMALL;
        let mut done = Relaxation::default();
        let mut gradient = vec![Vec3::zeros(); n];
        self.fixed.clear();
        let mut energy = self.evaluate(potential, x, &mut gradient);
        let (mut d, mut trial, mut trial_gradient) =
            (Vec::with_capacity(n), vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
        let turns = self.options.collapse == Some(Collapse::Turn);
        let flat = if turns { COLLAPSED } else { 0.0 };
        let longest = self.options.largest_move.get() * potential.metric().mean_edge();
        // A factor kept from an earlier relaxation is not fresh: if no step is found with it, it is
        // renewed before giving up.
        let mut age = 1;
        let mut halvings = 0;
        // Iterations with forces below the tolerance.
        let mut rested = 0;
        // Whether the factor has the largest shift there is.
        let mut stiffest = false;
        let kinks = turns && self.inverse.is_plain();
        let patience = if kinks { patience.min(KINK) } else { patience };
        let mut progress = Progress::new(energy, potential.residual(&gradient), patience);
        let anchor = potential.anchor().map(|anchor| (anchor.weights.least(), anchor.slack));
        let (weight, slack) = anchor.unwrap_or_default();
        // Under drag the energy is convex where steps are short, and its minimum near.
        self.try_full_below = if anchor.is_some() { f64::INFINITY } else { NEARLY_AT_REST };
        self.supported = anchor.is_some() && goal.trust.is_none();
        let unit = potential.force_scale() / potential.metric().mean_edge();
        let floor = if goal.trust.is_some() { NO_WEIGHT * unit } else { 0.0 };
        let ratio = (weight + floor) / (self.weight + floor);
        let fits = weight == self.weight || ratio.ln().abs() <= OTHER_WEIGHT.ln();
        self.factored &= fits;
        // Pairs from another rest metric would mix two energies.
        self.history.clear();
        loop {
            done.residual = potential.residual(&gradient);
            done.energy = energy;
            let balanced = reached(&done, goal, x)?;
            rested += usize::from(balanced);
            let exact = rested > AT_REST
                || done.residual <= FLOOR * goal.tolerance
                || done.iterations >= goal.max_iterations;
            if balanced && (exact || goal.displacement == f64::INFINITY) {
                return Ok((done, Outcome::AtRest));
            }
            if progress.is_poor(&done) {
                if balanced {
                    return Ok((done, Outcome::AtRest));
                }
                if self.may_hand_over() {
                    return Ok((done, Outcome::Poor));
                }
                // Around the kink of a flat triangle an iteration goes on without coming to rest.
                if self.collapse(potential, x, &gradient, &mut done)? {
                    energy = self.evaluate(potential, x, &mut gradient);
                    continue;
                }
            }
            if !self.factored || age >= self.refresh {
                if age > 0 && halvings > SOFT * age {
                    self.stiffen();
                }
                self.keep_marked();
                self.gauge = Gauge::new(potential, x, &gradient, goal.tolerance);
                self.refactor(potential, x, done.residual)?;
                self.weight = weight;
                stiffest = self.shift >= MOST_SHIFT || self.inverse.is_learnt();
                self.shift = (0.1 * self.shift).max(SHIFT);
                let far = small && done.residual > NEARLY_AT_REST;
                let usual = match (self.inverse.is_plain(), far) {
                    (true, _) if self.inverse.is_learnt() => REFRESH_PLAIN.1,
                    (true, _) => REFRESH_PLAIN.0,
                    (false, true) => REFRESH.0,
                    (false, false) => REFRESH.1,
                };
                self.refresh = self.options.refresh.map_or(usual, AtLeast::get);
                halvings = 0;
                age = 0;
            }
            self.direction(&gradient, &mut d);
            let mut slope = dot(&gradient, &d);
            if !(slope < 0.0) {
                self.history.clear();
                self.direction(&gradient, &mut d);
                slope = dot(&gradient, &d);
            }
            let far_off = largest(&d);
            if balanced && far_off <= goal.displacement {
                return Ok((done, Outcome::AtRest));
            }
            // The step is taken all the same: what is left then is far less.
            let last = far_off <= slack;
            let mut length = (longest / far_off).min(1.0);
            if let Some(trust) = goal.trust {
                let within = trust.longest(x, &d, length);
                if within < LEAVES * length {
                    // Forces as small as this tell no direction.
                    if balanced {
                        return Ok((done, Outcome::AtRest));
                    }
                    return Err(SolveError::Departed);
                }
                length = within;
            }
            let accepted = loop {
                if (goal.interrupted)() {
                    return Err(SolveError::Interrupted);
                }
                if length < SHORTEST || !length.is_finite() {
                    break None;
                }
                parallel::fill(&mut trial, |i| x[i] + length * d[i]);
                let share = self.options.area_share.get();
                if potential.allows_turning(x, &trial, share, flat) {
                    let e = self.evaluate(potential, &trial, &mut trial_gradient);
                    let descends = e <= energy + ARMIJO * length * slope;
                    // At round-off the slopes tell: still downhill, or not far uphill, at the end.
                    let level = level(potential, energy, e)
                        && dot(&trial_gradient, &d) <= 0.9 * slope.abs();
                    if e.is_finite() && (descends || level) {
                        break Some(e);
                    }
                    halvings += 1;
                }
                length *= 0.5;
            };
            if (last || balanced) && accepted.is_none() {
                return Ok((done, Outcome::AtRest));
            }
            let falls = accepted.is_some_and(|e| e < energy - NO_FALL * energy.abs());
            let far = done.residual > 10.0 * goal.tolerance && !turns;
            if (accepted.is_none() || (far && !falls))
                && self.collapse(potential, x, &gradient, &mut done)?
            {
                energy = self.evaluate(potential, x, &mut gradient);
                continue;
            }
            let Some(e) = accepted else {
                if age == 0 && !stiffest {
                    self.stiffen();
                } else if age == 0 {
                    return Ok((done, Outcome::NoStep));
                }
                self.factored = false;
                continue;
            };
            self.history.remember((x, &trial), (&gradient, &trial_gradient));
            if self.inverse.is_plain() {
                self.inverse.learn((x, &trial), (&gradient, &trial_gradient));
            }
            x.copy_from_slice(&trial);
            std::mem::swap(&mut gradient, &mut trial_gradient);
            energy = e;
            iterated(&mut done, potential);
            age += 1;
            if last {
                done.residual = potential.residual(&gradient);
                done.energy = energy;
                return Ok((done, Outcome::AtRest));
            }
        }
    }
}
