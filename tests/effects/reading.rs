//! Energies that read species: active tension, and one of another crate.

use std::sync::Arc;

use rumple::effects::prelude::*;
use rumple::kinetics::formula::{FormulaKinetics, Law};
use rumple::kit::{examine_with_species, synthetic_law};
use rumple::problem::{self, Problem};
use rumple::sheet::{SheetShape, generate};
use serde::Serialize;

use super::registered::read;
use crate::common::{irregular, prepare};

/// Springs `½ k (z - c)²` at the vertices: the height where they rest is a species.
#[derive(Debug, Clone, Serialize)]
struct Lifted {
    stiffness: f64,
    species: String,
    /// What its derivative by the species is, in units of the right one.
    slope: f64,
}

#[typetag::serialize(name = "test-lifted")]
impl EffectSpec for Lifted {
    fn needs(&self) -> Needs {
        Needs { species: true, out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let (species, _) = context.species("species", &self.species, "lift the sheet")?;
        let (k, slope) = (self.stiffness, self.slope);
        let corners = (0..context.sheet.vertex_count()).map(|v| [u32::try_from(v).unwrap()]);
        let springs = move |conditions: &Conditions<'_>, v: usize| {
            Lift::Spring(k, conditions.species(species)[v])
        };
        // ∂u/∂c = -k (z - c).
        let slopes = move |conditions: &Conditions<'_>| {
            let all = conditions.species(species).iter();
            all.map(|c| [Lift::Slope(-slope * k, *c)]).collect()
        };
        let elements = Elements::new("lifting springs", context.sheet, corners.collect(), springs)?;
        Ok(Effect::energy(elements.reading(species, slopes)))
    }
}

enum Lift {
    /// k and c.
    Spring(f64, f64),
    /// `k (z - c)`.
    Slope(f64, f64),
}

impl Element<1> for Lift {
    fn gradient(&self, [x]: &[Vec3; 1]) -> (f64, [Vec3; 1]) {
        match self {
            Self::Spring(k, c) => {
                let stretch = x.z - c;
                (0.5 * k * stretch * stretch, [Vec3::new(0.0, 0.0, k * stretch)])
            }
            Self::Slope(k, c) => (k * (x.z - c), [Vec3::new(0.0, 0.0, *k)]),
        }
    }

    fn hessian(&self, _: &[Vec3; 1], _: HessianPart) -> [[Block; 1]; 1] {
        let mut block = Block::zeros();
        if let Self::Spring(k, _) = self {
            block[(2, 2)] = *k;
        }
        [[block]]
    }
}

const RIGHT: Lifted = Lifted { stiffness: 2.0, species: String::new(), slope: 1.0 };

fn lifted(slope: f64) -> Lifted {
    Lifted { species: "c".into(), slope, ..RIGHT }
}

#[test]
fn a_strangers_effect_reads_a_species() {
    let law = Law::named("decay").species("b", "0").species("c", "-c");
    let sheet = generate(&SheetShape::Disc { radius: 3.0 }, 60, 1).unwrap();
    let tight = Positive::new(1e-5).unwrap();
    let spec =
        rumple::solve::staggered::StaggeredSpec { rtol: tight, atol: tight, ..Default::default() };
    let mut stepper = Problem::on(sheet)
        .material(Material { young: 10.0, poisson: 0.3, thickness: 0.1 })
        .effect(rumple::effects::Stretching::default())
        .effect(lifted(1.0))
        .law(problem::Law::new(Arc::new(FormulaKinetics::new(&law).unwrap())))
        .integrator(spec)
        .until(1.0)
        .stepper()
        .unwrap();
    stepper.state.species[1].fill(0.3);
    stepper.prepare().unwrap();
    while stepper.state.time < 1.0 {
        stepper.step(1.0).unwrap();
    }
    let exact = 0.3 * (-1.0f64).exp();
    for (x, c) in stepper.state.x.iter().zip(&stepper.state.species[1]) {
        assert!((x.z - c).abs() < 1e-6 && (c / exact - 1.0).abs() < 1e-4, "{} {c} {exact}", x.z);
    }
}

#[test]
fn the_kit_inspects_derivatives_by_species() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let law = synthetic_law(&["b", "c"]);
    let faults = |effect: &dyn EffectSpec, location| {
        examine_with_species(effect, &sheet, None, Some((&law, location))).unwrap().faults
    };
    for location in [Location::Vertex, Location::Face] {
        assert_eq!(faults(&lifted(1.0), location), Vec::<String>::new());
        for table in [
            "value = '0.3 + b*c'",
            "value = '-0.1*b^2*x'\nfibre = [1, 'x', 0]\nramp = { formula = '1 + t' }",
        ] {
            let effect = read("active-tension", table);
            assert_eq!(faults(&*effect, location), Vec::<String>::new(), "{table}");
        }
    }
    let wrong = faults(&lifted(0.5), Location::Vertex);
    assert!(wrong.iter().any(|fault| fault.contains("by species number 1")), "{wrong:?}");
}

const STRIP: &str = "
sheet = { shape = 'rectangle', width = 6.0, height = 2.0, vertices = 120 }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.1, drag = 1.0 }
time = { until = 1.0 }
";

#[test]
fn mistakes_in_formulas_of_species_are_named_with_their_place() {
    for (value, kinetics, what) in [
        ("0.1*mm", "kinetics = { rates = { myosin = '0', m = '0' } }", "did you mean `m`?"),
        ("0.1*q", "kinetics = { rates = { myosin = '0', m = '0' } }", "the species m, myosin"),
        ("0.1*m", "", "pi and no species"),
        ("0.1*(m", "kinetics = { rates = { m = '0' } }", "effect[1].value"),
    ] {
        let text = format!(
            "{STRIP}\n{kinetics}\neffect = [{{ kind = 'stretching' }}, {{ kind = 'active-tension', value = '{value}' }}]"
        );
        let scene = rumple::scene::Scene::parse(&text, "test", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let made = rumple::Simulation::new(&scene, &search);
        let Err(rumple::Error::Scene(error)) = made else { panic!("{value}") };
        let said = format!("{error} {}", error.advice().unwrap_or_default());
        assert!(said.contains(what) && said.contains("effect[1].value"), "{value}: {said}");
    }
}

#[test]
fn scenes_whose_energies_read_no_species_carry_none() {
    let text = format!(
        "{STRIP}\nkinetics = {{ rates = {{ m = '0' }} }}\n\
         effect = [{{ kind = 'stretching' }}, {{ kind = 'active-tension', value = '0.1*x' }}]"
    );
    let (_, simulation) = prepare(&text, &[]);
    assert!(simulation.model().mechanics().species().is_empty());
    let (_, simulation) = prepare(&text.replace("0.1*x", "0.1*m"), &[]);
    assert_eq!(simulation.model().mechanics().species(), [0]);
}
