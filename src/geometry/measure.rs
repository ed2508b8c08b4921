//! Area and enclosed volume of a sheet.
//!
//! ```text
//! A = Σ_T ½ |(x₁ - x₀) × (x₂ - x₀)|
//! V = Σ_T ⅙ (x₀ - O)·[(x₁ - O) × (x₂ - O)]        positive where normals point outwards
//! ```
//!
//! V of a closed sheet does not depend on O.

use rumple_numerics::Vec3;
use rumple_sheet::Sheet;

use super::Face;

/// Returns the area of the shape `x`, length².
#[must_use]
pub fn area(sheet: &Sheet, x: &[Vec3]) -> f64 {
    let triangles = sheet.triangles();
    let all = sheet.reduction();
    all.sum(triangles.len(), |t| Face::from_corners(&triangles[t].map(|v| x[v as usize])).area)
}

/// Returns the volume between the shape `x` and the point `origin`, length³.
#[must_use]
pub fn volume(sheet: &Sheet, x: &[Vec3], origin: Vec3) -> f64 {
    let triangles = sheet.triangles();
    sheet.reduction().sum(triangles.len(), |t| {
        let [a, b, c] = triangles[t].map(|v| x[v as usize] - origin);
        a.dot(&b.cross(&c)) / 6.0
    })
}
