//! The mechanical energies: derivatives, invariants, known answers.

mod derivatives;
mod gauge;
mod hinge;
mod invariants;
mod known;
mod lanes;
mod loads;
mod membrane;
mod memory;
mod methods;
mod multigrid;
mod relaxation;
mod stability;
mod stalls;

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    Bending, BondStretching, Energy, HingeBending, Material, MeyerBending, Stretching,
    StvkStretching,
};
use rumple::sheet::Sheet;
use rumple::model::Mechanics;

use crate::common::Noise;

pub const MATERIAL: Material = Material { young: 10.0, poisson: 1.0 / 3.0, thickness: 0.5 };

/// Every combination of options, with a name for messages.
pub fn variants(sheet: &Sheet) -> Vec<(String, Box<dyn Energy>)> {
    use rumple::effects::{BendingWeight, StretchingModulus, StretchingWeight};
    use rumple::geometry::AreaRule;
    let mut all: Vec<(String, Box<dyn Energy>)> = Vec::new();
    for weight in [StretchingWeight::OptimalArea, StretchingWeight::Paper] {
        let energy = BondStretching::new(&MATERIAL, weight);
        all.push((format!("stretching {weight:?}"), Box::new(energy)));
    }
    for modulus in [StretchingModulus::Paper, StretchingModulus::Plate] {
        for poisson in [-0.2, 0.0, 1.0 / 3.0, 0.45] {
            let energy = StvkStretching::new(&Material { poisson, ..MATERIAL }, modulus);
            all.push((format!("stretching stvk {modulus:?} {poisson}"), Box::new(energy)));
        }
    }
    all.push(("bending hinge".into(), Box::new(HingeBending::new(sheet, &MATERIAL))));
    for weight in [BendingWeight::Area, BendingWeight::Paper] {
        for area in [AreaRule::FrozenVoronoi, AreaRule::Barycentric, AreaRule::MixedVoronoi] {
            let energy = MeyerBending::new(sheet, &MATERIAL, weight, area);
            all.push((format!("bending {weight:?} {area:?}"), Box::new(energy)));
        }
    }
    all
}

/// One energy on a sheet without pins, grown unevenly so that rest and current lengths differ.
pub fn alone(sheet: &Arc<Sheet>, energy: Box<dyn Energy>) -> Mechanics {
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mut mechanics = Mechanics::new(Arc::clone(sheet), vec![energy], pins).unwrap();
    let factor: Vec<f64> =
        (0..sheet.edges().len()).map(|e| 1.0 + 0.05 * (e as f64).sin()).collect();
    mechanics.set_length_factor(&factor);
    mechanics
}

/// Stretching and bending with default options.
pub fn both(sheet: &Arc<Sheet>, material: &Material, pins: Vec<[bool; 3]>) -> Mechanics {
    let (s, b) = (Stretching::default(), Bending::default());
    let energies: Vec<Box<dyn Energy>> = vec![
        Box::new(BondStretching::new(material, s.weight)),
        Box::new(MeyerBending::new(sheet, material, b.weight, b.area)),
    ];
    Mechanics::new(Arc::clone(sheet), energies, pins).unwrap()
}

/// The rest positions moved about in all three directions.
pub fn crumpled(sheet: &Sheet, amplitude: f64) -> Vec<Vec3> {
    let mut noise = Noise::new(11);
    sheet.rest().iter().map(|x| x + amplitude * noise.vector()).collect()
}
