//! Internal variables that an effect owns: remodelling of lengths and angles, and those of an effect of the test.

use rumple::effects::prelude::*;
use rumple::kit::examine;
use rumple::problem::Problem;
use rumple::sheet::{SheetShape, generate};
use serde::Serialize;
use std::sync::Arc;

use super::running::at_end;
use crate::common::prepare;

/// Springs to the plane z = 0 whose stiffness `k (1 - d)` is lost by damage: `dd/dt = r (1 - d)`, so that `1 - d = exp(-rt)`.
#[derive(Debug, Clone, Copy, Serialize)]
struct Damaged {
    stiffness: f64,
    rate: f64,
    /// What its bound on the spectral radius is, in units of the right one.
    bound: f64,
}

#[typetag::serialize(name = "test-damaged")]
impl EffectSpec for Damaged {
    fn needs(&self) -> Needs {
        Needs { out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect { internal: vec![Box::new(*self)], ..Effect::energy(*self) })
    }
}

impl InternalVariables for Damaged {
    fn name(&self) -> &'static str {
        "damage"
    }

    fn location(&self) -> Location {
        Location::Vertex
    }

    fn initial(&self, _: usize) -> f64 {
        0.0
    }

    fn rates(&self, _: &Shape<'_>, values: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(values).for_each(|(out, d)| *out = self.rate * (1.0 - d));
    }

    fn spectral_bound(&self) -> f64 {
        self.bound * self.rate
    }
}

impl Energy for Damaged {
    /// Stiffness of the vertices.
    type Work = Vec<f64>;

    fn name(&self) -> &'static str {
        "damaged springs"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Vec<f64>) {
        let count = conditions.sheet.vertex_count();
        *work = match conditions.internal("damage") {
            None => vec![self.stiffness; count],
            Some(damage) => damage.iter().map(|d| self.stiffness * (1.0 - d)).collect(),
        };
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Vec<f64>,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        if let Some(gradient) = gradient {
            let all = gradient.iter_mut().zip(shape.x).zip(&*work);
            all.for_each(|((g, x), k)| g.z += k * x.z);
        }
        shape.x.iter().zip(&*work).map(|(x, k)| 0.5 * k * x.z * x.z).sum()
    }

    fn add_hessian(
        &self,
        _: &Shape<'_>,
        work: &mut Vec<f64>,
        _: HessianPart,
        into: &mut BlockMatrix,
    ) {
        into.update_rows(|i, row| {
            let mut block = Block::zeros();
            block[(2, 2)] = work[i];
            row.add(i, &block);
        });
    }
}

const RIGHT: Damaged = Damaged { stiffness: 2.0, rate: 0.7, bound: 1.0 };

#[test]
fn damage_of_a_strangers_effect_softens_springs() {
    use rumple::effects::{Load, LoadForce, Stretching};
    let number = |x: f64| Finite::new(x).unwrap();
    let force = LoadForce::PerVertex([0.0, 0.0, 0.1].map(|f| number(f).into()));
    let sheet = generate(&SheetShape::Disc { radius: 3.0 }, 60, 1).unwrap();
    let mut stepper = Problem::on(sheet)
        .material(Material { young: 10.0, poisson: 0.3, thickness: 0.1 })
        .effect(Stretching::default())
        .effect(RIGHT)
        .effect(Load { region: Region::All, force, ramp: None })
        .until(2.0)
        .stepper()
        .unwrap();
    stepper.prepare().unwrap();
    while stepper.state.time < 2.0 {
        stepper.step(2.0).unwrap();
    }
    let exact = 0.1 / 2.0 * (0.7f64 * 2.0).exp();
    for x in &stepper.state.x {
        assert!((x.z / exact - 1.0).abs() < 0.02, "{} {exact}", x.z);
    }
}

#[test]
fn the_kit_inspects_internal_variables() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 3.0 }, 60, 1).unwrap());
    let faults = |effect: &dyn EffectSpec| {
        let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
        examine(effect, &sheet, Some(&material)).unwrap().faults
    };
    assert_eq!(faults(&RIGHT), Vec::<String>::new());
    let wrong = faults(&Damaged { bound: 0.5, ..RIGHT });
    assert!(wrong.iter().any(|fault| fault.contains("spectral bound")), "{wrong:?}");
    let nothing = faults(&Damaged { rate: f64::NAN, ..RIGHT });
    assert!(!nothing.is_empty());
}

#[test]
fn remodelling_passes_the_kit() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 3.0 }, 60, 1).unwrap());
    for text in [
        "{ kind = 'remodelling', time = 2.0 }",
        "{ kind = 'remodelling', time = '2 + 0.1*x', yield = 0.05 }",
        "{ kind = 'bending', model = 'hinge', remodelling = { time = 0.5 } }",
        "{ kind = 'bending', model = 'hinge', remodelling = { time = 0.5, yield = 0.1 } }",
    ] {
        let scene = format!("{PLATE}\ntime.until = 1.0\neffect = [{text}]");
        let scene = rumple::scene::Scene::parse(&scene, "test", &[]).unwrap();
        let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
        let report = examine(&*scene.effects[0], &sheet, Some(&material)).unwrap();
        assert_eq!(report.faults, Vec::<String>::new(), "{text}");
    }
}

const PLATE: &str = "
sheet = { shape = 'rectangle', width = 6.0, height = 2.0, vertices = 120 }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.1, drag = 1e-6 }
equilibrium = { method = 'lbfgs', tolerance = 1e-9 }
";

/// A strip whose left end is held and whose right end is pulled out and bent up in time.
fn pulled(time: &str, more: &str) -> String {
    format!(
        "{PLATE}
        time = {{ until = 1.0, {time} }}
        effect = [
            {{ kind = 'stretching' }},
            {{ kind = 'bending', model = 'hinge', remodelling = {{ time = 0.7 }} }},
            {{ kind = 'pin', where = {{ half-space = {{ point = [-2.5, 0, 0], normal = [-1, 0, 0] }} }}, axes = 'xyz',
               displacement = [0, 0, 0] }},
            {{ kind = 'pin', where = {{ half-space = {{ point = [2.5, 0, 0], normal = [1, 0, 0] }} }}, axes = 'xyz',
               displacement = [0.1, 0.0, 0.5], ramp = {{ formula = 't' }} }},
            {{ kind = 'remodelling', time = '0.5 + 0.05*x', yield = 1e-3 }},
            {more}
        ]"
    )
}

#[test]
fn every_policy_and_integrator_gives_the_same_answer() {
    let staggered = |tolerance: f64| {
        format!("integrator = {{ kind = 'staggered', rtol = {tolerance:e}, atol = {tolerance:e} }}")
    };
    let reference = at_end(&pulled(&staggered(1e-5), ""));
    let largest = |values: &[f64], other: &[f64]| {
        values.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    for (time, tolerance) in [
        (staggered(1e-3), 2e-3),
        (format!("policy = 'simultaneous', {}", staggered(1e-3)), 5e-3),
        (format!("policy = 'chemistry-fast', {}", staggered(1e-3)), 5e-3),
        ("integrator = { kind = 'staggered', method = 'euler', step = 5e-3 }".into(), 2e-2),
    ] {
        let other = at_end(&pulled(&time, ""));
        for (name, (a, b)) in ["angles", "lengths"]
            .iter()
            .zip(reference.state().internal.iter().zip(&other.state().internal))
        {
            let initial = if *name == "angles" { 0.0 } else { 1.0 };
            let size = a.iter().map(|a| (a - initial).abs()).fold(0.0, f64::max);
            assert!(size > 1e-3, "{name}: {size}");
            let error = largest(a, b) / size;
            assert!(error < tolerance, "{time}, {name}: {error:e}");
        }
    }
}

#[test]
fn integrators_without_internal_variables_refuse_them() {
    for time in [
        "integrator = { kind = 'monolithic' }",
        "policy = 'simultaneous', integrator = { kind = 'explicit', method = 'tsit45' }",
    ] {
        let scene = rumple::scene::Scene::parse(&pulled(time, ""), "test", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let error = rumple::Simulation::new(&scene, &search).err().unwrap().to_string();
        assert!(error.contains("angle_remodelling, length_remodelling"), "{time}: {error}");
    }
}

#[test]
fn scenes_without_internal_variables_have_none() {
    let (_, simulation) =
        prepare(&format!("{PLATE}\ntime.until = 1.0\neffect = [{{ kind = 'stretching' }}]"), &[]);
    assert_eq!(simulation.state().internal.capacity(), 0);
    assert!(simulation.model().internal().is_empty());
}

#[test]
fn mistakes_are_named_with_their_place() {
    let effect = |text: &str| {
        format!("{PLATE}\ntime.until = 1.0\neffect = [{{ kind = 'stretching' }}, {text}]")
    };
    for (text, what) in [
        ("{ kind = 'remodelling' }", "time"),
        ("{ kind = 'remodelling', time = 0.0 }", "a number above 0"),
        ("{ kind = 'remodelling', time = 'x' }", "at vertex"),
        ("{ kind = 'remodelling', time = 1.0, yield = -0.1 }", "a number from 0"),
        ("{ kind = 'remodelling', time = 1.0, of = 'angles' }", "unknown key of"),
        ("{ kind = 'bending', remodelling = { time = 1.0 } }", "has no remodelling"),
        ("{ kind = 'bending', model = 'hinge', remodelling = { tim = 1.0 } }", "tim"),
        (
            "{ kind = 'remodelling', time = 1.0 }, { kind = 'remodelling', time = 2.0, where = 'rim' }",
            "owns internal variables length_remodelling already",
        ),
    ] {
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let made = rumple::scene::Scene::parse(&effect(text), "test", &[])
            .map_err(|e| e.to_string())
            .and_then(|scene| {
                rumple::Simulation::new(&scene, &search).map(drop).map_err(|e| e.to_string())
            });
        let error = made.err().unwrap_or_default();
        assert!(error.contains(what), "{text}: {error}");
    }
}

#[test]
fn frames_hold_internal_variables_to_the_last_bit() {
    use rumple::sheet::{Array, Surface};
    let fields = "\noutput.fields = ['length_remodelling', 'angle_remodelling']";
    let text = pulled("integrator = { kind = 'staggered', rtol = 1e-2, atol = 1e-2 }", "") + fields;
    let mut simulation = at_end(&text);
    let energies = simulation.energies().unwrap();
    let internal = simulation.state().internal.clone();
    let frame = simulation.frame().unwrap();
    frame.check().unwrap();
    let arrays = |fields: &[rumple::output::Field<'_>]| -> Vec<Array> {
        let of = |field: &rumple::output::Field<'_>| Array {
            name: field.name.clone(),
            components: field.components,
            values: field.data.to_vec(),
        };
        fields.iter().map(of).collect()
    };
    let surface = Surface {
        points: frame.points.to_vec(),
        // As after a turn of the corners in a file.
        triangles: frame.triangles.iter().map(|[a, b, c]| [*b, *c, *a]).collect(),
        point_arrays: arrays(&frame.point),
        cell_arrays: arrays(&frame.cell),
        ..Surface::default()
    };
    let mut turned = surface.clone();
    for array in &mut turned.cell_arrays {
        let all = array.values.as_chunks::<3>().0;
        array.values = all.iter().flat_map(|[a, b, c]| [*b, *c, *a]).collect();
    }
    let (_, mut other) = prepare(&text, &[]);
    rumple::run::inspect::take_state(&mut other, &turned).unwrap();
    assert_eq!(other.state().internal[1], internal[1]);
    // Rest angles of the boundary stay what they are.
    assert_eq!(other.state().internal[0], internal[0]);
    for ((name, a), (_, b)) in other.energies().unwrap().iter().zip(&energies) {
        assert!((a / b - 1.0).abs() < 1e-12, "{name}: {a} {b}");
    }
    let without = Surface { cell_arrays: Vec::new(), ..surface };
    let error = rumple::run::inspect::take_state(&mut other, &without).unwrap_err().to_string();
    assert!(error.contains("`angle_remodelling of edges`"), "{error}");
}
