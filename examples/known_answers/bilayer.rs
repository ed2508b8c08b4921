//! Q5: a free disc whose layers grow apart bends into a cap and, further on, into a trough.
//!
//! A disc of radius R and thickness h with the spontaneous curvature C₀ = (1+ν) κ₀, κ₀ the curvature of a narrow strip of it.
//! With uniform curvatures κ_x, κ_y a stress function that vanishes with its slope at the free edge carries K = κ_x κ_y:
//!
//! ```text
//! ∇⁴φ = -E h K,   φ = -E h K (R² - r²)²/64,   U_s = π E h K² R⁶/384
//! U_b = π R² D/2 [(κ_x-κ₀)² + (κ_y-κ₀)² + 2ν (κ_x-κ₀)(κ_y-κ₀)]
//! ```
//!
//! The cap κ_x = κ_y = s loses its stability to κ_x ≠ κ_y at s_c, where K remains from there on:
//!
//! ```text
//! s_c = 4 h/(R² √(1+ν)),   κ₀ = 2 s_c/(1+ν) = 8 h/(R² (1+ν)^(3/2)),   (κ_x - κ_y)² = (1+ν)² κ₀² - 4 s_c²
//! ```
//!
//! The line of the last equation is fitted to the trough: no bifurcation has to be found on a mesh that is not quite round. In the sheet
//! curvatures are not uniform near its edge, over some √(h/s).
//!
//! Freund, Substrate curvature due to thin film mismatch strain in the nonlinear deformation range, J. Mech. Phys. Solids 48 (2000) 1159;
//! Seffen & McMahon, Hyperstatic bending of bilayer discs, Int. J. Mech. Sci. 49 (2007) 230; Pezzulla, Smith, Nardinocchi & Holmes, Geometry and
//! mechanics of thin growing bilayers, Soft Matter 12 (2016) 4435.

use std::sync::Arc;

use nalgebra::{Matrix6, Vector6};
use rumple::Vec3;
use rumple::effects::Material;
use rumple::num::real;
use rumple::sheet::{Sheet, SheetShape, generate};

use super::{Outcome, Sample, mechanics, relax};

const RADIUS: f64 = 10.0;
const MATERIAL: Material = Material { young: 1e4, poisson: 0.3, thickness: 0.2 };
const STRETCHING: &str = "kind = 'stretching'\nmodel = 'stvk'\nmodulus = 'plate'";
/// C₀ of the troughs that are fitted, in units of the critical one.
const FITTED_CURVATURES: [f64; 4] = [1.15, 1.3, 1.45, 1.6];

/// The critical C₀.
fn critical() -> f64 {
    let Material { poisson, thickness, .. } = MATERIAL;
    8.0 * thickness / (RADIUS * RADIUS * (1.0 + poisson).sqrt())
}

/// (κ_x - κ_y)² of the quadric that fits best within half the radius.
fn difference_squared(sheet: &Sheet, x: &[Vec3]) -> Option<f64> {
    let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (x, rest) in x.iter().zip(sheet.rest()) {
        if rest.norm() < 0.5 * RADIUS {
            let [u, v] = [rest.x, rest.y];
            let row = Vector6::new(1.0, u, v, 0.5 * u * u, u * v, 0.5 * v * v);
            matrix += row * row.transpose();
            right += x.z * row;
        }
    }
    let fit = matrix.cholesky()?.solve(&right);
    Some((fit[3] - fit[5]).powi(2) + 4.0 * fit[4].powi(2))
}

/// What Q5 finds.
pub struct Bilayer {
    /// The C₀ at which the cap becomes a trough, in units of theory.
    pub critical: Sample,
    /// The slope of (κ_x - κ_y)² over C₀².
    pub slope: Sample,
}

/// Q5 on a disc of so many vertices.
pub fn bilayer(vertices: usize) -> Outcome<Bilayer> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: RADIUS }, vertices, 1)?);
    // A trough along y, which relaxes to the one that the mesh prefers.
    let trough = |x: &Vec3| Vec3::new(x.x, x.y, 0.25 * critical() * x.x * x.x);
    let mut x: Vec<Vec3> = sheet.rest().iter().map(trough).collect();
    let mut found: Vec<[f64; 2]> = Vec::new();
    for share in FITTED_CURVATURES {
        let curvature = share * critical();
        let bending = format!("kind = 'bending'\nmodel = 'meyer'\ncurvature = {curvature:e}");
        let pins = vec![[false; 3]; x.len()];
        let mut potential = mechanics(&sheet, &MATERIAL, &[STRETCHING, &bending], pins)?;
        relax(&mut potential, &mut x, 1e-9)?;
        let difference = difference_squared(&sheet, &x).ok_or("no quadric fits the disc")?;
        found.push([curvature.powi(2), difference]);
    }
    let mean = |k: usize| found.iter().map(|p| p[k]).sum::<f64>() / real(found.len());
    let [a, b] = [mean(0), mean(1)];
    let product: f64 = found.iter().map(|p| (p[0] - a) * (p[1] - b)).sum();
    let slope = product / found.iter().map(|p| (p[0] - a).powi(2)).sum::<f64>();
    let onset = (a - b / slope).sqrt() / critical();
    Ok(Bilayer {
        critical: Sample::new(&sheet, onset, 1.0),
        slope: Sample::new(&sheet, slope, 1.0),
    })
}
