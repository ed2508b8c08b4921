//! `rumple follow`: branches through folds and bifurcations, on the disk; what is refused; interruption.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use super::program::{folder, passes_with, rumple, text};
use crate::common::plots;
use crate::plugins::build;

/// A shallow arch with pinned ends.
const ARCH: &str = r#"
[sheet]
shape = "graph"
width = 10.0
height = 1.5
z = "0.1*cos(pi*x/10)"
vertices = 180

[material]
young = 1e4
poisson = 0.3
thickness = 0.1

[[effect]]
kind = "stretching"
model = "stvk"
modulus = "plate"

[[effect]]
kind = "bending"
model = "hinge"
rest = "mesh"

[[effect]]
kind = "pin"
where = { half-space = { point = [-4.999, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] } }
axes = "xyz"

[[effect]]
kind = "pin"
where = { half-space = { point = [4.999, 0.0, 0.0], normal = [1.0, 0.0, 0.0] } }
axes = "xz"
displacement = [0.0, 0.0, 0.0]

[[effect]]
kind = "load"
where = "all"
force = { per-area = [0.0, 0.0, 0.0] }

[time]
until = 1.0
"#;

const LOAD: &str = "effect.load.force.per-area[2]";

/// The columns of a table by their titles.
fn table(root: &Path) -> Vec<std::collections::HashMap<String, String>> {
    let text = fs::read_to_string(root.join("branch.csv")).unwrap();
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let values: Vec<&str> = line.split(',').collect();
        assert_eq!(values.len(), titles.len(), "{line}");
        titles.iter().zip(values).map(|(t, v)| ((*t).to_owned(), v.to_owned())).collect()
    };
    lines.map(row).collect()
}

fn number(row: &std::collections::HashMap<String, String>, title: &str) -> f64 {
    row[title].parse().unwrap()
}

#[test]
fn an_arch_is_followed_through_both_folds() {
    let folder = folder(ARCH);
    let at = folder.path();
    let args = ["follow", "scene.toml", "--along", LOAD, "--to", "-2e-3", "-o", "arch"];
    let out = passes_with(at, &args);
    let told = text(&out.stdout);
    assert_eq!(told.matches("fold at effect.load").count(), 2, "{told}");
    let root = at.join("arch");
    let rows = table(&root);
    let events: Vec<usize> = (0..rows.len()).filter(|k| rows[*k]["event"] == "fold").collect();
    let [down, back] = events[..] else { panic!("{events:?}") };
    let load = |k: usize| number(&rows[k], LOAD);
    // Equilibria at both sides of each fold, the loads turned back.
    assert!(load(down) < load(down - 1) && load(down) < load(down + 1), "{rows:?}");
    assert!(load(back) > load(back - 1) && load(back) > load(back + 1), "{rows:?}");
    for (k, row) in rows.iter().enumerate() {
        let unstable = (down + 1..back).contains(&k);
        if k != down && k != back {
            assert_eq!(number(row, "negative eigenvalues"), f64::from(u8::from(unstable)), "{k}");
        }
        assert!(number(row, "force residual") < 1e-6);
        let before = if k == 0 { -1.0 } else { number(&rows[k - 1], "arc length") };
        assert!(number(row, "arc length") > before);
    }
    assert_eq!(rows[0]["event"], "start");
    assert_eq!(rows[rows.len() - 1]["event"], "end");
    assert_eq!(load(rows.len() - 1), -2e-3);
    // A frame a row, a diagram, a page.
    let pvd = fs::read_to_string(root.join("sheet.pvd")).unwrap();
    assert_eq!(pvd.matches("<DataSet").count(), rows.len());
    let names = plots(&root)["branch"]["names"].to_string();
    assert!(names.contains("unstable") && names.contains("fold") && !names.contains("bifurcation"));
    assert!(root.join("report.html").is_file() && root.join("provenance.json").is_file());
    let status = fs::read_to_string(root.join("status.json")).unwrap();
    let status: serde_json::Value = serde_json::from_str(&status).unwrap();
    assert_eq!(status["status"], "complete");
    for count in ["steps", "iterations", "gradients", "hessians", "factorisations", "solves"] {
        assert!(status["work"][count].as_u64().unwrap() > 10, "{count}: {status}");
    }
    // What gives way to the load does so along it.
    let along = "mean displacement along the load [length]";
    let pressed =
        |k: usize| number(&rows[k], along) + number(&rows[k], "mean displacement along z [length]");
    assert!((1..rows.len()).all(|k| pressed(k).abs() < 0.1 * number(&rows[k], along)));
    // The shape beyond the second fold is one that a run finds at rest.
    let state = format!("arch/frames/frame_{:06}.vtu", rows.len() - 1);
    let set = format!("{LOAD}=-2e-3");
    let inspected =
        rumple(at, &["inspect", "scene.toml", "--set", &set, "--state", &state, "--stability"]);
    let told = text(&inspected.stdout);
    assert!(told.contains("stable: every direction raises the energy"), "{told}");
    // Results are not lost by chance.
    let again = rumple(at, &args);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--force"), "{}", text(&again.stderr));
    let forced = [&args[..], &["--force", "--quiet", "--steps", "2"]].concat();
    let out = rumple(at, &forced);
    assert!(out.status.success() && out.stdout.is_empty(), "{}", text(&out.stderr));
    assert_eq!(table(&root).len(), 3);
    // From an equilibrium on the unstable part, which no relaxation would find.
    let state = format!("arch/frames/frame_{:06}.vtu", 1);
    let from = table(&root)[1][LOAD].clone();
    let from = format!("--from={from}");
    let to = ["follow", "scene.toml", "--along", LOAD, &from, "--to", "0", "--state", &state];
    let out = rumple(at, &[&to[..], &["-o", "backwards"]].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(&at.join("backwards"));
    assert!(number(&rows[rows.len() - 1], "largest displacement [length]") < 1e-6, "{rows:?}");
}

/// A flat strip whose end moves: Euler's load at a shortening of π²h²/(12 L), and a branch to each side.
#[test]
fn a_column_is_left_for_the_bent_one() {
    let scene = ARCH
        .replace("z = \"0.1*cos(pi*x/10)\"", "z = \"0*x\"")
        .replace("poisson = 0.3", "poisson = 0.3333333333333333")
        .replace("axes = \"xyz\"", "axes = \"xz\"")
        .replace("height = 1.5\nz", "height = 1.0\nz")
        .replace("vertices = 180", "vertices = 400");
    let held = "\n[[effect]]\nkind = \"pin\"\nwhere = { ball = { centre = [-5.0, -0.5, 0.0], radius = 0.01 } }\n\
                axes = \"y\"\n\n[time]";
    let folder = folder(&scene.replace("\n[time]", held));
    let key = "effect[3].displacement[0]";
    let args = ["follow", "scene.toml", "--along", key, "--to", "-0.0015", "--switch"];
    let more = ["--both-ways", "--longest-step", "0.3", "-o", "bent"];
    let out = rumple(folder.path(), &[&args[..], &more].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(&folder.path().join("bent"));
    let of = |branch: &str| rows.iter().filter(|row| row["branch"] == branch).collect::<Vec<_>>();
    let straight = of("0");
    let critical = straight.iter().find(|row| row["event"] == "bifurcation").unwrap();
    let exact = -std::f64::consts::PI.powi(2) * 0.01 / 120.0;
    let found = number(critical, key);
    let modes = format!("bent/modes/mode_{:06}.vtu", number(critical, "point"));
    let modes = rumple::sheet::read::surface(folder.path().join(modes)).unwrap();
    assert!(modes.point_arrays.iter().any(|array| array.name.starts_with("mode_1")));
    assert!((found / exact - 1.0).abs() < 0.03, "{found} {exact}");
    assert_eq!(number(straight[straight.len() - 1], "negative eigenvalues"), 1.0);
    let means = ["1", "2"].map(|branch| {
        let bent = of(branch);
        let last = bent[bent.len() - 1];
        assert_eq!((last["event"].as_str(), last["negative eigenvalues"].as_str()), ("end", "0"));
        // A = (2L/π) √(ε - ε_cr).
        let strain = (0.0015 + found) / 10.0;
        let amplitude = number(last, "amplitude of the critical mode");
        assert!((amplitude.abs() / number(last, "height [length]") - 1.0).abs() < 0.02);
        let height = number(last, "height [length]");
        assert!((height / (20.0 / std::f64::consts::PI * strain.sqrt()) - 1.0).abs() < 0.03);
        number(last, "mean displacement along z [length]")
    });
    assert!((means[0] + means[1]).abs() < 1e-6 * means[0].abs(), "{means:?}");
    // The diagram has a sign, and tells stable from unstable without colours.
    let amplitudes =
        ["1", "2"].map(|branch| number(of(branch)[5], "amplitude of the critical mode"));
    assert!(amplitudes[0] > 0.0 && amplitudes[1] < 0.0, "{amplitudes:?}");
    assert!(straight.iter().all(|row| number(row, "amplitude of the critical mode").abs() < 1e-6));
    let names = plots(&folder.path().join("bent"))["branch"]["names"].to_string();
    assert!(names.contains("stable (solid)") && names.contains("unstable (dashed)"));
}

/// The time of a ramp in place of the load: the same branch.
#[test]
fn the_time_of_a_ramp_is_a_parameter() {
    let force = "force = { per-area = [0.0, 0.0, 0.0] }";
    let ramp = "force = { per-area = [0.0, 0.0, -2e-3] }\nramp = { formula = \"t\" }";
    let folder = folder(&ARCH.replace(force, ramp));
    let of = |args: &[&str], out: &str, key: &str| -> Vec<f64> {
        let given = [&["follow", "scene.toml", "-o", out][..], args].concat();
        passes_with(folder.path(), &given);
        let rows = table(&folder.path().join(out));
        rows.iter().filter(|row| row["event"] == "fold").map(|row| number(row, key)).collect()
    };
    let times = of(&["--along", "time", "--to", "1"], "by-time", "time");
    let loads = ["--along", LOAD, "--from", "0", "--to", "-2e-3", "--time", "1"];
    let loads = of(&loads, "by-load", LOAD);
    assert_eq!((times.len(), loads.len()), (2, 2));
    for (time, load) in times.iter().zip(&loads) {
        assert!((load / (-2e-3 * time) - 1.0).abs() < 1e-6, "{time} {load}");
    }
}

#[test]
fn what_has_no_branch_is_refused() {
    let folder = folder(ARCH);
    let refused = |args: &[&str], words: &[&str]| {
        let out = rumple(folder.path(), &[&["follow", "scene.toml", "-o", "no"], args].concat());
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{args:?}: \"{word}\" is not in: {message}");
        }
        assert!(!folder.path().join("no").exists(), "{args:?}");
    };
    let along = |key: &'static str| ["--along", key, "--to", "0.2"];
    refused(&along("material.thicknes"), &["did you mean thickness?"]);
    refused(&along("effect.lod.force.per-area[2]"), &["did you mean load?"]);
    refused(&along("sheet.vertices"), &["another mesh", "rumple sweep"]);
    refused(&along("sheet.z"), &["another mesh"]);
    refused(&along("effect.bending.model"), &["the text \"hinge\"", "material.thickness"]);
    refused(
        &along("effect.load.force.per-area"),
        &["a table or a list", "effect[4].force.per-area[0]"],
    );
    refused(&along("effect.bending.curvature"), &["leaves this key out", "--from"]);
    refused(&along("time.until"), &["time.until", "equilibria do not depend"]);
    refused(&along("load.force.per-area[2]"), &["--along", "load"]);
    refused(&along("material.drag.per-vertex"), &["do not depend", "a load, a modulus"]);
    refused(&along("material.thickness=0.1"), &["a key alone"]);
    refused(&["--along", "material.thickness", "--to", "0.1"], &["both 0.1"]);
    refused(&["--along", "material.thickness", "--to", "-1"], &["must be a number above 0"]);
    refused(&["--along", "material.thickness", "--to", "x"], &["is not a number"]);
    refused(&["--along", "material.thickness"], &["--to"]);
    let with = |effect: &str, words: &[&str]| {
        let scene = ARCH.replace("[time]", &format!("{effect}\n[time]"));
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        refused(&along("material.thickness"), words);
    };
    with(
        "[[effect]]\nkind = \"contact\"\ndistance = 0.01\n",
        &["scene.toml", "effect[5]", "not followed with contact", "kinks"],
    );
    with(
        "[[effect]]\nkind = \"remodelling\"\ntime = 1.0\n",
        &["scene.toml", "effect[5]", "remodelling changes the shape at rest"],
    );
    fs::write(folder.path().join("scene.toml"), include_str!("../../models/plates/film.toml"))
        .unwrap();
    let thicker = ["--along", "material.thickness", "--to", "0.3"];
    refused(&thicker, &["sheet.periodic", "not followed on a periodic sheet"]);
}

/// A law without space, through both folds of its cubic, and its state in frames.
#[test]
fn a_bistable_law_is_followed_along_its_parameter() {
    let folder = folder(include_str!("../../models/kinetics/bistable.toml"));
    let along = ["follow", "scene.toml", "--along", "kinetics.parameters.a", "--to", "4"];
    let out = rumple(folder.path(), &[&along[..], &["-o", "bistable"]].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("bistable");
    let rows = table(&root);
    let folds: Vec<usize> = (0..rows.len()).filter(|k| rows[*k]["event"] == "fold").collect();
    let [up, back] = folds[..] else { panic!("{folds:?}") };
    for (fold, a, c) in [(up, 2.0, -1.0), (back, -2.0, 1.0)] {
        assert!((number(&rows[fold], "kinetics.parameters.a") - a).abs() < 1e-6);
        assert!((number(&rows[fold], "mean c") - c).abs() < 1e-3);
    }
    for (k, row) in rows.iter().enumerate().filter(|(k, _)| !folds.contains(k)) {
        let [a, c] = ["kinetics.parameters.a", "mean c"].map(|title| number(row, title));
        assert!((a + 3.0 * c - c.powi(3)).abs() < 1e-6, "{k}");
        let grows = f64::from(u8::from((up + 1..back).contains(&k)));
        assert_eq!(number(row, "negative eigenvalues"), grows, "{k}");
    }
    assert!(plots(&root)["branch"]["panels"][0]["title"].as_str().unwrap().contains("mean c"));
    // No rate reads it.
    let more = ["--along", "time.until", "--to", "2", "-o", "no"];
    let out = rumple(folder.path(), &[&["follow", "scene.toml"], &more[..]].concat());
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
}

/// Ctrl-C ends between two points, with all files whole.
#[test]
fn an_interrupted_branch_is_whole() {
    let folder = folder(ARCH);
    let args = ["follow", "scene.toml", "--along", LOAD, "--to", "-2e-3", "-o", "arch"];
    let more = ["--longest-step", "1e-4", "--steps", "20000"];
    let mut child = Command::new(super::program())
        .current_dir(folder.path())
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args(args)
        .args(more)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let root = folder.path().join("arch");
    let patience = Instant::now();
    let lines = || fs::read_to_string(root.join("branch.csv")).map_or(0, |t| t.lines().count());
    while lines() < 5 {
        assert!(patience.elapsed() < Duration::from_secs(60), "no step was made");
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let rows = table(&root);
    let pvd = fs::read_to_string(root.join("sheet.pvd")).unwrap();
    assert_eq!(pvd.matches("<DataSet").count(), rows.len());
    assert!(root.join("plots.json").is_file());
    assert!(fs::read_to_string(root.join("status.json")).unwrap().contains("\"interrupted\""));
}
