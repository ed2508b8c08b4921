//! Studies whose files are damaged, or that have little to say.

use std::fs;

use super::{DECAY, GROWING, again, errors, study, table, text};
use crate::run::program::rumple;

#[test]
fn runs_whose_files_are_damaged_are_made_again() {
    let arguments = ["--tolerances", "1e-1,1e-2"];
    let (folder, out) = study(DECAY, &arguments);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let before = table(folder.path());
    let members = folder.path().join("out/members");

    let all = fs::read_dir(&members).unwrap().flatten().map(|entry| entry.path());
    let name = |p: &std::path::PathBuf| p.to_string_lossy().contains("reference");
    let confirming = all.filter(|p| p.is_dir()).find(name).unwrap();
    let point = members.join("run=monolithic,-BDF,-1e-2");
    fs::remove_file(confirming.join("states.bin")).unwrap();
    let states = fs::read(point.join("states.bin")).unwrap();
    fs::write(point.join("states.bin"), &states[..states.len() - 8]).unwrap();
    // Gathered alone it reports that, and fails.
    let out = rumple(folder.path(), &["accuracy", "out"]);
    let said = text(&out.stderr);
    assert!(
        !out.status.success() && said.contains("2 of ") && said.contains("damaged: "),
        "{said}"
    );
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("states.bin is missing or truncated"), "{page}");
    let out = again(folder.path(), &arguments);
    let said = text(&out.stderr);
    assert!(out.status.success(), "{said}");
    assert_eq!(said.matches(": begun").count(), 2, "{said}");
    assert_eq!(errors(&before), errors(&table(folder.path())));
}

#[test]
fn the_default_study_goes_with_every_policy() {
    for policy in ["quasi-static", "simultaneous", "chemistry-fast"] {
        let scene = GROWING.replace("until = 0.2", &format!("until = 0.02, policy = \"{policy}\""));
        let scene = scene
            .replace("integrator = { kind = \"staggered\", method = \"heun\", step = 0.01 }", "");
        let scene = scene
            .replace(", }\n", " }\n")
            .replace("thickness = 0.5", "thickness = 0.5, drag = 1.0");
        let (folder, out) = study(&scene, &["--tolerances", "1e-1", "--seeds", "0"]);
        assert!(out.status.success(), "{policy}: {}", text(&out.stderr));
        let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
        assert!(page.contains("* Confirmed by "), "{policy}: {page}");
    }
}

#[test]
fn a_scene_in_which_nothing_changes_has_no_errors() {
    let scene = GROWING.replace("sqrt(a) - c", "0*c").replace("1 + 0.1*c", "1");
    let scene = scene.replace(", bump = { amplitude = 0.3, width = 2.0 }", "");
    let (folder, out) = study(&scene, &["--tolerances", "1e-1", "--seeds", "0"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let said = text(&out.stdout);
    // Diffusion alone does change the species.
    assert!(!said.contains("Nothing changes"), "{said}");
    drop(folder);
    let scene = scene.replace("{ gaussian = { width = 2.0, amplitude = 0.5 } }", "0.5");
    let (folder, out) = study(&scene, &["--tolerances", "1e-1", "--seeds", "0"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains("Nothing changes in this scene"), "{}", text(&out.stdout));
    drop(folder);
}
