//! A spot in the middle of a disc grows by 10 % and buckles: mechanics alone, by the library.
//!
//! `cargo run --release --example 01_grown_spot`

use std::sync::Arc;

use rumple::effects::{Bending, BondStretching, EnergyTerm, Material, MeyerBending, Stretching};
use rumple::geometry::{AreaRule, Curvature, VertexArea};
use rumple::model::{Mechanics, Potential};
use rumple::sheet::{SheetShape, generate};
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec};

/// Relaxes the sheet and says how high the bump is.
///
/// # Errors
/// None is expected; they are passed on so that the example shows where they arise.
pub fn main() -> rumple::Result<()> {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 20.0 }, 1000, 1)?);
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let bending = Bending::default();
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&material, Stretching::default().weight)),
        EnergyTerm::new(MeyerBending::new(&sheet, &material, bending.weight, bending.area)),
    ];
    let boundary_fixed_vertically =
        sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    let mut mechanics =
        Potential::new(&Mechanics::new(Arc::clone(&sheet), energies, boundary_fixed_vertically)?);

    // Active strain: the length factor of every bond.
    let inside = |v: u32| sheet.rest()[v as usize].norm() < 6.0;
    let grows = |e: &rumple::sheet::Edge| e.vertices.iter().all(|v| inside(*v));
    let factor: Vec<f64> = sheet.edges().iter().map(|e| if grows(e) { 1.1 } else { 1.0 }).collect();
    mechanics.set_length_factor(&factor);

    // A flat sheet is a saddle; a slight dome says which way to buckle.
    let mut x = sheet.rest().to_vec();
    for (x, boundary) in x.iter_mut().zip(sheet.boundary()) {
        x.z = if *boundary { 0.0 } else { 0.1 * (-x.norm_squared() / 40.0).exp() };
    }
    let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default())?;
    let goal = Goal { tolerance: 1e-8, max_iterations: 1000, ..Goal::default() };
    let done = solver.relax(&mut mechanics, &mut x, &goal)?;
    let area = VertexArea::new(&sheet, AreaRule::default());
    let curvature = Curvature::evaluate(&mechanics.shape(&x), &area);
    let height = x.iter().map(|x| x.z).fold(0.0, f64::max);
    let sharpest = curvature.mean.iter().copied().fold(0.0, f64::max);
    println!("{done:?}\nheight {height:.3}, largest mean curvature {sharpest:.3}");
    assert!(height > 1.0, "the spot did not buckle");
    Ok(())
}
