//! What is told before a run, and that shipped scenes need no telling.

use std::fs;

use rumple::kinetics::Search;
use rumple::scene::Scene;
use rumple::simulation;

use super::prepare;
use crate::plugins::build;

/// A load below the tolerance would be answered by nothing at all, without a word.
#[test]
fn a_load_that_the_tolerance_hardly_sees_is_told() {
    let gentle = "[[effect]]\nkind = \"load\"\nwhere = \"all\"\n\
                  force = { per-vertex = [0.0, 0.0, 1e-3] }";
    let (_, setup) = prepare(&[gentle]);
    let [note] = &setup.notes[..] else { panic!("{:?}", setup.notes) };
    assert!(note.contains("1.3e-9 Y"), "{note}");
    assert!(note.contains("equilibrium.tolerance = 1e-6") && note.contains("1e-13"), "{note}");
    for (effect, tolerance) in [
        (gentle.to_owned(), "equilibrium.tolerance=1e-13"),
        (gentle.replace("1e-3", "1e4"), "equilibrium.tolerance=1e-6"),
        ("[[effect]]\nkind = \"pressure\"\nvalue = 0.0".into(), "equilibrium.tolerance=1e-6"),
    ] {
        let (_, setup) = prepare(&[&effect, tolerance]);
        assert!(setup.notes.is_empty(), "{effect}: {:?}", setup.notes);
    }
    let (_, setup) = prepare(&["[[effect]]\nkind = \"pressure\"\nvalue = 1e-3"]);
    assert_eq!(setup.notes.len(), 1);
}

#[test]
fn what_the_author_may_not_have_meant_is_told() {
    let on_the_rim = "[[effect]]\nkind = \"load\"\nwhere = \"rim\"\nforce = { per-vertex = ";
    let (_, setup) = prepare(&[&format!("{on_the_rim}[0.0, 0.0, 1e5] }}")]);
    assert!(setup.notes[0].contains("(load) acts only where pins hold"), "{:?}", setup.notes);
    let (_, setup) = prepare(&[&format!("{on_the_rim}[1e5, 0.0, 0.0] }}")]);
    assert!(setup.notes.is_empty(), "{:?}", setup.notes);
    let (_, setup) = prepare(&["[[effect]]\nkind = \"bending\"\nmodel = \"hinge\""]);
    assert!(setup.notes[0].contains("bending more than once"), "{:?}", setup.notes);
}

#[test]
fn shipped_scenes_are_ready_to_run_without_a_word() {
    let search = Search::in_directories(vec![build::directory().to_owned()]);
    let mut count = 0;
    for folder in fs::read_dir("models").unwrap().map(|f| f.unwrap().path()) {
        for file in fs::read_dir(folder).into_iter().flatten().map(|f| f.unwrap().path()) {
            if file.extension().is_some_and(|e| e == "toml") {
                let scene = Scene::load(&file, &[]).unwrap_or_else(|e| panic!("{e}"));
                let setup = simulation::prepare(&scene, &search).unwrap_or_else(|e| panic!("{e}"));
                assert!(setup.notes.is_empty(), "{}: {:?}", file.display(), setup.notes);
                count += 1;
            }
        }
    }
    assert!(count >= 5, "{count} scenes");
}
