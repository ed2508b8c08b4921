//! The ledger's row: one line of numbers for every accepted step.

use super::Result;
use super::fields::qualities;
use crate::effects::Measure;
use crate::geometry::Face;
use crate::kinetics::Location;
use crate::model::{Evaluation, Model};
use crate::num::real;
use crate::solve::StepReport;

/// Titles of the ledger's columns where there is no space; species follow.
const POINT: [&str; 8] = [
    "step",
    "time",
    "step size [time]",
    "error estimate",
    "rejected",
    "iterations",
    "factorisations",
    "wall time [s]",
];

fn is_point(model: &Model) -> bool {
    model.sheet().triangles().is_empty()
}

/// Titles of the ledger's columns, with units.
pub(super) fn columns(model: &Model, watched: bool) -> Vec<String> {
    if is_point(model) {
        let mut all = POINT.map(str::to_owned).to_vec();
        if let Some(chemistry) = model.chemistry() {
            all.extend(chemistry.descriptor().species.iter().map(|s| s.name.clone()));
        }
        return all;
    }
    let mut all: Vec<String> = ["step", "time", "step size [time]", "error estimate", "rejected"]
        .map(str::to_owned)
        .to_vec();
    all.extend(model.mechanics().names().map(|name| format!("energy of {name} [energy]")));
    for name in model.mechanics().constraint_names() {
        all.push(format!("constraint {name}"));
        all.push(format!("multiplier of {name} [energy]"));
    }
    all.extend(
        ["total energy [energy]", "iterations", "evaluations", "factorisations", "force residual"]
            .map(str::to_owned),
    );
    if watched {
        all.push("negative directions".to_owned());
    }
    if let Some(chemistry) = model.chemistry() {
        for species in &chemistry.descriptor().species {
            let name = &species.name;
            all.extend([
                format!("total {name}"),
                format!("least {name}"),
                format!("largest {name}"),
            ]);
        }
    }
    all.extend(
        ["least quality", "impossible rest triangles", "collapsed triangles", "wall time [s]"]
            .map(str::to_owned),
    );
    all
}

/// The row of `state` after the step that `report` describes; `negative` directions only where
/// the run watches them.
///
/// # Errors
/// If a law fails.
pub(super) fn row(
    at: &mut Evaluation<'_>,
    report: &StepReport,
    negative: Option<f64>,
    wall: f64,
) -> Result<Vec<f64>> {
    let (model, state) = (at.model(), at.state());
    let sheet = model.sheet();
    let step = real(usize::try_from(state.step).unwrap_or(usize::MAX));
    if is_point(model) {
        let work = &report.relaxation;
        let mut row = vec![step, state.time, report.step, report.error, real(report.rejected)];
        row.extend([work.iterations, work.factorisations].map(real));
        row.push(wall);
        row.extend(state.species.iter().flatten());
        return Ok(row);
    }
    let mut row = vec![step, state.time, report.step, report.error, real(report.rejected)];
    let energies = at.energies()?;
    let work = &report.relaxation;
    row.extend(&energies);
    if model.mechanics().is_constrained() {
        let potential = at.potential()?;
        let values = potential.constraint_values(&state.x);
        row.extend(values.iter().zip(potential.multipliers()).flat_map(|(g, l)| [*g, *l]));
    }
    row.push(energies.iter().sum());
    row.extend([work.iterations, work.evaluations, work.factorisations].map(real));
    row.push(work.residual);
    row.extend(negative);
    // An amount is per rest area, a concentration per current area.
    let amount = model.chemistry().is_some_and(|c| c.measure() == Measure::Amount);
    let x = if amount { sheet.rest() } else { &state.x };
    let triangles = sheet.triangles().iter();
    let areas: Vec<f64> = triangles.map(|t| Face::of(&t.map(|v| x[v as usize])).area).collect();
    if let Some(chemistry) = model.chemistry() {
        let share: Vec<f64> = match chemistry.location() {
            Location::Vertex => {
                let mut share = vec![0.0; sheet.vertex_count()];
                for (triangle, area) in sheet.triangles().iter().zip(&areas) {
                    for v in triangle {
                        share[*v as usize] += area / 3.0;
                    }
                }
                share
            }
            _ => areas,
        };
        for c in &state.species {
            row.push(c.iter().zip(&share).map(|(c, a)| c * a).sum());
            row.push(c.iter().copied().fold(f64::INFINITY, f64::min));
            row.push(c.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        }
    }
    row.push(qualities(sheet, &state.x).into_iter().fold(f64::INFINITY, f64::min));
    row.push(real(at.potential()?.metric().impossible_triangles()));
    row.push(real(work.collapsed));
    row.push(wall);
    Ok(row)
}
