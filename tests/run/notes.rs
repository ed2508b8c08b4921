//! What is reported before a run, and that nothing is reported about shipped scenes.

use std::fs;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

use super::prepare;
use crate::plugins::build;

/// A load below the tolerance would be answered by nothing at all, without a word.
#[test]
fn a_load_that_the_tolerance_hardly_sees_is_told() {
    let gentle = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\n\
                  force = { per-vertex = [0.0, 0.0, 1e-3] }";
    let (_, simulation) = prepare(&[gentle]);
    let [note] = simulation.notes() else { panic!("{:?}", simulation.notes()) };
    assert!(note.contains("1.3e-9 Y"), "{note}");
    assert!(note.contains("1e-13: the default under gentle loads"), "{note}");
    let (_, simulation) = prepare(&[&gentle.replace("1e-3", "1e-5")]);
    assert!(simulation.notes()[0].contains("round-off of positions"), "{:?}", simulation.notes());
    let (_, simulation) = prepare(&[gentle, "equilibrium.tolerance=1e-6"]);
    assert!(simulation.notes()[0].contains("1e-6: the response"), "{:?}", simulation.notes());
    // A load near the usual tolerance, and one far above it.
    for (force, tolerance) in [("1e1", 1e-9), ("1e4", 1e-6)] {
        let (_, simulation) = prepare(&[&gentle.replace("1e-3", force)]);
        let found = simulation.force_tolerance();
        assert!((found / tolerance - 1.0).abs() < 1e-9, "{force}: {found:e}");
        let noted = simulation.notes().concat().contains("the default under gentle loads");
        assert_eq!(noted, found < 1e-6, "{:?}", simulation.notes());
    }
    for (effect, tolerance) in [
        (gentle.to_owned(), "equilibrium.tolerance=1e-13"),
        (gentle.replace("1e-3", "1e4"), "equilibrium.tolerance=1e-6"),
        ("[[effect]]\nkind = \"pressure\"\nvalue = 0.0".into(), "equilibrium.tolerance=1e-6"),
    ] {
        let (_, simulation) = prepare(&[&effect, tolerance]);
        assert!(simulation.notes().is_empty(), "{effect}: {:?}", simulation.notes());
    }
    let (_, simulation) = prepare(&["[[effect]]\nkind = \"pressure\"\nvalue = 1e-3"]);
    assert_eq!(simulation.notes().len(), 1);
}

#[test]
fn shipped_scenes_are_ready_to_run_without_a_word() {
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let mut count = 0;
    for folder in
        fs::read_dir(crate::common::root().join("models")).unwrap().map(|f| f.unwrap().path())
    {
        // The hard ones are run as such, some with meshes that are made for them.
        if folder.ends_with("hard") {
            continue;
        }
        for file in fs::read_dir(folder).into_iter().flatten().map(|f| f.unwrap().path()) {
            if file.extension().is_some_and(|e| e == "toml") {
                let scene = Scene::load(&file, &[]).unwrap_or_else(|e| panic!("{e}"));
                let simulation = Simulation::new(&scene, &search).unwrap_or_else(|e| panic!("{e}"));
                assert!(
                    simulation.notes().is_empty(),
                    "{}: {:?}",
                    file.display(),
                    simulation.notes()
                );
                count += 1;
            }
        }
    }
    assert!(count >= 5, "{count} scenes");
}

/// The guide called it free of stress; a half-sphere opened by itself, without a word.
#[test]
fn a_curved_shape_from_a_file_is_told_to_be_under_stress() {
    let folder = tempfile::tempdir().unwrap();
    let sphere = crate::common::icosphere(2, 10.0);
    let flat = crate::common::lattice(6, 6);
    for (name, sheet) in [("sphere", &sphere), ("flat", &flat)] {
        let mut file = fs::File::create(folder.path().join(name).with_extension("obj")).unwrap();
        rumple::sheet::write::mesh(sheet, rumple::sheet::write::MeshFormat::Obj, &mut file)
            .unwrap();
    }
    let notes = |mesh: &str, effects: &str| {
        let scene = format!(
            "effect = [{effects}]\nmaterial = {{ young = 1e4, poisson = 0.3, thickness = 0.2 }}\n\
             sheet.file = '{mesh}.obj'\ntime.until = 1.0\n"
        );
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let scene = Scene::load(&folder.path().join("scene.toml"), &[]).unwrap();
        let simulation = Simulation::new(&scene, &PluginSearch::in_directories(vec![])).unwrap();
        simulation.notes().join("\n")
    };
    let (stretching, bending) =
        ("{ kind = \"stretching\", model = \"stvk\" }", "{ kind = \"bending\" }");
    let both = format!("{stretching}, {bending}");
    let said = notes("sphere", &both);
    let stress = "warning: effect[1] (bending): the shape of sheet.file is not free of stress";
    assert!(said.contains(stress) && said.contains("angles of up to 2.00e-1 rad"), "{said}");
    assert_eq!(notes("sphere", stretching), "");
    assert_eq!(
        notes("sphere", &format!("{stretching}, {{ kind = 'bending', rest = 'mesh' }}")),
        ""
    );
    assert_eq!(notes("flat", &both), "");
    let out = std::process::Command::new(super::program())
        .current_dir(folder.path())
        .args(["check", "scene.toml", "--set", "sheet.file=sphere.obj"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(said.contains("\nwarning    effect[1] (bending): the shape of sheet.file"), "{said}");
}

/// What is reported about a scene, in one text.
fn reported(overrides: &[&str]) -> String {
    prepare(overrides).1.notes().join("\n")
}

#[test]
fn a_poisson_ratio_that_bonds_do_not_have_is_told() {
    let text = reported(&["material.poisson=0.3"]);
    assert!(text.contains("effect[0] (stretching)"), "{text}");
    assert!(text.contains("material.poisson = 0.3") && text.contains("stvk"), "{text}");
    assert_eq!(reported(&["material.poisson=0.33"]), "");
    assert_eq!(reported(&["material.poisson=0.3", "effect.stretching.model=stvk"]), "");
}

#[test]
fn a_history_that_cannot_be_checkpointed_is_told_by_check() {
    let folder = super::program::folder(super::SMALL);
    let key = "time.integrator={ kind = \"monolithic\" }";
    let out = rumple_test(folder.path(), &["check", "scene.toml", "--set", key]);
    let words =
        "the history of past steps cannot be checkpointed: it restarts from the state every 3000";
    assert!(out.contains(words), "{out}");
}

fn rumple_test(folder: &std::path::Path, args: &[&str]) -> String {
    let out = super::rumple(folder, args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

#[test]
fn a_default_drag_is_noted() {
    for policy in ["simultaneous", "chemistry-fast"] {
        let under = format!("time.policy=\"{policy}\"");
        let text = reported(&[&under]);
        assert!(text.contains(&format!("the policy {policy} moves")), "{text}");
        assert!(text.contains("it is 1 of every vertex"), "{text}");
        for drag in ["drag=1", "drag={per-area=64}", "drag.per-vertex=100"] {
            assert_eq!(reported(&[&under, &format!("material.{drag}")]), "");
        }
    }
    assert_eq!(reported(&["time.policy=\"quasi-static\""]), "");
}

#[test]
fn a_thick_sheet_is_told() {
    let text = reported(&["material.thickness=2.5"]);
    assert!(text.contains("material.thickness = 2.5 is 0.18 of"), "{text}");
    // A tenth of the radius is the limit.
    assert_eq!(reported(&["material.thickness=1.39"]), "");
    let strip = "sheet={shape=\"rectangle\", width=60, height=12, vertices=600}";
    assert!(reported(&[strip, "material.thickness=1.7"]).contains("the sheet's radius 15.1"));
    assert_eq!(reported(&[strip, "material.thickness=1.5"]), "");
    let sphere = "sheet={shape=\"sphere\", radius=10, vertices=642}";
    let text = reported(&[sphere, "effect.pin.where=all", "material.thickness=1.2"]);
    assert!(text.contains("the sheet's radius 10"), "{text}");
}

#[test]
fn a_tolerance_that_calls_any_sheet_at_rest_is_told() {
    let text = reported(&["equilibrium={method=\"lbfgs\", tolerance=1}"]);
    assert!(text.contains("equilibrium.tolerance = 1 "), "{text}");
    assert!(
        reported(&["equilibrium={method=\"newton\", tolerance=0.1}"]).contains("strains of 10 %")
    );
    assert_eq!(reported(&["equilibrium={method=\"lbfgs\", tolerance=1e-3}"]), "");
}

/// Folds passed through one another, without a word.
#[test]
fn adhesion_that_nothing_keeps_apart_is_told() {
    let adhesion = "[[effect]]\nkind = \"adhesion\"\nwork = 1.0\ndistance = 0.5";
    let on_plane = "\nto = { plane = { point = [0, 0, -5], normal = [0, 0, 1] } }";
    let plane = "[[effect]]\nkind = \"obstacle\"\nshape = { plane = { point = [0, 0, -5], normal = [0, 0, 1] } }";
    let contact = "[[effect]]\nkind = \"contact\"";
    let to_plane = format!("{adhesion}{on_plane}");
    let text = reported(&[adhesion]);
    assert!(
        text.contains("effect[3] (adhesion): it pulls the sheet to the sheet itself"),
        "{text}"
    );
    assert!(text.contains("list kind = \"contact\" as well"), "{text}");
    let text = reported(&[&to_plane, contact]);
    assert!(text.contains("pulls the sheet to a body, and nothing keeps them apart"), "{text}");
    assert!(text.contains("list kind = \"obstacle\" as well"), "{text}");
    assert_eq!(reported(&[adhesion, contact]), "");
    assert_eq!(reported(&[&to_plane, plane]), "");
}

#[test]
fn a_distance_of_contact_beyond_the_edges_is_told() {
    let contact = "[[effect]]\nkind = \"contact\"";
    assert_eq!(reported(&[contact]), "");
    // The area of a disc over that of 500 vertices' triangles: edges of about 0.8 at a radius of 8.
    let fine = "sheet={ shape=\"disc\", radius=8, vertices=500 }";
    assert_eq!(reported(&[contact, fine]), "");
    let text = reported(&[contact, fine, "material.thickness=0.795"]);
    assert!(text.contains("effect[3] (contact): the distance of contact"), "{text}");
    assert!(text.contains("is 0.795, above the median edge of 0.7"), "{text}");
    assert!(text.contains("less than 1.59 apart at rest touch at half"), "{text}");
    let near = "[[effect]]\nkind = \"contact\"\ndistance = 0.2";
    assert_eq!(reported(&[near, fine, "material.thickness=0.795"]), "");
}

/// D was 0, without a word.
#[test]
fn diffusion_without_a_coefficient_in_a_law_as_text_is_refused() {
    let diffusion = "[[effect]]\nkind = \"diffusion\"\nspecies = \"c\"";
    let text = super::SMALL.replace("# more effects", diffusion);
    let law = text
        .replace("plugin = \"curvature-feedback\"", "rates.c = \"-c\"")
        .replace("parameters = { c_star = 0.1, b = 20.0 }\n", "");
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let made = |text: &str| {
        let scene = Scene::parse(text, "scene.toml", &[]).unwrap_or_else(|e| panic!("{e}"));
        Simulation::new(&scene, &search).map(|s| s.notes().join("\n")).map_err(|e| e.to_string())
    };
    let error = made(&law).unwrap_err();
    assert!(error.contains("diffusion of c has no coefficient, and the law gives none"), "{error}");
    assert_eq!(
        made(&law.replace(diffusion, &format!("{diffusion}\ncoefficient = 0.0"))),
        Ok("".into())
    );
    // Nor has the plugin.
    assert!(made(&text).unwrap_err().contains("has no coefficient"));
}

/// What `check` says of the small scene with these keys, which it refuses.
fn refused(keys: &[&str]) -> String {
    let keys: Vec<String> = keys.iter().map(|o| (*o).to_owned()).collect();
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let scene = Scene::parse(super::SMALL, "scene.toml", &keys).unwrap_or_else(|e| panic!("{e}"));
    match Simulation::new(&scene, &search) {
        Ok(_) => panic!("{keys:?} is accepted"),
        Err(rumple::Error::Scene(error)) => error.rendered(false),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn a_field_listed_twice_is_refused() {
    let text = refused(&["output.fields=[\"c\", \"force\", \"c\"]"]);
    assert!(text.contains("output.fields[2]") && text.contains("listed twice"), "{text}");
}

/// An energy that overflows was a triangle without area.
#[test]
fn numbers_too_large_or_small_to_compute_with_are_named() {
    for (key, name) in [
        ("material.thickness=1e99", "material.thickness"),
        ("material.young=1e-100", "material.young"),
        ("material.thickness=1e-90", "material.thickness"),
        ("sheet.radius=1e60", "sheet"),
    ] {
        let text = refused(&[key]);
        assert!(text.contains(name) && text.contains("1e-100 and 1e100"), "{key}: {text}");
    }
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    for (effect, name) in [
        ("kind = \"pressure\"\nvalue = 1e100", "effect[3]: a force of "),
        (
            "kind = \"diffusion\"\nspecies = \"c\"\ncoefficient = \"1e90*1e90\"",
            "effect[3].coefficient: ",
        ),
        ("kind = \"growth\"\nfactor = 1e7", "the length factor of laws and growth together is 1"),
        ("kind = \"growth\"\nfactor = \"1e-90*1e-90\"", "the length factor "),
        (
            "kind = \"load\"\nwhere = \"all\"\nforce = { along-normal = 1 }\nramp = { formula = \"1e90*1e90\" }",
            "effect[3].ramp: the ramp is 9.99",
        ),
    ] {
        let text = super::SMALL.replace("# more effects", &format!("[[effect]]\n{effect}"));
        let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
        let Err(error) = Simulation::new(&scene, &search) else { panic!("{effect}") };
        assert!(error.to_string().contains(name), "{error}");
    }
}

/// The factor that decides is too large beyond 50 000 vertices.
#[test]
fn a_stability_that_is_not_judged_is_noted() {
    let noted =
        |vertices: &str| reported(&[vertices]).contains("stability of equilibria is not judged");
    assert!(noted("sheet.vertices=51000"));
    assert!(!noted("sheet.vertices=500"));
}

/// The stabilising drag is one of quasi-static shapes.
#[test]
fn stabilisation_under_another_policy_is_noted() {
    let (_, simulation) = prepare(&["time.policy=simultaneous", "time.stabilisation=0.1"]);
    let notes = simulation.notes().concat();
    assert!(
        notes.contains("time.stabilisation has no effect under the policy simultaneous"),
        "{notes}"
    );
}

/// What an inflow is counted per depends on the mesh where a part of space is thin, and is said; it is settled by its key.
#[test]
fn inflow_says_what_it_is_counted_per_where_the_mesh_decides() {
    let scene = |place: &str| {
        format!(
            "sheet = {{ shape = \"rectangle\", width = 4.0, height = 2.0, vertices = 600 }}\n\
             [[effect]]\nkind = \"flux\"\nspecies = \"c\"\nvalue = 1.0\n{place}\n\
             [kinetics]\nrates.c = \"0\"\ninitial.c = 0.0\n[time]\nuntil = 1.0\n"
        )
    };
    let notes =
        |place: &str, keys: &[&str]| crate::common::prepare(&scene(place), keys).1.notes().concat();
    let strip = "where = { box = { min = [-2, -1, 0], max = [-1.9, 1, 0] } }";
    let said = notes(strip, &[]);
    assert!(said.contains("per length") && said.contains("may be per area"), "{said}");
    let said = notes(strip, &["sheet.vertices=2400"]);
    assert!(said.contains("per area") && said.contains("may be per length"), "{said}");
    for settled in [
        &format!("{strip}\nper = \"length\""),
        "where = \"rim\"",
        "where = { half-space = { point = [0, 0, 0], normal = [1, 0, 0] } }",
        "where = { ball = { centre = [0, 0, 0], radius = 0.5 } }",
    ] {
        assert_eq!(notes(settled, &[]), "", "{settled}");
    }
}
