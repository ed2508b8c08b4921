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
//! A_act does. Source: Zakharov & Dasbiswas (2021), section on the separation of spots.

use std::f64::consts::PI;

use serde::Serialize;

use crate::Vec3;
use crate::geometry::{Face, aligned, aligned_by, sum_at_corners, vertex_normals};
use crate::kinetics::Location;
use crate::model::{Evaluation, Model, ModelError, free_motions};
use crate::num::{real, whole};
use crate::study::extent;

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
    /// Largest rate of change of a species in units of its typical magnitude, 1/time.
    pub rate: f64,
}

impl Measures {
    /// Columns of `measures.csv`.
    pub(super) const COLUMNS: &str = "step,time,spots,separation d [length],nearest centres [length],share,\
        amplitude [length],deflection [length],energy [energy],fastest rate [1/time]";

    /// The row of step `step` in `measures.csv`.
    pub(in crate::study) fn row(&self, step: u64) -> [f64; 10] {
        let [d, nearest] = [self.separation, self.nearest].map(|v| v.unwrap_or(f64::NAN));
        let Self { time, energy, amplitude, deflection, spots, share, rate, .. } = *self;
        let (step, spots) = (real(usize::try_from(step).unwrap_or(usize::MAX)), real(spots));
        [step, time, spots, d, nearest, share, amplitude, deflection, energy, rate]
    }

    /// Measures of a row of `measures.csv`; none for a row of other length.
    pub(super) fn from_row(row: &[f64]) -> Option<Self> {
        let &[_, time, spots, d, nearest, share, amplitude, deflection, energy, rate] = row else {
            return None;
        };
        let [separation, nearest] = [d, nearest].map(|value| (!value.is_nan()).then_some(value));
        let spots = whole(spots);
        Some(Self { time, energy, amplitude, deflection, spots, separation, nearest, share, rate })
    }
}

/// The first species where it lives: what regions are made of.
struct Pattern {
    value: Vec<f64>,
    position: Vec<Vec3>,
    area: Vec<f64>,
    neighbours: Vec<[u32; 2]>,
}

impl Pattern {
    fn of(at: &mut Evaluation<'_>) -> Option<Self> {
        let (model, state) = (at.model(), at.state());
        let (sheet, x) = (model.sheet(), &state.x);
        let chemistry = model.chemistry()?;
        let faces: Vec<f64> =
            sheet.triangles().iter().map(|t| Face::of(&t.map(|v| x[v as usize])).area).collect();
        if chemistry.location() == Location::Face {
            let centre = |t: &[u32; 3]| t.iter().map(|v| x[*v as usize]).sum::<Vec3>() / 3.0;
            let inner = sheet.edges().iter().filter(|e| !e.is_boundary());
            return Some(Self {
                value: state.species.first()?.clone(),
                position: sheet.triangles().iter().map(centre).collect(),
                area: faces,
                neighbours: inner.map(|e| e.triangles).collect(),
            });
        }
        let mut area = vec![0.0; x.len()];
        sum_at_corners(sheet, |t| faces[t] / 3.0, &mut area);
        Some(Self {
            value: at.species_at_vertices().into_iter().next()?,
            position: x.to_vec(),
            area,
            neighbours: sheet.edges().iter().map(|e| e.vertices).collect(),
        })
    }

    /// Half way between the least and the largest value; none where they are the same.
    fn half_way(&self) -> Option<f64> {
        let (least, largest) = extent(self.value.iter().copied());
        (largest > least).then_some(0.5 * (least + largest))
    }

    /// Centres of the regions above `level`, and their area in all.
    fn regions(&self, level: f64) -> (Vec<Vec3>, f64) {
        let mut parent: Vec<u32> = (0u32..).take(self.value.len()).collect();
        let above = |k: u32| self.value[k as usize] > level;
        for [a, b] in self.neighbours.iter().copied().filter(|[a, b]| above(*a) && above(*b)) {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a.max(b) as usize] = a.min(b);
        }
        // A region is known by its first point; its moments are summed there.
        let mut moments = vec![(0.0, Vec3::zeros()); self.value.len()];
        for k in (0u32..).take(self.value.len()).filter(|k| above(*k)) {
            let (at, point) = (root(&mut parent, k) as usize, k as usize);
            moments[at].0 += self.area[point];
            moments[at].1 += self.area[point] * self.position[point];
        }
        let found = moments.iter().filter(|(area, _)| *area > 0.0);
        let centres = found.clone().map(|(area, moment)| moment / *area).collect();
        (centres, found.map(|(area, _)| area).sum())
    }
}

/// The first of the connected points, with the way there made short.
fn root(parent: &mut [u32], mut k: u32) -> u32 {
    while parent[k as usize] != k {
        parent[k as usize] = parent[parent[k as usize] as usize];
        k = parent[k as usize];
    }
    k
}

/// Displacements below this share of the sheet's size are what relaxations and round-off leave.
const NEGLIGIBLE_DISPLACEMENT: f64 = 1e-9;

/// Largest displacement and largest part of one along the normals at rest.
fn displacements(model: &Model, x: &[Vec3]) -> (f64, f64) {
    let (sheet, rest) = (model.sheet(), model.sheet().rest());
    let (motions, radius) =
        free_motions(rest, model.mechanics().pins(), model.sheet().reduction(), |_| 1.0);
    let placed = match motions.len() {
        0 => x.to_vec(),
        6 => aligned(x, rest),
        _ => {
            let motions: Vec<_> = motions.iter().map(|m| m.parameters).collect();
            aligned_by(&motions, radius, x, rest)
        }
    };
    let normals = vertex_normals(sheet, rest);
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
    let Some(pattern) = Pattern::of(at) else { return Ok(measures) };
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
        let nearest = |k: usize| {
            let others = centres.iter().enumerate().filter(|(other, _)| *other != k);
            others.map(|(_, other)| (other - centres[k]).norm()).fold(f64::INFINITY, f64::min)
        };
        measures.nearest = Some((0..centres.len()).map(nearest).sum::<f64>() / count);
    }
    Ok(measures)
}
