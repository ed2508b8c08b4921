//! Second derivatives of the Meyer bending energy.
//!
//! `U = Σ_i f(L_i, A_i, Θ_i)` with Θ the angle sum, so `∂²U` has an outer part from `f''`, one ring
//! of vertices at a time, and an inner part `f'·∂²(L, A, Θ)`, one triangle at a time.
//!
//! **Outer part.** With `J = ∂L - (L/A) ∂A` (the change of `L/A`, times A),
//!
//! ```text
//! p = 1:  f'' = (B/4A) |J|²                                             (convex)
//! p = 2:  f'' = (B/4A²) [ |J|² - 2 (L·J)(∂A)/A ] - 2G(2π-Θ)/A³ (∂A)² - 2(G/A²) ∂Θ ∂A
//! ```
//!
//! with `∂L_i/∂x_m = Σ_T (e_i·e_m)/(2A) n nᵀ + s_im [n]×`, s = +1 for m = i+2 and -1 for m = i+1,
//! and `G = B(1-ν)`. The first term is the positive part.
//!
//! **Inner part.** The gradient of a triangle is `Q × e_k + h_k × n` with `h_k = g_{k+1} - g_{k+2}`,
//! `Q = P V/(2A) + ½ a_T n` (see the parent module); moving corner m by δ changes
//! `n` by `P (e_m × δ)/(2A)`, `2A` by `n·(e_m × δ)`, `V` by `-h_m × δ` and `e_k` by `±δ`.
//!
//! Exact for frozen-Voronoi and barycentric areas; for `area = "mixed-voronoi"` the second
//! derivatives of the area fractions are left out.

use smallvec::SmallVec;

use super::{BendingWeight, MeyerBending};
use crate::Vec3;
use crate::effects::HessianPart;
use crate::geometry::{AreaRule, Face, Shape};
use crate::num::index;
use crate::solve::linear::{Block, BlockMatrix, LazyStencils, Sink};

/// Ring sizes up to which nothing is allocated.
const RING: usize = 12;

/// First derivatives of one vertex's gathered quantities by one vertex of its ring.
#[derive(Clone, Copy)]
struct RingEntry {
    /// `J = ∂L - (L/A) ⊗ ∂A`.
    curvature: Block,
    /// `∂A`.
    area: Vec3,
    /// `∂Θ`.
    angle: Vec3,
    /// `Lᵀ J`.
    along: Vec3,
}

impl RingEntry {
    const ZERO: Self = Self {
        curvature: Block::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        area: Vec3::new(0.0, 0.0, 0.0),
        angle: Vec3::new(0.0, 0.0, 0.0),
        along: Vec3::new(0.0, 0.0, 0.0),
    };
}

/// Where the blocks of the two parts go.
#[derive(Debug, Default)]
pub(super) struct Places {
    rings: LazyStencils,
    triangles: LazyStencils,
}

/// Adds the wanted part of the Hessian; `places` belong to the sheet.
pub(super) fn add(
    bending: &MeyerBending,
    places: &mut Places,
    shape: &Shape<'_>,
    part: HessianPart,
    into: &mut BlockMatrix,
) {
    let sheet = shape.sheet;
    let rings = places.rings.for_pattern(into.pattern(), || {
        (0..sheet.vertex_count()).map(|i| {
            // Vertices on the rim have no outer part.
            let mut vertices = SmallVec::<[u32; RING]>::new();
            if !sheet.rim()[i] {
                vertices.push(index(i));
                vertices.extend(sheet.vertex_edges().of(i).iter().map(|&(_, j)| j));
                vertices.sort_unstable();
            }
            vertices
        })
    });
    rings.assemble(into, |i, sink| add_ring(bending, shape, part, i, sink));
    if part == HessianPart::Full {
        let triangles = places.triangles.for_pattern(into.pattern(), || {
            sheet.triangles().iter().map(|t| {
                let mut t = *t;
                t.sort_unstable();
                t
            })
        });
        triangles.assemble(into, |t, sink| add_triangle(bending, shape, t, sink));
    }
}

/// Outer part of an interior vertex.
fn add_ring(
    bending: &MeyerBending,
    shape: &Shape<'_>,
    part: HessianPart,
    vertex: usize,
    sink: &mut Sink<'_>,
) {
    let printed = bending.weight == BendingWeight::Paper;
    let second_order = printed && part == HessianPart::Full;
    let vertices = sink.vertices();
    let mut entry: SmallVec<[RingEntry; RING]> =
        SmallVec::from_elem(RingEntry::ZERO, vertices.len());
    let incident = shape.sheet.vertex_triangles().of(vertex);
    let [x, y, z, area, angles] = bending.gathered[vertex];
    let l = Vec3::new(x, y, z);
    let ratio = l / area;
    for &(t, k) in incident {
        let (t, k) = (t as usize, k as usize);
        let corners = shape.corners(t);
        let face = Face::of(&corners);
        let (n, e) = (face.normal, edges_of(&corners));
        let mut by_area = [Vec3::zeros(); 3];
        if bending.area.rule() == AreaRule::MixedVoronoi {
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            bending.area.add_gradient(shape, t, unit, &mut by_area);
        } else {
            let half = 0.5 * bending.area.fractions()[t][k];
            for m in 0..3 {
                by_area[m] = half * n.cross(&e[m]);
            }
        }
        let mut by_angle = [Vec3::zeros(); 3];
        if second_order {
            angle_gradient(&e, &n, k, 1.0, &mut by_angle);
        }
        let along = n * (n / (2.0 * face.area)).transpose();
        for m in 0..3 {
            let mut block = e[k].dot(&e[m]) * along - ratio * by_area[m].transpose();
            if m == (k + 2) % 3 {
                add_cross(&mut block, &n, 1.0);
            } else if m == (k + 1) % 3 {
                add_cross(&mut block, &n, -1.0);
            }
            let target = shape.sheet.triangles()[t][m];
            if let Some(p) = vertices.iter().position(|v| *v == target) {
                let place = &mut entry[p];
                place.curvature += block;
                place.area += by_area[m];
                if second_order {
                    place.angle += by_angle[m];
                    place.along += block.tr_mul(&l);
                }
            }
        }
    }
    let quarter = 0.25 * bending.rigidity;
    let square = if printed { quarter / (area * area) } else { quarter / area };
    let cross = -square / area;
    let by_area = -2.0 * bending.gaussian * (2.0 * std::f64::consts::PI - angles) / area.powi(3);
    let by_angle = -bending.gaussian / (area * area);
    for p in 0..entry.len() {
        if !sink.wants(p) {
            continue;
        }
        let mine = entry[p];
        let left = square * mine.curvature.transpose();
        for (q, other) in entry.iter().enumerate().skip(p) {
            let mut block = left * other.curvature;
            if second_order {
                block += (cross * mine.along + by_area * mine.area + by_angle * mine.angle)
                    * other.area.transpose()
                    + mine.area * (cross * other.along + by_angle * other.angle).transpose();
            }
            sink.add(p, q, &block);
        }
    }
}

/// Adds `sign · [n]×`.
fn add_cross(block: &mut Block, n: &Vec3, sign: f64) {
    let n = sign * n;
    block[(0, 1)] -= n.z;
    block[(0, 2)] += n.y;
    block[(1, 0)] += n.z;
    block[(1, 2)] -= n.x;
    block[(2, 0)] -= n.y;
    block[(2, 1)] += n.x;
}

/// Edge vectors `e_k` opposite corner k.
fn edges_of([a, b, c]: &[Vec3; 3]) -> [Vec3; 3] {
    [c - b, a - c, b - a]
}

/// Adds `weight · ∂θ_k/∂x` to the corners of a triangle.
pub(super) fn angle_gradient(
    e: &[Vec3; 3],
    n: &Vec3,
    k: usize,
    weight: f64,
    gradient: &mut [Vec3; 3],
) {
    let (next, last) = ((k + 1) % 3, (k + 2) % 3);
    let (u, w) = (e[last], -e[next]);
    let by_next = (-weight / u.norm_squared()) * n.cross(&u);
    let by_last = (weight / w.norm_squared()) * n.cross(&w);
    gradient[next] += by_next;
    gradient[last] += by_last;
    gradient[k] -= by_next + by_last;
}

/// Inner part of triangle `t`.
fn add_triangle(bending: &MeyerBending, shape: &Shape<'_>, t: usize, sink: &mut Sink<'_>) {
    let corners = shape.sheet.triangles()[t];
    let d = corners.map(|v| bending.vertex[v as usize]);
    let positions = shape.corners(t);
    let face = Face::of(&positions);
    let (n, e) = (face.normal, edges_of(&positions));
    let inverse = 0.5 / face.area;
    let g = d.map(|d| d.by_vector);
    let h = [g[1] - g[2], g[2] - g[0], g[0] - g[1]];
    let v = e[0].cross(&g[0]) + e[1].cross(&g[1]) + e[2].cross(&g[2]);
    let by_area = 0.5 * bending.area.area_factor(t, d.map(|d| d.by_area));
    let along = n.dot(&v);
    let w = (v - along * n) * inverse;
    let q = w + by_area * n;
    let angles = d.iter().any(|d| d.by_angle != 0.0);
    // Sorted position of every corner, as the sink counts.
    let rank: [usize; 3] =
        std::array::from_fn(|k| corners.iter().filter(|other| **other < corners[k]).count());
    // ∂n/∂x_m = P [e_m]×/2A, and ∂Q/∂x_m.
    let mut turn = [Block::zeros(); 3];
    let mut change = [Block::zeros(); 3];
    for m in 0..3 {
        // n·(e_m × δ) = (n × e_m)·δ, and P [e]× = [e]× - n (n × e)ᵀ.
        let growth = n.cross(&e[m]);
        let mut dn = -n * growth.transpose();
        add_cross(&mut dn, &e[m], 1.0);
        dn *= inverse;
        // P [h]× = [h]× - n (n × h)ᵀ.
        let mut dw = (by_area - along * inverse) * dn
            - n * ((dn.tr_mul(&v) - n.cross(&h[m])) * inverse).transpose()
            - w * (growth * inverse).transpose();
        add_cross(&mut dw, &h[m], -inverse);
        turn[m] = dn;
        change[m] = dw;
    }
    for k in 0..3 {
        if !sink.wants(rank[k]) {
            continue;
        }
        for m in 0..3 {
            if rank[m] < rank[k] {
                continue;
            }
            let mut block = Block::zeros();
            for axis in 0..3 {
                let (dn, dq) = (turn[m].column(axis), change[m].column(axis));
                block.set_column(axis, &(h[k].cross(&dn) - e[k].cross(&dq)));
            }
            if m == (k + 2) % 3 {
                add_cross(&mut block, &q, 1.0);
            } else if m == (k + 1) % 3 {
                add_cross(&mut block, &q, -1.0);
            }
            if angles {
                for (corner, derivatives) in d.iter().enumerate() {
                    if derivatives.by_angle != 0.0 {
                        let weight = derivatives.by_angle;
                        add_angle_block(&e, &n, &turn[m], corner, weight, (k, m), &mut block);
                    }
                }
            }
            sink.add(rank[k], rank[m], &block);
        }
    }
}

/// Adds block `(k, m)` of `weight · ∂²θ_corner`.
///
/// `∂θ/∂x_next = -y(u)`, `∂θ/∂x_last = y(w)` with `y(u) = n × u/|u|²`, so
/// `∂y = ∂n × u/|u|² + n × ∂u/|u|² - 2 y (u·∂u)/|u|²`.
fn add_angle_block(
    e: &[Vec3; 3],
    n: &Vec3,
    turn: &Block,
    corner: usize,
    weight: f64,
    (k, m): (usize, usize),
    block: &mut Block,
) {
    let (next, last) = ((corner + 1) % 3, (corner + 2) % 3);
    for (end, arm, sign) in [(next, e[last], -weight), (last, -e[next], weight)] {
        // Row of the arm's end gets +, row of the corner gets -.
        let side = if k == end {
            sign
        } else if k == corner {
            -sign
        } else {
            continue;
        };
        let side = side / arm.norm_squared();
        for axis in 0..3 {
            let column = -side * arm.cross(&turn.column(axis));
            block.set_column(axis, &(block.column(axis) + column));
        }
        // ∂arm/∂x_m is 1 for its end, -1 for the corner.
        let side = if m == end {
            side
        } else if m == corner {
            -side
        } else {
            continue;
        };
        add_cross(block, n, side);
        let y = n.cross(&arm) / arm.norm_squared();
        *block -= (2.0 * side) * y * arm.transpose();
    }
}
