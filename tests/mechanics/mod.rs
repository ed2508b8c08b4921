//! The mechanical energies: derivatives, invariants, known answers.

mod derivatives;
mod factors;
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
mod rest_shapes;
mod stability;
mod stalls;

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    Bending, BondStretching, EnergyTerm, HingeBending, Material, MeyerBending, Stretching,
    StvkStretching,
};
use rumple::model::{Mechanics, Potential};
use rumple::sheet::Sheet;
use rumple_numerics::linear::BlockPattern;

use crate::common::Noise;

pub const MATERIAL: Material = Material { young: 10.0, poisson: 1.0 / 3.0, thickness: 0.5 };

/// The sum of `energies` on a sheet.
pub fn potential(sheet: Arc<Sheet>, energies: Vec<EnergyTerm>, pins: Vec<[bool; 3]>) -> Potential {
    Potential::new(&Mechanics::new(sheet, energies, pins).unwrap())
}

/// Pairs of vertices up to two edges apart.
pub fn two_rings(sheet: &Sheet) -> BlockPattern {
    let each = |i: usize, f: &mut dyn FnMut(u32)| {
        sheet.vertex_edges().entries(i).iter().for_each(|n| f(n.1))
    };
    BlockPattern::of_rings(sheet.vertex_count(), 2, &each, &[])
}

/// Every combination of options, with a name for messages.
pub fn variants(sheet: &Sheet) -> Vec<(String, EnergyTerm)> {
    use rumple::effects::{BendingWeight, StretchingModulus, StretchingWeight};
    use rumple::geometry::AreaRule;
    let mut all: Vec<(String, EnergyTerm)> = Vec::new();
    for weight in [StretchingWeight::OptimalArea, StretchingWeight::Paper] {
        let energy = BondStretching::new(&MATERIAL, weight);
        all.push((format!("stretching {weight:?}"), EnergyTerm::new(energy)));
    }
    for modulus in [StretchingModulus::Paper, StretchingModulus::PlaneStress] {
        for poisson in [-0.2, 0.0, 1.0 / 3.0, 0.45] {
            let energy = StvkStretching::new(&Material { poisson, ..MATERIAL }, modulus);
            all.push((format!("stretching stvk {modulus:?} {poisson}"), EnergyTerm::new(energy)));
        }
    }
    all.push(("bending hinge".into(), EnergyTerm::new(HingeBending::new(sheet, &MATERIAL))));
    for weight in [BendingWeight::Area, BendingWeight::Paper] {
        for area in [AreaRule::FrozenVoronoi, AreaRule::Barycentric, AreaRule::MixedVoronoi] {
            let energy = MeyerBending::new(sheet, &MATERIAL, weight, area);
            all.push((format!("bending {weight:?} {area:?}"), EnergyTerm::new(energy)));
        }
    }
    all
}

/// One energy on a sheet without pins, grown unevenly so that rest and current lengths differ.
pub fn alone(sheet: &Arc<Sheet>, energy: EnergyTerm) -> Potential {
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mut mechanics = potential(Arc::clone(sheet), vec![energy], pins);
    let factor: Vec<f64> =
        (0..sheet.edges().len()).map(|e| 1.0 + 0.05 * (e as f64).sin()).collect();
    mechanics.set_length_factor(&factor);
    mechanics
}

/// Stretching and bending with default options.
pub fn both(sheet: &Arc<Sheet>, material: &Material, pins: Vec<[bool; 3]>) -> Potential {
    let (s, b) = (Stretching::default(), Bending::default());
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(material, s.weight)),
        EnergyTerm::new(MeyerBending::new(sheet, material, b.weight, b.area)),
    ];
    potential(Arc::clone(sheet), energies, pins)
}

/// The rest positions moved about in all three directions.
pub fn crumpled(sheet: &Sheet, amplitude: f64) -> Vec<Vec3> {
    let mut noise = Noise::new(11);
    sheet.rest().iter().map(|x| x + amplitude * noise.vector()).collect()
}
