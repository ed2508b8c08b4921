//! The area `A_i` that belongs to a vertex, with its derivative.
//!
//! Written as corner shares of the triangles, `A_i = Σ_{T∋i} a_{T,i}(x)`:
//!
//! * frozen Voronoi: `a_{T,i} = ω_{T,i} A_T(x)`, with the fractions ω of the mixed-Voronoi split of
//!   the **rest** triangle; smooth in x and right on irregular vertices;
//! * barycentric: `ω = 1/3`; the mean curvature of a five-valent vertex on a sphere comes out 14 %
//!   too high and does not converge;
//! * mixed Voronoi, recomputed in x: `a = (|e_j|² cot θ_j + |e_k|² cot θ_k)/8` where the triangle
//!   is not obtuse, else `A/2` at the obtuse corner and `A/4` at the others. Only C⁰: forces jump
//!   where a triangle passes 90°.
//!
//! Reference: Meyer, Desbrun, Schröder & Barr, "Discrete differential-geometry operators for
//! triangulated 2-manifolds" (2003), doi:10.1007/978-3-662-05105-4_2.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use super::{Face, Shape};
use rumple_numerics::Vec3;
use rumple_sheet::Sheet;

/// How the area of a triangle is shared among its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AreaRule {
    /// Mixed-Voronoi fractions of the rest triangle times the current area.
    #[default]
    FrozenVoronoi,
    /// Mixed-Voronoi areas of the current triangle.
    MixedVoronoi,
    /// A third each.
    Barycentric,
}

/// A third of the rest areas of the triangles around every vertex: `Σ_i A⁰_i` is the area of the sheet.
///
/// They multiply a modulus (force/length³) to the stiffness of a vertex, so that results do not depend
/// on the mesh.
#[must_use]
pub fn lumped_areas(sheet: &Sheet) -> Vec<f64> {
    let mut area = vec![0.0; sheet.vertex_count()];
    let face =
        |t: usize| Face::from_corners(&sheet.triangles()[t].map(|v| sheet.rest()[v as usize]));
    sum_at_corners(sheet, |t| face(t).area / 3.0, &mut area);
    area
}

/// Writes at every vertex the sum of `share` over the triangles around it, taken in ascending order.
pub fn sum_at_corners(sheet: &Sheet, share: impl Fn(usize) -> f64, out: &mut [f64]) {
    out.fill(0.0);
    for (t, corners) in sheet.triangles().iter().enumerate() {
        let share = share(t);
        corners.iter().for_each(|v| out[*v as usize] += share);
    }
}

/// Corner shares for one sheet, the same for all copies.
#[derive(Debug, Clone)]
pub struct VertexArea {
    rule: AreaRule,
    fraction: Arc<OnceLock<Box<[[f64; 3]]>>>,
}

impl VertexArea {
    /// Prepares `rule` on the rest positions of `sheet`.
    #[must_use]
    pub fn new(sheet: &Sheet, rule: AreaRule) -> Self {
        let made = Self::lazy(rule);
        made.computed_fractions(sheet);
        made
    }

    /// The same, but fractions are computed at first use, of one sheet.
    #[must_use]
    pub fn lazy(rule: AreaRule) -> Self {
        Self { rule, fraction: Arc::default() }
    }

    /// The fractions ω, computed now if they were not before.
    #[inline]
    fn computed_fractions(&self, sheet: &Sheet) -> &[[f64; 3]] {
        self.fraction.get_or_init(|| match self.rule {
            AreaRule::FrozenVoronoi => (0..sheet.triangle_count())
                .map(|t| {
                    let corner = sheet.triangles()[t].map(|v| sheet.rest()[v as usize]);
                    let area = Face::from_corners(&corner).area;
                    mixed_voronoi(&corner, area).map(|share| share / area)
                })
                .collect(),
            AreaRule::Barycentric => vec![[1.0 / 3.0; 3]; sheet.triangle_count()].into(),
            AreaRule::MixedVoronoi => Box::default(),
        })
    }

    /// The rule in use.
    #[must_use]
    #[inline]
    pub fn rule(&self) -> AreaRule {
        self.rule
    }

    /// For the rules that freeze them, the fractions ω of every triangle; empty otherwise, and before they are
    /// computed.
    #[must_use]
    #[inline]
    pub fn fractions(&self) -> &[[f64; 3]] {
        self.fraction.get().map_or(&[], |fraction| fraction)
    }

    /// Areas of the three corners of triangle `t`.
    #[must_use]
    #[inline]
    pub fn corner_areas(&self, shape: &Shape<'_>, t: usize) -> [f64; 3] {
        let area = shape.face(t).area;
        match self.rule {
            AreaRule::MixedVoronoi => {
                let corner = shape.sheet.triangles()[t].map(|v| shape.x[v as usize]);
                mixed_voronoi(&corner, area)
            }
            _ => self.computed_fractions(shape.sheet)[t].map(|w| w * area),
        }
    }

    /// `Σ_k weight_k ∂a_{T,k}/∂A_T`, the part of the derivative that goes through the area.
    ///
    /// With fractions that are computed; for the rules that freeze them this is the whole derivative; for
    /// [`AreaRule::MixedVoronoi`] use [`VertexArea::add_gradient`].
    #[must_use]
    #[inline]
    pub fn derivative_by_area(&self, t: usize, weight: [f64; 3]) -> f64 {
        let w = self.fractions().get(t).copied().unwrap_or([1.0 / 3.0; 3]);
        w[0] * weight[0] + w[1] * weight[1] + w[2] * weight[2]
    }

    /// Adds `Σ_k weight_k ∂a_{T,k}/∂x_m` to `gradient[m]`, m = 0, 1, 2.
    pub fn add_gradient(
        &self,
        shape: &Shape<'_>,
        t: usize,
        weight: [f64; 3],
        gradient: &mut [Vec3; 3],
    ) {
        let face = shape.face(t);
        let e = shape.edge_vectors(t);
        if self.rule != AreaRule::MixedVoronoi {
            self.computed_fractions(shape.sheet);
            let factor = 0.5 * self.derivative_by_area(t, weight);
            for m in 0..3 {
                gradient[m] += factor * face.normal.cross(&e[m]);
            }
            return;
        }
        let cot = cotangents(&e, face.area);
        if let Some(k) = cot.iter().position(|c| *c <= 0.0) {
            let factor = 0.125 * (weight[0] + weight[1] + weight[2]) + 0.125 * weight[k];
            for m in 0..3 {
                gradient[m] += factor * face.normal.cross(&e[m]);
            }
            return;
        }
        // Corner k appears as |e_k|² cot θ_k in the shares of its two neighbours.
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let pair = (weight[i] + weight[j]) / 8.0;
            // d(|e_k|²) with e_k = x_j - x_i.
            gradient[j] += 2.0 * pair * cot[k] * e[k];
            gradient[i] -= 2.0 * pair * cot[k] * e[k];
            // cot θ_k = -e_i·e_j/(2A): d cot = -(de_i·e_j + e_i·de_j)/(2A) - cot dA/A.
            let c = pair * e[k].norm_squared();
            let q = c / (2.0 * face.area);
            gradient[k] -= q * (e[j] - e[i]);
            gradient[j] -= q * -e[j];
            gradient[i] -= q * e[i];
            for m in 0..3 {
                gradient[m] -= (0.5 * c * cot[k] / face.area) * face.normal.cross(&e[m]);
            }
        }
    }
}

/// Cotangents of the corner angles, from the oriented edges and the area.
fn cotangents(e: &[Vec3; 3], area: f64) -> [f64; 3] {
    std::array::from_fn(|k| -e[(k + 1) % 3].dot(&e[(k + 2) % 3]) / (2.0 * area))
}

/// Meyer's mixed area of each corner of a triangle.
fn mixed_voronoi(corner: &[Vec3; 3], area: f64) -> [f64; 3] {
    let e = [corner[2] - corner[1], corner[0] - corner[2], corner[1] - corner[0]];
    let cot = cotangents(&e, area);
    if let Some(k) = cot.iter().position(|c| *c <= 0.0) {
        return std::array::from_fn(|m| if m == k { 0.5 * area } else { 0.25 * area });
    }
    let q: [f64; 3] = std::array::from_fn(|k| e[k].norm_squared() * cot[k] / 8.0);
    [q[1] + q[2], q[2] + q[0], q[0] + q[1]]
}
