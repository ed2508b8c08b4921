//! Error norm of integrations that no rotation of the sheet changes.
//!
//! diffsol measures errors, Newton corrections and first slopes in the norm of its vectors. That of its own vectors
//! compares every component with a tolerance of its own, `atol + rtol |y_i|`: the same displacement counts more along
//! an axis along which its vertex has moved less, and steps depend on the axes. Here
//!
//! ```text
//! |e|² = 1/n ( Σ_vertices |e_v|²/(atol + rtol |u_v|)²  +  Σ_others e_i²/(atol_i + rtol |y_i|)² )
//! ```
//!
//! with the length of a vertex' displacement u_v, components for all other unknowns, and n terms: directions in which
//! nothing moves, as in a plane, do not count.

use std::sync::Arc;

use diffsol_la::{Context, LaError, VectorIndex};

use crate::linear::Displacements;

/// Which unknowns are the displacement of one vertex; travels with every vector as its context.
#[derive(Debug, Clone, Default)]
pub(super) struct Grouping {
    /// Places of the components of every vertex that moves.
    vertices: Arc<[[Option<u32>; 3]]>,
    /// Number of unknowns that are displacements; they come first.
    count: usize,
}

impl Grouping {
    /// Groups the displacements, if there are any.
    pub(super) fn new(displacements: Option<&Displacements>) -> Self {
        let Some(displacements) = displacements else { return Self::default() };
        let narrow = |place: usize| u32::try_from(place).ok();
        let places =
            displacements.place.iter().map(|axes| axes.map(|place| place.and_then(narrow)));
        let vertices = places.filter(|axes| axes.iter().any(Option::is_some)).collect();
        Self { vertices, count: displacements.count }
    }

    /// Squares of `x` over its tolerance: of every vertex' displacement, then of every other unknown.
    pub(super) fn ratios<'a>(
        &'a self,
        x: &'a [f64],
        y: &'a [f64],
        (atol, rtol): (&'a [f64], f64),
    ) -> impl Iterator<Item = f64> + 'a {
        let vertices = self.vertices.iter().map(move |axes| {
            let (mut length, mut moved, mut least) = (0.0, 0.0, 0.0);
            for place in axes.iter().flatten() {
                let place = *place as usize;
                length += x[place] * x[place];
                moved += y[place] * y[place];
                least = atol[place];
            }
            let tolerance = moved.sqrt() * rtol + least;
            length / (tolerance * tolerance)
        });
        let others = (self.count..x.len()).map(move |i| {
            let ratio = x[i] / (y[i].abs() * rtol + atol[i]);
            ratio * ratio
        });
        vertices.chain(others)
    }

    /// Mean square of `x` over its tolerance.
    pub(super) fn squared_norm(&self, x: &[f64], y: &[f64], tolerance: (&[f64], f64)) -> f64 {
        let count = self.vertices.len() + (x.len() - self.count);
        self.ratios(x, y, tolerance).sum::<f64>() / crate::num::real(count.max(1))
    }
}

impl Context for Grouping {
    fn clone_with_nbatch(&self, batches: usize) -> Result<Self, LaError> {
        match batches {
            1 => Ok(self.clone()),
            _ => Err(LaError::Other("unknowns are not integrated in batches".into())),
        }
    }
}

/// Places of unknowns.
#[derive(Debug, Clone)]
pub(super) struct Places {
    places: Vec<usize>,
    context: Grouping,
}

impl Places {
    /// The places.
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.places.iter().copied()
    }
}

impl VectorIndex for Places {
    type C = Grouping;

    fn context(&self) -> &Grouping {
        &self.context
    }

    fn zeros(len: usize, context: Grouping) -> Self {
        Self { places: vec![0; len], context }
    }

    fn len(&self) -> usize {
        self.places.len()
    }

    fn clone_as_vec(&self) -> Vec<usize> {
        self.places.clone()
    }

    fn from_vec(places: Vec<usize>, context: Grouping) -> Self {
        Self { places, context }
    }
}
