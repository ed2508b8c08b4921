//! Growth of a planar spot of Model II against linear theory.
//!
//! A disc fixed along its boundary and contracted by `1 - α m` has the area strain
//! `ē₀ = (1 - α m₀)⁻² - 1` and the tension `σ₀ = Y/(1-ν) ē₀` at uniform m₀, steady if
//! `k_on (1 - m₀) = k_off exp(-a σ₀) m₀`. For an axisymmetric disturbance e of zero mean in the lengths
//! the equation of plane stress has the solution
//!
//! ```text
//! u_r = (1+ν)/r ∫₀ʳ e r dr,   tr ε - 2e = -(1-ν) e      so  δσ = -Y e = Y α δm
//! ```
//!
//! (Timoshenko & Goodier, Theory of Elasticity (1970), article 150, for thermal stress), local although
//! the sheet is elastic. With `s = a σ₀`, and `Y α a = s (1-ν)/(2 m₀)` for α → 0, the mode J₀(k r), k R the
//! first zero of J₁, grows with
//!
//! ```text
//! λ = (k_on/m₀) [-1 + (1 - m₀) s (1-ν)/2] - D k²
//! ```

use rumple::Vec3;

use crate::common::prepare;

const RADIUS: f64 = 10.0;
/// First zero of J₁.
const BESSEL_ZERO: f64 = 3.831_705_970_207_512;
const M0: f64 = 0.25;
const ALPHA: f64 = 1e-3;
const POISSON: f64 = 1.0 / 3.0;
const END_TIME: f64 = 0.1;

/// Bessel's J of order 0.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..30u32 {
        term *= -0.25 * x * x / f64::from(k * k);
        sum += term;
    }
    sum
}

/// The rate at which the mode grows on a sheet of `vertices`.
fn measured(vertices: usize, s: f64, diffusion: f64) -> f64 {
    let strain = (1.0 - ALPHA * M0).powi(-2) - 1.0;
    let y = 1e3 / (1.0 - POISSON * POISSON);
    let tension = y / (1.0 - POISSON) * strain;
    let k_off = (1.0 - M0) / M0 * s.exp();
    let text = format!(
        "sheet = {{ shape = 'disc', radius = {RADIUS:?}, vertices = {vertices}, planar = true }}\n\
         material = {{ young = 1e3, poisson = {POISSON:?}, thickness = 1.0 }}\n\
         effect = [\n{{ kind = 'stretching', model = 'stvk' }},\n\
         {{ kind = 'pin', where = 'rim', axes = 'xy' }},\n\
         {{ kind = 'diffusion', species = 'm', coefficient = {diffusion:?} }} ]\n\
         equilibrium = {{ method = 'lbfgs', tolerance = 1e-12 }}\n\
         time = {{ until = {END_TIME:?}, integrator = {{ kind = 'monolithic', rtol = 1e-7, atol = 1e-10 }} }}\n\
         [kinetics]\nplugin = 'tension-feedback'\n\
         parameters = {{ k_on = 1.0, k_off = {k_off:?}, a = {:?}, alpha = {ALPHA:?} }}\n\
         initial.m = {M0:?}\n",
        s / tension
    );
    let (_, mut simulation) = prepare(&text, &[]);
    let sheet = simulation.sheet().clone();
    let mut area = vec![0.0; sheet.vertex_count()];
    for corners in sheet.triangles() {
        let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
        corners.iter().for_each(|v| area[*v as usize] += (b - a).cross(&(c - a)).norm() / 6.0);
    }
    let value = |x: &Vec3| bessel(BESSEL_ZERO * x.norm() / RADIUS);
    let mut mode: Vec<f64> = sheet.rest().iter().map(value).collect();
    // The uniform mode grows faster than all others.
    let mean = mode.iter().zip(&area).map(|(m, a)| m * a).sum::<f64>() / area.iter().sum::<f64>();
    mode.iter_mut().for_each(|m| *m -= mean);
    let project = |m: &[f64]| -> f64 {
        m.iter().zip(&mode).zip(&area).map(|((m, mode), a)| (m - M0) * mode * a).sum()
    };
    for (m, mode) in simulation.state_mut().species[0].iter_mut().zip(&mode) {
        *m += 1e-4 * mode;
    }
    let before = project(&simulation.state().species[0]);
    super::run(&mut simulation, END_TIME);
    assert!(super::stays_in_plane(&simulation));
    (project(&simulation.state().species[0]) / before).ln() / END_TIME
}

#[test]
fn a_planar_spot_grows_and_decays_as_theory_says() {
    for (s, diffusion, grows) in [(8.0, 1.0, true), (2.0, 1.0, false)] {
        let reaction = (-1.0 + (1.0 - M0) * s * 0.5 * (1.0 - POISSON)) / M0;
        let rate = reaction - diffusion * (BESSEL_ZERO / RADIUS).powi(2);
        assert_eq!(rate > 0.0, grows);
        let [coarse, fine] = [400, 1600].map(|n| (measured(n, s, diffusion) / rate - 1.0).abs());
        // The signal is a mean over triangles and then over vertices: of second order in their size.
        assert!(fine < 0.015 && fine < 0.4 * coarse, "s = {s}: errors {coarse}, {fine}");
    }
}
