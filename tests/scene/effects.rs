//! Effects of the engine in scenes: options that belong to another model, regions, loads.

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

use super::{position, refused};

const HEAD: &str = r#"
[sheet]
shape = "rectangle"
width = 4.0
height = 3.0
vertices = 60

[material]
young = 1.0
poisson = 0.3
thickness = 0.1

[time]
until = 1.0

[[effect]]
kind = "stretching"
model = "stvk"

[[effect]]
"#;

fn build(effect: &str) -> Result<Simulation, rumple::Error> {
    let scene = Scene::parse(&format!("{HEAD}{effect}\n"), "s.toml", &[])?;
    Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))
}

/// Refused once the sheet is known: message, help, and the first `needle` as the place.
fn wrong(effect: &str, needle: &str, message: &str, help: &str) {
    let text = format!("{HEAD}{effect}\n");
    let Err(rumple::Error::Scene(error)) = build(effect) else { panic!("{effect}") };
    assert_eq!(error.message(), message);
    let needle = &text[text.rfind(needle).unwrap()..];
    assert_eq!(error.position(), Some(position(&text, needle)), "{effect}");
    assert_eq!(error.advice(), Some(help), "{effect}");
}

#[test]
fn every_model_and_load_is_accepted() {
    for effect in [
        "kind = \"bending\"\nmodel = \"hinge\"",
        "kind = \"bending\"\nrest = \"mesh\"\ncurvature = 0.1",
        "kind = \"bending\"\nmodel = \"hinge\"\ncurvature = \"0.1*x\"",
        "kind = \"stretching\"\nmodel = \"stvk\"\nmodulus = \"plate\"",
        "kind = \"pressure\"\nvalue = -2",
        "kind = \"load\"\nwhere = \"all\"\nforce = { total = [0, 0, 1] }",
        "kind = \"load\"\nwhere = { vertices = [1, 2] }\nforce = { per-vertex = [0, 0, 1] }",
        "kind = \"load\"\nwhere = \"rim\"\nforce = { per-length = [0, 0, 1] }",
        "kind = \"load\"\nwhere = \"all\"\nforce = { per-area = [0, 0, 1] }",
        "kind = \"load\"\nwhere = \"all\"\nforce = { along-normal = 1 }",
        "kind = \"pin\"\naxes = \"xyz\"\nwhere = { half-space = { normal = [1, 0, 0] } }",
        "kind = \"pin\"\naxes = \"xyz\"\nwhere = { all-of = [\"rim\", { ring = { inner = 0, outer \
         = 9 } }] }",
    ] {
        let mut simulation = build(effect).unwrap_or_else(|e| panic!("{effect}: {e}"));
        assert!(simulation.evaluate().potential().unwrap().force_scale() > 0.0);
        let scene = Scene::parse(&format!("{HEAD}{effect}\n"), "s.toml", &[]).unwrap();
        let resolved = scene.resolved().unwrap();
        let again = Scene::parse(&resolved, "r.toml", &[]).unwrap();
        assert_eq!(again.resolved().unwrap(), resolved, "{effect}");
        assert_eq!(format!("{:?}", again.effects), format!("{:?}", scene.effects), "{effect}");
    }
}

#[test]
fn a_ramp_of_a_body_without_a_displacement_is_refused() {
    let plane = "{ plane = { normal = [0, 0, 1], point = [0, 0, -1] } }";
    let ramp = "ramp = { formula = \"t\" }";
    let message = "effect[1].ramp: a ramp without a displacement moves nothing";
    let help = "as in displacement = [0, 0, 1.5]: where the body is when the ramp is 1";
    let place = "{ formula = \"t\" }";
    wrong(&format!("kind = \"obstacle\"\nshape = {plane}\n{ramp}"), place, message, help);
    let adhesion = format!("kind = \"adhesion\"\nwork = 1.0\ndistance = 0.1\nto = {plane}");
    wrong(&format!("{adhesion}\n{ramp}"), place, message, help);
    let moved = "displacement = [0, 0, 1]";
    build(&format!("kind = \"obstacle\"\nshape = {plane}\n{moved}\n{ramp}")).unwrap();
}

#[test]
fn the_boundary_has_two_names() {
    let resolved = |word: &str| {
        let text = format!("{HEAD}kind = \"pin\"\naxes = \"z\"\nwhere = \"{word}\"\n");
        Scene::parse(&text, "s.toml", &[]).unwrap().resolved().unwrap()
    };
    assert_eq!(resolved("boundary"), resolved("rim"));
}

#[test]
fn options_of_another_model_are_refused() {
    wrong(
        "kind = \"stretching\"\nmodel = \"stvk\"\nweight = \"paper\"",
        "\"paper\"",
        "effect[1].weight: model = \"stvk\" has no weight: it is a constant-strain triangle, \
         not a bond",
        "leave weight out, or choose model = \"bond\"",
    );
    wrong(
        "kind = \"stretching\"\nmodulus = \"plate\"",
        "\"plate\"",
        "effect[1].modulus: model = \"bond\" has no modulus: it always has Y = E h/(1-ν²)",
        "leave modulus out, or choose model = \"stvk\"",
    );
    for (key, value) in [("weight", "\"area\""), ("area", "\"barycentric\"")] {
        wrong(
            &format!("kind = \"bending\"\nmodel = \"hinge\"\n{key} = {value}"),
            value,
            &format!(
                "effect[1].{key}: model = \"hinge\" has no {key}: it weights its edges by \
                 optimal lengths and areas"
            ),
            &format!("leave {key} out, or choose model = \"meyer\""),
        );
    }
}

#[test]
fn regions_that_choose_nothing_or_make_no_sense() {
    let force = "force = { total = [0, 0, 1] }";
    let load = |region: &str| format!("kind = \"load\"\n{force}\nwhere = {region}");
    for (region, is) in [
        (
            "{ ball = { centre = [99, 0, 0], radius = 1 } }",
            "the ball of radius 1 around (99, 0, 0)",
        ),
        (
            "{ box = { min = [50, 0, 0], max = [60, 1, 0.5] } }",
            "the box from (50, 0, 0) to (60, 1, 0.5)",
        ),
        (
            "{ half-space = { point = [99, 0, 0], normal = [1, 0, 0] } }",
            "the half-space from (99, 0, 0) on along (1, 0, 0)",
        ),
        (
            "{ all-of = [\"rim\", { ring = { inner = 98, outer = 99 } }] }",
            "what these have in common: the boundary; the ring from 98 to 99 around the axis through (0, 0, 0) \
             along (0, 0, 1)",
        ),
    ] {
        let Err(rumple::Error::Scene(error)) = build(&load(region)) else { panic!("{region}") };
        assert_eq!(error.message(), "effect[1].where: no vertex is chosen by this load");
        let start = format!("it is {is}; the sheet at rest has x from -");
        let help = error.advice().unwrap();
        assert!(help.starts_with(&start) && help.contains(", z from "), "{help}");
    }
    let region = "{ vertices = [0, 4000] }";
    let n = build("kind = \"bending\"").unwrap().sheet().vertex_count();
    let message = format!("effect[1].where: vertex 4000 does not exist: the sheet has {n}");
    wrong(&load(region), region, &message, "vertices are numbered from 0");
    let region = "{ half-space = { normal = [0, 0, 0] } }";
    let message = "effect[1].where: the normal must be a nonzero vector";
    wrong(&load(region), region, message, "for example [0, 0, 1]");
    let region = "{ all-of = [\"rim\", { ring = { inner = 2, outer = 1 } }] }";
    let message = "effect[1].where: the ring's inner = 2 is above outer = 1";
    wrong(&load(region), region, message, "inner and outer are distances from the axis");
    wrong(
        "kind = \"load\"\nforce = { per-length = [0, 0, 1] }\nwhere = { vertices = [0] }",
        "{ vertices",
        "effect[1].where: no boundary edge has both ends in the region of this load",
        "a force per length acts on the boundary; for a force on single vertices use total or \
         per-vertex",
    );
}

#[test]
fn misspelt_kinds_models_and_forces_are_answered_with_the_nearest() {
    let refusal = |effect: &str| refused(&format!("{HEAD}{effect}\n"), &[]);
    let error = refusal("kind = \"presure\"\nvalue = 1");
    assert_eq!(error.message(), "effect[1]: unknown effect \"presure\"");
    assert!(error.advice().unwrap().starts_with("did you mean pressure? allowed: "));
    let error = refusal("kind = \"lod\"");
    assert!(error.advice().unwrap().starts_with("did you mean load? "), "{:?}", error.advice());
    let error = refusal("kind = \"bending\"\nmodel = \"hinges\"");
    assert_eq!(error.message(), "effect[1].model: unknown name \"hinges\"");
    assert_eq!(error.advice(), Some("did you mean hinge? allowed: meyer, hinge"));
    let error = refusal("kind = \"stretching\"\nmodel = \"stkv\"");
    assert_eq!(error.advice(), Some("did you mean stvk? allowed: bond, stvk"));
    let error = refusal("kind = \"stretching\"\nwight = \"paper\"");
    assert_eq!(error.advice(), Some("did you mean weight? allowed: kind, model, weight, modulus"));
    let error = refusal("kind = \"load\"\nwhere = \"rim\"\nforce = { per-lenth = [0, 0, 1] }");
    assert_eq!(error.message(), "effect[1].force: unknown name \"per-lenth\"");
    assert!(error.advice().unwrap().starts_with("did you mean per-length? "));
    let error = refusal("kind = \"load\"\nwhere = \"rim\"\nforce = { total = [0, nan, 1] }");
    assert_eq!(error.message(), "effect[1].force.total[1] must be a finite number, not NaN");
    let error = refusal("kind = \"pressure\"\nvalue = inf");
    assert_eq!(error.message(), "effect[1].value must be a finite number, not inf");
    let error = refusal("kind = \"pressure\"");
    assert_eq!(error.message(), "missing key value in effect[1]");
}

#[test]
fn rest_shapes_are_refused_where_they_do_not_fit() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, sheet: &rumple::sheet::Sheet| {
        let path = folder.path().join(name);
        let mut file = std::fs::File::create(&path).unwrap();
        rumple::sheet::write::mesh(sheet, rumple::sheet::write::MeshFormat::Obj, &mut file)
            .unwrap();
        path.to_str().unwrap().to_owned()
    };
    let help = "a state is a file of the same mesh with other positions, as a frame of a run is";
    let path = written("other.obj", &crate::common::lattice(3, 3));
    let vertices = crate::common::lattice(3, 3).vertex_count();
    let here = build("kind = \"bending\"").unwrap().sheet().vertex_count();
    wrong(
        &format!("kind = \"bending\"\nrest = {{ state = \"{path}\" }}"),
        "{ state",
        &format!("effect[1].rest: {path}: it has {vertices} vertices, and the sheet has {here}"),
        help,
    );
    let Err(rumple::Error::Scene(error)) =
        build("kind = \"bending\"\nrest = { state = \"missing.obj\" }")
    else {
        panic!("a file that does not exist")
    };
    assert!(error.message().contains("missing.obj"), "{}", error.message());
    for key in ["rest = \"mesh\"", "curvature = 0.125"] {
        let name = key.split(' ').next().unwrap();
        wrong(
            &format!("kind = \"bending\"\nweight = \"paper\"\n{key}"),
            key.split("= ").nth(1).unwrap(),
            &format!(
                "effect[1].{name}: weight = \"paper\" is the sum as printed, of a sheet that rests in the plane"
            ),
            &format!("leave {name} out, or choose weight = \"area\""),
        );
    }
    wrong(
        "kind = \"bending\"\ncurvature = \"exp(1000 + x)\"",
        "\"exp(",
        &{
            let x = build("kind = \"bending\"").unwrap().sheet().rest()[0];
            format!("effect[1].curvature: it is inf at vertex 0 ({}, {}, {})", x.x, x.y, x.z)
        },
        "it must be a finite number at the rest position of every vertex",
    );
    for (text, needle) in [
        ("kind = \"bending\"\nrest = \"plane\"", "\"plane\""),
        ("kind = \"bending\"\ncurvature = true", "true"),
    ] {
        let text = format!("{HEAD}{text}\n");
        let error = refused(&text, &[]);
        assert_eq!(error.position(), Some(position(&text, needle)), "{}", error.message());
    }
}
