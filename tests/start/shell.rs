//! Completions and man pages.

use std::fs;
use std::process::Command;

use crate::run::program::{passes, passes_with, rumple, text};

#[test]
fn completions_are_scripts_that_the_shell_reads() {
    let folder = tempfile::tempdir().unwrap();
    for (shell, mark) in
        [("bash", "complete -F"), ("zsh", "#compdef rumple"), ("fish", "complete -c rumple")]
    {
        let out = passes_with(folder.path(), &["completions", shell]);
        let script = text(&out.stdout);
        for word in [mark, "accuracy", "plugin-path", "own-law"] {
            assert!(script.contains(word), "{shell} without {word}");
        }
        let file = folder.path().join(shell);
        fs::write(&file, script).unwrap();
        // A shell that is not there reads nothing.
        if let Ok(read) = Command::new(shell).arg("-n").arg(&file).output() {
            assert!(read.status.success(), "{shell}: {}", text(&read.stderr));
        }
    }
    // What bash offers after `rumple new a --from t`.
    let offered = Command::new("bash")
        .current_dir(folder.path())
        .args([
            "-c",
            "source ./bash; COMP_WORDS=(rumple new a --from t); COMP_CWORD=4; \
            _rumple rumple t --from; echo ${COMPREPLY[@]}",
        ])
        .output();
    if let Ok(offered) = offered {
        assert_eq!(text(&offered.stdout).trim(), "turing", "{}", text(&offered.stderr));
    }
    assert_eq!(rumple(folder.path(), &["completions", "basch"]).status.code(), Some(2));
}

#[test]
fn every_command_has_a_man_page() {
    let folder = tempfile::tempdir().unwrap();
    passes(folder.path(), "man pages");
    let read = |name: &str| fs::read_to_string(folder.path().join("pages").join(name)).unwrap();
    let main = read("rumple.1");
    for section in [".SH NAME", ".SH SYNOPSIS", ".SH DESCRIPTION", ".SH OPTIONS", ".SH SUBCOMMANDS"]
    {
        assert!(main.contains(section), "{section} in {main}");
    }
    assert!(read("rumple-run.1").contains("plugin\\-path"), "{}", read("rumple-run.1"));
    assert!(read("rumple-plugin-validate.1").contains(".SH OPTIONS"));
    // A second time only by force.
    let again = rumple(folder.path(), &["man", "pages"]);
    assert_eq!(again.status.code(), Some(2), "{}", text(&again.stderr));
    assert!(rumple(folder.path(), &["man", "pages", "--force"]).status.success());
}
