//! The rest metric: optimal bond lengths `l̄_ij = Φ_ij l⁰_ij` and the areas they imply.
//!
//! Active strain enters mechanics here and nowhere else: kinetics return the length factor Φ at
//! the bonds, and stretching, tension and areas read the lengths.
//!
//! Where Φ jumps from one vertex to the next (Model I: by 1.54 across a front one edge wide), three
//! optimal lengths need not make a triangle. Bonds do not mind, but their weight does: it must not
//! vanish. So there are two areas of a triangle,
//!
//! ```text
//! Ā_T  area of the triangle with sides l̄, by Heron's formula; 0 if there is none
//! max(Ā_T, ⅒ Φ_T² A⁰_T)  for weights, Φ_T the mean length factor of its edges
//! ```
//!
//! which are the same wherever the optimal triangle is not ten times flatter than the rest one.

use std::sync::Arc;

use rumple_numerics::parallel;
use rumple_sheet::{Sheet, SheetError};

/// Least share of `Φ² A⁰` that counts as a triangle's area in the weights of its bonds.
const MIN_AREA: f64 = 0.1;

/// Optimal lengths of the edges and optimal areas of the triangles; copies share them until they change.
#[derive(Debug, Clone, Default)]
pub struct RestMetric {
    reference_length: Arc<Vec<f64>>,
    length: Arc<Vec<f64>>,
    area: Arc<Vec<f64>>,
    reference_area: Arc<Vec<f64>>,
    weight_area: Arc<Vec<f64>>,
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
        let mut mean = [0.0, 0.0];
        for (edge, length) in sheet.edges().iter().zip(&length) {
            if sheet.counts(&edge.vertices) {
                mean = [mean[0] + length, mean[1] + 1.0];
            }
        }
        sheet.reduction().sum_over_ranks(&mut mean);
        let mean_edge = mean[0] / mean[1].max(1.0);
        let area: Vec<f64> = sheet
            .triangle_edges()
            .iter()
            .map(|edges| heron_area(edges.map(|e| length[e as usize])))
            .collect();
        // At Φ = 1 the three areas are the same.
        let (length, area) = (Arc::new(length), Arc::new(area));
        let metric = Self {
            reference_length: Arc::clone(&length),
            length,
            reference_area: Arc::clone(&area),
            weight_area: Arc::clone(&area),
            area,
            mean_edge,
        };
        if let Some(t) = metric.impossible_triangle() {
            return Err(SheetError::Unusable(metric.describe_impossible(sheet, t)));
        }
        Ok(metric)
    }

    /// Sets `l̄ = Φ l⁰` from the length factor at every edge.
    pub fn set_length_factor(&mut self, sheet: &Sheet, factor: &[f64]) {
        let reference = &self.reference_length;
        let length: &mut Vec<f64> = Arc::make_mut(&mut self.length);
        parallel::fill(length, |e| factor[e] * reference[e]);
        self.update_areas(sheet);
    }

    /// Optimal lengths `l̄`, one per edge.
    #[must_use]
    #[inline]
    pub fn length(&self) -> &[f64] {
        &self.length
    }

    /// Lengths `l⁰` in the rest positions, one per edge.
    #[must_use]
    #[inline]
    pub fn reference_length(&self) -> &[f64] {
        &self.reference_length
    }

    /// Optimal areas `Ā`, one per triangle, from the optimal lengths; 0 where these make none.
    #[must_use]
    #[inline]
    pub fn area(&self) -> &[f64] {
        &self.area
    }

    /// Mean edge length of the rest positions.
    #[must_use]
    #[inline]
    pub fn mean_edge(&self) -> f64 {
        self.mean_edge
    }

    /// Areas for weights: `max(Ā, ⅒ Φ² A⁰)`, one per triangle, never 0.
    #[must_use]
    #[inline]
    pub fn weight_area(&self) -> &[f64] {
        &self.weight_area
    }

    /// `∂Ā_T/∂l̄` by the three edges of triangle `t`, opposite each corner; zeros where there is no
    /// triangle.
    #[must_use]
    #[inline]
    pub fn area_gradient(&self, sheet: &Sheet, t: usize) -> [f64; 3] {
        let area = self.area[t];
        if !(area > 0.0) {
            return [0.0; 3];
        }
        let side = sheet.triangle_edges()[t].map(|e| self.length[e as usize]);
        let square = side.map(|l| l * l);
        let sum: f64 = square.iter().sum();
        std::array::from_fn(|k| side[k] * (sum - 2.0 * square[k]) / (8.0 * area))
    }

    /// Derivatives of [`RestMetric::weight_area`] by the three edges of triangle `t`.
    #[must_use]
    #[inline]
    pub fn weight_area_gradient(&self, sheet: &Sheet, t: usize) -> [f64; 3] {
        if self.weight_area[t] <= self.area[t] {
            return self.area_gradient(sheet, t);
        }
        let edges = sheet.triangle_edges()[t].map(|e| e as usize);
        let factor = edges.map(|e| self.length[e] / self.reference_length[e]);
        let mean = (factor[0] + factor[1] + factor[2]) / 3.0;
        edges.map(|e| {
            MIN_AREA * 2.0 / 3.0 * mean * self.reference_area[t] / self.reference_length[e]
        })
    }

    /// The first triangle whose optimal lengths violate the triangle inequality.
    #[must_use]
    pub fn impossible_triangle(&self) -> Option<usize> {
        self.area.iter().position(|a| !(*a > 0.0))
    }

    /// How many triangles have optimal lengths that violate the triangle inequality.
    #[must_use]
    pub fn impossible_triangles(&self) -> usize {
        self.area.iter().filter(|a| !(**a > 0.0)).count()
    }

    /// What is wrong with triangle `t`, in words.
    #[must_use]
    pub fn describe_impossible(&self, sheet: &Sheet, t: usize) -> String {
        format!(
            "the optimal lengths {:?} of triangle {t} (vertices {:?}) do not make a triangle: \
             the active strain changes too much from one vertex to the next; use a finer mesh \
             or a smoother length factor",
            sheet.triangle_edges()[t].map(|e| self.length[e as usize]),
            sheet.triangles()[t]
        )
    }

    fn update_areas(&mut self, sheet: &Sheet) {
        let (length, reference) = (&self.length, &self.reference_length);
        let edges = sheet.triangle_edges();
        let area: &mut Vec<f64> = Arc::make_mut(&mut self.area);
        parallel::fill(area, |t| heron_area(edges[t].map(|e| length[e as usize])));
        let (area, reference_area) = (&*area, &self.reference_area);
        let weight_area: &mut Vec<f64> = Arc::make_mut(&mut self.weight_area);
        parallel::fill(weight_area, |t| {
            let factor = edges[t].map(|e| length[e as usize] / reference[e as usize]);
            let mean = (factor[0] + factor[1] + factor[2]) / 3.0;
            area[t].max(MIN_AREA * mean * mean * reference_area[t])
        });
    }
}

/// Area of the triangle with the given sides, by Kahan's stable form of Heron's formula;
/// 0 or NaN if they violate the triangle inequality.
///
/// With `a ≥ b ≥ c`: `A = ¼ √((a+(b+c)) (c-(a-b)) (c+(a-b)) (a+(b-c)))`.
#[must_use]
fn heron_area(sides: [f64; 3]) -> f64 {
    let mut s = sides;
    s.sort_unstable_by(|p, q| q.total_cmp(p));
    let [a, b, c] = s;
    let gap = c - (a - b);
    if !(gap > 0.0) {
        return 0.0;
    }
    0.25 * ((a + (b + c)) * gap * (c + (a - b)) * (a + (b - c))).sqrt()
}
