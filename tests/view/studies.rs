//! Pages of sweeps and comparisons, of runs without frames, of resumed and failed runs.

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
    // Its table and its plots, as the sweep wrote them.
    let study = page.about["study"].as_array().unwrap();
    assert_eq!(study[0]["table"].as_array().unwrap().len(), 4);
    assert!(study.iter().any(|block| block["plot"]["name"] == "thickness"), "{study:?}");
    let plots = folder.join("sweep/plots.json");
    let whole = fs::read_to_string(&plots).unwrap();
    fs::write(&plots, &whole[..whole.len() / 2]).unwrap();
    let out = rumple(folder, &["view", "sweep", "-o", "grid.html", "--force"]);
    assert!(text(&out.stderr).contains("plots.json: is not what a study writes"));
    fs::write(&plots, whole).unwrap();
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

/// What is not finite is an empty cell of the ledger, which the viewer and the tables of sweeps read.
#[test]
fn a_gap_with_nothing_near_is_an_empty_cell() {
    let folder = folder(&(scene() + "\n[[effect]]\nkind = \"contact\"\n"));
    let folder = folder.path();
    let over = "material.thickness=0.5,1";
    done(folder, &["sweep", "scene.toml", "--out", "out", "--over", over, "--quiet"]);
    let member = folder.join("out/members/thickness=1");
    let ledger = fs::read_to_string(member.join("ledger.csv")).unwrap();
    let (header, rows) = ledger.split_once('\n').unwrap();
    let gap = header.split(',').position(|title| title == "gap of contact [length]").unwrap();
    assert!(rows.lines().all(|row| row.split(',').nth(gap) == Some("")), "{ledger}");
    assert!(!rows.contains("inf") && !rows.contains("nan"), "{ledger}");
    let table = fs::read_to_string(folder.join("out/sweep.csv")).unwrap();
    let total = table.lines().next().unwrap().split(',').position(|title| title == "total c");
    let total = table.lines().nth(2).unwrap().split(',').nth(total.unwrap()).unwrap();
    assert!(total.parse::<f64>().unwrap() > 0.0, "{table}");
    done(folder, &["view", member.to_str().unwrap(), "-o", "page.html"]);
    let page = Read::new(&folder.join("page.html"));
    let ledger = &page.about["members"][0]["ledger"];
    let rows = usize::try_from(ledger["rows"].as_u64().unwrap()).unwrap();
    let block = page.block(&ledger["block"]);
    let gaps = block.as_chunks::<4>().0[gap * rows..][..rows].iter();
    assert!(gaps.map(|b| f32::from_le_bytes(*b)).all(f32::is_nan));
}

/// How a start comes to rest is not a warning; a saddle that it stays at is one, and so is every event of a step.
#[test]
fn events_of_a_start_at_rest_are_no_warning() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let (snap, saddle) = ("0,0,snap,,,0.3,,1,0,0,0", "0,0,saddle at the start,-1,1,,m.vtu,,,,");
    let left = "0,0,left along the mode,1,0,,n.vtu,,,,";
    let stuck = "0,0,not left along the mode,-1,1,,n.vtu,,,,";
    let later = "0.1,3,snap,,,0.3,,1,0,0,0";
    let cases: [(&[&str], usize); 7] = [
        (&[], 0),
        (&[snap], 0),
        (&[saddle, left], 0),
        (&[saddle], 1),
        (&[saddle, stuck], 1),
        (&[snap, later], 1),
        (&[saddle, left, later, later], 2),
    ];
    for (rows, count) in cases {
        let list = format!("time,step,kind\n{}\n", rows.join("\n"));
        fs::write(folder.join("out/events.csv"), list).unwrap();
        done(folder, &["view", "out", "-o", "page.html", "--force"]);
        let page = Read::new(&folder.join("page.html"));
        let warnings = page.about["members"][0]["warnings"].as_array().unwrap();
        let expected = format!("events, as snaps and losses of stability: {count}, listed below");
        assert_eq!(warnings.iter().any(|text| *text == expected), count > 0, "{rows:?}");
        assert_eq!(warnings.len(), usize::from(count > 0), "{rows:?}: {warnings:?}");
    }
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
