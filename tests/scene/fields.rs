//! Parameters that differ from place to place: what is accepted, and how wrong ones are answered.

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::sheet::Sheet;

use super::position;

const TEXT: &str = r#"
[sheet]
file = "FILE"

[material]
young = 2.0
poisson = 0.3
thickness = 0.5

[time]
until = 1.0

[[effect]]
kind = "stretching"
"#;

/// Writes a mesh of 3 × 3 with an array `h` at its points and `e` on its triangles.
pub(crate) fn written(folder: &std::path::Path) -> (Sheet, String) {
    let sheet = crate::common::lattice(3, 3);
    let array = |values: usize, of: &dyn Fn(usize) -> f64| {
        (0..values).map(|i| of(i).to_string()).collect::<Vec<_>>().join(" ")
    };
    let points: Vec<String> =
        sheet.rest().iter().map(|x| format!("{:e} {:e} {:e}", x.x, x.y, x.z)).collect();
    let cells: Vec<String> =
        sheet.triangles().iter().map(|[a, b, c]| format!("3 {a} {b} {c}")).collect();
    let (n, m) = (points.len(), cells.len());
    let text = format!(
        "# vtk DataFile Version 3.0\nfields\nASCII\nDATASET POLYDATA\nPOINTS {n} double\n{}\n\
         POLYGONS {m} {}\n{}\nCELL_DATA {m}\nSCALARS e double 1\nLOOKUP_TABLE default\n{}\n\
         POINT_DATA {n}\nSCALARS h double 1\nLOOKUP_TABLE default\n{}\n\
         SCALARS k%20[1/length] double 1\nLOOKUP_TABLE default\n{}\nVECTORS v double\n{}\n",
        points.join("\n"),
        4 * m,
        cells.join("\n"),
        array(m, &|t| 1.0 + 0.25 * t as f64),
        array(n, &|i| 0.5 + 0.125 * i as f64),
        array(n, &|i| 1.0 + i as f64),
        array(3 * n, &|i| i as f64),
    );
    let path = folder.join("mesh.vtk");
    std::fs::write(&path, text).unwrap();
    (sheet, path.to_str().unwrap().to_owned())
}

/// The simulation of the scene with `from` replaced by `to`.
fn built(file: &str, from: &str, to: &str) -> (String, Result<Simulation, rumple::Error>) {
    let text = TEXT.replace("FILE", file).replacen(from, to, 1);
    let scene = Scene::parse(&text, "s.toml", &[]).map_err(rumple::Error::from);
    let search = PluginSearch::in_directories(Vec::new());
    (text, scene.and_then(|scene| Simulation::new(&scene, &search)))
}

fn material(file: &str, key: &str) -> rumple::effects::MaterialField {
    let from = match key.split(' ').next() {
        Some("young") => "young = 2.0",
        Some("poisson") => "poisson = 0.3",
        _ => "thickness = 0.5",
    };
    let text = TEXT.replace("FILE", file).replacen(from, key, 1);
    let scene = Scene::parse(&text, "s.toml", &[]).unwrap();
    let read_back = Scene::parse(&scene.resolved().unwrap(), "r.toml", &[]).unwrap();
    assert_eq!(read_back.material, scene.material);
    let (sheet, _) =
        rumple::sheet::read::surface(std::path::Path::new(file)).unwrap().into_sheet().unwrap();
    rumple::run::material(&scene, &sheet).unwrap().unwrap()
}

#[test]
fn fields_are_read_at_the_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let (sheet, file) = written(folder.path());
    let centroid = |t: usize| {
        sheet.triangles()[t].map(|v| sheet.rest()[v as usize]).iter().sum::<rumple::Vec3>() / 3.0
    };
    let by_number = material(&file, "thickness = 0.5");
    assert!(by_number.is_uniform());
    let formula = material(&file, "thickness = \"1 + x\"").thickness;
    let arrays = material(&file, &format!("young = {{ file = \"{file}\", array = \"e\" }}")).young;
    let points =
        material(&file, &format!("thickness = {{ file = \"{file}\", array = \"h\" }}")).thickness;
    let ratio = material(&file, "poisson = \"0.1*x - 0.2\"").poisson;
    let regions = material(
        &file,
        "thickness = { default = 1.0, regions = [{ where = { half-space = { point = [1, 0, 0], normal = [1, 0, 0] } \
         }, value = 2.0 }, { where = { vertices = [0] }, value = 3.0 }] }",
    )
    .thickness;
    for (t, corners) in sheet.triangles().iter().enumerate() {
        let x = centroid(t).x;
        assert!((formula.at(t) - 1.0 - x).abs() < 1e-14);
        assert!((ratio.at(t) - 0.1 * x + 0.2).abs() < 1e-14);
        assert_eq!(arrays.at(t), 1.0 + 0.25 * t as f64);
        let mean = corners.iter().map(|v| 0.5 + 0.125 * f64::from(*v)).sum::<f64>() / 3.0;
        assert!((points.at(t) - mean).abs() < 1e-14);
        let expected = match (corners.contains(&0), x >= 1.0) {
            (true, _) => 3.0,
            (_, true) => 2.0,
            _ => 1.0,
        };
        assert_eq!(regions.at(t), expected, "triangle {t}");
    }
}

#[test]
fn wrong_fields_are_refused_at_their_key() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = written(folder.path());
    let array = |name: &str| format!("thickness = {{ file = \"{file}\", array = \"{name}\" }}");
    let odd = format!("{file}: no array `hh` with one number per triangle");
    let vector = format!("{file}: array `v` has 3 components, and a number per vertex is needed");
    for (to, message, help) in [
        (array("hh"), odd.as_str(), "its arrays there: e, h, k [1/length], v"),
        (
            "thickness = \"x - 1\"".into(),
            "it is -",
            "it must be a number above 0 at the rest position of every triangle",
        ),
        ("thickness = \"1 + xx\"".into(), "unknown name `xx`", "did you mean `x`?"),
        (
            "thickness = { default = 1.0, regions = [{ where = { vertices = [99] }, value = 2.0 }] }"
                .into(),
            "regions[0].where: vertex 99 does not exist",
            "vertices are numbered from 0",
        ),
        (
            "thickness = { default = 1.0, regions = [{ where = { ball = { centre = [50, 0, 0], radius = 1.0 } }, \
             value = 2.0 }] }"
                .into(),
            "regions[0].where: no triangle is chosen by this region",
            "it is the ball of radius 1 around (50, 0, 0); the sheet at rest has x from ",
        ),
        (
            array("v"),
            vector.as_str(),
            "an array of one component",
        ),
    ] {
        let (text, result) = built(&file, "thickness = 0.5", &to);
        let Err(rumple::Error::Scene(error)) = result else { panic!("{to}") };
        let start = format!("material.thickness: {message}");
        assert!(error.message().starts_with(&start), "{}\n{start}", error.message());
        assert!(error.advice().unwrap_or_default().starts_with(help), "{:?}", error.advice());
        let value = to.strip_prefix("thickness = ").unwrap();
        assert_eq!(error.position(), Some(position(&text, value)), "{to}");
    }
    for (to, message) in [
        ("thickness = { default = 1.0 }", "a field has both keys `default` and `regions`"),
        (
            "thickness = { default = -1.0, regions = [] }",
            "material.thickness.default must be a number above 0, not -1.0",
        ),
        (
            "thickness = { default = 1.0, regions = [{ where = \"all\", valu = 2.0 }] }",
            "unknown key valu in material.thickness.regions[0]",
        ),
    ] {
        let (_, result) = built(&file, "thickness = 0.5", to);
        let Err(rumple::Error::Scene(error)) = result else { panic!("{to}") };
        assert!(error.message().contains(message), "{}", error.message());
    }
    assert!(built(&file, "thickness = 0.5", &array("h")).1.is_ok());
    // The unit of a frame's array may be left out.
    assert!(built(&file, "thickness = 0.5", &array("k")).1.is_ok());
    let (_, result) = built(&file, "thickness = 0.5", "thickness = { formula = \"1 + x\" }");
    let Err(rumple::Error::Scene(error)) = result else { panic!("a table") };
    assert_eq!(error.message(), "unknown key formula in [material.thickness]");
    let help = error.advice().unwrap();
    assert!(
        help.starts_with("a formula is written as a string, without a table around it"),
        "{help}"
    );
}

#[test]
fn wrong_ratios_loads_and_growth_are_refused_at_their_key() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = written(folder.path());
    let effect = |table: &str| format!("{table}\n\n[[effect]]\nkind = \"stretching\"\n");
    let stretching = "kind = \"stretching\"\n";
    let load = "kind = \"load\"\nwhere = \"all\"\nforce = { per-area = [0, 0, \"exp(1000 + x)\"] }";
    let growth = |field: &str| format!("kind = \"growth\"\nfactor = {field}");
    let regions = "{ default = 1.0, regions = [{ where = \"rim\", value = -1.0 }] }";
    let array = format!("{{ file = \"{file}\", array = \"e\" }}");
    let fibre = |array: &str| {
        format!(
            "kind = \"growth\"\nalong = 2\nfibre = {{ file = \"{file}\", array = \"{array}\" }}"
        )
    };
    let scalar = |array: &str| {
        format!("effect[0].fibre: {file}: array `{array}` has 1 component, and a fibre needs 3")
    };
    for (from, to, message) in [
        ("poisson = 0.3", "poisson = \"x\"".to_owned(), "material.poisson: it is "),
        ("poisson = 0.3", "poisson = 0.7".to_owned(), "material.poisson must be a number above -1"),
        (stretching, effect(load), "effect[0].force: it is "),
        (stretching, effect(&growth(regions)), "effect[0].factor: the length factor is "),
        (stretching, effect(&growth("\"1 + u\"")), "effect[0].factor: unknown name `u`"),
        (stretching, effect(&growth(&array)), "effect[0].factor: "),
        (stretching, effect(&fibre("h")), scalar("h").as_str()),
        (stretching, effect(&fibre("k")), scalar("k [1/length]").as_str()),
    ] {
        let (_, result) = built(&file, from, &to);
        let Err(rumple::Error::Scene(error)) = result else { panic!("{to}") };
        assert!(error.message().starts_with(message), "{to}: {}", error.message());
    }
    let points = format!("{{ file = \"{file}\", array = \"h\" }}");
    for good in [
        growth(&points),
        growth("{ default = 1.0, regions = [{ where = \"rim\", value = 1.5 }] }"),
        growth("1.25"),
        "kind = \"load\"\nwhere = \"all\"\nforce = { per-vertex = [0, \"x\", 1] }".to_owned(),
        format!("kind = \"load\"\nwhere = \"all\"\nforce = {{ along-normal = {array} }}"),
    ] {
        let (text, result) = built(&file, stretching, &effect(&good));
        assert!(result.is_ok(), "{good}: {}", result.err().unwrap());
        let scene = Scene::parse(&text, "s.toml", &[]).unwrap();
        let again = Scene::parse(&scene.resolved().unwrap(), "r.toml", &[]).unwrap();
        assert_eq!(again.resolved().unwrap(), scene.resolved().unwrap());
    }
}

#[test]
fn wrong_drags_and_foundations_are_refused_at_their_key() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = written(folder.path());
    let foundation = "kind = \"foundation\"\nwhere = \"all\"\nstiffness = \"1 - x\"\n\n[[effect]]\nkind = \"stretching\"\n";
    for (from, to, needle, message) in [
        (
            "thickness = 0.5",
            "thickness = 0.5\ndrag = \"x - 1\"",
            "\"x - 1\"",
            "material.drag: it is -1 at vertex 0 (0, 0, 0)",
        ),
        (
            "thickness = 0.5",
            "thickness = 0.5\ndrag = { per-area = { normal = 1.0 } }",
            "{ normal",
            "missing key tangential in [material.drag.per-area]",
        ),
        (
            "kind = \"stretching\"\n",
            foundation,
            "\"1 - x\"",
            "effect[0].stiffness: it is 0 at vertex 1 (1, 0, 0)",
        ),
    ] {
        let (text, result) = built(&file, from, to);
        let Err(rumple::Error::Scene(error)) = result else { panic!("{to}") };
        assert_eq!(error.message(), message);
        assert_eq!(error.position(), Some(position(&text, needle)), "{to}");
    }
}

#[test]
fn wrong_coefficients_of_diffusion_are_refused_at_their_key() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = written(folder.path());
    let with = |keys: &str, coefficient: &str| {
        let effect = format!(
            "kind = \"diffusion\"\nspecies = \"c\"\ncoefficient = {coefficient}\n\n[kinetics]\nrates.c = \"0\"\n{keys}\n"
        );
        built(&file, "kind = \"stretching\"\n", &effect)
    };
    assert!(with("", "\"1 + x\"").1.is_ok());
    assert!(with("", &format!("{{ file = \"{file}\", array = \"e\" }}")).1.is_ok());
    let face = "location = \"face\"";
    for (keys, coefficient, message) in [
        ("", "\"x - 9\"", "effect[0].coefficient: it is -"),
        (face, "\"1 + x\"", "effect[0].coefficient: the Green-Gauss scheme has one coefficient"),
        ("", "-1.0", "effect[0].coefficient must be a number from 0, not -1.0"),
    ] {
        let (text, result) = with(keys, coefficient);
        let Err(rumple::Error::Scene(error)) = result else { panic!("{coefficient}") };
        assert!(error.message().starts_with(message), "{}", error.message());
        assert_eq!(error.position(), Some(position(&text, coefficient)), "{coefficient}");
    }
}
