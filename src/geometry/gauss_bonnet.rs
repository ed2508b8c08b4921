//! The theorem of Gauss and Bonnet for a triangulated surface.
//!
//! ```text
//! Σ_interior (2π - Σ angles) + Σ_boundary (π - Σ angles) = 2π χ,     χ = V - E + F
//! ```
//!
//! with the angles of the triangles around each vertex: curvature inside, turning along the boundary. It holds for
//! every shape up to round-off. What breaks it is a triangle whose angles do not add up to π, since two of its
//! corners coincide or are not finite, or a topology that contradicts itself.

use std::f64::consts::PI;

use super::curvature::angle;
use rumple_numerics::Vec3;
use rumple_numerics::parallel;
use rumple_sheet::Sheet;

/// What a surface's angles say of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TotalCurvature {
    /// Curvature inside and turning along the boundary, less 2πχ; radians.
    pub defect: f64,
    /// The triangle whose angles miss π most, if there is one that does.
    pub worst: Option<usize>,
}

/// Triangles with what is said of them.
struct Claims<'a> {
    triangles: &'a [[u32; 3]],
    boundary: &'a [bool],
    characteristic: i64,
}

impl TotalCurvature {
    /// Of `sheet` in the shape `x`.
    #[must_use]
    pub fn evaluate(sheet: &Sheet, x: &[Vec3]) -> Self {
        Self::claimed(
            &Claims {
                triangles: sheet.triangles(),
                boundary: sheet.boundary(),
                characteristic: sheet.euler_characteristic(),
            },
            x,
        )
    }

    fn claimed(claims: &Claims<'_>, x: &[Vec3]) -> Self {
        let Claims { triangles, boundary, characteristic } = claims;
        let angles = |t: usize| -> f64 {
            let corners = triangles[t].map(|v| x[v as usize]);
            (0..3).map(|k| angle(&corners, k)).sum()
        };
        // Whole turns are counted, not added up, so that a million vertices leave no round-off.
        let half_turns: i64 = boundary.iter().map(|boundary| if *boundary { 1 } else { 2 }).sum();
        let triangle_count = i64::try_from(triangles.len()).unwrap_or(i64::MAX);
        let left = half_turns - triangle_count - 2 * characteristic;
        #[allow(clippy::cast_precision_loss)]
        let left = left as f64 * PI;
        let missing = parallel::sum(triangles.len(), |t| PI - angles(t));
        let miss = |t: usize| (angles(t) - PI).abs();
        // NaN is not above anything.
        let worst = (0..triangles.len()).find(|&t| !(miss(t) <= ROUND_OFF));
        Self { defect: left + missing, worst }
    }
}

/// What the angles of a sound triangle miss π by at most.
const ROUND_OFF: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron.
    fn solid() -> (Vec<[u32; 3]>, Vec<Vec3>) {
        let x = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.3, 0.1], [0.2, 0.3, 0.9]];
        (vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], x.map(Vec3::from).to_vec())
    }

    fn defect(triangles: &[[u32; 3]], boundary: &[bool], characteristic: i64, x: &[Vec3]) -> f64 {
        TotalCurvature::claimed(&Claims { triangles, boundary, characteristic }, x).defect
    }

    #[test]
    fn a_topology_that_contradicts_itself_is_seen() {
        let (triangles, x) = solid();
        let closed = [false; 4];
        assert!(defect(&triangles, &closed, 2, &x).abs() < 1e-14);
        // A triangle that is missing, a vertex taken for one on the boundary, a handle that is none.
        assert!((defect(&triangles[1..], &closed, 2, &x) - PI).abs() < 1e-12);
        assert!((defect(&triangles, &[true, false, false, false], 2, &x) + PI).abs() < 1e-12);
        assert!((defect(&triangles, &closed, 0, &x) - 4.0 * PI).abs() < 1e-12);
        // Opened in earnest it is a disc.
        let open = [true, true, true, false];
        assert!(defect(&triangles[1..], &open, 1, &x).abs() < 1e-14);
    }

    #[test]
    fn a_triangle_without_angles_is_named() {
        let (triangles, mut x) = solid();
        let sheet = Sheet::new(x.clone(), triangles).unwrap();
        assert_eq!(TotalCurvature::evaluate(&sheet, &x).worst, None);
        x[2] = x[0];
        let seen = TotalCurvature::evaluate(&sheet, &x);
        assert!(seen.defect.abs() > 1.0 && seen.worst == Some(0), "{seen:?}");
        x[2].x = f64::NAN;
        assert!(TotalCurvature::evaluate(&sheet, &x).defect.is_nan());
    }
}
