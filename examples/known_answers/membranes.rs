//! Hencky's membrane (B7): a disc without bending stiffness, fixed at its boundary, under a dead load.
//!
//! ```text
//! w₀ = κ(ν) a (q a/Y)^⅓        Y two-dimensional Young's modulus, small rotations
//! ```
//!
//! Hencky, Z. Math. Phys. 63 (1915) 311; Fichter, NASA TP-3658 (1997), for the uniform (dead) load.

use std::sync::Arc;

use rumple::effects::Material;
use rumple::sheet::{SheetShape, generate};

use super::{Models, Outcome, Sample, area_load, at_point, mechanics, relax};

/// κ for some Poisson's ratios, from `N'' + 3N'/r + 1/(8N²) = 0, N'(1) + (1-ν) N(1) = 0`.
pub const HENCKY: [(f64, f64); 3] =
    [(0.2, 0.6774353258039543), (0.3, 0.6534433446921029), (1.0 / 3.0, 0.6447764163160953)];

/// Load `q a/Y`: small enough for the theory (the slope at the boundary is 0.04), large enough to be
/// far above round-off.
const LOAD: f64 = 1e-5;

/// Height of the middle; `kappa` is κ(ν).
pub fn hencky(vertices: usize, (nu, kappa): (f64, f64), models: &Models) -> Outcome<Sample> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 1.0 }, vertices, 1)?);
    let material = Material { young: 1.0 - nu * nu, poisson: nu, thickness: 1.0 };
    let pins = sheet.boundary().iter().map(|boundary| [*boundary; 3]).collect();
    let load = area_load(LOAD);
    let mut mechanics = mechanics(&sheet, &material, &[models.stretching, &load], pins)?;
    let exact = kappa * LOAD.cbrt();
    // Flat, it has no stiffness at all.
    let mut x = sheet.rest().to_vec();
    for (x, boundary) in x.iter_mut().zip(sheet.boundary()) {
        x.z = if *boundary { 0.0 } else { exact * (1.0 - x.norm_squared()) };
    }
    relax(&mut mechanics, &mut x, 1e-11)?;
    let top = at_point(&sheet, &x, 0.0, 0.0)?;
    Ok(Sample::new(&sheet, top.z, exact))
}
