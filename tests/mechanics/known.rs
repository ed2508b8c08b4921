//! Known answers: fan, sphere, cylinder, lattice moduli.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{BendingWeight, EnergyTerm, Material, MeyerBending};
use rumple::geometry::{AreaRule, Curvature, VertexArea};
use rumple::model::Potential;
use rumple::sheet::Sheet;

use super::{both, potential};
use crate::common::{icosphere, lattice};

/// A material with B = 1.
fn unit_rigidity(poisson: f64) -> Material {
    Material { young: 12.0 * (1.0 - poisson * poisson), poisson, thickness: 1.0 }
}

fn curvature(sheet: &Sheet, rule: AreaRule, x: &[Vec3]) -> Curvature {
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = potential(Arc::new(sheet.clone()), Vec::new(), pins);
    let area = VertexArea::new(sheet, rule);
    Curvature::evaluate(&mechanics.shape(x), &area)
}

#[test]
fn fan_with_lifted_apex() {
    let mut rest = vec![Vec3::zeros()];
    for k in 0..6 {
        let phi = PI / 3.0 * f64::from(k);
        rest.push(Vec3::new(phi.cos(), phi.sin(), 0.0));
    }
    let triangles = (0..6u32).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
    let sheet = Sheet::new(rest, triangles).unwrap();
    let mut x = sheet.rest().to_vec();
    x[0].z = 0.3;
    let c = curvature(&sheet, AreaRule::Barycentric, &x);
    assert!((c.area[0] - 0.916515138991168).abs() < 1e-12);
    assert!((c.mean[0] - 0.535714285714286).abs() < 1e-12);
    assert!((c.gaussian[0] - 0.316623963573207).abs() < 1e-12);
    let c = curvature(&sheet, AreaRule::MixedVoronoi, &x);
    assert!((c.area[0] - 0.891965626339619).abs() < 1e-12);
    assert!((c.mean[0] - 0.5504587155963305).abs() < 1e-12);
}

#[test]
fn sphere_curvature_and_energy() {
    let sheet = icosphere(3, 5.0);
    let c = curvature(&sheet, AreaRule::MixedVoronoi, sheet.rest());
    for (h, k) in c.mean.iter().zip(&c.gaussian) {
        assert!((h - 0.2).abs() < 2e-4 * 0.2 * 5.0, "{h}");
        assert!((k - 0.04).abs() < 0.02 * 0.04, "{k}");
    }
    // At a five-valent vertex barycentric areas are a known fault.
    let bary = curvature(&sheet, AreaRule::Barycentric, sheet.rest());
    assert!((bary.mean[0] / 0.2 - 1.14).abs() < 0.02, "{}", bary.mean[0] / 0.2);

    let material = unit_rigidity(1.0 / 3.0);
    let mut values = Vec::new();
    for (level, expected) in [(1, 4.7601), (2, 5.18369), (3, 5.2954), (4, 5.3238)] {
        let sheet = Arc::new(icosphere(level, 1.0));
        let energy: EnergyTerm = EnergyTerm::new(MeyerBending::new(
            &sheet,
            &material,
            BendingWeight::Area,
            AreaRule::MixedVoronoi,
        ));
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mut mechanics = potential(Arc::clone(&sheet), vec![energy], pins);
        let value = mechanics.energy(sheet.rest()) / PI;
        assert!((value / expected - 1.0).abs() < 1e-4, "{level}: {value}");
        values.push(value);
    }
    let order = ((values[1] - values[0]) / (values[2] - values[1])).log2();
    assert!((order - 2.0).abs() < 0.2, "order {order}");
    let limit = values[3] + (values[3] - values[2]) / 3.0;
    assert!((limit - 16.0 / 3.0).abs() < 1e-3, "{limit}");
}

#[test]
fn cylinder_costs_half_b_kappa_squared_per_area() {
    let mut errors = Vec::new();
    for refine in [1.0, 2.0, 4.0] {
        let sheet = Arc::new(lattice(24, 24));
        let radius = 10.0 * refine;
        let x: Vec<Vec3> = sheet
            .rest()
            .iter()
            .map(|p| {
                let phi = p.x / radius;
                Vec3::new(radius * phi.sin(), p.y, radius * (phi.cos() - 1.0))
            })
            .collect();
        let c = curvature(&sheet, AreaRule::FrozenVoronoi, &x);
        let inner = |i: usize| !sheet.boundary()[i];
        let (mut energy, mut area) = (0.0, 0.0);
        for i in (0..x.len()).filter(|&i| inner(i)) {
            assert!((c.mean[i] * 2.0 * radius - 1.0).abs() < 0.02, "H {}", c.mean[i]);
            energy += 0.5 * c.area[i] * (4.0 * c.mean[i] * c.mean[i]);
            area += c.area[i];
        }
        errors.push((energy / area * 2.0 * radius * radius - 1.0).abs());
    }
    assert!(errors[0] < 0.02 && errors[2] < errors[0] / 8.0, "{errors:?}");
}

/// Affine stretch of a lattice: the interior has modulus Y and Poisson's ratio 1/3.
#[test]
fn lattice_has_modulus_y_and_poisson_ratio_one_third() {
    let material = Material { young: 7.0, poisson: 1.0 / 3.0, thickness: 0.3 };
    let y = material.stretching_modulus();
    let (columns, rows) = (40, 40);
    let sheet = Arc::new(lattice(columns, rows));
    let mut mechanics = both(&sheet, &material, vec![[false; 3]; sheet.vertex_count()]);
    let area: f64 = mechanics.metric().area().iter().sum();
    // Both strains at once and each alone: three numbers fix an isotropic 2-D solid.
    let h = 1e-4;
    let density = |mechanics: &mut Potential, exx: f64, eyy: f64| {
        let x: Vec<Vec3> = sheet
            .rest()
            .iter()
            .map(|p| Vec3::new(p.x * (1.0 + exx), p.y * (1.0 + eyy), 0.0))
            .collect();
        mechanics.energies(&x)[0] / area
    };
    let biaxial = density(&mut mechanics, h, h) / (h * h);
    assert!((biaxial / (1.5 * y) - 1.0).abs() < 1e-3, "{biaxial} {}", 1.5 * y);
    // C11 = Y/(1-ν²) = 9Y/8, C12 = ν C11 = 3Y/8.
    let uniaxial = density(&mut mechanics, h, 0.0) / (h * h);
    assert!((uniaxial / (0.5 * 9.0 / 8.0 * y) - 1.0).abs() < 1e-3, "{uniaxial}");
    let c12 = (density(&mut mechanics, h, h) - density(&mut mechanics, h, -h)) / (2.0 * h * h);
    assert!((c12 / (3.0 / 8.0 * y) - 1.0).abs() < 1e-3, "{c12}");
}

/// Growth keeps the modulus of the grown region against its own area.
#[test]
fn a_grown_sheet_keeps_its_modulus() {
    let material = Material { young: 7.0, poisson: 1.0 / 3.0, thickness: 0.3 };
    let sheet = Arc::new(lattice(10, 10));
    let mut mechanics = both(&sheet, &material, vec![[false; 3]; sheet.vertex_count()]);
    let grow = 1.54;
    mechanics.set_length_factor(&vec![grow; sheet.edges().len()]);
    let area: f64 = mechanics.metric().area().iter().sum();
    let stretched: Vec<Vec3> = sheet.rest().iter().map(|x| x * grow * (1.0 + 1e-4)).collect();
    let density = mechanics.energies(&stretched)[0] / area / 1e-8;
    assert!((density / (1.5 * material.stretching_modulus()) - 1.0).abs() < 1e-3);
}
