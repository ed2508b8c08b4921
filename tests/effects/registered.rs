//! Every kind of effect that the program registers, with the options that make it another energy.

use std::collections::BTreeSet;
use std::sync::Arc;

use rumple::effects::{
    Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, Field, FieldValues,
    HessianPart, Material, MaterialField, Measure, SPONTANEOUS_CURVATURE,
};
use rumple::geometry::Conditions;
use rumple::kinetics::Location;
use rumple::kit::{Report, examine_on, examine_with_species, synthetic_law};
use rumple::model::{Mechanics, Potential};
use rumple::num::checked::Positive;
use rumple::scene::Scene;
use rumple::sheet::{Sheet, SheetShape, generate};

use crate::common::irregular;

/// A table of an effect, on a closed sheet or an open one, and its invariances: translation,
/// rotation, and whether it leaves the sheet at rest alone.
const SAMPLES: [(&str, &str, bool, [bool; 3]); 66] = [
    ("stretching", "model = 'bond'", false, [true, true, true]),
    ("stretching", "model = 'bond'\nweight = 'paper'", false, [true, true, true]),
    ("stretching", "model = 'stvk'", false, [true, true, true]),
    ("bending", "model = 'meyer'", false, [true, true, true]),
    ("bending", "model = 'meyer'\narea = 'barycentric'", false, [true, true, true]),
    ("bending", "model = 'meyer'\nweight = 'paper'", false, [true, true, true]),
    ("bending", "rest = 'mesh'", true, [true, true, true]),
    ("bending", "rest = 'mesh'", false, [true, true, true]),
    ("bending", "curvature = 0.2", true, [true, true, false]),
    ("bending", "curvature = 0.2", false, [true, true, false]),
    (
        "bending",
        "rest = 'mesh'\ncurvature = '0.1*x'\narea = 'barycentric'",
        true,
        [true, true, false],
    ),
    ("bending", "curvature = '0.2 + 0.1*t*x'", false, [true, true, false]),
    ("bending", "model = 'hinge'\ncurvature = '0.2 + 0.1*t*x'", true, [true, true, false]),
    ("bending", "model = 'hinge'", false, [true, true, true]),
    ("bending", "model = 'hinge'\nrest = 'mesh'", true, [true, true, true]),
    ("bending", "model = 'hinge'\ncurvature = 0.2", false, [true, true, false]),
    ("bending", "model = 'hinge'\nrest = 'mesh'\ncurvature = '0.1*x'", true, [true, true, false]),
    ("load", "where = 'all'\nforce = { per-area = [0.1, 0.2, -0.3] }", false, [false; 3]),
    (
        "load",
        "where = 'rim'\nforce = { total = [1.0, 0.0, 0.0] }\nramp = { formula = '1 + t^2' }",
        false,
        [false; 3],
    ),
    ("load", "where = 'all'\nforce = { per-area = [0.1, 't*x', 0.2] }", false, [false; 3]),
    ("pressure", "value = 0.7", true, [true, true, false]),
    ("pressure", "value = 0.7\nramp = { points = [[0, 0.5], [1, 2]] }", true, [true, true, false]),
    ("foundation", "where = 'all'\nstiffness = 3.0", false, [false, false, true]),
    ("foundation", "where = 'all'\nstiffness = 'exp(x)'", false, [false, false, true]),
    (
        "foundation",
        "where = 'all'\nstiffness = 3.0\nto = { plane = { normal = [0.0, 1.0, 2.0] } }",
        false,
        [false, false, false],
    ),
    ("volume", "stiffness = 5.0", true, [true, true, true]),
    (
        "volume",
        "stiffness = 5.0\ntarget = { share = 1.2 }\nramp = { formula = '1 + 0.1*t' }",
        true,
        [true, true, false],
    ),
    ("volume", "exact = true", true, [true, true, true]),
    ("volume", "exact = true\nramp = { formula = '1 + 0.1*t' }", true, [true, true, true]),
    ("contact", "", false, [true, true, true]),
    ("contact", "distance = 0.3\nstiffness = 2.0", true, [true, true, true]),
    ("adhesion", "work = 0.2\ndistance = 0.5", false, [true, true, true]),
    ("adhesion", "work = 0.2\ndistance = 0.4", true, [true, true, true]),
    (
        "adhesion",
        "work = 0.3\ndistance = 0.9\nto = { plane = { point = [0.0, 0.0, -0.1], normal = [0.1, 0.0, 2.0] } }",
        false,
        [false; 3],
    ),
    (
        "adhesion",
        "work = 0.3\ndistance = 1.1\nto = { sphere = { centre = [0.3, 0.1, 0.0], radius = 2.9 } }\ndisplacement = [0.0, 0.1, 0.0]\n\
         ramp = { formula = 't' }",
        true,
        [false; 3],
    ),
    (
        "obstacle",
        "shape = { plane = { point = [0.0, 0.0, -0.1], normal = [0.1, 0.0, 2.0] } }",
        false,
        [false; 3],
    ),
    (
        "obstacle",
        "shape = { sphere = { centre = [1.0, 1.0, -2.9], radius = 2.9 } }\ndisplacement = [0.0, 0.1, 0.0]\n\
         ramp = { formula = 't' }\ndistance = 0.6",
        false,
        [false; 3],
    ),
    (
        "obstacle",
        "shape = { cylinder = { axis = [1.0, 0.3, 0.0], radius = 3.2, sheet = 'inside' } }",
        true,
        [false; 3],
    ),
    ("growth", "factor = '1 + 0.1*x*t'", false, [true, true, true]),
    ("growth", "along = '1 + 0.1*x*t'\nfibre = [1, 'x', 0]", false, [true, true, true]),
    ("growth", "along = 1.1\nshear = '0.2*x*t'\nfibre = [1, 'x', 0]", true, [true, true, true]),
    ("directed-growth", "fibre = [1, 0, 0.5]\nacross = 0.5", true, [true, true, true]),
    ("remodelling", "time = 2.0", false, [true, true, true]),
    ("remodelling", "time = '2 + 0.1*x'\nyield = 0.03", true, [true, true, true]),
    ("active-tension", "value = 0.7", false, [true, true, false]),
    ("active-tension", "value = -0.4\nramp = { formula = '1 + t' }", true, [true, true, false]),
    ("active-tension", "value = '0.3 + 0.1*x'\nfibre = [1, 0, 0]", false, [true, true, false]),
    ("active-tension", "value = -0.3\nfibre = ['y', '-x', 0.1]", true, [true, true, false]),
    ("active-tension", "value = '0.3 + 0.1*t*x'\nfibre = [1, 0, 0]", true, [true, true, false]),
    ("pin", "where = 'rim'\naxes = 'xyz'", false, [true, true, true]),
    ("diffusion", "species = 'c'", false, [true, true, true]),
    ("advection", "species = 'c'\nvelocity = ['-y', 'x', '0.3']", true, [true, true, true]),
    ("advection", "species = 'c'\nvelocity = ['1 + y', 0.3, 1.0]", false, [true, true, true]),
    (
        "advection",
        "species = 'c'\nvelocity = ['1 + y', 0.3, 1.0]\nscheme = 'central'",
        false,
        [true, true, true],
    ),
    ("cross-diffusion", "species = 'c'\nby = 'd'\ncoefficient = -0.7", false, [true, true, true]),
    ("hold", "species = 'c'\nwhere = 'rim'\nvalue = '1 + x'", false, [true, true, true]),
    ("hold", "species = 'd'\nwhere = 'all'\nvalue = 2.0", true, [true, true, true]),
    ("flux", "species = 'c'\nwhere = 'all'\nvalue = '1 + x'", true, [true, true, true]),
    ("flux", "species = 'c'\nwhere = 'rim'\nvalue = -0.3", false, [true, true, true]),
    ("flux", "species = 'c'\nwhere = 'rim'\nvalue = -0.3\nper = 'area'", false, [true, true, true]),
    (
        "exchange",
        "species = 'c'\nwhere = 'rim'\nrate = '2 + y'\nreference = 'x'",
        false,
        [true, true, true],
    ),
    (
        "exchange",
        "species = 'c'\nwhere = { half-space = { normal = [1.0, 0.0, 0.0] } }\nrate = 2\nreference = 1",
        true,
        [true, true, true],
    ),
    (
        "exchange",
        "species = 'c'\nwhere = 'all'\nper = 'length'\nrate = 2.0\nreference = 1.0",
        false,
        [true, true, true],
    ),
    ("diffusion", "species = 'c'\ncoefficient = '2 + x'", false, [true, true, true]),
    (
        "diffusion",
        "species = 'c'\nfibre = ['1 + y', 'x', 0.3]\nalong = '2 + x^2'\nacross = 0.3",
        false,
        [true, true, true],
    ),
    (
        "diffusion",
        "species = 'c'\nfibre = [0.2, 1, 0.3]\nalong = 0.1\nacross = '1 + y^2'",
        true,
        [true, true, true],
    ),
];

fn sheet(closed: bool) -> Arc<Sheet> {
    let sphere = || generate(&SheetShape::Sphere { radius: 3.0, irregular: true }, 150, 1).unwrap();
    Arc::new(if closed { sphere() } else { irregular(9, 8, 0.25) })
}

fn report(kind: &str, table: &str, closed: bool, location: Location) -> Report {
    let spec: Box<dyn EffectSpec> = read(kind, table);
    let material = Material { young: 10.0, poisson: 1.0 / 3.0, thickness: 0.5 };
    let mut synthetic_law = synthetic_law(&["c", "d"]);
    synthetic_law.capabilities.length_factor = true;
    let kinetics = spec.needs().species.then_some((&synthetic_law, location));
    examine_with_species(spec.as_ref(), &sheet(closed), Some(&material), kinetics).unwrap()
}

/// As a scene reads it.
pub(super) fn read(kind: &str, table: &str) -> Box<dyn EffectSpec> {
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 1.0, vertices = 50 }}\ntime = {{ until = 1.0 }}\n\
         material = {{ young = 1.0, poisson = 0.3, thickness = 0.1 }}\n\
         kinetics = {{ rates = {{ c = '0' }} }}\n[[effect]]\nkind = '{kind}'\n{table}\n"
    );
    let scene = Scene::parse(&text, "sample.toml", &[]).unwrap_or_else(|e| panic!("{kind}: {e}"));
    scene.effects.into_iter().next().unwrap()
}

#[test]
fn every_registered_effect_passes_the_kit() {
    for (kind, table, closed, [translation, rotation, rest]) in SAMPLES {
        let found = report(kind, table, closed, Location::Vertex);
        assert_eq!(found.faults, Vec::<String>::new(), "{kind} {table}");
        assert_eq!(found.translation_invariant, translation, "{kind} {table}");
        assert_eq!(found.rotation_invariant, rotation, "{kind} {table}");
        assert_eq!(found.zero_at_rest, rest, "{kind} {table}");
    }
}

/// With the spontaneous curvature of a law; an energy that leaves its derivatives out is found.
#[test]
fn bending_that_follows_a_law_passes_the_kit() {
    let mut law = synthetic_law(&["c"]);
    law.capabilities.curvature = true;
    let material = Material { young: 10.0, poisson: 1.0 / 3.0, thickness: 0.5 };
    let bending =
        SAMPLES.iter().filter(|(kind, table, ..)| *kind == "bending" && !table.contains("paper"));
    for (kind, table, closed, _) in bending {
        let (spec, kinetics) = (read(kind, table), Some((&law, Location::Vertex)));
        let found = examine_with_species(spec.as_ref(), &sheet(*closed), Some(&material), kinetics);
        assert_eq!(found.unwrap().faults, Vec::<String>::new(), "{table}");
    }
    let found = examine_with_species(&Forgetful, &sheet(false), Some(&material), None).unwrap();
    let missing =
        "Forgetful: the derivatives of the forces by the spontaneous curvature of a law differ";
    assert!(found.faults.iter().any(|fault| fault.starts_with(missing)), "{:?}", found.faults);
}

/// Forces along z in proportion to the spontaneous curvature of a law, without derivatives by it.
#[derive(Debug, serde::Serialize)]
struct Forgetful;

#[typetag::serialize(name = "test-forgetful")]
impl EffectSpec for Forgetful {
    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::energy(Pull))
    }
}

struct Pull;

impl Energy for Pull {
    type Work = Vec<f64>;

    fn name(&self) -> &'static str {
        "Forgetful"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Vec<f64>) {
        *work = conditions.internal(SPONTANEOUS_CURVATURE).unwrap_or_default().to_vec();
    }

    fn evaluate(
        &self,
        shape: &rumple::geometry::Shape<'_>,
        work: &mut Vec<f64>,
        gradient: Option<&mut [rumple::Vec3]>,
    ) -> f64 {
        if let Some(gradient) = gradient {
            work.iter().zip(gradient).for_each(|(c, g)| g.z += c);
        }
        work.iter().zip(shape.x).map(|(c, x)| c * x.z).sum()
    }

    fn add_hessian(
        &self,
        _: &rumple::geometry::Shape<'_>,
        _: &mut Vec<f64>,
        _: HessianPart,
        _: &mut rumple::linear::BlockMatrix,
    ) {
    }
}

/// What each scheme conserves; on the rest shape both are true of that alone.
#[test]
fn diffusion_passes_the_kit_wherever_species_live() {
    for (table, location, closed, [totals, constants]) in [
        ("species = 'c'", Location::Vertex, false, [true, true]),
        ("species = 'c'", Location::Vertex, true, [true, true]),
        ("species = 'c'\nmetric = 'rest'", Location::Vertex, false, [false, false]),
        ("species = 'c'\ncoefficient = 'exp(x)'", Location::Vertex, false, [true, true]),
        ("species = 'c'\ncoefficient = 'exp(x)'", Location::Vertex, true, [true, true]),
        ("species = 'c'\ncoefficient = 0.0", Location::Vertex, false, [true, true]),
        (
            "species = 'c'\nfibre = [1, 1, 0]\nalong = 'exp(x)'\nacross = 0.2",
            Location::Vertex,
            true,
            [true, true],
        ),
        ("species = 'c'", Location::Face, false, [false, true]),
        ("species = 'c'\nmetric = 'rest'", Location::Face, false, [false, true]),
    ] {
        let found = report("diffusion", table, closed, location);
        assert_eq!(found.faults, Vec::<String>::new(), "{table} {location:?}");
        assert_eq!(found.conserves_totals, totals, "{table} {location:?}");
        assert_eq!(found.keeps_constants, constants, "{table} {location:?}");
    }
}

/// Advection moves totals about, and gathers species unless the velocity has no divergence.
#[test]
fn advection_and_cross_diffusion_conserve_totals() {
    for (kind, table, closed, constants) in [
        ("advection", "species = 'c'\nvelocity = ['1 + y', 'z', '0.3*x']", true, false),
        ("advection", "species = 'c'\nvelocity = ['1 + y', 0.3, 1.0]", false, false),
        ("cross-diffusion", "species = 'c'\nby = 'd'\ncoefficient = -0.7", false, true),
    ] {
        let found = report(kind, table, closed, Location::Vertex);
        assert!(found.conserves_totals, "{kind} {table}");
        assert_eq!(found.keeps_constants, constants, "{kind} {table}");
    }
}

/// Their derivatives where species live on faces; a flux changes totals, and leaves no constant alone.
#[test]
fn inflows_pass_the_kit_on_faces() {
    for (kind, table) in [
        ("flux", "species = 'c'\nwhere = 'all'\nvalue = '1 + x'"),
        ("flux", "species = 'c'\nwhere = 'rim'\nvalue = '1 + x'"),
        ("exchange", "species = 'c'\nwhere = 'all'\nrate = 2.0\nreference = 'x'"),
        ("exchange", "species = 'c'\nwhere = 'rim'\nrate = 2.0\nreference = 'x'"),
    ] {
        for location in [Location::Vertex, Location::Face] {
            let found = report(kind, table, false, location);
            assert_eq!(found.faults, Vec::<String>::new(), "{kind} {table}");
            assert!(!found.conserves_totals && !found.keeps_constants, "{kind} {table}");
        }
    }
}

/// Those of the material that know one that differs from place to place; what is true of them stays true.
#[test]
fn elastic_effects_pass_the_kit_where_the_material_varies() {
    let field = |text: &str| Field::<Positive>::Formula(text.into());
    let elastic = SAMPLES.iter().filter(|sample| ["stretching", "bending"].contains(&sample.0));
    for (kind, table, closed, [translation, rotation, rest]) in elastic {
        let (spec, sheet) = (read(kind, table), sheet(*closed));
        let on = |text| field(text).on(Location::Face, &sheet, None, "thickness").unwrap();
        let material = MaterialField {
            young: on("10 + x"),
            poisson: on("0.2 + 0.02*x"),
            thickness: on("0.5 + 0.3*step(y - 0.1)"),
        };
        let found = examine_on(spec.as_ref(), &sheet, Some(&material), None).unwrap();
        assert_eq!(found.faults, Vec::<String>::new(), "{kind} {table}");
        assert_eq!(found.translation_invariant, *translation, "{kind} {table}");
        assert_eq!(found.rotation_invariant, *rotation, "{kind} {table}");
        assert_eq!(found.zero_at_rest, *rest, "{kind} {table}");
    }
}

/// A material that is written as a field with one value gives what the number gives.
#[test]
fn a_field_of_one_value_is_the_number() {
    let number = Material { young: 10.0, poisson: 0.2, thickness: 0.5 };
    for (kind, table, closed, _) in SAMPLES {
        if !["stretching", "bending"].contains(&kind) {
            continue;
        }
        let (spec, sheet) = (read(kind, table), sheet(closed));
        let moved: Vec<_> = sheet
            .rest()
            .iter()
            .map(|x| x + 0.1 * rumple::Vec3::new((3.0 * x.y).sin(), x.z * x.x, (2.0 * x.x).cos()))
            .collect();
        let count = sheet.triangle_count();
        let field = MaterialField {
            thickness: FieldValues::Each(vec![0.5; count]),
            ..MaterialField::from(&number)
        };
        let poisson = MaterialField {
            poisson: FieldValues::Each(vec![0.2; count]),
            ..MaterialField::from(&number)
        };
        let of = |varying: Option<&MaterialField>| {
            let context = EffectContext {
                sheet: &sheet,
                material: Some(&number),
                varying,
                kinetics: None,
                measure: Measure::Concentration,
                read: None,
            };
            let energies = spec.build(&context).unwrap().energies;
            let pins = vec![[false; 3]; sheet.vertex_count()];
            let mechanics = Mechanics::new(sheet.clone(), energies, pins).unwrap();
            Potential::new(&mechanics).energy(&moved)
        };
        let one = of(None);
        for field in [&field, &poisson] {
            let all = of(Some(field));
            assert!((all / one - 1.0).abs() < 1e-10, "{kind} {table}: {all} {one}");
        }
    }
}

#[test]
fn every_registered_effect_has_a_sample() {
    let mut registered: BTreeSet<&str> =
        rumple::registry::names::<dyn EffectSpec>().into_iter().collect();
    // Those of tests and of the example of another crate are examined there.
    registered.retain(|name| !name.starts_with("test-") && *name != "indenter");
    let sampled: BTreeSet<&str> = SAMPLES.iter().map(|s| s.0).collect();
    assert_eq!(sampled, registered);
}
