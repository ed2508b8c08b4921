//! The version that the program states: with its features, and with the commit where it is built from its repository or
//! `RUMPLE_COMMIT` gives one. With that variable, empty or not, a new commit alone builds nothing again.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=src/build.rs");
    println!("cargo::rerun-if-env-changed=RUMPLE_COMMIT");
    let commit = match std::env::var("RUMPLE_COMMIT") {
        Ok(given) => Some(given).filter(|given| !given.is_empty()),
        Err(_) => commit(),
    };
    let features = [("CARGO_FEATURE_MPI64", "mpi64"), ("CARGO_FEATURE_MPI", "mpi")];
    let features = features.iter().find(|(variable, _)| std::env::var_os(variable).is_some());
    let features = features.map(|(_, name)| format!("features: {name}"));
    let known: Vec<String> = commit.into_iter().chain(features).collect();
    let version = env!("CARGO_PKG_VERSION");
    match known.is_empty() {
        true => println!("cargo::rustc-env=RUMPLE_VERSION={version}"),
        false => println!("cargo::rustc-env=RUMPLE_VERSION={version} ({})", known.join("; ")),
    }
}

/// Hash and date of the commit; none elsewhere than in the repository of this program.
fn commit() -> Option<String> {
    let root = git(&["rev-parse", "--show-toplevel"])?;
    if Path::new(&root).canonicalize().ok()? != Path::new(".").canonicalize().ok()? {
        return None;
    }
    // Every commit and every checkout adds to it.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).is_file() {
        println!("cargo::rerun-if-changed={log}");
    }
    git(&["log", "-1", "--format=%h %cs"])
}

fn git(arguments: &[&str]) -> Option<String> {
    let done = Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
    let text = String::from_utf8_lossy(&done.stdout).trim().to_owned();
    (!text.is_empty()).then_some(text)
}
