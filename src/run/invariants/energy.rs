//! The balance of the energy.
//!
//! With U(x; l) the energy under the conditions l, which are optimal lengths, species that effects read, loads and targets,
//!
//! ```text
//! fall of U = work against drag - work of growth - work of species - work of loads - work of pins - work of constraints
//! ```
//!
//! over a step from (x_0, l_0) to (x_1, l_1). Every work is taken by the trapezoidal rule, or by the mean velocity:
//!
//! ```text
//! drag          (x_1 - x_0)·γ(½(x_0 + x_1)) (x_1 - x_0)/Δt
//! growth        ½ Σ_l [U(x_0; l) + U(x_1; l)]  from l_0 to l_1, of effects that do not change with time themselves
//! species       the same of those among them that read species: what the chemistry does on the sheet
//! loads         the same of effects that do: ramps; of obstacles that move ½ (∂U_0/∂t + ∂U_1/∂t) Δt, each without the other shape
//! pins          ½ (∂U_0 + ∂U_1)·(x_1 - x_0) along the directions that are moved
//! constraints   ½ (λ_0 + λ_1) (g(x_1) - g(x_0)),  g as the mean of both conditions
//! ```
//!
//! so that a step leaves an error of Δt³, and a run one of Δt²: with integrators of second order the imbalance falls
//! as Δt², with those of first order as Δt. A quasi-static shape rests under the conditions of the moment, or snaps: what the
//! stabilising drag takes up is what the integrator says.
//!
//! The limit is for the imbalance of a step, relative to what it turns over, which is the sum of the magnitudes of all
//! works and of the fall at fixed conditions, or [`MINIMUM_RELATIVE_TURNOVER`] of the largest energy so far if that
//! is more. The imbalance of a run is then at most the limit times what it turns over.

use super::{InspectedStep, Monitor, Reading};
use crate::Vec3;
use crate::model::{Evaluation, Model, State};
use crate::parallel;
use crate::run::Result;
use crate::scene::Scene;

/// Least turnover that the imbalance of a step is divided by, relative to the largest energy so far.
const MINIMUM_RELATIVE_TURNOVER: f64 = 1e-6;

/// The works, in the order of the ledger.
const WORKS: [&str; 6] = [
    "work against drag",
    "work of growth",
    "work of species",
    "work of loads",
    "work of pins",
    "work of constraints",
];
const DRAG: usize = 0;
const GROWTH: usize = 1;
const SPECIES: usize = 2;
const LOADS: usize = 3;
const PINS: usize = 4;
const CONSTRAINTS: usize = 5;

/// The balance, with the works that a model can do. It remembers the works since the start, the imbalance and the largest
/// energy.
pub(super) struct EnergyBalance([bool; WORKS.len()]);

/// Energies and constraints of the shapes x_0 and x_1 under the conditions of one state.
struct AtConditions {
    /// Energies of the effects at x_0 and x_1.
    energies: [Vec<f64>; 2],
    /// ∂U at the shape of the state, pinned directions included; empty unless pins move.
    gradient: Vec<Vec3>,
    /// λ, and g at x_0 and x_1.
    multipliers: Vec<f64>,
    constraints: [Vec<f64>; 2],
}

impl AtConditions {
    fn new(mut at: Evaluation<'_>, shapes: [&[Vec3]; 2], with_gradient: bool) -> Result<Self> {
        let x = &at.state().x;
        let effects = at.model().mechanics().terms().len();
        let potential = at.potential()?;
        let energies = shapes.map(|x| potential.energies(x));
        let mut gradient = vec![Vec3::zeros(); if with_gradient { x.len() } else { 0 }];
        for k in (0..effects).filter(|_| with_gradient) {
            let force = potential.force_of(k, x);
            gradient.iter_mut().zip(force).for_each(|(g, f)| *g -= f);
        }
        let multipliers = potential.multipliers().to_vec();
        let constraints = shapes.map(|x| potential.constraint_values(x));
        Ok(Self { energies, gradient, multipliers, constraints })
    }
}

/// Sum of the magnitudes of energies.
fn magnitude(energies: &[f64]) -> f64 {
    energies.iter().map(|u| u.abs()).sum()
}

impl EnergyBalance {
    /// For `scene`.
    ///
    /// # Errors
    /// A work that is not known, with the place.
    pub(super) fn new(scene: &Scene, model: &Model) -> Result<Self> {
        let mechanics = model.mechanics();
        let drag = model.mass_weights().mechanics > 0.0;
        if drag && mechanics.constraints().iter().any(|term| term.reads().time) {
            let message = "under drag the work of a constraint whose target changes with time is not accounted for: \
                           its multiplier is that of the shape at rest";
            let help = "give it a stiffness in place of exact = true, or leave energy out";
            return Err(scene.error_at("invariants.energy", message, Some(help)).into());
        }
        let (species, loads) = (!mechanics.species().is_empty(), mechanics.depends_on_time());
        let (pins, constraints) = (mechanics.has_prescribed(), mechanics.is_constrained());
        Ok(Self([drag, true, species, loads, pins, constraints]))
    }

    /// The works of a step from the state `before`, the fall of the energy at fixed conditions, and the largest energy.
    fn works(
        &self,
        step: &mut InspectedStep<'_>,
        before: &State,
    ) -> Result<([f64; WORKS.len()], f64, f64)> {
        let after = step.after;
        let shapes = [before.x.as_slice(), after.x.as_slice()];
        let first = AtConditions::new(step.workspace.at(before), shapes, self.0[PINS])?;
        let last = AtConditions::new(step.workspace.at(after), shapes, self.0[PINS])?;
        let forth = step.workspace.work_of_obstacles(before, after.time)?;
        let back = step.workspace.work_of_obstacles(after, before.time)?;
        let model = &step.workspace.model;
        let mut works = [0.0; WORKS.len()];
        for (k, term) in model.mechanics().terms().iter().enumerate() {
            let change = |x: usize| last.energies[x][k] - first.energies[x][k];
            let which = match (term.reads().time, term.reads().species.is_empty()) {
                (true, _) => LOADS,
                (false, true) => GROWTH,
                (false, false) => SPECIES,
            };
            let [begin, end] = match (forth[k], back[k]) {
                (Some(forth), Some(back)) => [forth, -back],
                _ => [change(0), change(1)],
            };
            works[which] += 0.5 * (begin + end);
        }
        works[DRAG] = match self.0[DRAG] {
            true => against_drag(model, before, after),
            false => step.dissipated,
        };
        if self.0[PINS] {
            works[PINS] = parallel::sum(before.x.len(), |i| {
                let (moved, pins) = (after.x[i] - before.x[i], model.mechanics().pins()[i]);
                let pull = 0.5 * (first.gradient[i] + last.gradient[i]);
                (0..3).filter(|a| pins[*a]).map(|a| pull[a] * moved[a]).sum()
            });
        }
        for (k, (a, b)) in first.multipliers.iter().zip(&last.multipliers).enumerate() {
            let change = |g: &[Vec<f64>; 2]| g[1][k] - g[0][k];
            works[CONSTRAINTS] +=
                0.25 * (a + b) * (change(&first.constraints) + change(&last.constraints));
        }
        let [begin, end] = [&first.energies[0], &last.energies[1]];
        let fall: f64 = begin.iter().zip(end).map(|(begin, end)| begin - end).sum();
        let fall = fall + works[GROWTH] + works[SPECIES] + works[LOADS];
        Ok((works, fall, magnitude(begin).max(magnitude(end))))
    }

    /// The listed ones of `works`.
    fn listed<T>(&self, works: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
        works.into_iter().zip(self.0).filter(|(_, listed)| *listed).map(|(work, _)| work)
    }
}

/// `(x_1 - x_0)·γ (x_1 - x_0)/Δt` along the directions that are free.
fn against_drag(model: &Model, before: &State, after: &State) -> f64 {
    let mut middle = before.x.clone();
    parallel::update(&mut middle, |i, x| *x = 0.5 * (*x + after.x[i]));
    let weights = model.drag().weights(model.sheet(), &middle, 1.0 / (after.time - before.time));
    let pins = model.mechanics().pins();
    parallel::sum(before.x.len(), |i| {
        let moved = after.x[i] - before.x[i];
        let free = Vec3::from_fn(|a, _| if pins[i][a] { 0.0 } else { moved[a] });
        free.dot(&weights.apply(i, free))
    })
}

impl Monitor for EnergyBalance {
    fn law(&self) -> (String, &'static str) {
        let advice = "the integrator leaves this error: try a smaller time.integrator.rtol or step, a method of second \
                      order (staggered with method = \"heun\", shape = \"sdirk2\"), or a larger limit";
        ("the balance of the energy (share of what the step turns over)".into(), advice)
    }

    fn columns(&self) -> Vec<String> {
        let works = self.listed(WORKS).map(|name| format!("{name} [energy]"));
        let more = ["energy imbalance [energy]", "relative energy imbalance of the step"];
        works.chain(more.map(str::to_owned)).collect()
    }

    fn sees_every_step(&self) -> bool {
        true
    }

    fn inspect(&mut self, step: &mut InspectedStep<'_>, memory: &mut Vec<f64>) -> Result<Reading> {
        let Some(before) = step.before else {
            let largest = magnitude(&step.workspace.at(step.after).energies()?);
            *memory = [vec![0.0; WORKS.len() + 1], vec![largest]].concat();
            let row = vec![0.0; self.columns().len()];
            return Ok(Reading { row, value: 0.0, place: String::new() });
        };
        let (works, fall, largest) = self.works(step, before)?;
        let imbalance = fall + works[PINS] + works[CONSTRAINTS] - works[DRAG];
        let largest = memory.pop().unwrap_or_default().max(largest);
        let now = works.iter().chain([&imbalance]);
        memory.iter_mut().zip(now).for_each(|(total, now)| *total += now);
        let turned = magnitude(&works) + fall.abs();
        let allowed = turned.max(MINIMUM_RELATIVE_TURNOVER * largest);
        let value = if imbalance == 0.0 { 0.0 } else { imbalance.abs() / allowed };
        let [drag, growth, species, loads, pins, constraints] = works;
        let place = format!(
            "in this step the energy falls by {fall:.3e} at fixed conditions, drag takes up {drag:.3e}, pins and \
             constraints do {:.3e}, growth {growth:.3e}, species {species:.3e}, loads {loads:.3e}",
            pins + constraints
        );
        let totals = self.listed(memory.iter().copied());
        let row = totals.chain([memory[WORKS.len()], value]).collect();
        memory.push(largest);
        Ok(Reading { row, value, place })
    }
}
