//! Growth of single modes of the Schnakenberg kinetics against linear theory.
//!
//! With `J = γ [[-1 + 2uv, u²], [-2uv, -u²]]` at the steady state (1, 0.9) a mode of the Laplacian with
//! eigenvalue -k² grows with the largest real part of an eigenvalue of `J - k² diag(1, d)`, for d = 10
//! where 0.2 < k²/γ < 0.5. Every mode is tried where it grows and where it decays.

use rumple::Vec3;

use crate::common::prepare;

const RATIO: f64 = 10.0;

/// Rate and direction (u, v) of the fastest growth at k²; real there.
fn theory(gamma: f64, square: f64) -> (f64, [f64; 2]) {
    let [a, b] = [gamma * 0.8 - square, gamma];
    let [c, d] = [-1.8 * gamma, -gamma - RATIO * square];
    let (half, product) = (0.5 * (a + d), a * d - b * c);
    let root = half * half - product;
    assert!(root > 0.0, "k² = {square}: the rates are complex");
    let rate = half + root.sqrt();
    (rate, [b, rate - a])
}

/// The rate at which `mode` grows on the sheet of `scene`, from its projection at two times.
fn measured(sheet: &str, mode: &impl Fn(&Vec3) -> f64, gamma: f64, direction: [f64; 2]) -> f64 {
    let text = format!(
        "[sheet]\n{sheet}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"u\"\ncoefficient = 1.0\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"v\"\ncoefficient = {RATIO:?}\n\
         [kinetics]\nplugin = \"schnakenberg\"\nparameters = {{ gamma = {gamma:?} }}\n\
         [time]\nuntil = 0.2\n\
         integrator = {{ kind = \"monolithic\", rtol = 1e-9, atol = 1e-12 }}\n"
    );
    let (_, mut simulation) = prepare(&text, &[]);
    let shape: Vec<f64> = simulation.sheet().rest().iter().map(mode).collect();
    let project = |u: &[f64]| -> f64 { u.iter().zip(&shape).map(|(u, m)| (u - 1.0) * m).sum() };
    let size = 1e-5 / direction[0].abs().max(direction[1].abs());
    let start = [1.0, 0.9];
    for s in 0..2 {
        for (c, m) in simulation.state_mut().species[s].iter_mut().zip(&shape) {
            *c = start[s] + size * direction[s] * m;
        }
    }
    let before = project(&simulation.state().species[0]);
    while simulation.state().time < 0.2 {
        simulation.step(0.2).unwrap();
    }
    (project(&simulation.state().species[0]) / before).ln() / 0.2
}

fn check(name: &str, square: f64, sheet: &str, mode: impl Fn(&Vec3) -> f64) {
    for (share, grows) in [(0.33, true), (1.0, false)] {
        let gamma = square / share;
        let (rate, direction) = theory(gamma, square);
        assert_eq!(rate > 0.0, grows);
        let found = measured(sheet, &mode, gamma, direction);
        assert!((found / rate - 1.0).abs() < 0.01, "{name}, {gamma}: {found} instead of {rate}");
    }
}

#[test]
fn modes_of_the_sphere_grow_as_theory_says() {
    let sheet = "shape = \"sphere\"\nradius = 1.0\nvertices = 5762";
    check("l = 1", 2.0, sheet, |x| x.x);
    check("l = 2", 6.0, sheet, |x| 3.0 * x.z * x.z - 1.0);
    check("l = 3", 12.0, sheet, |x| x.x * x.y * x.z);
}

/// Bessel's J of order n.
fn bessel(n: u32, x: f64) -> f64 {
    let mut term = (1..=n).fold(1.0, |product, k| product * 0.5 * x / f64::from(k));
    let mut sum = term;
    for k in 1..30u32 {
        term *= -0.25 * x * x / (f64::from(k) * f64::from(k + n));
        sum += term;
    }
    sum
}

#[test]
fn modes_of_the_disc_grow_as_theory_says() {
    let sheet = "shape = \"disc\"\nradius = 1.0\nvertices = 2000";
    for (n, root) in
        [(1, 1.841_183_781_340_659_5), (2, 3.054_236_928_227_140_4), (3, 4.201_188_941_210_529)]
    {
        check(&format!("n = {n}"), root * root, sheet, |x| {
            let r = x.norm();
            bessel(n, root * r) * (f64::from(n) * x.y.atan2(x.x)).cos()
        });
    }
}
