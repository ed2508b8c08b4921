//! References: kept, flagged; studies that go on.

use std::fs;

use super::{DECAY, again, errors, study, table, text};

#[test]
fn a_study_goes_on_with_the_runs_that_are_left() {
    let (folder, out) = study(DECAY, &["--tolerances", "1e-1,1e-2"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let before = table(folder.path());
    let member = folder.path().join("out/members/run=monolithic,-BDF,-1e-2");
    fs::remove_dir_all(&member).unwrap();
    let out = crate::run::program::rumple(folder.path(), &["accuracy", "out"]);
    assert!(text(&out.stdout).starts_with("Incomplete: 1 of "), "{}", text(&out.stdout));
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.lines().take(4).any(|line| line.contains("Incomplete: 1 of ")), "{page}");
    let out = again(folder.path(), &["--tolerances", "1e-1,1e-2"]);
    let said = text(&out.stderr);
    assert!(out.status.success(), "{said}");
    assert_eq!(said.matches(": begun").count(), 1, "{said}");
    assert_eq!(errors(&before), errors(&table(folder.path())));
    // What there is can be gathered again from its folder alone.
    let out = crate::run::program::rumple(folder.path(), &["accuracy", "out"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
}

#[test]
fn a_run_that_was_given_up_is_made_again_if_it_may_take_longer() {
    let arguments = |limit| ["--tolerances", "1e-1", "--limit", limit];
    let (folder, out) = study(DECAY, &arguments("50"));
    assert!(out.status.success(), "{}", text(&out.stderr));
    let path = folder.path().join("out/members/run=monolithic,-BDF,-1e-1/status.json");
    let given_up = || {
        let mut status: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(status["status"], "complete");
        status["status"] = "failed".into();
        let reason =
            "given up at t = 0.2: less than 1 % of its way in 20 % of the time limit of 50 s";
        status["reason"] = reason.into();
        fs::write(&path, status.to_string()).unwrap();
    };
    for (limit, begun) in [("50", 0), ("20", 0), ("60", 1)] {
        given_up();
        let said = text(&again(folder.path(), &arguments(limit)).stderr);
        assert_eq!(said.matches(": begun").count(), begun, "--limit {limit}: {said}");
        if begun == 0 {
            let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
            assert!(page.contains("1e-1: failed: given up"), "{page}");
            let back = fs::read_to_string(&path).unwrap().replace("failed", "complete");
            fs::write(&path, back).unwrap();
        }
    }
}

#[test]
fn without_a_reference_errors_are_not_known() {
    let arguments =
        ["--reference", "{ kind = \"staggered\", method = \"euler\" }", "--tolerances", "1e-1"];
    let scene = DECAY.replace("-k*c", "sqrt(0.5 - t)");
    let (_folder, out) = study(&scene, &arguments);
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert!(said.contains("errors are not known"), "{said}");
}

/// A clamped disc that grows, perfectly flat: all integrators stay on the saddle that it becomes, and agree.
const SADDLE: &str = r#"
sheet = { shape = "disc", radius = 10.0, vertices = 100 }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
time = { policy = "quasi-static", until = 0.2 }
output = { every = 0.1 }

[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "xyz"

[kinetics]
rates.g = "1"
length_factor = "1 + 0.02*g"
initial.g = 0.0
"#;

#[test]
fn references_on_a_saddle_are_flagged_as_unreliable() {
    let arguments = [
        &["--integrator", "staggered", "--tolerances", "1e-1", "--seeds", "0"][..],
        &[
            "--reference",
            "staggered",
            "--reference",
            "{ kind = \"staggered\", rtol = 5e-3, atol = 5e-3 }",
        ],
    ];
    let unstable = "branch that is unstable";
    let (folder, out) = study(SADDLE, &arguments.concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains(unstable), "{}", text(&out.stdout));
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("From t = 0.0"), "{page}");
    // One set to leave saddles does.
    let left = format!("{SADDLE}\n[stability]\nperturb = 0.01\n");
    let (_folder, out) = study(&left, &arguments.concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(!text(&out.stdout).contains(unstable), "{}", text(&out.stdout));
}
