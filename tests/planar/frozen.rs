//! Scenes with half of the physics, in a plane or not: a shape that does not move, no chemistry, no space.

use rumple::Simulation;

use super::{STRIP, distance, run, stays_in_plane, strip, with};
use crate::common::prepare;

/// The strip without energies: nothing moves.
fn frozen() -> String {
    let (head, rest) = STRIP.split_once("[[effect]]").unwrap();
    let (_, tail) = rest.split_once("[[effect]]\nkind = \"diffusion\"").unwrap();
    format!("{head}[[effect]]\nkind = \"diffusion\"{tail}")
}

fn at_end(text: &str, planar: bool, overrides: &[&str]) -> Simulation {
    let mut simulation = with(text, planar, overrides);
    run(&mut simulation, 1.0);
    simulation
}

/// A sheet that nothing can move, because it is pinned everywhere, is as one without mechanics. The law
/// reads tensions: those of its optimal lengths, which need no motion.
#[test]
fn a_frozen_scene_is_one_that_cannot_move() {
    let pinned = |axes: &str| {
        format!("[[effect]]\nkind = \"pin\"\nwhere = \"all\"\naxes = \"{axes}\"\n# more effects")
    };
    for integrator in [
        "time.integrator={kind=\"staggered\",rtol=1e-6,atol=1e-6}",
        "time.integrator={kind=\"monolithic\",rtol=1e-8,atol=1e-8}",
    ] {
        let still = at_end(&frozen(), false, &[integrator]);
        let start = strip(true, &[]).state().species[0].clone();
        let change = still.state().species[0].iter().zip(&start);
        assert!(change.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 0.05);
        for (planar, text) in [
            (true, frozen()),
            (true, STRIP.replace("# more effects", &pinned("xy"))),
            (false, STRIP.replace("# more effects", &pinned("xyz"))),
        ] {
            let twin = at_end(&text, planar, &[integrator]);
            let far = distance(still.state(), twin.state());
            assert!(far.0 == 0.0 && far.1 < 1e-12, "{integrator}, planar {planar}: {far:?}");
            assert!(stays_in_plane(&twin));
        }
    }
}

#[test]
fn mechanics_alone_runs_in_a_plane() {
    let (head, rest) = STRIP.split_once("[kinetics]").unwrap();
    let (_, tail) = rest.split_once("[equilibrium]").unwrap();
    let text = format!("{head}[equilibrium]{tail}");
    let diffusion = "[[effect]]\nkind = \"diffusion\"\nspecies = \"m\"\ncoefficient = 0.5\n";
    let text = text.replace(diffusion, "");
    for policy in ["time.policy=\"quasi-static\"", "time.policy=\"simultaneous\""] {
        let (plane, space) = (at_end(&text, true, &[policy]), at_end(&text, false, &[policy]));
        let (shape, _) = distance(plane.state(), space.state());
        assert!(shape < 1e-7 && stays_in_plane(&plane), "{policy}: {shape:e}");
        assert!(plane.state().x.iter().zip(plane.sheet().rest()).any(|(x, rest)| x != rest));
    }
}

#[test]
fn a_point_has_no_plane_and_needs_none() {
    let point = "[sheet]\nshape = \"point\"\n[kinetics]\nplugin = \"brusselator\"\n\
                 initial = { u = 1.0, v = 1.0 }\n[time]\nintegrator = \"monolithic\"\nuntil = 1.0\n";
    let (_, mut simulation) = prepare(point, &["sheet.planar=false"]);
    run(&mut simulation, 1.0);
    assert_eq!(simulation.state().time, 1.0);
}

/// Curvatures are 0 exactly, and the author is reported that a law which reads them gets nothing.
#[test]
fn a_law_that_reads_curvature_gets_zeros_and_its_author_a_note() {
    let law = "[kinetics]\nrates.m = \"1 + H + K - m\"\nobservables.bent = \"H\"\n";
    let (head, rest) = STRIP.split_once("[kinetics]").unwrap();
    let (_, tail) = rest.split_once("[equilibrium]").unwrap();
    let text = format!("{head}{law}\n[equilibrium]{tail}");
    let integrator = "time.integrator={kind=\"monolithic\",rtol=1e-8,atol=1e-10}";
    let mut simulation = with(&text, true, &[integrator]);
    let [note] = simulation.notes() else { panic!("{:?}", simulation.notes()) };
    assert!(note.contains("mean_curvature") && note.contains("planar"), "{note}");
    for column in simulation.evaluate().signals().unwrap() {
        assert!(column.iter().all(|value| *value == 0.0));
    }
    run(&mut simulation, 1.0);
    let expected = 1.0 - (-1.0f64).exp();
    for m in &simulation.state().species[0] {
        assert!((m - expected).abs() < 1e-6, "{m} {expected}");
    }
    let without = strip(true, &[]);
    assert!(without.notes().is_empty(), "{:?}", without.notes());
}
