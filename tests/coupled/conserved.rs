//! Under `chemistry-fast` the steady state is the one with the totals of the start.

use rumple::model::State;

use super::{distance, final_state, finished};
use crate::common::prepare;

/// Everything that conserves: a is advected and follows b, b diffuses, and immobile p binds mobile u to q.
const CONSERVING: &str = r#"
[sheet]
shape = "disc"
radius = 5.0
vertices = 300
planar = true
[material]
young = 1000.0
poisson = 0.3
thickness = 0.5
drag = 10.0
[[effect]]
kind = "stretching"
[[effect]]
kind = "diffusion"
species = "a"
coefficient = 1.0
[[effect]]
kind = "advection"
species = "a"
velocity = [1.0, 0.5, 0.0]
[[effect]]
kind = "diffusion"
species = "b"
coefficient = 0.5
[[effect]]
kind = "cross-diffusion"
species = "a"
by = "b"
coefficient = 0.2
[[effect]]
kind = "diffusion"
species = "u"
coefficient = 1.0
[kinetics]
measure = "amount"
rates.a = "0"
rates.b = "0"
rates.u = "q - u*p"
rates.p = "q - u*p"
rates.q = "u*p - q"
initial.a = { gaussian = { width = 2.0, amplitude = 1.0 } }
initial.b = { gaussian = { width = 3.0, amplitude = 1.0 } }
initial.u = { gaussian = { width = 2.0, amplitude = 1.0 } }
initial.p = { gaussian = { width = 3.0, amplitude = 1.0 } }
initial.q = 0.2
[time]
policy = "chemistry-fast"
integrator = "staggered"
until = 1.0
"#;
const GROWTH: &str = r#"[[effect]]
kind = "growth"
factor = "1 + 0.2*t*exp(-(x^2+y^2)/8)"
[kinetics]"#;

/// The largest change, relative to the start, of the totals of a, b, u + q and p + q, and of p + q at a vertex.
fn change(text: &str, keys: &[&str]) -> [f64; 5] {
    let (_, simulation) = prepare(text, keys);
    let (model, start) = (simulation.model().clone(), simulation.state().clone());
    let (sheet, chemistry) = (model.sheet(), model.chemistry().unwrap());
    let areas = chemistry.point_areas(sheet, sheet.rest());
    let names = chemistry.descriptor().species.iter().map(|s| s.name.clone()).collect::<Vec<_>>();
    let of = |state: &State, name: &str, i: usize| {
        state.species[names.iter().position(|n| n == name).unwrap()][i]
    };
    let total = |state: &State, all: &[&str]| -> f64 {
        let at = |i: usize| all.iter().map(|name| of(state, name, i)).sum::<f64>();
        areas.iter().enumerate().map(|(i, area)| area * at(i)).sum()
    };
    let end = finished(text, keys).state().clone();
    assert!(distance(&end, &start).1 > 0.1, "the chemistry has not moved");
    let totals = [&["a"][..], &["b"], &["u", "q"], &["p", "q"]];
    let mut found = [0.0; 5];
    for (found, all) in found.iter_mut().zip(totals) {
        *found = (total(&end, all) / total(&start, all) - 1.0).abs();
    }
    let bound = |state: &State, i: usize| of(state, "p", i) + of(state, "q", i);
    let local = (0..areas.len()).map(|i| (bound(&end, i) / bound(&start, i) - 1.0).abs());
    found[4] = local.fold(0.0, f64::max);
    found
}

#[test]
fn conserved_totals_stay_on_still_and_on_growing_sheets() {
    let growing = CONSERVING.replace("[kinetics]", GROWTH);
    for (text, keys) in [
        (CONSERVING, &[][..]),
        (&growing, &[]),
        // By an iterative solver.
        (&growing, &["sheet.vertices=1000", "time.until=0.1"]),
    ] {
        let found = change(text, keys);
        assert!(found[..4].iter().all(|change| *change < 1e-12), "{keys:?}: {found:?}");
        assert!(found[4] < 1e-6, "{keys:?}: {found:?}");
    }
}

/// The state with these totals is the one that the chemistry itself runs into.
#[test]
fn a_conserving_chemistry_settles_where_its_rates_lead() {
    let fast = final_state(CONSERVING, &["time.until=0.1"]);
    let keys = [
        "time.policy='simultaneous'",
        "time.until=200.0",
        "time.integrator={kind='monolithic',rtol=1e-7,atol=1e-9}",
    ];
    let (_, species) = distance(&fast, &final_state(CONSERVING, &keys));
    assert!(species < 1e-4, "{species:e}");
}
