//! The energy landscape at fixed optimal lengths and time: U(x), or L(x) with constraints; with an
//! anchor what one step under drag makes of it.

mod conditions;
mod constrained;
mod contact;

use std::sync::Arc;

use super::constraint::Constraints;
use super::counters::energy;
use super::error::ModelError;
use super::hold::CorotationalForces;
use super::mechanics::Mechanics;
use super::proximal_term::Anchor;
use crate::effects::{AnyEnergy, HessianPart, Pins, RankOneTerm, Work};
use crate::geometry::{RestMetric, Shape};
use crate::linear::{BlockMatrix, BlockPattern};
use crate::reduction::Reduction;
use crate::sheet::Sheet;
use crate::sheet::quality::triangle_quality;
use crate::tally::Meter;
use crate::{Vec3, parallel};

/// `U(x)` of the sum of all energies under given conditions, with the memory to evaluate it.
pub struct Potential {
    mechanics: Arc<Mechanics>,
    metric: RestMetric,
    time: f64,
    /// Internal variables and what laws give, by name.
    internal: Vec<(&'static str, Vec<f64>)>,
    /// Species that energies read, at the vertices.
    species: Vec<Vec<f64>>,
    /// Whether they have changed since effects were prepared.
    stale: bool,
    work: Vec<Work>,
    pub(super) constraints: Constraints,
    anchor: Option<Anchor>,
    hold: Option<CorotationalForces>,
    force_scale: f64,
    /// Of the optimal lengths.
    lengths: Meter,
}

impl Drop for Potential {
    /// Memory is freed where it is counted.
    fn drop(&mut self) {
        for (work, meter) in self.work.drain(..).zip(self.mechanics.meters()) {
            let _scope = meter.uncounted_scope();
            drop(work);
        }
    }
}

impl Potential {
    /// At Φ = 1 and time 0.
    #[must_use]
    pub fn new(mechanics: &Arc<Mechanics>) -> Self {
        let work = mechanics.terms().iter().map(|_| Work::from(Box::new(()))).collect();
        let lengths = mechanics.tally().meter("geometry", "optimal lengths and areas");
        let (metric, time) = (mechanics.reference().clone(), 0.0);
        let constraints = Constraints::new(mechanics);
        let mechanics = Arc::clone(mechanics);
        let edge = mechanics.reference().mean_edge();
        let scales =
            mechanics.terms().iter().map(|term| term.energy.force_scales(edge).unit_strain);
        let force_scale = scales.fold(0.0, f64::max);
        let force_scale = mechanics.sheet().reduction().largest_over_ranks(force_scale);
        let (anchor, hold) = (None, None);
        let (internal, stale) = (Vec::new(), false);
        let species = mechanics.zero_species();
        let mut made = Self {
            mechanics,
            metric,
            time,
            internal,
            species,
            stale,
            work,
            constraints,
            anchor,
            hold,
            force_scale,
            lengths,
        };
        made.prepare();
        let sheet = Arc::clone(made.sheet());
        made.choose_stiffness(sheet.rest());
        made
    }

    /// Adds the pull towards an earlier shape to U from now on, in place of the one before; conditions
    /// leave it unchanged.
    pub fn set_anchor(&mut self, anchor: Option<Anchor>) {
        self.anchor = anchor;
    }

    /// Takes the pull towards an earlier shape away.
    pub(crate) fn take_anchor(&mut self) -> Option<Anchor> {
        self.anchor.take()
    }

    /// Adds forces that hold the sheet to what acts from now on, in place of those before.
    pub(crate) fn set_hold(&mut self, hold: Option<CorotationalForces>) {
        self.hold = hold;
    }

    /// The pull towards an earlier shape.
    #[must_use]
    pub fn anchor(&self) -> Option<&Anchor> {
        self.anchor.as_ref()
    }

    /// The effects.
    #[must_use]
    pub fn mechanics(&self) -> &Arc<Mechanics> {
        &self.mechanics
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        self.mechanics.sheet()
    }

    /// The fixed directions.
    #[must_use]
    pub fn pins(&self) -> &Pins {
        self.mechanics.pins()
    }

    /// The optimal lengths in force.
    #[must_use]
    pub fn metric(&self) -> &RestMetric {
        &self.metric
    }

    /// Force on a vertex at unit strain: the unit of force tolerances. At least one listed effect
    /// must define it for relaxation to make sense; otherwise it is 0.
    #[must_use]
    pub fn force_scale(&self) -> f64 {
        self.force_scale
    }

    /// The shape `x` under these conditions.
    #[must_use]
    pub fn shape<'a>(&'a self, x: &'a [Vec3]) -> Shape<'a> {
        Shape { sheet: self.mechanics.sheet(), metric: &self.metric, time: self.time, x }
    }

    /// The effects, the constraints and the shape at `x`.
    pub(super) fn constrained<'a>(
        &'a mut self,
        x: &'a [Vec3],
    ) -> (&'a Mechanics, &'a mut Constraints, Shape<'a>) {
        let Self { mechanics, metric, time, constraints, .. } = self;
        let shape = Shape { sheet: mechanics.sheet(), metric, time: *time, x };
        (mechanics, constraints, shape)
    }

    /// Calls `f` with every energy, its memory and the shape at `x`; `what` of [`energy`] is counted, but for
    /// gradients, which may be a part of what is.
    fn each(
        &mut self,
        what: &'static str,
        x: &[Vec3],
        mut f: impl FnMut(usize, &dyn AnyEnergy, &mut Work, &Shape<'_>),
    ) {
        let sheet = self.mechanics.sheet();
        let shape = Shape { sheet, metric: &self.metric, time: self.time, x };
        let meters = self.mechanics.meters();
        self.mechanics.tally().count(|work| match what {
            energy::ENERGY => work.energies += 1,
            energy::HESSIAN => work.hessians += 1,
            _ => {}
        });
        for (k, (term, work)) in self.mechanics.terms().iter().zip(&mut self.work).enumerate() {
            if what == energy::LOW_RANK && !term.coupling().low_rank {
                continue;
            }
            let _scope = meters[k].scope(what);
            f(k, &*term.energy, work, &shape);
        }
    }

    /// Energy of every effect at `x`, by [`Mechanics::names`].
    pub fn energies(&mut self, x: &[Vec3]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.mechanics.terms().len());
        self.each(energy::ENERGY, x, |_, term, work, shape| {
            all.push(term.evaluate(shape, work, None))
        });
        self.reduction().sum_over_ranks(&mut all);
        all
    }

    /// Force `-∂U/∂x` of effect number `which` at `x`, before pins.
    pub fn force_of(&mut self, which: usize, x: &[Vec3]) -> Vec<Vec3> {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let shape =
            Shape { sheet: self.mechanics.sheet(), metric: &self.metric, time: self.time, x };
        if let (Some(term), Some(work)) =
            (self.mechanics.terms().get(which), self.work.get_mut(which))
        {
            let _scope = self.mechanics.meters()[which].scope(energy::GRADIENT);
            term.energy.evaluate(&shape, work, Some(&mut gradient));
        }
        gradient.iter().map(|g| -g).collect()
    }

    /// Force `-∂U/∂x` of all effects and `λ ∂g` of constraints at `x`, before pins: along fixed directions in equilibrium
    /// the negative of the reactions.
    pub fn forces(&mut self, x: &[Vec3]) -> Vec<Vec3> {
        self.mechanics.tally().count(|work| work.gradients += 1);
        let mut gradient = vec![Vec3::zeros(); x.len()];
        self.each(energy::GRADIENT, x, |_, term, work, shape| {
            term.evaluate(shape, work, Some(&mut gradient));
        });
        let mut forces: Vec<Vec3> = gradient.iter().map(|g| -g).collect();
        for which in 0..self.multipliers().len() {
            let of = self.constraint_force(which, x);
            parallel::update(&mut forces, |i, force| *force += of[i]);
        }
        forces
    }

    /// The first energy or constraint that is not a finite number at `x`, or whose forces are not; `None` where
    /// positions are not finite themselves.
    pub fn not_finite(&mut self, x: &[Vec3]) -> Option<String> {
        if self.reduction().any(!x.iter().all(|x| x.iter().all(|x| x.is_finite()))) {
            return None;
        }
        let energies = self.energies(x);
        let mechanics = Arc::clone(&self.mechanics);
        let reduction = self.reduction().clone();
        let bad = |force: Vec<Vec3>| {
            reduction.any(!force.iter().all(|f| f.iter().all(|f| f.is_finite())))
        };
        let of = |(k, name): (usize, &str)| {
            (!energies[k].is_finite() || bad(self.force_of(k, x))).then(|| name.to_owned())
        };
        let found = mechanics.names().enumerate().find_map(of);
        found.or_else(|| {
            let values = self.constraint_values(x);
            let mut all = mechanics.constraint_names().zip(values);
            all.find(|(_, value)| !value.is_finite()).map(|(name, _)| name.to_owned())
        })
    }

    /// The time in force.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Total energy U at `x`.
    pub fn energy(&mut self, x: &[Vec3]) -> f64 {
        let mut total = [0.0];
        self.each(energy::ENERGY, x, |_, term, work, shape| {
            total[0] += term.evaluate(shape, work, None)
        });
        self.total(total[0], x)
    }

    /// The energy over all ranks: of the effects, of which each has its share, of the anchor and of what holds vertices.
    fn total(&self, effects: f64, x: &[Vec3]) -> f64 {
        let (anchor, hold, reduction) =
            (self.anchor.as_ref(), self.hold.as_ref(), self.reduction());
        let anchor = anchor.map_or(0.0, |anchor| anchor.energy_here(x, reduction));
        let hold = hold.map_or(0.0, |hold| hold.energy_here(x, reduction));
        let mut all = [effects, anchor, hold];
        reduction.sum_over_ranks(&mut all);
        all[0] + all[1] + all[2]
    }

    /// What sums over the whole sheet are taken over.
    #[must_use]
    pub fn reduction(&self) -> &Reduction {
        self.mechanics.sheet().reduction()
    }

    /// Total energy at `x` (L, if there are constraints), and its gradient with the fixed directions set
    /// to zero.
    pub fn energy_gradient(&mut self, x: &[Vec3], gradient: &mut [Vec3]) -> f64 {
        self.mechanics.tally().count(|work| work.gradients += 1);
        self.gradient_within(x, gradient)
    }

    /// The same as part of a right-hand side, which counts for both.
    pub(super) fn gradient_within(&mut self, x: &[Vec3], gradient: &mut [Vec3]) -> f64 {
        let mut energy = self.unconstrained_gradient(x, gradient);
        if self.is_constrained() {
            let (mechanics, constraints, shape) = self.constrained(x);
            energy += constraints.add(mechanics, &shape, gradient);
        }
        if !energy.is_finite() {
            let mechanics = Arc::clone(&self.mechanics);
            let time = self.time;
            mechanics.note_not_finite(|| Some((self.not_finite(x)?, time)));
        }
        energy
    }

    /// U at `x`, and its gradient with the fixed directions set to zero.
    pub(super) fn unconstrained_gradient(&mut self, x: &[Vec3], gradient: &mut [Vec3]) -> f64 {
        gradient.fill(Vec3::zeros());
        let mut total = [0.0];
        self.each(energy::GRADIENT, x, |_, term, work, shape| {
            total[0] += term.evaluate(shape, work, Some(&mut *gradient));
        });
        if let Some(anchor) = &self.anchor {
            anchor.add_gradient(x, gradient);
        }
        if let Some(hold) = &self.hold {
            hold.add_gradient(x, self.reduction(), gradient);
        }
        self.mechanics.fix(gradient);
        self.total(total[0], x)
    }

    /// Largest force on a vertex in units of [`Potential::force_scale`].
    #[must_use]
    pub fn residual(&self, gradient: &[Vec3]) -> f64 {
        let largest = self.reduction().largest(gradient);
        if largest == 0.0 { 0.0 } else { largest / self.force_scale }
    }

    /// The pattern of second derivatives at `x`: that of all shapes, unless an effect couples pairs of
    /// the moment.
    pub fn pattern(&mut self, x: &[Vec3]) -> Arc<BlockPattern> {
        if !self.mechanics.couples_pairs() {
            return Arc::clone(self.mechanics.pattern());
        }
        let mut pairs = Vec::new();
        self.each_contact(("pairs", |does| does.pairs), x, |_, term, work, shape| {
            term.pairs(shape, work, &mut pairs);
        });
        self.mechanics.pattern_with(&pairs)
    }

    /// Second derivatives at `x`, those of low rank left out, with the fixed directions replaced by the
    /// mean stiffness.
    ///
    /// # Errors
    /// [`ModelError::Coupling`] if an effect adds to what the pattern of `into` lacks.
    pub fn hessian(
        &mut self,
        x: &[Vec3],
        part: HessianPart,
        into: &mut BlockMatrix,
    ) -> Result<(), ModelError> {
        into.clear();
        let mut wrong = None;
        self.each(energy::HESSIAN, x, |k, term, work, shape| {
            term.add_hessian(shape, work, part, into);
            wrong = wrong.or(into.outside().map(|pair| (k, pair)));
        });
        if let Some((k, pair)) = wrong {
            let effect = self.mechanics.names().nth(k).unwrap_or_default().to_owned();
            return Err(ModelError::Coupling { effect, pair });
        }
        if self.is_constrained() {
            let (mechanics, constraints, shape) = self.constrained(x);
            constraints.add_hessian(mechanics, &shape, part, into)?;
        }
        if let Some(anchor) = &self.anchor {
            anchor.add_hessian(into);
        }
        let scale = into.mean_diagonal();
        into.pin(self.mechanics.pins(), scale);
        Ok(())
    }

    /// Second derivatives of low rank at `x`, with the fixed directions set to zero.
    pub fn low_rank(&mut self, x: &[Vec3], part: HessianPart) -> Vec<RankOneTerm> {
        let mut terms = Vec::new();
        if self.mechanics.has_low_rank() {
            self.each(energy::LOW_RANK, x, |_, term, work, shape| {
                term.low_rank(shape, work, part, &mut terms)
            });
            for term in &mut terms {
                self.mechanics.fix(&mut term.direction);
            }
        }
        if self.is_constrained() {
            let (mechanics, constraints, shape) = self.constrained(x);
            constraints.add_low_rank(mechanics, &shape, &mut terms);
        }
        terms
    }

    /// Whether moving from `from` to `to` is allowed: every triangle keeps `share` of its area and its
    /// side, and no effect forbids the step.
    pub fn allows(&mut self, from: &[Vec3], to: &[Vec3], share: f64) -> bool {
        if !self.keeps_triangles(from, to, share, 0.0) {
            return false;
        }
        if !self.mechanics.limits_steps() {
            return true;
        }
        let direction: Vec<Vec3> = from.iter().zip(to).map(|(from, to)| to - from).collect();
        self.largest_step(from, &direction) >= 1.0
    }

    /// Whether every triangle keeps `share` of its area from `from` to `to`, and its side unless its quality is less
    /// than `flat`.
    pub(crate) fn keeps_triangles(
        &self,
        from: &[Vec3],
        to: &[Vec3],
        share: f64,
        flat: f64,
    ) -> bool {
        let _scope = self.mechanics.tally().meter("solver", "check of triangles").scope("steps");
        let triangles = self.sheet().triangles();
        let cross = |x: &[Vec3], t: usize| {
            let [a, b, c] = triangles[t].map(|v| x[v as usize]);
            (b - a).cross(&(c - a))
        };
        let worst = self.reduction().max(triangles.len(), |t| {
            let (old, new) = (cross(from, t), cross(to, t));
            let keeps = new.norm() >= share * old.norm() && old.dot(&new) > 0.0;
            let may_turn = || triangle_quality(triangles[t].map(|v| from[v as usize])) < flat;
            if keeps || may_turn() { 0.0 } else { 1.0 }
        });
        worst <= 0.0
    }
}
