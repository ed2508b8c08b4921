//! Dead loads and pressure: resultants, derivatives, where pressure has an energy.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::DMatrix;
use rumple::Vec3;
use rumple::effects::Pins;
use rumple::effects::{
    DeadLoad, Energy, EnergyTerm, Field, FollowerPressure, HessianPart, LoadForce, Region,
};
use rumple::model::Potential;
use rumple::num::checked::Finite;
use rumple::sheet::Sheet;
use rumple_numerics::linear::BlockMatrix;

use super::{crumpled, potential, two_rings};
use crate::common::{Noise, icosphere, irregular, lattice};

fn finite(v: [f64; 3]) -> [Finite; 3] {
    v.map(|v| Finite::new(v).unwrap())
}

fn mechanics(sheet: &Arc<Sheet>, energy: impl Energy + 'static, pins: Pins) -> Potential {
    potential(Arc::clone(sheet), vec![EnergyTerm::new(energy)], pins)
}

fn free(sheet: &Sheet) -> Pins {
    vec![[false; 3]; sheet.vertex_count()]
}

fn sum(load: &DeadLoad) -> Vec3 {
    load.force().iter().sum()
}

#[test]
fn dead_loads_have_the_resultant_that_is_asked_for() {
    let sheet = irregular(11, 9, 0.2);
    let all = Region::All.mask(&sheet);
    let f = [1.0, -2.0, 0.5];
    let vector = Vec3::from(f);
    let load = |mask: &[bool], force| DeadLoad::new(&sheet, mask, force).unwrap();
    let near = |a: Vec3, b: Vec3| assert!((a - b).norm() < 1e-12 * b.norm(), "{a} {b}");
    near(sum(&load(&all, LoadForce::Total(finite(f)))), vector);
    near(sum(&load(&all, LoadForce::PerVertex(finite(f).map(Field::from)))), 99.0 * vector);
    let few = Region::Vertices(vec![3, 50]);
    let on = load(&few.mask(&sheet), LoadForce::Total(finite(f)));
    near(on.force()[50], 0.5 * vector);
    assert_eq!(on.force()[4], Vec3::zeros());
    // The bottom row is straight, 10 long; its ends carry half of what its inner vertices do.
    let bottom = Region::Cuboid { min: [-1.0, -0.1, -1.0], max: [99.0, 0.1, 1.0] };
    let on = load(&bottom.mask(&sheet), LoadForce::PerLength(finite(f).map(Field::from)));
    near(sum(&on), 10.0 * vector);
    near(on.force()[0], 0.5 * vector);
    near(on.force()[1], vector);
    let area = 10.0 * 8.0 * 0.75f64.sqrt();
    near(sum(&load(&all, LoadForce::PerArea(finite(f).map(Field::from)))), area * vector);
    let up = load(&all, LoadForce::AlongNormal(Finite::new(3.0).unwrap().into()));
    near(sum(&up), Vec3::new(0.0, 0.0, 3.0 * area));
    let sphere = icosphere(2, 1.0);
    let all = Region::All.mask(&sphere);
    let force = LoadForce::AlongNormal(Finite::ONE.into());
    let out = DeadLoad::new(&sphere, &all, force).unwrap();
    assert!(sum(&out).norm() < 1e-13);
    assert!(out.force().iter().zip(sphere.rest()).all(|(f, x)| f.dot(x) > 0.9 * f.norm()));
    // A region in which nothing can carry the load.
    let none =
        DeadLoad::new(&sphere, &all, LoadForce::PerLength(finite(f).map(Field::from))).unwrap_err();
    assert_eq!(none.to_string(), "no boundary edge has both ends in the region of this load");
    let one = Region::Vertices(vec![7]).mask(&sphere);
    let none =
        DeadLoad::new(&sphere, &one, LoadForce::PerArea(finite(f).map(Field::from))).unwrap_err();
    assert_eq!(none.to_string(), "no triangle has all corners in the region of this load");
}

/// A force per area that is a formula of the centroids, one per length or vertex of the vertices.
#[test]
fn dead_loads_may_differ_from_place_to_place() {
    let sheet = irregular(11, 9, 0.2);
    let all = Region::All.mask(&sheet);
    let field = |text: &str| Field::Formula(text.into());
    let [zero, one] = [0.0, 1.0].map(|f| Field::from(Finite::new(f).unwrap()));
    let load = |force| DeadLoad::new(&sheet, &all, force).unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs(), "{a} {b}");
    let area = 10.0 * 8.0 * 0.75f64.sqrt();
    // The centroid of the whole sheet, by its rest shape.
    let moment = |of: &dyn Fn(&Vec3) -> f64| {
        let triangles = sheet.triangles().iter().map(|t| t.map(|v| sheet.rest()[v as usize]));
        let each = triangles
            .map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm() * of(&((a + b + c) / 3.0)));
        each.sum::<f64>()
    };
    let on = sum(&load(LoadForce::PerArea([zero.clone(), one.clone(), field("2 - x")])));
    near(on.y, area);
    near(on.z, moment(&|x| 2.0 - x.x));
    let on = load(LoadForce::AlongNormal(field("1 + y^2")));
    near(sum(&on).z, moment(&|x| 1.0 + x.y * x.y));
    let on = load(LoadForce::PerVertex([field("x"), zero.clone(), one]));
    for (force, x) in on.force().iter().zip(sheet.rest()) {
        assert_eq!(*force, Vec3::new(x.x, 0.0, 1.0));
    }
    let bottom = Region::Cuboid { min: [-1.0, -0.1, -1.0], max: [99.0, 0.1, 1.0] };
    let force = LoadForce::PerLength([zero.clone(), zero.clone(), field("x")]);
    let on = DeadLoad::new(&sheet, &bottom.mask(&sheet), force).unwrap();
    near(sum(&on).z, 50.0);
    let wrong = LoadForce::PerVertex([zero.clone(), zero, field("1/(x - x)")]);
    let error = DeadLoad::new(&sheet, &all, wrong).unwrap_err();
    assert_eq!(error.key, "force");
}

#[test]
fn a_dead_load_does_not_change_with_the_shape() {
    let sheet = Arc::new(irregular(6, 5, 0.2));
    let force = LoadForce::PerArea(finite([0.3, 0.0, -1.0]).map(Field::from));
    let load = DeadLoad::new(&sheet, &Region::All.mask(&sheet), force).unwrap();
    let forces = load.force().to_vec();
    let mut mechanics = mechanics(&sheet, load, free(&sheet));
    assert_eq!(mechanics.force_scale(), 0.0);
    assert_eq!(mechanics.energy(sheet.rest()), 0.0);
    let x = crumpled(&sheet, 0.3);
    assert_eq!(mechanics.force_of(0, &x), forces);
    let work: f64 =
        forces.iter().zip(&x).zip(sheet.rest()).map(|((f, x), r)| f.dot(&(x - r))).sum();
    assert!((mechanics.energy(&x) + work).abs() < 1e-14);
    let mut hessian = BlockMatrix::zeros(Arc::new(two_rings(&sheet)));
    mechanics.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
    assert_eq!(hessian.mean_diagonal(), 0.0);
}

#[test]
fn regions_choose_by_rest_position() {
    let sheet = lattice(11, 11);
    let count = |region: &Region| region.vertices(&sheet).len();
    let right =
        Region::HalfSpace { point: finite([9.9, 0.0, 0.0]), normal: finite([2.0, 0.0, 0.0]) };
    assert_eq!(count(&right), 6 + 5); // x = 10 in even rows, 10.5 in odd ones
    let ring = |inner: f64, outer: f64| Region::Ring {
        centre: finite([5.0, 6.0 * 0.75f64.sqrt(), 7.0]),
        axis: finite([0.0, 0.0, -3.0]),
        inner: rumple::num::checked::NonNegative::new(inner).unwrap(),
        outer: rumple::num::checked::NonNegative::new(outer).unwrap(),
    };
    assert_eq!((count(&ring(0.0, 1.1)), count(&ring(0.9, 1.1))), (7, 6));
    let corner =
        Region::AllOf(vec![Region::Boundary, right.clone(), Region::Vertices(vec![10, 9, 0])]);
    assert_eq!(corner.vertices(&sheet), [10]);
    assert_eq!(count(&Region::AllOf(vec![Region::Boundary, right])), 11);
}

/// Energy, gradient and Hessian against one another along random admissible directions.
fn check_derivatives(mechanics: &mut Potential, x: &[Vec3]) {
    let pins = mechanics.pins().clone();
    let mut hessian = BlockMatrix::zeros(Arc::new(two_rings(mechanics.sheet())));
    mechanics.hessian(x, HessianPart::Full, &mut hessian).unwrap();
    let mut noise = Noise::new(21);
    for _ in 0..4 {
        let d: Vec<Vec3> = pins
            .iter()
            .map(|fixed| {
                let v = noise.vector();
                Vec3::from_fn(|a, _| if fixed[a] { 0.0 } else { v[a] })
            })
            .collect();
        let at = |h: f64| -> Vec<Vec3> { x.iter().zip(&d).map(|(x, d)| x + h * d).collect() };
        let mut gradient = |x: &[Vec3]| {
            let mut g = vec![Vec3::zeros(); x.len()];
            let energy = mechanics.energy_gradient(x, &mut g);
            (energy, g)
        };
        let h = 1e-4;
        let (_, here) = gradient(x);
        let ((up, forward), (down, back)) = (gradient(&at(h)), gradient(&at(-h)));
        let slope: f64 = here.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
        let difference = (up - down) / (2.0 * h);
        assert!((difference - slope).abs() < 1e-6 * slope.abs(), "{difference} {slope}");
        let product =
            dense(&hessian) * nalgebra::DVector::from_fn(3 * d.len(), |r, _| d[r / 3][r % 3]);
        let mut error = 0.0f64;
        for i in 0..d.len() {
            for a in 0..3 {
                let exact = (forward[i][a] - back[i][a]) / (2.0 * h);
                error = error.max((product[3 * i + a] - exact).abs());
            }
        }
        assert!(error < 1e-6 * product.amax(), "{error:e}");
    }
}

fn dense(matrix: &BlockMatrix) -> DMatrix<f64> {
    let n = matrix.pattern().rows();
    let mut out = DMatrix::zeros(3 * n, 3 * n);
    for i in 0..n {
        for (&j, block) in matrix.pattern().row(i).iter().zip(matrix.row(i)) {
            let j = j as usize;
            out.view_mut((3 * i, 3 * j), (3, 3)).copy_from(&block);
            out.view_mut((3 * j, 3 * i), (3, 3)).copy_from(&block.transpose());
        }
    }
    out
}

#[test]
fn pressure_in_a_closed_sheet_has_the_energy_minus_p_v() {
    let sheet = Arc::new(icosphere(2, 2.0));
    let mut one = mechanics(&sheet, FollowerPressure::new(&sheet, 0.7), free(&sheet));
    assert_eq!(one.force_scale(), 0.0);
    let x = crumpled(&sheet, 0.1);
    check_derivatives(&mut one, &x);
    let force = one.force_of(0, &x);
    let torque: Vec3 = force.iter().zip(&x).map(|(f, x)| x.cross(f)).sum();
    assert!(force.iter().sum::<Vec3>().norm() < 1e-12 && torque.norm() < 1e-12);
    let away: Vec<Vec3> = x.iter().map(|x| x + Vec3::new(3.0, -20.0, 1.0)).collect();
    assert!((one.energy(&x) - one.energy(&away)).abs() < 1e-11);
    let volume = 4.0 / 3.0 * PI * 8.0;
    let error = |level: usize| {
        let sheet = Arc::new(icosphere(level, 2.0));
        let mut one = mechanics(&sheet, FollowerPressure::new(&sheet, 0.7), free(&sheet));
        (one.energy(sheet.rest()) / (-0.7 * volume) - 1.0).abs()
    };
    assert!(error(4) < 0.003 && error(4) < 0.26 * error(3), "{} {}", error(3), error(4));
    // Positive pressure pushes outwards.
    let out = one.force_of(0, sheet.rest());
    assert!(out.iter().zip(sheet.rest()).all(|(f, x)| f.dot(x) > 0.0));
}

#[test]
fn pressure_on_an_open_sheet_has_an_energy_where_the_boundary_is_fixed() {
    let sheet = Arc::new(irregular(8, 7, 0.2));
    let mut x = crumpled(&sheet, 0.2);
    let pinned: Pins = sheet.boundary().iter().map(|boundary| [*boundary; 3]).collect();
    check_derivatives(&mut mechanics(&sheet, FollowerPressure::new(&sheet, -1.3), pinned), &x);
    // A boundary that slides in the plane z = 0.
    for (x, boundary) in x.iter_mut().zip(sheet.boundary()) {
        if *boundary {
            x.z = 0.0;
        }
    }
    let sliding: Pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    check_derivatives(&mut mechanics(&sheet, FollowerPressure::new(&sheet, -1.3), sliding), &x);
}

/// With a free boundary no energy exists; the force is p ∫ n dA and the Hessian the symmetric part.
#[test]
fn pressure_with_a_free_boundary_has_the_symmetric_part() {
    let sheet = Arc::new(irregular(5, 4, 0.2));
    let x = crumpled(&sheet, 0.2);
    let p = 0.8;
    let mut one = mechanics(&sheet, FollowerPressure::new(&sheet, p), free(&sheet));
    let force = one.force_of(0, &x);
    let total: Vec3 = (sheet.triangles().iter())
        .map(|t| t.map(|v| x[v as usize]))
        .map(|[a, b, c]| 0.5 * p * (b - a).cross(&(c - a)))
        .sum();
    assert!((force.iter().sum::<Vec3>() - total).norm() < 1e-13);
    let n = x.len();
    let h = 1e-5;
    let mut jacobian = DMatrix::zeros(3 * n, 3 * n);
    for column in 0..3 * n {
        let mut gradient = |h: f64| {
            let mut moved = x.clone();
            moved[column / 3][column % 3] += h;
            let mut g = vec![Vec3::zeros(); n];
            one.energy_gradient(&moved, &mut g);
            g
        };
        let (up, down) = (gradient(h), gradient(-h));
        for row in 0..3 * n {
            jacobian[(row, column)] = (up[row / 3] - down[row / 3])[row % 3] / (2.0 * h);
        }
    }
    let symmetric = 0.5 * (&jacobian + jacobian.transpose());
    let mut hessian = BlockMatrix::zeros(Arc::new(two_rings(&sheet)));
    one.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
    assert!((dense(&hessian) - &symmetric).amax() < 1e-9);
    assert!((jacobian - symmetric).amax() > 0.01, "a free boundary should show");
}
