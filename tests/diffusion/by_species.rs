//! Coefficients of diffusion and cross-diffusion that read species.

use rumple::Simulation;
use rumple::effects::{Diffusion, EffectContext, EffectSpec, Field, Measure};
use rumple::kinetics::Location;
use rumple::kit::synthetic_law;

use crate::common::{irregular, prepare};

fn run(text: &str, until: f64) -> Simulation {
    let (_, mut simulation) = prepare(text, &[]);
    simulation.prepare().unwrap();
    while simulation.state().time < until {
        simulation.step(until).unwrap();
    }
    simulation
}

fn areas(simulation: &Simulation) -> Vec<f64> {
    let sheet = simulation.model().sheet();
    let mut areas = vec![0.0; sheet.vertex_count()];
    for t in sheet.triangles() {
        let [p, q, r] = t.map(|v| sheet.rest()[v as usize]);
        t.iter().for_each(|v| areas[*v as usize] += (q - p).cross(&(r - p)).norm() / 6.0);
    }
    areas
}

/// Between c = 0 and c = 1, with D = 1 + 2 c: c + c² is linear in x (Kirchhoff's transformation).
#[test]
fn a_steady_profile_is_that_of_kirchhoff() {
    for integrator in ["'staggered'", "{ kind = 'monolithic', rtol = 1e-6, atol = 1e-8 }"] {
        let text = format!(
            "sheet = {{ shape = 'rectangle', width = 4.0, height = 1.0, vertices = 900 }}
             time = {{ until = 60.0, integrator = {integrator} }}
             kinetics = {{ rates = {{ c = '0' }}, initial = {{ c = {{ formula = '(x + 2)/4' }} }} }}
             effect = [
                 {{ kind = 'diffusion', species = 'c', coefficient = '1 + 2*c' }},
                 {{ kind = 'hold', species = 'c', where = {{ half-space = {{ point = [-1.99, 0, 0], normal = [-1, 0, 0] }} }}, value = 0.0 }},
                 {{ kind = 'hold', species = 'c', where = {{ half-space = {{ point = [1.99, 0, 0], normal = [1, 0, 0] }} }}, value = 1.0 }},
             ]"
        );
        let simulation = run(&text, 60.0);
        let c = &simulation.state().species[0];
        let rest = simulation.model().sheet().rest();
        let exact = |x: f64| (0.25 + 2.0 * (x + 2.0) / 4.0).sqrt() - 0.5;
        let worst = c.iter().zip(rest).map(|(c, x)| (c - exact(x.x)).abs()).fold(0.0, f64::max);
        println!("{integrator}: {worst:.2e}");
        assert!(worst < 2e-3, "{integrator}: {worst}");
    }
}

/// The source solution of Barenblatt and Pattle for ∂c/∂t = ∇·(c ∇c) in the plane: with τ = t/2,
/// c = τ^(-1/2) (1 - r² τ^(-1/2)/16) inside of the front r² = 16 τ^(1/2), 0 outside.
#[test]
fn a_slow_front_is_that_of_barenblatt() {
    let exact = |r2: f64, t: f64| {
        let root = (0.5 * t).sqrt();
        ((1.0 - r2 / (16.0 * root)) / root).max(0.0)
    };
    let error = |vertices: usize| {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 7.0, vertices = {vertices} }}
             time = {{ until = 2.0, integrator = {{ kind = 'staggered', rtol = 1e-4, atol = 1e-5 }} }}
             kinetics = {{ rates = {{ c = '0' }}, initial = {{ c = {{ formula = 'max(1 - (x^2 + y^2)/16, 0)' }} }} }}
             effect = [{{ kind = 'diffusion', species = 'c', coefficient = 'max(c, 0)' }}]"
        );
        let simulation = run(&text, 2.0);
        let (areas, rest) = (areas(&simulation), simulation.model().sheet().rest());
        let c = &simulation.state().species[0];
        let total: f64 = c.iter().zip(&areas).map(|(c, a)| c * a).sum();
        let at = |t: f64| -> f64 {
            rest.iter().zip(&areas).map(|(x, a)| a * exact(x.norm_squared(), t)).sum()
        };
        assert!((total / at(2.0) - 1.0).abs() < 1e-9, "total {total}");
        let wrong: f64 = (0..c.len())
            .map(|i| areas[i] * (c[i] - exact(rest[i].norm_squared(), 4.0)).abs())
            .sum();
        wrong / total
    };
    let (coarse, fine) = (error(1000), error(4000));
    println!("L1 errors {coarse:.2e}, {fine:.2e}");
    assert!(fine < 5e-3 && fine < 0.5 * coarse, "{coarse} {fine}");
}

/// Chemotaxis up a steep attractant: u gathers as exp(χ v) (Keller & Segel with constant v, D = 1), and is conserved.
#[test]
fn cells_gather_up_a_gradient_as_boltzmann_says() {
    let text = "sheet = { shape = 'rectangle', width = 4.0, height = 1.0, vertices = 1500 }
         time = { until = 15.0, integrator = { kind = 'staggered', rtol = 1e-3 } }
         kinetics = { rates = { u = '0', v = '0' }, initial = { u = 1.0, v = { formula = '0.5*x' } } }
         effect = [
             { kind = 'diffusion', species = 'u', coefficient = 1.0 },
             { kind = 'cross-diffusion', species = 'u', by = 'v', coefficient = '-2*u' },
         ]";
    let simulation = run(text, 15.0);
    let rest = simulation.model().sheet().rest();
    let u = &simulation.state().species[0];
    // ∫ exp(x) over the width of 4.
    let unit = 4.0 / (2.0f64.exp() - (-2.0f64).exp());
    let worst =
        u.iter().zip(rest).map(|(u, x)| (u / (unit * x.x.exp()) - 1.0).abs()).fold(0.0, f64::max);
    let total: f64 = u.iter().zip(areas(&simulation)).map(|(u, a)| u * a).sum();
    println!("worst {worst:.2e}, total {total}");
    assert!(worst < 1e-2 && (total / 4.0 - 1.0).abs() < 1e-9, "{worst} {total}");
}

#[test]
fn coefficients_that_no_diffusion_has_are_refused() {
    let sheet = irregular(5, 5, 0.1);
    let law = synthetic_law(&["c"]);
    let context = |location, measure| EffectContext {
        sheet: &sheet,
        material: None,
        varying: None,
        kinetics: Some((&law, location)),
        measure,
        read: None,
    };
    let (vertex, concentration) = (Location::Vertex, Measure::Concentration);
    for (formula, location, measure, words) in [
        ("1 + c*t", vertex, concentration, "unknown name `t`"),
        ("1 + c", Location::Face, concentration, "for species on vertices"),
        ("1 + c", vertex, Measure::Amount, "for concentrations"),
        ("1 + d", vertex, concentration, "d"),
    ] {
        let spec = Diffusion::new("c", Some(Field::Formula(formula.into())));
        let error = spec.build(&context(location, measure)).err().unwrap();
        assert_eq!(error.key, "coefficient", "{error}");
        assert!(error.message.contains(words), "{error}");
    }
    // The names that an unknown one may have meant are those that are read: the time is not.
    for (formula, help) in [
        (
            "tt*c",
            "There are x, y, z (rest position, length), distance_to_boundary, pi and the species c",
        ),
        (
            "1 + cc",
            "did you mean `c`? There are x, y, z (rest position, length), distance_to_boundary, pi and the species c",
        ),
        ("t", "the time is not read here. There are x, y, z"),
    ] {
        let spec = Diffusion::new("c", Some(Field::Formula(formula.into())));
        let error = spec.build(&context(vertex, concentration)).err().unwrap();
        assert!(error.help.as_deref().is_some_and(|said| said.starts_with(help)), "{error:?}");
    }
    let text = "sheet = { shape = 'disc', radius = 3.0, vertices = 100 }
         time = { until = 1.0 }
         kinetics = { rates = { c = '0' }, initial = { c = { formula = 'x' } } }
         effect = [{ kind = 'diffusion', species = 'c', coefficient = '1 + c' }]";
    let (_, mut simulation) = prepare(text, &[]);
    let error = simulation.prepare().and_then(|_| simulation.step(1.0).map(|_| ()));
    let message = error.unwrap_err().to_string();
    let words = "effect[0].coefficient: the coefficient of diffusion of `c` becomes -";
    assert!(message.contains(words), "{message}");
}
