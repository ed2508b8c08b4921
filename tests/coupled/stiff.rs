//! Stiff problems with known answers, as plugins on a scene without space.
//!
//! Digits: IVP test set (`rober`, `vdpol`, `hires`, `orego`).

use rumple::kinetics::Species;

use super::{final_state, finished};
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

/// A step may end within round-off of an output time; the run continues from there.
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
    use rumple::kinetics::PluginSearch;
    use rumple::scene::Scene;
    let search =
        || PluginSearch::in_directories(vec![crate::plugins::build::directory().to_owned()]);
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

/// The air pollution problem of 20 species, and its published solution at t = 60.
const POLLU: &str = include_str!("../data/pollu.toml");
const POLLUTED: [f64; 20] = [
    0.5646255480022769e-1,
    0.1342484130422339,
    0.4139734331099427e-8,
    0.5523140207484359e-2,
    0.2018977262302196e-6,
    0.1464541863493966e-6,
    0.7784249118997964e-1,
    0.3245075353396018,
    0.7494013383880406e-2,
    0.1622293157301561e-7,
    0.1135863833257075e-7,
    0.2230505975721359e-2,
    0.208716288279863e-3,
    0.1396921016840158e-4,
    0.8964884856898295e-2,
    0.4352846369330103e-17,
    0.6899219696263405e-2,
    0.1007803037365946e-3,
    0.1772146513969984e-5,
    0.5682943292316392e-4,
];

/// Largest relative error of the pollution problem, and its steps.
fn pollution(overrides: &[&str]) -> (f64, u64) {
    let simulation = finished(POLLU, overrides);
    let species = &simulation.model().chemistry().unwrap().descriptor().species;
    let error = |(species, c): (&Species, &Vec<f64>)| {
        let number: usize = species.name[1..].parse().unwrap();
        (c[0] / POLLUTED[number - 1] - 1.0).abs()
    };
    let state = simulation.state();
    (species.iter().zip(&state.species).map(error).fold(0.0, f64::max), state.step)
}

/// Stiff problems and oscillators, with nothing chosen by the scene.
#[test]
fn at_a_point_the_default_integrator_is_stiff_and_accurate() {
    let (error, steps) = pollution(&[]);
    assert!(error < 1e-5 && steps < 600, "pollu: {error:e} in {steps} steps");
    let cases: [(&str, &str, f64, f64, u64); 4] = [
        ("robertson", "y1 = 1.0", 40.0, 1e-5, 500),
        ("van-der-pol", "y1 = 2.0", 2.0, 1e-3, 3000),
        ("oregonator", "y1 = 1.0, y2 = 2.0, y3 = 3.0", 360.0, 1e-3, 3000),
        ("brusselator", "u = 1.0, v = 1.0", 50.0, 1e-3, 3000),
    ];
    for (plugin, initial, until, allowed, most) in cases {
        let text = point(plugin, initial, until);
        let exact = "time.integrator={kind=\"monolithic\",rtol=1e-10,atol=1e-14}";
        let expected = final_state(&text, &[exact]).species.concat();
        let state = final_state(&text, &[]);
        let pairs = state.species.iter().flatten().zip(&expected);
        let error = pairs.map(|(c, e)| (c / e - 1.0).abs()).fold(0.0, f64::max);
        println!("{plugin}: {error:e} in {} steps", state.step);
        assert!(
            error < allowed && state.step < most,
            "{plugin}: {error:e} in {} steps",
            state.step
        );
    }
}

/// What is asked for is delivered, but for a few times the tolerance, also where it is tight.
#[test]
fn errors_of_methods_of_fixed_order_go_with_the_tolerance() {
    for (method, allowed) in [("bdf", 300.0), ("tr-bdf2", 20.0), ("esdirk34", 20.0)] {
        for rtol in [1e-4, 1e-6, 1e-8] {
            let integrator = format!(
                "time.integrator={{kind='monolithic',method='{method}',rtol={rtol:e},atol={:e}}}",
                1e-6 * rtol
            );
            let (error, steps) = pollution(&[&integrator]);
            println!("{method} {rtol:e}: {error:e} in {steps} steps");
            assert!(error < allowed * rtol, "{method} at {rtol:e}: {error:e} in {steps} steps");
        }
    }
}
