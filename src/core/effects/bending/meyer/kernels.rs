//! The Meyer energy four triangles at a time: see the parent module for the equations.

use std::f64::consts::PI;

use super::parts::{MeyerBending, VertexDerivatives};
use crate::Vec3;
use crate::geometry::{AreaRule, Shape};
use crate::parallel::element_blocks::{Corners, F64x4, Group, Kernel};
use crate::parallel::simd::{LANES, Lanes, Lanes3, Simd, angle};

/// Four triangles: edges `e_k` opposite corner k, unit normals, twice the areas.
pub(super) struct Triangles<L> {
    pub edge: [Lanes3<L>; 3],
    pub normal: Lanes3<L>,
    pub double_area: L,
}

impl<L: Lanes> Triangles<L> {
    #[inline(always)]
    pub fn gather<S: Simd<Lanes = L>>(
        simd: S,
        x: &[Vec3],
        [va, vb, vc]: [[u32; LANES]; 3],
    ) -> Self {
        let a = Lanes3::gather(simd, x, va);
        let b = Lanes3::gather(simd, x, vb);
        let c = Lanes3::gather(simd, x, vc);
        let edge = [c - b, a - c, b - a];
        let cross = edge[0].cross(edge[1]);
        let double_area = cross.dot(cross).sqrt();
        Self { edge, normal: cross.scale(simd.splat(1.0) / double_area), double_area }
    }

    /// Angle at corner `k`, well conditioned for needles and caps: its sine times both lengths is
    /// `2A`, its cosine `-e·e'`.
    #[inline(always)]
    fn angle<S: Simd<Lanes = L>>(&self, simd: S, k: usize) -> L {
        let cosine = -self.edge[(k + 1) % 3].dot(self.edge[(k + 2) % 3]);
        angle(simd, self.double_area, cosine)
    }
}

/// The numbers `value(0)`, … `value(3)` as lanes. A macro, because what is called through a closure
/// is not compiled for the wide registers.
macro_rules! lanes {
    ($simd:expr, $lane:ident => $value:expr) => {
        $simd.load([
            {
                let $lane = 0;
                $value
            },
            {
                let $lane = 1;
                $value
            },
            {
                let $lane = 2;
                $value
            },
            {
                let $lane = 3;
                $value
            },
        ])
    };
}

/// Areas of the triangles' corners.
#[inline(always)]
fn corner_areas<S: Simd>(
    simd: S,
    bending: &MeyerBending,
    shape: &Shape<'_>,
    group: &Group<3>,
    double_area: S::Lanes,
) -> [S::Lanes; 3] {
    let t = group.element;
    if bending.area.rule() == AreaRule::MixedVoronoi {
        let [a, b, c, d] = t.map(|t| bending.area.corner_areas(shape, t as usize));
        let areas = [a, b, c, d];
        return [
            lanes!(simd, i => areas[i][0]),
            lanes!(simd, i => areas[i][1]),
            lanes!(simd, i => areas[i][2]),
        ];
    }
    let [a, b, c] = fractions(simd, bending, t);
    let half = simd.splat(0.5) * double_area;
    [a * half, b * half, c * half]
}

/// Shares of the corners in the areas of four triangles.
#[inline(always)]
fn fractions<S: Simd>(simd: S, bending: &MeyerBending, [a, b, c, d]: [u32; 4]) -> [S::Lanes; 3] {
    let of = bending.area.fractions();
    let (a, b, c, d) = (&of[a as usize], &of[b as usize], &of[c as usize], &of[d as usize]);
    let [first, second, third, _] = simd.columns([
        [a[0], a[1], a[2], 0.0],
        [b[0], b[1], b[2], 0.0],
        [c[0], c[1], c[2], 0.0],
        [d[0], d[1], d[2], 0.0],
    ]);
    [first, second, third]
}

/// Sums over the triangles around every vertex: `L_i` and `A_i`; with twice four numbers, `Σθ` too.
pub(super) struct VertexSums<'a> {
    pub bending: &'a MeyerBending,
    pub shape: Shape<'a>,
}

impl VertexSums<'_> {
    #[inline(always)]
    fn triangles<S: Simd>(
        &self,
        simd: S,
        group: &Group<3>,
    ) -> (Triangles<S::Lanes>, [[S::Lanes; 4]; 3]) {
        let faces = Triangles::gather(simd, self.shape.x, group.vertex);
        let area = corner_areas(simd, self.bending, &self.shape, group, faces.double_area);
        let mut corner = [[area[0]; 4]; 3];
        let (a, b) = (faces.normal.cross(faces.edge[0]), faces.normal.cross(faces.edge[1]));
        // The edges add up to nothing.
        let l = [a, b, -(a + b)];
        for k in 0..3 {
            corner[k] = l[k].with(area[k]);
        }
        (faces, corner)
    }
}

impl Kernel<3, 1> for VertexSums<'_> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, Corners<S::Lanes, 3, 1>) {
        let (_, [a, b, c]) = self.triangles(simd, group);
        (simd.splat(0.0), [[a], [b], [c]])
    }
}

impl Kernel<3, 2> for VertexSums<'_> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, Corners<S::Lanes, 3, 2>) {
        let (faces, [a, b, c]) = self.triangles(simd, group);
        let zero = simd.splat(0.0);
        let first = faces.angle(simd, 0);
        let second = faces.angle(simd, 1);
        let third = simd.splat(PI) - first - second;
        (
            zero,
            [
                [a, [first, zero, zero, zero]],
                [b, [second, zero, zero, zero]],
                [c, [third, zero, zero, zero]],
            ],
        )
    }
}

/// Area vectors `½ (b - a) × (c - a)` of triangles, for the sums around every vertex.
pub(super) struct AreaVectors<'a> {
    pub x: &'a [Vec3],
}

impl Kernel<3, 1> for AreaVectors<'_> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, Corners<S::Lanes, 3, 1>) {
        let [va, vb, vc] = group.vertex;
        let a = Lanes3::gather(simd, self.x, va);
        let (b, c) = (Lanes3::gather(simd, self.x, vb) - a, Lanes3::gather(simd, self.x, vc) - a);
        let zero = simd.splat(0.0);
        let vector = b.cross(c).scale(simd.splat(0.5)).with(zero);
        (zero, [[vector], [vector], [vector]])
    }
}

/// The gradient that a vertex gathers; ANGLES if triangles may have derivatives by angles, NORMALS if
/// vertices have derivatives by their area vectors.
pub(super) struct Gradient<'a, const ANGLES: bool, const NORMALS: bool> {
    pub bending: &'a MeyerBending,
    pub vertex: &'a [VertexDerivatives],
    /// `∂U/∂N_i`; empty without NORMALS.
    pub by_normal: &'a [Vec3],
    pub shape: Shape<'a>,
}

impl<const ANGLES: bool, const NORMALS: bool> Gradient<'_, ANGLES, NORMALS> {
    pub(super) fn add_to(&self, gradient: &mut [Vec3]) {
        let write = |g: &mut Vec3, [F64x4([x, y, z, _])]: &[F64x4; 1]| *g += Vec3::new(*x, *y, *z);
        self.shape.sheet.triangle_blocks().accumulate(self, gradient, write);
    }
}

impl<const ANGLES: bool, const NORMALS: bool> Kernel<3, 1> for Gradient<'_, ANGLES, NORMALS> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, Corners<S::Lanes, 3, 1>) {
        let Triangles { edge: e, normal: n, double_area } =
            Triangles::gather(simd, self.shape.x, group.vertex);
        let one = simd.splat(1.0);
        let zero = simd.splat(0.0);
        let at = self.vertex;
        let vertex = &group.vertex;
        let (mut g, mut by_area) = ([Lanes3 { x: zero, y: zero, z: zero }; 3], [zero; 3]);
        for k in 0..3 {
            (g[k], by_area[k]) = derivatives(simd, at, vertex[k]);
        }
        let v = e[0].cross(g[0]) + e[1].cross(g[1]) + e[2].cross(g[2]);
        let frozen = self.bending.area.rule() != AreaRule::MixedVoronoi;
        let mut along = -(n.dot(v) / double_area);
        if frozen {
            let [a, b, c] = fractions(simd, self.bending, group.element);
            let share = by_area[0] * a + by_area[1] * b + by_area[2] * c;
            along = along + simd.splat(0.5) * share;
        }
        let mut q = v.scale(one / double_area) + n.scale(along);
        if NORMALS {
            q = q + corner_sum(simd, self.by_normal, vertex).scale(simd.splat(0.5));
        }
        if ANGLES && has_angle_terms(at, vertex) {
            // The derivatives by angles, Σ_k w_k ∂θ_k/∂x, have the form of those by vectors.
            let gamma = angle_coefficients(simd, at, vertex, &e);
            for k in 0..3 {
                g[k] = g[k] + e[k].scale(gamma[k]);
            }
        }
        let first = q.cross(e[0]) + (g[1] - g[2]).cross(n);
        let second = q.cross(e[1]) + (g[2] - g[0]).cross(n);
        // A triangle exerts no force as a whole.
        let third = -(first + second);
        let mut out = [first.with(zero), second.with(zero), third.with(zero)];
        if !frozen {
            add_area_gradient(simd, self, group, &mut out);
        }
        let [a, b, c] = out;
        (zero, [[a], [b], [c]])
    }
}

/// The sums of `from` over the corners of four triangles.
#[inline(always)]
pub(super) fn corner_sum<S: Simd>(
    simd: S,
    from: &[Vec3],
    [a, b, c]: &[[u32; LANES]; 3],
) -> Lanes3<S::Lanes> {
    Lanes3::gather(simd, from, *a) + Lanes3::gather(simd, from, *b) + Lanes3::gather(simd, from, *c)
}

/// `∂U/∂L_i` and `∂U/∂A_i` of four vertices.
#[inline(always)]
pub(super) fn derivatives<S: Simd>(
    simd: S,
    at: &[VertexDerivatives],
    [a, b, c, d]: [u32; 4],
) -> (Lanes3<S::Lanes>, S::Lanes) {
    let (a, b, c, d) = (&at[a as usize], &at[b as usize], &at[c as usize], &at[d as usize]);
    let [x, y, z, by_area] = simd.columns([
        [a.by_vector.x, a.by_vector.y, a.by_vector.z, a.by_area],
        [b.by_vector.x, b.by_vector.y, b.by_vector.z, b.by_area],
        [c.by_vector.x, c.by_vector.y, c.by_vector.z, c.by_area],
        [d.by_vector.x, d.by_vector.y, d.by_vector.z, d.by_area],
    ]);
    (Lanes3 { x, y, z }, by_area)
}

/// Whether any corner has a derivative by its angle.
#[inline(always)]
pub(super) fn has_angle_terms(at: &[VertexDerivatives], vertex: &[[u32; LANES]; 3]) -> bool {
    vertex.iter().flatten().any(|&v| at[v as usize].by_angle != 0.0)
}

/// `γ_k = (w_{k+1} - w_{k+2})/|e_k|²` with w the derivatives by the angles: with them
/// `Σ_k w_k ∂θ_k/∂x_k = (γ_{k+1} e_{k+1} - γ_{k+2} e_{k+2}) × n`.
#[inline(always)]
pub(super) fn angle_coefficients<S: Simd>(
    simd: S,
    at: &[VertexDerivatives],
    vertex: &[[u32; LANES]; 3],
    e: &[Lanes3<S::Lanes>; 3],
) -> [S::Lanes; 3] {
    let mut w = [simd.splat(0.0); 3];
    for k in 0..3 {
        w[k] = lanes!(simd, i => at[vertex[k][i] as usize].by_angle);
    }
    let mut gamma = w;
    for k in 0..3 {
        gamma[k] = (w[(k + 1) % 3] - w[(k + 2) % 3]) / e[k].dot(e[k]);
    }
    gamma
}

/// Adds the derivative of mixed-Voronoi areas, one triangle after the other.
#[inline(always)]
fn add_area_gradient<S: Simd, const ANGLES: bool, const NORMALS: bool>(
    simd: S,
    kernel: &Gradient<'_, ANGLES, NORMALS>,
    group: &Group<3>,
    out: &mut [[S::Lanes; 4]; 3],
) {
    let extra = group.element.map(|t| {
        let t = t as usize;
        let corners = kernel.shape.sheet.triangles()[t];
        let by_area = corners.map(|v| kernel.vertex[v as usize].by_area);
        let mut gradient = [Vec3::zeros(); 3];
        kernel.bending.area.add_gradient(&kernel.shape, t, by_area, &mut gradient);
        gradient
    });
    for (k, corner) in out.iter_mut().enumerate() {
        for (axis, component) in corner.iter_mut().take(3).enumerate() {
            *component = *component + lanes!(simd, i => extra[i][k][axis]);
        }
    }
}
