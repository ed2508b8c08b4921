//! What a right scene becomes.

use rumple::Vec3;
use rumple::effects::Measure;
use rumple::model::{Policy, TensionReading};
use rumple::output::Compression;
use rumple::scene::{Direction, Initial, Scene, ShapeSpec, SheetSource};
use toml::Table;

use super::{SCENE, refused};

fn scene(text: &str) -> Scene {
    Scene::parse(text, "s.toml", &[]).unwrap_or_else(|e| panic!("{}", e.rendered(false)))
}

/// What is written out of a scene.
fn resolved(scene: &Scene) -> Table {
    scene.resolved().unwrap().parse().unwrap()
}

#[test]
fn a_scene_with_every_table() {
    let scene = scene(SCENE);
    let SheetSource::Generated(ShapeSpec::Disc(disc)) = &scene.sheet.source else {
        panic!("{:?}", scene.sheet)
    };
    assert_eq!((disc.radius.get(), disc.vertices.get(), disc.seed), (100.0, 20_000, 1));
    let bump = scene.sheet.bump.as_ref().unwrap();
    assert_eq!((bump.width.get(), bump.centre[1].get(), bump.direction), (3.0, 2.0, Direction::Z));
    assert_eq!(scene.material.as_ref().unwrap().drag, rumple::scene::DragSpec::default());
    let y = 1e6 * 0.5 / (1.0 - 1.0 / 9.0);
    let sheet = crate::common::lattice(2, 2);
    let material = rumple::run::material(&scene, &sheet).unwrap().unwrap().largest();
    assert!((material.stretching_modulus() / y - 1.0).abs() < 1e-15);
    assert!((material.bending_rigidity() / (y * 0.25 / 12.0) - 1.0).abs() < 1e-15);
    let names: Vec<_> = scene.effects.iter().map(|effect| effect.name()).collect();
    assert_eq!(names, ["spring 2", "weightless"]);
    let kinetics = &scene.kinetics[0];
    assert_eq!(kinetics.parameters["b"].uniform(), Some(100.0));
    assert_eq!((kinetics.location, kinetics.measure), (None, Measure::Concentration));
    assert_eq!(kinetics.tension, TensionReading::Trace);
    assert_eq!(scene.time.policy, Policy::Simultaneous);
    assert_eq!(scene.time.policy.name(), "simultaneous");
    let resolved = resolved(&scene);
    let integrator = &resolved["time"]["integrator"];
    assert_eq!(integrator["kind"].as_str(), Some("monolithic"));
    assert_eq!(integrator["rtol"].as_float(), Some(1e-3));
    assert_eq!(scene.time.span.until.get(), 500.0);
    assert_eq!(resolved["equilibrium"]["method"].as_str(), Some("descent"));
    assert_eq!(scene.output.fields, ["c", "mean_curvature"]);
    assert_eq!(scene.output.compression, Compression::None);
}

#[test]
fn resolved_reads_back_as_the_same_scene() {
    let initial = [
        "initial.a = { rectangle = { size = [1, 2], value = 3 } }",
        "initial.b = { stripe = { width = 0.1, value = 1e-99 } }",
        "initial.d = { spots = [{ width = 1, amplitude = 2 }, { width = 3, amplitude = -1 }] }",
        "initial.e = { random = { mean = 0.5, amplitude = 1 } }",
        "initial.f = { file = \"a b.vtu\", array = \"c\" }",
        "initial.\"odd. key\" = 1.7976931348623157e99",
    ];
    let text = SCENE.replacen("initial.m = 0.25", &initial.join("\n"), 1);
    for sheet in [
        "shape = \"disc\"\nradius = 100.0",
        "shape = \"rectangle\"\nwidth = 3\nheight = 0.1",
        "shape = \"lattice\"\nwidth = 3\nheight = 1",
        "shape = \"annulus\"\ninner = 1\nouter = 2",
        "shape = \"sphere\"\nradius = 1\nirregular = true",
        "shape = \"cylinder\"\nradius = 1\nheight = 2",
        "shape = \"cylinder\"\nradius = 1\nheight = 2\ncaps = true",
        "shape = \"cap\"\nradius = 3\nheight = 1",
        "shape = \"torus\"\nmajor = 3\nminor = 1",
        "shape = \"ellipsoid\"\nsemi_axes = [1.5, 1.2, 1.0]",
        "shape = \"wavy-strip\"\nwidth = 20\nheight = 8\namplitude = 1\nwavelength = 10",
        "shape = \"graph\"\nwidth = 6\nheight = 4\nz = \"0.1*x*y\"",
    ] {
        let first = scene(&text.replacen("shape = \"disc\"\nradius = 100.0", sheet, 1));
        let resolved = first.resolved().unwrap();
        let again = scene(&resolved);
        assert_eq!(again.resolved().unwrap(), resolved);
        assert_eq!(again.sheet, first.sheet);
        assert_eq!(again.material, first.material);
        assert_eq!(again.kinetics, first.kinetics);
        assert_eq!(again.output, first.output);
        assert_eq!(format!("{:?}", again.effects), format!("{:?}", first.effects));
        assert_eq!(format!("{:?}", again.time), format!("{:?}", first.time));
    }
    assert!(scene(SCENE).resolved().unwrap().contains("per-vertex = 1.0"));
}

#[test]
fn tables_that_may_be_absent() {
    let (head, tail) = SCENE.split_once("[kinetics]").unwrap();
    let tail = &tail[tail.find("[time]").unwrap()..tail.find("[output]").unwrap()];
    let scene = scene(&format!("{head}{tail}"));
    assert!(scene.kinetics.is_empty());
    assert_eq!((scene.output.every, scene.output.compression), (None, Compression::Zlib));
    assert!(!scene.resolved().unwrap().contains("kinetics"));
}

#[test]
fn paths_count_from_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let text = SCENE
        .replacen("shape = \"disc\"\nradius = 100.0\nvertices = 20000", "file = \"m/x.obj\"", 1)
        .replacen("\"curvature-feedback\"", "\"./libc.so\"", 1)
        .replacen("initial.m = 0.25", "initial.m = { file = \"c.vtu\", array = \"m\" }", 1);
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &[]).unwrap();
    let file = folder.path().join("m/x.obj");
    assert_eq!(scene.sheet.source, SheetSource::File { file });
    let kinetics = &scene.kinetics[0];
    assert_eq!(kinetics.plugin.as_deref(), folder.path().join("./libc.so").to_str());
    assert!(
        matches!(&kinetics.initial["m"], Initial::File(f) if f.file == folder.path().join("c.vtu"))
    );
    let overridden = Scene::load(&path, &["kinetics.plugin=by-name".to_owned()]).unwrap();
    assert_eq!(overridden.kinetics[0].plugin.as_deref(), Some("by-name"));
    let missing = Scene::load(&folder.path().join("b.toml"), &[]).unwrap_err();
    assert!(missing.to_string().contains("b.toml: cannot read the scene: "), "{missing}");
    std::fs::write(&path, [0xff, 0xfe, b'a']).unwrap();
    assert!(Scene::load(&path, &[]).unwrap_err().to_string().contains("UTF-8"));
}

/// The names under which a kind is read and written are given apart; they must be the same.
#[test]
fn what_the_engine_registers_reads_back() {
    let effects = [
        "kind = \"stretching\"",
        "kind = \"bending\"",
        "kind = \"pin\"\nwhere = \"rim\"\naxes = \"z\"",
        "kind = \"load\"\nwhere = \"rim\"\nforce = { total = [0, 0, 1] }",
        "kind = \"pressure\"\nvalue = 1.5",
        "kind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 1.0",
    ];
    let (head, rest) = SCENE.split_once("[[effect]]").unwrap();
    let rest = &rest[rest.find("[kinetics]").unwrap()..rest.find("[equilibrium]").unwrap()];
    let rest = rest.replacen("policy = \"simultaneous\"\n", "", 1);
    let integrator = "integrator = { kind = \"monolithic\", rtol = 1e-3 }\n";
    let rest = rest.replacen(integrator, "", 1);
    let listed: String = effects.iter().map(|e| format!("[[effect]]\n{e}\n")).collect();
    let first = scene(&format!("{head}{listed}{rest}"));
    assert_eq!(first.time.policy.name(), "quasi-static");
    let resolved = first.resolved().unwrap();
    for kind in ["stretching", "bending", "pin", "load", "pressure", "diffusion", "staggered"] {
        assert!(resolved.contains(&format!("kind = \"{kind}\"")), "{resolved}");
    }
    assert!(resolved.contains("policy = \"quasi-static\""), "{resolved}");
    assert!(resolved.contains("method = \"lbfgs\""), "{resolved}");
    assert_eq!(scene(&resolved).resolved().unwrap(), resolved);
}

#[test]
fn a_name_alone_stands_for_a_kind_without_parameters() {
    let descent = "method = \"descent\"";
    let text = SCENE.replacen(descent, &format!("{descent}\ntolerance = 1e-9"), 1);
    let equilibrium = &resolved(&scene(&text))["equilibrium"];
    assert_eq!(equilibrium["tolerance"].as_float(), Some(1e-9));
    let policy = "policy = \"simultaneous\"";
    let text = SCENE.replacen(policy, "policy = { kind = \"simultaneous\" }", 1);
    assert_eq!(scene(&text).time.policy, Policy::Simultaneous);
    let long = "integrator = { kind = \"monolithic\", rtol = 1e-3 }";
    let [name, table] = ["\"staggered\"", "{ kind = \"staggered\" }"]
        .map(|kind| resolved(&scene(&SCENE.replacen(long, &format!("integrator = {kind}"), 1))));
    assert_eq!(name["time"]["integrator"]["kind"].as_str(), Some("staggered"));
    assert_eq!(name, table);
    // As a person sees them who names one that there is not.
    let error = refused(&SCENE.replacen("\"test-spring\"", "\"none of them\"", 1), &[]);
    let (_, names) = error.advice().unwrap().split_once("allowed: ").unwrap();
    let names: Vec<&str> = names.split(", ").collect();
    assert!(names.contains(&"test-spring") && names.is_sorted(), "{names:?}");
}

#[test]
fn initial_fields_follow_their_formulas() {
    let start = |value: &str| {
        let text = SCENE.replacen("initial.m = 0.25", &format!("initial.m = {value}"), 1);
        scene(&text).kinetics[0].initial["m"].clone()
    };
    let x = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let points = [x(0.0, 0.0), x(2.0, 0.0), x(0.0, -2.0), x(5.0, 5.0)];
    let by_place = |i: usize| u32::try_from(i).unwrap();
    let values = |value: &str| start(value).values(&points, &by_place).unwrap();
    assert_eq!(values("3"), [3.0; 4]);
    let e = (-0.5f64).exp();
    let spot = "{ gaussian = { width = 2, amplitude = 4, background = 1 } }";
    let v = values(spot);
    assert_eq!(v[0], 5.0);
    assert!((v[1] - (1.0 + 4.0 * e)).abs() < 1e-15 && v[1] == v[2]);
    let two = "{ spots = [{ width = 2, amplitude = 1 }, { centre = [2, 0, 0], width = 2, amplitude = 1 }] }";
    let v = values(two);
    assert!((v[0] - (1.0 + e)).abs() < 1e-15 && v[0] == v[1]);
    assert_eq!(
        values("{ rectangle = { size = [4, 1], value = 2, background = -1 } }"),
        [2.0, 2.0, -1.0, -1.0]
    );
    assert_eq!(
        values("{ stripe = { normal = [0, 3, 0], width = 1, value = 1 } }"),
        [1.0, 1.0, 0.0, 0.0]
    );
    assert_eq!(values("{ stripe = { width = 1, value = 1 } }"), [1.0, 0.0, 1.0, 0.0]);
    let noise = "{ random = { mean = 10, amplitude = 1, seed = 3 } }";
    let v = values(noise);
    assert_eq!(v, values(noise));
    assert_ne!(v, values("{ random = { mean = 10, amplitude = 1, seed = 4 } }"));
    assert!(v.iter().all(|c| (9.0..11.0).contains(c)) && v[0] != v[1]);
    assert!(start("{ file = \"x.vtu\", array = \"c\" }").values(&points, &by_place).is_none());
}
