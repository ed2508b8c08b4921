//! Pages of sweeps and comparisons, of runs without frames, of legacy frames, of resumed and failed runs.

use std::fs;

use serde_json::Value;

use super::{Read, done, scene};
use crate::run::program::{folder, rumple, text};

#[test]
fn a_sweep_is_a_grid_of_its_members() {
    let folder = folder(&scene());
    let folder = folder.path();
    let over = "material.thickness=0.5,1,10";
    done(folder, &["sweep", "scene.toml", "--out", "sweep", "--over", over, "--quiet"]);
    let page = Read::new(&folder.join("sweep/report.html"));
    assert_eq!(page.about["members"].as_array().unwrap().len(), 3);
    assert!(!folder.join("sweep/members/thickness=1/report.html").exists());
    done(folder, &["view", "sweep", "-o", "grid.html"]);
    let page = Read::new(&folder.join("grid.html"));
    let members = page.about["members"].as_array().unwrap();
    let names: Vec<&str> = members.iter().map(|m| m["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["thickness=0.5", "thickness=1", "thickness=10"]);
    // Their meshes are one: it is held once.
    let meshes: Vec<&Value> = members.iter().map(|m| &m["sheet"]["triangles"]).collect();
    assert!(meshes.iter().all(|mesh| *mesh == meshes[0]), "{meshes:?}");
    assert!(page.html.contains("3 members; 18 of 18 frames of 3 runs"));
    // A member that is lost is a warning, not an error.
    let lost = folder.join("sweep/members/thickness=1/frames/frame_000000.vtu");
    fs::remove_file(lost).unwrap();
    done(folder, &["view", "sweep", "-o", "grid.html", "--force"]);
    let page = Read::new(&folder.join("grid.html"));
    let warnings = &page.about["members"][1]["warnings"];
    assert!(warnings[0].as_str().unwrap().contains("frame_000000.vtu"), "{warnings}");
    let limit = ["view", "sweep", "-o", "grid.html", "--force", "--size-limit", "0.15"];
    let out = rumple(folder, &limit);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
}

#[test]
fn a_comparison_is_a_grid_of_its_members() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["compare", "scene.toml", "--out", "one", "--quiet"]);
    assert!(folder.join("one/report.html").is_file());
    let again = ["compare", "scene.toml", "--out", "one", "--quiet", "--force", "--set"];
    done(folder, &[&again[..], &["output.report=false"]].concat());
    assert!(!folder.join("one/report.html").exists());
    done(folder, &["view", "one", "-o", "grid.html"]);
    let page = Read::new(&folder.join("grid.html"));
    assert_eq!(page.about["members"].as_array().unwrap().len(), 1);
    assert_eq!(page.numbers().len(), 6);
}

#[test]
fn a_run_without_space_has_its_ledger() {
    let folder = folder(
        "sheet = { shape = \"point\" }\nkinetics = { rates = { c = \"1 - c\" } }\ntime = { until = 1.0 }\n",
    );
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let page = Read::new(&folder.join("out/report.html"));
    assert_eq!(*page.sheet(), Value::Null);
    assert!(page.about["members"][0]["ledger"]["rows"].as_u64().unwrap() > 1);
}

#[test]
fn legacy_frames_are_shown() {
    let folder = folder(&scene());
    let folder = folder.path();
    let set = "output.format=\"vtk\"";
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet", "--set", set]);
    let page = Read::new(&folder.join("out/report.html"));
    assert_eq!(page.numbers(), [0, 1, 2, 3, 4, 5]);
    assert!(page.sheet()["rest"].is_number());
}

/// A resumed run has the viewer of all of it.
#[test]
fn a_resumed_run_ends_with_a_new_viewer() {
    let folder = folder(&(scene() + "\n[checkpoint]\nevery = 0.02\n"));
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    done(folder, &["resume", "out", "--until", "0.08", "--quiet"]);
    let page = Read::new(&folder.join("out/report.html"));
    assert_eq!(page.numbers().last(), Some(&8));
}
