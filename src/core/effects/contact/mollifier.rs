//! The factor on the barrier of two edges that makes it smooth where they are parallel and their distance is not.
//!
//! ```text
//! m = (2 - c/ε) c/ε,   c = |u × v|²,   ε = 10⁻³ |U|² |V|²;   1 for c ≥ ε
//! ```
//!
//! u, v the edges, U, V those at rest (Li et al. 2020, doi:10.1145/3386569.3392425, section 5).

use crate::Vec3;
use crate::effects::Block;

/// ε in units of the squared lengths at rest.
const PARALLEL_THRESHOLD: f64 = 1e-3;

/// m for two edges x₀ x₁ and x₂ x₃.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mollifier {
    /// m.
    pub(super) value: f64,
    /// dm/dc and d²m/dc².
    slopes: [f64; 2],
    u: Vec3,
    v: Vec3,
}

impl Mollifier {
    /// At `x`, with the places `rest` at rest.
    pub(super) fn new(x: &[Vec3; 4], rest: &[Vec3; 4]) -> Self {
        let of = |x: &[Vec3; 4]| [x[1] - x[0], x[3] - x[2]];
        let ([u, v], [at_rest_u, at_rest_v]) = (of(x), of(rest));
        let bound = PARALLEL_THRESHOLD * at_rest_u.norm_squared() * at_rest_v.norm_squared();
        let share = u.cross(&v).norm_squared() / bound;
        let (value, slopes) = if share < 1.0 {
            let slopes = [2.0 * (1.0 - share) / bound, -2.0 / (bound * bound)];
            ((2.0 - share) * share, slopes)
        } else {
            (1.0, [0.0; 2])
        };
        Self { value, slopes, u, v }
    }

    /// ∂c/∂u and ∂c/∂v.
    fn by_edges(&self) -> [Vec3; 2] {
        let Self { u, v, .. } = self;
        let product = u.dot(v);
        [2.0 * (v.norm_squared() * u - product * v), 2.0 * (u.norm_squared() * v - product * u)]
    }

    /// Derivatives by the ends.
    pub(super) fn gradient(&self) -> [Vec3; 4] {
        let [u, v] = self.by_edges().map(|by| self.slopes[0] * by);
        [-u, u, -v, v]
    }

    /// Second derivatives by the ends.
    pub(super) fn hessian(&self) -> [[Block; 4]; 4] {
        let Self { u, v, slopes: [first, second], .. } = *self;
        let by = self.by_edges();
        let own = |w: Vec3| Block::from_diagonal_element(w.norm_squared()) - w * w.transpose();
        let mixed =
            2.0 * u * v.transpose() - v * u.transpose() - Block::from_diagonal_element(u.dot(&v));
        let of_c = [[own(v), mixed], [mixed.transpose(), own(u)]];
        let sign = [-1.0, 1.0, -1.0, 1.0];
        std::array::from_fn(|k| {
            std::array::from_fn(|m| {
                let (a, b) = (k / 2, m / 2);
                let of_m = 2.0 * first * of_c[a][b] + second * by[a] * by[b].transpose();
                sign[k] * sign[m] * of_m
            })
        })
    }
}
