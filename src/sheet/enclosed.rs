//! The side on which a closed surface has its inside.

use rumple_numerics::Vec3;

use crate::Sheet;

/// Volume over the sum of the absolute values of its parts, below which it is that of a surface folded flat.
const FLAT_VOLUME_SHARE: f64 = 1e-9;

/// The sign of the volume that the shape `x` of a closed sheet encloses, 0 where it is one of round-off.
fn side(sheet: &Sheet, x: &[Vec3]) -> f64 {
    let all = sheet.reduction();
    let mean = Vec3::from([0, 1, 2].map(|axis| all.sum(x.len(), |i| x[i][axis])));
    let mean = mean / all.count(x.len());
    let triangles = sheet.triangles();
    let [volume, size] = all.sums(triangles.len(), |range| {
        let cone = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| x[v as usize] - mean);
            a.dot(&b.cross(&c))
        };
        let cones = triangles[range].iter().map(cone);
        cones.fold([0.0, 0.0], |[v, s], cone| [v + cone, s + cone.abs()])
    });
    if volume.abs() <= FLAT_VOLUME_SHARE * size { 0.0 } else { volume.signum() }
}

/// Whether a closed sheet is turned inside out between the shapes `before` and `after`; one that is flat before is on the
/// side of its rest shape. All ranks of a sheet that is spread ask together: a part without a boundary is not closed, nor is a periodic sheet.
#[must_use]
pub fn is_turned(sheet: &Sheet, before: &[Vec3], after: &[Vec3]) -> bool {
    let reduction = sheet.reduction();
    if !reduction.periods().is_empty() || reduction.any(sheet.boundary().contains(&true)) {
        return false;
    }
    let before = match side(sheet, before) {
        0.0 => side(sheet, sheet.rest()),
        side => side,
    };
    before * side(sheet, after) < 0.0
}
