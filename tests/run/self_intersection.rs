//! Self-intersection is reported at the end of a run, whether or not the scene asks for it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::program::{folder, passes, rumple, text};

use crate::common::shipped;

/// What standard output and standard error say, and the status.
fn ran(folder: &Path, code: i32, keys: &[&str]) -> (String, String, Value) {
    let set = keys.iter().flat_map(|key| ["--set", key]);
    let args: Vec<&str> = ["run", "scene.toml", "--out", "result"].into_iter().chain(set).collect();
    let out = rumple(folder, &args);
    let (said, errors) = (text(&out.stdout), text(&out.stderr));
    assert_eq!(out.status.code(), Some(code), "{errors}");
    let status = fs::read_to_string(folder.join("result/status.json")).unwrap();
    (said, errors, serde_json::from_str(&status).unwrap())
}

/// It ended with code 0 and no word.
#[test]
fn a_run_tells_that_the_sheet_passes_through_itself() {
    let scene = shipped("models/hard/pushed.toml");
    let directory = folder(&scene);
    let (said, errors, status) = ran(directory.path(), 0, &[]);
    let pairs = status["crossings"].as_u64().unwrap();
    assert!(pairs > 5, "{status}");
    let words =
        format!("warning: the sheet passes through itself: {pairs} pairs of triangles cross");
    assert!(said.contains(&words), "{said}");
    // The pole is through at the last output time alone.
    assert_eq!(errors.matches("passes through itself").count(), 1, "{errors}");
    assert!(errors.contains("warning: time 1: the sheet passes through itself"), "{errors}");
    assert!(errors.contains("first triangles") && errors.contains("near ("), "{errors}");
    assert!(errors.contains("`invariants.crossings = 0` ends a run"), "{errors}");

    // Before the pole is there nothing is said.
    let directory = folder(&scene);
    let (said, errors, status) = ran(directory.path(), 0, &["time.until=0.5"]);
    assert_eq!(status["crossings"], 0, "{status}");
    assert!(!(said + &errors).contains("passes through itself"));

    // Nor of shapes that do not move, which are not checked.
    let directory =
        folder("sheet.shape = \"point\"\ntime.until = 1.0\nkinetics.rates.c = \"-c\"\n");
    let (said, _, status) = ran(directory.path(), 0, &[]);
    assert!(status["crossings"].is_null(), "{status}");
    assert!(!said.contains("passes through itself"));
}

/// A plane rose through a disc with a pinned boundary, and it ended with code 0 and no word.
#[test]
fn a_run_tells_that_pins_hold_the_sheet_inside_an_obstacle() {
    let scene = r#"
        sheet = { shape = "disc", radius = 4.0, vertices = 200 }
        material = { young = 1000.0, poisson = 0.3, thickness = 0.1 }
        time = { until = 1.0, integrator = { longest_step = 0.25 } }
        output.every = 0.5
        effect = [
            { kind = "stretching" },
            { kind = "bending" },
            { kind = "pin", where = "rim", axes = "xyz" },
            { kind = "obstacle", shape = { plane = { point = [0, 0, -0.6], normal = [0, 0, 1] } }, displacement = [0, 0, 1], ramp = { formula = "t" } },
        ]
    "#;
    let directory = folder(scene);
    let (_, errors, _) = ran(directory.path(), 0, &[]);
    let words = "warning: time 1: the sheet is inside of the obstacle by up to 4.00e-1";
    assert_eq!(errors.matches("inside of").count(), 1, "{errors}");
    assert!(errors.contains(words), "{errors}");
    let directory = folder(scene);
    let (_, errors, _) = ran(directory.path(), 0, &["time.until=0.4", "output.every=0.4"]);
    assert!(!errors.contains("inside of"), "{errors}");
}

#[test]
fn sweeps_and_comparisons_name_members_whose_sheet_passes_through_itself() {
    let directory = folder(&shipped("models/hard/pushed.toml"));
    let said = |args: &[&str]| {
        let out = rumple(directory.path(), args);
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    let over = ["--over", "time.until=0.5,1", "--out", "sweep"];
    let sweep = said(&[&["sweep", "scene.toml"][..], &over].concat());
    assert_eq!(sweep.matches("passes through itself").count(), 1, "{sweep}");
    assert!(sweep.contains("* until = 1: the sheet passes through itself: "), "{sweep}");
    let page = fs::read_to_string(directory.path().join("sweep/sweep.md")).unwrap();
    assert!(page.contains("* until = 1: the sheet passes through itself: "), "{page}");
    let compare = said(&["compare", "scene.toml", "--out", "compare"]);
    assert!(compare.contains(": the sheet passes through itself: "), "{compare}");
}

/// Nothing crosses any more where a shell has come out at the other side.
#[test]
fn a_closed_sheet_that_is_turned_inside_out_is_told() {
    let scene = "sheet = { shape = \"sphere\", radius = 3.0, vertices = 42 }\n\
                 material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.2 }\n\
                 effect = [{ kind = \"stretching\" }]\ntime.until = 1.0\n";
    let directory = folder(scene);
    let path = directory.path();
    passes(path, "inspect scene.toml --vtu start.vtu");
    let start = rumple::sheet::read::surface(path.join("start.vtu")).unwrap();
    let points: Vec<rumple::Vec3> = start.points.iter().map(|x| -x).collect();
    // The reader would turn a mesh over, the states of a run it takes as they are.
    let mirrored = rumple::sheet::Sheet::new(points, start.triangles).unwrap();
    let mut file = fs::File::create(path.join("mirrored.vtu")).unwrap();
    rumple::sheet::write::mesh(&mirrored, rumple::sheet::write::MeshFormat::Vtu, &mut file)
        .unwrap();
    let run = |from: &[&str]| {
        let out =
            rumple(path, &[&["run", "scene.toml", "--out", "result", "--force"], from].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        let status = fs::read_to_string(path.join("result/status.json")).unwrap();
        let status: Value = serde_json::from_str(&status).unwrap();
        (text(&out.stdout), status["crossings"].clone(), status["inside_out"].clone())
    };
    let (said, crossings, inside_out) = run(&["--from", "mirrored.vtu"]);
    assert_eq!((crossings, inside_out), (0.into(), true.into()));
    assert!(
        said.contains("warning: the closed sheet is turned inside out, through itself"),
        "{said}"
    );
    let (said, _, inside_out) = run(&[]);
    assert_eq!(inside_out, false);
    assert!(!said.contains("inside out"), "{said}");
}

#[test]
fn the_report_of_a_failure_tells_that_the_sheet_passes_through_itself() {
    let scene = shipped("models/hard/pushed.toml");
    let directory = folder(&scene);
    let (_, _, status) = ran(directory.path(), 1, &["kinetics.rates.c=\"sqrt(0.95 - t)\""]);
    let report = fs::read_to_string(directory.path().join("result/failure/report.md")).unwrap();
    assert!(report.contains("| self-intersection | the sheet passes through itself: "), "{report}");
    assert!(report.contains("near ("), "{report}");
    // Of the last output time.
    assert_eq!(status["crossings"], 0, "{status}");
}
