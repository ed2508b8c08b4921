//! No step passes over a smooth pulse, whatever the law and the integrator.

use crate::common::prepare;

const POINT: &str = r#"
[sheet]
shape = "point"
[kinetics]
rates.c = "0"
[time]
policy = "simultaneous"
until = 240.0
"#;

/// The end of the run.
const UNTIL: f64 = 240.0;

fn wave(t: f64) -> f64 {
    (std::f64::consts::TAU * t / 24.0).sin()
}

fn pulse(t: f64, centre: f64, width: f64) -> f64 {
    (-((t - centre) / width).powi(2)).exp()
}

type Rate = fn(f64) -> f64;

const LAWS: [(&str, Rate); 12] = [
    ("pos(sin(2*pi*t/24))", |t| wave(t).max(0.0)),
    ("abs(sin(2*pi*t/24))", |t| wave(t).abs()),
    ("max(0, cos(2*pi*t/24) - 0.5)", |t| (wave(t + 6.0) - 0.5).max(0.0)),
    ("max(0, cos(2*pi*t/24) - 0.95)", |t| (wave(t + 6.0) - 0.95).max(0.0)),
    ("pos(sin(2*pi*t/24))^0.5", |t| wave(t).max(0.0).sqrt()),
    ("sin(2*pi*t/24)^8", |t| wave(t).powi(8)),
    ("hill(sin(2*pi*t/24), 0.5, 4)", |t| {
        let r = (wave(t).max(0.0) / 0.5).powi(4);
        r / (1.0 + r)
    }),
    ("exp(-((t-100)/5)^2)", |t| pulse(t, 100.0, 5.0)),
    ("exp(-((t-100.3)/0.03)^2)", |t| pulse(t, 100.3, 0.03)),
    ("1 + exp(-((t-200)/2)^2)", |t| 1.0 + pulse(t, 200.0, 2.0)),
    ("tanh((t-100)/0.1) - tanh((t-110)/0.1)", |t| {
        ((t - 100.0) / 0.1).tanh() - ((t - 110.0) / 0.1).tanh()
    }),
    ("exp(-t/40)*pos(sin(2*pi*t/24))", |t| (-t / 40.0).exp() * wave(t).max(0.0)),
];

fn integral(rate: Rate) -> f64 {
    let steps = 240_000;
    let step = UNTIL / f64::from(steps);
    (0..steps).map(|k| rate((f64::from(k) + 0.5) * step)).sum::<f64>() * step
}

/// The value at the end, and the number of steps.
fn end(rate: &str, integrator: &str) -> (f64, usize) {
    let keys = [format!("kinetics.rates.c='{rate}'"), format!("time.integrator={integrator}")];
    let (_, mut simulation) = prepare(POINT, &[&keys[0], &keys[1]]);
    simulation.prepare().unwrap();
    let mut steps = 0;
    while simulation.state().time < UNTIL {
        simulation.step(UNTIL).unwrap_or_else(|e| panic!("{rate}: {e}"));
        steps += 1;
    }
    (simulation.state().species[0][0], steps)
}

#[test]
fn no_integrator_steps_over_a_smooth_pulse() {
    let integrators = [
        ("{ kind = 'monolithic' }", 3e-3),
        ("{ kind = 'monolithic', rtol = 1e-6, atol = 1e-9 }", 1e-4),
        ("{ kind = 'monolithic', method = 'tr-bdf2' }", 3e-3),
        ("{ kind = 'monolithic', method = 'esdirk34' }", 3e-3),
        ("{ kind = 'explicit', method = 'tsit45' }", 3e-3),
        ("{ kind = 'staggered' }", 0.05),
        ("{ kind = 'staggered', rtol = 1e-4, atol = 1e-4 }", 3e-3),
        ("{ kind = 'staggered', chemistry = 'bdf' }", 0.05),
        ("{ kind = 'staggered', chemistry = 'tsit45' }", 0.05),
    ];
    let mut wrong = Vec::new();
    for (law, rate) in LAWS {
        let exact = integral(rate);
        for (integrator, tolerance) in integrators {
            let (c, steps) = end(law, integrator);
            let error = (c - exact).abs() / exact;
            if error > tolerance || steps > 20_000 {
                wrong.push(format!("{law}, {integrator}: {c} for {exact}, {steps} steps"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// However short it is against the span.
#[test]
fn no_pulse_is_too_short() {
    for width in [1e-2, 1e-3, 1e-4] {
        for centre in [100.0, 123.4, 123.456] {
            let law = format!("exp(-((t-{centre})/{width})^2)");
            for integrator in [
                "'monolithic'",
                "{ kind = 'monolithic', method = 'tr-bdf2' }",
                "{ kind = 'staggered', atol = 1e-9 }",
            ] {
                let (c, steps) = end(&law, integrator);
                let exact = width * std::f64::consts::PI.sqrt();
                let right = (c - exact).abs() < 0.02 * exact && steps < 20_000;
                assert!(right, "{law}, {integrator}: {c} for {exact}, {steps} steps");
            }
        }
    }
}

/// A pulse that multiplies a species of which there is little at first.
#[test]
fn a_pulse_may_multiply_a_species() {
    let (c, _) = end("c*exp(-((t-100)/0.5)^2) + 1e-3 - 1e-3*c", "'monolithic'");
    assert!((c - 0.331).abs() < 0.005, "{c}");
}

const DOME: &str = r#"
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "xyz" },
    { kind = "pressure", value = -0.8, ramp = { formula = "exp(-((t-40)/8)^2)" } },
]
sheet = { shape = "cap", radius = 10.0, height = 2.5, vertices = 120 }
material = { young = 1e3, poisson = 0.3, thickness = 0.3 }
time = { until = 100.0 }
"#;

/// The largest load acts at the end of a step: a dome that it turns inside out stays so.
#[test]
fn a_pulse_of_load_is_met_at_its_peak() {
    for ramp in ["exp(-((t-40)/8)^2)", "exp(-((t-40)/0.5)^2)", "sin(2*pi*t/160)^6"] {
        let scene = DOME.replace("exp(-((t-40)/8)^2)", ramp);
        let (_, mut simulation) = prepare(&scene, &[]);
        simulation.prepare().unwrap();
        let (mut nearest, mut snaps) = (f64::INFINITY, 0);
        while simulation.state().time < 100.0 {
            snaps += simulation.step(100.0).unwrap().relaxation.snaps;
            nearest = nearest.min((simulation.state().time - 40.0).abs());
        }
        assert!(nearest < 1e-3, "{ramp}: {nearest}");
        assert!(snaps > 0, "{ramp}");
    }
}
