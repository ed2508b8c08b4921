//! What a sweep refuses, before anything is made.

use super::{GROWING, folder, rumple, text};

#[test]
fn bad_keys_and_values_are_refused_before_anything_is_made() {
    let over = "--over";
    let cases: [(&[&str], &[&str]); 16] = [
        (&[], &["--over", "--seeds"]),
        (&[over, "material.thickness="], &["material.thickness", "no values"]),
        (&[over, "material.thickness=1,1.0"], &["1 and 1.0"]),
        (
            &[over, "material.thikness=1,2"],
            &["--over:1:1", "material.thikness=1", "did you mean thickness"],
        ),
        (&[over, "thickness=1,2"], &["--over:1:1", "material.thickness"]),
        (&[over, "material.thickness=1,-2"], &["--over:1:20", "material.thickness=-2", "above 0"]),
        (&[over, "kinetics.parameter.a=1,2"], &["unknown key parameter", "parameters"]),
        (&[over, "sheet.seed=1,2", over, "sheet.seed=3,4"], &["sheet.seed", "twice"]),
        (
            &[over, "effect.bending.model=meyer", over, "effect[1].model=hinge"],
            &["effect[1].model"],
        ),
        (
            &[over, "sheet.bump.width=1,2", over, "sheet.bump={ amplitude = 1.0, width = 1.0 }"],
            &["sheet.bump.width", "clash"],
        ),
        (&[over, "material.thickness=1,2", "--set", "material.thickness=3"], &["clash", "--set"]),
        (&[over, "sheet.seed=1..2", "--seeds", "2"], &["sheet.seed", "twice"]),
        (&[over, "material.young=1..200", over, "sheet.seed=1..200"], &["10000"]),
        (&[over, "material.thickness=1,2", "--memory", "8GB"], &["--memory", "--jobs"]),
        (
            &[over, "material.thickness=1,2", "--slurm-option=-n1", "--slurm"],
            &["`--slurm` is gone", "--plan", "sweep member"],
        ),
        (&[over, "material.thickness=1,2", "--seeds", "0"], &["--seeds"]),
    ];
    for (args, expected) in cases {
        let folder = folder(GROWING);
        let all = [&["sweep", "scene.toml", "--out", "out"], args].concat();
        let out = rumple(folder.path(), &all);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {message}");
        for word in expected {
            assert!(message.contains(word), "{args:?}: {word} in {message}");
        }
        assert!(!folder.path().join("out").exists(), "{args:?}");
    }
}

/// Rows were equal, with a note that scrolled by.
#[test]
fn a_parameter_that_nothing_reads_is_neither_swept_over_nor_set() {
    let text_law = GROWING
        .replace("sqrt(a) - c", "sqrt(kappa) - c")
        .replace("{ a = 1.0 }", "{ kappa = 1.0, old = 2.0 }")
        .replace("[kinetics]", "[kinetics]\nlet.nowhere = \"old\"");
    let plugin =
        GROWING.replace("rates.c = \"sqrt(a) - c\"\nlength_factor = \"1 + 0.1*c\"", "PLUGIN");
    let plugin = plugin
        .replace("PLUGIN", "plugin = \"curvature-feedback\"")
        .replace("{ a = 1.0 }", "{ beta = 1.0 }");
    let cases: [(&str, &str, &str, &[&str]); 6] = [
        (&text_law, "--over", "kapp=0,1,2", &["[--over:1:1]", "nothing"]),
        (&text_law, "--over", "kapp=0,1,2", &["did you mean kappa? read: kappa"]),
        // Declared in the scene, and mentioned only by what nothing mentions.
        (&text_law, "--over", "old=1,2", &["no formula of the law reads", "read: kappa"]),
        (&plugin, "--over", "betta=0,1", &["no parameter `betta`", "did you mean `beta`?"]),
        (&text_law, "--set", "kapp=1", &["[--set:1:1]", "kappa"]),
        (&text_law, "--set", "kinetics.let.nowhere=\"2*old\"", &["reads this `let`", "read: none"]),
    ];
    for (scene, option, change, expected) in cases {
        let folder = folder(scene);
        let command = if option == "--set" { "run" } else { "sweep" };
        let place = if change.starts_with("kinetics") { "" } else { "kinetics.parameters." };
        let change = format!("{place}{change}");
        let out = rumple(folder.path(), &[command, "scene.toml", "--out", "out", option, &change]);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{change}: {message}");
        for word in expected {
            assert!(message.contains(word), "{change}: {word} in {message}");
        }
        assert!(!folder.path().join("out").exists(), "{change}");
    }
    // One that is read by way of a `let` may be set; in a scene without overrides it is a note.
    let scene = text_law.replace("sqrt(kappa)", "sqrt(kappa) + 0*nowhere");
    let folder_of = |scene: &str| folder(scene);
    let check = |scene: &str, extra: &[&str]| {
        let folder = folder_of(scene);
        let out = rumple(folder.path(), &[&["check", "scene.toml"][..], extra].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    let said = check(&scene, &["--set", "kinetics.parameters.old=3"]);
    assert!(!said.contains("reads its parameter"), "{said}");
    assert!(check(&text_law, &[]).contains("no formula of kinetics reads its parameter `old`"));
}

#[test]
fn a_directory_with_something_else_in_it_is_left_alone() {
    let folder = folder(GROWING);
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::fs::write(folder.path().join("out/thesis.txt"), "years").unwrap();
    let args = ["sweep", "scene.toml", "--out", "out", "--over", "material.thickness=1,2"];
    for force in [&[][..], &["--force"]] {
        let out = rumple(folder.path(), &[&args[..], force].concat());
        assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
        assert!(text(&out.stderr).contains("out"), "{}", text(&out.stderr));
        assert_eq!(std::fs::read_dir(folder.path().join("out")).unwrap().count(), 1);
    }
    for args in [&["sweep", "collect", "out"][..], &["sweep", "member", "out", "0"]] {
        let out = rumple(folder.path(), args);
        assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
        assert!(text(&out.stderr).contains("sweep.json"), "{}", text(&out.stderr));
    }
    // Nor may results go where the scene is.
    let out = rumple(folder.path(), &["sweep", "scene.toml", "--out", ".", "--seeds", "2"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
}

/// A file that scenes name, and that is another one now, is named.
#[test]
fn a_file_that_has_changed_is_named() {
    let scene = "sheet = { file = 'disc.obj' }\ntime = { until = 1.0 }\n\
                 [kinetics]\nrates.c = '-c'\ninitial.c = 1.0\n";
    let folder = folder(scene);
    let mesh = |vertices: &str| {
        let size = ["radius=5", "--vertices", vertices, "--out", "disc.obj", "--force"];
        let out = rumple(folder.path(), &[&["mesh", "generate", "disc"][..], &size].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
    };
    let sweep = ["sweep", "scene.toml", "--over", "time.until=1,2", "--out", "out"];
    mesh("100");
    assert!(rumple(folder.path(), &sweep).status.success());
    mesh("110");
    let out = rumple(folder.path(), &sweep);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("disc.obj has changed, for until = 1"), "{message}");
}
