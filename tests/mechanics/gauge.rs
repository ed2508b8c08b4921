//! Rigid motions that pins leave free: no relaxation drifts along them, and round-off does not decide.

use std::sync::Arc;

use nalgebra::{Matrix3, SVD};
use rumple::Vec3;
use rumple::effects::Material;
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::equilibrium::{
    Descent, DescentSpec, Equilibrium, Goal, Lbfgs, LbfgsSpec, Newton, NewtonSpec, Preconditioner,
    Relaxation,
};

use super::both;
use crate::common::{Noise, prepare};

/// Translation and angle, in radians, of the best rigid motion from `a` to `b`, and what is left.
fn motion(a: &[Vec3], b: &[Vec3]) -> (Vec3, f64, f64) {
    let mean = |x: &[Vec3]| x.iter().sum::<Vec3>() / x.len() as f64;
    let (centre_a, centre_b) = (mean(a), mean(b));
    let products = a.iter().zip(b).map(|(a, b)| (b - centre_b) * (a - centre_a).transpose());
    let SVD { u: Some(u), v_t: Some(v), .. } = products.sum::<Matrix3<f64>>().svd(true, true)
    else {
        panic!("no singular vectors");
    };
    let flip = Matrix3::from_diagonal(&Vec3::new(1.0, 1.0, (u * v).determinant().signum()));
    let turn = u * flip * v;
    let angle = (0.5 * (turn.trace() - 1.0)).clamp(-1.0, 1.0).acos();
    let left = |(a, b): (&Vec3, &Vec3)| (b - centre_b - turn * (a - centre_a)).norm();
    let worst = a.iter().zip(b).map(left).fold(0.0, f64::max);
    (centre_b - centre_a, angle, worst)
}

/// A disc whose middle grows violently, out of the plane by noise, with z fixed along the boundary or no
/// pins at all.
fn grown(free: bool) -> (Potential, Vec<Vec3>) {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 16.0 }, 500, 1).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary && !free]).collect();
    let mut mechanics = both(&sheet, &material, pins);
    let inside = |v: u32| (sheet.rest()[v as usize] - Vec3::new(3.0, 1.0, 0.0)).norm() < 5.0;
    let grown = |e: &rumple::sheet::Edge| e.vertices.iter().all(|v| inside(*v));
    let factor: Vec<f64> = sheet.edges().iter().map(|e| if grown(e) { 1.3 } else { 1.0 }).collect();
    mechanics.set_length_factor(&factor);
    let mut noise = Noise::new(4);
    let lifted = |x: &Vec3| x + 0.05 * noise.number() * Vec3::z();
    let mut x: Vec<Vec3> = sheet.rest().iter().map(lifted).collect();
    for (x, pins) in x.iter_mut().zip(mechanics.pins()) {
        if pins[2] {
            x.z = 0.0;
        }
    }
    (mechanics, x)
}

fn relax(
    mechanics: &mut Potential,
    x: &mut [Vec3],
    method: &mut dyn Equilibrium,
    tolerance: f64,
) -> Relaxation {
    let goal = Goal { tolerance, max_iterations: 100_000, ..Goal::default() };
    method.relax(mechanics, x, &goal).unwrap()
}

fn methods(mechanics: &Potential) -> Vec<(&'static str, Box<dyn Equilibrium>, f64)> {
    let lbfgs = |preconditioner| {
        let spec = LbfgsSpec { preconditioner, ..LbfgsSpec::default() };
        Box::new(Lbfgs::new(mechanics.mechanics(), spec).unwrap())
    };
    vec![
        ("factor", lbfgs(Preconditioner::Factor), 1e-8),
        ("multigrid", lbfgs(Preconditioner::Multigrid), 1e-8),
        (
            "newton",
            Box::new(Newton::new(mechanics.mechanics(), NewtonSpec::default()).unwrap()),
            1e-8,
        ),
        ("descent", Box::new(Descent::new(DescentSpec::default())), 1e-3),
    ]
}

#[test]
fn a_sheet_that_pins_leave_free_does_not_drift_while_it_relaxes() {
    for free in [false, true] {
        let (mut mechanics, start) = grown(free);
        for (name, mut method, tolerance) in methods(&mechanics) {
            let mut x = start.clone();
            let done = relax(&mut mechanics, &mut x, &mut *method, tolerance);
            let (moved, turned, shape) = motion(&start, &x);
            // Where z is fixed along the boundary only motions in the plane are free.
            let moved = if free { moved.norm() } else { moved.xy().norm() };
            println!("free {free} {name}: {moved:.2e} {turned:.2e} {shape:.2e} {done:?}");
            assert!(shape > 0.5, "{name}: nothing happens");
            assert!(moved < 1e-6, "{name}, free {free}: moved by {moved}");
            assert!(turned < 0.1, "{name}, free {free}: turned by {turned}");
        }
    }
}

/// The same minimum as with three pins that take away the rigid motions only: the gauge puts no force
/// on the sheet.
#[test]
fn the_gauge_leaves_no_trace_in_shape_and_energy() {
    let (mut mechanics, start) = grown(false);
    let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let mut free = start.clone();
    let gauged = relax(&mut mechanics, &mut free, &mut lbfgs, 1e-10);
    assert!(gauged.residual <= 1e-10);
    // From there, with the three pins instead: at rest at once.
    let mut pins = mechanics.pins().clone();
    pins[0] = [true, true, pins[0][2]];
    pins[1][1] = true;
    let sheet: Arc<Sheet> = Arc::clone(mechanics.sheet());
    let rest_length = |e: &rumple::sheet::Edge| {
        let [a, b] = e.vertices.map(|v| sheet.rest()[v as usize]);
        (b - a).norm()
    };
    let lengths = mechanics.metric().length().iter().zip(sheet.edges());
    let factor: Vec<f64> = lengths.map(|(l, e)| l / rest_length(e)).collect();
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let mut pinned = both(&sheet, &material, pins);
    pinned.set_length_factor(&factor);
    let mut lbfgs = Lbfgs::new(pinned.mechanics(), LbfgsSpec::default()).unwrap();
    let done = relax(&mut pinned, &mut free, &mut lbfgs, 2e-10);
    assert_eq!(done.iterations, 0, "{done:?}");
    assert!((done.energy - gauged.energy).abs() <= 1e-12 * gauged.energy);
}

/// A load turns a strip that hangs from one corner: a motion along which a force acts is not free.
#[test]
fn a_load_may_turn_a_sheet_that_hangs_from_one_vertex() {
    let (_, mut simulation) = prepare(
        r#"
        sheet = { shape = "rectangle", width = 6.0, height = 2.0, vertices = 150 }
        material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.3 }
        [[effect]]
        kind = "stretching"
        [[effect]]
        kind = "bending"
        model = "hinge"
        [[effect]]
        kind = "pin"
        where = "all"
        axes = "z"
        [[effect]]
        kind = "pin"
        where = { box = { min = [-3.01, -1.01, -1.0], max = [-2.99, -0.99, 1.0] } }
        axes = "xyz"
        [[effect]]
        kind = "load"
        where = "all"
        force = { per-area = [0.0, -0.5, 0.0] }
        [time]
        until = 1.0
        [equilibrium]
        tolerance = 1e-7
        "#,
        &[],
    );
    simulation.relax().unwrap();
    let x = &simulation.state().x;
    let centre = x.iter().sum::<Vec3>() / x.len() as f64;
    let corner = Vec3::new(-3.0, -1.0, 0.0);
    assert!((centre.x - corner.x).abs() < 0.05, "{centre}");
    assert!(centre.y < corner.y - 2.0, "{centre}");
}

/// The first frame of the small Model I, species on vertices, with Young's modulus changed in its
/// seventh digit: nothing but round-off is different, so nothing else may be in the shape.
#[test]
fn a_change_in_the_seventh_digit_of_young_does_not_choose_another_shape() {
    let text = include_str!("../../models/model-i/small.toml");
    let mut shapes: Vec<Vec<Vec3>> = Vec::new();
    for young in ["1e6", "1.0000001e6", "0.9999999e6"] {
        let keys = ["kinetics.location=vertex".to_owned(), format!("material.young={young}")];
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        let (_, mut simulation) = prepare(text, &keys);
        simulation.relax().unwrap();
        shapes.push(simulation.state().x.to_vec());
    }
    for other in &shapes[1..] {
        let (_, _, shape) = motion(&shapes[0], other);
        assert!(shape < 1e-4, "{shape}");
    }
}
