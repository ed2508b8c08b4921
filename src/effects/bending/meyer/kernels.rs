//! The Meyer energy four triangles at a time: see the parent module for the equations.

use std::f64::consts::PI;

use super::MeyerBending;
use crate::Vec3;
use crate::geometry::{AreaRule, Shape};
use crate::parallel::patches::{Group, Kernel};
use crate::parallel::simd::{Lanes, Lanes3, Simd, atan_unit};

/// Four triangles: edges `e_k` opposite corner k, unit normals, twice the areas.
struct Triangles<L> {
    edge: [Lanes3<L>; 3],
    normal: Lanes3<L>,
    double_area: L,
}

impl<L: Lanes> Triangles<L> {
    #[inline(always)]
    fn gather<S: Simd<Lanes = L>>(simd: S, x: &[Vec3], group: &Group<3>) -> Self {
        let [va, vb, vc] = group.vertex;
        let a = Lanes3::gather(simd, x, va);
        let b = Lanes3::gather(simd, x, vb);
        let c = Lanes3::gather(simd, x, vc);
        let edge = [c - b, a - c, b - a];
        let cross = edge[0].cross(edge[1]);
        let double_area = cross.dot(cross).sqrt();
        Self { edge, normal: cross.scale(simd.splat(1.0) / double_area), double_area }
    }

    /// Angle at corner `k`, by a half-angle formula that is well conditioned for needles and caps:
    /// `tan φ/2 = 2A/(|u||w| + |u·w|)` with φ the angle or π minus it.
    #[inline(always)]
    fn angle<S: Simd<Lanes = L>>(&self, simd: S, k: usize) -> L {
        let (u, w) = (self.edge[(k + 1) % 3], self.edge[(k + 2) % 3]);
        let dot = -u.dot(w);
        let lengths = (u.dot(u) * w.dot(w)).sqrt();
        let sharp = atan_unit(simd, self.double_area / (lengths + dot.abs()));
        let quarter = simd.splat(0.5 * PI);
        quarter - (quarter - sharp - sharp).copysign(dot)
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
        let [a, b, c, d] = t.map(|t| bending.area.corners(shape, t as usize));
        let areas = [a, b, c, d];
        return [
            lanes!(simd, i => areas[i][0]),
            lanes!(simd, i => areas[i][1]),
            lanes!(simd, i => areas[i][2]),
        ];
    }
    let fraction = bending.area.fractions();
    let half = simd.splat(0.5) * double_area;
    [
        lanes!(simd, i => fraction[t[i] as usize][0]) * half,
        lanes!(simd, i => fraction[t[i] as usize][1]) * half,
        lanes!(simd, i => fraction[t[i] as usize][2]) * half,
    ]
}

/// What a vertex gathers: `L_i`, `A_i` and, if ANGLES, `Σθ`.
pub(super) struct Gather<'a, const ANGLES: bool> {
    pub bending: &'a MeyerBending,
    pub shape: Shape<'a>,
}

impl<const ANGLES: bool> Kernel<3, 5> for Gather<'_, ANGLES> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, [[S::Lanes; 5]; 3]) {
        let faces = Triangles::gather(simd, self.shape.x, group);
        let area = corner_areas(simd, self.bending, &self.shape, group, faces.double_area);
        let zero = simd.splat(0.0);
        let mut corner = [[zero; 5]; 3];
        for k in 0..3 {
            let l = faces.normal.cross(faces.edge[k]);
            corner[k] = [l.x, l.y, l.z, area[k], zero];
        }
        if ANGLES {
            corner[0][4] = faces.angle(simd, 0);
            corner[1][4] = faces.angle(simd, 1);
            corner[2][4] = simd.splat(PI) - corner[0][4] - corner[1][4];
        }
        (zero, corner)
    }
}

/// The gradient that a vertex gathers; ANGLES if triangles may have derivatives by angles.
pub(super) struct Gradient<'a, const ANGLES: bool> {
    pub bending: &'a MeyerBending,
    pub shape: Shape<'a>,
}

impl<const ANGLES: bool> Kernel<3, 3> for Gradient<'_, ANGLES> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, group: &Group<3>) -> (S::Lanes, [[S::Lanes; 3]; 3]) {
        let Triangles { edge: e, normal: n, double_area } =
            Triangles::gather(simd, self.shape.x, group);
        let one = simd.splat(1.0);
        let zero = simd.splat(0.0);
        let at = &self.bending.vertex;
        let vertex = &group.vertex;
        let mut g = [Lanes3 { x: zero, y: zero, z: zero }; 3];
        for k in 0..3 {
            g[k] = Lanes3 {
                x: lanes!(simd, i => at[vertex[k][i] as usize].by_vector.x),
                y: lanes!(simd, i => at[vertex[k][i] as usize].by_vector.y),
                z: lanes!(simd, i => at[vertex[k][i] as usize].by_vector.z),
            };
        }
        let v = e[0].cross(g[0]) + e[1].cross(g[1]) + e[2].cross(g[2]);
        let frozen = self.bending.area.rule() != AreaRule::MixedVoronoi;
        let mut along = -(n.dot(v) / double_area);
        if frozen {
            let (fraction, t) = (self.bending.area.fractions(), &group.element);
            let mut share = zero;
            for k in 0..3 {
                share = share
                    + lanes!(simd, i => at[vertex[k][i] as usize].by_area)
                        * lanes!(simd, i => fraction[t[i] as usize][k]);
            }
            along = along + simd.splat(0.5) * share;
        }
        let q = v.scale(one / double_area) + n.scale(along);
        let mut corner = [q; 3];
        for k in 0..3 {
            corner[k] = q.cross(e[k]) + (g[(k + 1) % 3] - g[(k + 2) % 3]).cross(n);
        }
        if ANGLES && self.has_angles(group) {
            let (mut w, mut m) = ([zero; 3], e);
            for k in 0..3 {
                w[k] = lanes!(simd, i => at[vertex[k][i] as usize].by_angle);
                m[k] = n.cross(e[k]).scale(one / e[k].dot(e[k]));
            }
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                corner[k] = corner[k] + m[i].scale(w[k] - w[j]) + m[j].scale(w[k] - w[i]);
            }
        }
        let mut out = [corner[0].components(), corner[1].components(), corner[2].components()];
        if !frozen {
            add_area_gradient(simd, self, group, &mut out);
        }
        (zero, out)
    }
}

impl<const ANGLES: bool> Gradient<'_, ANGLES> {
    /// Whether any corner has a derivative by its angle.
    #[inline(always)]
    fn has_angles(&self, group: &Group<3>) -> bool {
        let at = &self.bending.vertex;
        group.vertex.iter().flatten().any(|&v| at[v as usize].by_angle != 0.0)
    }
}

/// Adds the derivative of mixed-Voronoi areas, one triangle after the other.
#[inline(always)]
fn add_area_gradient<S: Simd, const ANGLES: bool>(
    simd: S,
    kernel: &Gradient<'_, ANGLES>,
    group: &Group<3>,
    out: &mut [[S::Lanes; 3]; 3],
) {
    let extra = group.element.map(|t| {
        let t = t as usize;
        let corners = kernel.shape.sheet.triangles()[t];
        let by_area = corners.map(|v| kernel.bending.vertex[v as usize].by_area);
        let mut gradient = [Vec3::zeros(); 3];
        kernel.bending.area.add_gradient(&kernel.shape, t, by_area, &mut gradient);
        gradient
    });
    for (k, corner) in out.iter_mut().enumerate() {
        for (axis, component) in corner.iter_mut().enumerate() {
            *component = *component + lanes!(simd, i => extra[i][k][axis]);
        }
    }
}
