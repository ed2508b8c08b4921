//! Scalar measures of a state, which can be compared across the branches of a bifurcation.
//!
//! A *spot* is a connected region where the first species is above a level: vertices that share an edge,
//! or triangles that share one if the species live there. With N spots of area A_act on a sheet of area
//! A_tot, all in the deformed state, the separation of spots is
//!
//! ```text
//! d = 2 (√(A_tot / πN) - √(A_act / πN))
//! ```
//!
//! the gap between discs of area A_act/N in the middle of discs of area A_tot/N. It depends on the level as
//! A_act does. Source: Zakharov & Dasbiswas (2021), section on the separation of spots. On a periodic sheet
//! areas are those of one period, and distances those of the nearest images.

use std::f64::consts::PI;

use serde::Serialize;

use crate::Vec3;
use crate::geometry::{aligned, aligned_by, vertex_normals};
use crate::model::{Evaluation, Model, ModelError, free_motions};
use crate::num::{real, whole};
use crate::run::pattern::Pattern;

/// Scalar measures of a state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Measures {
    /// Time.
    pub time: f64,
    /// Elastic energy: that of all effects but loads, which apply a force from outside.
    pub energy: f64,
    /// Largest displacement out of the rest shape, after the best of the rigid motions that pins leave free; 0
    /// below 1e-9 of the sheet's size.
    pub amplitude: f64,
    /// The same of its part along the normals of the sheet at rest.
    pub deflection: f64,
    /// Connected regions where the first species is above the level.
    pub spots: usize,
    /// The separation d of spots; none without spots.
    pub separation: Option<f64>,
    /// Mean distance of a spot's centre from the nearest other; none for fewer than two.
    pub nearest: Option<f64>,
    /// Area of all spots over that of the sheet, in the deformed state.
    pub share: f64,
    /// Width of the narrowest pattern of a species, half a wave, in mean edges; none where all are uniform.
    pub width: Option<f64>,
    /// The same of the mean curvature, half a wave of wrinkles; none of a shape without.
    pub wrinkle_width: Option<f64>,
    /// Largest rate of change of a species in units of its typical magnitude, 1/time.
    pub rate: f64,
}

impl Measures {
    /// Columns of `measures.csv`.
    pub(super) const COLUMNS: &str = "step,time,spots,separation d [length],nearest centres [length],share,\
        amplitude [length],deflection [length],energy [energy],fastest rate [1/time],pattern width [edges],\
        wrinkle width [edges]";

    /// The row of step `step` in `measures.csv`.
    pub(in crate::study) fn row(&self, step: u64) -> [f64; 12] {
        let [d, nearest, width, wrinkles] =
            [self.separation, self.nearest, self.width, self.wrinkle_width]
                .map(|v| v.unwrap_or(f64::NAN));
        let Self { time, energy, amplitude, deflection, spots, share, rate, .. } = *self;
        let (step, spots) = (real(usize::try_from(step).unwrap_or(usize::MAX)), real(spots));
        [step, time, spots, d, nearest, share, amplitude, deflection, energy, rate, width, wrinkles]
    }

    /// Measures of a row of `measures.csv`; none for a row of other length.
    pub(super) fn from_row(row: &[f64]) -> Option<Self> {
        let known = |k: usize| row.get(k).copied().filter(|value| !value.is_nan());
        (row.len() >= 10).then(|| Self {
            time: row[1],
            spots: whole(row[2]),
            separation: known(3),
            nearest: known(4),
            share: row[5],
            amplitude: row[6],
            deflection: row[7],
            energy: row[8],
            rate: row[9],
            // Rows of earlier versions have no widths.
            width: known(10),
            wrinkle_width: known(11),
        })
    }
}

/// Displacements below this share of the sheet's size are what relaxations and round-off leave.
const NEGLIGIBLE_DISPLACEMENT: f64 = 1e-9;

/// Largest displacement and largest part of one along the normals at rest.
fn displacements(model: &Model, x: &[Vec3]) -> (f64, f64) {
    let (sheet, rest) = (model.sheet(), model.sheet().rest());
    let (motions, radius) =
        free_motions(rest, model.mechanics().pins(), sheet.reduction(), |_| 1.0);
    let normals = vertex_normals(sheet, rest);
    let own = sheet.reduction().owned(x.len());
    let (x, rest) = (&x[..own], &rest[..own]);
    let placed = match motions.len() {
        0 => x.to_vec(),
        6 => aligned(x, rest),
        _ => {
            let motions: Vec<_> = motions.iter().map(|m| m.parameters).collect();
            aligned_by(&motions, radius, x, rest)
        }
    };
    let moved = || placed.iter().zip(rest).map(|(x, r)| x - r);
    let seen = |d: f64| if d > NEGLIGIBLE_DISPLACEMENT * radius { d } else { 0.0 };
    let along = moved().zip(&normals).map(|(d, n)| d.dot(n).abs());
    (seen(moved().map(|d| d.norm()).fold(0.0, f64::max)), seen(along.fold(0.0, f64::max)))
}

/// Measures of a state; spots are where the first species is above `level`, or half way between its
/// least and largest values.
///
/// # Errors
/// If a law fails.
pub fn measure(at: &mut Evaluation<'_>, level: Option<f64>) -> Result<Measures, ModelError> {
    let (model, state) = (at.model(), at.state());
    let loads = model.mechanics().applied_forces();
    let elastic = at.energies()?.into_iter().zip(loads).filter(|(_, load)| *load == 0.0);
    let (amplitude, deflection) = displacements(model, &state.x);
    let mut measures = Measures {
        time: state.time,
        // No minus before nothing.
        energy: elastic.map(|(energy, _)| energy).sum::<f64>() + 0.0,
        amplitude,
        deflection,
        rate: at.fastest_rate()?,
        ..Measures::default()
    };
    let width = |pattern: Pattern| pattern.width(&state.x, model.sheet());
    measures.wrinkle_width = Pattern::of_shape(at)?.and_then(width);
    let patterns = Pattern::of_species(at);
    measures.width = Pattern::narrowest(&patterns, &state.x, model.sheet());
    let Some(pattern) = patterns.first() else { return Ok(measures) };
    let Some(level) = level.or_else(|| pattern.half_way()) else { return Ok(measures) };
    let (centres, above) = pattern.regions(level);
    let total: f64 = pattern.area.iter().sum();
    let count = real(centres.len());
    if total > 0.0 {
        // No minus before nothing.
        measures.share = above / total + 0.0;
    }
    measures.spots = centres.len();
    if !centres.is_empty() {
        let radius = |area: f64| (area / (PI * count)).sqrt();
        measures.separation = Some(2.0 * (radius(total) - radius(above)));
    }
    if centres.len() > 1 {
        let all = model.sheet().reduction();
        let nearest = |k: usize| {
            let others = centres.iter().enumerate().filter(|(other, _)| *other != k);
            let image = |centre: &Vec3| all.nearest_image(centre - centres[k]).norm();
            others.map(|(_, other)| image(other)).fold(f64::INFINITY, f64::min)
        };
        measures.nearest = Some((0..centres.len()).map(nearest).sum::<f64>() / count);
    }
    Ok(measures)
}
