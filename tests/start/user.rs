//! Defaults of the user.

use std::fs;
use std::process::Command;

use crate::common::path;
use crate::run::program;
use crate::run::program::text;

/// What the program prints with this file of defaults, on both streams, and its exit code.
fn with(defaults: &str, arguments: &[&str], variables: &[(&str, &str)]) -> (String, Option<i32>) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("rumple")).unwrap();
    fs::write(folder.path().join("rumple/config.toml"), defaults).unwrap();
    let mut command = Command::new(program());
    command.env_remove("RUMPLE_PLUGIN_PATH").env("XDG_CONFIG_HOME", folder.path());
    let done =
        command.env("HOME", "/home/me").envs(variables.iter().copied()).args(arguments).output();
    let done = done.unwrap();
    (text(&done.stdout) + &text(&done.stderr), done.status.code())
}

#[test]
fn a_file_has_defaults_that_variables_and_options_override() {
    let list = ["plugin", "list"];
    let (said, code) = with("plugin_path = [\"~/laws\", \"/other\"]", &list, &[]);
    assert!(said.contains("  /home/me/laws\n  /other\n") && code == Some(0), "{said}");
    let set = [("RUMPLE_PLUGIN_PATH", "/mine")];
    let (said, _) = with("plugin_path = [\"/other\"]", &list, &set);
    assert!(said.contains("/mine") && !said.contains("/other"), "{said}");
    let model = path("models/plates/leaf.toml");
    let bench = |more: &[&str]| {
        let arguments = [&["plugin", "bench", &model, "--points", "10"], more].concat();
        with("threads = 3", &arguments, &[]).0
    };
    assert!(bench(&[]).contains("3 threads"), "{}", bench(&[]));
    assert!(bench(&["--threads", "2"]).contains("2 threads"));
}

#[test]
fn mistakes_in_it_name_the_file_and_the_line() {
    for (wrong, said) in [
        ("threads = 0", "line 1"),
        ("\nthread = 2", "expected one of `threads`, `color`, `plugin_path`, `browser`, `ffmpeg`"),
        ("color = \"red\"", "expected `auto` or `never`"),
        ("threads = ", "line 1"),
    ] {
        let (message, code) = with(wrong, &["plugin", "list"], &[]);
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("rumple/config.toml") && message.contains(said), "{message}");
    }
}
