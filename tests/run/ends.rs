//! How a run ends: its exit code, its status, and who is named.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::program::{folder, passes_with, rumple, text};
use super::{SMALL, program};
use crate::plugins::build::{self, c_library};

fn status(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("status.json")).unwrap()).unwrap()
}

/// A run of hours that has made its first steps, started by these words before the program.
fn long_run(folder: &Path, before: &[&str]) -> Child {
    let scene = SMALL.replace("until = 0.5", "until = 5000.0");
    fs::write(folder.join("long.toml"), scene).unwrap();
    let program = program();
    let words = before.iter().map(Path::new).chain([program.as_path()]).collect::<Vec<_>>();
    let child = Command::new(words[0])
        .args(&words[1..])
        .current_dir(folder)
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args(["run", "long.toml", "--out", "result"])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let rows = || fs::read_to_string(folder.join("result/ledger.csv")).unwrap_or_default();
    wait_for("steps", || rows().lines().count() >= 4);
    child
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let patience = Instant::now();
    while !there() {
        assert!(patience.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn send(child: &Child, signal: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
}

#[test]
fn the_status_says_that_a_run_is_complete() {
    let folder = folder(SMALL);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result", "--quiet"]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let status = status(&folder.path().join("result"));
    assert_eq!(status["status"], "complete");
    assert_eq!(status["time"], 0.5);
    assert!(status["reason"].as_str().unwrap().contains("end time"), "{status}");
}

#[cfg(unix)]
#[test]
fn the_exit_code_and_the_status_tell_which_signal_ended_a_run() {
    for (signal, code, name) in
        [("-INT", 130, "SIGINT"), ("-TERM", 143, "SIGTERM"), ("-HUP", 129, "SIGHUP")]
    {
        let folder = tempfile::tempdir().unwrap();
        let mut child = long_run(folder.path(), &[]);
        let result = folder.path().join("result");
        assert_eq!(status(&result)["status"], "running");
        send(&child, signal);
        assert_eq!(child.wait().unwrap().code(), Some(code));
        let status = status(&result);
        assert_eq!(status["status"], "interrupted");
        assert!(status["reason"].as_str().unwrap().contains(name), "{status}");
        assert!(status["time"].as_f64().unwrap() > 0.0, "{status}");
    }
}

#[cfg(unix)]
#[test]
fn an_ignored_hangup_stays_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = long_run(folder.path(), &["nohup"]);
    send(&child, "-HUP");
    let ledger = folder.path().join("result/ledger.csv");
    let rows = || fs::read_to_string(&ledger).unwrap().lines().count();
    let before = rows();
    wait_for("step after the hangup", || rows() > before + 3);
    assert!(child.try_wait().unwrap().is_none());
    send(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(143));
}

#[cfg(unix)]
#[test]
fn an_interrupted_comparison_says_so() {
    let folder = folder(&SMALL.replace("until = 0.5", "until = 5000.0"));
    let mut child = Command::new(program())
        .current_dir(folder.path())
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .args(["compare", "scene.toml", "--out", "result"])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let result = folder.path().join("result");
    let member = || {
        let folders =
            fs::read_dir(result.join("members")).ok()?.flatten().map(|entry| entry.path());
        folders.into_iter().find(|path| path.join("sheet.pvd").exists())
    };
    wait_for("frame", || member().is_some());
    send(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(143));
    assert_eq!(status(&result)["status"], "interrupted");
    assert_eq!(status(&member().unwrap())["status"], "interrupted");
}

/// y' = y² ends at t = 1: one member steps over that, the other dies there. A crash does not count as a success.
#[test]
fn a_comparison_with_a_member_that_died_is_no_success() {
    let scene = r#"
        sheet = { shape = "point" }
        [kinetics]
        species.y = { typical = 1.0 }
        rates.y = "y^2"
        initial.y = 1.0
        [time]
        until = 2.0
        [output]
        every = 1.0
    "#;
    let folder = folder(scene);
    let euler = r#"{ kind = "staggered", method = "euler", step = 0.5, chemistry = "euler" }"#;
    let bdf = r#"{ kind = "monolithic", method = "bdf" }"#;
    let args = ["compare", "scene.toml", "--out", "c", "--integrator", euler, "--integrator", bdf];
    let out = rumple(folder.path(), &args);
    let (reported, message) = (text(&out.stdout), text(&out.stderr));
    assert_eq!(out.status.code(), Some(1), "{reported}\n{message}");
    assert!(message.contains("1 of 2 members did not come to their end"), "{message}");
    let result = folder.path().join("c");
    assert_eq!(status(&result)["status"], "failed");
    assert!(result.join("compare.csv").exists());
}

#[cfg(unix)]
#[test]
fn two_runs_into_one_directory_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = long_run(folder.path(), &[]);
    for (command, why) in [("run", "another run"), ("compare", "holds no sweep")] {
        let args = [command, "long.toml", "--out", "result", "--force"];
        let out = rumple(folder.path(), &args);
        assert_eq!(out.status.code(), Some(2), "{}", text(&out.stdout));
        assert!(text(&out.stderr).contains(why), "{}", text(&out.stderr));
    }
    // A process that dies frees its lock.
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(status(&folder.path().join("result"))["status"], "running");
    let end = ["--set", "time.until=0.02"];
    let args = [&["run", "long.toml", "--out", "result", "--force"][..], &end].concat();
    passes_with(folder.path(), &args);
}

/// The small scene with the law of `tests/faulty/planted.c`.
fn planted(fault: &str) -> String {
    let definition = format!("FAULT={fault}");
    let library = c_library("tests/faulty/planted.c", &format!("planted_{fault}"), &[&definition]);
    SMALL
        .replace("curvature-feedback", library.to_str().unwrap())
        .replace("parameters = { c_star = 0.1, b = 20.0 }", "")
        .replace("amplitude = 0.08", "amplitude = 0.8")
        .replace("step = 0.01,", "step = 0.01, longest_step = 0.01,")
}

#[cfg(unix)]
#[test]
fn a_crash_of_a_plugin_ends_by_the_signal_with_whole_files() {
    use std::os::unix::process::ExitStatusExt;

    let cases = [("ABORTS", 6), ("SEGFAULT", 11), ("SEGFAULT_LATE", 11), ("DEEP", 6)];
    for (fault, signal) in cases.into_iter().chain([("RAISES_FPE", 8)]) {
        let folder = folder(&planted(fault));
        let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
        let message = text(&out.stderr);
        assert_eq!(out.status.signal(), Some(signal), "{fault}: {:?} {message}", out.status);
        // As a run that is killed: the lock is free, and frames are complete.
        let result = folder.path().join("result");
        assert_eq!(status(&result)["status"], "running", "{fault}");
        if fault.ends_with("LATE") {
            let pvd = fs::read_to_string(result.join("sheet.pvd")).unwrap();
            let frames = fs::read_dir(result.join("frames")).unwrap().count();
            assert_eq!(pvd.matches("<DataSet").count(), frames, "{fault}");
        }
    }
}

#[test]
fn a_run_that_cannot_go_on_leaves_a_failed_status() {
    let folder = folder(&planted("NOT_FINITE"));
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    let status = status(&folder.path().join("result"));
    assert_eq!(status["status"], "failed");
    assert!(status["reason"].as_str().unwrap().contains("returned NaN"), "{status}");
}

/// Only one call of hundreds gives it, in a step that is rejected.
#[test]
fn a_bad_number_in_a_try_that_is_made_shorter_is_told_once() {
    let folder = folder(&planted("NOT_FINITE_ONCE"));
    for (quiet, out) in [(&[][..], "a"), (&["--quiet"], "b")] {
        let args = [&["run", "scene.toml", "--threads", "1", "--out", out][..], quiet].concat();
        let done = rumple(folder.path(), &args);
        let message = text(&done.stderr);
        assert!(done.status.success(), "{message}");
        let reported = message.lines().filter(|line| line.contains("returned NaN in rate"));
        let reported: Vec<&str> = reported.collect();
        assert_eq!(reported.len(), 1, "{message}");
        for part in ["plugin `planted`", "species c at vertex", "position (", "in a rejected step"]
        {
            assert!(reported[0].contains(part), "no {part} in {}", reported[0]);
        }
    }
}
