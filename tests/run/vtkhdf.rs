//! All frames in one file: the same numbers as in files of their own, whole after kills, and read by all that read frames.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rumple::sheet::read;

use super::SMALL;
use super::program::{folder, rumple, text};
use super::resumed::assert_same;
use crate::plugins::build;

const FIELDS: &str =
    "every = 0.05\nfields = [\"c\", \"mean_curvature\", \"rest_position\", \"quality\"]";

fn scene(format: &str) -> String {
    let output = format!("{FIELDS}\nformat = \"{format}\"");
    SMALL.replace("until = 0.5", "until = 0.2").replace("every = 0.25", &output)
}

fn done(folder: &Path, args: &[&str]) -> String {
    let out = rumple(folder, args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// Runs into `vtu` and `vtkhdf` with frames of either kind.
fn both(folder: &Path) {
    for format in ["vtu", "vtkhdf"] {
        fs::write(folder.join("scene.toml"), scene(format)).unwrap();
        let told = done(folder, &["run", "scene.toml", "--out", format, "--quiet"]);
        let index = if format == "vtu" { "sheet.pvd" } else { "sheet.vtkhdf" };
        assert!(told.contains(index) || told.is_empty(), "{told}");
    }
}

#[test]
fn its_frames_are_those_of_files_of_their_own() {
    let folder = folder(SMALL);
    let at = folder.path();
    both(at);
    let file = at.join("vtkhdf/sheet.vtkhdf");
    assert!(!at.join("vtkhdf/frames").exists());
    let times = read::frame_times(&file).unwrap();
    assert_eq!(times.len(), 5);
    for (k, time) in times.iter().enumerate() {
        let one = read::surface(format!("{}#{k}", file.display())).unwrap();
        let other = read::surface(at.join(format!("vtu/frames/frame_{k:06}.vtu"))).unwrap();
        assert_eq!((one.time, other.time), (Some(*time), Some(*time)));
        assert_eq!(one.points, other.points);
        assert_eq!(one.triangles, other.triangles);
        assert_eq!(one.point_arrays.len(), other.point_arrays.len());
        for array in &other.point_arrays {
            assert_eq!(one.point_array(&array.name), Some(array));
        }
        for array in &other.cell_arrays {
            assert_eq!(one.cell_array(&array.name), Some(array));
        }
    }
    assert_eq!(read::surface(&file).unwrap().time, times.last().copied());
    let message = read::surface(format!("{}#9", file.display())).unwrap_err().to_string();
    assert!(message.contains("has 5 frames; frame 9"), "{message}");
    // What else reads frames.
    let page = done(at, &["view", "vtkhdf", "--out", "page.html"]);
    assert!(page.contains("5 of 5 frames"), "{page}");
    for state in ["vtkhdf/sheet.vtkhdf", "vtkhdf/sheet.vtkhdf#2"] {
        done(at, &["inspect", "scene.toml", "--state", state, "--json", "-"]);
        done(at, &["run", "scene.toml", "--from", state, "--out", "on", "--force", "--quiet"]);
    }
    // A new run replaces the file; one with frames of their own leaves none of it.
    fs::write(at.join("scene.toml"), scene("vtu")).unwrap();
    done(at, &["run", "scene.toml", "--out", "vtkhdf", "--force", "--quiet"]);
    assert!(!file.exists() && at.join("vtkhdf/sheet.pvd").exists());
}

#[test]
fn a_killed_run_leaves_a_whole_file_and_goes_on_with_the_same_bytes() {
    let folder = folder(SMALL);
    let at = folder.path();
    let scene =
        SMALL.replace("until = 0.5", "until = 0.8").replace("every = 0.25", "every = 0.002")
            + "format = \"vtkhdf\"\n\n[checkpoint]\nevery = 0.05\n";
    fs::write(at.join("scene.toml"), scene).unwrap();
    done(at, &["run", "scene.toml", "--out", "whole", "--quiet"]);
    let whole = read::frame_times(at.join("whole/sheet.vtkhdf")).unwrap().len();
    assert_eq!(whole, 401);
    let (mut first, mut before) = (true, 0);
    // Each part is killed after some frames more, at no chosen instant.
    for more in [60, 71, 83, 97] {
        let command: &[&str] =
            if first { &["run", "scene.toml", "--out", "killed"] } else { &["resume", "killed"] };
        let mut run = Command::new(super::program())
            .current_dir(at)
            .env("RUMPLE_PLUGIN_PATH", build::directory())
            .args(command)
            .arg("--quiet")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let file = at.join("killed/sheet.vtkhdf");
        let start = Instant::now();
        loop {
            // The file is read while it is written.
            let frames = read::frame_times(&file).map_or(0, |times| times.len());
            if frames >= before + more || start.elapsed() > Duration::from_secs(60) {
                break;
            }
            std::thread::sleep(Duration::from_micros(700));
        }
        run.kill().unwrap();
        run.wait().unwrap();
        let times = read::frame_times(&file).unwrap();
        assert!(times.len() >= before + more, "{} of {} frames", times.len(), before + more);
        for k in [0, times.len() / 2, times.len() - 1] {
            let frame = read::surface(format!("{}#{k}", file.display())).unwrap();
            assert_eq!(frame.time, Some(times[k]));
        }
        // The next part continues from a checkpoint, up to 25 frames before.
        before = times.len().saturating_sub(26);
        first = false;
    }
    done(at, &["resume", "killed", "--quiet"]);
    assert_same(&at.join("whole"), &at.join("killed"), "after four kills");
}

#[test]
fn frames_that_were_changed_are_not_gone_on_from() {
    let folder = folder(SMALL);
    let at = folder.path();
    fs::write(at.join("scene.toml"), scene("vtkhdf") + "\n[checkpoint]\nevery = 0.05\n").unwrap();
    done(at, &["run", "scene.toml", "--out", "run", "--quiet"]);
    let file = at.join("run/sheet.vtkhdf");
    let good = fs::read(&file).unwrap();
    let refused = |bytes: &[u8], words: &str| {
        fs::write(&file, bytes).unwrap();
        let out = rumple(at, &["resume", "run", "--until", "0.3", "--quiet"]);
        assert_eq!(out.status.code(), Some(2));
        let message = text(&out.stderr);
        assert!(message.contains("sheet.vtkhdf") && message.contains(words), "{message}");
    };
    refused(&good[..good.len() / 2], "cut short");
    let mut other = good.clone();
    // The first number of the first frame: a compressed chunk, after all tables.
    let time = 0.05f64.to_le_bytes();
    let place = good.windows(8).position(|window| window == time).unwrap();
    other[place..place + 8].copy_from_slice(&0.06f64.to_le_bytes());
    refused(&other, "not as the run wrote it");
    fs::write(&file, &good).unwrap();
    done(at, &["resume", "run", "--until", "0.3", "--quiet"]);
    assert_eq!(read::frame_times(&file).unwrap().len(), 7);
}

/// The real VTK reads the numbers of both kinds of frames, to the last bit.
#[test]
#[ignore = "needs Python with the vtk package in RUMPLE_PYTHON; tests/run.sh runs it"]
fn real_vtk_reads_one_file_as_it_reads_many() {
    let python = std::env::var("RUMPLE_PYTHON").expect("RUMPLE_PYTHON names the interpreter");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scripts/check_vtkhdf.py");
    let folder = folder(SMALL);
    both(folder.path());
    let out = Command::new(python)
        .current_dir(folder.path())
        .args([script, "vtkhdf/sheet.vtkhdf", "vtu/sheet.pvd"])
        .output()
        .unwrap();
    let (told, complaints) = (text(&out.stdout), text(&out.stderr));
    assert!(out.status.success(), "{told}{complaints}");
    assert!(told.contains("5 frames are the same"), "{told}{complaints}");
}
