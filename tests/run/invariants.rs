//! Monitors of laws of nature: where they hold, and that planted violations are caught.

use std::path::Path;
use std::process::Output;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::output::ledger::value;
use rumple::scene::Scene;

use super::program::{folder, passes, rumple, text};
use crate::common;
use crate::common::shipped;
use crate::coupled::DOME;
use crate::plugins::build;

/// The columns of a ledger.
struct Ledger {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Ledger {
    fn of(directory: &Path) -> Self {
        let all = std::fs::read_to_string(directory.join("ledger.csv")).unwrap();
        let mut lines = all.lines();
        let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let row = |line: &str| line.split(',').map(|v| value(v).unwrap()).collect();
        Self { names, rows: lines.map(row).collect() }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let found = self.names.iter().position(|n| n == name);
        let k = found.unwrap_or_else(|| panic!("{name} in {:?}", self.names));
        self.rows.iter().map(|row| row[k]).collect()
    }

    fn last(&self, name: &str) -> f64 {
        *self.column(name).last().unwrap()
    }

    fn largest(&self, name: &str) -> f64 {
        self.column(name)
            .iter()
            .fold(0.0, |m, v| if v.abs() > m || v.is_nan() { v.abs() } else { m })
    }
}

/// A run by the program with these keys of `[invariants]` and others.
fn run(scene: &str, laws: &str, keys: &[&str]) -> (tempfile::TempDir, Output) {
    let folder = folder(&format!("{scene}\n[invariants]\n{laws}\n"));
    let mut args = vec!["run", "scene.toml", "--out", "result"];
    args.extend(keys.iter().flat_map(|key| ["--set", *key]));
    let out = rumple(folder.path(), &args);
    (folder, out)
}

/// The ledger of a run that keeps its laws.
fn kept(scene: &str, laws: &str, keys: &[&str]) -> Ledger {
    let (folder, out) = run(scene, laws, keys);
    assert!(out.status.success(), "{laws} {keys:?}: {}", text(&out.stderr));
    Ledger::of(&folder.path().join("result"))
}

/// What a run says that ends with this exit code.
fn refused(code: i32, scene: &str, laws: &str, keys: &[&str]) -> String {
    let (_folder, out) = run(scene, laws, keys);
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{laws} {keys:?}: {said}");
    said.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn assert_says(said: &str, all: &[&str]) {
    for part in all {
        assert!(said.contains(part), "`{part}` in {said}");
    }
}

/// A free sheet that grows where there is much of a, which turns into b and back.
const FREE: &str = r#"
[sheet]
shape = "disc"
radius = 6.0
vertices = 150
bump = { amplitude = 0.2, width = 3.0 }
[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 0.5
drag = 10.0
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "diffusion"
species = "a"
coefficient = 1.0
[[effect]]
kind = "diffusion"
species = "b"
coefficient = 0.1
[kinetics]
measure = "amount"
rates.a = "b - 2*a*mean_curvature^2 - a*b"
rates.b = "a*b + 2*a*mean_curvature^2 - b"
length_factor = "1 + 0.1*a"
initial.a = { gaussian = { width = 2.0, amplitude = 1.0 } }
initial.b = 0.1
[time]
policy = "simultaneous"
until = 1.0
"#;

const ALL: &str = "energy = 1e-2\nforce = 1e-9\ncrossings = 0\ntotals = { \"a + b\" = 1e-9 }";

#[test]
fn a_scene_that_keeps_all_laws_and_one_that_lists_none() {
    let (folder, out) = run(FREE, ALL, &[]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    for law in ["energy: at most", "force: at most", "crossings: at most 0"] {
        assert!(text(&out.stdout).contains(law), "{}", text(&out.stdout));
    }
    let plain = FREE.to_owned();
    std::fs::write(folder.path().join("plain.toml"), plain).unwrap();
    passes(folder.path(), "run plain.toml --out plain");
    let [held, free] = ["result", "plain"].map(|name| Ledger::of(&folder.path().join(name)));
    let added: Vec<&String> = held.names.iter().filter(|name| !free.names.contains(name)).collect();
    let expected = [
        "work against drag [energy]",
        "work of growth [energy]",
        "energy imbalance [energy]",
        "relative energy imbalance of the step",
        "change of the total of a + b [amount]",
        "net force [force]",
        "relative net force",
        "net torque [force length]",
        "relative net torque",
        "crossings [pairs of triangles]",
    ];
    assert_eq!(added, expected);
    assert_eq!(free.names.len() + added.len(), held.names.len());
    // Looking changes nothing of what is computed.
    for name in ["time", "total a", "total energy [energy]", "force residual"] {
        assert_eq!(held.column(name), free.column(name), "{name}");
    }
    let frame = |name: &str| {
        std::fs::read(folder.path().join(name).join("frames/frame_000001.vtu")).unwrap()
    };
    assert!(frame("result") == frame("plain"));
    // It moves: the laws had something to hold.
    assert!(
        held.last("work against drag [energy]") > 1e-3,
        "{}",
        held.last("work against drag [energy]")
    );
    assert!(held.largest("relative net force") > 0.0);
    let (a, largest) = (held.column("total a"), held.largest("total b"));
    assert!((a[0] - a[a.len() - 1]).abs() > 0.01 * largest);
}

/// What a species does by the tension that it sets is neither growth nor a load.
#[test]
fn the_work_of_species_is_in_the_balance_of_the_energy() {
    let tension = "[[effect]]\nkind = \"active-tension\"\nvalue = \"20*a\"\n[[effect]]\nkind = \"stretching\"";
    let scene = FREE.replacen("[[effect]]\nkind = \"stretching\"", tension, 1);
    assert!(scene.contains("active-tension"));
    for policy in ["simultaneous", "quasi-static"] {
        let ledger = kept(&scene, "energy = 1e-2", &[&format!("time.policy={policy:?}")]);
        let work = ledger.last("work of species [energy]");
        let energy = ledger.column("total energy [energy]");
        let fall = energy[0] - energy[energy.len() - 1];
        assert!(work.abs() > 0.1 * fall.abs() && work != 0.0, "{policy}: {work} of {fall}");
    }
}

/// Policies and shapes for which all of it holds as well.
#[test]
fn laws_hold_under_every_policy_on_open_and_closed_sheets() {
    for policy in ["quasi-static", "chemistry-fast"] {
        let steady = "kinetics.rates={a=\"0.1*exp(-t)*(b - a)\",b=\"0.1*exp(-t)*(a - b)\"}";
        let keys = [format!("time.policy={policy:?}")];
        let mut keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        let mut laws = ALL;
        if policy == "chemistry-fast" {
            // Its chemistry has no steady state of a total that stays.
            keys.push("kinetics.rates={a=\"exp(-t) - a\",b=\"a - b\"}");
            laws = "energy = 1e-2\nforce = 1e-9";
        } else {
            keys.push(steady);
        }
        kept(FREE, laws, &keys);
    }
    let sphere = FREE.replace("shape = \"disc\"", "shape = \"sphere\"");
    let sphere = sphere.replace("bump = { amplitude = 0.2, width = 3.0 }\n", "");
    let pressed = [
        "effect=[{kind=\"stretching\"},{kind=\"bending\"},{kind=\"pressure\",value=0.3}]",
        "kinetics.rates={a=\"0\",b=\"0\"}",
    ];
    kept(&sphere, ALL, &pressed);
}

/// Fall of the energy = works, to the order of the integrator: with growth and a pressure that stays.
#[test]
fn the_imbalance_of_the_energy_falls_with_the_order_of_the_integrator() {
    let imbalance = |integrator: &str, step: f64| {
        let key = format!("time.integrator={{{integrator}}}").replace("STEP", &format!("{step}"));
        let ledger = kept(DOME, "energy = true", &[&key, "time.until=0.8"]);
        assert!(ledger.last("work against drag [energy]") > 0.0);
        let steps = ledger.rows.len() as f64 - 1.0;
        (ledger.last("energy imbalance [energy]").abs(), steps)
    };
    let fixed = "kind=\"staggered\",method=\"euler\",shape=\"euler\",step=STEP";
    let controlled = "kind=\"staggered\",rtol=STEP,atol=STEP";
    for (integrator, [coarse, fine], [least, most]) in
        [(fixed, [0.02, 0.005], [0.8, 1.4]), (controlled, [1e-4, 1e-6], [1.6, 3.5])]
    {
        let [coarse, fine] = [coarse, fine].map(|step| imbalance(integrator, step));
        let order = (coarse.0 / fine.0).ln() / (fine.1 / coarse.1).ln();
        assert!(order > least && order < most, "{integrator}: {order} {coarse:?} {fine:?}");
    }
}

/// Ramps, pins that move and constraints do work of their own; without it the balance would be wrong by it.
#[test]
fn the_works_of_ramps_moved_pins_and_constraints_are_in_the_balance() {
    let base = "{kind=\"stretching\"},{kind=\"bending\"}";
    let closed = DOME.replace("shape = \"disc\"", "shape = \"sphere\"");
    let ramp = "ramp={formula=\"t\"}";
    let rim = "{kind=\"pin\",where=\"rim\",axes=\"z\"";
    let pole =
        "{kind=\"pin\",where={ring={inner=0.0,outer=4.0}},axes=\"z\",displacement=[0.0,0.0,2.0]";
    let cases = [
        (DOME, "work of loads [energy]", format!("{rim}}},{{kind=\"pressure\",value=0.5,{ramp}}}")),
        (DOME, "work of pins [energy]", format!("{rim}}},{pole},{ramp}}}")),
        (
            closed.as_str(),
            "work of constraints [energy]",
            "{kind=\"volume\",exact=true,ramp={formula=\"1 + 0.2*t\"}}".to_owned(),
        ),
    ];
    for (scene, work, more) in &cases {
        let effects = format!("effect=[{base},{more}]");
        for policy in ["quasi-static", "simultaneous"] {
            let keys = [
                effects.as_str(),
                &format!("time.policy={policy:?}"),
                "kinetics.initial.c=0.0",
                "kinetics.parameters.w=0.0",
                "time.integrator={kind=\"staggered\",rtol=1e-4,atol=1e-4,longest_step=0.02}",
            ];
            if work.contains("constraints") && policy == "simultaneous" {
                let said = refused(2, scene, "energy = true", &keys);
                assert_says(&said, &["under drag the work of a constraint", "stiffness"]);
                continue;
            }
            let ledger = kept(scene, "energy = true", &keys);
            let (done, left) = (ledger.largest(work), ledger.largest("energy imbalance [energy]"));
            assert!(done > 0.0 && left < 2e-2 * done, "{work}, {policy}: {done} {left}");
        }
    }
}

/// An obstacle that moves by many times its reach within a step does the work of its force on the sheet.
#[test]
fn the_work_of_an_obstacle_that_moves_is_in_the_balance() {
    let pressed = r#"
        effect = [
            { kind = "stretching", model = "stvk" },
            { kind = "bending", rest = "mesh" },
            { kind = "pin", where = "rim", axes = "xyz" },
            { kind = "obstacle", shape = { plane = { point = [0, 0, 1.1], normal = [0, 0, -1] } },
              displacement = [0, 0, -0.4], ramp = { formula = "t" } },
        ]
        sheet = { shape = "cap", radius = 2.0, height = 0.9, vertices = 250 }
        material = { young = 1e3, poisson = 0.3, thickness = 0.1, drag = 2.0 }
        time = { until = 1.0, integrator = { kind = "staggered", rtol = 1e-3, atol = 1e-3 } }
    "#;
    for policy in ["quasi-static", "simultaneous"] {
        let ledger = kept(pressed, "energy = true", &[&format!("time.policy={policy:?}")]);
        let done = ledger.largest("work of loads [energy]");
        let left = ledger.largest("energy imbalance [energy]");
        assert!(done > 0.1 && left < 5e-2 * done, "{policy}: {done} {left}");
    }
}

/// Beyond the limit the run ends at the state before, and says which law.
#[test]
fn a_crude_integrator_that_breaks_the_balance_of_the_energy_ends_the_run() {
    let crude = "time.integrator={kind=\"staggered\",method=\"euler\",shape=\"euler\",step=0.2}";
    let free = kept(DOME, "energy = true", &[crude]);
    let relative = "relative energy imbalance of the step";
    let imbalances = free.column(relative);
    let first = imbalances.iter().position(|value| *value > 0.005).unwrap();
    let (folder, out) = run(DOME, "energy = 0.005", &[crude]);
    let said = text(&out.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert_says(&said, &["balance of the energy", "energy allows 0.005", "rtol", "failure"]);
    // Up to there it is the run that is watched alone, to the bit.
    let result = folder.path().join("result");
    let held = Ledger::of(&result);
    assert_eq!(held.rows.len(), first);
    for name in ["time", "total energy [energy]", relative] {
        assert!(free.column(name).starts_with(&held.column(name)), "{name}");
    }
    let report = std::fs::read_to_string(result.join("failure/report.md")).unwrap();
    assert_says(&report, &["last good step", &format!("| {} |", first - 1), "drag takes up"]);
}

#[test]
fn a_law_that_makes_what_should_stay_is_caught() {
    let planted = "kinetics.rates.a=\"b - a + 0.01*step(t - 0.5)\"";
    let keys = [planted, "kinetics.rates.b=\"a - b\""];
    let said = refused(1, FREE, "totals = { \"a + b\" = 1e-9 }", &keys);
    // Steps end at the jump, up to which it holds.
    assert_says(&said, &["the total of a + b", "stopped at time 0.5", "the total was"]);
    // From the first step on; nothing dilutes a concentration on a sheet that moves.
    for (laws, key) in [
        ("totals = { \"a + b\" = 1e-9 }", "kinetics.rates.a=\"b - a + 0.01\""),
        ("totals = { a = 1e-9 }", planted),
        ("totals = { \"a + b\" = 1e-9 }", "kinetics.measure=\"concentration\""),
    ] {
        let said = refused(1, FREE, laws, &[key, "kinetics.rates.b=\"a - b\""]);
        assert_says(&said, &["the conservation of the total", "measure = \"amount\""]);
    }
    // Watched without a limit it is a column as any other.
    let ledger = kept(FREE, "totals = { a = true }", &[]);
    let (change, total) =
        (ledger.column("change of the total of a [amount]"), ledger.column("total a"));
    let fall = total[total.len() - 1] - total[0];
    assert!(fall != 0.0 && (change[change.len() - 1] - fall).abs() <= 1e-9 * total[0]);
    // With weights it may be one.
    let keys = ["kinetics.rates.a=\"2*b - 2*a\"", "kinetics.rates.b=\"a - b\""];
    kept(FREE, "totals = { \"a + 2 b\" = 1e-9 }", &keys);
    let said = refused(2, FREE, "totals = { \"a + d\" = true }", &[]);
    assert_says(&said, &["`d` is neither a species nor a number", "a, b"]);
}

#[test]
fn a_load_that_is_not_balanced_is_caught() {
    let load = |ramp: &str| {
        format!(
            "effect=[{{kind=\"stretching\"}},{{kind=\"bending\"}},{{kind=\"load\",where=\"all\",\
             force={{per-area=[0.01,0.0,0.0]}}{ramp}}}]"
        )
    };
    let later = load(",ramp={formula=\"step(t - 0.4)*step(0.5 - t)\"}");
    let keys = [later.as_str(), "time.integrator.longest_step=0.03"];
    let said = refused(1, FREE, "force = 1e-9", &keys);
    assert_says(
        &said,
        &["forces and torques of a free sheet", "does not hold at time 0.4", "load pulls with"],
    );
    let keys = [load(""), "time.start=\"given\"".to_owned()];
    let said = refused(1, FREE, "force = 1e-9", &keys.each_ref().map(String::as_str));
    assert_says(&said, &["does not hold at time 0", "load pulls with", "leave the limit out"]);
    // What pins carry.
    assert!(kept(DOME, "force = true", &[]).largest("net force [force]") > 0.0);
}

/// The pole of a sphere that is pushed through the other one.
#[test]
fn a_sheet_that_passes_through_itself_is_caught() {
    let scene = &shipped("models/hard/pushed.toml");
    let ledger = kept(scene, "crossings = true", &["time.until=0.83"]);
    assert!(ledger.last("crossings [pairs of triangles]") > 5.0);
    assert_eq!(ledger.column("crossings [pairs of triangles]")[0], 0.0);
    let said = refused(1, scene, "crossings = 0", &[]);
    assert_says(
        &said,
        &["does not pass through itself", "crossings allows 0", "first triangles", "near ("],
    );
}

/// A step that breaks a limit leaves the state as it was, to the bit; between evaluations nothing is said.
#[test]
fn a_step_that_breaks_a_limit_changes_nothing() {
    let planted = "kinetics.rates.a=\"b - a + 0.01*step(t - 0.5)\"";
    let scene = format!(
        "{FREE}\n[invariants]\nevery = 3\ncrossings = true\ntotals = {{ \"a + b\" = 1e-9 }}"
    );
    let keys = [planted, "kinetics.rates.b=\"a - b\"", "time.integrator.longest_step=0.04"];
    let (_, mut simulation) = common::prepare(&scene, &keys);
    simulation.prepare().unwrap();
    let error = loop {
        let before = simulation.state().clone();
        if let Err(error) = simulation.step(1.0) {
            assert!(*simulation.state() == before);
            break error;
        }
        assert!(simulation.state().time < 0.7);
    };
    assert!(
        matches!(&error, rumple::Error::Broken(broken) if broken.key == "totals.\"a + b\""),
        "{error}"
    );
    // Nor is it remembered: the same step breaks it by as much.
    let again = simulation.step(1.0).unwrap_err();
    assert_eq!(again.to_string(), error.to_string());
    let every = kept(FREE, "every = 3\ncrossings = true", &[]);
    for (step, count) in every.column("crossings [pairs of triangles]").iter().enumerate() {
        assert_eq!(count.is_nan(), step % 3 != 0, "{step}");
    }
}

#[test]
fn what_makes_no_sense_is_refused_with_its_place() {
    let refusal = |laws: &str, keys: &[&str]| {
        let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
        let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
        let made = Scene::parse(&format!("{FREE}\n[invariants]\n{laws}\n"), "scene.toml", &keys);
        let made = made.map_err(rumple::Error::from).and_then(|s| Simulation::new(&s, &search));
        match made {
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(error) => panic!("{error}"),
            Ok(_) => panic!("{laws} is accepted"),
        }
    };
    for (laws, keys, says) in [
        ("energy = false", &[][..], "true, to be watched"),
        ("energy = -1.0", &[], "a number from 0"),
        ("every = 0", &[], "an integer from 1"),
        ("gauss-bonnet = 1", &[], "gauss-bonnet is removed: leave it out"),
        ("totals = [\"a\"]", &[], "totals"),
        ("energy = true", &["effect=[]"], "no effect of the scene has an energy"),
        ("force = true", &["effect=[]"], "no effect of the scene has a force"),
    ] {
        let said = refusal(laws, keys);
        assert!(said.contains(says), "{laws}: {said}");
    }
}
