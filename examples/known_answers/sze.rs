//! Cantilevers of Sze, Liu & Lo: end shear (S1, their § 3.1) and end moment (S2, § 3.2), ν = 0.
//!
//! Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551, doi:10.1016/j.finel.2003.11.001.
//!
//! The strip runs along x and moves to +z; `U` and `W` are the displacements of its end along -x
//! and z. The clamp holds two columns of vertices and lies midway between them (see `strips`). Of
//! the sides, the cells of the rim carry no bending energy in the cotangent model; the mesh is
//! wider by them, so that the width that bends is `b`.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::Material;
use rumple::num::real;
use rumple::sheet::Sheet;
use rumple::system::{Mechanics, Pins};

use super::loads::{DeadForces, EndMoment, Lever};
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
const MOST_SHEAR: f64 = 4.0;
const MOST_MOMENT: f64 = 50.0 * PI / 3.0;

/// A cantilever with its columns of vertices at the tip.
struct Cantilever {
    sheet: Arc<Sheet>,
    pins: Pins,
    last: Vec<usize>,
    before: Vec<usize>,
}

impl Cantilever {
    fn new(length: f64, rows: usize, extra: f64, models: &Models) -> Outcome<Self> {
        let mut strip = Strip { length, width: 1.0, rows, extra };
        strip.width /= bending_share(&strip.mesh()?, models)?;
        let sheet = Arc::new(strip.mesh()?);
        let spacing = strip.spacing();
        let column = |x: &Vec3| rumple::num::whole(x.x / spacing);
        let of = |c: usize| (0..sheet.vertex_count()).filter(|&i| column(&sheet.rest()[i]) == c).collect();
        let pins = sheet.rest().iter().map(|x| [column(x) < 2; 3]).collect();
        let (last, before) = (of(strip.columns()), of(strip.columns() - 1));
        Ok(Self { pins, last, before, sheet })
    }

    /// Shares of the end's width that belong to the vertices of the last column.
    fn shares(&self) -> Vec<f64> {
        let n = self.last.len() - 1;
        let share = |j: usize| if j == 0 || j == n { 0.5 } else { 1.0 };
        (0..=n).map(|j| share(j) / real(n)).collect()
    }

    fn mechanics(&self, models: &Models, load: Box<dyn rumple::effects::Energy>) -> Outcome<Mechanics> {
        let energies = vec![
            energy(&self.sheet, &MATERIAL, models.stretching)?,
            energy(&self.sheet, &MATERIAL, models.bending)?,
            load,
        ];
        Ok(Mechanics::new(Arc::clone(&self.sheet), energies, self.pins.clone())?)
    }

    fn mean(&self, column: &[usize], x: &[Vec3]) -> Vec3 {
        column.iter().map(|&i| x[i]).sum::<Vec3>() / real(column.len())
    }
}

/// -U and W of the tip at the five loads of [`SHEAR`].
pub fn shear(rows: usize, models: &Models) -> Outcome<Vec<[Sample; 2]>> {
    let strip = Cantilever::new(10.0, rows, 0.5, models)?;
    let sheet = &strip.sheet;
    let mut x = sheet.rest().to_vec();
    let start = strip.mean(&strip.last, &x);
    let mut found = Vec::new();
    for step in 1..=20u32 {
        let load = f64::from(step) / 20.0;
        let mut forces = vec![Vec3::zeros(); sheet.vertex_count()];
        for (&i, share) in strip.last.iter().zip(strip.shares()) {
            forces[i].z = MOST_SHEAR * load * share;
        }
        let mut mechanics = strip.mechanics(models, Box::new(DeadForces(forces)))?;
        newton(&mut mechanics, &mut x, 1e-10)?;
        if let Some((_, u, w)) = SHEAR.iter().find(|row| (row.0 - load).abs() < 1e-9) {
            let moved = strip.mean(&strip.last, &x) - start;
            found.push([Sample::new(sheet, -moved.x, *u), Sample::new(sheet, moved.z, *w)]);
        }
    }
    Ok(found)
}

/// -U and W of the tip at the moments `fractions` of the one that closes the strip to a ring.
///
/// The moment acts on the last two columns; the tip lies midway between them.
pub fn moment(rows: usize, steps: u32, models: &Models) -> Outcome<Vec<(f64, [Sample; 2])>> {
    const LENGTH: f64 = 12.0;
    let strip = Cantilever::new(LENGTH, rows, 1.0, models)?;
    let sheet = &strip.sheet;
    let mut x = sheet.rest().to_vec();
    let tip = |x: &[Vec3]| 0.5 * (strip.mean(&strip.last, x) + strip.mean(&strip.before, x));
    let start = tip(&x);
    let mut found = Vec::new();
    for step in 1..=steps {
        let load = f64::from(step) / f64::from(steps);
        let levers = strip.last.iter().zip(strip.shares()).enumerate();
        let levers = levers.map(|(j, (&tip, share))| Lever {
            tip,
            base: [strip.before[j], strip.before[j + 1]],
            share,
        });
        let load_energy = EndMoment {
            moment: MOST_MOMENT * load,
            levers: levers.collect(),
            from: 2.0 * PI * (load - 1.0 / f64::from(steps)),
        };
        let mut mechanics = strip.mechanics(models, Box::new(load_energy))?;
        newton(&mut mechanics, &mut x, 1e-10)?;
        let angle = 2.0 * PI * load;
        let moved = tip(&x) - start;
        let u = LENGTH * (1.0 - angle.sin() / angle);
        let w = LENGTH * (1.0 - angle.cos()) / angle;
        found.push((load, [Sample::new(sheet, -moved.x, u), Sample::new(sheet, moved.z, w)]));
    }
    Ok(found)
}
