//! The shortest connection of a point with a triangle or an edge, and of two edges, with its derivatives.
//!
//! ```text
//! d² = min_β φ(x, β),   φ = |r|²,   r = Σ_k w_k(β) x_k,   Σ_k w_k = 0
//!
//! point p, triangle abc    r = p - (1 - β₁ - β₂) a - β₁ b - β₂ c
//! edges ab, cd             r = (1 - β₁) a + β₁ b - (1 - β₂) c - β₂ d
//! ```
//!
//! The β that are not at a bound are free: two inside of a triangle or of both edges, one on an edge, none at a
//! corner. With G_k,i = ∂²φ/∂x_k∂β_i and M = ∂²φ/∂β∂β over the free β,
//!
//! ```text
//! ∂d²/∂x_k = 2 w_k r,     ∂²d²/∂x_k∂x_m = 2 w_k w_m 1 - Σ_ij G_k,i (M⁻¹)_ij G_m,jᵀ
//! G_k,i = 2 (w_k r_i + w'_k,i r),     M_ij = 2 r_i·r_j,     r_i = Σ_k w'_k,i x_k
//! ```
//!
//! (the envelope theorem and implicit differentiation of ∂φ/∂β = 0). d² is C¹ where it is not 0, but for edges that
//! are parallel; second derivatives jump where a β becomes free.
//!
//! Closest points after Ericson, *Real-Time Collision Detection* (2005), sections 5.1.5 and 5.1.9, with areas and
//! determinants from cross products: their relative error is round-off over the sine of the least angle, not over
//! its square. Where even this is lost, the nearest point is looked for on the edges of the triangle, or at an end
//! of the edges.

use nalgebra::Matrix3;
use rumple_numerics::Vec3;

/// Four points: a point and a triangle, or two edges.
pub type Corners = [Vec3; 4];

/// Edges are parallel, and one β serves, where sin² of the angle between them is below this; a triangle is a line where
/// that between its edges is. Positions inside are exact to 1e-6 edges above it, and distances by 1e-10 edges below.
const PARALLEL_SIN_SQUARED: f64 = 1e-20;

/// The shortest connection r of two features, as weights of four points.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    weight: [f64; 4],
    /// w'_k,i of the free β.
    by: [[f64; 4]; 2],
    free: usize,
    /// r, from the second feature to the first.
    r: Vec3,
}

impl Nearest {
    #[inline]
    fn new(x: &Corners, weight: [f64; 4], by: &[[f64; 4]]) -> Self {
        let mut all = [[0.0; 4]; 2];
        all[..by.len()].copy_from_slice(by);
        Self { weight, by: all, free: by.len(), r: combined(x, &weight) }
    }

    /// The shortest connection, from the second feature to the first.
    #[must_use]
    pub fn connection(&self) -> Vec3 {
        self.r
    }

    /// d.
    #[must_use]
    pub fn distance(&self) -> f64 {
        self.r.norm()
    }

    /// The weights w of the points; a point with weight 0 does not matter, second derivatives included.
    #[must_use]
    pub fn weights(&self) -> &[f64; 4] {
        &self.weight
    }

    /// Second derivatives of d², block `[k][m]` by x_k and x_m.
    #[must_use]
    pub fn squared_hessian(&self, x: &Corners) -> [[Matrix3<f64>; 4]; 4] {
        let w = &self.weight;
        let along = [0, 1].map(|i| combined(x, &self.by[i]));
        let inverse = self.inverse(&along);
        let mixed = |k: usize, i: usize| 2.0 * (w[k] * along[i] + self.by[i][k] * self.r);
        let mut all = [[Matrix3::zeros(); 4]; 4];
        for (k, row) in all.iter_mut().enumerate() {
            for (m, block) in row.iter_mut().enumerate() {
                *block = Matrix3::from_diagonal_element(2.0 * w[k] * w[m]);
                for i in 0..self.free {
                    for j in 0..self.free {
                        *block -= inverse[i][j] * mixed(k, i) * mixed(m, j).transpose();
                    }
                }
            }
        }
        all
    }

    /// M⁻¹ over the free β; of parallel edges the first one is taken as fixed.
    fn inverse(&self, along: &[Vec3; 2]) -> [[f64; 2]; 2] {
        let m = |i: usize, j: usize| 2.0 * along[i].dot(&along[j]);
        if self.free < 2 {
            return [[1.0 / m(0, 0), 0.0], [0.0, 0.0]];
        }
        let (a, b, c) = (m(0, 0), m(0, 1), m(1, 1));
        let det = 4.0 * along[0].cross(&along[1]).norm_squared();
        if !(det > PARALLEL_SIN_SQUARED * a * c) {
            return [[0.0, 0.0], [0.0, 1.0 / c]];
        }
        [[c / det, -b / det], [-b / det, a / det]]
    }
}

#[inline]
fn combined(x: &Corners, weight: &[f64; 4]) -> Vec3 {
    weight[0] * x[0] + weight[1] * x[1] + weight[2] * x[2] + weight[3] * x[3]
}

/// Point x₀ and triangle x₁ x₂ x₃; also which corners of the triangle the nearest point lies between, as bits 1,
/// 2 and 4.
#[must_use]
#[inline]
pub fn point_triangle(x: &Corners) -> (Nearest, u8) {
    let [p, a, b, c] = x;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (point_point(x, 1), 1);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (point_point(x, 2), 2);
    }
    let normal = ab.cross(&ac);
    let vc = normal.dot(&ab.cross(&ap));
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return on_edge(x, [1, 2], d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (point_point(x, 3), 4);
    }
    let vb = normal.dot(&ap.cross(&ac));
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return on_edge(x, [1, 3], d2 / (d2 - d6));
    }
    let va = normal.dot(&(c - b).cross(&bp));
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return on_edge(x, [2, 3], (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = normal.norm_squared();
    if !(sum > PARALLEL_SIN_SQUARED * ab.norm_squared() * ac.norm_squared()) {
        return on_line(x);
    }
    let (v, w) = (vb / sum, vc / sum);
    let by = [[0.0, 1.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]];
    (Nearest::new(x, [1.0, v + w - 1.0, -v, -w], &by), 7)
}

/// The same of a triangle whose corners lie on a line.
#[cold]
fn on_line(x: &Corners) -> (Nearest, u8) {
    let [ab, ac, bc] = [[1, 2], [1, 3], [2, 3]].map(|ends| point_edge(x, ends));
    let nearer = |a: (Nearest, u8), b: (Nearest, u8)| {
        if b.0.distance() < a.0.distance() { b } else { a }
    };
    nearer(nearer(ab, ac), bc)
}

/// Point x₀ and the edge between corners `ends` of the triangle x₁ x₂ x₃; with the corners that the nearest point
/// lies between.
#[must_use]
pub fn point_edge(x: &Corners, ends: [usize; 2]) -> (Nearest, u8) {
    let [a, b] = ends.map(|k| x[k]);
    let along = b - a;
    let beta = along.dot(&(x[0] - a)) / along.norm_squared();
    on_edge(x, ends, beta)
}

/// Point x₀ and corner `k` of the triangle x₁ x₂ x₃.
#[must_use]
pub fn point_point(x: &Corners, k: usize) -> Nearest {
    let mut weight = [1.0, 0.0, 0.0, 0.0];
    weight[k] = -1.0;
    Nearest::new(x, weight, &[])
}

#[inline]
fn on_edge(x: &Corners, [a, b]: [usize; 2], beta: f64) -> (Nearest, u8) {
    let bit = |k: usize| 1u8 << (k - 1);
    if !(beta > 0.0) {
        return (point_point(x, a), bit(a));
    }
    if beta >= 1.0 {
        return (point_point(x, b), bit(b));
    }
    let (mut weight, mut by) = ([1.0, 0.0, 0.0, 0.0], [0.0; 4]);
    (weight[a], weight[b]) = (beta - 1.0, -beta);
    (by[a], by[b]) = (1.0, -1.0);
    (Nearest::new(x, weight, &[by]), bit(a) | bit(b))
}

/// Edges x₀ x₁ and x₂ x₃.
#[must_use]
#[inline]
pub fn edge_edge(x: &Corners) -> Nearest {
    let [p, q, u, v] = x;
    let (d, e, r) = (q - p, v - u, p - u);
    let (a, b, c) = (d.norm_squared(), d.dot(&e), e.norm_squared());
    let (s0, t0) = (d.dot(&r), e.dot(&r));
    let normal = d.cross(&e);
    let det = normal.norm_squared();
    // 0 where an edge has no length.
    let unit = |value: f64| if value > 0.0 { value.min(1.0) } else { 0.0 };
    let mut s =
        if det > PARALLEL_SIN_SQUARED * a * c { unit(e.cross(&r).dot(&normal) / det) } else { 0.0 };
    let mut t = (b * s + t0) / c;
    if !(t > 0.0) {
        (t, s) = (0.0, unit(-s0 / a));
    } else if t >= 1.0 {
        (t, s) = (1.0, unit((b - s0) / a));
    }
    let weight = [1.0 - s, s, t - 1.0, -t];
    let by = [[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]];
    let inside = |share: f64| share > 0.0 && share < 1.0;
    match (inside(s), inside(t)) {
        (true, true) => Nearest::new(x, weight, &by),
        (true, false) => Nearest::new(x, weight, &by[..1]),
        (false, true) => Nearest::new(x, weight, &by[1..]),
        (false, false) => Nearest::new(x, weight, &[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from -1 to 1, the same each time.
    struct Noise(u64);

    impl Noise {
        fn number(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            #[allow(clippy::cast_precision_loss)]
            let unit = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
            2.0 * unit - 1.0
        }

        fn corners(&mut self) -> Corners {
            std::array::from_fn(|_| Vec3::from_fn(|_, _| self.number()))
        }
    }

    /// The least distance over a grid of weights.
    fn by_grid(x: &Corners, of: fn(f64, f64) -> Option<[f64; 4]>) -> f64 {
        const N: u32 = 200;
        let share = |k: u32| f64::from(k) / f64::from(N);
        let pairs = (0..=N).flat_map(|k| (0..=N).map(move |m| (share(k), share(m))));
        let all = pairs.filter_map(|(s, t)| of(s, t));
        all.map(|w| combined(x, &w).norm()).fold(f64::INFINITY, f64::min)
    }

    fn of_triangle(s: f64, t: f64) -> Option<[f64; 4]> {
        (s + t <= 1.0 + 1e-12).then_some([1.0, s + t - 1.0, -s, -t])
    }

    fn of_edges(s: f64, t: f64) -> Option<[f64; 4]> {
        Some([1.0 - s, s, t - 1.0, -t])
    }

    #[test]
    fn distances_are_the_least_there_are() {
        let mut noise = Noise(1);
        let mut kinds = [0; 8];
        for _ in 0..300 {
            let x = noise.corners();
            let (nearest, between) = point_triangle(&x);
            kinds[usize::from(between)] += 1;
            let (d, grid) = (nearest.distance(), by_grid(&x, of_triangle));
            assert!(d <= grid + 1e-12 && grid - d < 0.02, "{d} {grid}");
            let (d, grid) = (edge_edge(&x).distance(), by_grid(&x, of_edges));
            assert!(d <= grid + 1e-12 && grid - d < 0.02, "{d} {grid}");
        }
        assert!(kinds[1..].iter().all(|count| *count > 3), "{kinds:?}");
    }

    #[test]
    fn features_without_extent_have_their_distance() {
        let p = |x: f64| Vec3::new(x, 0.0, 0.0);
        // A corner twice, all on a line, one point.
        for (corners, d) in [
            ([p(3.0), p(0.0), p(0.0), p(4.0)], 0.0),
            ([p(3.0), p(0.0), p(4.0), p(0.0)], 0.0),
            ([p(3.0), p(4.0), p(0.0), p(0.0)], 0.0),
            ([p(-1.5), p(0.0), p(1.0), p(-2.0)], 0.0),
            ([p(3.0), p(1.0), p(1.0), p(1.0)], 2.0),
        ] {
            assert_eq!(point_triangle(&corners).0.distance(), d, "{corners:?}");
        }
        for (corners, d) in [
            ([p(1.0), p(1.0), p(0.0), p(4.0)], 0.0),
            ([p(0.0), p(4.0), p(1.0), p(1.0)], 0.0),
            ([p(1.0), p(1.0), p(3.0), p(3.0)], 2.0),
            ([p(0.0), p(1.0), p(3.0), p(4.0)], 2.0),
        ] {
            assert_eq!(edge_edge(&corners).distance(), d, "{corners:?}");
        }
    }

    #[test]
    fn nearly_degenerate_edges_have_their_distance() {
        let mut noise = Noise(9);
        for power in 3..16 {
            let tilt = 0.1f64.powi(power);
            let shift = Vec3::new(noise.number(), 0.0, 0.3);
            let end = Vec3::new(1.0, tilt * noise.number(), tilt * noise.number());
            let x = [Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), shift, shift + end];
            let d = edge_edge(&x).distance();
            assert!((d - 0.3).abs() < 2.0 * tilt, "{tilt:e}: {d}");
        }
    }

    /// First and second derivatives of d² against differences.
    fn derivatives(x: &Corners, of: impl Fn(&Corners) -> Nearest) {
        let here = of(x);
        let exact = here.squared_hessian(x);
        let h = 1e-5;
        for k in 0..4 {
            for a in 0..3 {
                let at = |h: f64| {
                    let mut x = *x;
                    x[k][a] += h;
                    let nearest = of(&x);
                    let gradient = nearest.weights().map(|w| 2.0 * w * nearest.connection());
                    (nearest.distance().powi(2), gradient)
                };
                let ((up, above), (down, below)) = (at(h), at(-h));
                let slope = 2.0 * here.weights()[k] * here.connection()[a];
                assert!(((up - down) / (2.0 * h) - slope).abs() < 1e-7 * (1.0 + slope.abs()));
                for m in 0..4 {
                    let by = (above[m] - below[m]) / (2.0 * h);
                    let row = exact[m][k].column(a).into_owned();
                    assert!(
                        (by - row).norm() < 2e-5 * (1.0 + row.norm()),
                        "{k} {a} {m}: {by} {row}"
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_are_exact() {
        let mut noise = Noise(4);
        for _ in 0..200 {
            let x = noise.corners();
            if point_triangle(&x).0.distance() > 0.1 && edge_edge(&x).distance() > 0.1 {
                derivatives(&x, |x| point_triangle(x).0);
                derivatives(&x, edge_edge);
            }
        }
    }
}
