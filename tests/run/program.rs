//! The program: results on the disk, exit codes, messages, interruption.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use super::{SMALL, program};
use crate::common::plots;
use crate::plugins::build;

pub fn rumple(directory: &Path, args: &[&str]) -> Output {
    let plugins = build::directory();
    Command::new(program())
        .current_dir(directory)
        .env("RUMPLE_PLUGIN_PATH", plugins)
        .args(args)
        .output()
        .unwrap()
}

/// Runs the program, which must succeed.
pub fn passes_with(directory: &Path, args: &[&str]) -> Output {
    let out = rumple(directory, args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    out
}

/// [`passes_with`] the arguments that blanks separate.
pub fn passes(directory: &Path, words: &str) -> Output {
    passes_with(directory, &words.split_whitespace().collect::<Vec<_>>())
}

pub fn folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_run_writes_what_it_promises() {
    let folder = folder(SMALL);
    passes(folder.path(), "run scene.toml --out result");
    let result = folder.path().join("result");
    let pvd = fs::read_to_string(result.join("sheet.pvd")).unwrap();
    for time in ["timestep=\"0\"", "timestep=\"0.25\"", "timestep=\"0.5\""] {
        assert!(pvd.contains(time), "{time} in {pvd}");
    }
    let ledger = fs::read_to_string(result.join("ledger.csv")).unwrap();
    let mut rows = ledger.lines();
    let columns: Vec<&str> = rows.next().unwrap().split(',').collect();
    for column in ["step", "time", "energy of bending [energy]", "force residual", "total c"] {
        assert!(columns.contains(&column), "{column} in {columns:?}");
    }
    let residual = columns.iter().position(|c| *c == "force residual").unwrap();
    for row in rows {
        let value: f64 = row.split(',').nth(residual).unwrap().parse().unwrap();
        assert!(value <= 1e-6, "{row}");
    }
    let provenance = fs::read_to_string(result.join("provenance.json")).unwrap();
    assert!(provenance.contains("libcurvature_feedback"), "{provenance}");
    // The resolved scene runs again, to the same last frame.
    passes(folder.path(), "run result/resolved.toml --out again");
    let frame = |name: &str| fs::read(folder.path().join(name).join("frames/frame_000002.vtu"));
    assert_eq!(frame("result").unwrap(), frame("again").unwrap());
    // A frame is a state: inspecting it gives an equilibrium.
    let inspected = rumple(
        folder.path(),
        &["inspect", "scene.toml", "--state", "result/frames/frame_000002.vtu", "--json", "o.json"],
    );
    assert!(inspected.status.success(), "{}", text(&inspected.stderr));
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("o.json")).unwrap()).unwrap();
    let last: Vec<f64> =
        ledger.lines().last().unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    let total = columns.iter().position(|c| *c == "total energy [energy]").unwrap();
    let reported = json["energy"]["total"].as_f64().unwrap();
    assert!((reported / last[total] - 1.0).abs() < 1e-12, "{reported} {}", last[total]);
}

#[test]
fn an_existing_result_is_not_overwritten_without_force() {
    let folder = folder(&SMALL.replace("until = 0.5", "until = 0.02"));
    let first = passes(folder.path(), "run scene.toml --out result --quiet");
    assert!(first.stdout.is_empty());
    let second = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    assert_eq!(second.status.code(), Some(2));
    assert!(text(&second.stderr).contains("--force"), "{}", text(&second.stderr));
    let third = rumple(folder.path(), &["run", "scene.toml", "--out", "result", "--force"]);
    assert!(third.status.success());
}

/// Amounts are per rest area: without reactions their total stays while the sheet grows.
#[test]
fn totals_of_amounts_are_over_rest_areas() {
    let folder = folder(
        &SMALL
            .replace("[kinetics]", "[kinetics]\nmeasure = \"amount\"")
            .replace("c_star = 0.1", "c_star = 0.02, w = 0.0, beta = 0.0"),
    );
    passes(folder.path(), "run scene.toml --out result");
    let ledger = fs::read_to_string(folder.path().join("result/ledger.csv")).unwrap();
    let rows: Vec<Vec<&str>> = ledger.lines().map(|row| row.split(',').collect()).collect();
    let column = rows[0].iter().position(|name| *name == "total c").unwrap();
    let totals: Vec<f64> = rows[1..].iter().map(|row| row[column].parse().unwrap()).collect();
    assert!(totals.len() > 2 && totals[0] > 0.0);
    for total in &totals {
        assert!((total / totals[0] - 1.0).abs() < 1e-10, "{totals:?}");
    }
}

#[test]
fn a_state_without_the_species_is_refused() {
    let folder = folder(&SMALL.replace("until = 0.5", "until = 0.02"));
    passes(folder.path(), "run scene.toml --out result");
    let frame = fs::read_to_string(folder.path().join("result/frames/frame_000000.vtu")).unwrap();
    let renamed = frame.replace("Name=\"c\"", "Name=\"other\"");
    assert_ne!(frame, renamed);
    fs::write(folder.path().join("bare.vtu"), renamed).unwrap();
    let args = ["inspect", "scene.toml", "--state", "bare.vtu", "--json", "o.json"];
    let out = rumple(folder.path(), &args);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("bare.vtu") && message.contains("species `c`"), "{message}");
    assert!(!folder.path().join("o.json").exists());
}

#[test]
fn mistakes_are_told_with_their_line_and_exit_code_two() {
    let cases: [(&str, &str, &[&str]); 9] = [
        ("kind = \"bending\"", "kind = \"bendig\"", &["bending"]),
        ("young = 1e6", "yuong = 1e6", &["young"]),
        ("thickness = 0.5", "thickness = -0.5", &["above 0"]),
        (
            "plugin = \"curvature-feedback\"",
            "plugin = \"curvature-fedback\"",
            &["curvature-feedback", "looked in"],
        ),
        ("c_star = 0.1", "c_stat = 0.1", &["c_star"]),
        ("b = 20.0", "b = -20.0", &["b"]),
        ("initial.c", "initial.d", &["species"]),
        ("until = 0.5", "until = ", &[]),
        ("every = 0.25", "fields = [\"curvature\"]", &["mean_curvature"]),
    ];
    for (right, wrong, expected) in cases {
        assert!(SMALL.contains(right), "{right}");
        let folder = folder(&SMALL.replacen(right, wrong, 1));
        let out = rumple(folder.path(), &["check", "scene.toml"]);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{wrong}: {message}");
        let line = 1 + SMALL[..SMALL.find(right).unwrap()].matches('\n').count();
        let place = format!("scene.toml:{line}:");
        for part in expected.iter().copied().chain([place.as_str()]) {
            assert!(message.contains(part), "{wrong}: no `{part}` in\n{message}");
        }
    }
}

#[test]
fn bad_files_end_with_exit_code_two() {
    let folder = folder(SMALL);
    fs::write(folder.path().join("cut.obj"), "v 0 0 0\nv 1 0 0\nf 1 2 3\n").unwrap();
    fs::write(folder.path().join("cut.vtu"), "<VTKFile type=\"Unstr").unwrap();
    fs::write(folder.path().join("noise.so"), [7u8; 300]).unwrap();
    let set = |assignment: &str| format!("--set={assignment}");
    let cases: [(Vec<String>, &str); 5] = [
        (vec!["check".into(), "missing.toml".into()], "missing.toml"),
        (vec!["check".into(), "scene.toml".into(), set("sheet={file=\"cut.obj\"}")], "cut.obj"),
        (
            vec!["inspect".into(), "scene.toml".into(), "--state".into(), "cut.vtu".into()],
            "cut.vtu",
        ),
        (
            vec!["check".into(), "scene.toml".into(), set("kinetics.plugin=\"./noise.so\"")],
            "noise.so",
        ),
        (vec!["mesh".into(), "check".into(), "cut.obj".into()], "cut.obj"),
    ];
    for (args, part) in cases {
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let out = rumple(folder.path(), &args);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.contains(part), "{args:?}: {message}");
        assert!(!message.contains("panicked"), "{args:?}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_whole_files() {
    let folder = folder(&SMALL.replace("until = 0.5", "until = 500.0"));
    let mut child = Command::new(program())
        .current_dir(folder.path())
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args(["run", "scene.toml", "--out", "result"])
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let ledger = folder.path().join("result/ledger.csv");
    let patience = Instant::now();
    while fs::read_to_string(&ledger).map_or(0, |t| t.lines().count()) < 4 {
        assert!(patience.elapsed() < Duration::from_secs(60), "no step was made");
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let pvd = fs::read_to_string(folder.path().join("result/sheet.pvd")).unwrap();
    assert!(pvd.trim_end().ends_with("</VTKFile>"));
    let times: Vec<f64> = pvd
        .split("timestep=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap().parse().unwrap())
        .collect();
    assert!(times.is_sorted_by(|a, b| a < b), "no frame is written twice: {times:?}");
    let frames = pvd.matches("<DataSet").count();
    assert_eq!(fs::read_dir(folder.path().join("result/frames")).unwrap().count(), frames);
    let ledger = fs::read_to_string(&ledger).unwrap();
    assert!(ledger.ends_with('\n'));
    let steps: Vec<u64> =
        ledger.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(steps.is_sorted_by(|a, b| a < b), "no step is written twice: {steps:?}");
}

#[test]
fn policies_and_integrators_are_compared() {
    let folder = folder(crate::coupled::DOME);
    let out = rumple(
        folder.path(),
        &[
            "compare",
            "scene.toml",
            "--out",
            "result",
            "--policies",
            "quasi-static,simultaneous",
            "--integrator",
            "staggered",
            "--integrator",
            "{ kind = \"monolithic\", method = \"tr-bdf2\" }",
            "--integrator",
            "{ kind = \"explicit\", step = 1e-3 }",
            "--set",
            "output.every=0.5",
        ],
    );
    let shown = text(&out.stdout);
    assert!(out.status.success(), "{shown}{}", text(&out.stderr));
    assert!(shown.contains("slowest mode of the shape"), "{shown}");
    assert!(shown.contains("quasi-static, explicit, Euler, step = 1e-3: "), "{shown}");
    assert!(shown.contains("under this policy the shape has none"), "{shown}");
    let again = rumple(folder.path(), &["compare", "scene.toml", "--out", "result", "--quiet"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("holds another sweep"), "{}", text(&again.stderr));
    let plots = plots(&folder.path().join("result"))["compare"]["names"].to_string();
    assert!(plots.contains("quasi-static, monolithic, TR-BDF2"), "{plots}");
    let table = fs::read_to_string(folder.path().join("result/compare.csv")).unwrap();
    // Five members at three times, and the header.
    assert_eq!(table.lines().count(), 16, "{table}");
    let last = |member: &str| -> Vec<f64> {
        let row = table.lines().rfind(|row| row.starts_with(member)).unwrap();
        let row = &row[member.len()..];
        // What has no value is empty.
        row.split(',').skip(1).map(|v| v.parse().unwrap_or(f64::NAN)).collect()
    };
    let same = last("\"quasi-static, monolithic, TR-BDF2\"");
    let other = last("\"simultaneous, monolithic, TR-BDF2\"");
    // One spot has no distance from another.
    let nearest = |row: &str| row.rsplit('"').next().and_then(|r| r.split(',').nth(9)) == Some("");
    assert!(!table.contains("NaN") && table.lines().skip(1).all(nearest), "{table}");
    // The last row of a member has what its steps took.
    let title = |name: &str| table.lines().next().unwrap().split(',').position(|t| t == name);
    for count in ["steps", "evaluations", "newton iterations", "factorisations"] {
        assert!(last("\"quasi-static, monolithic, TR-BDF2\"")[title(count).unwrap() - 1] > 0.0);
    }
    assert!(!shown.contains("NaN"), "{shown}");
    // Time, then the distances of shape and species from the first member.
    assert_eq!(same[0], 1.0);
    assert!(same[1] < 1e-2 && same[2] < 1e-2, "{same:?}");
    assert!(other[1] > same[1], "{other:?} {same:?}");
    for file in ["sheet.pvd", "resolved.toml", "provenance.json"] {
        let member = "result/members/pairing=quasi-static,-monolithic,-TR-BDF2";
        let member = folder.path().join(member);
        assert!(member.join(file).exists(), "{file}");
    }
}

#[test]
fn a_point_has_a_ledger_and_no_frames() {
    let folder = folder(
        "[sheet]\nshape = \"point\"\n[kinetics]\nplugin = \"brusselator\"\n\
         initial = { u = 1.0, v = 1.0 }\n[time]\nintegrator = \"monolithic\"\nuntil = 5.0\n",
    );
    passes(folder.path(), "run scene.toml --out result");
    let ledger = fs::read_to_string(folder.path().join("result/ledger.csv")).unwrap();
    assert!(ledger.lines().next().unwrap().ends_with("wall time [s],u,v"), "{ledger}");
    assert!(ledger.lines().last().unwrap().split(',').nth(1) == Some("5"), "{ledger}");
    assert!(!folder.path().join("result/sheet.pvd").exists());
    passes(folder.path(), "check scene.toml");
}

/// A run starts from a frame of another: the same positions and species, relaxed as every start is.
#[test]
fn a_run_starts_from_a_state() {
    let folder = folder(SMALL);
    passes(folder.path(), "run scene.toml --out first");
    let from = "first/frames/frame_000002.vtu";
    passes_with(folder.path(), &["run", "scene.toml", "--from", from, "--out", "second"]);
    let json = fs::read_to_string(folder.path().join("second/provenance.json")).unwrap();
    let provenance: serde_json::Value = serde_json::from_str(&json).unwrap();
    let digest = Sha256::digest(fs::read(folder.path().join(from)).unwrap());
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(provenance["state"]["sha256"], digest);
    assert!(provenance["state"]["path"].as_str().unwrap().ends_with(from), "{json}");
    let total = |run: &str, row: fn(&str) -> &str| -> f64 {
        let ledger = fs::read_to_string(folder.path().join(run).join("ledger.csv")).unwrap();
        let column =
            ledger.lines().next().unwrap().split(',').position(|t| t == "total c").unwrap();
        row(&ledger).split(',').nth(column).unwrap().parse().unwrap()
    };
    let last = total("first", |ledger| ledger.lines().last().unwrap());
    let start = total("second", |ledger| ledger.lines().nth(1).unwrap());
    assert!((start / last - 1.0).abs() < 1e-6, "{start} {last}");

    for (from, said) in [("nowhere.vtu", "nowhere.vtu"), ("scene.toml", "scene.toml")] {
        let out = rumple(folder.path(), &["run", "scene.toml", "--from", from, "--out", "third"]);
        assert_eq!(out.status.code(), Some(2), "{from}");
        assert!(text(&out.stderr).contains(said), "{}", text(&out.stderr));
        assert!(!folder.path().join("third").exists());
    }
    // What is read is not written over.
    let out =
        rumple(folder.path(), &["run", "scene.toml", "--from", from, "--out", "first", "--force"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(folder.path().join(from).exists());
}
