//! What changes along a branch: the shape and the species, and differences of them.

use crate::Vec3;
use crate::parallel;

/// Positions and species, or a change of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unknowns {
    /// Of every vertex.
    pub x: Vec<Vec3>,
    /// Of every species at its points; none on branches of mechanics alone.
    pub species: Vec<Vec<f64>>,
}

impl Unknowns {
    /// As many zeros.
    #[must_use]
    pub(crate) fn zeros_like(&self) -> Self {
        let species = self.species.iter().map(|values| vec![0.0; values.len()]).collect();
        Self { x: vec![Vec3::zeros(); self.x.len()], species }
    }

    /// Multiplies all by `factor`.
    pub fn scale(&mut self, factor: f64) {
        parallel::update(&mut self.x, |_, v| *v *= factor);
        self.species.iter_mut().flatten().for_each(|value| *value *= factor);
    }

    /// With `factor` times `other` added.
    #[must_use]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        parallel::update(&mut sum.x, |i, v| *v += factor * other.x[i]);
        for (values, others) in sum.species.iter_mut().zip(&other.species) {
            parallel::update(values, |i, value| *value += factor * others[i]);
        }
        sum
    }
}

/// A change of shape, species and parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Of shape and species; 0 along fixed directions.
    pub unknowns: Unknowns,
    /// Of the parameter.
    pub parameter: f64,
}

impl Direction {
    /// Multiplies it by `factor`.
    pub(super) fn scale(&mut self, factor: f64) {
        self.unknowns.scale(factor);
        self.parameter *= factor;
    }
}
