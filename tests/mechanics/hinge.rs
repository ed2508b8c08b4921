//! Hinge bending: moduli on a lattice, agreement with the Meyer model, folds.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{BendingWeight, Energy, EnergyTerm, HingeBending, Material, MeyerBending};
use rumple::geometry::AreaRule;
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate};

use super::potential;
use crate::common::lattice;

/// A material with B = 1.
fn unit_rigidity(poisson: f64) -> Material {
    Material { young: 12.0 * (1.0 - poisson * poisson), poisson, thickness: 1.0 }
}

fn alone(sheet: &Arc<Sheet>, energy: impl Energy + 'static) -> Potential {
    let pins = vec![[false; 3]; sheet.vertex_count()];
    potential(Arc::clone(sheet), vec![EnergyTerm::new(energy)], pins)
}

fn hinge(sheet: &Arc<Sheet>, poisson: f64) -> Potential {
    alone(sheet, HingeBending::new(sheet, &unit_rigidity(poisson)))
}

fn meyer(sheet: &Arc<Sheet>, poisson: f64) -> Potential {
    let (weight, area) = (BendingWeight::Area, AreaRule::FrozenVoronoi);
    alone(sheet, MeyerBending::new(sheet, &unit_rigidity(poisson), weight, area))
}

/// The sheet rolled up about an axis at `angle` to y.
fn rolled(sheet: &Sheet, radius: f64, angle: f64) -> Vec<Vec3> {
    let (across, axis) =
        (Vec3::new(angle.cos(), angle.sin(), 0.0), Vec3::new(-angle.sin(), angle.cos(), 0.0));
    let roll = |x: &Vec3| {
        let phi = x.dot(&across) / radius;
        let z = Vec3::new(0.0, 0.0, radius * (phi.cos() - 1.0));
        radius * phi.sin() * across + x.dot(&axis) * axis + z
    };
    sheet.rest().iter().map(roll).collect()
}

/// Area of the hinges: a third of a lattice's vertex area each.
fn area_of_hinges(sheet: &Sheet) -> f64 {
    let inner = sheet.edges().iter().filter(|e| !e.is_boundary()).count();
    inner as f64 * 0.75f64.sqrt() / 3.0
}

#[test]
fn a_cylinder_costs_half_b_kappa_squared_per_area_in_any_direction() {
    let sheet = Arc::new(lattice(60, 60));
    let area = area_of_hinges(&sheet);
    for poisson in [0.0, 1.0 / 3.0] {
        let mut mechanics = hinge(&sheet, poisson);
        for angle in [0.0, 0.3, 0.5, 1.2] {
            let density = |mechanics: &mut Potential, radius: f64| {
                mechanics.energy(&rolled(&sheet, radius, angle)) / area * 2.0 * radius * radius
            };
            // The three kinds of hinge are not quite equally many because of the boundary.
            let (coarse, fine) = (density(&mut mechanics, 5.0), density(&mut mechanics, 1e3));
            assert!((fine - 1.0).abs() < 0.02, "{angle}: {fine}");
            assert!((coarse / fine - 1.0).abs() < 0.02, "{angle}: {coarse} {fine}");
        }
    }
}

/// Gentle paraboloids: the density is (B/2)[(2H)² - 2(1-ν_h)K] with ν_h = -1/3 whatever ν is.
#[test]
fn the_lattice_has_a_gaussian_modulus_of_its_own() {
    let sheet = Arc::new(lattice(80, 80));
    let area = area_of_hinges(&sheet);
    for poisson in [0.0, 1.0 / 3.0, 0.5] {
        let mut mechanics = hinge(&sheet, poisson);
        for (k1, k2, angle) in
            [(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, -1.0, 0.4), (0.5, -0.2, 1.0)]
        {
            let scale = 1e-6;
            let (c, s) = (f64::cos(angle), f64::sin(angle));
            let height = |p: &Vec3| {
                let (u, v) =
                    (c * (p.x - 40.0) + s * (p.y - 35.0), -s * (p.x - 40.0) + c * (p.y - 35.0));
                Vec3::new(p.x, p.y, 0.5 * scale * (k1 * u * u + k2 * v * v))
            };
            let x: Vec<Vec3> = sheet.rest().iter().map(height).collect();
            let density = mechanics.energy(&x) / area / (scale * scale);
            let expected = 0.5 * ((k1 + k2) * (k1 + k2) - 2.0 * (4.0 / 3.0) * k1 * k2);
            assert!((density / expected - 1.0).abs() < 0.02, "{k1} {k2} {angle}: {density}");
        }
    }
}

/// A smooth bump away from the boundary: both models give (B/2)∫(Δw)² for any ν, and their
/// difference falls with the square of the edge length.
#[test]
fn all_bending_models_agree_for_smooth_shapes_inside_the_flat_sheet() {
    let mut errors = Vec::new();
    for refine in [1.0, 2.0, 4.0] {
        let (radius, n) = (8.0 * refine, 24.0 * refine);
        let size = rumple::num::whole(n);
        let sheet = Arc::new(lattice(size, size));
        let centre = Vec3::new(0.5 * n, 0.5 * n * 0.75f64.sqrt(), 0.0);
        let amplitude = 1e-3 * radius;
        let bump = |p: &Vec3| {
            let q = (1.0 - (p - centre).norm_squared() / (radius * radius)).max(0.0);
            Vec3::new(p.x, p.y, amplitude * q.powi(4))
        };
        let x: Vec<Vec3> = sheet.rest().iter().map(bump).collect();
        // ∫(Δw)² of (1-r²/R²)⁴: 2π ∫ (16/R²)² (1-s)⁴ (1-4s)² R²/2 ds, s = r²/R².
        let moments = 1.0 / 5.0 - 8.0 / 30.0 + 16.0 * 2.0 / 210.0;
        let exact = 0.5 * std::f64::consts::PI * 256.0 * moments * (amplitude / radius).powi(2);
        let relative = |mut mechanics: Potential| mechanics.energy(&x) / exact;
        let one_third = 1.0 / 3.0;
        let (h, m) = (relative(hinge(&sheet, one_third)), relative(meyer(&sheet, one_third)));
        for poisson in [0.0, 0.5] {
            assert!((relative(hinge(&sheet, poisson)) / h - 1.0).abs() < 1e-9);
            assert!((relative(meyer(&sheet, poisson)) / m - 1.0).abs() < 1e-8);
        }
        errors.push([(h - 1.0).abs(), (m - 1.0).abs(), (h / m - 1.0).abs()]);
    }
    for k in 0..3 {
        let order = (errors[1][k] / errors[2][k]).log2();
        assert!(errors[2][k] < 0.02 && (order - 2.0).abs() < 0.25, "{errors:?}");
    }
}

/// On an irregular mesh the stiffness of a cylinder is off by what the mesh makes of it, and
/// refinement does not help: the documented limit of the model.
#[test]
fn an_irregular_mesh_changes_the_stiffness_somewhat() {
    let mut stiffness = Vec::new();
    for vertices in [1000, 4000] {
        let shape = SheetShape::Rectangle { width: 1.0, height: 1.0 };
        let sheet = Arc::new(generate(&shape, vertices, 1).unwrap());
        let mut mechanics = hinge(&sheet, 0.3);
        let radius = 1e3;
        let energy = mechanics.energy(&rolled(&sheet, radius, 0.0));
        // A triangle at the boundary lacks a hinge, so the edge of the sheet is softer.
        let (boundary, all) =
            (sheet.edges().iter().filter(|e| e.is_boundary()).count(), sheet.edges().len());
        let area = (all - boundary) as f64 / (1.5 * sheet.triangle_count() as f64);
        stiffness.push(energy / area * 2.0 * radius * radius);
    }
    assert!(stiffness.iter().all(|s| (0.98..1.03).contains(s)), "{stiffness:?}");
}

#[test]
fn a_closing_fold_costs_more_and_more() {
    let h = 0.75f64.sqrt();
    let rest = [[0.0, 0.0], [0.0, 1.0], [-h, 0.5], [h, 0.5]];
    let rest = rest.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
    let sheet = Arc::new(Sheet::new(rest, vec![[0, 1, 2], [1, 0, 3]]).unwrap());
    let mut mechanics = hinge(&sheet, 0.3);
    for theta in [0.5, -0.5, 2.0, 3.0, 3.1] {
        let mut x = sheet.rest().to_vec();
        x[3] = Vec3::new(h * f64::cos(theta), 0.5, -h * f64::sin(theta));
        let expected = 0.5 / (2.0 * 0.5 * h) * (2.0 * f64::tan(0.5 * theta)).powi(2);
        let energy = mechanics.energy(&x);
        assert!((energy / expected - 1.0).abs() < 1e-9, "{theta}: {energy} {expected}");
    }
}
