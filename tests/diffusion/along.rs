//! Diffusion along and across fibres that the surface carries.

use rumple::effects::{Diffusion, EffectContext, EffectSpec, Fibre, Field, Measure};
use rumple::kinetics::Location;
use rumple::kit::synthetic_law;
use rumple::num::checked::NonNegative;
use rumple::sheet::Sheet;
use rumple::{Simulation, Vec3};

use crate::common::{irregular, prepare};

fn number(d: f64) -> Option<Field<NonNegative>> {
    Some(NonNegative::new(d).unwrap().into())
}

fn context<'a>(sheet: &'a Sheet, law: &'a rumple::kinetics::Descriptor) -> EffectContext<'a> {
    EffectContext {
        sheet,
        material: None,
        varying: None,
        kinetics: Some((law, Location::Vertex)),
        measure: Measure::Concentration,
        read: None,
    }
}

/// `Σ A c dc/dt = -∫ ∇c·D ∇c` of linear c, exact on any mesh, on a sheet that is stretched, sheared and tilted.
#[test]
fn the_flux_is_that_of_the_carried_fibre() {
    let sheet = irregular(7, 6, 0.2);
    let law = synthetic_law(&["c"]);
    let (along, across, fibre) = (3.0, 0.4, Vec3::new(0.6, 0.8, 0.0));
    let components = [fibre.x, fibre.y, 0.5].map(|a| Field::Formula(format!("{a:?}")));
    let spec = Diffusion {
        fibre: Some(Fibre::Components(components)),
        along: number(along),
        across: number(across),
        ..Diffusion::new("c", None)
    };
    let term = spec.build(&context(&sheet, &law)).unwrap().transports.remove(0);
    let moved = |x: &Vec3| Vec3::new(1.4 * x.x + 0.3 * x.y, 0.7 * x.y, 0.5 * x.x - 0.2 * x.y);
    let x: Vec<Vec3> = sheet.rest().iter().map(moved).collect();
    let a = moved(&fibre).normalize();
    let normal = moved(&Vec3::x()).cross(&moved(&Vec3::y())).normalize();
    let b = normal.cross(&a);
    let mut areas = vec![0.0; x.len()];
    for t in sheet.triangles() {
        let [p, q, r] = t.map(|v| x[v as usize]);
        t.iter().for_each(|v| areas[*v as usize] += (q - p).cross(&(r - p)).norm() / 6.0);
    }
    let total: f64 = areas.iter().sum();
    let operator = term.operator_on(&sheet, &x);
    for gradient in [a, b, a + 2.0 * b, Vec3::new(0.3, -0.5, 1.0)] {
        let c: Vec<f64> = x.iter().map(|x| gradient.dot(x)).collect();
        let mut rate = vec![0.0; c.len()];
        term.add_rate((&sheet, 0.0), &operator, &c, &mut rate);
        let flow: f64 = (0..c.len()).map(|i| areas[i] * c[i] * rate[i]).sum();
        let expected = along * gradient.dot(&a).powi(2) + across * gradient.dot(&b).powi(2);
        assert!((flow / (-total * expected) - 1.0).abs() < 1e-12, "{flow} {expected}");
    }
}

/// A scene with modes cos(πx/4) and cos(πy/2) on 4 × 2, by the integrator.
#[test]
fn modes_along_and_across_decay_at_their_rates() {
    let decay = |axis: usize| {
        let mode = if axis == 0 { "cos(pi*(x + 2)/4)" } else { "cos(pi*(y + 1)/2)" };
        let text = format!(
            "sheet = {{ shape = 'rectangle', width = 4.0, height = 2.0, vertices = 1500 }}
             time = {{ until = 0.2, integrator = {{ kind = 'staggered', chemistry = 'tr-bdf2', rtol = 1e-7, atol = 1e-9 }} }}
             kinetics = {{ rates = {{ c = '0' }}, initial = {{ c = {{ formula = '{mode}' }} }} }}
             effect = [{{ kind = 'diffusion', species = 'c', fibre = [1, 0, 0], along = 2.0, across = '0.25 + 0*x' }}]"
        );
        let (_, mut simulation): (_, Simulation) = prepare(&text, &[]);
        let before = simulation.state().species[0].clone();
        simulation.prepare().unwrap();
        while simulation.state().time < 0.2 {
            simulation.step(0.2).unwrap();
        }
        let after = &simulation.state().species[0];
        let product: f64 = before.iter().zip(after).map(|(a, b)| a * b).sum();
        let square: f64 = before.iter().map(|a| a * a).sum();
        -(product / square).ln() / 0.2
    };
    let pi = std::f64::consts::PI;
    for (axis, expected) in [(0, 2.0 * (pi / 4.0).powi(2)), (1, 0.25 * (pi / 2.0).powi(2))] {
        let found = decay(axis);
        println!("axis {axis}: rate {found:.6}, {expected:.6} expected");
        assert!((found / expected - 1.0).abs() < 5e-3, "{axis}: {found} {expected}");
    }
}

#[test]
fn keys_that_do_not_go_together_are_refused() {
    let sheet = irregular(5, 5, 0.1);
    let law = synthetic_law(&["c"]);
    let whole = Diffusion {
        fibre: Some(Fibre::Components([1.0, 0.0, 0.0].map(|a| Field::Formula(format!("{a:?}"))))),
        along: number(1.0),
        across: number(2.0),
        ..Diffusion::new("c", None)
    };
    for (spec, key, words) in [
        (Diffusion { coefficient: number(1.0), ..whole.clone() }, "coefficient", "one coefficient"),
        (Diffusion { across: None, ..whole.clone() }, "fibre", "needs the fibre"),
        (Diffusion { fibre: None, ..whole.clone() }, "along", "needs the fibre"),
        (Diffusion { fibre: None, along: None, ..whole.clone() }, "across", "needs the fibre"),
    ] {
        let error = spec.build(&context(&sheet, &law)).err().unwrap();
        assert_eq!(error.key, key, "{error}");
        assert!(error.message.contains(words), "{error}");
    }
    let faces = EffectContext { kinetics: Some((&law, Location::Face)), ..context(&sheet, &law) };
    assert_eq!(whole.build(&faces).err().unwrap().key, "fibre");
}
