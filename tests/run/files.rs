//! What a command may write to: nothing that it reads, nothing that is not its own.

use std::fs;
use std::path::Path;

use super::SMALL;
use super::program::{folder, passes, rumple, text};

/// The small scene with a time that takes no time.
fn short() -> String {
    SMALL.replace("until = 0.5", "until = 0.02")
}

fn refused(folder: &Path, args: &[&str], parts: &[&str]) {
    let out = rumple(folder, args);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "{args:?}: no {part} in {message}");
    }
}

fn done(folder: &Path, args: &[&str]) {
    let out = rumple(folder, args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
}

#[test]
fn force_does_not_destroy_the_scene_that_is_run() {
    let folder = folder(&short());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "a", "--quiet"]);
    for out in ["a", "./b/../a", "."] {
        fs::create_dir_all(folder.join("b")).unwrap();
        let args = ["run", "a/resolved.toml", "--out", out, "--force"];
        refused(folder, &args, &["resolved.toml", "the scene"]);
        let args = ["compare", "a/resolved.toml", "--out", out, "--force"];
        refused(folder, &args, &["resolved.toml", "the scene"]);
    }
    for left in ["a/resolved.toml", "a/sheet.pvd", "a/frames/frame_000000.vtu", "a/ledger.csv"] {
        assert!(folder.join(left).is_file(), "{left}");
    }
}

#[test]
fn force_does_not_destroy_meshes_and_starts() {
    let folder = folder(&short());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "a", "--quiet"]);
    let frame = "a/frames/frame_000000.vtu";
    let before = fs::read(folder.join(frame)).unwrap();
    let mesh = format!("sheet={{ file = \"{frame}\" }}");
    let start = format!("kinetics.initial.c={{ file = \"{frame}\", array = \"c\" }}");
    for (set, key) in [(&mesh, "sheet.file"), (&start, "kinetics.initial.c")] {
        let args = ["run", "scene.toml", "--out", "a", "--force", "--set", set];
        refused(folder, &args, &[key, "frame_000000.vtu"]);
        assert_eq!(fs::read(folder.join(frame)).unwrap(), before);
    }
    assert!(folder.join("a/sheet.pvd").is_file(), "nothing is removed before it is refused");
}

#[cfg(unix)]
#[test]
fn force_removes_nothing_through_links() {
    use std::os::unix::fs::symlink;
    let folder = folder(&short());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "other", "--quiet"]);
    fs::create_dir(folder.join("a")).unwrap();
    symlink("../other/frames", folder.join("a/frames")).unwrap();
    symlink("other", folder.join("link")).unwrap();
    for out in ["a", "link"] {
        let args = ["run", "scene.toml", "--out", out, "--force"];
        refused(folder, &args, &["link"]);
    }
    refused(folder, &["compare", "scene.toml", "--out", "link", "--force"], &["link"]);
    assert!(folder.join("other/frames/frame_000000.vtu").is_file());
    assert!(folder.join("other/ledger.csv").is_file());
    // What is written over is the link, not what it leads to.
    fs::remove_file(folder.join("a/frames")).unwrap();
    symlink("../other/ledger.csv", folder.join("a/ledger.csv")).unwrap();
    let ledger = fs::read(folder.join("other/ledger.csv")).unwrap();
    let args = ["run", "scene.toml", "--out", "a", "--force", "--set", "output.every=0.01"];
    done(folder, &args);
    assert_eq!(fs::read(folder.join("other/ledger.csv")).unwrap(), ledger);
    assert!(!fs::symlink_metadata(folder.join("a/ledger.csv")).unwrap().is_symlink());
}

#[test]
fn a_success_keeps_nothing_of_an_earlier_failure() {
    let folder = folder(&short());
    let a = folder.path().join("a");
    fs::create_dir_all(a.join("modes")).unwrap();
    fs::create_dir_all(a.join("failure")).unwrap();
    let old = ["failed.vtu", "events.csv", "status.json", "modes/mode_000000.vtu", "notes.txt"];
    for old in old.iter().chain(&["failure/report.md", "failure/state.vtu"]) {
        fs::write(a.join(old), "old").unwrap();
    }
    done(folder.path(), &["run", "scene.toml", "--out", "a", "--force", "--quiet"]);
    for gone in ["failed.vtu", "events.csv", "modes", "failure"] {
        assert!(!a.join(gone).exists(), "{gone}");
    }
    assert!(fs::read_to_string(a.join("status.json")).unwrap().contains("complete"));
    assert_eq!(fs::read_to_string(a.join("notes.txt")).unwrap(), "old");
}

#[test]
fn compare_overwrites_nothing_foreign() {
    let folder = folder(&short());
    let folder = folder.path();
    fs::create_dir(folder.join("a")).unwrap();
    let mine = folder.join("a/compare.csv");
    fs::write(&mine, "mine").unwrap();
    for force in [&[][..], &["--force"]] {
        let args = [&["compare", "scene.toml", "--out", "a"][..], force].concat();
        refused(folder, &args, &["is not empty and holds no sweep"]);
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
    }
    // Its own results are continued, and replaced by force; what else is there stays.
    let compare = ["compare", "scene.toml", "--out", "b", "--quiet"];
    done(folder, &compare);
    fs::write(folder.join("b/notes.txt"), "mine").unwrap();
    let status = || fs::read_to_string(folder.join("b/status.json")).unwrap();
    assert!(status().contains("\"complete\"") && status().contains("1 member: 1 complete"));
    done(folder, &compare);
    let other = ["--set", "output.every=0.01", "--force"];
    done(folder, &[&compare[..], &other].concat());
    assert_eq!(fs::read_to_string(folder.join("b/notes.txt")).unwrap(), "mine");
}

#[test]
fn inspect_overwrites_nothing_unless_forced_and_never_what_it_reads() {
    let folder = folder(&short());
    let folder = folder.path();
    fs::write(folder.join("mine"), "mine").unwrap();
    for option in ["--json", "--vtu", "--out"] {
        refused(folder, &["inspect", "scene.toml", option, "mine"], &["mine", "--force"]);
        assert_eq!(fs::read_to_string(folder.join("mine")).unwrap(), "mine");
        for force in [&["--force"][..], &[]] {
            let args = [&["inspect", "scene.toml", option, "scene.toml"][..], force].concat();
            refused(folder, &args, &["scene.toml", "the scene"]);
        }
        assert_eq!(fs::read_to_string(folder.join("scene.toml")).unwrap(), short());
    }
    done(folder, &["inspect", "scene.toml", "--vtu", "start.vtu"]);
    let start = fs::read(folder.join("start.vtu")).unwrap();
    let args = ["inspect", "scene.toml", "--state", "start.vtu", "--vtu", "start.vtu", "--force"];
    refused(folder, &args, &["start.vtu", "the state"]);
    assert_eq!(fs::read(folder.join("start.vtu")).unwrap(), start);
    let args = ["inspect", "scene.toml", "--json", "none/o.json"];
    refused(folder, &args, &["no directory"]);
    done(folder, &["inspect", "scene.toml", "--json", "mine", "--force"]);
    assert!(fs::read_to_string(folder.join("mine")).unwrap().starts_with('{'));
}

#[test]
fn a_dash_is_standard_output_and_no_file() {
    let folder = folder(&short());
    let out = passes(folder.path(), "inspect scene.toml --json - --stability --modes 1");
    let value: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(value["stability"].is_object());
    assert!(!folder.path().join("-").exists());
}

#[test]
fn mesh_generate_overwrites_nothing_unless_forced() {
    let folder = folder(&short());
    let folder = folder.path();
    fs::write(folder.join("disc.obj"), "mine").unwrap();
    let args = ["mesh", "generate", "disc", "radius=5", "--vertices", "50", "--out"];
    refused(folder, &[&args[..], &["disc.obj"]].concat(), &["disc.obj", "--force"]);
    assert_eq!(fs::read_to_string(folder.join("disc.obj")).unwrap(), "mine");
    done(folder, &[&args[..], &["disc.obj", "--force"]].concat());
    assert!(fs::read_to_string(folder.join("disc.obj")).unwrap().starts_with("v "));
    assert_eq!(fs::read_dir(folder).unwrap().count(), 2, "nothing is left beside it");
}
