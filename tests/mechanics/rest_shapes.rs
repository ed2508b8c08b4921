//! Bending at rest in a shape that is not flat.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{EnergyTerm, HingeBending, Material, MeyerBending, RestShape};
use rumple::geometry::AreaRule;
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate};

use super::potential;

const MATERIAL: Material = Material { young: 1e3, poisson: 0.3, thickness: 0.1 };

fn shells() -> Vec<Arc<Sheet>> {
    let made = [
        SheetShape::Sphere { radius: 10.0, irregular: true },
        SheetShape::Sphere { radius: 10.0, irregular: false },
        SheetShape::Cap { radius: 10.0, height: 10.0 },
        SheetShape::Cylinder { radius: 3.0, height: 8.0, caps: false },
        SheetShape::Torus { major: 5.0, minor: 2.0 },
    ];
    made.map(|shape| Arc::new(generate(&shape, 600, 1).unwrap())).into()
}

/// The bending of `sheet`, by name.
fn bending(sheet: &Arc<Sheet>, model: &str, rest: &RestShape) -> Potential {
    let term = match model {
        "hinge" => EnergyTerm::new(HingeBending::with_rest(sheet, &MATERIAL, rest)),
        _ => EnergyTerm::new(MeyerBending::with_rest(sheet, &MATERIAL, AreaRule::default(), rest)),
    };
    potential(Arc::clone(sheet), vec![term], vec![[false; 3]; sheet.vertex_count()])
}

const MODELS: [&str; 2] = ["hinge", "meyer"];

fn forces(potential: &mut Potential, x: &[Vec3]) -> (f64, f64) {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let energy = potential.energy_gradient(x, &mut gradient);
    (energy, gradient.iter().map(|g| g.norm()).fold(0.0, f64::max))
}

/// B = 0.0916 here, so that forces of bending are of order 0.01.
#[test]
fn shells_are_at_rest_in_their_own_mesh_to_round_off() {
    for sheet in shells() {
        for model in MODELS {
            let rest = RestShape::from_positions(sheet.rest());
            let (energy, force) = forces(&mut bending(&sheet, model, &rest), sheet.rest());
            assert!(energy.abs() < 1e-20 && force < 1e-10, "{model}: {energy:e} {force:e}");
            let (energy, force) =
                forces(&mut bending(&sheet, model, &RestShape::default()), sheet.rest());
            assert!(energy > 0.05 && force > 1e-6, "{model}: {energy:e} {force:e}");
        }
    }
}

/// A shape enlarged as a whole by growth is at rest too.
#[test]
fn a_shell_that_grows_evenly_rests_as_the_same_shape_enlarged() {
    for sheet in shells() {
        for model in MODELS {
            let mut bending = bending(&sheet, model, &RestShape::from_positions(sheet.rest()));
            bending.set_length_factor(&vec![1.3; sheet.edges().len()]);
            let x: Vec<Vec3> = sheet.rest().iter().map(|x| 1.3 * x).collect();
            let (energy, force) = forces(&mut bending, &x);
            assert!(energy.abs() < 1e-20 && force < 1e-10, "{model}: {energy:e} {force:e}");
        }
    }
}

/// A shell turned inside out is bent by twice its curvature: it is not its own mirror image.
#[test]
fn a_cap_turned_inside_out_is_under_stress() {
    let sheet = Arc::new(generate(&SheetShape::Cap { radius: 10.0, height: 2.0 }, 600, 1).unwrap());
    for model in MODELS {
        let mut bending = bending(&sheet, model, &RestShape::from_positions(sheet.rest()));
        let mirrored: Vec<Vec3> = sheet.rest().iter().map(|x| Vec3::new(x.x, x.y, -x.z)).collect();
        let (energy, _) = forces(&mut bending, &mirrored);
        let b = MATERIAL.bending_rigidity();
        // (B/2) [(4/R)² - 2(1-ν) (2/R)²] per area; hinges have ν = -1/3.
        let poisson = if model == "hinge" { -1.0 / 3.0 } else { MATERIAL.poisson };
        let area = 2.0 * std::f64::consts::PI * 10.0 * 2.0;
        let expected = 0.5 * b * (16.0 - 8.0 * (1.0 - poisson)) / 100.0 * area;
        assert!((energy / expected - 1.0).abs() < 0.1, "{model}: {energy} {expected}");
    }
}
