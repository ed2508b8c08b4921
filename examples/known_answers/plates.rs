//! Circular plates: buckling under expansion (B1) and deflection under a pressure (B5).
//!
//! ```text
//! buckling    N_cr = k B/a²,  N = Y ε/(1-ν);   clamped: J₁(√k) = 0,
//!             supported: x J₀(x) = (1-ν) J₁(x), k = x²
//! deflection  clamped w₀ = q a⁴/(64 B),  supported w₀ = (5+ν)/(1+ν) q a⁴/(64 B)
//! ```
//!
//! Timoshenko & Woinowsky-Krieger, Theory of Plates and Shells (1959); Timoshenko & Gere,
//! Theory of Elastic Stability (1961).
//!
//! **Boundaries.** Supported: all of the boundary is fixed. Clamped: the boundary and the row of its neighbours are
//! fixed. Bending is then felt from the cells of the second row on, which reach half a row to either
//! side, so the clamped circle lies midway between the two rows: `a` is the mean of their radii.

use std::sync::Arc;

use rumple::effects::Material;
use rumple::effects::Pins;
use rumple::num::real;
use rumple::sheet::{Sheet, SheetShape, generate};

use super::{
    Models, Outcome, Sample, Stiffness, area_load, at_point, critical, mechanics, relax_flat,
};

/// How the boundary is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// In place, free to turn.
    Supported,
    /// In place and in direction.
    Clamped,
}

/// k for ν = 1/3: first root of x J₀(x) = (2/3) J₁(x), squared.
const K_SUPPORTED: f64 = 4.282410148730029;
/// The same for ν = -1/3, which hinges have.
const K_SUPPORTED_HINGES: f64 = 2.387093841844885;
/// k: first root of J₁, squared.
const K_CLAMPED: f64 = 14.681970642123895;

/// A disc of radius 1 with its fixed vertices and the radius of the circle on which it is fixed.
pub struct Plate {
    pub sheet: Arc<Sheet>,
    pub pins: Pins,
    pub radius: f64,
    pub material: Material,
}

/// The plate on a mesh of so many vertices.
pub fn plate(vertices: usize, boundary: Boundary) -> Outcome<Plate> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 1.0 }, vertices, 1)?);
    let mut fixed = sheet.boundary().to_vec();
    let mut radius = 1.0;
    if boundary == Boundary::Clamped {
        for edge in sheet.edges() {
            for [a, b] in [[0, 1], [1, 0]] {
                if sheet.boundary()[edge.vertices[a] as usize] {
                    fixed[edge.vertices[b] as usize] = true;
                }
            }
        }
        let second = (0..vertices).filter(|&i| fixed[i] && !sheet.boundary()[i]);
        let radii: Vec<f64> = second.map(|i| sheet.rest()[i].norm()).collect();
        radius = 0.5 * (1.0 + radii.iter().sum::<f64>() / real(radii.len()));
    }
    let pins = fixed.iter().map(|h| [*h; 3]).collect();
    let material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness: 0.03 };
    Ok(Plate { sheet, pins, radius, material })
}

/// Critical expansion of a disc whose boundary cannot move (B1), ν = 1/3.
pub fn buckling(vertices: usize, boundary: Boundary, models: &Models) -> Outcome<Sample> {
    let Plate { sheet, pins, radius, material } = plate(vertices, boundary)?;
    let k = match boundary {
        Boundary::Clamped => K_CLAMPED,
        Boundary::Supported if models.bending_poisson(&material) < 0.0 => K_SUPPORTED_HINGES,
        Boundary::Supported => K_SUPPORTED,
    };
    let ratio = material.bending_rigidity() / material.stretching_modulus();
    let exact = k * (1.0 - material.poisson) * ratio / (radius * radius);
    let effects = [models.stretching, models.bending];
    let mut mechanics = mechanics(&sheet, &material, &effects, pins.clone())?;
    let mut stiffness = Stiffness::new(&sheet)?;
    let mut x = sheet.rest().to_vec();
    let computed = critical(0.5 * exact, 1.5 * exact, |strain| {
        let factor = vec![1.0 + strain; sheet.edges().len()];
        relax_flat(&sheet, &material, models, (&pins, &factor), &mut x)?;
        mechanics.set_length_factor(&factor);
        Ok(stiffness.is_positive(&mut mechanics, &x))
    })?;
    Ok(Sample::new(&sheet, computed, exact))
}

/// Deflection of the middle under a small uniform pressure (B5), ν = 1/3.
pub fn deflection(vertices: usize, boundary: Boundary, models: &Models) -> Outcome<Sample> {
    let Plate { sheet, pins, radius, material } = plate(vertices, boundary)?;
    let nu = models.bending_poisson(&material);
    let support = if boundary == Boundary::Clamped { 1.0 } else { (5.0 + nu) / (1.0 + nu) };
    let exact = support * radius.powi(4) / (64.0 * material.bending_rigidity());
    let load = area_load(1.0);
    let effects = [models.stretching, models.bending, &load];
    let mut mechanics = mechanics(&sheet, &material, &effects, pins)?;
    let rest = sheet.rest().to_vec();
    let forces = mechanics.force_of(2, &rest);
    let moved = Stiffness::new(&sheet)?.response(&mut mechanics, &rest, forces)?;
    Ok(Sample::new(&sheet, at_point(&sheet, &moved, 0.0, 0.0)?.z, exact))
}
