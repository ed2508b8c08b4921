//! The same bits on 1 and 4 threads, and where a run on one is continued with 2: both models of the
//! paper, every policy, every integrator.

use super::program::{folder, rumple, text};
use super::resumed::{assert_same, checkpoints, stopped};

/// A gentle dome: what differs is its kinetics. Parallel loops hand out blocks of 512 entries: there are two of vertices,
/// three of triangles and four of edges.
const SCENE: &str = r#"
[sheet]
shape = "disc"
radius = 20.0
vertices = 600
imperfection = { amplitude = 1e-3, seed = 7 }
[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 2.0
drag = 10.0
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
[[effect]]
kind = "pressure"
value = 0.5
[[effect]]
kind = "diffusion"
species = "SPECIES"
coefficient = 1.0
[invariants]
energy = true
force = true
crossings = true
[kinetics]
KINETICS
[output]
every = 0.005
[time]
until = 0.02
"#;

const MODELS: [(&str, &str, &str); 2] = [
    (
        "model I",
        "c",
        "plugin = \"curvature-feedback\"
        parameters = { c_star = 0.4, b = 3.0, w = 2.0, H_s = 0.5, lambda_min = 0.95 }
        initial.c = { gaussian = { width = 8.0, amplitude = 0.3 } }",
    ),
    (
        "model II",
        "m",
        "plugin = \"tension-feedback\"
        parameters = { a = 0.1, alpha = 0.05 }
        initial.m = { gaussian = { width = 8.0, amplitude = 0.3 } }",
    ),
];

/// The policies.
const ALL_POLICIES: &[&str] = &["quasi-static", "simultaneous", "chemistry-fast"];
const MOVING_POLICIES: &[&str] = &["simultaneous", "chemistry-fast"];
const SIMULTANEOUS_POLICY: &[&str] = &["simultaneous"];
const QUASI_STATIC_POLICY: &[&str] = &["quasi-static"];

/// Integrators with the policies that they fit, the time to which they run, and the time between checkpoints where those
/// are a part of what is computed.
#[rustfmt::skip]
const INTEGRATORS: [(&str, &[&str], &str, Option<&str>); 10] = [
    ("kind=\"staggered\",rtol=1e-3,atol=1e-3", ALL_POLICIES, "0.01", None),
    ("kind=\"staggered\",method=\"euler\",step=0.002", ALL_POLICIES, "0.01", None),
    ("kind=\"staggered\",rtol=1e-3,atol=1e-3,shape=\"euler\"", MOVING_POLICIES, "0.006", None),
    ("kind=\"staggered\",rtol=1e-3,atol=1e-3,chemistry=\"bdf\"", SIMULTANEOUS_POLICY, "0.003", None),
    ("kind=\"staggered\",rtol=1e-3,atol=1e-3,chemistry=\"esdirk34\"", QUASI_STATIC_POLICY, "0.01", None),
    ("kind=\"monolithic\",method=\"bdf\",rtol=1e-3,atol=1e-3", ALL_POLICIES, "0.003", Some("0.001")),
    ("kind=\"monolithic\",method=\"tr-bdf2\",rtol=1e-3,atol=1e-3", ALL_POLICIES, "0.003", Some("0.001")),
    ("kind=\"monolithic\",method=\"esdirk34\",rtol=1e-3,atol=1e-3", ALL_POLICIES, "0.003", Some("0.001")),
    ("kind=\"explicit\",step=2e-4", SIMULTANEOUS_POLICY, "0.002", None),
    ("kind=\"explicit\",method=\"tsit45\",rtol=1e-3,atol=1e-3", SIMULTANEOUS_POLICY, "0.003", Some("0.001")),
];

/// Runs it on 1 and on 4 threads, and on from the middle of the first with 2.
fn same_bits(scene: &str, name: &str, keys: &[&str]) {
    let folder = folder(scene);
    let run = |threads: &str| {
        let mut args = vec!["run", "scene.toml", "--out", threads, "--threads", threads, "--quiet"];
        args.extend(keys.iter().flat_map(|key| ["--set", *key]));
        let out = rumple(folder.path(), &args);
        assert!(out.status.success(), "{name} {keys:?}: {}", text(&out.stderr));
        folder.path().join(threads)
    };
    let [one, four] = ["1", "4"].map(run);
    assert_same(&one, &four, &format!("{name} {keys:?}, 4 threads"));
    let count = checkpoints(&one).len();
    assert!(count > 1, "{name} {keys:?}");
    let two = folder.path().join("2");
    stopped(&one, &two, (count - 1) / 2);
    let out = rumple(folder.path(), &["resume", "2", "--threads", "2", "--quiet"]);
    assert!(out.status.success(), "{name} {keys:?}: {}", text(&out.stderr));
    assert_same(&one, &two, &format!("{name} {keys:?}, continued with 2 threads"));
}

/// All that fits together of one model.
fn every_policy_and_integrator(model: usize) {
    let (name, species, kinetics) = MODELS[model];
    let scene = SCENE.replace("SPECIES", species).replace("KINETICS", kinetics);
    for (kind, policies, until, every) in INTEGRATORS {
        for policy in policies {
            let integrator = format!("time.integrator={{{kind}}}");
            let policy = format!("time.policy={policy:?}");
            let until: f64 = until.parse().unwrap();
            // Steps end at output times: there are three at least. Where checkpoints change nothing there are two.
            let frames = format!("output.every={}", until / 3.0);
            let every = every.map_or(until / 3.0, |every| every.parse().unwrap());
            let every = format!("checkpoint.every={every}");
            let until = format!("time.until={until}");
            let keys = [&policy, &integrator, &until, &frames, &every, "checkpoint.keep=100000"];
            same_bits(&scene, name, &keys);
        }
    }
}

#[test]
fn model_i_under_every_policy_by_every_integrator() {
    every_policy_and_integrator(0);
}

#[test]
fn model_ii_under_every_policy_by_every_integrator() {
    every_policy_and_integrator(1);
}

/// What the comparison is for: it tells runs apart that differ in the last digit of one number.
#[test]
fn a_last_digit_is_seen() {
    let (_, species, kinetics) = MODELS[0];
    let scene = SCENE.replace("SPECIES", species).replace("KINETICS", kinetics);
    let folder = folder(&scene);
    for (out, value) in [("a", "0.5"), ("b", "0.5000000000000001")] {
        let key = format!("effect[3].value={value}");
        let args = ["run", "scene.toml", "--out", out, "--set", &key, "--set", "time.until=0.005"];
        assert!(rumple(folder.path(), &args).status.success());
    }
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let differs = std::panic::catch_unwind(|| assert_same(&a, &b, "")).is_err();
    assert!(differs);
}
