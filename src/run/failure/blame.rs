//! Who and where: what an error blames, or where the residual is largest.

use crate::Vec3;
use crate::kinetics::{KineticsError, Location};
use crate::model::{ModelError, State};
use crate::num::real;
use crate::run::{Error, Simulation};
use crate::solve::SolveError;

/// Cause of a failure, where it is known.
#[derive(Debug, Default)]
pub(super) struct FailureCause {
    /// A law, an effect or a species, in words.
    pub(super) causes: Vec<String>,
    /// A triangle.
    pub(super) triangle: Option<usize>,
    /// A vertex.
    pub(super) vertex: Option<usize>,
    /// A point where species live.
    pub(super) point: Option<usize>,
    /// Whether the place is one that the error names; otherwise it is where the residual is largest.
    pub(super) is_named: bool,
}

impl FailureCause {
    /// Of `error`, where `simulation` stopped.
    pub(super) fn new(error: &Error, simulation: &mut Simulation) -> Self {
        let mut blame = Self::default();
        match innermost(error) {
            Error::Kinetics(error) => blame.law(error),
            Error::Solve(error) => blame.solver(error),
            _ => {}
        }
        blame.is_named = blame.vertex.is_some() || blame.triangle.is_some();
        let on_faces = simulation
            .model()
            .chemistry()
            .is_some_and(|chemistry| chemistry.location() == Location::Face);
        blame.point = if on_faces { blame.triangle } else { blame.vertex };
        if let Some(t) = blame.triangle
            && blame.vertex.is_none()
        {
            blame.vertex = simulation.sheet().triangles().get(t).map(|corners| corners[0] as usize);
        }
        if !blame.is_named {
            let stuck = simulation.stepper.workspace.stuck().cloned();
            blame.vertex = strongest(simulation, stuck.as_ref());
        }
        if blame.point.is_none() {
            blame.point = fastest(simulation);
        }
        if blame.vertex.is_none() && !on_faces {
            blame.vertex = blame.point;
        }
        blame
    }

    fn law(&mut self, error: &KineticsError) {
        let law = match error {
            KineticsError::Failed { plugin, .. } | KineticsError::Retry { plugin, .. } => {
                Some(format!("plugin `{plugin}`"))
            }
            KineticsError::BadOutput(bad) => Some(bad.law.clone()),
            _ => None,
        };
        self.causes.extend(law);
        if let KineticsError::BadOutput(bad) = error {
            self.causes.push(bad.quantity.clone());
        }
        if let Some(site) = error.site() {
            match site.location {
                "vertex" => self.vertex = Some(site.point),
                "edge" => {}
                _ => self.triangle = Some(site.point),
            }
        }
    }

    fn solver(&mut self, error: &SolveError) {
        match error {
            SolveError::Collapsed { triangle, .. } => self.triangle = Some(*triangle),
            SolveError::EffectNotFinite { effect, .. } => {
                self.causes.push(format!("effect {effect}"));
            }
            SolveError::Constraint { constraint, .. } => {
                self.causes.push(format!("constraint {constraint}"));
            }
            SolveError::Model(ModelError::OutOfRange { species, location, point, .. }) => {
                self.causes.push(format!("species {species}"));
                match location {
                    Location::Vertex => self.vertex = Some(*point),
                    _ => self.triangle = Some(*point),
                }
            }
            _ => {}
        }
    }

    /// Where it is, in words; on the shape `x`.
    pub(super) fn place(&self, simulation: &Simulation, x: &[Vec3]) -> Option<String> {
        let at = |x: &Vec3| format!("({:.6}, {:.6}, {:.6})", x.x, x.y, x.z);
        let sheet = simulation.sheet();
        let triangle = self.triangle.and_then(|t| Some((t, sheet.triangles().get(t)?)));
        if let Some((t, corners)) = triangle {
            let sum: Vec3 = corners.iter().filter_map(|v| x.get(*v as usize)).sum();
            return Some(format!(
                "triangle {t} (vertices {corners:?}) at {}",
                at(&(sum / real(3)))
            ));
        }
        let vertex = self.vertex.filter(|_| !sheet.triangles().is_empty())?;
        Some(format!("vertex {vertex} at {}", at(x.get(vertex)?)))
    }
}

/// What failed, without what is known of the cause.
fn innermost(error: &Error) -> &Error {
    match error {
        Error::Solve(SolveError::Diagnosed { error: inner, .. }) => {
            inner.downcast_ref().unwrap_or(error)
        }
        _ => error,
    }
}

/// The vertex with the largest force left, at `stuck` if that is given.
fn strongest(simulation: &mut Simulation, stuck: Option<&State>) -> Option<usize> {
    if !simulation.model().moves() {
        return None;
    }
    let state = stuck.cloned().unwrap_or_else(|| simulation.stepper.state.clone());
    let gradient = simulation.stepper.workspace.at(&state).gradient().ok()?;
    largest(gradient.iter().map(|g| g.norm()))
}

/// The point with the largest rate, in units of the species' typical magnitudes.
fn fastest(simulation: &mut Simulation) -> Option<usize> {
    let model = std::sync::Arc::clone(simulation.model());
    let typical = |s: usize| model.chemistry().map_or(1.0, |c| c.typical(s));
    let mut at = simulation.evaluate();
    let rates = at.rates().ok()?;
    let of = |i: usize| {
        let each = rates.iter().enumerate().map(|(s, rate)| (rate[i] / typical(s)).abs());
        each.fold(0.0, f64::max)
    };
    largest((0..rates.first()?.len()).map(of))
}

/// The number of the largest; what is not a number is larger than all.
fn largest(values: impl Iterator<Item = f64>) -> Option<usize> {
    let size = |v: f64| if v.is_nan() { f64::INFINITY } else { v };
    values.enumerate().max_by(|a, b| size(a.1).total_cmp(&size(b.1))).map(|(i, _)| i)
}
