//! `rumple fit`: parameters found again, their errors, what data do not determine, fits that go on, refusals.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::Noise;
use crate::gradient::PLATE;
use crate::run::program::{folder, passes_with, rumple, text};

/// The mean of u obeys du/dt = s - k u.
const DECAY: &str = r#"
sheet = { shape = "disc", radius = 3.0, vertices = 80 }
time = { until = 4.0, integrator = { kind = "staggered", rtol = 1e-6, atol = 1e-6 } }
effect = [{ kind = "diffusion", species = "u", coefficient = 0.2 }]
[kinetics]
rates.u = "s - k*u"
parameters = { k = 0.5, s = 0.3 }
initial.u = 2.0
"#;

/// The mean with the rates k and s, and its derivatives by them.
fn exact(t: f64, k: f64, s: f64) -> [f64; 3] {
    let (rest, decay) = (s / k, (-k * t).exp());
    let by_k = -rest / k * (1.0 - decay) - (2.0 - rest) * t * decay;
    [rest + (2.0 - rest) * decay, by_k, (1.0 - decay) / k]
}

fn fit(folder: &Path, rest: &[&str]) -> Value {
    let words = [&["fit", "scene.toml", "data.csv", "--json", "--quiet"], rest].concat();
    serde_json::from_str(&text(&passes_with(folder, &words).stdout)).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

const BOTH: [&str; 4] =
    ["--with", "kinetics.parameters.k=0.01:5", "--with", "kinetics.parameters.s=0:"];

#[test]
fn rates_are_found_with_their_standard_errors() {
    let (k, s, sigma) = (0.8, 0.4, 0.02);
    let folder = folder(DECAY);
    let mut noise = Noise::new(7);
    let mut table = String::from("# measured\nt, mean(u), sigma mean(u)\n");
    // JᵀJ of the exact solution.
    let mut product = [[0.0; 2]; 2];
    for step in 1..=40 {
        let t = 0.1 * f64::from(step);
        let [value, by_k, by_s] = exact(t, k, s);
        // A sum of twelve is nearly normal.
        let normal: f64 = (0..12).map(|_| noise.number()).sum::<f64>() / 2.0;
        writeln!(table, "{t}, {}, {sigma}", value + sigma * normal).unwrap();
        let row = [by_k, by_s];
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            product[i][j] += row[i] * row[j] / (sigma * sigma);
        }
    }
    fs::write(folder.path().join("data.csv"), table).unwrap();
    let found = fit(folder.path(), &BOTH);
    let values = numbers(&found["values"]);
    let errors = numbers(&found["uncertainty"]["standard"]);
    let determinant = product[0][0] * product[1][1] - product[0][1] * product[1][0];
    let expected = [product[1][1] / determinant, product[0][0] / determinant].map(f64::sqrt);
    for (n, exact) in [k, s].into_iter().enumerate() {
        assert!((values[n] - exact).abs() < 4.0 * errors[n], "{values:?} {errors:?}");
        // The errors are those at the values found, which are off by some per cent.
        assert!((errors[n] / expected[n] - 1.0).abs() < 0.1, "{errors:?} {expected:?}");
    }
    let chi = found["chi_squared"].as_f64().unwrap();
    assert!((10.0..80.0).contains(&chi), "{chi}");
    let of_run = found["chi_squared_of_run"].as_f64().unwrap();
    assert!((of_run - chi).abs() < 0.1, "{of_run} {chi}");
    let table = fs::read_to_string(folder.path().join("scene-fit/fitted.csv")).unwrap();
    assert_eq!(table.lines().count(), 41);
}

#[test]
fn what_data_do_not_determine_is_said() {
    let product = DECAY.replace("s - k*u", "s*k - u").replace("initial.u = 2.0", "initial.u = 0.0");
    let folder = folder(&product);
    let rows = (1..=4).map(|t| format!("{t},{}", 0.4 * (1.0 - (-f64::from(t)).exp())));
    let rows: Vec<String> = rows.collect();
    fs::write(folder.path().join("data.csv"), format!("t,mean(u)\n{}\n", rows.join("\n"))).unwrap();
    let words = [&["fit", "scene.toml", "data.csv", "--quiet"][..], &BOTH].concat();
    let said = text(&passes_with(folder.path(), &words).stdout);
    assert_eq!(said.matches("not determined\n").count(), 2, "{said}");
    let direction =
        said.lines().find(|line| line.starts_with("not determined by the data")).unwrap();
    for share in ["kinetics.parameters.k^", "kinetics.parameters.s^", "0.71"] {
        assert!(direction.contains(share), "{said}");
    }
    let found: Value = serde_json::from_str(
        &fs::read_to_string(folder.path().join("scene-fit/fit.json")).unwrap(),
    )
    .unwrap();
    let values = numbers(&found["values"]);
    assert!((values[0] * values[1] - 0.4).abs() < 1e-5, "{values:?}");
}

#[test]
fn a_modulus_from_heights_at_places() {
    // Without the pull along it the modulus and the load are one parameter at rest.
    let plate = PLATE.replace("[-0.3, 0.0, 0.4]", "[0.0, 0.0, 0.4]");
    let folder = folder(&plate);
    let path = folder.path();
    // Heights of a stiffer plate, between its vertices, of linear interpolation.
    passes_with(path, &["run", "scene.toml", "--set", "material.young=25e3", "--out", "stiff"]);
    let last = fs::read_dir(path.join("stiff/frames")).unwrap().map(|entry| entry.unwrap().path());
    let surface = rumple::sheet::read::surface(last.max().unwrap()).unwrap();
    let rest = rumple::scene::Scene::parse(&plate, "scene.toml", &[]).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    let rest = rumple::Simulation::new(&rest, &search).unwrap().state().x.to_vec();
    let mut table = String::from("x,y,uz\n");
    for corners in surface.triangles.iter().step_by(9) {
        let share = [0.2, 0.3, 0.5];
        let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
            corners.iter().zip(share).map(|(v, share)| share * of(*v as usize)).sum()
        };
        let (x, y) = (mean(&|v| rest[v].x), mean(&|v| rest[v].y));
        writeln!(table, "{x},{y},{}", mean(&|v| surface.points[v].z)).unwrap();
    }
    fs::write(path.join("data.csv"), table).unwrap();
    for start in [&[][..], &["--at-start"]] {
        let with = ["--with", "material.young=1e3:1e5", "--starts", "2", "--force"];
        let found = fit(path, &[&with, start].concat());
        let young = numbers(&found["values"])[0];
        assert!((young / 25e3 - 1.0).abs() < 1e-5, "{found}");
        assert_eq!(found["starts"].as_array().unwrap().len(), 2);
    }
    // At rest the load and the modulus are one parameter.
    let found = fit(
        path,
        &["--with", "material.young", "--with", "effect.load.force.per-area[2]", "--out", "both"],
    );
    let ratio = numbers(&found["values"]);
    assert!((ratio[0] / ratio[1] / (25e3 / 0.4) - 1.0).abs() < 1e-4, "{found}");
    assert!(found["uncertainty"]["standard"][0].is_null(), "{found}");
}

#[test]
fn a_rate_changes_its_sign_on_the_way() {
    let folder = folder(DECAY);
    let rows = (1..=6).map(|t| {
        let t = 0.5 * f64::from(t);
        format!("{t},{}", exact(t, -0.4, 0.3)[0])
    });
    let rows: Vec<String> = rows.collect();
    fs::write(folder.path().join("data.csv"), format!("t,mean(u)\n{}\n", rows.join("\n"))).unwrap();
    for start in ["0.5", "0.1", "0.0"] {
        let set = format!("kinetics.parameters.k={start}");
        let found =
            fit(folder.path(), &["--with", "kinetics.parameters.k", "--force", "--set", &set]);
        let k = numbers(&found["values"])[0];
        assert!((k + 0.4).abs() < 1e-4, "{start}: {found}");
    }
}

#[test]
fn an_interrupted_fit_goes_on_to_the_same_bytes() {
    let folder = folder(DECAY);
    let root = folder.path().join("scene-fit");
    let rows = (1..=8).map(|t| {
        let t = 0.5 * f64::from(t);
        format!("{t},{}", exact(t, 0.9, 0.1)[0])
    });
    let rows: Vec<String> = rows.collect();
    fs::write(folder.path().join("data.csv"), format!("t,mean(u)\n{}\n", rows.join("\n"))).unwrap();
    fit(folder.path(), &BOTH);
    let result = fs::read(root.join("fit.json")).unwrap();
    let record = fs::read_to_string(root.join("evaluations.jsonl")).unwrap();
    let lines: Vec<&str> = record.lines().collect();
    assert!(lines.len() > 6, "{}", lines.len());
    // As left by SIGKILL in the middle of a line.
    let part = format!("{}\n{}", lines[..5].join("\n"), &lines[5][..20]);
    fs::write(root.join("evaluations.jsonl"), part).unwrap();
    fs::remove_file(root.join("fit.json")).unwrap();
    fit(folder.path(), &BOTH);
    assert_eq!(fs::read_to_string(root.join("evaluations.jsonl")).unwrap(), record);
    assert_eq!(fs::read(root.join("fit.json")).unwrap(), result);
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let folder = folder(DECAY);
    let path = folder.path();
    let refused = |data: &str, with: &str, expected: &str| {
        fs::write(path.join("data.csv"), data).unwrap();
        let words = format!("fit scene.toml data.csv {with}");
        let done = rumple(path, &words.split(' ').collect::<Vec<_>>());
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{data}: {said}");
        assert!(said.contains(expected), "{data}: {said}");
    };
    let k = "--with kinetics.parameters.k";
    for (data, expected) in [
        ("t,mean(v)\n1,2\n", "data.csv: column mean(v): unknown name `v`"),
        ("t,mean(u)\n1,2\n2,many\n", "data.csv:3: mean(u): expected a number, not \"many\""),
        ("t,mean(u)\n1,2\n5,1\n", "data.csv:3: t = 5: expected a time from 0 to time.until = 4"),
        ("t,mean(u)\n,2\n", "data.csv:2: it has no time"),
        ("t,mean(u)\n1,2,3\n", "data.csv:2"),
        ("t,x,y,u\n1,9,0,1\n", "data.csv:2: (9, 0, 0) lies 6.0"),
        ("t,mean(u),sigma mean(u)\n1,2,0\n", "sigma mean(u): expected a number above 0"),
        ("t,sigma mean(u)\n1,2\n", "the column mean(u) is missing"),
        ("1,2\n3,4\n", "expected a head"),
        ("t;mean(u)\n1;2\n", "columns are separated by commas"),
        ("t,mean(u),mean(u)\n1,2,3\n", "mean(u) is there twice"),
        ("t\n1\n", "expected a column of a measure"),
        ("mean(u)\n1\n", "the data have no column t"),
        ("t,mean(u)\n", "0 values determine no 1 parameters"),
        ("", "expected a column of a measure"),
    ] {
        refused(data, k, expected);
    }
    let good = "t,mean(u)\n1,2\n";
    refused(good, "--with kinetics.parameters.k=1:2", "the scene has 0.5, which lies outside");
    refused(good, "--with kinetics.parameters.k=2:1", "2 is not below 1");
    refused(good, "--with kinetics.parameters.kk", "did you mean k?");
    refused(good, &format!("{k} --starts 3"), "need two bounds");
    refused(good, &format!("{k} --at-start"), "the data have times");
    fs::write(path.join("data.csv"), good).unwrap();
    fit(path, &["--with", "kinetics.parameters.k", "--out", "other"]);
    refused("t,mean(u)\n1,3\n", &format!("{k} --out other"), "--force removes it");
    refused(good, &format!("{k} --out ."), "is the scene of this command");
    fs::create_dir(path.join("full")).unwrap();
    fs::write(path.join("full/notes.txt"), "").unwrap();
    refused(good, &format!("{k} --out full"), "notes.txt, which no fit wrote");
}
