//! The program on a planar scene: check, run, frames, inspect, compare, start from a state.

use std::fs;

use rumple::sheet::read;

use super::STRIP;
use crate::run::program::{folder, passes, rumple, text};

fn planar() -> String {
    STRIP.replacen("[sheet]", "[sheet]\nplanar = true", 1)
}

#[test]
fn a_planar_scene_goes_through_every_command() {
    let folder = folder(&planar());
    let path = folder.path();
    let done = |args: &[&str]| {
        let out = rumple(path, args);
        assert!(out.status.success(), "{args:?}: {}{}", text(&out.stdout), text(&out.stderr));
        text(&out.stdout) + &text(&out.stderr)
    };
    let check = done(&["check", "scene.toml"]);
    assert!(check.contains("planar") && !check.contains("warning"), "{check}");
    let vertices = |said: &str, after: &str| -> usize {
        let line = said.lines().find(|line| line.contains(after)).unwrap();
        line.split_whitespace().find_map(|word| word.parse().ok()).unwrap()
    };
    let free = vertices(&check, "positions free");

    let watch = ["--set", "stability.watch=true"];
    let said = done(&["run", "scene.toml", "--out", "result", watch[0], watch[1]]);
    assert!(!said.contains("flat"), "{said}");
    let ledger = fs::read_to_string(path.join("result/ledger.csv")).unwrap();
    assert!(!ledger.contains("NaN") && ledger.lines().count() > 2, "{ledger}");
    let frame = read::surface(path.join("result/frames/frame_000002.vtu")).unwrap();
    assert!(frame.points.iter().all(|x| x.z.to_bits() == 0));
    assert!(frame.points.len() * 2 > free && free > frame.points.len());
    let curvature =
        frame.point_arrays.iter().find(|a| a.name.starts_with("mean_curvature")).unwrap();
    assert!(curvature.values.iter().all(|h| *h == 0.0));

    let state = "result/frames/frame_000002.vtu";
    done(&["inspect", "scene.toml", "--state", state, "--json", "o.json", "--stability"]);
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("o.json")).unwrap()).unwrap();
    assert_eq!(
        (json["stability"]["negative"].as_u64(), json["stability"]["rigid"].as_u64()),
        (Some(0), Some(0))
    );
    for key in ["mean_curvature", "gaussian_curvature"] {
        assert!(json[key].as_array().unwrap().iter().all(|h| h.as_f64() == Some(0.0)), "{key}");
    }

    done(&["run", "scene.toml", "--from", state, "--out", "second"]);
    let total = |run: &str, row: fn(&str) -> &str| -> f64 {
        let ledger = fs::read_to_string(path.join(run).join("ledger.csv")).unwrap();
        let column =
            ledger.lines().next().unwrap().split(',').position(|t| t == "total m").unwrap();
        row(&ledger).split(',').nth(column).unwrap().parse().unwrap()
    };
    let last = total("result", |ledger| ledger.lines().last().unwrap());
    let start = total("second", |ledger| ledger.lines().nth(1).unwrap());
    assert!((start / last - 1.0).abs() < 1e-9, "{start} {last}");

    let compared = done(&[
        "compare",
        "scene.toml",
        "--out",
        "compared",
        "--quiet",
        "--policies",
        "quasi-static,simultaneous",
        "--integrator",
        "staggered",
        "--integrator",
        "monolithic",
    ]);
    assert!(!compared.contains("NaN"), "{compared}");
    let table = fs::read_to_string(path.join("compared/compare.csv")).unwrap();
    assert!(!table.contains("NaN") && table.lines().count() > 8, "{table}");
}

#[test]
fn a_state_that_leaves_the_plane_is_refused_with_its_vertex() {
    let folder = folder(&planar());
    let path = folder.path();
    passes(path, "run scene.toml --out result");
    let frame = read::surface(path.join("result/frames/frame_000000.vtu")).unwrap();
    let mut bent = String::from("# vtk DataFile Version 3.0\nbent\nASCII\nDATASET POLYDATA\n");
    bent += &format!("POINTS {} double\n", frame.points.len());
    for (v, x) in frame.points.iter().enumerate() {
        let z = if v == 7 { 1e-7 } else { x.z };
        bent += &format!("{} {} {z}\n", x.x, x.y);
    }
    bent += &format!("POLYGONS {} {}\n", frame.triangles.len(), 4 * frame.triangles.len());
    for [a, b, c] in &frame.triangles {
        bent += &format!("3 {a} {b} {c}\n");
    }
    bent +=
        &format!("POINT_DATA {}\nSCALARS m double 1\nLOOKUP_TABLE default\n", frame.points.len());
    bent += &"0.5\n".repeat(frame.points.len());
    fs::write(path.join("bent.vtk"), &bent).unwrap();
    for args in [
        ["run", "scene.toml", "--from", "bent.vtk", "--out", "second"].as_slice(),
        &["inspect", "scene.toml", "--state", "bent.vtk"],
    ] {
        let out = rumple(path, args);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {}", text(&out.stdout));
        let said = text(&out.stderr);
        assert!(said.contains("bent.vtk") && said.contains("vertex 7"), "{said}");
    }
    // The same state in space.
    passes(path, "inspect scene.toml --state bent.vtk --set sheet.planar=false");
}
