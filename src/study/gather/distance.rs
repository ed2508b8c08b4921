//! Distances of states and of runs, and where two runs diverge.

use nalgebra::Vector6;

use crate::Vec3;
use crate::geometry::{Face, aligned, aligned_by, lumped_areas};
use crate::kinetics::Location;
use crate::model::{Model, State, free_motions};
use crate::num::real;
use crate::sheet::Sheet;

/// Least scale of shape differences, as a share of the size of the sheet: that of a sheet at rest.
const DISPLACEMENT_FLOOR: f64 = 1e-6;
/// Distances below this share of the sheet's size are round-off of the alignment.
const ROUND_OFF: f64 = 1e-13;

/// Distance of a field of two states: root mean squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the difference.
    pub distance: f64,
    /// Scale: the norm of the reference, at least the smallest that counts.
    pub size: f64,
}

impl Difference {
    /// The distance as a share of the size.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.distance == 0.0 { 0.0 } else { self.distance / self.size }
    }
}

/// Distance of two states, or of two runs at an output time of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// The time of the first.
    pub time: f64,
    /// Of positions, after the rigid motion that makes it least, against the displacement.
    pub shape: Difference,
    /// The number of the species that differs most against its values, and its difference.
    pub species: Option<(usize, Difference)>,
}

impl Distance {
    /// Relative difference of shapes.
    #[must_use]
    pub fn of_shape(&self) -> f64 {
        self.shape.relative()
    }

    /// Relative difference of the species that differs most; 0 without species.
    #[must_use]
    pub fn of_species(&self) -> f64 {
        self.species.map_or(0.0, |(_, by)| by.relative())
    }

    /// The larger of the two.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.of_species().max(self.of_shape())
    }

    /// The number of the species that differs most, none where shapes differ more, and the difference.
    #[must_use]
    pub fn worst(&self) -> (Option<usize>, Difference) {
        match self.species {
            Some((which, by)) if by.relative() > self.of_shape() => (Some(which), by),
            _ => (None, self.shape),
        }
    }
}

/// Relative distance of shapes or species beyond which two runs of a comparison count as diverged.
pub const DIVERGED: f64 = 0.2;
/// The same of references, which are so tight that half of it cannot be an error of the integration in time.
pub const REFERENCES_DIVERGED: f64 = 0.5 * DIVERGED;

/// Where two runs diverge: the first of their distances beyond `bound`. They are on different branches of a
/// bifurcation from there on, or too far from one another for a larger distance to mean more.
pub fn first_beyond(course: &[Distance], bound: f64) -> Option<&Distance> {
    course.iter().find(|distance| distance.largest() > bound)
}

/// The largest distances of `course`: of shapes, of species.
pub(in crate::study) fn largest<'a>(
    course: impl Iterator<Item = &'a Distance>,
) -> Option<(f64, f64)> {
    let larger = |(a, b): (f64, f64), (c, d): (f64, f64)| (a.max(c), b.max(d));
    course.map(|d| (d.of_shape(), d.of_species())).reduce(larger)
}

/// Distance of one run from another over the output times they have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// At every time.
    pub course: Vec<Distance>,
    /// Largest distances before the runs diverge: of shapes, of species; none if they begin apart.
    pub largest: Option<(f64, f64)>,
    /// The first distance beyond [`DIVERGED`].
    pub diverged: Option<Distance>,
}

impl Deviations {
    /// Returns those of the distances along time.
    #[must_use]
    pub fn new(course: Vec<Distance>) -> Self {
        let diverged = first_beyond(&course, DIVERGED).copied();
        let before = course.iter().take_while(|d| diverged.is_none_or(|at| d.time < at.time));
        Self { largest: largest(before), diverged, course }
    }
}

/// The norm that differences of states of one model are measured in: a root mean square over the area at rest,
/// `‖f‖² = Σ A_i f_i² / Σ A_i`, so that it does not depend on where a mesh is fine. Points without a sheet count
/// alike. Of a periodic sheet one period counts.
#[derive(Debug, Clone)]
pub struct Norm {
    rest: Vec<Vec3>,
    /// Rigid motions of a periodic sheet and their radius; none of other sheets, which move freely.
    motions: Option<(Vec<Vector6<f64>>, f64)>,
    vertices: Vec<f64>,
    faces: Vec<f64>,
    species: Vec<(f64, Location)>,
    moves: bool,
}

impl Norm {
    /// Returns the norm on `sheet` with species of typical magnitudes at locations.
    #[must_use]
    pub fn new(sheet: &Sheet, species: Vec<(f64, Location)>) -> Self {
        let face = |corners: &[u32; 3]| {
            Face::from_corners(&corners.map(|v| sheet.rest()[v as usize])).area
        };
        let all = sheet.reduction();
        let own = all.owned(sheet.vertex_count());
        let counted = &sheet.triangles()[..all.owned(sheet.triangle_count())];
        let faces = counted.iter().map(face).collect();
        let mut vertices = lumped_areas(sheet);
        vertices.truncate(own);
        if sheet.triangle_count() == 0 {
            vertices.fill(1.0);
        }
        let motions = (!all.periods().is_empty()).then(|| {
            let free = vec![[false; 3]; sheet.vertex_count()];
            let (motions, radius) = free_motions(sheet.rest(), &free, all, |_| 1.0);
            (motions.iter().map(|motion| motion.parameters).collect(), radius)
        });
        let rest = sheet.rest()[..own].to_vec();
        Self { rest, motions, vertices, faces, species, moves: true }
    }

    /// Returns the norm of a model.
    pub(crate) fn of_model(model: &Model) -> Self {
        let all = |c: &crate::model::Chemistry| {
            let species = c.descriptor().species.iter().zip(c.all_typical());
            species.map(|(s, typical)| (typical, s.location)).collect()
        };
        let species = model.chemistry().map(all).unwrap_or_default();
        Self { moves: model.moves(), ..Self::new(model.sheet(), species) }
    }

    /// Whether there is a sheet, not points alone.
    pub(crate) fn has_sheet(&self) -> bool {
        !self.faces.is_empty()
    }

    /// Whether there are species to compare.
    pub(crate) fn has_species(&self) -> bool {
        !self.species.is_empty()
    }

    /// Whether the shape moves.
    pub(crate) fn shape_moves(&self) -> bool {
        self.moves
    }

    /// Distances of `states` from those of `reference` at the same times.
    #[must_use]
    pub fn course(&self, states: &[State], reference: &[State]) -> Vec<Distance> {
        let distance = |state: &State| {
            let same = |r: &&State| (r.time - state.time).abs() <= 1e-9 * state.time.abs();
            Some(self.distance(state, reference.iter().find(same)?))
        };
        states.iter().filter_map(distance).collect()
    }

    /// Distance of `a` from `b`.
    #[must_use]
    pub fn distance(&self, a: &State, b: &State) -> Distance {
        let [x, goal] = [&a.x, &b.x].map(|x| &x[..x.len().min(self.rest.len())]);
        let aligned = match &self.motions {
            None => aligned(x, goal),
            Some((motions, radius)) => aligned_by(motions, *radius, x, goal),
        };
        let over = |squares: &mut dyn Iterator<Item = f64>| mean(&self.vertices, squares).sqrt();
        let moved = over(&mut b.x.iter().zip(&self.rest).map(|(b, r)| (b - r).norm_squared()));
        let apart = over(&mut aligned.iter().zip(&b.x).map(|(a, b)| (a - b).norm_squared()));
        // A sheet that has not moved is compared with its size.
        let middle = self.rest.iter().sum::<Vec3>() / real(self.rest.len().max(1));
        let size = over(&mut self.rest.iter().map(|r| (r - middle).norm_squared()));
        let species = a.species.iter().zip(&b.species).zip(&self.species);
        let species = species.map(|((a, b), (typical, location))| {
            let weights = match location {
                Location::Face => &self.faces,
                Location::Vertex | Location::Edge => &self.vertices,
            };
            let size = mean(weights, &mut b.iter().map(|b| b * b)).sqrt().max(1e-3 * typical);
            let apart = mean(weights, &mut a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)));
            Difference { distance: apart.sqrt(), size }
        });
        let by = |a: &(usize, Difference), b: &(usize, Difference)| {
            a.1.relative().total_cmp(&b.1.relative())
        };
        let distance = if apart > ROUND_OFF * size { apart } else { 0.0 };
        let shape = Difference { distance, size: moved.max(DISPLACEMENT_FLOOR * size) };
        Distance { time: a.time, shape, species: species.enumerate().max_by(by) }
    }
}

/// The weighted mean of `values`; 0 of none.
fn mean(weights: &[f64], values: &mut dyn Iterator<Item = f64>) -> f64 {
    let mut sums = (0.0, 0.0);
    for (weight, value) in weights.iter().zip(values) {
        sums = (sums.0 + weight * value, sums.1 + weight);
    }
    if sums.1 > 0.0 { sums.0 / sums.1 } else { 0.0 }
}
