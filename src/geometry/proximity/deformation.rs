//! How far a patch of the sheet keeps its points apart: a lower Lipschitz bound of the deformation.
//!
//! F maps tangents at rest to the shape, R is a rotation near F on the patch, and `M = Rᵀ F`. Along a path from a to b
//! with unit tangents t that deviate from the chord, of direction u, by at most β (`patches.rs`)
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
//!
//! A smaller c follows from the mean F of the clusters of a patch (with a third column, the normal) and by how much
//! that of a triangle differs from it at most, δ: eigenvalues of the symmetric part of Rᵀ F change by at most δ, and those
//! of a symmetric 3 × 3 matrix A are within `q ± 2p` of `q = tr A/3`, `p² = |A - q|²/6`.

use nalgebra::{Matrix3, Rotation3};
use rumple_numerics::num::{index, real};
use rumple_numerics::{Vec3, parallel};
use rumple_sheet::Sheet;

use super::patches::{Cluster, Patch};

/// F on the two tangents of a triangle.
pub(super) type Gradient = [Vec3; 2];

/// Accuracy of rotations, and how many iterations they may take. Every rotation serves; a good one serves best.
const ROTATION: (f64, usize) = (1e-3, 10);

/// The least change of F, in the Frobenius norm, that a patch has to leave room for.
const MIN_ALLOWANCE: f64 = 0.03;
/// The bound of means serves where it leaves this change of F; else that of all triangles is computed.
const MEAN_BOUND_ALLOWANCE: f64 = 0.1;
/// A bound is recomputed where less than this share of its allowance is left.
const RENEWAL_SHARE: f64 = 0.5;

/// F of a cluster.
#[derive(Debug, Clone, Copy)]
struct Mean {
    /// The columns of the mean over its triangles.
    f: [Vec3; 3],
    /// By how much F of a triangle differs from it on tangents, at most.
    differs: f64,
}

/// The deformation at one shape.
#[derive(Debug)]
pub(super) struct Deformed {
    /// F of every triangle.
    pub(super) gradients: Vec<Gradient>,
    /// F of the clusters of the patches that it is asked for on; nothing where a triangle has no normal.
    means: Vec<Option<Mean>>,
}

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
    /// By how much F of a triangle of every cluster changes at most where every vertex moves by 1.
    pub(super) steepest: Vec<f64>,
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
    pub(super) fn new(sheet: &Sheet, clusters: &[Cluster]) -> Self {
        let tangents = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
            let (p, q) = (b - a, c - a);
            let t = p.normalize();
            let across = q - q.dot(&t) * t;
            let (length, height) = (p.norm(), across.norm());
            let second = [-q.dot(&t) / (length * height), 1.0 / height];
            Tangents { of: [t, across / height], first: 1.0 / length, second }
        };
        let tangents: Vec<Tangents> = sheet.triangles().iter().map(tangents).collect();
        let steep = |t: &u32| {
            let Tangents { first, second: [p, q], .. } = tangents[*t as usize];
            2.0 * first.hypot(p.abs() + q.abs())
        };
        let most = |cluster: &Cluster| cluster.triangles.iter().map(steep).fold(0.0, f64::max);
        let steepest = clusters.iter().map(most).collect();
        Self { tangents, steepest }
    }

    /// F on every triangle of the shape `x`. Linear in `x`.
    pub(super) fn gradient(&self, sheet: &Sheet, x: &[Vec3], t: usize) -> Gradient {
        let [a, b, c] = sheet.triangles()[t].map(|v| x[v as usize]);
        let (p, q) = (b - a, c - a);
        let Tangents { first, second, .. } = self.tangents[t];
        [first * p, second[0] * p + second[1] * q]
    }

    /// F on every triangle of the shape `x`.
    pub(super) fn gradients(&self, sheet: &Sheet, x: &[Vec3]) -> Vec<Gradient> {
        let mut gradients = vec![[Vec3::zeros(); 2]; sheet.triangle_count()];
        parallel::fill(&mut gradients, |t| self.gradient(sheet, x, t));
        gradients
    }

    /// The deformation with these `gradients`, on the patches that are `asked` for.
    pub(super) fn on_patches(
        &self,
        clusters: &[Cluster],
        gradients: Vec<Gradient>,
        asked: impl Fn(usize) -> bool,
    ) -> Deformed {
        let mut needed = vec![false; clusters.len()];
        for k in (0..clusters.len()).filter(|k| asked(*k)) {
            clusters[k].patch.clusters.iter().for_each(|k| needed[*k as usize] = true);
        }
        let mut means = vec![None; clusters.len()];
        let mean = |k: usize| self.mean(&clusters[k], &gradients);
        parallel::fill(&mut means, |k| needed[k].then(|| mean(k)).flatten());
        Deformed { gradients, means }
    }

    /// F of a cluster.
    fn mean(&self, cluster: &Cluster, gradients: &[Gradient]) -> Option<Mean> {
        let mut sum = [Vec3::zeros(); 3];
        for t in &cluster.triangles {
            let ([s, t], [f, g]) = (self.tangents[*t as usize].of, gradients[*t as usize]);
            let (normal, at_rest) = (f.cross(&g).try_normalize(0.0)?, s.cross(&t));
            for (k, column) in sum.iter_mut().enumerate() {
                *column += s[k] * f + t[k] * g + at_rest[k] * normal;
            }
        }
        let f = sum.map(|column| column / real(cluster.triangles.len().max(1)));
        let differs = |t: &u32| {
            let [s, across] = &self.tangents[*t as usize].of;
            change(&[times(&f, s), times(&f, across)], &gradients[*t as usize])
        };
        let most = cluster.triangles.iter().map(differs).fold(0.0, f64::max);
        Some(Mean { f, differs: most.sqrt() })
    }

    /// The bound for the patch of cluster `k`, where c is to be `needed`; nothing without a patch of use.
    pub(super) fn bound(
        &self,
        (cluster, k): (&Cluster, usize),
        deformed: &Deformed,
        needed: f64,
    ) -> Option<Bound> {
        let patch = &cluster.patch;
        if patch.covers.is_empty() {
            return None;
        }
        let own = patch.clusters.binary_search(&index(k)).unwrap_or(0);
        let rotation = deformed.rotation(patch.clusters[own] as usize)?;
        let allowed = |least: f64| (least - needed) / patch.sensitivity();
        let of_means = deformed
            .least(patch, &rotation)
            .filter(|least| allowed(*least) >= MEAN_BOUND_ALLOWANCE);
        let all = || {
            let flat = patch.triangles.first().filter(|_| patch.turn == 0.0);
            let most =
                flat.map(|t| deformed.most(patch, &self.tangents[*t as usize].of, &rotation));
            let too_little = most.filter(|most| allowed(*most) < MIN_ALLOWANCE);
            too_little.unwrap_or_else(|| self.least(patch, &deformed.gradients, &rotation))
        };
        let least = of_means.unwrap_or_else(all);
        Some(Bound {
            rotation,
            least,
            holds: allowed(least) >= MIN_ALLOWANCE,
            allowed: allowed(least).max(0.0),
        })
    }

    /// Whether c of a patch is `needed` at least.
    pub(super) fn keeps(
        &self,
        patch: &Patch,
        deformed: &Deformed,
        bound: &Bound,
        needed: f64,
    ) -> bool {
        let rotation = &bound.rotation;
        deformed.least(patch, rotation).is_some_and(|least| least >= needed)
            || self.least(patch, &deformed.gradients, rotation) >= needed
    }

    /// c of a patch, with the columns of a rotation.
    fn least(&self, patch: &Patch, gradients: &[Gradient], [p, q, r]: &[Vec3; 3]) -> f64 {
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
        if patch.turn == 0.0 {
            return least;
        }
        let middle = 0.5 * (least + largest);
        let mut whole = 0.0f64;
        for t in &patch.triangles {
            let ([s, t], [f, g]) = of(t);
            whole = whole.max((f - middle * s).norm_squared() + (g - middle * t).norm_squared());
        }
        patch.bound(least, largest, whole.sqrt())
    }
}

impl Deformed {
    /// A rotation near F on the triangles of cluster `k`, as its columns.
    fn rotation(&self, k: usize) -> Option<[Vec3; 3]> {
        let (eps, iterations) = ROTATION;
        let f = Matrix3::from_columns(&self.means[k]?.f);
        let near = Rotation3::from_matrix_eps(&f, eps, iterations, Rotation3::identity());
        let columns = near.matrix();
        Some(std::array::from_fn(|k| columns.column(k).into_owned()))
    }

    /// A lower bound of c of a patch by the means of its clusters.
    fn least(&self, patch: &Patch, rotation: &[Vec3; 3]) -> Option<f64> {
        let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in &patch.clusters {
            let Mean { f, differs } = self.means[*k as usize]?;
            let m = |a: usize, b: usize| rotation[a].dot(&f[b]);
            let third = (m(0, 0) + m(1, 1) + m(2, 2)) / 3.0;
            let [x, y, z] = [0, 1, 2].map(|a| m(a, a) - third);
            let [u, v, w] = [(0, 1), (0, 2), (1, 2)].map(|(a, b)| 0.5 * (m(a, b) + m(b, a)));
            let squared = x * x + y * y + z * z + 2.0 * (u * u + v * v + w * w);
            let deviation = 2.0 * (squared / 6.0).sqrt() + differs;
            least = least.min(third - deviation);
            largest = largest.max(third + deviation);
        }
        if patch.turn == 0.0 {
            return Some(least);
        }
        let middle = 0.5 * (least + largest);
        let whole = |k: &u32| {
            let Mean { f, differs } = self.means[*k as usize]?;
            let apart = |a: usize| (f[a] - middle * rotation[a]).norm_squared();
            Some((apart(0) + apart(1) + apart(2)).sqrt() + differs)
        };
        let whole = patch.clusters.iter().filter_map(whole).fold(0.0, f64::max);
        Some(patch.bound(least, largest, whole))
    }
}

impl Deformed {
    /// An upper bound of c of a patch that is flat at rest, with the tangents of one of its triangles: the least
    /// eigenvalue is a concave function, of which no value is below the mean.
    fn most(&self, patch: &Patch, [s, t]: &[Vec3; 2], rotation: &[Vec3; 3]) -> f64 {
        let [along, across] = [s, t].map(|tangent| times(rotation, tangent));
        let of = |k: &u32| {
            let f = &self.means[*k as usize].as_ref()?.f;
            let [g, h] = [s, t].map(|tangent| times(f, tangent));
            let (first, second) = (along.dot(&g), across.dot(&h));
            let mixed = 0.5 * (along.dot(&h) + across.dot(&g));
            let half = 0.5 * (first - second);
            Some(0.5 * (first + second) - (half * half + mixed * mixed).sqrt())
        };
        let within = patch.covers.iter().filter(|k| patch.clusters.binary_search(k).is_ok());
        within.filter_map(of).fold(f64::INFINITY, f64::min)
    }
}

impl Bound {
    /// The same where F of the patch has `changed`, while that leaves enough.
    pub(super) fn after(self, changed: f64, patch: &Patch, needed: f64) -> Option<Self> {
        let change = changed * patch.sensitivity();
        let least = if self.holds { self.least - change } else { self.least + change };
        let after = Self { least, ..self };
        let enough = MIN_ALLOWANCE.max(RENEWAL_SHARE * self.allowed);
        (self.holds == (after.allowance(patch, needed) >= enough)).then_some(after)
    }

    /// By how much F may change, in the Frobenius norm, until c has fallen to `needed`.
    pub(super) fn allowance(&self, patch: &Patch, needed: f64) -> f64 {
        (self.least - needed) / patch.sensitivity()
    }
}

/// The matrix with these columns times a vector.
#[inline]
fn times(columns: &[Vec3; 3], v: &Vec3) -> Vec3 {
    columns[0] * v.x + columns[1] * v.y + columns[2] * v.z
}

/// |A - B|² in the Frobenius norm.
#[inline]
pub(super) fn change([a, b]: &Gradient, [c, d]: &Gradient) -> f64 {
    (a - c).norm_squared() + (b - d).norm_squared()
}

/// The largest |ΔF| of the triangles of every cluster.
pub(super) fn changes(clusters: &[Cluster], from: &[Gradient], to: &[Gradient]) -> Vec<f64> {
    let mut all = vec![0.0; clusters.len()];
    parallel::fill(&mut all, |k| {
        let of = |t: &u32| change(&from[*t as usize], &to[*t as usize]);
        clusters[k].triangles.iter().map(of).fold(0.0, f64::max).sqrt()
    });
    all
}
