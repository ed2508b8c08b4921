//! Directories without results, half ones, files that are there.

use std::fs;
use std::path::Path;

use super::{Read, done, scene};
use crate::run::program::{folder, rumple, text};

fn refused(folder: &Path, args: &[&str], parts: &[&str]) {
    let out = rumple(folder, args);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "{args:?}: no {part} in {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn directories_without_results_are_refused() {
    let folder = folder(&scene());
    let folder = folder.path();
    refused(folder, &["view", "none"], &["none", "no such directory"]);
    refused(folder, &["view", "scene.toml"], &["scene.toml", "directory"]);
    fs::create_dir(folder.join("empty")).unwrap();
    refused(folder, &["view", "empty"], &["empty", "resolved.toml"]);
    assert_eq!(fs::read_dir(folder.join("empty")).unwrap().count(), 0);
    refused(folder, &["view", "empty", "--frames", "1"], &["--frames"]);
    refused(folder, &["view", "empty", "--watch"], &["empty", "resolved.toml"]);
    refused(folder, &["view", "empty", "--watch", "-o", "page.html"], &["--watch"]);
    refused(folder, &["view", "empty", "--size-limit=-1"], &["--size-limit"]);
}

#[test]
fn damaged_results_are_refused_with_the_file() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let damage = |file: &str, change: &dyn Fn(&str) -> Option<String>, part: &str| {
        let path = folder.join("out").join(file);
        let before = fs::read_to_string(&path).unwrap();
        match change(&before) {
            Some(text) => fs::write(&path, text).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        refused(folder, &["view", "out", "-o", "page.html"], &[file, part]);
        assert!(!folder.join("page.html").exists());
        fs::write(&path, before).unwrap();
    };
    let half = |text: &str| Some(text[..text.len() / 2].to_owned());
    damage("frames/frame_000002.vtu", &half, "");
    damage("frames/frame_000005.vtu", &|_| None, "");
    damage("frames/frame_000003.vtu", &|t| Some(t.replace("Name=\"c\"", "Name=\"d\"")), "fields");
    damage("costs.json", &half, "");
    damage("ledger.csv", &|t| Some(t.replacen("\n0,", "\nzero,", 1)), "expected");
    let outside = |t: &str| Some(t.replace("frames/frame_000001.vtu", "../secret.vtu"));
    damage("sheet.pvd", &outside, "../secret.vtu");
    damage("sheet.pvd", &|_| Some("<html></html>".into()), "an index of frames");
    damage("sheet.pvd", &half, "cut");
    damage("sheet.pvd", &|t| Some(t.replace("timestep=\"0\"", "timestep=\"soon\"")), "time");
    done(folder, &["view", "out", "-o", "page.html"]);
}

/// What a killed run leaves is shown, with a warning.
#[test]
fn an_unfinished_run_is_shown_as_far_as_it_came() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let root = folder.join("out");
    let status = fs::read_to_string(root.join("status.json")).unwrap();
    fs::write(root.join("status.json"), status.replace("\"complete\"", "\"running\"")).unwrap();
    fs::remove_file(root.join("costs.json")).unwrap();
    let ledger = fs::read_to_string(root.join("ledger.csv")).unwrap();
    fs::write(root.join("ledger.csv"), &ledger[..ledger.len() - 7]).unwrap();
    done(folder, &["view", "out", "--force"]);
    let page = Read::new(&root.join("report.html"));
    let member = &page.about["members"][0];
    assert_eq!(member["status"], "killed");
    assert!(member["warnings"][0].as_str().unwrap().contains("killed"), "{}", member["warnings"]);
    let rows = member["ledger"]["of"].as_u64().unwrap();
    assert_eq!(rows, ledger.lines().count() as u64 - 2);
}

/// What is left of a complete run, and what is wrong, in the page and in the terminal.
#[test]
fn a_record_that_is_damaged_is_said_to_be_so() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    for (file, damaged, words) in [
        ("ledger.csv", None, "no ledger.csv"),
        ("ledger.csv", Some("step,time\n0,0\n1,"), "ledger.csv ends within a line"),
        ("ledger.csv", Some(""), "ledger.csv ends within a line"),
        ("ledger.csv", Some("\0\0\0\0"), "ledger.csv ends within a line"),
        ("status.json", Some("{"), "status.json is missing or damaged"),
        ("resolved.toml", Some("until ="), "resolved.toml is not valid TOML"),
    ] {
        let path = folder.join("out").join(file);
        let before = fs::read(&path).unwrap();
        match damaged {
            Some(text) => fs::write(&path, text).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        let out = rumple(folder, &["view", "out", "--force"]);
        let page = Read::new(&folder.join("out/report.html"));
        let warnings = page.about["members"][0]["warnings"].to_string();
        assert!(out.status.success() && text(&out.stderr).contains(words), "{}", text(&out.stderr));
        assert!(warnings.contains(words), "{warnings}");
        fs::write(&path, before).unwrap();
    }
    let out = rumple(folder, &["view", "out", "--force"]);
    assert_eq!(text(&out.stderr), "");
}

#[test]
fn nothing_is_overwritten_unless_forced() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    fs::write(folder.join("mine.html"), "mine").unwrap();
    refused(folder, &["view", "out", "-o", "mine.html"], &["mine.html", "--force"]);
    refused(folder, &["view", "out"], &["report.html", "--force"]);
    refused(folder, &["view", "out", "-o", "no/page.html"], &["no directory"]);
    refused(folder, &["view", "out", "-o", "out"], &["directory"]);
    assert_eq!(fs::read_to_string(folder.join("mine.html")).unwrap(), "mine");
    done(folder, &["view", "out", "-o", "mine.html", "--force"]);
    assert!(fs::read_to_string(folder.join("mine.html")).unwrap().starts_with("<!DOCTYPE html>"));
    let html = done(folder, &["view", "out", "-o", "-"]);
    assert!(html.starts_with("<!DOCTYPE html>") && html.trim_end().ends_with("</html>"));
    // A run replaces that of an earlier one, as all that it writes.
    done(folder, &["run", "scene.toml", "--out", "out", "--force", "--quiet"]);
}
