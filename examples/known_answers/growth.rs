//! Growth and topology that bend a free sheet: the spherical cap (F2), the cone (F3) and disclinations (F5).
//!
//! ```text
//! cap            Φ(ρ) = 1/(1 + ρ²/(4 R_s²)) on a flat disc is the metric of a sphere of radius R_s;
//!                height 2 R² R_s/(4 R_s² + R²) in the thin limit, lower by (1+ν) √(B/Y)
//! cone           length factor λ along the radius of a flat disc, 1 across it: slope of the cone √(λ² - 1)
//! disclination   flat → buckled at Y R²/B = 154 (five-fold), 192 (seven-fold), R centre to corner
//! ```
//!
//! The correction is the bending of a spherical shell near its free edge: the spherical metric with
//! flat rest curvature has the moment `M = B(1+ν)/R_s` everywhere but at the boundary, and to take it
//! away there moves the boundary by `M/(2Bβ²)`, `β⁴ = Y/(4 B R_s²)`. ν is that of bending.
//!
//! The numbers of the second are those quoted for bonds and hinges: Seung & Nelson, Phys. Rev. A 38
//! (1988) 1005, doi:10.1103/PhysRevA.38.1005.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    EffectContext, EffectSpec, Fibre, Field, Growth, Material, Measure, Pins, Region,
};
use rumple::num::real;
use rumple::sheet::{Sheet, SheetShape, generate};

use super::meshes::{disclination, pressed_flat};
use super::{Models, Outcome, Sample, Stiffness, critical, mechanics, relax, relax_flat};

const SPHERE: f64 = 20.0;
const DISC: f64 = 10.0;

/// Holds three vertices in six directions, which stops rigid motions and nothing else.
fn statically_determinate(sheet: &Sheet, [a, b, c]: [usize; 3]) -> Pins {
    let mut pins = vec![[false; 3]; sheet.vertex_count()];
    pins[a] = [true; 3];
    pins[b] = [false, true, true];
    pins[c] = [false, false, true];
    pins
}

/// A cap's height beside two theories.
#[derive(Debug, Clone, Copy)]
pub struct Cap {
    /// Beside the limit of no thickness.
    pub thin: Sample,
    /// Beside the theory that counts the free edge.
    pub edge: Sample,
}

/// Height of the cap that a disc of thickness `thickness` becomes by growth.
pub fn cap(vertices: usize, thickness: f64, models: &Models) -> Outcome<Cap> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: DISC }, vertices, 1)?);
    let material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness };
    let free = vec![[false; 3]; vertices];
    let mut mechanics = mechanics(&sheet, &material, &[models.stretching, models.bending], free)?;
    let at =
        |v: u32| 1.0 / (1.0 + sheet.rest()[v as usize].norm_squared() / (4.0 * SPHERE * SPHERE));
    let factor: Vec<f64> =
        sheet.edges().iter().map(|e| 0.5 * (at(e.vertices[0]) + at(e.vertices[1]))).collect();
    mechanics.set_length_factor(&factor);
    // A slight dome says to which side.
    let mut x = sheet.rest().to_vec();
    for x in &mut x {
        x.z = -0.1 * x.norm_squared() / (2.0 * SPHERE);
    }
    relax(&mut mechanics, &mut x, 1e-9)?;
    let exact = 2.0 * DISC * DISC * SPHERE / (4.0 * SPHERE * SPHERE + DISC * DISC);
    let height = rise(&sheet, &x);
    let ratio = material.bending_rigidity() / material.stretching_modulus();
    let corrected = exact - (1.0 + models.bending_poisson(&material)) * ratio.sqrt();
    Ok(Cap {
        thin: Sample::new(&sheet, height, exact),
        edge: Sample::new(&sheet, height, corrected),
    })
}

/// Slope of the cone that a disc of thickness `thickness` becomes by growth along its radius by `factor`, between 0.3 and
/// 0.8 of the radius.
pub fn cone(vertices: usize, thickness: f64, factor: f64, models: &Models) -> Outcome<Sample> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: DISC }, vertices, 1)?);
    let material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness };
    let free = vec![[false; 3]; vertices];
    let mut mechanics = mechanics(&sheet, &material, &[models.stretching, models.bending], free)?;
    let radial = ["x", "y", "0"].map(|text| Field::Formula(text.into()));
    let growth = Growth {
        factor: None,
        along: Some(Field::Formula(factor.to_string())),
        across: None,
        shear: None,
        fibre: Some(Fibre::Components(radial)),
        region: Region::All,
    };
    let context = EffectContext {
        sheet: &sheet,
        material: Some(&material),
        varying: None,
        kinetics: None,
        measure: Measure::Concentration,
        read: None,
    };
    let grown = growth.build(&context)?.growth.remove(0);
    mechanics.set_length_factor(&grown.at_edges(&sheet, 0.0));
    let slope = (factor * factor - 1.0).sqrt();
    let mut x = sheet.rest().to_vec();
    for x in &mut x {
        x.z = -0.9 * slope * x.norm();
    }
    relax(&mut mechanics, &mut x, 1e-9)?;
    // Least squares of the height by the distance from the axis.
    let (mut n, mut r, mut rr, mut z, mut rz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (rest, x) in sheet.rest().iter().zip(&x) {
        if (0.3..0.8).contains(&(rest.norm() / DISC)) {
            let radius = x.xy().norm();
            n += 1.0;
            r += radius;
            rr += radius * radius;
            z += x.z;
            rz += radius * x.z;
        }
    }
    Ok(Sample::new(&sheet, -(n * rz - r * z) / (n * rr - r * r), slope))
}

/// Height of the middle over the mean of the boundary, along the axis of the boundary.
fn rise(sheet: &Sheet, x: &[Vec3]) -> f64 {
    let boundary: Vec<usize> = (0..x.len()).filter(|&i| sheet.boundary()[i]).collect();
    let mean = boundary.iter().map(|&i| x[i]).sum::<Vec3>() / real(boundary.len());
    // No vertex lies in the middle of the disc: the top of the paraboloid through the vertices near it.
    let near: Vec<usize> = (0..x.len()).filter(|&i| sheet.rest()[i].norm() < 0.15 * DISC).collect();
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    for &i in &boundary {
        let d = x[i] - mean;
        normal += d * d.transpose();
    }
    let decomposed = normal.symmetric_eigen();
    let axis: Vec3 = decomposed.eigenvectors.column(decomposed.eigenvalues.imin()).into();
    let (mut n, mut s, mut ss, mut z, mut sz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &i in &near {
        let square = sheet.rest()[i].norm_squared();
        let height = (x[i] - mean).dot(&axis);
        n += 1.0;
        s += square;
        ss += square * square;
        z += height;
        sz += square * height;
    }
    ((z * ss - sz * s) / (n * ss - s * s)).abs()
}

/// Föppl-von Kármán number Y R²/B, R = `shells` edges, at which a disclinated patch leaves the plane.
pub fn disclination_buckling(fold: usize, shells: usize, models: &Models) -> Outcome<Sample> {
    let exact = if fold == 5 { 154.0 } else { 192.0 };
    let sheet = Arc::new(disclination(fold, shells)?);
    let material = |number: f64| {
        let thickness = real(shells) * (12.0 / number).sqrt();
        Material { young: 1.0 / thickness, poisson: 1.0 / 3.0, thickness }
    };
    // The two ends of the first ray's edge, and the first vertex of the third sector.
    let sector = shells * (shells + 1) / 2;
    let pins = statically_determinate(&sheet, [0, 1, 1 + 2 * sector]);
    let unstrained = vec![1.0; sheet.edges().len()];
    let mut x = pressed_flat(fold, shells);
    relax_flat(&sheet, &material(exact), models, (&pins, &unstrained), &mut x)?;
    let mut stiffness = Stiffness::new(&sheet)?;
    let computed = critical(0.3 * exact, 3.0 * exact, |number| {
        let effects = [models.stretching, models.bending];
        let mut mechanics = mechanics(&sheet, &material(number), &effects, pins.clone())?;
        Ok(stiffness.is_positive(&mut mechanics, &x))
    })?;
    Ok(Sample::new(&sheet, computed, exact))
}
