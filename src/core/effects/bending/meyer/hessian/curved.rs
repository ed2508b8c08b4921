//! The outer part of the second derivatives with a rest shape that is not flat, or a spontaneous curvature.
//!
//! With `a = L·n` and the factors of [`SecondFactors`], one ring of vertices has
//!
//! ```text
//! stiffness · J ⊗ J + ½ pull ∂²a,   J = ½ ∂a - (½ a/A) ∂A,   ∂a = n·∂L + r·∂N
//! |N| ∂²a = ∂Lᵀ P ∂N + ∂Nᵀ P ∂L - (n·∂N ⊗ r·∂N + r·∂N ⊗ n·∂N) - (a/|N|) ∂Nᵀ P ∂N
//! ```
//!
//! `P = 1 - n nᵀ`, and `∂N_i/∂x_m = Σ_T ½ [e_m]×`. The first term is the positive part. With a flat rest shape the
//! stiffness is that of the file `rings.rs`.

use crate::Vec3;
use crate::effects::bending::meyer::parts::{At, CurvedAt, MeyerBending};
use crate::geometry::{Face, Shape};
use crate::linear::{Block, BlockMatrix, Sink, Stencils};

/// Ring sizes up to which nothing is allocated.
const INLINE_RING: usize = 12;

/// First derivatives of what one vertex gathers, by one vertex of its ring.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct RingDerivatives {
    /// `∂L`.
    pub vector: Block,
    /// `∂N`.
    pub normal: Block,
    /// `∂A`.
    pub area: Vec3,
}

impl RingDerivatives {
    pub(in super::super) const ZERO: Self = {
        let zero = Block::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self { vector: zero, normal: zero, area: Vec3::new(0.0, 0.0, 0.0) }
    };
}

/// Second derivatives by what one vertex gathers.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct SecondFactors {
    /// n.
    pub normal: Vec3,
    /// r.
    pub along_by_normal: Vec3,
    /// 1/|N|.
    pub inverse: f64,
    /// a.
    pub along: f64,
    /// `a/(2A)`.
    pub mean: f64,
    /// `(1-s) B/A`.
    pub stiffness: f64,
    /// `f_p`.
    pub pull: f64,
}

/// What the blocks of a ring are made of, by one of its vertices.
#[derive(Clone, Copy)]
struct Factors {
    /// J.
    bent: Vec3,
    /// `n·∂N` and `r·∂N`.
    tilt: [Vec3; 2],
    /// `P ∂N`, and `P ∂L - (a/2|N|) P ∂N`.
    turn: Block,
    rest: Block,
}

impl Factors {
    const ZERO: Self = {
        let RingDerivatives { vector, normal, area } = RingDerivatives::ZERO;
        Self { bent: area, tilt: [area; 2], turn: normal, rest: vector }
    };
}

impl SecondFactors {
    /// J.
    pub(in super::super) fn bent(&self, at: &RingDerivatives) -> Vec3 {
        let by = at.vector.tr_mul(&self.normal) + at.normal.tr_mul(&self.along_by_normal);
        0.5 * by - self.mean * at.area
    }

    fn factors(&self, at: &RingDerivatives) -> Factors {
        let n = self.normal;
        let tilt = [at.normal.tr_mul(&n), at.normal.tr_mul(&self.along_by_normal)];
        let turn = at.normal - n * tilt[0].transpose();
        let across = at.vector - n * at.vector.tr_mul(&n).transpose();
        let rest = across - (0.5 * self.along * self.inverse) * turn;
        Factors { bent: self.bent(at), tilt, turn, rest }
    }

    fn block(&self, p: &Factors, q: &Factors, full: bool) -> Block {
        let mut block = self.stiffness * p.bent * q.bent.transpose();
        if full {
            let scale = 0.5 * self.pull * self.inverse;
            block += scale
                * (p.rest.tr_mul(&q.turn) + p.turn.tr_mul(&q.rest)
                    - p.tilt[0] * q.tilt[1].transpose()
                    - p.tilt[1] * q.tilt[0].transpose());
        }
        block
    }
}

/// Derivatives of what vertex `i` gathers by the `vertices` of its ring, which are in ascending order.
pub(in super::super) fn differentiate(
    bending: &MeyerBending,
    shape: &Shape<'_>,
    i: usize,
    vertices: &[u32],
    ring: &mut [RingDerivatives],
) {
    if vertices.is_empty() {
        return;
    }
    for &(t, k) in shape.sheet.vertex_triangles().entries(i) {
        let (t, k) = (t as usize, k as usize % 3);
        let (face, e) = (Face::from_corners(&shape.corners(t)), shape.edge_vectors(t));
        let n = face.normal;
        let mut unit = [0.0; 3];
        unit[k] = 1.0;
        let mut area_slopes = [Vec3::zeros(); 3];
        bending.area.add_gradient(shape, t, unit, &mut area_slopes);
        for (m, v) in shape.sheet.triangles()[t].iter().enumerate() {
            let Ok(place) = vertices.binary_search(v) else { continue };
            let place = &mut ring[place];
            place.vector += (0.5 * e[k].dot(&e[m]) / face.area) * n * n.transpose();
            match (m + 3 - k) % 3 {
                1 => place.vector -= n.cross_matrix(),
                2 => place.vector += n.cross_matrix(),
                _ => {}
            }
            place.normal += 0.5 * e[m].cross_matrix();
            place.area += area_slopes[m];
        }
    }
}

/// Adds the blocks of all rings.
pub(super) fn add(
    at: &At<'_>,
    curved: CurvedAt<'_>,
    (shape, full): (&Shape<'_>, bool),
    rings: &Stencils,
    into: &mut BlockMatrix,
) {
    rings.assemble(into, |i, sink| {
        let size = sink.vertices().len();
        if size <= INLINE_RING {
            let (mut ring, mut factors) =
                ([RingDerivatives::ZERO; INLINE_RING], [Factors::ZERO; INLINE_RING]);
            let few = (&mut ring[..size], &mut factors[..size]);
            add_ring(at, curved, (shape, full), (i, sink), few);
        } else {
            let (mut ring, mut factors) =
                (vec![RingDerivatives::ZERO; size], vec![Factors::ZERO; size]);
            add_ring(at, curved, (shape, full), (i, sink), (&mut ring, &mut factors));
        }
    });
}

fn add_ring(
    at: &At<'_>,
    CurvedAt { rest, work }: CurvedAt<'_>,
    (shape, full): (&Shape<'_>, bool),
    (i, sink): (usize, &mut Sink<'_>),
    (ring, factors): (&mut [RingDerivatives], &mut [Factors]),
) {
    if ring.is_empty() {
        return;
    }
    differentiate(at.bending, shape, i, sink.vertices(), ring);
    let second = rest.second_factors(at.bending, (at.gathered, work), i);
    for (factors, at) in factors.iter_mut().zip(ring) {
        *factors = second.factors(at);
    }
    for p in 0..factors.len() {
        if sink.wants(p) {
            for q in p..factors.len() {
                sink.add(p, q, &second.block(&factors[p], &factors[q], full));
            }
        }
    }
}
