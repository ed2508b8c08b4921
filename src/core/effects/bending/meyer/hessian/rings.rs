//! The outer part of the second derivatives, one ring of vertices at a time.
//!
//! Each block (p, q) of a ring is a sum of outer products `Σ_k a_k(p) b_k(q)ᵀ`: three from `|J|²`,
//! two more from the rest of `f''`.

use super::super::parts::{At, Local};
use super::super::weight::BendingWeight;
use crate::Vec3;
use crate::geometry::{AreaRule, Face, Shape};
use crate::linear::{Elements, Packed, Rows, Sink};
use crate::parallel::simd::Simd;

/// Ring sizes up to which nothing is allocated.
const INLINE_RING: usize = 12;

/// Outer part of the interior vertices.
pub(super) struct OuterPart<'a> {
    pub at: At<'a>,
    pub shape: Shape<'a>,
    pub local: &'a Local,
    /// Whether to add what is not positive.
    pub second_order: bool,
}

/// First derivatives of one vertex's gathered quantities by one vertex of its ring.
#[derive(Clone, Copy)]
struct Derivatives {
    /// Rows of `∂L`, later of `J = ∂L - (L/A) ⊗ ∂A`.
    curvature: [Vec3; 3],
    /// `∂A`.
    area: Vec3,
    /// `∂Θ`.
    angle: Vec3,
}

impl Derivatives {
    const ZERO: Self = {
        let zero = Vec3::new(0.0, 0.0, 0.0);
        Self { curvature: [zero; 3], area: zero, angle: zero }
    };
}

/// The factors of a ring vertex: as columns on the left and as rows on the right of a block.
#[derive(Clone, Copy)]
struct Factors<L, const K: usize> {
    left: [Packed<L>; K],
    right: [Packed<L>; K],
}

impl Elements for OuterPart<'_> {
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, elements: &[u32], rows: &mut Rows<'_>) {
        if self.second_order {
            self.add_all::<S, 5>(simd, elements, rows);
        } else {
            self.add_all::<S, 3>(simd, elements, rows);
        }
    }
}

impl OuterPart<'_> {
    #[inline(always)]
    fn add_all<S: Simd, const K: usize>(&self, simd: S, elements: &[u32], rows: &mut Rows<'_>) {
        let zero = Packed([simd.splat(0.0); 2], 0.0);
        let factors = Factors { left: [zero; K], right: [zero; K] };
        let (mut few, mut few_factors) = ([Derivatives::ZERO; INLINE_RING], [factors; INLINE_RING]);
        let (mut many, mut many_factors) = (Vec::new(), Vec::new());
        for &i in elements {
            let mut sink = rows.sink(i);
            let size = sink.vertices().len();
            let (ring, factors) = if size <= INLINE_RING {
                (&mut few[..size], &mut few_factors[..size])
            } else {
                many.resize(size, Derivatives::ZERO);
                many_factors.resize(size, factors);
                (&mut many[..], &mut many_factors[..])
            };
            self.differentiate(i as usize, ring);
            self.add_ring(simd, i as usize, ring, factors, &mut sink);
        }
    }

    /// Derivatives of what vertex `i` gathers by the vertices of its ring.
    #[inline(always)]
    fn differentiate(&self, i: usize, ring: &mut [Derivatives]) {
        let Self { at: At { bending, .. }, shape, .. } = self;
        ring.fill(Derivatives::ZERO);
        let incident = shape.sheet.vertex_triangles().entries(i);
        for (&(t, k), local) in incident.iter().zip(self.local.corners_of(i)) {
            let (t, k) = (t as usize, k as usize % 3);
            let corners = shape.corners(t);
            let face = Face::from_corners(&corners);
            let (n, e) = (face.normal, edges_of(&corners));
            let mut area_slopes = [Vec3::zeros(); 3];
            if bending.area.rule() == AreaRule::MixedVoronoi {
                let mut unit = [0.0; 3];
                unit[k] = 1.0;
                bending.area.add_gradient(shape, t, unit, &mut area_slopes);
            } else {
                let half = 0.5 * bending.area.fractions()[t][k];
                for m in 0..3 {
                    area_slopes[m] = half * n.cross(&e[m]);
                }
            }
            let mut angle_slopes = [Vec3::zeros(); 3];
            if self.second_order {
                angle_slopes = angle_gradient(&e, &n, k);
            }
            let inverse = 0.5 / face.area;
            for m in 0..3 {
                let Some(place) = ring.get_mut(usize::from(local[m])) else { continue };
                let along = (inverse * e[k].dot(&e[m])) * n;
                let [x, y, z] = &mut place.curvature;
                *x += n.x * along;
                *y += n.y * along;
                *z += n.z * along;
                place.area += area_slopes[m];
                place.angle += angle_slopes[m];
                // Plus [n]× for the corner before k, minus [n]× for the one after.
                let turn = match (m + 3 - k) % 3 {
                    1 => -n,
                    2 => n,
                    _ => continue,
                };
                x.y -= turn.z;
                x.z += turn.y;
                y.x += turn.z;
                y.z -= turn.x;
                z.x -= turn.y;
                z.y += turn.x;
            }
        }
    }

    #[inline(always)]
    fn add_ring<S: Simd, const K: usize>(
        &self,
        simd: S,
        i: usize,
        ring: &mut [Derivatives],
        factors: &mut [Factors<S::Lanes, K>],
        sink: &mut Sink<'_>,
    ) {
        let bending = self.at.bending;
        let [x, y, z, area, angles] = self.at.gathered[i];
        let l = Vec3::new(x, y, z);
        let ratio = l / area;
        let (quarter, gaussian) = (0.25 * bending.rigidity.at(i), bending.gaussian.at(i));
        let printed = bending.weight == BendingWeight::Paper;
        let square = if printed { quarter / (area * area) } else { quarter / area };
        let cross = -square / area;
        let by_area =
            -2.0 * gaussian * (2.0 * std::f64::consts::PI - angles) / (area * area * area);
        let by_angle = -gaussian / (area * area);
        for (vertex, factors) in ring.iter_mut().zip(factors.iter_mut()) {
            let [x, y, z] = &mut vertex.curvature;
            *x -= ratio.x * vertex.area;
            *y -= ratio.y * vertex.area;
            *z -= ratio.z * vertex.area;
            let rows = [*x, *y, *z];
            for k in 0..3 {
                factors.left[k] = left(simd, square * rows[k]);
                factors.right[k] = right(simd, rows[k]);
            }
            if K == 5 {
                let along = l.x * rows[0] + l.y * rows[1] + l.z * rows[2];
                let rest = cross * along + by_angle * vertex.angle;
                factors.left[K - 2] = left(simd, rest + by_area * vertex.area);
                factors.right[K - 2] = right(simd, vertex.area);
                factors.left[K - 1] = left(simd, vertex.area);
                factors.right[K - 1] = right(simd, rest);
            }
        }
        for p in 0..factors.len() {
            if !sink.wants(p) {
                continue;
            }
            let left = factors[p].left;
            for (q, other) in factors.iter().enumerate().skip(p) {
                let right = &other.right;
                let mut low = left[0].0[0] * right[0].0[0];
                let mut high = left[0].0[1] * right[0].0[1];
                let mut last = left[0].1 * right[0].1;
                for k in 1..K {
                    low = low + left[k].0[0] * right[k].0[0];
                    high = high + left[k].0[1] * right[k].0[1];
                    last += left[k].1 * right[k].1;
                }
                sink.add_packed(simd, p, q, Packed([low, high], last));
            }
        }
    }
}

/// A column, repeated for the three columns of a block.
#[inline(always)]
fn left<S: Simd>(simd: S, a: Vec3) -> Packed<S::Lanes> {
    Packed([simd.load([a.x, a.y, a.z, a.x]), simd.load([a.y, a.z, a.x, a.y])], a.z)
}

/// A row, each number repeated for its column of a block.
#[inline(always)]
fn right<S: Simd>(simd: S, b: Vec3) -> Packed<S::Lanes> {
    Packed([simd.load([b.x, b.x, b.x, b.y]), simd.load([b.y, b.y, b.z, b.z])], b.z)
}

/// Edge vectors `e_k` opposite corner k.
#[inline(always)]
fn edges_of([a, b, c]: &[Vec3; 3]) -> [Vec3; 3] {
    [c - b, a - c, b - a]
}

/// `∂θ_k/∂x` for the corners of a triangle.
#[inline(always)]
fn angle_gradient(e: &[Vec3; 3], n: &Vec3, k: usize) -> [Vec3; 3] {
    let (next, last) = ((k + 1) % 3, (k + 2) % 3);
    let (u, w) = (e[last], -e[next]);
    let mut gradient = [Vec3::zeros(); 3];
    gradient[next] = (-1.0 / u.norm_squared()) * n.cross(&u);
    gradient[last] = (1.0 / w.norm_squared()) * n.cross(&w);
    gradient[k] = -(gradient[next] + gradient[last]);
    gradient
}
