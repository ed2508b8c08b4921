//! Contacts of folded and stacked sheets: derivatives, sums of forces, and the pressure between parallel sheets.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{BlockMatrix, Contacts, EnergyTerm, HessianPart};
use rumple::geometry::lumped_areas;
use rumple::model::{Mechanics, Potential};
use rumple::sheet::Sheet;

use crate::common::Noise;

/// The pressure of the barrier at the distance `d`, as the reference gives it.
fn pressure(stiffness: f64, reach: f64, d: f64) -> f64 {
    let u = d / reach;
    stiffness * ((1.0 - u) * (1.0 - u) / u - 2.0 * (1.0 - u) * u.ln())
}

/// A grid of n × m vertices a unit apart, the rows shifted against one another.
fn grid(n: u32, m: u32, shear: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let place = |k: u32| {
        let (i, j) = (f64::from(k % n), f64::from(k / n));
        Vec3::new(i + shear * j, j, 0.0)
    };
    let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
    let cells = (0..m - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    ((0..n * m).map(place).collect(), cells.flat_map(two).collect())
}

/// A strip folded over, its halves `gap` apart, with noise.
fn folded(gap: f64, roughness: f64) -> (Arc<Sheet>, Vec<Vec3>) {
    let (rest, triangles) = grid(16, 6, 0.3);
    let sheet = Arc::new(Sheet::new(rest, triangles).unwrap());
    let (mut noise, r) = (Noise::new(5), 0.5 * gap);
    let fold = |x: &Vec3| {
        let s = x.x - 8.2;
        let straight = s.abs() - std::f64::consts::FRAC_PI_2 * r;
        let curve = if straight > 0.0 {
            Vec3::new(-straight, 0.0, s.signum() * r)
        } else {
            Vec3::new(r * (s / r).cos(), 0.0, r * (s / r).sin())
        };
        curve + Vec3::new(0.0, x.y, 0.0)
    };
    let x = sheet.rest().iter().map(|x| fold(x) + roughness * noise.vector()).collect();
    (sheet, x)
}

fn potential(sheet: &Arc<Sheet>, distance: f64, stiffness: f64) -> Potential {
    let term = EnergyTerm::contact(Contacts::new(sheet, distance, stiffness));
    Potential::new(&Mechanics::new(Arc::clone(sheet), vec![term], Vec::new()).unwrap())
}

fn gradient(potential: &mut Potential, x: &[Vec3]) -> Vec<Vec3> {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    potential.energy_gradient(x, &mut gradient);
    gradient
}

fn moved(x: &[Vec3], d: &[Vec3], by: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + by * d).collect()
}

fn norm(a: &[Vec3]) -> f64 {
    a.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>().sqrt()
}

#[test]
fn derivatives_are_those_of_the_energy() {
    // From surfaces barely in contact to edges that are nearly parallel, and near at rest.
    for (gap, roughness, distance) in
        [(0.5, 0.02, 0.6), (0.3, 0.05, 0.6), (0.2, 0.01, 0.6), (0.25, 1e-3, 0.6), (0.7, 0.1, 1.4)]
    {
        let (sheet, x) = folded(gap, roughness);
        let mut potential = potential(&sheet, distance, 2.0);
        let here = gradient(&mut potential, &x);
        assert!(norm(&here) > 1e-3, "{gap}: no contact");
        let mut hessian = BlockMatrix::zeros(potential.pattern(&x));
        potential.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
        let mut noise = Noise::new(8);
        for _ in 0..4 {
            let d: Vec<Vec3> = x.iter().map(|_| noise.vector()).collect();
            let h = 1e-7;
            let (up, down) = (moved(&x, &d, h), moved(&x, &d, -h));
            let rise = (potential.energy(&up) - potential.energy(&down)) / (2.0 * h);
            let slope: f64 = here.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
            assert!((rise - slope).abs() < 1e-6 * norm(&here) * norm(&d), "{gap}: {rise} {slope}");
            let (above, below) = (gradient(&mut potential, &up), gradient(&mut potential, &down));
            let change = moved(&above, &below, -1.0);
            let change: Vec<Vec3> = change.iter().map(|c| c / (2.0 * h)).collect();
            let product = multiply(&hessian, &d);
            let error = norm(&moved(&change, &product, -1.0));
            assert!(error < 1e-5 * norm(&product), "{gap}: {error:e} of {:e}", norm(&product));
        }
        let mut positive = BlockMatrix::zeros(potential.pattern(&x));
        potential.hessian(&x, HessianPart::Positive, &mut positive).unwrap();
        for _ in 0..10 {
            let d: Vec<Vec3> = x.iter().map(|_| noise.vector()).collect();
            assert!(positive.quadratic(&d) > 0.0);
        }
    }
}

fn multiply(matrix: &BlockMatrix, v: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); v.len()];
    for i in 0..v.len() {
        for (&j, block) in matrix.pattern().row(i).iter().zip(matrix.row(i)) {
            let j = j as usize;
            out[i] += block * v[j];
            if j != i {
                out[j] += block.tr_mul(&v[i]);
            }
        }
    }
    out
}

#[test]
fn forces_and_torques_balance_and_there_are_none_at_rest() {
    let (sheet, x) = folded(0.3, 0.05);
    let mut potential = potential(&sheet, 0.6, 2.0);
    let force = gradient(&mut potential, &x);
    let torque: Vec3 = x.iter().zip(&force).map(|(x, f)| x.cross(f)).sum();
    assert!(norm(&force) > 1.0);
    assert!(force.iter().sum::<Vec3>().norm() < 1e-12 * norm(&force));
    assert!(torque.norm() < 1e-11 * norm(&force), "{torque}");
    // Distances far above the edge do not lock a flat sheet.
    for distance in [0.6, 5.0] {
        let mut potential = self::potential(&sheet, distance, 2.0);
        assert_eq!(potential.energy(sheet.rest()), 0.0);
        assert_eq!(norm(&gradient(&mut potential, sheet.rest())), 0.0);
        // Nor one that shrinks to a third of its size.
        potential.set_length_factor(&vec![0.33; sheet.edges().len()]);
        let small: Vec<Vec3> = sheet.rest().iter().map(|x| 0.33 * x).collect();
        assert_eq!(potential.energy(&small), 0.0);
    }
}

#[test]
fn parallel_plates_push_with_the_pressure_of_the_barrier_whatever_their_meshes() {
    let (reach, stiffness) = (0.5, 3.0);
    let (mut rest, mut triangles) = grid(12, 12, 0.0);
    let first = rest.len();
    let (above, more) = grid(31, 31, 0.0);
    // A smaller and finer plate over the inside of a larger one, with six by six of its vertices below.
    rest.extend(above.iter().map(|x| Vec3::new(0.2 * x.x + 2.5, 0.2 * x.y + 2.5, 100.0)));
    triangles.extend(more.iter().map(|t| t.map(|v| v + u32::try_from(first).unwrap())));
    let sheet = Arc::new(Sheet::new(rest, triangles).unwrap());
    for gap in [0.49, 0.4, 0.3, 0.26] {
        let low = |x: &Vec3| Vec3::new(x.x, x.y, if x.z > 1.0 { gap } else { 0.0 });
        let x: Vec<Vec3> = sheet.rest().iter().map(low).collect();
        let mut potential = potential(&sheet, reach, stiffness);
        let force = gradient(&mut potential, &x);
        let [down, up] = [&force[..first], &force[first..]].map(|f| -f.iter().sum::<Vec3>().z);
        let pressure = pressure(stiffness, reach, gap);
        assert!((up / (36.0 * pressure) - 1.0).abs() < 1e-12, "{gap}: {up}");
        assert!((up + down).abs() < 1e-12 * up, "{gap}: {up} {down}");
    }
}

#[test]
fn equal_plates_push_with_exactly_the_pressure_of_the_barrier() {
    let (reach, stiffness) = (0.5, 3.0);
    let (mut rest, mut triangles) = grid(9, 9, 0.0);
    let first = rest.len();
    rest.extend(rest.clone().iter().map(|x| x + Vec3::new(0.0, 0.0, 50.0)));
    triangles
        .extend(triangles.clone().iter().map(|t| t.map(|v| v + u32::try_from(first).unwrap())));
    let sheet = Arc::new(Sheet::new(rest, triangles).unwrap());
    for gap in [0.49, 0.4, 0.3, 0.26] {
        let low = |x: &Vec3| Vec3::new(x.x, x.y, if x.z > 1.0 { gap } else { 0.0 });
        let x: Vec<Vec3> = sheet.rest().iter().map(low).collect();
        let mut potential = potential(&sheet, reach, stiffness);
        let force = gradient(&mut potential, &x);
        let pressure = pressure(stiffness, reach, gap);
        let up: f64 = force[first..].iter().map(|f| -f.z).sum();
        assert!((up / (64.0 * pressure) - 1.0).abs() < 1e-12, "{gap}: {up}");
        // Each vertex carries the pressure on its own area.
        for (f, half) in force[first..].iter().zip(lumped_areas(&sheet)) {
            assert!((-f.z - pressure * half).abs() < 1e-12 * 64.0, "{gap}");
        }
    }
}

#[test]
fn a_shape_that_crosses_itself_is_refused_with_its_place() {
    let (sheet, mut x) = folded(0.3, 0.0);
    let mut potential = potential(&sheet, 0.6, 2.0);
    assert_eq!(potential.refusal(&x), None);
    x[2].z += 0.5;
    let (effect, why) = potential.refusal(&x).unwrap();
    assert_eq!(effect, "contact");
    assert!(why.contains("cross") && why.contains("vertices ["), "{why}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (sheet, x) = folded(0.3, 0.05);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut potential = potential(&sheet, 0.6, 2.0);
            let bits = gradient(&mut potential, &x).iter().map(|g| g.map(f64::to_bits)).collect();
            let bits: Vec<_> = bits;
            (potential.energy(&x).to_bits(), bits)
        })
    };
    assert_eq!(on(1), on(2));
    assert_eq!(on(1), on(4));
}
