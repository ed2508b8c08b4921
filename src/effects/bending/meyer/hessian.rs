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

use super::{BendingWeight, MeyerBending};
use crate::Vec3;
use crate::effects::HessianPart;
use crate::geometry::{Shape, angle_at};
use crate::num::index;
use crate::parallel;
use crate::solve::linear::{Block, BlockMatrix};

/// First derivatives of one vertex's gathered quantities by one vertex of its ring.
#[derive(Clone, Copy)]
struct RingEntry {
    vertex: u32,
    /// `J = ∂L - (L/A) ⊗ ∂A`.
    curvature: Block,
    /// `∂A`.
    area: Vec3,
    /// `∂Θ`.
    angle: Vec3,
    /// `Lᵀ J`.
    along: Vec3,
}

/// A vertex with its ring and the coefficients of the outer part.
#[derive(Clone, Default)]
struct Ring {
    entry: Vec<RingEntry>,
    square: f64,
    cross: f64,
    area: f64,
    angle: f64,
}

/// Adds the wanted part of the Hessian.
pub(super) fn add(
    bending: &MeyerBending,
    shape: &Shape<'_>,
    part: HessianPart,
    into: &mut BlockMatrix,
) {
    let mut rings = vec![Ring::default(); shape.sheet.vertex_count()];
    parallel::fill(&mut rings, |i| ring(bending, shape, part, i));
    let neighbours = shape.sheet.vertex_edges();
    into.update_rows(|i, row| {
        let around = neighbours.of(i).iter().map(|&(_, j)| j as usize);
        for k in std::iter::once(i).chain(around) {
            let ring = &rings[k];
            let Some(mine) = ring.entry.iter().find(|entry| entry.vertex as usize == i) else {
                continue;
            };
            let left = ring.square * mine.curvature.transpose();
            for other in ring.entry.iter().filter(|entry| entry.vertex as usize >= i) {
                let mut block = left * other.curvature;
                if ring.cross != 0.0 {
                    block += ring.cross
                        * (mine.along * other.area.transpose()
                            + mine.area * other.along.transpose())
                        + ring.area * mine.area * other.area.transpose()
                        + ring.angle
                            * (mine.angle * other.area.transpose()
                                + mine.area * other.angle.transpose());
                }
                row.add(other.vertex as usize, &block);
            }
        }
        if part == HessianPart::Full {
            for &(t, k) in shape.sheet.vertex_triangles().of(i) {
                let blocks = triangle_blocks(bending, shape, t as usize, k as usize);
                let corners = shape.sheet.triangles()[t as usize];
                for (&j, block) in corners.iter().zip(&blocks) {
                    if j as usize >= i {
                        row.add(j as usize, block);
                    }
                }
            }
        }
    });
}

/// The ring of an interior vertex; empty on the rim, where `f''` is zero.
fn ring(bending: &MeyerBending, shape: &Shape<'_>, part: HessianPart, vertex: usize) -> Ring {
    if shape.sheet.rim()[vertex] {
        return Ring::default();
    }
    let printed = bending.weight == BendingWeight::Paper;
    let second_order = printed && part == HessianPart::Full;
    let empty = |vertex| RingEntry {
        vertex,
        curvature: Block::zeros(),
        area: Vec3::zeros(),
        angle: Vec3::zeros(),
        along: Vec3::zeros(),
    };
    let mut entry = vec![empty(index(vertex))];
    entry.extend(shape.sheet.vertex_edges().of(vertex).iter().map(|&(_, j)| empty(j)));
    let incident = shape.sheet.vertex_triangles().of(vertex);
    let (mut l, mut area, mut angles) = (Vec3::zeros(), 0.0, 0.0);
    for &(t, k) in incident {
        let (t, k) = (t as usize, k as usize);
        l += shape.face(t).normal.cross(&shape.edge_vectors(t)[k]);
        area += bending.area.corners(shape, t)[k];
        if second_order {
            angles += angle_at(shape, t, k);
        }
    }
    let ratio = l / area;
    for &(t, k) in incident {
        let (t, k) = (t as usize, k as usize);
        let face = shape.face(t);
        let (n, e) = (face.normal, shape.edge_vectors(t));
        let mut by_area = [Vec3::zeros(); 3];
        let mut unit = [0.0; 3];
        unit[k] = 1.0;
        bending.area.add_gradient(shape, t, unit, &mut by_area);
        let mut by_angle = [Vec3::zeros(); 3];
        if second_order {
            angle_gradient(&e, &n, k, 1.0, &mut by_angle);
        }
        let along = n * n.transpose() / (2.0 * face.area);
        for m in 0..3 {
            let mut block = e[k].dot(&e[m]) * along - ratio * by_area[m].transpose();
            if m == (k + 2) % 3 {
                block += n.cross_matrix();
            } else if m == (k + 1) % 3 {
                block -= n.cross_matrix();
            }
            let target = shape.sheet.triangles()[t][m];
            if let Some(place) = entry.iter_mut().find(|place| place.vertex == target) {
                place.curvature += block;
                place.area += by_area[m];
                place.angle += by_angle[m];
                place.along += block.tr_mul(&l);
            }
        }
    }
    let quarter = 0.25 * bending.rigidity;
    if !printed {
        return Ring { entry, square: quarter / area, ..Ring::default() };
    }
    let square = quarter / (area * area);
    if !second_order {
        return Ring { entry, square, ..Ring::default() };
    }
    let deficit = 2.0 * std::f64::consts::PI - angles;
    Ring {
        entry,
        square,
        cross: -square / area,
        area: -2.0 * bending.gaussian * deficit / (area * area * area),
        angle: -bending.gaussian / (area * area),
    }
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

/// Inner part: blocks (k, m), m = 0, 1, 2, of triangle `t`.
fn triangle_blocks(bending: &MeyerBending, shape: &Shape<'_>, t: usize, k: usize) -> [Block; 3] {
    let d = shape.sheet.triangles()[t].map(|v| bending.vertex[v as usize]);
    let face = shape.face(t);
    let (n, e) = (face.normal, shape.edge_vectors(t));
    let double_area = 2.0 * face.area;
    let g = d.map(|d| d.by_vector);
    let h: [Vec3; 3] = std::array::from_fn(|m| g[(m + 1) % 3] - g[(m + 2) % 3]);
    let v = e[0].cross(&g[0]) + e[1].cross(&g[1]) + e[2].cross(&g[2]);
    let by_area = 0.5 * bending.area.area_factor(t, d.map(|d| d.by_area));
    let w = (v - n.dot(&v) * n) / double_area;
    let q = w + by_area * n;
    let tangent = Block::identity() - n * n.transpose();
    let turn: [Block; 3] = std::array::from_fn(|m| tangent * e[m].cross_matrix() / double_area);
    let mut blocks: [Block; 3] = std::array::from_fn(|m| {
        let dn = turn[m];
        let growth = e[m].cross_matrix().tr_mul(&n).transpose() / double_area;
        let dw =
            (-n.dot(&v) * dn - n * (dn.tr_mul(&v)).transpose() - tangent * h[m].cross_matrix())
                / double_area
                - w * growth;
        let dq = dw + by_area * dn;
        let mut block = h[k].cross_matrix() * dn - e[k].cross_matrix() * dq;
        if m == (k + 2) % 3 {
            block += q.cross_matrix();
        } else if m == (k + 1) % 3 {
            block -= q.cross_matrix();
        }
        block
    });
    for (corner, derivatives) in d.iter().enumerate() {
        if derivatives.by_angle != 0.0 {
            add_angle_blocks(&e, &n, &turn, corner, derivatives.by_angle, k, &mut blocks);
        }
    }
    blocks
}

/// Adds row `k` of `weight · ∂²θ_corner`.
///
/// `∂θ/∂x_next = -y(u)`, `∂θ/∂x_last = y(w)` with `y(u) = n × u/|u|²`, so
/// `∂y = ∂n × u/|u|² + n × ∂u/|u|² - 2 y (u·∂u)/|u|²`.
fn add_angle_blocks(
    e: &[Vec3; 3],
    n: &Vec3,
    turn: &[Block; 3],
    corner: usize,
    weight: f64,
    k: usize,
    blocks: &mut [Block; 3],
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
        let square = arm.norm_squared();
        let y = n.cross(&arm) / square;
        let by_arm = n.cross_matrix() / square - 2.0 * y * arm.transpose() / square;
        for m in 0..3 {
            let mut block = -arm.cross_matrix() * turn[m] / square;
            if m == end {
                block += by_arm;
            } else if m == corner {
                block -= by_arm;
            }
            blocks[m] += side * block;
        }
    }
}
