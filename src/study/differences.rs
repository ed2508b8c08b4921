//! Distance of two states.

use crate::Vec3;
use crate::geometry::{Face, aligned, lumped_areas};
use crate::kinetics::Location;
use crate::model::{Model, State};
use crate::num::real;
use crate::sheet::Sheet;

/// Displacements below this share of the sheet's size are none.
const STILL: f64 = 1e-6;
/// What round-off of the alignment leaves, of the sheet's size, is not a distance.
const ROUND_OFF: f64 = 1e-13;

/// How far a field of one state is from that of another, each a root mean square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the difference.
    pub distance: f64,
    /// Of what it is compared with, or the least that counts if that is smaller.
    pub size: f64,
}

impl Difference {
    /// The distance as a share of the size.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.distance == 0.0 { 0.0 } else { self.distance / self.size }
    }
}

/// Differences of two states.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    /// Of positions, after the rigid motion that makes them least, against the displacement.
    pub shape: Difference,
    /// Of every species, against its values.
    pub species: Vec<Difference>,
}

impl Differences {
    /// The species with the largest relative difference, and that difference.
    #[must_use]
    pub fn worst_species(&self) -> Option<(usize, Difference)> {
        let by = |a: &(usize, Difference), b: &(usize, Difference)| {
            a.1.relative().total_cmp(&b.1.relative())
        };
        self.species.iter().copied().enumerate().max_by(by)
    }
}

/// The norm that differences of states of one model are measured in: a root mean square over the area at rest,
/// `‖f‖² = Σ A_i f_i² / Σ A_i`, so that it does not depend on where a mesh is fine. Points without a sheet count
/// alike.
#[derive(Debug, Clone)]
pub struct Norm {
    rest: Vec<Vec3>,
    vertices: Vec<f64>,
    faces: Vec<f64>,
    species: Vec<(f64, Location)>,
}

impl Norm {
    /// That of `sheet` with species of typical magnitudes at locations.
    #[must_use]
    pub fn new(sheet: &Sheet, species: Vec<(f64, Location)>) -> Self {
        let face = |corners: &[u32; 3]| Face::of(&corners.map(|v| sheet.rest()[v as usize])).area;
        let faces = sheet.triangles().iter().map(face).collect();
        let mut vertices = lumped_areas(sheet);
        if sheet.triangle_count() == 0 {
            vertices.fill(1.0);
        }
        Self { rest: sheet.rest().to_vec(), vertices, faces, species }
    }

    /// That of a model.
    #[must_use]
    pub fn of(model: &Model) -> Self {
        let all = |c: &crate::model::Chemistry| {
            c.descriptor().species.iter().map(|s| (s.typical, s.location)).collect()
        };
        Self::new(model.sheet(), model.chemistry().map(all).unwrap_or_default())
    }

    /// How many species there are.
    #[must_use]
    pub fn species(&self) -> usize {
        self.species.len()
    }

    /// How far `a` is from `b`.
    #[must_use]
    pub fn differences(&self, a: &State, b: &State) -> Differences {
        let aligned = aligned(&a.x, &b.x);
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
        Differences {
            shape: Difference {
                distance: if apart > ROUND_OFF * size { apart } else { 0.0 },
                size: moved.max(STILL * size),
            },
            species: species.collect(),
        }
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
