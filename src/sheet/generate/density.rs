//! Edge length from a number of vertices.
//!
//! Euler: a triangulation with N vertices, N_r of them on the boundary, has F = 2N - N_r - 2χ
//! triangles. With equilateral triangles of edge l, F·(√3/4)l² = A and N_r = P/l for area A and
//! length P of the boundary, so
//!
//! ```text
//! (2N - 2χ) s l² - s P l - A = 0,      s = √3/4.
//! ```

use rumple_numerics::num::{real, whole};

/// The edge length (unit of length) at which `vertices` vertices fill `area` inside a boundary of length
/// `perimeter`; `twice_chi` is 2χ: 2 for a disc, 0 for a ring or tube, 4 for a sphere.
pub(super) fn edge_length(area: f64, perimeter: f64, twice_chi: f64, vertices: usize) -> f64 {
    let s = 3f64.sqrt() / 4.0;
    let m = s * (2.0 * real(vertices) - twice_chi).max(1.0);
    let p = s * perimeter;
    (p + (p * p + 4.0 * m * area).sqrt()) / (2.0 * m)
}

/// About how many vertices fill `area` inside a boundary of length `perimeter` with edges of this length: the same relation.
pub(super) fn vertex_count(area: f64, perimeter: f64, twice_chi: f64, edge: f64) -> usize {
    let s = 3f64.sqrt() / 4.0;
    whole(0.5 * ((area + s * perimeter * edge) / (s * edge * edge) + twice_chi))
}
