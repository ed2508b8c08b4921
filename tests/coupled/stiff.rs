//! Stiff problems with known answers, as plugins on a scene without space.
//!
//! Digits: IVP test set (`rober`, `vdpol`, `hires`, `orego`).

use super::final_state;
use crate::common::prepare;

fn point(plugin: &str, initial: &str, until: f64) -> String {
    format!(
        "[sheet]\nshape = \"point\"\n[kinetics]\nplugin = \"{plugin}\"\ninitial = {{ {initial} }}\n\
         [time]\nuntil = {until:?}\n"
    )
}

/// Largest relative error of the species.
fn error(text: &str, integrator: &str, expected: &[f64]) -> f64 {
    let state = final_state(text, &[&format!("time.integrator={{{integrator}}}")]);
    let values = state.species.concat();
    assert_eq!(values.len(), expected.len());
    values.iter().zip(expected).map(|(c, e)| (c / e - 1.0).abs()).fold(0.0, f64::max)
}

/// All implicit methods at two tolerances: errors of a few hundred tolerances at most (they add up
/// over the steps, of which a method of second order makes tens of thousands), and falling with the
/// tolerance.
fn check(text: &str, expected: &[f64]) {
    for (method, allowed) in [("bdf", 300.0), ("tr-bdf2", 2000.0), ("esdirk34", 300.0)] {
        let at = |rtol: f64| {
            let atol = 1e-5 * rtol;
            let integrator =
                format!("kind=\"monolithic\",method=\"{method}\",rtol={rtol:e},atol={atol:e}");
            error(text, &integrator, expected)
        };
        let (coarse, fine) = (at(1e-4), at(1e-7));
        assert!(coarse < 300.0 * 1e-4, "{method}: {coarse:e}");
        assert!(fine < allowed * 1e-7, "{method}: {fine:e}");
        assert!(fine < 0.1 * coarse, "{method}: {coarse:e}, then {fine:e}");
    }
}

#[test]
fn robertson() {
    let text = |until| point("robertson", "y1 = 1.0", until);
    check(&text(40.0), &[0.7158270687194, 9.185534764558e-6, 0.2841637457458]);
    check(&text(4e4), &[0.03898337708548, 1.62176831591e-7, 0.9610164607377]);
}

/// Eleven orders of magnitude in time, in one run; the limits on failures do not end it.
#[test]
fn robertson_to_its_end() {
    let text = point("robertson", "y1 = 1.0", 1e11);
    let expected = [2.083340149701255e-08, 8.333360770334713e-14, 0.999999979166505];
    let integrator = "kind=\"monolithic\",rtol=1e-8,atol=1e-16";
    let found = error(&text, integrator, &expected);
    assert!(found < 1e-5, "{found:e}");
}

#[test]
fn van_der_pol() {
    let text = |until| point("van-der-pol", "y1 = 2.0", until);
    check(&text(1.0), &[-1.86364625480813, 0.753543086543546]);
    check(&text(2.0), &[1.706167732170483, -0.8928097010247975]);
}

#[test]
fn hires() {
    let text = |until| point("hires", "y1 = 1.0, y8 = 0.0057", until);
    check(
        &text(321.8122),
        &[
            0.0007371312573325668,
            0.0001442485726316185,
            5.888729740967575e-05,
            0.001175651343283149,
            0.002386356198831331,
            0.006238968252742796,
            0.002849998395185769,
            0.002850001604814231,
        ],
    );
}

#[test]
fn oregonator() {
    let text = |until| point("oregonator", "y1 = 1.0, y2 = 2.0, y3 = 3.0", until);
    check(&text(30.0), &[1.000661467180497, 1512.778937348249, 10358.54312767229]);
    check(&text(360.0), &[1.000814870318523, 1228.178521549917, 132.0554942846706]);
}

/// A step may end within round-off of an output time; the run goes on from there.
#[test]
fn a_run_goes_on_after_every_output_time() {
    let text = point("robertson", "y1 = 1.0", 10.0);
    let implicit = ["bdf", "tr-bdf2", "esdirk34"];
    let monolithic = implicit.map(|m| format!("kind=\"monolithic\",method=\"{m}\""));
    let staggered = implicit.map(|m| format!("kind=\"staggered\",chemistry=\"{m}\""));
    for integrator in monolithic.iter().chain(&staggered) {
        for every in [1.0, 0.7, 1.0 / 3.0, 0.1, 0.07, 0.03, 0.01] {
            let (_, mut simulation) =
                prepare(&text, &[&format!("time.integrator={{{integrator}}}")]);
            simulation.prepare().unwrap();
            let mut count = 1.0;
            while simulation.state().time < 10.0 {
                let target = f64::min(count * every, 10.0);
                while simulation.state().time < target {
                    simulation
                        .step(target)
                        .unwrap_or_else(|e| panic!("{integrator}, every {every}: {e}"));
                }
                assert_eq!(
                    simulation.state().time.to_bits(),
                    target.to_bits(),
                    "{integrator}, {every}"
                );
                count += 1.0;
            }
        }
    }
}

/// A first step that is much too long ends where the rates overflow, which the explicit method's
/// error estimate does not see.
#[test]
fn a_step_into_where_there_are_no_rates_is_made_shorter() {
    let text = point("van-der-pol", "y1 = 2.0", 1e-3);
    let at = |integrator: &str| {
        let keys = ["time.policy=\"simultaneous\"", &format!("time.integrator={{{integrator}}}")];
        final_state(&text, &keys).species.concat()
    };
    let expected = at("kind=\"monolithic\",rtol=1e-8,atol=1e-10");
    let found = at("kind=\"explicit\",method=\"tsit45\",step=0.1,rtol=1e-6,atol=1e-8");
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}

/// The shape rests to a force tolerance, which a soft direction turns into a distance far above the
/// tolerance of the integration: the first step must not be charged with it.
#[test]
fn stiff_kinetics_on_a_sheet_start_from_a_shape_at_rest() {
    let text = r#"
[sheet]
shape = "disc"
radius = 5.0
vertices = 60
imperfection = { amplitude = 1e-2 }
[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 0.5
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
[kinetics]
plugin = "robertson"
initial = { y1 = 1.0 }
[time]
policy = "quasi-static"
until = 40.0
"#;
    let expected = [0.7158270687194, 9.185534764558e-6, 0.2841637457458];
    for method in ["bdf", "tr-bdf2", "esdirk34"] {
        for (rtol, allowed) in [(1e-4, 3e-2), (1e-6, 2e-3)] {
            let atol = 1e-5 * rtol;
            let integrator = format!(
                "time.integrator={{kind=\"monolithic\",method=\"{method}\",rtol={rtol:e},atol={atol:e}}}"
            );
            let state = final_state(text, &[&integrator]);
            for (values, expected) in state.species.iter().zip(expected) {
                for c in values {
                    assert!((c / expected - 1.0).abs() < allowed, "{method}, {rtol:e}: {c:e}");
                }
            }
        }
    }
}

/// What a point does not have is refused with the reason.
#[test]
fn a_point_has_no_shape() {
    use rumple::kinetics::Search;
    use rumple::scene::Scene;
    let search = || Search::in_directories(vec![crate::plugins::build::directory().to_owned()]);
    let refusal = |text: &str| {
        let scene = Scene::parse(text, "scene.toml", &[]).unwrap();
        match rumple::Simulation::new(&scene, &search()) {
            Ok(_) => panic!("accepted: {text}"),
            Err(error) => error.to_string(),
        }
    };
    let reads = refusal(&point("curvature-feedback", "c = 0.1", 1.0));
    assert!(reads.contains("mean_curvature, which a point does not have"), "{reads}");
    let effect = point("robertson", "y1 = 1.0", 1.0)
        + "[[effect]]\nkind = \"diffusion\"\nspecies = \"y1\"\n";
    assert!(refusal(&effect).contains("no effect acts on it"));
    let empty = refusal("[sheet]\nshape = \"point\"\n[time]\nuntil = 1.0\n");
    assert!(empty.contains("missing table [kinetics]"), "{empty}");
}
