//! The side on which a closed surface has its inside.

use rumple_numerics::Vec3;
use rumple_numerics::num::real;

use crate::Sheet;

/// Volume over the sum of the absolute values of its parts, below which it is that of a surface folded flat.
const FLAT: f64 = 1e-9;

/// The sign of the volume that the shape `x` of a closed sheet encloses, 0 where it is one of round-off.
fn side(sheet: &Sheet, x: &[Vec3]) -> f64 {
    let mean = x.iter().sum::<Vec3>() / real(x.len());
    let cone = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| x[v as usize] - mean);
        a.dot(&b.cross(&c))
    };
    let cones = sheet.triangles().iter().map(cone);
    let (volume, size) = cones.fold((0.0, 0.0), |(v, s), cone: f64| (v + cone, s + cone.abs()));
    if volume.abs() <= FLAT * size { 0.0 } else { volume.signum() }
}

/// Whether a closed sheet is turned inside out between the shapes `before` and `after`; one that is flat before is on the
/// side of its rest shape.
#[must_use]
pub fn is_turned(sheet: &Sheet, before: &[Vec3], after: &[Vec3]) -> bool {
    let closed = !sheet.boundary().contains(&true);
    if !closed {
        return false;
    }
    let before = match side(sheet, before) {
        0.0 => side(sheet, sheet.rest()),
        side => side,
    };
    before * side(sheet, after) < 0.0
}
