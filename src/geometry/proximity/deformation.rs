//! How far a patch of the sheet keeps its points apart: a lower Lipschitz bound of the deformation.
//!
//! F maps tangents at rest to the shape, R is a rotation near F on the patch, and `M = Rᵀ F`. Along a path from a to b
//! with unit tangents t that deviate from the chord, of direction u, by at most β (`clusters.rs`)
//!
//! ```text
//! (x(b) - x(a)) · R u = ∫ M t · u ds ≥ c |b - a|,    so |x(b) - x(a)| ≥ c |b - a|
//! c = m - (max |t · M t - m| + β max |M t - m t|) / cos β
//! ```
//!
//! for every m; the middle of the range of t · M t is taken. On a patch that is flat and convex at rest c is the least
//! eigenvalue of the symmetric part of M (as in Gale & Nikaido, *The Jacobian matrix and global univalence of mappings*,
//! Math. Ann. 159 (1965) 81, doi:10.1007/BF01360282, theorem 6): a sheet that is bent by less than 60° and not compressed to half keeps points further apart than half
//! of their distance at rest. c is concave along straight motions, and changes by at most `(1 + β)/cos β max |ΔF|`.

use nalgebra::{Matrix3, Rotation3};

use rumple_numerics::Vec3;
use rumple_numerics::parallel;
use rumple_sheet::Sheet;

use super::clusters::{Cluster, Patch};

/// F on the two tangents of a triangle.
pub(super) type Gradient = [Vec3; 2];

/// Accuracy of rotations, and how many iterations they may take. Every rotation serves; a good one serves best.
const ROTATION: (f64, usize) = (1e-3, 10);

/// The least change of F, in the Frobenius norm, that a patch has to leave room for.
const LEAST_ALLOWANCE: f64 = 0.03;
/// A bound is recomputed where less than this share of its allowance is left.
const RENEWED: f64 = 0.5;

/// Orthonormal tangents of a triangle at rest, and what makes F on them out of two edges.
#[derive(Debug, Clone, Copy)]
struct Tangents {
    of: [Vec3; 2],
    first: f64,
    second: [f64; 2],
}

/// Deformations of one sheet.
#[derive(Debug)]
pub(super) struct Deformation {
    tangents: Vec<Tangents>,
}

/// How far apart a patch keeps its points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    /// The columns of R.
    pub(super) rotation: [Vec3; 3],
    /// A lower bound of c where the patch holds, an upper one where it does not.
    least: f64,
    /// Whether c is large enough.
    pub(super) holds: bool,
    /// By how much F might change when c was last computed.
    allowed: f64,
}

impl Deformation {
    pub(super) fn new(sheet: &Sheet) -> Self {
        let tangents = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
            let (p, q) = (b - a, c - a);
            let t = p.normalize();
            let across = q - q.dot(&t) * t;
            let (length, height) = (p.norm(), across.norm());
            let second = [-q.dot(&t) / (length * height), 1.0 / height];
            Tangents { of: [t, across / height], first: 1.0 / length, second }
        };
        Self { tangents: sheet.triangles().iter().map(tangents).collect() }
    }

    /// F on every triangle of the shape `x`. Linear in `x`.
    pub(super) fn gradient(&self, sheet: &Sheet, x: &[Vec3], t: usize) -> Gradient {
        let [a, b, c] = sheet.triangles()[t].map(|v| x[v as usize]);
        let (p, q) = (b - a, c - a);
        let Tangents { first, second, .. } = self.tangents[t];
        [first * p, second[0] * p + second[1] * q]
    }

    /// By how much F of a triangle changes at most where every vertex moves by 1.
    pub(super) fn largest_change(&self, t: usize) -> f64 {
        let Tangents { first, second: [p, q], .. } = self.tangents[t];
        2.0 * first.hypot(p.abs() + q.abs())
    }

    pub(super) fn gradients(&self, sheet: &Sheet, x: &[Vec3]) -> Vec<Gradient> {
        let mut all = vec![[Vec3::zeros(); 2]; sheet.triangle_count()];
        parallel::fill(&mut all, |t| self.gradient(sheet, x, t));
        all
    }

    /// The bound for the patch of a cluster, where c is to be `needed`; nothing without a patch of use. The one
    /// `before` serves, less what F has `changed`, while that leaves enough.
    pub(super) fn bound(
        &self,
        cluster: &Cluster,
        gradients: &[Gradient],
        needed: f64,
        before: Option<(&Bound, f64)>,
    ) -> Option<Bound> {
        let patch = &cluster.patch;
        if patch.covers.is_empty() {
            return None;
        }
        if let Some((before, changed)) = before {
            let change = changed * patch.sensitivity();
            let least = if before.holds { before.least - change } else { before.least + change };
            let allowed = (least - needed) / patch.sensitivity();
            let enough = LEAST_ALLOWANCE.max(RENEWED * before.allowed);
            if before.holds == (allowed >= enough) {
                return Some(Bound { least, ..*before });
            }
        }
        let rotation = self.rotation(cluster, gradients)?;
        let least = self.least(patch, gradients, &rotation);
        let allowed = (least - needed) / patch.sensitivity();
        Some(Bound {
            rotation,
            least,
            holds: allowed >= LEAST_ALLOWANCE,
            allowed: allowed.max(0.0),
        })
    }

    /// A rotation near F on the triangles of a cluster, as its columns.
    fn rotation(&self, cluster: &Cluster, gradients: &[Gradient]) -> Option<[Vec3; 3]> {
        let mut sum = Matrix3::zeros();
        for t in &cluster.triangles {
            let ([s, t], [f, g]) = (self.tangents[*t as usize].of, gradients[*t as usize]);
            let normal = f.cross(&g).try_normalize(0.0)?;
            sum += f * s.transpose() + g * t.transpose() + normal * s.cross(&t).transpose();
        }
        let (eps, iterations) = ROTATION;
        let near = Rotation3::from_matrix_eps(&sum, eps, iterations, Rotation3::identity());
        let columns = near.matrix();
        Some(std::array::from_fn(|k| columns.column(k).into_owned()))
    }

    /// c of a patch, with the columns of a rotation.
    pub(super) fn least(
        &self,
        patch: &Patch,
        gradients: &[Gradient],
        [p, q, r]: &[Vec3; 3],
    ) -> f64 {
        let turned = |t: &Vec3| t.x * p + t.y * q + t.z * r;
        let of = |t: &u32| {
            let [s, across] = &self.tangents[*t as usize].of;
            ([turned(s), turned(across)], gradients[*t as usize])
        };
        let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        for t in &patch.triangles {
            let ([s, t], [f, g]) = of(t);
            let (along, across) = (s.dot(&f), t.dot(&g));
            let mixed = 0.5 * (s.dot(&g) + t.dot(&f));
            let (mean, half) = (0.5 * (along + across), 0.5 * (along - across));
            let deviation = (half * half + mixed * mixed).sqrt();
            least = least.min(mean - deviation);
            largest = largest.max(mean + deviation);
        }
        let turn = patch.turn;
        if turn == 0.0 {
            return least;
        }
        let middle = 0.5 * (least + largest);
        let mut whole = 0.0f64;
        for t in &patch.triangles {
            let ([s, t], [f, g]) = of(t);
            whole = whole.max((f - middle * s).norm_squared() + (g - middle * t).norm_squared());
        }
        middle - (0.5 * (largest - least) + turn * whole.sqrt()) / turn.cos()
    }
}

impl Bound {
    /// By how much F may change, in the Frobenius norm, until c has fallen to `needed`.
    pub(super) fn allowance(&self, patch: &Patch, needed: f64) -> f64 {
        (self.least - needed) / patch.sensitivity()
    }
}

/// |A - B|² in the Frobenius norm.
#[inline]
pub(super) fn change([a, b]: &Gradient, [c, d]: &Gradient) -> f64 {
    (a - c).norm_squared() + (b - d).norm_squared()
}

/// The largest of `changes` on a patch.
pub(super) fn largest_change(patch: &Patch, changes: &[f64]) -> f64 {
    patch.triangles.iter().map(|t| changes[*t as usize]).fold(0.0, f64::max)
}
