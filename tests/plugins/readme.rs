//! The law of README.md as a plugin and as a formula.

use std::fs;

use super::build::rust_library;
use crate::common::prepare;

/// The `number`th block of README.md in this language.
fn block(language: &str, number: usize) -> String {
    let text = crate::common::shipped("README.md");
    let after = text.split(&format!("```{language}\n")).nth(number + 1).unwrap();
    after.split("```").next().unwrap().to_owned()
}

#[test]
fn the_law_of_the_readme_bends_its_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("law.rs");
    fs::write(&source, block("rust", 0)).unwrap();
    let library = rust_library(source.to_str().unwrap(), "readme_law", &[]);
    let scene = block("toml", 0);
    let plugin = scene.replace("curvature-feedback", library.to_str().unwrap());
    let (sheet, _) = scene.split_once("[kinetics]").unwrap();
    let bending = [plugin, format!("{sheet}{}", block("toml", 1))].map(|scene| {
        let keys = ["sheet.vertices=500", "time.until=0.25"];
        let (_, mut simulation) = prepare(&scene, &keys);
        simulation.prepare().unwrap();
        let before = simulation.evaluate().energies().unwrap()[1];
        while simulation.state().time < 0.25 {
            simulation.step(0.25).unwrap();
        }
        let after = simulation.evaluate().energies().unwrap()[1];
        assert!(after > 1.2 * before, "{before:e} {after:e}");
        after
    });
    assert!((bending[0] / bending[1] - 1.0).abs() < 1e-2, "{bending:?}");
}
