//! The rest metric: optimal bond lengths `l̄_ij = Φ_ij l⁰_ij` and the areas they imply.
//!
//! Active strain enters mechanics here and nowhere else: kinetics return the length factor Φ at
//! the bonds, and stretching, tension and areas read the lengths.

use crate::parallel;
use crate::sheet::{Sheet, SheetError};

/// Optimal lengths of the edges and optimal areas of the triangles.
#[derive(Debug, Clone)]
pub struct RestMetric {
    reference_length: Vec<f64>,
    length: Vec<f64>,
    area: Vec<f64>,
    mean_edge: f64,
}

impl RestMetric {
    /// The metric of the rest positions, Φ = 1.
    ///
    /// # Errors
    /// An edge without length or a triangle without area.
    pub fn new(sheet: &Sheet) -> Result<Self, SheetError> {
        let rest = sheet.rest();
        let length: Vec<f64> = sheet
            .edges()
            .iter()
            .map(|e| (rest[e.vertices[0] as usize] - rest[e.vertices[1] as usize]).norm())
            .collect();
        if let Some(e) = length.iter().position(|l| !(*l > 0.0 && l.is_finite())) {
            let [a, b] = sheet.edges()[e].vertices;
            return Err(SheetError::Unusable(format!(
                "the edge between vertices {a} and {b} has rest length {}",
                length[e]
            )));
        }
        let mean_edge = length.iter().sum::<f64>() / crate::num::real(length.len().max(1));
        let mut metric = Self {
            reference_length: length.clone(),
            length,
            area: vec![0.0; sheet.triangle_count()],
            mean_edge,
        };
        metric.update_areas(sheet)?;
        Ok(metric)
    }

    /// Sets `l̄ = Φ l⁰` from the length factor at every edge.
    ///
    /// # Errors
    /// Lengths that violate the triangle inequality, with the triangle and its three lengths; the
    /// metric is unchanged then.
    pub fn set_length_factor(&mut self, sheet: &Sheet, factor: &[f64]) -> Result<(), SheetError> {
        let reference = &self.reference_length;
        let mut length: Vec<f64> = vec![0.0; factor.len()];
        parallel::fill(&mut length, |e| factor[e] * reference[e]);
        std::mem::swap(&mut self.length, &mut length);
        let result = self.update_areas(sheet);
        if result.is_err() {
            self.length = length;
            self.update_areas(sheet)?;
        }
        result
    }

    /// Optimal lengths `l̄`, one per edge.
    #[must_use]
    pub fn length(&self) -> &[f64] {
        &self.length
    }

    /// Lengths `l⁰` in the rest positions, one per edge.
    #[must_use]
    pub fn reference_length(&self) -> &[f64] {
        &self.reference_length
    }

    /// Optimal areas `Ā`, one per triangle, from the optimal lengths.
    #[must_use]
    pub fn area(&self) -> &[f64] {
        &self.area
    }

    /// Mean edge length of the rest positions.
    #[must_use]
    pub fn mean_edge(&self) -> f64 {
        self.mean_edge
    }

    fn update_areas(&mut self, sheet: &Sheet) -> Result<(), SheetError> {
        let length = &self.length;
        let edges = sheet.triangle_edges();
        parallel::fill(&mut self.area, |t| heron_area(edges[t].map(|e| length[e as usize])));
        match self.area.iter().position(|a| !(*a > 0.0)) {
            None => Ok(()),
            Some(t) => Err(SheetError::Unusable(format!(
                "the optimal lengths {:?} of triangle {t} (vertices {:?}) do not make a triangle: \
                 the active strain changes too much from one vertex to the next; use a finer mesh \
                 or a smoother length factor",
                edges[t].map(|e| length[e as usize]),
                sheet.triangles()[t]
            ))),
        }
    }
}

/// Area of the triangle with the given sides, by Kahan's stable form of Heron's formula;
/// 0 or NaN if there is no such triangle.
///
/// With `a ≥ b ≥ c`: `A = ¼ √((a+(b+c)) (c-(a-b)) (c+(a-b)) (a+(b-c)))`.
#[must_use]
pub fn heron_area(sides: [f64; 3]) -> f64 {
    let mut s = sides;
    s.sort_unstable_by(|p, q| q.total_cmp(p));
    let [a, b, c] = s;
    let gap = c - (a - b);
    if !(gap > 0.0) {
        return 0.0;
    }
    0.25 * ((a + (b + c)) * gap * (c + (a - b)) * (a + (b - c))).sqrt()
}
