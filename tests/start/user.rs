//! Defaults of the user.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::plugins::build;
use crate::run::program::{folder, passes, text};
use crate::run::{SMALL, program};

/// What the program prints in `folder` with this file of defaults, on both streams, and its exit code.
fn with(
    folder: &Path,
    defaults: &str,
    arguments: &[&str],
    variables: &[(&str, &str)],
) -> (String, Option<i32>) {
    fs::create_dir_all(folder.join("rumple")).unwrap();
    fs::write(folder.join("rumple/config.toml"), defaults).unwrap();
    let mut command = Command::new(program());
    for variable in ["RUMPLE_PLUGIN_PATH", "RUMPLE_BROWSER", "RUMPLE_FFMPEG", "RAYON_NUM_THREADS"] {
        command.env_remove(variable);
    }
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).env("HOME", "/home/me");
    let done = command.envs(variables.iter().copied()).args(arguments).output().unwrap();
    (text(&done.stdout) + &text(&done.stderr), done.status.code())
}

#[test]
fn a_file_has_defaults_that_variables_and_options_override() {
    let folder = folder(SMALL);
    let folder = folder.path();
    let list = ["plugin", "list", "--plugin-path", "/first"];
    let directories = "plugin_path = [\"~/laws\", \"/other\", \"here\"]";
    let (said, code) = with(folder, directories, &list, &[]);
    let here = folder.join("rumple/here");
    let all = format!("  /first\n  /home/me/laws\n  /other\n  {}\n", here.display());
    assert!(said.contains(&all) && code == Some(0), "{said}");
    let (said, _) = with(folder, directories, &list, &[("RUMPLE_PLUGIN_PATH", "/mine")]);
    assert!(said.contains("/mine") && !said.contains("/other"), "{said}");

    let defaults = format!("threads = 3\nplugin_path = [{:?}]", build::directory());
    let threads = |more: &[&str], variables: &[(&str, &str)]| {
        let run = ["run", "scene.toml", "--out", "out", "--force", "--quiet"];
        let (said, code) = with(folder, &defaults, &[&run[..], more].concat(), variables);
        assert_eq!(code, Some(0), "{said}");
        let costs = fs::read(folder.join("out/costs.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&costs).unwrap()["threads"].as_u64()
    };
    assert_eq!(threads(&[], &[]), Some(3));
    assert_eq!(threads(&["--threads", "2"], &[]), Some(2));
    assert_eq!(threads(&[], &[("RAYON_NUM_THREADS", "1")]), Some(1));
}

#[test]
fn mistakes_in_it_name_the_file_and_the_line() {
    let folder = tempfile::tempdir().unwrap();
    for (wrong, said) in [
        ("threads = 0", "line 1"),
        ("\nthread = 2", "expected one of `threads`, `color`, `plugin_path`, `browser`, `ffmpeg`"),
        ("color = \"red\"", "expected `auto` or `never`"),
        ("threads = ", "line 1"),
    ] {
        let (message, code) = with(folder.path(), wrong, &["plugin", "list"], &[]);
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("rumple/config.toml: ") && message.contains(said), "{message}");
    }
}

#[test]
fn programs_that_it_names_and_that_are_missing_are_refused_by_its_key() {
    let folder = folder(SMALL);
    let folder = folder.path();
    passes(folder, "run scene.toml --out out --quiet");
    let defaults = "browser = \"~/none\"\nffmpeg = \"no-ffmpeg\"";
    let (message, code) = with(folder, defaults, &["picture", "out"], &[]);
    assert_eq!(code, Some(2), "{message}");
    let file = folder.join("rumple/config.toml");
    let wanted = format!("error: {}: browser = /home/me/none: no such program", file.display());
    assert!(message.contains(&wanted), "{message}");
    let (message, _) = with(folder, defaults, &["movie", "out", "-o", "m.mp4"], &[]);
    assert!(message.contains("config.toml: ffmpeg = no-ffmpeg: no such program"), "{message}");
    let set = [("RUMPLE_BROWSER", "/mine")];
    let (message, _) = with(folder, defaults, &["picture", "out"], &set);
    assert!(message.contains("error: RUMPLE_BROWSER = /mine: no such program"), "{message}");
}
