//! An effect that a program registers and no scene lists changes nothing.

use std::path::Path;

use rumple::effects::{
    Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, HessianPart,
};
use rumple::geometry::Shape as At;
use rumple::kinetics::PluginSearch;
use rumple::output::{Interrupt, Mode, Progress, ResultDirectory};
use rumple::run::{Costs, laws, run};
use rumple::scene::Scene;
use rumple::{Simulation, Vec3};
use rumple_numerics::linear::BlockMatrix;

/// An effect of this program that no scene here lists.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Unlisted {}

#[typetag::serialize(name = "test-unlisted")]
impl EffectSpec for Unlisted {
    fn name(&self) -> String {
        "unlisted".into()
    }

    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::energy(Upwards))
    }
}

rumple::register_kind!(dyn EffectSpec, "test-unlisted", Unlisted);

/// `U = -Σ z`.
struct Upwards;

impl Energy for Upwards {
    type Work = ();

    fn name(&self) -> &'static str {
        "unlisted"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn evaluate(&self, shape: &At<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        for g in gradient.into_iter().flatten() {
            g.z -= 1.0;
        }
        shape.x.iter().map(|x| -x.z).sum()
    }

    fn add_hessian(&self, _: &At<'_>, (): &mut (), _: HessianPart, _: &mut BlockMatrix) {}
}

/// The counts of a run, by group and name; without checkpoints, which follow the clock.
fn counts(directory: &Path) -> Vec<(String, Vec<(String, u64)>)> {
    let costs = Costs::read(directory).unwrap();
    let named = |group: &str, name: &str| format!("{group} {name}");
    let all = costs.parts.into_iter().map(|part| (named(&part.group, &part.name), part.counts));
    all.filter(|(name, _)| name != "output checkpoints").collect()
}

/// This program registers one effect more than `rumple` does; a run of a scene that does not list it is the
/// same, bit for bit and count for count.
#[test]
fn an_unlisted_effect_changes_no_bit_and_no_count() {
    let known = rumple::registry::names::<dyn EffectSpec>();
    assert!(known.contains(&"test-unlisted"), "{known:?}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, crate::run::SMALL).unwrap();
    let file = path.display().to_string();
    let out = crate::run::rumple(folder.path(), &["run", &file, "--out", "without", "--quiet"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    // The effect acts where it is listed.
    let listed = format!("{}\n[[effect]]\nkind = 'test-unlisted'\n", crate::run::SMALL);
    let refused = folder.path().join("listed.toml");
    std::fs::write(&refused, &listed).unwrap();
    assert_eq!(crate::run::rumple(folder.path(), &["check", "listed.toml"]).status.code(), Some(2));
    assert!(Scene::parse(&listed, "listed.toml", &[]).is_ok());

    let scene = Scene::load(&path, &[]).unwrap();
    let search = PluginSearch::in_directories(vec![crate::plugins::build::directory().to_owned()]);
    let mut simulation = Simulation::new(&scene, &search).unwrap();
    let directory = ResultDirectory::prepare(&folder.path().join("with"), false).unwrap();
    let mut progress = Progress::new(Mode::Silent, 1.0);
    let interrupt = Interrupt::install().unwrap();
    laws::validate(&mut simulation.evaluate()).unwrap();
    run::run(&scene, &mut simulation, &directory, &mut progress, interrupt).unwrap();
    for number in 0..3 {
        let frame = |of: &str| {
            let name = format!("{of}/frames/frame_{number:06}.vtu");
            std::fs::read(folder.path().join(name)).unwrap()
        };
        assert!(frame("with") == frame("without"), "frame {number}");
    }
    let (with, without) = (folder.path().join("with"), folder.path().join("without"));
    assert_eq!(counts(&with), counts(&without));
}

/// Images come behind what is owned, and this energy counts them.
#[test]
fn energies_that_do_not_support_parts_are_refused_on_periodic_sheets() {
    let text =
        "sheet = { shape = 'rectangle', periodic = 'x', width = 4.0, height = 2.0, vertices = 60 }
        material = { young = 1.0, poisson = 0.3, thickness = 0.1 }
        effect = [{ kind = 'stretching' }, { kind = 'test-unlisted' }]
        time.until = 1.0
        output.every = 1.0";
    let scene = Scene::parse(text, "periodic.toml", &[]).unwrap();
    let Err(error) = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())) else {
        panic!("it is taken")
    };
    let said = error.to_string();
    assert!(said.contains("the energy unlisted cannot be evaluated on a periodic sheet"), "{said}");
}
