//! Relaxations on which the default stalled: it ends within a bounded amount of work.

use std::fmt::Write;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{Bending, BondStretching, EnergyTerm, LoadForce, Stretching};
use rumple::effects::{DeadLoad, Material, MeyerBending};
use rumple::model::Potential;
use rumple::num::checked::{AtLeast, Finite};
use rumple::sheet::Sheet;
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec, Relaxation};

use super::potential;
use crate::common::prepare;

/// A strip whose upper edge grows: discrete harmonic waves of the free boundary have no mean curvature.
fn ruffle(method: &str) -> Vec<Relaxation> {
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
    let mut done = vec![simulation.relax().unwrap()];
    for time in [0.01f64, 0.03, 0.05, 0.2] {
        for (g, x) in simulation.state_mut().species[0].iter_mut().zip(&edges) {
            *g = 1.0 - (-time / (1.0 + (-(x.y - 4.0) / 0.7).exp())).exp();
        }
        done.push(simulation.relax().unwrap());
    }
    done
}

#[test]
fn a_ruffled_strip_with_a_free_boundary_does_not_stall() {
    for method in ["", "precision = \"single\"", "preconditioner = \"multigrid\""] {
        let done = ruffle(method);
        let evaluations: Vec<usize> = done.iter().map(|d| d.evaluations).collect();
        println!("{method}: {evaluations:?}");
        assert!(evaluations.iter().all(|e| *e < 1000), "{method}: {evaluations:?}");
    }
}

/// A grid whose diagonals leave triangles with three boundary vertices in two corners; these flap without
/// any bending energy.
fn flapping(direction: Vec3) -> Potential {
    let (columns, rows) = (21u32, 7u32);
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
    let force = LoadForce::PerArea(<[f64; 3]>::from(direction).map(|f| Finite::new(f).unwrap()));
    let load = DeadLoad::new(&sheet, &vec![true; sheet.vertex_count()], force).unwrap();
    let (s, b) = (Stretching::default(), Bending::default());
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&material, s.weight)),
        EnergyTerm::new(MeyerBending::new(&sheet, &material, b.weight, b.area)),
        EnergyTerm::new(load),
    ];
    potential(sheet, energies, pins)
}

#[test]
fn triangles_with_three_boundary_vertices_do_not_stall_a_load() {
    for load in [1.0, 20.0, 200.0] {
        let mut mechanics = flapping(load * -Vec3::z());
        let mut x = mechanics.sheet().rest().to_vec();
        let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
        let goal = Goal { tolerance: 1e-9, max_iterations: 3000, interrupted: &|| false };
        let done = lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap();
        println!("load {load}: {done:?}");
        assert!(done.evaluations < 1500, "load {load}: {done:?}");
    }
}

#[test]
fn a_relaxation_without_end_says_what_to_try() {
    let mut mechanics = flapping(-Vec3::z());
    let mut x = mechanics.sheet().rest().to_vec();
    let mut lbfgs = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let goal = Goal { tolerance: 1e-9, max_iterations: 2, interrupted: &|| false };
    let error = lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap_err().to_string();
    assert!(error.contains("equilibrium.method") && error.contains("tolerance"), "{error}");
}

/// With one pair of memory and a factor that is never renewed L-BFGS gets nowhere, which is noticed
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
        let goal = Goal { tolerance, max_iterations, interrupted: &|| false };
        lbfgs.relax(&mut mechanics, &mut x, &goal)
    };
    let alone = relax(1e-9, 299).unwrap_err();
    let SolveError::NotConverged { iterations: 299, residual, .. } = alone else {
        panic!("{alone}");
    };
    let done = relax(0.2 * residual, 100_000).unwrap();
    println!("{residual:.2e} {done:?}");
    assert!(done.iterations > 300 && done.factorisations > 1, "{residual:e} {done:?}");
    // Where that gets nowhere either, below round-off, the steps of both are counted.
    let error = relax(1e-18, 100_000).unwrap_err();
    let (SolveError::NotConverged { iterations, .. } | SolveError::Stalled { iterations, .. }) =
        error
    else {
        panic!("{error}");
    };
    assert!(iterations > 300, "{iterations}");
}
