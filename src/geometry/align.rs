//! Rigid motions that lay one shape on another.

use nalgebra::Matrix3;

use rumple_numerics::Vec3;
use rumple_numerics::num::real;

/// `from` moved rigidly so that it lies nearest to `to` (Kabsch, doi:10.1107/S0567739476001873).
#[must_use]
pub fn aligned(from: &[Vec3], to: &[Vec3]) -> Vec<Vec3> {
    let count = real(from.len().max(1));
    let centre = |x: &[Vec3]| x.iter().sum::<Vec3>() / count;
    let (a, b) = (centre(from), centre(to));
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(x, y)| (y - b) * (x - a).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return from.to_vec() };
    let mut keep = Matrix3::identity();
    // No mirror image: the least direction takes the sign.
    let least = svd.singular_values.imin();
    keep[(least, least)] = (u * v).determinant().signum();
    let turn = u * keep * v;
    from.iter().map(|x| turn * (x - a) + b).collect()
}
