//! Cantilevers of Sze, Liu & Lo: end shear (S1, their § 3.1) and end moment (S2, § 3.2), ν = 0.
//!
//! Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551.
//!
//! The strip runs along x and moves to +z; `U` and `W` are the displacements of its end along -x
//! and z. The clamp holds two columns of vertices and lies midway between them (see `strips`). Of
//! the sides, the cells of the boundary carry no bending energy in the cotangent model; the mesh is
//! wider by them, so that the width that bends is `b`.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::Pins;
use rumple::effects::{EnergyTerm, Material};
use rumple::model::{Mechanics, Potential};
use rumple::num::{real, whole};
use rumple::sheet::Sheet;

use super::loads::{EndMoment, Lever};
use super::meshes::Strip;
use super::strips::bending_share;
use super::{Models, Outcome, Sample, energy, newton};

/// P/P_max, -U, W of S1: the inextensible elastica, which Sze's table agrees with to 0.2 %.
pub const SHEAR: [(f64, f64, f64); 5] = [
    (0.2, 0.3817, 2.4945),
    (0.4, 1.1860, 4.2941),
    (0.6, 2.0046, 5.4455),
    (0.8, 2.7080, 6.1918),
    (1.0, 3.2894, 6.6996),
];

const MATERIAL: Material = Material { young: 1.2e6, poisson: 0.0, thickness: 0.1 };
/// Length of the strip that is rolled up.
pub const ROLL_LENGTH: f64 = 12.0;
const MAX_SHEAR: f64 = 4.0;
const MAX_MOMENT: f64 = 50.0 * PI / 3.0;

/// A cantilever and its clamp.
struct Cantilever {
    strip: Strip,
    sheet: Arc<Sheet>,
    pins: Pins,
}

impl Cantilever {
    fn new(length: f64, rows: usize, extra: f64, models: &Models) -> Outcome<Self> {
        let mut strip = Strip { length, width: 1.0, rows, extra };
        strip.width /= bending_share(&strip.mesh()?, models)?;
        let sheet = Arc::new(strip.mesh()?);
        let mut cantilever = Self { strip, sheet, pins: Vec::new() };
        cantilever.pins = vec![[false; 3]; cantilever.sheet.vertex_count()];
        for column in 0..2 {
            for i in cantilever.column(column) {
                cantilever.pins[i] = [true; 3];
            }
        }
        Ok(cantilever)
    }

    /// Vertices of a column, by ascending y.
    fn column(&self, number: usize) -> Vec<usize> {
        let spacing = self.strip.spacing();
        let rest = self.sheet.rest();
        (0..rest.len()).filter(|&i| whole(rest[i].x / spacing) == number).collect()
    }

    fn mechanics(&self, models: &Models, load: EnergyTerm) -> Outcome<Potential> {
        let energies = vec![
            energy(&self.sheet, &MATERIAL, models.stretching)?,
            energy(&self.sheet, &MATERIAL, models.bending)?,
            load,
        ];
        Ok(Potential::new(&Mechanics::new(Arc::clone(&self.sheet), energies, self.pins.clone())?))
    }
}

fn mean(vertices: &[usize], x: &[Vec3]) -> Vec3 {
    vertices.iter().map(|&i| x[i]).sum::<Vec3>() / real(vertices.len())
}

/// -U and W of the tip at the five loads of [`SHEAR`], reached in ten steps.
pub fn shear(rows: usize, models: &Models) -> Outcome<Vec<[Sample; 2]>> {
    let cantilever = Cantilever::new(10.0, rows, 0.5, models)?;
    let (strip, sheet) = (&cantilever.strip, &cantilever.sheet);
    let last = cantilever.column(strip.columns());
    let edge = (real(strip.columns()) - 0.5) * strip.spacing();
    let mut x = sheet.rest().to_vec();
    let start = mean(&last, &x);
    let mut found = Vec::new();
    for step in 1..=10u32 {
        let load = f64::from(step) / 10.0;
        let density = MAX_SHEAR * load / strip.width;
        let table = format!(
            "kind = 'load'\nwhere = {{ box = {{ min = [{edge:e}, -1e9, -1e9], \
             max = [1e9, 1e9, 1e9] }} }}\nforce = {{ per-length = [0.0, 0.0, {density:e}] }}"
        );
        let load_energy = energy(sheet, &MATERIAL, &table)?;
        let mut mechanics = cantilever.mechanics(models, load_energy)?;
        newton(&mut mechanics, &mut x, 1e-10)?;
        if let Some((_, u, w)) = SHEAR.iter().find(|row| (row.0 - load).abs() < 1e-9) {
            let moved = mean(&last, &x) - start;
            found.push([Sample::new(sheet, -moved.x, *u), Sample::new(sheet, moved.z, *w)]);
        }
    }
    Ok(found)
}

/// -U and W of the tip at `steps` moments up to the one that closes the strip to a ring.
///
/// The moment acts on levers between the last two columns that bend, so the strip ends midway
/// between these; beyond follows the boundary, which carries nothing. (On the boundary itself a moment finds
/// displacements that the cotangent curvature does not see, and pulls triangles apart.)
pub fn moment(rows: usize, steps: u32, models: &Models) -> Outcome<Vec<(f64, [Sample; 2])>> {
    let cantilever = Cantilever::new(ROLL_LENGTH, rows, 2.0, models)?;
    let (strip, sheet) = (&cantilever.strip, &cantilever.sheet);
    let tips = cantilever.column(strip.columns() - 1);
    let bases = cantilever.column(strip.columns() - 2);
    let mut x = sheet.rest().to_vec();
    let mut before = x.clone();
    let tip = |x: &[Vec3]| 0.5 * (mean(&tips, x) + mean(&bases, x));
    let start = tip(&x);
    let mut found = Vec::new();
    for step in 1..=steps {
        let load = f64::from(step) / f64::from(steps);
        let levers = (0..rows)
            .map(|j| Lever {
                tip: tips[j + 1],
                base: [bases[j], bases[j + 1]],
                share: 1.0 / real(rows),
            })
            .collect();
        let from = 2.0 * PI * (load - 1.0 / f64::from(steps));
        let load_energy = EnergyTerm::new(EndMoment { moment: MAX_MOMENT * load, levers, from });
        let guess = x.iter().zip(&before).map(|(x, before)| 2.0 * x - before).collect();
        before = std::mem::replace(&mut x, guess);
        newton(&mut cantilever.mechanics(models, load_energy)?, &mut x, 1e-9)
            .map_err(|e| format!("{rows} rows, load {load}: {e}"))?;
        let angle = 2.0 * PI * load;
        let moved = tip(&x) - start;
        let u = ROLL_LENGTH * (1.0 - angle.sin() / angle);
        let w = ROLL_LENGTH * (1.0 - angle.cos()) / angle;
        found.push((load, [Sample::new(sheet, -moved.x, u), Sample::new(sheet, moved.z, w)]));
    }
    Ok(found)
}
