//! Euler's strip (B3): buckling of a narrow strip that expands between immovable ends.
//!
//! ```text
//! N = Y ε = k π² D'/L²,  D' = B(1-ν²) where the strip is narrow;  k = 1 pinned, 4 clamped ends
//! A = (2L/π) √(ε - ε_cr)      height of the pinned strip beyond
//! ```
//!
//! **Edges.** A bending energy that lives on interior vertices leaves out the cells along the free
//! sides: the strip bends like one that is narrower by these cells (¾ of an edge). The exact values
//! here count the width of the interior cells for such a model ([`bending_share`]).
//!
//! Bonds are not isotropic in the right-angled half triangles along the straight sides: pulled along
//! x these are 14/9 times as stiff as the lattice. They make up 1/(2 rows) of the area, so `N` is
//! larger by 1 + 5/(18 rows), which the exact values count too.
//!
//! **Step in thickness.** A strip that is clamped at one end and loaded by F at the other, of which the half at the clamp is
//! thicker (rigidities B₁ and B₂):
//!
//! ```text
//! δ = F L³/(3 w) [ (7/8)/D₁' + (1/8)/D₂' ]
//! ```
//!
//! **Ends.** Pinned: the last column of vertices is fixed along x and z. Clamped: the last two are,
//! and the length is measured between the middles of these pairs.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{Field, Material, MaterialField, Pins};
use rumple::geometry::{AreaRule, VertexArea};
use rumple::kinetics::Location;
use rumple::num::real;
use rumple::sheet::Sheet;

use super::meshes::Strip;
use super::{
    BOND, MEYER, Models, Outcome, Sample, Stiffness, critical, mechanics, newton, relax_flat,
};

/// How the ends are fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// In place, free to turn.
    Pinned,
    /// In place and in direction.
    Clamped,
}

const LENGTH: f64 = 20.0;
/// So that the triangles are equilateral with 23 columns a row: bonds would notice otherwise. For
/// pinned ends the number of rows is then even, for clamped ones (a column more) odd.
const WIDTH: f64 = 1.004_087_420_5;
const MATERIAL: Material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness: 0.5 };

/// Share of a strip's width that carries bending energy under `models`.
pub fn bending_share(sheet: &Sheet, models: &Models) -> Outcome<f64> {
    if models.bending != MEYER {
        return Ok(1.0);
    }
    let material = Material { ..MATERIAL };
    let free = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = mechanics(&Arc::new(sheet.clone()), &material, &[BOND], free)?;
    let area = VertexArea::new(sheet, AreaRule::FrozenVoronoi);
    let last = sheet.rest().iter().map(|x| x.x).fold(0.0, f64::max);
    let (mut inner, mut all) = (0.0, 0.0);
    let shape = mechanics.shape(sheet.rest());
    for (t, triangle) in sheet.triangles().iter().enumerate() {
        for (v, share) in triangle.iter().zip(area.corner_areas(&shape, t)) {
            let (v, x) = (*v as usize, sheet.rest()[*v as usize].x);
            if x > 1e-9 && x < last - 1e-9 {
                all += share;
                inner += if sheet.boundary()[v] { 0.0 } else { share };
            }
        }
    }
    Ok(inner / all)
}

struct Euler {
    strip: Strip,
    sheet: Arc<Sheet>,
    pins: Pins,
    critical: f64,
}

fn euler(rows: usize, ends: Ends, models: &Models) -> Outcome<Euler> {
    let extra = if ends == Ends::Clamped { 1.0 } else { 0.0 };
    let strip = Strip { length: LENGTH, width: WIDTH, rows, extra };
    let sheet = Arc::new(strip.mesh()?);
    let (dx, last) = (strip.spacing(), strip.spacing() * real(strip.columns()));
    let reach = (extra + 0.5) * dx;
    let fixed = |x: &Vec3| x.x < reach || x.x > last - reach;
    let mut pins: Pins = sheet.rest().iter().map(|x| [fixed(x), false, fixed(x)]).collect();
    pins[rows / 2][1] = true;
    let nu = models.bending_poisson(&MATERIAL);
    let narrow = MATERIAL.bending_rigidity() * (1.0 - nu * nu) * bending_share(&sheet, models)?;
    let k = if ends == Ends::Clamped { 4.0 } else { 1.0 };
    let sides = if models.stretching == BOND { 5.0 / (18.0 * real(rows)) } else { 0.0 };
    let modulus = MATERIAL.stretching_modulus() * (1.0 + sides);
    let critical = k * PI * PI * narrow / (modulus * LENGTH * LENGTH);
    Ok(Euler { strip, sheet, pins, critical })
}

/// Critical expansion of a narrow strip.
pub fn buckling(rows: usize, ends: Ends, models: &Models) -> Outcome<Sample> {
    let Euler { sheet, pins, critical: exact, .. } = euler(rows, ends, models)?;
    let effects = [models.stretching, models.bending];
    let mut mechanics = mechanics(&sheet, &MATERIAL, &effects, pins.clone())?;
    let mut stiffness = Stiffness::new(&sheet)?;
    let mut x = sheet.rest().to_vec();
    let computed = critical(0.5 * exact, 1.5 * exact, |strain| {
        let factor = vec![1.0 + strain; sheet.edges().len()];
        relax_flat(&sheet, &MATERIAL, models, (&pins, &factor), &mut x)?;
        mechanics.set_length_factor(&factor);
        Ok(stiffness.is_positive(&mut mechanics, &x))
    })?;
    Ok(Sample::new(&sheet, computed, exact))
}

/// Height of the pinned strip at `load` times the critical expansion.
pub fn height(rows: usize, load: f64, models: &Models) -> Outcome<Sample> {
    let Euler { strip, sheet, pins, critical } = euler(rows, Ends::Pinned, models)?;
    let effects = [models.stretching, models.bending];
    let mut mechanics = mechanics(&sheet, &MATERIAL, &effects, pins)?;
    mechanics.set_length_factor(&vec![1.0 + load * critical; sheet.edges().len()]);
    let exact = 2.0 * LENGTH / PI * ((load - 1.0) * critical).sqrt();
    let mut x = sheet.rest().to_vec();
    for x in &mut x {
        x.z = 0.3 * exact * (PI * x.x / LENGTH).sin();
    }
    // The ends' sines are round-off, not zero.
    for (x, fixed) in x.iter_mut().zip(mechanics.pins()) {
        x.z = if fixed[2] { 0.0 } else { x.z };
    }
    newton(&mut mechanics, &mut x, 1e-10)?;
    let middle = 0.5 * strip.spacing() * real(strip.columns());
    let crest: Vec<f64> = (0..x.len())
        .filter(|&i| (sheet.rest()[i].x - middle).abs() < 0.5 * strip.spacing())
        .map(|i| x[i].z)
        .collect();
    Ok(Sample::new(&sheet, crest.iter().sum::<f64>() / real(crest.len()), exact))
}

/// Thickness of the half of a strip at its clamp, in units of that of the other half.
const STEP: f64 = 2.0;

/// Deflection of the end of a strip with a step in thickness under a small load there.
pub fn step(rows: usize, models: &Models) -> Outcome<Sample> {
    let strip = Strip { length: LENGTH, width: WIDTH, rows, extra: 1.0 };
    let sheet = Arc::new(strip.mesh()?);
    let (dx, last) = (strip.spacing(), strip.spacing() * real(strip.columns()));
    // The clamp is in the middle of the first two columns; half a column at the end remains.
    let (clamp, end) = (0.5 * dx, last);
    let length = end - clamp;
    let middle = dx * (0.5 * real(strip.columns())).round();
    let share = (middle - clamp) / length;
    let thickness: Field = Field::Formula(format!(
        "{} + {}*step({middle} - x)",
        MATERIAL.thickness,
        (STEP - 1.0) * MATERIAL.thickness
    ));
    let material = MaterialField {
        thickness: thickness.on(Location::Face, &sheet, None, "thickness")?,
        ..MaterialField::from(&MATERIAL)
    };
    let pins: Pins = sheet.rest().iter().map(|x| [x.x < 1.5 * dx; 3]).collect();
    let mut mechanics = mechanics(&sheet, material, &[models.stretching, models.bending], pins)?;
    let tip: Vec<bool> = sheet.rest().iter().map(|x| x.x > end - 0.5 * dx).collect();
    let carriers = real(tip.iter().filter(|tip| **tip).count());
    let load = |tip: &bool| if *tip { Vec3::z() / carriers } else { Vec3::zeros() };
    let forces: Vec<Vec3> = tip.iter().map(load).collect();
    let moved = Stiffness::new(&sheet)?.response(&mut mechanics, sheet.rest(), forces)?;
    let height: f64 = moved.iter().zip(&tip).filter(|(_, tip)| **tip).map(|(u, _)| u.z).sum();
    let nu = models.bending_poisson(&MATERIAL);
    let thin = MATERIAL.bending_rigidity() * (1.0 - nu * nu) * bending_share(&sheet, models)?;
    let thick = STEP.powi(3) * thin;
    let rest = (1.0 - share).powi(3);
    let exact = length.powi(3) / (3.0 * WIDTH) * ((1.0 - rest) / thick + rest / thin);
    Ok(Sample::new(&sheet, height / carriers, exact))
}
