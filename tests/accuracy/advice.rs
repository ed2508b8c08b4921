//! The advice is the cheapest run that is accurate enough.

use std::fs;

use super::{DECAY, GROWING, folder, number, rumple, study, table, text};

#[test]
fn the_cheapest_run_that_is_accurate_enough_is_recommended() {
    for want in ["0.05", "1e-3"] {
        let (folder, out) = study(DECAY, &["--want", want]);
        assert!(out.status.success(), "{}", text(&out.stderr));
        let want: f64 = want.parse().unwrap();
        let rows = table(folder.path());
        let good = rows.iter().filter(|row| {
            row["status"] == "complete" && number(row, "error of the species") <= want
        });
        let best =
            good.min_by(|a, b| number(a, "steps [s]").total_cmp(&number(b, "steps [s]"))).unwrap();
        let said = text(&out.stdout);
        let name = format!("{}, ", best["integrator"]);
        let advice = said.split_once(": ").unwrap().1;
        assert!(advice.starts_with(&name), "{said}\n{best:?}");
        let tolerance = format!("{:e}", number(best, "tolerance"));
        assert!(advice.contains(&tolerance), "{said}\n{best:?}");
    }
}

#[test]
fn an_error_that_no_run_has_is_not_promised() {
    let (_folder, out) = study(DECAY, &["--want", "1e-14", "--tolerances", "1e-1,1e-2"]);
    let said = text(&out.stdout);
    assert!(said.contains("no run is as accurate"), "{said}");
    assert!(said.contains("tighter --tolerances"), "{said}");
}

#[test]
fn the_spread_of_seeds_is_what_an_error_is_compared_with() {
    let noise =
        "bump = { amplitude = 0.3, width = 2.0 }, imperfection = { amplitude = 0.05, seed = 3 }";
    let scene = GROWING.replace("bump = { amplitude = 0.3, width = 2.0 }", noise);
    let arguments = ["--of", "energy", "--want", "1e-9", "--tolerances", "1e-1,1e-2,1e-3"];
    let (folder, out) = study(&scene, &arguments);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let said = text(&out.stdout);
    assert!(said.contains("Other random numbers change the energy by"), "{said}");
    assert!(said.contains("below the seed-to-seed spread"), "{said}");
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("Spread over 3 seeds"), "{page}");
}

#[test]
fn bad_arguments_are_refused_before_anything_is_made() {
    let cases: [(&[&str], &str); 15] = [
        (&["--want", "0"], "a share above 0"),
        (&["--tolerances", "1e-2,none"], "`none` is not a number between 0 and 1"),
        (&["--tolerances", "2"], "`2` is not a number between 0 and 1"),
        (&["--tolerances", ""], "no values"),
        (&["--integrator", "stagered"], "did you mean staggered"),
        (&["--integrator", "stagered"], "[--integrator:1:26]"),
        (&["--integrator", "explicit"], "an explicit integrator needs a rate"),
        (&["--of", "colour"], "possible values"),
        (&["--over", "material.thickness=1,2"], "with --set KEY=VALUE"),
        (&["--repeats", "3"], "`--repeats` is gone: the processor time of one run is taken"),
        (&["--integrator", "explicit"], "[--integrator:1:17]"),
        (&["--reference", "explicit"], "[--reference:1:17]"),
        (&["--integrator", "bdf"], "write { kind = \"monolithic\", method = \"bdf\" }"),
        (&["--tolerances", "1e-30"], "--tolerances 1e-30: below 1e-13"),
        (&["--limit", "0.3"], "a whole number of seconds"),
    ];
    refused(GROWING, &cases);
}

/// Each of the options is refused with what is expected, and nothing is made.
fn refused(scene: &str, cases: &[(&[&str], &str)]) {
    for (arguments, expected) in cases {
        let (folder, out) = study(scene, arguments);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
        assert!(!folder.path().join("out").exists(), "{arguments:?}");
    }
}

/// What a scene has not is refused, and what changes nothing.
#[test]
fn what_the_scene_lacks_is_refused() {
    let cases: [(&[&str], &str); 2] = [
        (&["--of", "shape"], "nothing moves in this scene"),
        (&["--of", "amplitude"], "nothing moves in this scene"),
    ];
    refused(DECAY, &cases);
    let (scene, folder) = ("scene.toml", folder(DECAY));
    let out = rumple(folder.path(), &["accuracy", scene, "--out", scene]);
    let message = text(&out.stderr);
    assert!(message.contains("it is the scene of this command"), "{message}");
}

/// The settings that are recommended can be pasted behind `rumple run`, with numbers as people write them.
#[test]
fn what_is_recommended_can_be_pasted() {
    let fixed = ["--integrator", "{ kind = \"staggered\", method = \"euler\" }", "--want", "1"];
    let (_folder, out) = study(DECAY, &[&fixed[..], &["--tolerances", "0.3,1e-3"]].concat());
    let (said, told) = (text(&out.stdout), text(&out.stderr));
    let expected =
        "To run it: --set 'time.integrator={ kind = \"staggered\", method = \"euler\", step = ";
    assert!(said.contains(expected) && !said.contains("tol ="), "{said}{told}");
    assert!(told.contains("--want 1: an error of 100 %"), "{told}");
}

/// Gathering makes no runs: options of runs are refused.
#[test]
fn what_gathering_cannot_change_is_refused() {
    let (folder, out) = study(DECAY, &["--tolerances", "1e-1,1e-2"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    for option in [["--tolerances", "1e-3"], ["--seeds", "1"], ["--limit", "9"]] {
        let out = rumple(folder.path(), &[&["accuracy", "out"][..], &option].concat());
        assert_eq!(out.status.code(), Some(2), "{option:?}");
        assert!(text(&out.stderr).contains(option[0]), "{}", text(&out.stderr));
    }
}
