//! Relaxations on which the default stalled: it ends within a bounded amount of work.

use std::fmt::Write;
use std::sync::Arc;

use rumple::effects::{Bending, BondStretching, EnergyTerm, LoadForce, Stretching};
use rumple::effects::{DeadLoad, Material, MeyerBending};
use rumple::model::Potential;
use rumple::num::checked::{AtLeast, Finite};
use rumple::sheet::Sheet;
use rumple::sheet::quality::triangle_quality;
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec};
use rumple::{Simulation, Vec3};

use super::potential;
use crate::common::prepare;

/// The gradients of one relaxation.
fn gradients(simulation: &mut Simulation) -> u64 {
    let before = simulation.model().tally().work();
    simulation.relax().unwrap();
    (simulation.model().tally().work() - before).gradients
}

/// A strip whose upper edge grows: discrete harmonic waves of the free boundary have no mean curvature.
fn ruffle(method: &str) -> Vec<u64> {
    let mut text = String::from(
        r#"
        [sheet]
        shape = "rectangle"
        width = 60.0
        height = 12.0
        vertices = 600
        imperfection = { amplitude = 1e-2, seed = 3 }
        [material]
        young = 1e6
        poisson = 0.3333333333333333
        thickness = 0.5
        [[effect]]
        kind = "stretching"
        [[effect]]
        kind = "bending"
        [kinetics]
        species.g = { doc = "growth", typical = 0.1, lower = 0.0 }
        rates.g = "k*edge*(1 - g)"
        length_factor = "1 + m*g"
        parameters = { k = 1.0, m = 0.3, edge = { formula = "1/(1 + exp(-(y - 4)/0.7))" } }
        units = { k = "1/time", m = "1", edge = "1" }
        initial.g = 0.0
        [time]
        until = 1.0
        "#,
    );
    write!(text, "[equilibrium]\n{method}").unwrap();
    let (_, mut simulation) = prepare(&text, &[]);
    let edges = simulation.sheet().rest().to_vec();
    let mut done = vec![gradients(&mut simulation)];
    for time in [0.01f64, 0.03, 0.05, 0.2] {
        for (g, x) in simulation.state_mut().species[0].iter_mut().zip(&edges) {
            *g = 1.0 - (-time / (1.0 + (-(x.y - 4.0) / 0.7).exp())).exp();
        }
        done.push(gradients(&mut simulation));
    }
    done
}

#[test]
fn a_ruffled_strip_with_a_free_boundary_does_not_stall() {
    for method in ["", "precision = \"single\"", "preconditioner = \"multigrid\""] {
        let evaluations = ruffle(method);
        println!("{method}: {evaluations:?}");
        assert!(evaluations.iter().all(|e| *e < 1000), "{method}: {evaluations:?}");
    }
}

/// A grid of unit squares whose diagonals all go the same way, clamped at its left end, under a load per area.
fn clamped(columns: u32, rows: u32, load: Vec3) -> Potential {
    let at = |i: u32, j: u32| j * columns + i;
    let rest = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| Vec3::new(f64::from(i), f64::from(j), 0.0)))
        .collect();
    let triangles = (0..rows - 1)
        .flat_map(|j| (0..columns - 1).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            [[a, b, c], [b, d, c]]
        })
        .collect();
    let sheet = Arc::new(Sheet::new(rest, triangles).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.3 };
    let pins: Vec<[bool; 3]> = sheet.rest().iter().map(|x| [x.x < 1.5; 3]).collect();
    let force = LoadForce::PerArea(<[f64; 3]>::from(load).map(|f| Finite::new(f).unwrap().into()));
    let load = DeadLoad::new(&sheet, &vec![true; sheet.vertex_count()], force).unwrap();
    let (s, b) = (Stretching::default(), Bending::default());
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&material, s.weight)),
        EnergyTerm::new(MeyerBending::new(&sheet, &material, b.weight, b.area)),
        EnergyTerm::new(load),
    ];
    potential(sheet, energies, pins)
}

/// Two corners of this grid are triangles with three boundary vertices; these flap without any bending energy.
fn flapping(load: Vec3) -> Potential {
    clamped(21, 7, load)
}

#[test]
fn triangles_with_three_boundary_vertices_do_not_stall_a_load() {
    for load in [1.0, 20.0, 200.0] {
        let mut mechanics = flapping(load * -Vec3::z());
        let mut x = mechanics.sheet().rest().to_vec();
        let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
        let goal = Goal { tolerance: 1e-9, max_iterations: 3000, ..Goal::default() };
        let done = lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap();
        println!("load {load}: {done:?}");
        let gradients = mechanics.mechanics().tally().work().gradients;
        assert!(gradients < 1500, "load {load}: {gradients}");
    }
}

#[test]
fn a_relaxation_without_end_says_what_to_try() {
    let mut mechanics = flapping(-Vec3::z());
    let mut x = mechanics.sheet().rest().to_vec();
    let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let goal = Goal { tolerance: 1e-9, max_iterations: 2, ..Goal::default() };
    let error = lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap_err().to_string();
    let keys =
        ["equilibrium.max_iterations = 1000", "equilibrium.largest_move", "equilibrium.method"];
    assert!(keys.iter().all(|key| error.contains(key)), "{error}");
}

/// With one pair of memory and a factor that is never renewed L-BFGS stagnates, which is detected
/// after 300 iterations here: Newton's method takes over.
#[test]
fn newton_takes_over_where_the_default_gets_nowhere() {
    let number = |n| AtLeast::new(n).unwrap();
    let relax = |tolerance: f64, max_iterations: usize| {
        let mut mechanics = flapping(-Vec3::z());
        let mut x = mechanics.sheet().rest().to_vec();
        let growth = |e: usize| 1.0 + 0.02 * (0.7 * e as f64).sin();
        let factor: Vec<f64> = (0..mechanics.sheet().edges().len()).map(growth).collect();
        mechanics.set_length_factor(&factor);
        let (memory, refresh) = (number(1), Some(number(100_000)));
        let spec = LbfgsSpec { memory, refresh, ..LbfgsSpec::default() };
        let mut lbfgs = Lbfgs::new(mechanics.mechanics(), spec).unwrap();
        let goal = Goal { tolerance, max_iterations, ..Goal::default() };
        let done = lbfgs.relax(&mut mechanics, &mut x, &goal)?;
        Ok((done, mechanics.mechanics().tally().work()))
    };
    let alone = relax(1e-9, 299).unwrap_err();
    let SolveError::NotConverged { iterations: 299, residual, .. } = alone else {
        panic!("{alone}");
    };
    let (done, work) = relax(0.2 * residual, 100_000).unwrap();
    println!("{residual:.2e} {done:?}");
    assert!(done.iterations > 300 && work.factorisations > 1, "{residual:e} {work:?}");
    // Its first turn ends where all iterations are used up: those of both are counted.
    let error = relax(1e-9, 340).unwrap_err();
    assert!(matches!(error, SolveError::NotConverged { iterations: 340, .. }), "{error}");
    // Turns of both come to rest.
    println!("{:?}", relax(1e-9, 100_000).unwrap());
}

/// Without an interior vertex the mean curvature is undefined: a chain of rigid triangles that swings down through a
/// quarter of a turn. The energy falls slowly, and all of the time.
#[test]
fn a_strip_without_interior_vertices_hangs_down() {
    for (load, tolerance) in [(1e-3, 1e-9), (1.0, 1e-9), (10.0, 1e-9)] {
        let mut mechanics = clamped(31, 2, -load * Vec3::z());
        let mut x = mechanics.sheet().rest().to_vec();
        let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
        let goal = Goal { tolerance, max_iterations: 6000, ..Goal::default() };
        let done = lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap();
        println!("load {load}: {done:?}");
        // The tip hangs by the length of the strip, but for its stretching.
        let tip = x.iter().map(|x| x.z).fold(0.0, f64::min);
        assert!((-29.5..-28.0).contains(&tip), "load {load}: {tip}");
    }
}

/// Vertices that are prescribed to move by several edges at once would turn their triangles inside out.
#[test]
fn prescribed_vertices_are_led_far() {
    let text = r#"
        [sheet]
        shape = "rectangle"
        width = 20.0
        height = 4.0
        vertices = 300
        imperfection = { amplitude = 1e-2, seed = 3 }
        [material]
        young = 1e6
        poisson = 0.3333333333333333
        thickness = 0.3
        [[effect]]
        kind = "stretching"
        [[effect]]
        kind = "bending"
        [[effect]]
        kind = "pin"
        where = { half-space = { point = [-9.2, 0, 0], normal = [-1, 0, 0] } }
        axes = "xyz"
        [[effect]]
        kind = "pin"
        where = { half-space = { point = [9.2, 0, 0], normal = [1, 0, 0] } }
        axes = "xyz"
        displacement = [-6, 0, 0]
        ramp = { formula = "t" }
        [time]
        until = 1.0
        "#;
    let (_, mut simulation) = prepare(text, &[]);
    simulation.relax().unwrap();
    simulation.state_mut().time = 1.0;
    let done = simulation.relax().unwrap();
    println!("{done:?}");
    let rest = simulation.sheet().rest();
    let x = &simulation.state().x;
    for (x, rest) in x.iter().zip(rest).filter(|(_, rest)| rest.x >= 9.2) {
        assert_eq!(*x, rest - 6.0 * Vec3::x());
    }
    // It bends out of the plane; nothing is pressed together.
    let height = x.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
    assert!(height > 3.0, "{height}");
    for t in simulation.sheet().triangles() {
        assert!(triangle_quality(t.map(|v| x[v as usize])) > 0.3);
    }
}
