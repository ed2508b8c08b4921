//! Builds the libraries that the tests load.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rumple::kinetics::{Library, PluginKinetics, search};
use rumple_plugin_abi as abi;

use crate::common::root;

/// The packages of the shipped plugins.
pub const SHIPPED: [&str; 9] = [
    "curvature-feedback",
    "tension-feedback",
    "schnakenberg",
    "brusselator",
    "gray-scott",
    "robertson",
    "van-der-pol",
    "hires",
    "oregonator",
];

/// The directory with the libraries of the plugin packages, built on first use.
pub fn directory() -> &'static Path {
    static DIRECTORY: OnceLock<PathBuf> = OnceLock::new();
    DIRECTORY.get_or_init(|| {
        let executable = std::env::current_exe().unwrap();
        let directory = executable.parent().unwrap().parent().unwrap().to_owned();
        let mut cargo = Command::new(env!("CARGO"));
        cargo.current_dir(root()).arg("build").arg("--quiet");
        cargo.arg("--target-dir").arg(directory.parent().unwrap());
        for package in SHIPPED.iter().chain(&["rumple-plugin-sdk"]) {
            cargo.args(["-p", package]);
        }
        if directory.ends_with("release") {
            cargo.arg("--release");
        }
        run(&mut cargo);
        directory
    })
}

/// A shipped plugin.
pub fn library(name: &str) -> Arc<Library> {
    Library::load(&directory().join(search::file_name(name))).unwrap()
}

/// A shipped plugin with these parameters.
pub fn plugin(name: &str, parameters: &[(&str, f64)]) -> PluginKinetics {
    library(name).instantiate(&map(parameters)).unwrap()
}

/// Parameters by name.
pub fn map(parameters: &[(&str, f64)]) -> BTreeMap<String, f64> {
    parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

/// A library from C source with these definitions (`NAME=VALUE`).
pub fn c_library(source: &str, name: &str, definitions: &[&str]) -> PathBuf {
    let root = root();
    let mut cc = Command::new("cc");
    cc.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC"]);
    cc.arg("-Wno-unused").arg(root.join(source)).arg("-I").arg(root.join("plugins/abi/include"));
    for definition in definitions.iter().map(|text| (*text).to_owned()).chain(layout()) {
        cc.arg(format!("-D{definition}"));
    }
    compile(cc.arg("-lm"), name)
}

/// The library of `tests/faulty/misbehaving.rs`.
pub fn misbehaving() -> Arc<Library> {
    static LIBRARY: OnceLock<Arc<Library>> = OnceLock::new();
    Arc::clone(LIBRARY.get_or_init(|| {
        Library::load(&rust_library("tests/faulty/misbehaving.rs", "misbehaving", &[])).unwrap()
    }))
}

/// A library from one Rust source, with these `cfg`s.
pub fn rust_library(source: &str, name: &str, cfgs: &[&str]) -> PathBuf {
    {
        let mut rustc = Command::new(std::env::var_os("RUSTC").unwrap_or("rustc".into()));
        rustc.args(["--edition", "2024", "--crate-type", "cdylib", "-O"]);
        rustc.arg(root().join(source));
        let about = ["NAME", "VERSION", "AUTHORS", "LICENSE"];
        rustc.envs(about.map(|key| (format!("CARGO_PKG_{key}"), name)));
        rustc.args(cfgs.iter().flat_map(|cfg| ["--cfg", cfg]));
        let sdk = directory().join("librumple_plugin_sdk.rlib");
        rustc.arg("--extern").arg(format!("rumple_plugin_sdk={}", sdk.display()));
        rustc.arg("-L").arg(format!("dependency={}", directory().join("deps").display()));
        compile(&mut rustc, name)
    }
}

/// Sizes and offsets of the boundary, for a C source to compare with its own.
fn layout() -> Vec<String> {
    [
        ("SIZE_SPECIES", size_of::<abi::Species>()),
        ("SIZE_PARAMETER", size_of::<abi::Parameter>()),
        ("SIZE_SIGNAL", size_of::<abi::Signal>()),
        ("SIZE_DESCRIPTOR", size_of::<abi::Descriptor>()),
        ("SIZE_REPORT", size_of::<abi::Report>()),
        ("SIZE_BATCH", size_of::<abi::Batch>()),
        ("SIZE_TABLE", size_of::<abi::PluginTable>()),
        ("OFFSET_CAPABILITIES", std::mem::offset_of!(abi::Descriptor, capabilities)),
        ("OFFSET_OPEN", std::mem::offset_of!(abi::Parameter, open)),
    ]
    .map(|(name, value)| format!("{name}={value}"))
    .to_vec()
}

/// Has a compiler write the library of this name, and puts it into place in one go: another test
/// process may have the file of the last run mapped.
fn compile(compiler: &mut Command, name: &str) -> PathBuf {
    // One at a time and each once: several tests want the same library.
    static MADE: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let output = Path::new(env!("CARGO_TARGET_TMPDIR")).join(search::file_name(name));
    if made.contains(name) {
        return output;
    }
    let fresh = output.with_extension(std::process::id().to_string());
    run(compiler.arg("-o").arg(&fresh));
    std::fs::rename(&fresh, &output).unwrap();
    made.insert(name.to_owned());
    output
}

fn run(command: &mut Command) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}:\n{text}");
}
