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
//! loads         the same of effects that do: ramps
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

use super::{Invariant, InvariantValue, Step};
use crate::Vec3;
use crate::model::{Evaluation, Model, State};
use crate::parallel;
use crate::run::Result;
use crate::scene::Scene;
use crate::solve::Workspace;

/// Least turnover that the imbalance of a step is divided by, relative to the largest energy so far.
const MINIMUM_RELATIVE_TURNOVER: f64 = 1e-6;

/// The law. It remembers [`EnergyTotals`].
pub(super) struct EnergyBalance {
    /// Whether the shape moves under drag.
    drag: bool,
    /// Whether effects read species.
    species: bool,
    /// Whether effects, pins or constraints change with time.
    loads: bool,
    pins: bool,
    constraints: bool,
}

/// Works since the start, the imbalance, and the largest energy.
#[derive(Debug, Clone, Copy, Default)]
struct EnergyTotals {
    drag: f64,
    growth: f64,
    species: f64,
    loads: f64,
    pins: f64,
    constraints: f64,
    imbalance: f64,
    largest: f64,
}

impl EnergyTotals {
    fn to_memory(self) -> Vec<f64> {
        let Self { drag, growth, species, loads, pins, constraints, imbalance, largest } = self;
        vec![drag, growth, species, loads, pins, constraints, imbalance, largest]
    }

    fn of(memory: &[f64]) -> Self {
        match *memory {
            [drag, growth, species, loads, pins, constraints, imbalance, largest] => {
                Self { drag, growth, species, loads, pins, constraints, imbalance, largest }
            }
            _ => Self::default(),
        }
    }
}

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
    fn of(at: &mut Evaluation<'_>, shapes: [&[Vec3]; 2], with_gradient: bool) -> Result<Self> {
        let x = &at.state().x;
        let effects = at.model().mechanics().terms().len();
        let constrained = at.model().mechanics().is_constrained();
        let potential = at.potential()?;
        let energies = shapes.map(|x| potential.energies(x));
        let mut gradient = vec![Vec3::zeros(); if with_gradient { x.len() } else { 0 }];
        for k in (0..effects).filter(|_| with_gradient) {
            let force = potential.force_of(k, x);
            gradient.iter_mut().zip(force).for_each(|(g, f)| *g -= f);
        }
        let multipliers = if constrained { potential.multipliers().to_vec() } else { Vec::new() };
        let constraints =
            shapes.map(|x| if constrained { potential.constraint_values(x) } else { Vec::new() });
        Ok(Self { energies, gradient, multipliers, constraints })
    }

    /// Fall of the energy from the first shape to the second.
    fn fall(&self) -> f64 {
        let [first, second] = &self.energies;
        first.iter().zip(second).map(|(a, b)| a - b).sum()
    }

    /// Sum of the magnitudes of the effects' energies at a shape.
    fn energy_magnitude(&self, shape: usize) -> f64 {
        self.energies[shape].iter().map(|u| u.abs()).sum()
    }
}

impl EnergyBalance {
    /// For `scene`.
    ///
    /// # Errors
    /// A scene without an energy, or with a work that is not known, with the place.
    pub(super) fn of(scene: &Scene, model: &Model) -> Result<Self> {
        let mechanics = model.mechanics();
        if mechanics.is_empty() {
            let message = "no effect of the scene has an energy";
            return Err(scene.error_at("invariants.energy", message, None).into());
        }
        let drag = model.storage().mechanics > 0.0;
        if drag && mechanics.constraints().iter().any(|term| term.reads().time) {
            let message = "under drag the work of a constraint whose target changes with time is not accounted for: \
                           its multiplier is that of the shape at rest";
            let help = "give the volume a stiffness in place of exact = true, or leave energy out";
            return Err(scene.error_at("invariants.energy", message, Some(help)).into());
        }
        Ok(Self {
            drag,
            species: !mechanics.species().is_empty(),
            loads: mechanics.depends_on_time(),
            pins: mechanics.has_prescribed(),
            constraints: mechanics.is_constrained(),
        })
    }

    fn row(&self, totals: &EnergyTotals, relative_imbalance: f64) -> Vec<f64> {
        let parts = [
            (self.drag, totals.drag),
            (true, totals.growth),
            (self.species, totals.species),
            (self.loads, totals.loads),
            (self.pins, totals.pins),
            (self.constraints, totals.constraints),
            (true, totals.imbalance),
            (true, relative_imbalance),
        ];
        parts.into_iter().filter(|(listed, _)| *listed).map(|(_, value)| value).collect()
    }

    /// The works of a step as totals, and the fall of the energy at fixed conditions.
    fn works(&self, step: &mut Step<'_>) -> Result<(EnergyTotals, f64)> {
        let (before, after) = (step.before, step.after);
        let shapes = [before.x.as_slice(), after.x.as_slice()];
        let first = AtConditions::of(&mut step.before(), shapes, self.pins)?;
        let last = AtConditions::of(&mut step.after(), shapes, self.pins)?;
        let model = &step.workspace.model;
        let mechanics = model.mechanics();
        let fall = 0.5 * (first.fall() + last.fall());
        let mut works = EnergyTotals::default();
        for (k, term) in mechanics.terms().iter().enumerate() {
            let change = |x: usize| last.energies[x][k] - first.energies[x][k];
            let work = 0.5 * (change(0) + change(1));
            *match (term.reads().time, term.reads().species.is_empty()) {
                (true, _) => &mut works.loads,
                (false, true) => &mut works.growth,
                (false, false) => &mut works.species,
            } += work;
        }
        works.drag = match self.drag {
            true => against_drag(model, before, after),
            false => step.dissipated,
        };
        if self.pins {
            works.pins = parallel::sum(before.x.len(), |i| {
                let (moved, pins) = (after.x[i] - before.x[i], mechanics.pins()[i]);
                let pull = 0.5 * (first.gradient[i] + last.gradient[i]);
                (0..3).filter(|a| pins[*a]).map(|a| pull[a] * moved[a]).sum()
            });
        }
        for (k, (a, b)) in first.multipliers.iter().zip(&last.multipliers).enumerate() {
            let change = |g: &[Vec<f64>; 2]| g[1][k] - g[0][k];
            works.constraints +=
                0.25 * (a + b) * (change(&first.constraints) + change(&last.constraints));
        }
        works.imbalance = fall + works.pins + works.constraints - works.drag;
        works.largest = first.energy_magnitude(0).max(last.energy_magnitude(1));
        Ok((works, fall))
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

impl Invariant for EnergyBalance {
    fn name(&self) -> String {
        "the balance of the energy (share of what the step turns over)".into()
    }

    fn advice(&self) -> &'static str {
        "the integrator leaves this error: try a smaller time.integrator.rtol or step, a method of second order \
         (staggered with method = \"heun\", shape = \"sdirk2\"), or a larger limit"
    }

    fn columns(&self) -> Vec<String> {
        let all = [
            (self.drag, "work against drag [energy]"),
            (true, "work of growth [energy]"),
            (self.species, "work of species [energy]"),
            (self.loads, "work of loads [energy]"),
            (self.pins, "work of pins [energy]"),
            (self.constraints, "work of constraints [energy]"),
            (true, "energy imbalance [energy]"),
            (true, "relative energy imbalance of the step"),
        ];
        all.into_iter().filter(|(listed, _)| *listed).map(|(_, name)| name.to_owned()).collect()
    }

    fn sees_every_step(&self) -> bool {
        true
    }

    fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<InvariantValue> {
        let energies = workspace.at(state).energies()?;
        let largest = energies.iter().map(|u| u.abs()).sum();
        let totals = EnergyTotals { largest, ..EnergyTotals::default() };
        let row = self.row(&totals, 0.0);
        Ok(InvariantValue { row, value: 0.0, place: String::new(), memory: totals.to_memory() })
    }

    fn inspect(&mut self, step: &mut Step<'_>, memory: &[f64]) -> Result<InvariantValue> {
        let totals = EnergyTotals::of(memory);
        let (now, fall) = self.works(step)?;
        let EnergyTotals { drag, growth, species, loads, pins, constraints, imbalance, largest } =
            now;
        let largest = largest.max(totals.largest);
        let works = [drag, growth, species, loads, pins, constraints, fall];
        let turned: f64 = works.iter().map(|work| work.abs()).sum();
        let allowed = turned.max(MINIMUM_RELATIVE_TURNOVER * largest);
        let value = if imbalance == 0.0 { 0.0 } else { imbalance.abs() / allowed };
        let place = format!(
            "in this step the energy falls by {fall:.3e} at fixed conditions, drag takes up {drag:.3e}, pins and \
             constraints do {:.3e}, growth {growth:.3e}, species {species:.3e}, loads {loads:.3e}",
            pins + constraints
        );
        let totals = EnergyTotals {
            drag: totals.drag + drag,
            growth: totals.growth + growth,
            species: totals.species + species,
            loads: totals.loads + loads,
            pins: totals.pins + pins,
            constraints: totals.constraints + constraints,
            imbalance: totals.imbalance + imbalance,
            largest,
        };
        Ok(InvariantValue {
            row: self.row(&totals, value),
            value,
            place,
            memory: totals.to_memory(),
        })
    }
}
