//! Sweeps that were killed, and go on.

use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::{GROWING, folder, rows, rumple, statuses, text};
use crate::run::program::{passes, passes_with};

const ARGS: [&str; 8] = [
    "sweep",
    "scene.toml",
    "--out",
    "out",
    "--over",
    "material.thickness=0.5..0.7:3",
    "--jobs",
    "1",
];

/// The growing sheet in many small steps, so that a member takes a while.
pub fn slow() -> String {
    let scene = GROWING.replace("\"heun\", step = 0.01", "\"euler\", step = 2e-4");
    assert_ne!(scene, GROWING);
    scene + "\n[output]\nevery = 0.02\n"
}

fn start(folder: &Path) -> Child {
    Command::new(crate::run::program())
        .current_dir(folder)
        .args(ARGS)
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits until `is`, and panics if that takes too long.
pub fn wait_until(what: &str, mut is: impl FnMut() -> bool) {
    let since = Instant::now();
    while !is() {
        assert!(since.elapsed() < Duration::from_secs(300), "{what}: too long");
        sleep(Duration::from_millis(20));
    }
}

pub fn status_of(member: &Path) -> String {
    said_at_its_end(member, "status")
}

fn said_at_its_end(member: &Path, key: &str) -> String {
    let text = fs::read_to_string(member.join("status.json")).unwrap_or_default();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    json[key].as_str().unwrap_or_default().to_owned()
}

#[test]
fn a_sweep_that_was_killed_goes_on_with_the_members_that_are_left() {
    let folder = folder(&slow());
    let members = folder.path().join("out/members");
    let (first, second) = (members.join("thickness=0.5"), members.join("thickness=0.6"));
    let mut child = start(folder.path());
    wait_until("the second member", || {
        status_of(&first) == "complete" && status_of(&second) == "running"
    });
    child.kill().unwrap();
    child.wait().unwrap();
    // Its member ends by itself after its step, as one that was interrupted.
    wait_until("the member ends", || status_of(&second) == "interrupted");
    assert_eq!(said_at_its_end(&second, "reason"), "the process that began it is gone");
    let done = fs::read(first.join("status.json")).unwrap();
    let ledger = fs::read(first.join("ledger.csv")).unwrap();

    // What there is can be gathered.
    passes(folder.path(), "sweep collect out");
    let table = folder.path().join("out/sweep.csv");
    let half = rows(&table);
    assert_eq!(statuses(&half)[..2], ["complete", "interrupted"]);
    assert_eq!(statuses(&half)[2..], ["not begun"]);
    assert!(folder.path().join("out/plots.json").is_file());

    // Another scene is refused, and says where.
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, slow().replace("young = 1e3", "young = 2e3")).unwrap();
    let out = rumple(folder.path(), &ARGS);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("young = 2000.0"), "{}", text(&out.stderr));
    let member = rumple(folder.path(), &["sweep", "member", "out", "2"]);
    assert_eq!(member.status.code(), Some(2), "{}", text(&member.stderr));
    assert!(!members.join("thickness=0.7").exists());
    fs::write(&scene, slow()).unwrap();

    // The same command continues, with one more value.
    let mut args = ARGS;
    args[5] = "material.thickness=0.5..0.7:3,2";
    passes_with(folder.path(), &args);
    assert_eq!(fs::read(first.join("status.json")).unwrap(), done, "it was run again");
    assert_eq!(fs::read(first.join("ledger.csv")).unwrap(), ledger);
    let all = rows(&table);
    assert_eq!(statuses(&all), ["complete"; 4]);

    // An uninterrupted sweep says the same, but for what it cost.
    args[3] = "whole";
    passes_with(folder.path(), &args);
    let whole = rows(&folder.path().join("whole/sweep.csv"));
    for (a, b) in all.iter().zip(&whole) {
        for (column, value) in
            a.iter().filter(|(c, _)| !["CPU [s]", "memory [MB]"].contains(&&***c))
        {
            assert_eq!(value, &b[column], "{column}");
        }
    }
    let frame = |root: &str| {
        let member = folder.path().join(root).join("members/thickness=0.6");
        fs::read(member.join("frames/frame_000010.vtu")).unwrap()
    };
    assert!(frame("out") == frame("whole"));

    // Fewer values than there are members is another sweep, unless it is to be replaced.
    let mut fewer = ARGS.to_vec();
    fewer[5] = "material.thickness=0.5,0.6";
    let out = rumple(folder.path(), &fewer);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("thickness = 0.7"), "{}", text(&out.stderr));
    fewer.push("--force");
    passes_with(folder.path(), &fewer);
    assert_eq!(rows(&table).len(), 2);
    assert!(!members.join("thickness=0.7").exists());
}

#[cfg(unix)]
#[test]
fn a_sweep_that_is_interrupted_ends_its_members() {
    for (signal, code, name) in [("-TERM", 143, "SIGTERM"), ("-INT", 130, "SIGINT")] {
        let folder = folder(&slow());
        let members = folder.path().join("out/members");
        let mut child = start(folder.path());
        wait_until("the first member", || {
            fs::read_to_string(members.join("thickness=0.5/measures.csv"))
                .is_ok_and(|text| text.lines().count() > 2)
        });
        // To the sweep alone, which forwards it to its members.
        let id = child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(code));
        let first = members.join("thickness=0.5");
        assert_eq!(status_of(&first), "interrupted");
        let reason = said_at_its_end(&first, "reason");
        assert!(reason.contains(name), "{reason}");
        assert_eq!(reason, said_at_its_end(&folder.path().join("out"), "reason"));
        assert!(!members.join("thickness=0.6").exists());
        assert_eq!(status_of(&folder.path().join("out")), "interrupted");
        let table = rows(&folder.path().join("out/sweep.csv"));
        assert_eq!(statuses(&table)[0], "interrupted");
        let time: f64 = table[0]["time"].parse().unwrap();
        assert!(time > 0.0 && time < 0.2, "{time}");
    }
}
