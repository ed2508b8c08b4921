//! The inner part of the second derivatives, four triangles at a time.

use super::super::kernels::{
    Triangles, angle_coefficients, corner_sum, derivatives, has_angle_terms,
};
use super::super::parts::At;
use crate::geometry::Shape;
use crate::linear::{Elements, Rows, pack};
use crate::parallel::simd::{LANES, Lanes3, Simd};

/// Columns of a 3×3 block.
pub(super) type Columns<L> = [Lanes3<L>; 3];

/// Inner part of the triangles. The corners are taken in ascending order, as the matrix stores
/// them; where that turns a triangle over, its normal and its edges change sign together, and all
/// expressions stay.
pub(super) struct InnerPart<'a> {
    pub at: At<'a>,
    pub shape: Shape<'a>,
}

impl Elements for InnerPart<'_> {
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, elements: &[u32], rows: &mut Rows<'_>) {
        for four in elements.chunks(LANES) {
            let mut element = [four[0]; LANES];
            element[..four.len()].copy_from_slice(four);
            let mut vertex = [[0; LANES]; 3];
            for (lane, e) in element.iter().enumerate() {
                if let [a, b, c] = rows.vertices(*e) {
                    [vertex[0][lane], vertex[1][lane], vertex[2][lane]] = [*a, *b, *c];
                }
            }
            let blocks = self.blocks(simd, element, vertex);
            for (pair, block) in PAIRS.into_iter().zip(blocks) {
                let [a, b, c] = block;
                let entries = [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z];
                let packed = pack(simd, entries);
                for (lane, e) in four.iter().enumerate() {
                    rows.sink(*e).add_packed(simd, pair.0, pair.1, packed[lane]);
                }
            }
        }
    }
}

/// The pairs of corners, in the order of [`InnerPart::blocks`].
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 2), (0, 0), (1, 1), (2, 2)];

/// Columns of ∂n/∂x_m and ∂Q/∂x_m of the corner m, with the edge e opposite of it and h, the difference of the
/// derivatives at the other corners.
#[inline(always)]
fn corner_derivatives<S: Simd>(
    simd: S,
    (n, inverse): (Lanes3<S::Lanes>, S::Lanes),
    (e, h): (Lanes3<S::Lanes>, Lanes3<S::Lanes>),
    (v, w, slope): (Lanes3<S::Lanes>, Lanes3<S::Lanes>, S::Lanes),
) -> (Columns<S::Lanes>, Columns<S::Lanes>) {
    let growth = n.cross(e).array();
    let lift = n.cross(h).array();
    let across = e.cross_columns(simd);
    let sheared = h.cross_columns(simd);
    let zero = [Lanes3 { x: inverse, y: inverse, z: inverse }; 3];
    let (mut turn, mut change) = (zero, zero);
    for axis in 0..3 {
        let dn = (across[axis] - n.scale(growth[axis])).scale(inverse);
        let by_v = dn.dot(v) - lift[axis];
        let parts = n.scale(by_v) + w.scale(growth[axis]) + sheared[axis];
        turn[axis] = dn;
        change[axis] = dn.scale(slope) - parts.scale(inverse);
    }
    (turn, change)
}

/// Adds the derivatives of the angle terms γ e by the edges, `∂(γ e)/∂e = γ (1 - 2 e eᵀ/|e|²)`, to the blocks of the
/// corner pairs (0, 1), (0, 2) and (1, 2).
#[inline(always)]
fn add_angle_terms<S: Simd>(
    simd: S,
    n: Lanes3<S::Lanes>,
    e: &[Lanes3<S::Lanes>; 3],
    gamma: &[S::Lanes; 3],
    blocks: [&mut Columns<S::Lanes>; 3],
) {
    let across = n.cross_columns(simd);
    for (block, k) in blocks.into_iter().zip([2, 1, 0]) {
        let double = simd.splat(2.0) / e[k].dot(e[k]);
        let tilt = n.cross(e[k]).scale(double);
        let along = e[k].array();
        for axis in 0..3 {
            let column = across[axis] - tilt.scale(along[axis]);
            block[axis] = block[axis] + column.scale(gamma[k]);
        }
    }
}

impl InnerPart<'_> {
    #[inline(always)]
    fn blocks<S: Simd>(
        &self,
        simd: S,
        element: [u32; LANES],
        vertex: [[u32; LANES]; 3],
    ) -> [Columns<S::Lanes>; 6] {
        let Triangles { edge: e, normal: n, double_area } =
            Triangles::gather(simd, self.shape.x, vertex);
        let at = self.at.vertex;
        let inverse = simd.splat(1.0) / double_area;
        let mut g = e;
        for k in 0..3 {
            (g[k], _) = derivatives(simd, at, vertex[k]);
        }
        let h = [g[1] - g[2], g[2] - g[0], g[0] - g[1]];
        let v = e[0].cross(g[0]) + e[1].cross(g[1]) + e[2].cross(g[2]);
        let by_area = simd.splat(0.5) * simd.load(self.derivatives_by_area(element));
        let along = n.dot(v);
        let w = (v - n.scale(along)).scale(inverse);
        let mut q = w + n.scale(by_area);
        if let Some(curved) = &self.at.curved {
            let sum = corner_sum(simd, &curved.work.by_normal, &vertex);
            q = q + sum.scale(simd.load(self.half_orientation(element, &vertex)));
        }
        let slope = by_area - along * inverse;
        // Columns of ∂n/∂x_m = P [e_m]×/2A and of ∂Q/∂x_m, for m = 1 and 2; those of all three
        // corners add up to nothing. 2A grows by (n × e_m)·δ, and P [a]× = [a]× - n (n × a)ᵀ.
        let [(turn_b, change_b), (turn_c, change_c)] =
            [1, 2].map(|m| corner_derivatives(simd, (n, inverse), (e[m], h[m]), (v, w, slope)));
        let (turn, change) = ([turn_b, turn_c], [change_b, change_c]);
        let zero = [Lanes3 { x: inverse, y: inverse, z: inverse }; 3];
        let mut turned = h;
        let mut gamma = None;
        if has_angle_terms(at, &vertex) {
            // The derivatives by angles turn with n as if γ_k e_k were added to g_k …
            let by = angle_coefficients(simd, at, &vertex, &e);
            let f = [e[0].scale(by[0]), e[1].scale(by[1]), e[2].scale(by[2])];
            turned = [h[0] + f[1] - f[2], h[1] + f[2] - f[0], h[2] + f[0] - f[1]];
            gamma = Some(by);
        }
        let [mut ab, mut ac, mut bc] = [zero; 3];
        for axis in 0..3 {
            ab[axis] = turned[0].cross(turn[0][axis]) - e[0].cross(change[0][axis]);
            ac[axis] = turned[0].cross(turn[1][axis]) - e[0].cross(change[1][axis]);
            bc[axis] = turned[1].cross(turn[1][axis]) - e[1].cross(change[1][axis]);
        }
        let across = q.cross_columns(simd);
        for axis in 0..3 {
            ab[axis] = ab[axis] - across[axis];
            ac[axis] = ac[axis] + across[axis];
            bc[axis] = bc[axis] - across[axis];
        }
        if let Some(gamma) = gamma {
            // … and with the edges.
            add_angle_terms(simd, n, &e, &gamma, [&mut ab, &mut ac, &mut bc]);
        }
        // Moving the triangle as a whole changes no force.
        let [ba, ca, cb] = [transposed(ab), transposed(ac), transposed(bc)];
        [ab, ac, bc, minus_sum(ab, ac), minus_sum(ba, bc), minus_sum(ca, cb)]
    }

    /// ½ for triangles whose corners in ascending order go round as they do in the sheet, else -½: derivatives by area
    /// vectors change sign with these.
    #[inline(always)]
    fn half_orientation(&self, element: [u32; LANES], vertex: &[[u32; LANES]; 3]) -> [f64; LANES] {
        let mut half = [0.5; LANES];
        for lane in 0..LANES {
            let [a, b, c] = self.shape.sheet.triangles()[element[lane] as usize];
            let pair = [vertex[0][lane], vertex[1][lane]];
            if ![[a, b], [b, c], [c, a]].contains(&pair) {
                half[lane] = -0.5;
            }
        }
        half
    }

    /// `Σ_k f_k ∂U/∂A_k` with f the shares of the corners.
    #[inline(always)]
    fn derivatives_by_area(&self, element: [u32; LANES]) -> [f64; LANES] {
        element.map(|t| {
            let corners = self.shape.sheet.triangles()[t as usize];
            let by_area = corners.map(|v| self.at.vertex[v as usize].by_area);
            self.at.bending.area.derivative_by_area(t as usize, by_area)
        })
    }
}

#[inline(always)]
fn transposed<L: crate::parallel::simd::Lanes>([a, b, c]: Columns<L>) -> Columns<L> {
    [
        Lanes3 { x: a.x, y: b.x, z: c.x },
        Lanes3 { x: a.y, y: b.y, z: c.y },
        Lanes3 { x: a.z, y: b.z, z: c.z },
    ]
}

#[inline(always)]
fn minus_sum<L: crate::parallel::simd::Lanes>(a: Columns<L>, b: Columns<L>) -> Columns<L> {
    [-(a[0] + b[0]), -(a[1] + b[1]), -(a[2] + b[2])]
}
