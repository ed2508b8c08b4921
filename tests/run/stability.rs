//! The watch on stability during a run, and what `inspect` tells of it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use rumple::sheet::read;

use super::program;
use crate::plugins::build;

/// A perfectly flat disc with an immovable boundary whose lengths grow slowly: c decays from 1 as
/// dc/dt = -c, and Φ = Λ(1)/Λ(c) grows from 1.
const GROWING: &str = r#"
[sheet]
shape = "disc"
radius = 14.0
vertices = 400

[material]
young = 1e6
poisson = 0.3333333333333333
thickness = 0.5

[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "xyz"

[kinetics]
plugin = "curvature-feedback"
parameters = { w = 0.0, b = 1.0, c_star = 0.5, lambda_min = 1.006, lambda_0 = 1.0037347559 }
initial.c = 1.0

[time]
integrator = { kind = "staggered", method = "euler", step = 0.0025 }
until = 0.3

[equilibrium]
tolerance = 1e-9

[stability]
modes = 3
"#;

const STEP: f64 = 0.0025;

/// Strain of growth after so many Euler steps.
fn strain(step: i32) -> f64 {
    let c = (1.0 - STEP).powi(step);
    let share = 1.0 / (1.0 + (-(c - 0.5)).exp());
    1.0037347559 / (1.0 + 0.006 * share) - 1.0
}

fn run(scene: &str, args: &[&str]) -> (tempfile::TempDir, Output) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = Command::new(program())
        .current_dir(folder.path())
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args([args[0], "scene.toml"])
        .args(&args[1..])
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{error}");
    (folder, output)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The rows of a CSV file, without its header.
fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    (split(lines.next().unwrap()), lines.map(split).collect())
}

fn modes(path: &Path) -> Vec<String> {
    let arrays = read::surface(path).unwrap().point_arrays;
    arrays.into_iter().map(|a| a.name).filter(|n| n.starts_with("mode_")).collect()
}

/// B1: ε = k (1-ν) B/(Y R²) with k = 4.28241, B/Y = h²/12; meshes of some hundred vertices are 3 to
/// 5 % softer.
#[test]
fn loss_of_stability_is_an_event_at_the_buckling_strain() {
    let (folder, output) = run(GROWING, &["run", "--out", "result"]);
    let result = folder.path().join("result");
    let (header, events) = rows(&result.join("events.csv"));
    assert_eq!(header[..3], ["time", "step", "kind"]);
    assert_eq!(events.len(), 1, "{events:?}");
    let [time, step, kind, eigenvalue, negative, released, file, ..] = &events[0][..] else {
        panic!("{events:?}")
    };
    assert_eq!((kind.as_str(), negative.as_str()), ("loss of stability", "1"));
    assert!(eigenvalue.parse::<f64>().unwrap() < 0.0 && released.is_empty());
    let step: i32 = step.parse().unwrap();
    assert!((time.parse::<f64>().unwrap() - STEP * f64::from(step)).abs() < 1e-12);
    let critical = 4.282410148730029 * (2.0 / 3.0) * (0.25 / 12.0) / (14.0 * 14.0);
    let ratios = [strain(step - 1) / critical, strain(step) / critical];
    println!("stable at {} and unstable at {} of the plate's strain", ratios[0], ratios[1]);
    assert!(ratios[1] - ratios[0] < 0.02 && ratios[0] > 0.93 && ratios[1] < 1.0, "{ratios:?}");
    assert_eq!(modes(&result.join(file)), ["mode_1", "mode_2", "mode_3"]);
    let text = said(&output);
    assert!(text.contains("loss of stability") && text.contains("stability.perturb"), "{text}");
    // The ledger has the count of every step, and the sheet stays where it is: flat.
    let (header, ledger) = rows(&result.join("ledger.csv"));
    let column = header.iter().position(|c| c == "negative directions").unwrap();
    for (row, number) in ledger.iter().zip(0..) {
        assert_eq!(row[column] != "0", number >= step, "{row:?}");
    }
    assert!(read::surface(result.join(file)).unwrap().points.iter().all(|x| x.z == 0.0));
}

#[test]
fn a_saddle_is_left_along_its_mode_if_the_scene_says_so() {
    let scene = GROWING.replace("modes = 3", "perturb = 0.02");
    let (folder, _) = run(&scene, &["run", "--out", "result"]);
    let result = folder.path().join("result");
    let (_, events) = rows(&result.join("events.csv"));
    let kinds: Vec<&str> = events.iter().map(|e| e[2].as_str()).collect();
    assert_eq!(kinds, ["loss of stability", "left along the mode"]);
    assert_eq!(events[1][4], "0");
    assert!(events[1][3].parse::<f64>().unwrap() > 0.0);
    let end = read::surface(result.join("frames/frame_000001.vtu")).unwrap();
    let top = end.points.iter().map(|x| x.z).fold(0.0, f64::max);
    // The mode points upwards, and so does the dome: of the size √(ε - ε_cr) R.
    assert!(top > 0.1 && top < 1.0, "{top}");
    assert!(end.points.iter().all(|x| x.z > -1e-6));
}

/// A shell that loses volume: it becomes a saddle as a sphere, which no imperfection breaks.
const SHELL: &str = r#"
sheet = { shape = "sphere", radius = 10.0, vertices = 300 }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.8 }
effect = [
    { kind = "stretching", model = "stvk" },
    { kind = "bending" },
    { kind = "volume", exact = true, ramp = { formula = "1 - 0.3*t" } },
]
time = { until = 1.0, integrator = { kind = "staggered", method = "euler", step = 0.25 } }
"#;

/// The path leaves it itself, whatever the method: `perturb` finds nothing to do.
#[test]
fn a_saddle_that_is_not_flat_needs_no_perturbation() {
    for method in ["lbfgs", "newton"] {
        let scene = format!("equilibrium.method = \"{method}\"\n{SHELL}");
        let mut ends = Vec::new();
        for stability in ["", "[stability]\n", "[stability]\nperturb = 0.05\n"] {
            let (folder, _) = run(&format!("{scene}{stability}"), &["run", "--out", "result"]);
            let result = folder.path().join("result");
            let (header, ledger) = rows(&result.join("ledger.csv"));
            let last = |name: &str| {
                let column = header.iter().position(|c| c.starts_with(name));
                column.map(|column| ledger.last().unwrap()[column].clone())
            };
            if !stability.is_empty() {
                let (_, events) = rows(&result.join("events.csv"));
                let unstable = |event: &&Vec<String>| event[2] == "loss of stability";
                assert_eq!(events.iter().find(unstable), None, "{method}: {events:?}");
                assert_eq!(last("negative directions").as_deref(), Some("0"), "{method}");
            }
            ends.push(last("total energy").unwrap());
        }
        assert!(ends.iter().all(|end| *end == ends[0]), "{method}: {ends:?}");
    }
}

/// A shape that moves under drag is evaluated without relaxation.
#[test]
fn a_moving_shape_is_displaced_and_never_relaxed() {
    let scene = GROWING
        .replace("modes = 3", "perturb = 0.02")
        .replace("tolerance = 1e-9", "tolerance = 1e-9\nmax_iterations = 3")
        .replace("[time]", "[time]\npolicy = \"simultaneous\"")
        .replace("\"staggered\", method = \"euler\", step = 0.0025", "\"monolithic\"");
    let (folder, output) = run(&scene, &["run", "--out", "result"]);
    let result = folder.path().join("result");
    let (_, events) = rows(&result.join("events.csv"));
    let kinds: Vec<&str> = events.iter().map(|e| e[2].as_str()).collect();
    assert_eq!(kinds[..2], ["loss of stability", "displaced along the mode"], "{}", said(&output));
    let displaced = read::surface(result.join(&events[1][6])).unwrap();
    let top = |points: &[rumple::Vec3]| points.iter().map(|x| x.z).fold(0.0, f64::max);
    assert!((top(&displaced.points) - 0.02).abs() < 1e-6, "{}", top(&displaced.points));
    // What is on its way is left alone, and from there it grows, as far as the drag lets it.
    assert_eq!(kinds.iter().filter(|kind| kind.starts_with("displaced")).count(), 1, "{kinds:?}");
    let end = read::surface(result.join("frames/frame_000001.vtu")).unwrap();
    assert!(top(&end.points) > 0.02, "{}", top(&end.points));
}

/// A displacement too small for the force tolerance comes to nothing, and is not called a success.
#[test]
fn a_perturbation_that_falls_back_is_told() {
    let scene = GROWING.replace("modes = 3", "perturb = 1e-12");
    let (folder, output) = run(&scene, &["run", "--out", "result"]);
    let (_, events) = rows(&folder.path().join("result/events.csv"));
    let kinds: Vec<&str> = events.iter().map(|e| e[2].as_str()).take(2).collect();
    assert_eq!(kinds, ["loss of stability", "not left along the mode"]);
    assert_eq!(events[1][4], "1");
    assert!(said(&output).contains("a larger stability.perturb"), "{}", said(&output));
}

#[test]
fn a_flat_saddle_at_the_start_is_told_with_and_without_a_watch() {
    let grown = GROWING.replace("initial.c = 1.0", "initial.c = 0.0").replace("0.3\n", "0.01\n");
    let (folder, output) = run(&grown, &["run", "--out", "result"]);
    let (_, events) = rows(&folder.path().join("result/events.csv"));
    assert_eq!(events.len(), 1, "{events:?}");
    assert_eq!((events[0][0].as_str(), events[0][2].as_str()), ("0", "saddle at the start"));
    assert!(events[0][4].parse::<usize>().unwrap() > 1);
    assert!(said(&output).contains("sheet.imperfection"), "{}", said(&output));

    let unwatched = grown.replace("modes = 3", "watch = false");
    let (folder, output) = run(&unwatched, &["run", "--out", "result"]);
    let result = folder.path().join("result");
    assert!(!result.join("events.csv").exists() && !result.join("modes").exists());
    let (header, _) = rows(&result.join("ledger.csv"));
    assert!(!header.iter().any(|c| c == "negative directions"));
    let text = said(&output);
    assert!(text.contains("perfectly flat and a saddle") && text.contains("bump"), "{text}");

    // Nothing is said where the start is not flat.
    let rough = unwatched.replace("400\n", "400\nimperfection = { amplitude = 1e-3 }\n");
    let text = said(&run(&rough, &["run", "--out", "result"]).1);
    assert!(!text.contains("flat"), "{text}");
}

#[test]
fn inspect_tells_minima_saddles_and_rigid_motions_apart() {
    let verdict = |scene: &str, args: &[&str]| {
        let mut all = vec!["inspect", "--stability", "--out", "modes.vtu", "--json", "o.json"];
        all.extend(args);
        let (folder, output) = run(scene, &all);
        let json = fs::read(folder.path().join("o.json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let names = modes(&folder.path().join("modes.vtu"));
        (String::from_utf8(output.stdout).unwrap(), json["stability"].clone(), names)
    };
    let (text, json, names) = verdict(GROWING, &["--modes", "2"]);
    assert!(text.contains("stable: every direction raises the energy"), "{text}");
    assert_eq!(names, ["mode_1", "mode_2"]);
    assert_eq!(json["negative"], 0);
    let least = json["eigenvalues"][0].as_f64().unwrap();
    assert!(least > 0.0 && least <= json["eigenvalues"][1].as_f64().unwrap());

    let grown = GROWING.replace("initial.c = 1.0", "initial.c = 0.0");
    let (text, json, names) = verdict(&grown, &[]);
    assert!(text.contains("not an equilibrium"), "{text}");
    assert_eq!(names.len(), 4);
    assert_eq!(json["equilibrium"], false);
    let (text, json, _) = verdict(&grown, &["--relax"]);
    let negative = json["negative"].as_u64().unwrap();
    assert!(negative > 1 && text.contains(&format!("saddle: {negative} directions")), "{text}");
    assert!(!text.contains("not an equilibrium"), "{text}");

    let fixed = GROWING.replace("axes = \"xyz\"", "axes = \"z\"");
    let (text, json, _) = verdict(&fixed, &["--relax"]);
    assert!(text.contains("stable up to 3 free rigid motions"), "{text}");
    assert_eq!((json["negative"].as_u64(), json["rigid"].as_u64()), (Some(0), Some(3)));
}

#[test]
fn a_watch_without_energies_is_refused() {
    let bare =
        GROWING.replace("kind = \"stretching\"\n[[effect]]\nkind = \"bending\"\n[[effect]]\n", "");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), &bare).unwrap();
    let output = Command::new(program())
        .current_dir(folder.path())
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args(["run", "scene.toml", "--out", "result"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = said(&output);
    assert!(text.contains("nothing to watch") && text.contains("scene.toml"), "{text}");
}

/// A snap needs no watch: it is an event wherever the shape is in equilibrium at all times.
#[test]
fn a_snap_is_an_event_with_the_energy_that_it_releases() {
    let (folder, _) =
        run(include_str!("../../models/plates/snap.toml"), &["run", "--out", "result"]);
    let result = folder.path().join("result");
    let (_, events) = rows(&result.join("events.csv"));
    let (header, ledger) = rows(&result.join("ledger.csv"));
    let column = |name: &str| header.iter().position(|c| c == name).unwrap();
    let (jumps, released) = (column("snaps"), column("energy released by snaps [energy]"));
    let snapped: Vec<_> = ledger.iter().filter(|row| row[jumps] != "0").collect();
    assert!(!events.is_empty() && events.len() == snapped.len(), "{events:?} {snapped:?}");
    for (event, row) in events.iter().zip(snapped) {
        assert_eq!((event[2].as_str(), &event[5]), ("snap", &row[released]));
        assert_eq!((&event[0], &event[1]), (&row[1], &row[0]));
        assert!(event[5].parse::<f64>().unwrap() > 0.0, "{event:?}");
    }
}

/// A stripe that grows between fixed edges: it buckles in the third step, and is at rest at the end.
#[test]
fn a_run_that_ends_while_the_shape_moves_says_so() {
    let scene = r#"
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "xyz" },
    { kind = "growth", factor = "1 + 0.1*t*exp(-x^2/10)" },
]
sheet = { shape = "rectangle", width = 20.0, height = 20.0, vertices = 900, imperfection = { amplitude = 1e-2, seed = 3 } }
material = { young = 1e5, poisson = 0.3333333333333333, thickness = 0.3, drag = 0.01 }
time = { until = 1.0, integrator = { kind = "staggered", longest_step = 0.05 } }
"#;
    let note = "the run ends while the shape moves under the stabilising drag";
    let moves = |args: &[&str]| {
        let (folder, output) = run(scene, &[&["run", "--out", "a"], args].concat());
        let page = fs::read_to_string(folder.path().join("a/report.html")).unwrap();
        let said = said(&output).contains(note);
        assert_eq!(page.contains(note), said, "the page repeats what the run has said");
        said
    };
    assert!(moves(&["--set", "time.max_steps=5"]));
    assert!(!moves(&[]));
}

/// The modes of a periodic film lose their stability in pairs, and their files have the points of frames.
#[test]
fn the_stability_of_a_periodic_sheet_is_watched() {
    let film = crate::common::shipped("models/plates/film.toml");
    let scene = film.replace("vertices = 1200", "vertices = 600") + "[stability]\n";
    let (folder, _) = run(&scene, &["run", "--out", "result", "--set", "time.until=0.6"]);
    let result = folder.path().join("result");
    let (_, events) = rows(&result.join("events.csv"));
    let lost = events.iter().find(|event| event[2] == "loss of stability").unwrap();
    let time: f64 = lost[0].parse().unwrap();
    let negative: usize = lost[4].parse().unwrap();
    assert!(time > 0.45 && time <= 0.6 && negative >= 2, "{lost:?}");
    let points = |path: &Path| read::surface(path).unwrap().points.len();
    let frame = points(&result.join("frames/frame_000001.vtu"));
    assert_eq!(points(&result.join(&lost[6])), frame);
}
