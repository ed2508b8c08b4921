//! The mechanical half of the system: `U(x; l̄)` of all listed effects, and what holds the sheet.

use std::sync::Arc;

use super::rigid::free_motions;
use crate::Vec3;
use crate::effects::{Energy, HessianPart};
use crate::geometry::{RestMetric, Shape};
use crate::parallel;
use crate::sheet::{Sheet, SheetError};
use crate::solve::linear::BlockMatrix;

/// For every vertex the directions in which it is held.
pub type Pins = Vec<[bool; 3]>;

/// Energies, pins and the rest metric of one sheet.
#[derive(Default)]
pub struct Mechanics {
    sheet: Arc<Sheet>,
    metric: RestMetric,
    energies: Vec<Box<dyn Energy>>,
    names: Vec<String>,
    pins: Pins,
    /// The vertices with pins.
    pinned: Vec<usize>,
    force_scale: f64,
}

impl Mechanics {
    /// Puts `energies` on `sheet`, unstrained (Φ = 1).
    ///
    /// # Errors
    /// A rest state with edges or triangles of no size.
    pub fn new(
        sheet: Arc<Sheet>,
        energies: Vec<Box<dyn Energy>>,
        pins: Pins,
    ) -> Result<Self, SheetError> {
        let metric = RestMetric::new(&sheet)?;
        let pinned = (0..pins.len()).filter(|&i| pins[i].contains(&true)).collect();
        let names = numbered(energies.iter().map(|e| e.name()));
        let mut mechanics = Self { sheet, metric, energies, names, pins, pinned, force_scale: 0.0 };
        mechanics.announce_metric();
        Ok(mechanics)
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        &self.sheet
    }

    /// The rest metric in force.
    #[must_use]
    pub fn metric(&self) -> &RestMetric {
        &self.metric
    }

    /// The held directions.
    #[must_use]
    pub fn pins(&self) -> &Pins {
        &self.pins
    }

    /// How many of the six rigid motions of the sheet at rest the pins do not hold.
    #[must_use]
    pub fn free_motions(&self) -> usize {
        free_motions(self.sheet.rest(), &self.pins, |_| 1.0).0.len()
    }

    /// Force on a vertex at unit strain: the unit of force tolerances. At least one listed effect
    /// must define it for relaxation to make sense; otherwise it is 0.
    #[must_use]
    pub fn force_scale(&self) -> f64 {
        self.force_scale
    }

    /// Largest force on a vertex that each effect applies from outside to the sheet at rest, in
    /// units of [`Mechanics::force_scale`], by [`Mechanics::names`].
    #[must_use]
    pub fn applied_forces(&self) -> Vec<f64> {
        self.energies.iter().map(|e| e.applied_force() / self.force_scale).collect()
    }

    /// Whether no effect has an energy.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.energies.is_empty()
    }

    /// Names of the effects with an energy, in the scene's order: no two are the same.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Sets the length factor Φ of every edge.
    pub fn set_length_factor(&mut self, factor: &[f64]) {
        self.metric.set_length_factor(&self.sheet, factor);
        self.announce_metric();
    }

    fn announce_metric(&mut self) {
        for energy in &mut self.energies {
            energy.set_rest_metric(&self.sheet, &self.metric);
        }
        self.force_scale = self.energies.iter().map(|e| e.force_scale()).fold(0.0, f64::max);
    }

    /// Calls `f` with the shape at `x`.
    pub fn with_shape<R>(&mut self, x: &[Vec3], f: impl FnOnce(&Shape<'_>) -> R) -> R {
        f(&Shape { sheet: &self.sheet, metric: &self.metric, x })
    }

    /// Energy of every effect at `x`, by [`Mechanics::names`].
    pub fn energies(&mut self, x: &[Vec3]) -> Vec<f64> {
        let shape = Shape { sheet: &self.sheet, metric: &self.metric, x };
        self.energies.iter_mut().map(|e| e.evaluate(&shape, None)).collect()
    }

    /// Force `-∂U/∂x` of effect number `which` at `x`, before pins.
    pub fn force_of(&mut self, which: usize, x: &[Vec3]) -> Vec<Vec3> {
        let shape = Shape { sheet: &self.sheet, metric: &self.metric, x };
        let mut gradient = vec![Vec3::zeros(); x.len()];
        self.energies[which].evaluate(&shape, Some(&mut gradient));
        gradient.iter().map(|g| -g).collect()
    }

    /// Total energy at `x`.
    pub fn energy(&mut self, x: &[Vec3]) -> f64 {
        self.energies(x).iter().sum()
    }

    /// Total energy at `x`, and its gradient with the held directions set to zero.
    pub fn energy_gradient(&mut self, x: &[Vec3], gradient: &mut [Vec3]) -> f64 {
        let shape = Shape { sheet: &self.sheet, metric: &self.metric, x };
        gradient.fill(Vec3::zeros());
        let mut energy = 0.0;
        for effect in &mut self.energies {
            energy += effect.evaluate(&shape, Some(gradient));
        }
        for &i in &self.pinned {
            for a in 0..3 {
                if self.pins[i][a] {
                    gradient[i][a] = 0.0;
                }
            }
        }
        energy
    }

    /// Largest force on a vertex in units of [`Mechanics::force_scale`], and that vertex.
    #[must_use]
    pub fn residual(&self, gradient: &[Vec3]) -> f64 {
        let largest = parallel::max(gradient.len(), |i| gradient[i].norm_squared()).sqrt();
        if largest == 0.0 { 0.0 } else { largest / self.force_scale }
    }

    /// Second derivatives at `x`, with the held directions replaced by the mean stiffness.
    pub fn hessian(&mut self, x: &[Vec3], part: HessianPart, into: &mut BlockMatrix) {
        let shape = Shape { sheet: &self.sheet, metric: &self.metric, x };
        into.clear();
        for effect in &mut self.energies {
            effect.add_hessian(&shape, part, into);
        }
        let scale = into.mean_diagonal();
        into.pin(&self.pins, scale);
    }

    /// Hands all `∂²U/∂x_i∂l̄_e` at `x` to `emit`, in an order that depends on the sheet alone.
    pub fn metric_derivatives(&mut self, x: &[Vec3], emit: &mut dyn FnMut(usize, usize, Vec3)) {
        let shape = Shape { sheet: &self.sheet, metric: &self.metric, x };
        for effect in &mut self.energies {
            effect.metric_derivatives(&shape, emit);
        }
    }

    /// Whether moving from `from` to `to` keeps every triangle: its area does not fall below
    /// `share` of what it was, and it does not turn over.
    pub fn keeps_triangles(&mut self, from: &[Vec3], to: &[Vec3], share: f64) -> bool {
        let triangles = self.sheet.triangles();
        let cross = |x: &[Vec3], t: usize| {
            let [a, b, c] = triangles[t].map(|v| x[v as usize]);
            (b - a).cross(&(c - a))
        };
        let worst = parallel::max(triangles.len(), |t| {
            let (old, new) = (cross(from, t), cross(to, t));
            if new.norm() >= share * old.norm() && old.dot(&new) > 0.0 { 0.0 } else { 1.0 }
        });
        worst <= 0.0
    }
}

/// Names with a number after those that came before: load, load 2, load 3.
fn numbered<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut seen: Vec<&str> = Vec::new();
    let number = |name: &'a str| {
        seen.push(name);
        match seen.iter().filter(|earlier| **earlier == name).count() {
            1 => name.to_owned(),
            count => format!("{name} {count}"),
        }
    };
    names.map(number).collect()
}
