//! What cannot be in a plane is refused at its key, in a file of an outside effect too.

use rumple::effects::{
    BlockMatrix, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, HessianPart,
    Needs,
};
use rumple::geometry::Shape;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::{Simulation, Vec3, kit, register_kind};
use serde::{Deserialize, Serialize};

use super::{STRIP, with};
use crate::plugins::build;

/// A force along z of an outside crate, which declares it or not.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Lift {
    #[serde(default)]
    declared: bool,
}

#[typetag::serialize(name = "test-lift")]
impl EffectSpec for Lift {
    fn name(&self) -> String {
        "lift".to_owned()
    }

    fn needs(&self) -> Needs {
        Needs { out_of_plane: self.declared.then_some("declared"), ..Needs::default() }
    }

    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::energy(Weight))
    }
}
register_kind!(dyn EffectSpec, "test-lift", Lift);

struct Weight;

impl Energy for Weight {
    type Work = ();

    fn name(&self) -> &'static str {
        "lift"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        if let Some(gradient) = gradient {
            gradient.iter_mut().for_each(|g| g.z -= 1.0);
        }
        -shape.x.iter().map(|x| x.z).sum::<f64>()
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), _: HessianPart, _: &mut BlockMatrix) {}
}

/// The error of a planar scene.
fn refused(text: &str, overrides: &[&str]) -> rumple::scene::SceneError {
    let text = text.replacen("[sheet]", "[sheet]\nplanar = true", 1);
    let keys: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let made = Scene::parse(&text, "scene.toml", &keys).map_err(rumple::Error::from);
    match made.and_then(|scene| Simulation::new(&scene, &search)) {
        Ok(_) => panic!("accepted: {text}{overrides:?}"),
        Err(rumple::Error::Scene(error)) => error,
        Err(error) => panic!("no error of the scene: {error}"),
    }
}

#[test]
fn effects_that_act_along_z_are_refused_at_their_key() {
    let normal = "{ plane = { normal = [1, 0, 1] } }";
    for (effect, key) in [
        ("kind = \"bending\"", "kind"),
        ("kind = \"bending\"\nmodel = \"hinge\"", "kind"),
        ("kind = \"pressure\"\nvalue = 1.0", "kind"),
        ("kind = \"volume\"\nstiffness = 1.0", "kind"),
        ("kind = \"load\"\nwhere = \"all\"\nforce = { total = [1, 0, 1e-9] }", "force"),
        ("kind = \"load\"\nwhere = \"all\"\nforce = { per-vertex = [0, 0, 1] }", "force"),
        ("kind = \"load\"\nwhere = \"rim\"\nforce = { per-length = [0, 0, -1] }", "force"),
        ("kind = \"load\"\nwhere = \"all\"\nforce = { per-area = [0, 0, 1] }", "force"),
        ("kind = \"load\"\nwhere = \"all\"\nforce = { along-normal = 1 }", "force"),
        ("kind = \"pin\"\nwhere = \"rim\"\naxes = \"z\"", "axes"),
        ("kind = \"pin\"\nwhere = \"rim\"\naxes = \"xyz\"", "axes"),
        (&format!("kind = \"foundation\"\nwhere = \"all\"\nstiffness = 1\nto = {normal}"), "to"),
        ("kind = \"test-lift\"\ndeclared = true", "declared"),
    ] {
        let text = STRIP.replace("# more effects", &format!("[[effect]]\n{effect}\n"));
        let error = refused(&text, &[]);
        assert!(error.message().starts_with(&format!("effect[5].{key}: ")), "{effect}: {error}");
        let planar = text.replacen("[sheet]", "[sheet]\nplanar = true", 1);
        let (line, _) = error.position().unwrap();
        let there = planar.lines().nth(line - 1).unwrap();
        assert!(there.starts_with(key), "{effect}: line {line} is {there}");
    }
    let normal = "{ plane = { normal = [1, 1, 0] } }";
    for effect in [
        "kind = \"pin\"\nwhere = { vertices = [0] }\naxes = \"xy\"",
        &format!("kind = \"foundation\"\nwhere = \"all\"\nstiffness = 1\nto = {normal}"),
        "kind = \"growth\"\nfactor = \"1 + 0.1*x*t\"",
    ] {
        let text = STRIP.replace("# more effects", &format!("[[effect]]\n{effect}\n"));
        assert!(with(&text, true, &[]).notes().is_empty(), "{effect}");
    }
}

/// What an outside effect does not declare is found by the kit, and reported before a run.
#[test]
fn forces_out_of_the_plane_that_are_not_declared_are_found() {
    let text = STRIP.replace("# more effects", "[[effect]]\nkind = \"test-lift\"\n");
    let simulation = with(&text, true, &[]);
    let [note] = simulation.notes() else { panic!("{:?}", simulation.notes()) };
    assert!(note.contains("lift") && note.contains("vertex 0"), "{note}");
    for (declared, faulty) in [(true, false), (false, true)] {
        let sheet = std::sync::Arc::clone(simulation.sheet());
        let report = kit::examine(&Lift { declared }, &sheet, None).unwrap();
        let found = report.faults.iter().any(|fault| fault.contains("out_of_plane"));
        assert_eq!(found, faulty, "{:?}", report.faults);
        assert!(found || report.faults.is_empty(), "{:?}", report.faults);
    }
}

#[test]
fn sheets_and_starts_that_leave_the_plane_are_refused() {
    let key = |overrides: &[&str], key: &str| {
        let error = refused(STRIP, overrides);
        assert!(error.message().starts_with(&format!("sheet.{key}")), "{overrides:?}: {error}");
        error
    };
    let shape =
        |shape: &str| STRIP.replace("shape = \"rectangle\"\nwidth = 10.0\nheight = 6.0", shape);
    for other in
        ["shape = \"sphere\"\nradius = 3.0", "shape = \"cylinder\"\nradius = 3.0\nheight = 6.0"]
    {
        let error = refused(&shape(other), &[]);
        assert!(error.message().starts_with("sheet.planar"), "{error}");
        assert_eq!(error.position().map(|(line, _)| line), Some(3));
    }
    let point = "[sheet]\nshape = \"point\"\n[kinetics]\nplugin = \"brusselator\"\n\
                 initial = { u = 1.0, v = 1.0 }\n[time]\nuntil = 1.0\n";
    assert!(refused(point, &[]).message().starts_with("sheet.planar"));
    key(&["sheet.imperfection={amplitude=1e-3}"], "imperfection");
    key(&["sheet.bump={amplitude=0.1,width=1.0,direction=\"normal\"}"], "bump");
    key(&["sheet.planar=1"], "planar");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ridge.obj");
    let ridge = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1e-9\nf 1 2 3\nf 2 4 3\n";
    std::fs::write(&file, ridge).unwrap();
    let bent = STRIP.replace(
        "shape = \"rectangle\"\nwidth = 10.0\nheight = 6.0\nvertices = 120",
        &format!("file = '{}'", file.display()),
    );
    let error = refused(&bent, &[]);
    assert!(error.message().starts_with("sheet.planar"), "{error}");
    assert!(error.message().contains("vertex 3"), "{error}");
    let misspelt = refused(STRIP, &["sheet.planer=true"]);
    assert!(misspelt.advice().unwrap().contains("planar"), "{:?}", misspelt.advice());
}

/// The resolved scene says it, and reads back as the same.
#[test]
fn a_resolved_scene_stays_planar() {
    let text = STRIP.replacen("[sheet]", "[sheet]\nplanar = true", 1);
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let resolved = scene.resolved().unwrap();
    assert!(resolved.contains("planar = true"), "{resolved}");
    assert!(Scene::parse(&resolved, "resolved.toml", &[]).unwrap().sheet.planar);
    let usual = Scene::parse(STRIP, "scene.toml", &[]).unwrap().resolved().unwrap();
    assert!(!usual.contains("planar"), "{usual}");
}
