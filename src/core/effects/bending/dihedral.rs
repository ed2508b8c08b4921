//! The angle of two triangles at their common edge, ψ = 2 tan(θ/2), and its derivatives (`hinge.rs`).

use crate::Vec3;
use crate::linear::Block;
use crate::num::index;
use crate::sheet::{Edge, Sheet};

/// What one triangle contributes to ∂θ, by (start, end, opposite).
pub(super) struct Wing {
    /// Edge vector, from start to end, over its length.
    along: Vec3,
    length: f64,
    /// `N = e × (x₂ - x₀)`: along the normal, of twice the area of the triangle.
    normal: Vec3,
    /// `m = N/|N|²`, of which the derivatives of θ by the corners are multiples.
    slope: Vec3,
    /// Factors of m.
    factor: [f64; 3],
    corner: [Vec3; 3],
}

impl Wing {
    /// For the triangle of `corner`; `along` and `length` belong to its edge from 0 to 1.
    pub(super) fn new(corner: [Vec3; 3], along: Vec3, length: f64) -> Self {
        let [start, end, opposite] = corner;
        let arm = opposite - start;
        let normal = (end - start).cross(&arm);
        let foot = arm.dot(&along);
        Self {
            along,
            length,
            normal,
            slope: (1.0 / normal.norm_squared()) * normal,
            factor: [length - foot, foot, -length],
            corner,
        }
    }

    pub(super) fn gradient(&self) -> [Vec3; 3] {
        self.factor.map(|factor| factor * self.slope)
    }

    /// Block `[j][k]`: the derivative of `factor_j · m` by corner k.
    pub(super) fn hessian(&self) -> [[Block; 3]; 3] {
        let [start, end, opposite] = self.corner;
        let edges = [opposite - end, start - opposite, end - start];
        let square = self.normal.norm_squared();
        let reflect = Block::identity() / square - 2.0 * self.slope * self.slope.transpose();
        let slope_derivatives = edges.map(|e| reflect * e.cross_matrix());
        let arm = opposite - start;
        let across = (arm - arm.dot(&self.along) * self.along) / self.length;
        let zero = Vec3::zeros();
        let length_slopes = [-self.along, self.along, zero];
        let foot_slopes = [-self.along - across, across, self.along];
        let factor_slopes: [[Vec3; 3]; 3] = [
            std::array::from_fn(|k| length_slopes[k] - foot_slopes[k]),
            foot_slopes,
            length_slopes.map(|d| -d),
        ];
        std::array::from_fn(|j| {
            std::array::from_fn(|k| {
                self.slope * factor_slopes[j][k].transpose() + self.factor[j] * slope_derivatives[k]
            })
        })
    }
}

/// Corners of the hinge that belong to the two wings.
pub(super) const WING_CORNERS: [[usize; 3]; 2] = [[0, 1, 2], [1, 0, 3]];

/// Both wings and ψ.
pub(super) fn state(x: &[Vec3; 4]) -> ([Wing; 2], f64) {
    let edge = x[1] - x[0];
    let length = edge.norm();
    let along = (1.0 / length) * edge;
    let wing = |[a, b, c]: [usize; 3], along| Wing::new([x[a], x[b], x[c]], along, length);
    let wings = [wing(WING_CORNERS[0], along), wing(WING_CORNERS[1], -along)];
    let (first, second) = (&wings[0].normal, &wings[1].normal);
    let sine = -wings[0].length * first.dot(&(x[3] - x[0]));
    let cosine = first.dot(second);
    let size = (first.norm_squared() * second.norm_squared()).sqrt();
    let psi = 2.0 * sine / (size + cosine);
    (wings, psi)
}

pub(super) fn angle_gradient(wings: &[Wing; 2]) -> [Vec3; 4] {
    let mut gradient = [Vec3::zeros(); 4];
    for (wing, places) in wings.iter().zip(WING_CORNERS) {
        for (place, g) in places.into_iter().zip(wing.gradient()) {
            gradient[place] += g;
        }
    }
    gradient
}

/// `tangent ∂θ ⊗ ∂θ`.
pub(super) fn angle_outer_product(wings: &[Wing; 2], tangent: f64) -> [[Block; 4]; 4] {
    let gradient = angle_gradient(wings);
    std::array::from_fn(|j| {
        std::array::from_fn(|k| tangent * gradient[j] * gradient[k].transpose())
    })
}

/// `k ∂θ ⊗ ∂θ`, `k = rigidity l²/(A₁+A₂)` by current lengths and areas, of the hinge with the given
/// corners: the positive part at small angles.
pub(super) fn stiffness_blocks(x: &[Vec3; 4], rigidity: impl Fn(f64) -> f64) -> [[Block; 4]; 4] {
    let (wings, _) = state(x);
    let area = 0.5 * (wings[0].normal.norm() + wings[1].normal.norm());
    angle_outer_product(&wings, rigidity(area) * wings[0].length * wings[0].length / area)
}

/// Numbers of the interior edges of `sheet` with the corners of their hinges: the ends of the edge,
/// then the opposite corners of the triangles in which it runs forwards and backwards.
pub(super) fn hinges(sheet: &Sheet) -> impl Iterator<Item = (u32, [u32; 4])> + '_ {
    let opposite = |t: u32, e: u32| {
        let t = t as usize;
        let k = (0..3).find(|&k| sheet.triangle_edges()[t][k] == e).unwrap_or(0);
        let corner = sheet.triangles()[t];
        [corner[(k + 1) % 3], corner[(k + 2) % 3], corner[k]]
    };
    let inside = sheet.edges().iter().enumerate().filter(|(_, edge)| !edge.is_boundary());
    inside.map(move |(e, Edge { triangles: [first, second], .. })| {
        let e = index(e);
        let [start, end, left] = opposite(*first, e);
        let [_, _, right] = opposite(*second, e);
        (e, [start, end, left, right])
    })
}

/// ψ of the hinge with the given corners.
pub(super) fn psi(x: &[Vec3; 4]) -> f64 {
    state(x).1
}
