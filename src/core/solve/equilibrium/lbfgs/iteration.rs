//! The iteration of one relaxation: direction, step length, and when it ends.

use super::super::preconditioner::SMALL_SHEET;
use super::super::stop::{FORCE_FLOOR, iterated, reached, same_energy};
use super::super::{Goal, Relaxation, TrustRegion};
use super::progress::{Outcome, Progress};
use super::{Collapse, DIAGONAL_SHIFT, Gauge, Lbfgs, MAX_SHIFT, NEARLY_AT_REST};
use crate::model::{Anchor, Potential};
use crate::num::checked::AtLeast;
use crate::num::real;
use crate::reduction::Reduction;
use crate::solve::SolveError;
use crate::solve::diagnosis::COLLAPSED;
use crate::solve::equilibrium::lbfgs::REFRESH_INTERVALS;
use crate::{Vec3, parallel};

/// The same for a plain metric. On Model I, loosely relaxed, 30 needed a seventh less iterations than 100.
const PLAIN_REFRESH_INTERVAL: usize = 30;
/// Sufficient decrease.
const ARMIJO: f64 = 1e-4;
/// Halvings of a step that the energy asked for, on average between two factorisations, from which on the
/// metric is too soft: the shift grows.
const SOFT_METRIC_HALVINGS: usize = 3;
/// A factor made for weights of an anchor that differ by less than this serves. Not the factor by which steps
/// grow: there the last digit would decide.
const WEIGHT_RATIO_TOLERANCE: f64 = 2.5;
/// Weights below this, in units of the stretching stiffness, are as good as none: a quasi-static step has minimisations with
/// a weight and one without.
const NEGLIGIBLE_WEIGHT: f64 = 1e-5;
/// Most iterations at forces below the tolerance, where displacements are bounded as well: a floppy sheet has modes
/// without stiffness.
const MAX_AT_REST_ITERATIONS: usize = 50;
/// A relaxation leaves its trust region where this allows less than such a share of a step.
const BLOCKED_STEP_SHARE: f64 = 0.02;
/// Falls of the energy below this share of it count as none where a triangle has collapsed.
const NEGLIGIBLE_FALL: f64 = 1e-6;
/// Iterations after which an iteration that may turn triangles over is taken to go around the kink of one.
const KINK_ITERATIONS: usize = 25;
/// Shortest step tried, as a share of the proposed one.
const MIN_STEP_SHARE: f64 = 1e-8;

/// What stays the same during one relaxation.
struct Rules {
    /// Whether triangles may turn over, and below which quality.
    turns: bool,
    flat: f64,
    /// Largest move of a vertex in one step.
    longest: f64,
    /// Least weight of the proximal term, and the distance to its minimum that counts as rest.
    weight: f64,
    slack: f64,
}

/// The iterate, with room for a trial step.
struct Iterate {
    done: Relaxation,
    energy: f64,
    gradient: Vec<Vec3>,
    d: Vec<Vec3>,
    trial: Vec<Vec3>,
    trial_gradient: Vec<Vec3>,
    /// Iterations since the factor was made. One kept from an earlier relaxation is not fresh: if no step is found with
    /// it, it is renewed before giving up.
    age: usize,
    /// Halvings of steps since then.
    halvings: usize,
    /// Iterations with forces below the tolerance.
    rested: usize,
    /// Whether the factor has the largest shift there is.
    stiffest: bool,
}

impl Iterate {
    fn new(gradient: Vec<Vec3>, energy: f64) -> Self {
        let none = vec![Vec3::zeros(); gradient.len()];
        Self {
            done: Relaxation::default(),
            energy,
            d: Vec::with_capacity(gradient.len()),
            trial: none.clone(),
            trial_gradient: none,
            gradient,
            age: 1,
            halvings: 0,
            rested: 0,
            stiffest: false,
        }
    }

    /// Whether forces are below the tolerance and nothing more is asked for.
    fn is_at_rest(&mut self, balanced: bool, goal: &Goal<'_>) -> bool {
        self.rested += usize::from(balanced);
        let exact = self.rested > MAX_AT_REST_ITERATIONS
            || self.done.residual <= FORCE_FLOOR * goal.tolerance
            || self.done.iterations >= goal.max_iterations;
        balanced && (exact || goal.distance_tolerance == f64::INFINITY)
    }

    /// Whether the energy `e` is lower by more than round-off.
    fn falls_to(&self, e: f64) -> bool {
        e < self.energy - NEGLIGIBLE_FALL * self.energy.abs()
    }

    /// Takes over residual and energy of the iterate.
    fn report(&mut self, potential: &Potential) {
        self.done.residual = potential.residual(&self.gradient);
        self.done.energy = self.energy;
    }
}

impl Lbfgs {
    /// Iterates from `x` until it is in equilibrium, or stagnates over as many iterations as `patience` has.
    ///
    /// # Errors
    /// As for [`Equilibrium::relax`](super::super::Equilibrium::relax).
    pub(super) fn iterate(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
        patience: usize,
    ) -> Result<(Relaxation, Outcome), SolveError> {
        let (mut at, rules, mut progress) = self.start(potential, x, patience);
        loop {
            at.report(potential);
            let balanced = reached(potential, &at.done, goal, x)?;
            if at.is_at_rest(balanced, goal) {
                return Ok((at.done, Outcome::AtRest));
            }
            if progress.is_poor(&at.done) {
                if let Some(outcome) = self.outcome_of_poor_progress(balanced) {
                    return Ok((at.done, outcome));
                }
                // Around the kink of a flat triangle an iteration does not converge.
                if self.collapses(potential, x, &mut at)? {
                    continue;
                }
            }
            if !self.factor.ready || at.age >= self.factor.refresh {
                self.renew(potential, x, goal, (&rules, &mut at))?;
            }
            let slope = self.descent_direction(potential.reduction(), &mut at);
            let far_off = potential.reduction().largest(&at.d);
            if balanced && far_off <= goal.distance_tolerance {
                return Ok((at.done, Outcome::AtRest));
            }
            // The step is taken all the same: what is left then is far less.
            let last = far_off <= rules.slack;
            let direction = (&at.d[..], (rules.longest / far_off).min(1.0));
            let Some(length) = within(potential.reduction(), goal.trust, x, direction) else {
                // Forces as small as this tell no direction.
                let at_rest = balanced.then_some((at.done, Outcome::AtRest));
                return at_rest.ok_or(SolveError::Departed);
            };
            let accepted =
                self.search_line(potential, x, goal, (&rules, &mut at), (slope, length))?;
            if (last || balanced) && accepted.is_none() {
                return Ok((at.done, Outcome::AtRest));
            }
            let far = at.done.residual > 10.0 * goal.tolerance && !rules.turns;
            let stagnates = !accepted.is_some_and(|e| !far || at.falls_to(e));
            match accepted {
                _ if stagnates && self.collapses(potential, x, &mut at)? => {}
                None if self.is_exhausted(&at) => return Ok((at.done, Outcome::NoStep)),
                None => {}
                Some(e) => {
                    self.accept(potential, x, &mut at, e);
                    if last {
                        at.report(potential);
                        return Ok((at.done, Outcome::AtRest));
                    }
                }
            }
        }
    }

    /// The iterate at `x`, the rules of the energy there, and the progress from there.
    fn start(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        patience: usize,
    ) -> (Iterate, Rules, Progress) {
        self.fixed.clear();
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let energy = self.evaluate(potential, x, &mut gradient);
        let at = Iterate::new(gradient, energy);
        let rules = self.begin(potential);
        let kinks = rules.turns && self.inverse.is_vertexwise();
        let patience = if kinks { patience.min(KINK_ITERATIONS) } else { patience };
        let progress = Progress::new(energy, potential.residual(&at.gradient), patience);
        (at, rules, progress)
    }

    /// The outcome of an iteration that makes poor progress; none where it continues all the same.
    fn outcome_of_poor_progress(&self, balanced: bool) -> Option<Outcome> {
        let poor = self.may_hand_over().then_some(Outcome::Poor);
        balanced.then_some(Outcome::AtRest).or(poor)
    }

    /// Whether nothing is left to try after a search along a line without a step; otherwise the factor is to be renewed, a
    /// fresh one stiffer.
    fn is_exhausted(&mut self, at: &Iterate) -> bool {
        if at.age == 0 && at.stiffest {
            return true;
        }
        if at.age == 0 {
            self.stiffen();
        }
        self.factor.ready = false;
        false
    }

    /// Prepares for the energy of `potential`: whether the factor that there is serves it.
    fn begin(&mut self, potential: &Potential) -> Rules {
        let turns = self.options.collapse == Some(Collapse::Turn);
        let least = |anchor: &Anchor| anchor.weights.least(potential.reduction());
        let anchor = potential.anchor().map(|anchor| (least(anchor), anchor.slack));
        let (weight, slack) = anchor.unwrap_or_default();
        // Under drag the energy is convex where steps are short, and its minimum near.
        self.try_full_below = if anchor.is_some() { f64::INFINITY } else { NEARLY_AT_REST };
        let unit = potential.force_scale() / potential.metric().mean_edge();
        let floor = NEGLIGIBLE_WEIGHT * unit;
        self.supported = weight > floor;
        let ratio = (weight + floor) / (self.factor.weight + floor);
        let fits = weight == self.factor.weight || ratio.ln().abs() <= WEIGHT_RATIO_TOLERANCE.ln();
        self.factor.ready &= fits;
        // Pairs from another rest metric would mix two energies.
        self.history.clear();
        Rules {
            turns,
            flat: if turns { COLLAPSED } else { 0.0 },
            longest: self.options.largest_move.get() * potential.metric().mean_edge(),
            weight,
            slack,
        }
    }

    /// Renews the factor, and says how long it is kept.
    fn renew(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        goal: &Goal<'_>,
        (rules, at): (&Rules, &mut Iterate),
    ) -> Result<(), SolveError> {
        if at.age > 0 && at.halvings > SOFT_METRIC_HALVINGS * at.age {
            self.stiffen();
        }
        self.complete_snapshot();
        self.gauge = Gauge::for_relaxation(potential, x, &at.gradient, goal);
        self.refactor(potential, x, at.done.residual)?;
        self.factor.weight = rules.weight;
        at.stiffest = self.factor.shift >= MAX_SHIFT;
        self.factor.shift = (0.1 * self.factor.shift).max(DIAGONAL_SHIFT);
        let small = potential.reduction().count(x.len()) <= real(SMALL_SHEET);
        let far = small && at.done.residual > NEARLY_AT_REST;
        let usual = match (self.inverse.is_vertexwise(), far) {
            (true, _) => PLAIN_REFRESH_INTERVAL,
            (false, true) => REFRESH_INTERVALS.0,
            (false, false) => REFRESH_INTERVALS.1,
        };
        self.factor.refresh = self.options.refresh.map_or(usual, AtLeast::get);
        (at.halvings, at.age) = (0, 0);
        Ok(())
    }

    /// A direction in which the energy falls, with its slope.
    fn descent_direction(&mut self, reduction: &Reduction, at: &mut Iterate) -> f64 {
        self.direction(&at.gradient, &mut at.d);
        let slope = reduction.dot(&at.gradient, &at.d);
        if slope < 0.0 {
            return slope;
        }
        self.history.clear();
        self.direction(&at.gradient, &mut at.d);
        reduction.dot(&at.gradient, &at.d)
    }

    /// The energy at the end of the longest step up to `length` that satisfies the sufficient-decrease condition; none if no such step exists.
    fn search_line(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        goal: &Goal<'_>,
        (rules, at): (&Rules, &mut Iterate),
        (slope, mut length): (f64, f64),
    ) -> Result<Option<f64>, SolveError> {
        let share = self.options.area_share.get();
        if potential.mechanics().limits_steps() {
            let whole: Vec<Vec3> = at.d.iter().map(|d| length * d).collect();
            length *= potential.largest_step(x, &whole);
        }
        let whole_step = length;
        loop {
            // The iteration has asked before the first trial.
            if length < whole_step && (goal.interrupted)() {
                return Err(SolveError::Interrupted);
            }
            if length < MIN_STEP_SHARE || !length.is_finite() {
                return Ok(None);
            }
            let d = &at.d;
            parallel::fill(&mut at.trial, |i| x[i] + length * d[i]);
            if potential.keeps_triangles(x, &at.trial, share, rules.flat) {
                let e = self.evaluate(potential, &at.trial, &mut at.trial_gradient);
                let descends = e <= at.energy + ARMIJO * length * slope;
                // At round-off the slopes tell: still downhill, or not far uphill, at the end.
                let level = same_energy(potential, at.energy, e)
                    && potential.reduction().dot(&at.trial_gradient, &at.d) <= 0.9 * slope.abs();
                if e.is_finite() && (descends || level) {
                    return Ok(Some(e));
                }
                at.halvings += 1;
            }
            length *= 0.5;
        }
    }

    /// Whether triangles have collapsed, which are then held.
    fn collapses(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        at: &mut Iterate,
    ) -> Result<bool, SolveError> {
        if potential.reduction().distribution().is_some() {
            // Which triangle collapses is not agreed on between ranks.
            return Ok(false);
        }
        let collapses = self.handle_collapsed(potential, x, &at.gradient, &mut at.done)?;
        if collapses {
            at.energy = self.evaluate(potential, x, &mut at.gradient);
        }
        Ok(collapses)
    }

    /// Takes the trial step, to the energy `e`, and learns from it.
    fn accept(&mut self, potential: &Potential, x: &mut [Vec3], at: &mut Iterate, e: f64) {
        self.history.remember((x, &at.trial), (&at.gradient, &at.trial_gradient));
        if self.inverse.is_vertexwise() {
            self.inverse.learn((x, &at.trial), (&at.gradient, &at.trial_gradient));
        }
        x.copy_from_slice(&at.trial);
        std::mem::swap(&mut at.gradient, &mut at.trial_gradient);
        at.energy = e;
        iterated(&mut at.done, potential);
        at.age += 1;
    }
}

/// The length of a step `d` from `x`, up to `most`, within the trust region; none where that is left.
fn within(
    reduction: &Reduction,
    trust: Option<TrustRegion<'_>>,
    x: &[Vec3],
    (d, most): (&[Vec3], f64),
) -> Option<f64> {
    let Some(trust) = trust else { return Some(most) };
    let within = trust.longest(x, d, most, reduction);
    (!(within < BLOCKED_STEP_SHARE * most)).then_some(within)
}
