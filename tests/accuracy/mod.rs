//! What accuracy costs: errors that are known, reports that show all runs, advice that follows from them.

mod advice;
mod damaged;
mod known;
mod references;
mod stabilised;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;

use tempfile::TempDir;

use crate::run::program::{folder, rumple, text};
use crate::sweep::{GROWING, number, rows};

/// c decays from 1: c(t) = exp(-t).
pub const DECAY: &str = r#"
sheet = { shape = "point" }
time = { until = 1.0 }
output = { every = 0.5 }

[kinetics]
rates.c = "-k*c"
parameters = { k = 1.0 }
initial.c = 1.0
"#;

/// Runs a study of `scene` in a folder of its own.
pub fn study(scene: &str, arguments: &[&str]) -> (TempDir, Output) {
    let folder = folder(scene);
    let output = again(folder.path(), arguments);
    (folder, output)
}

/// Runs a study of the scene in `folder`.
pub fn again(folder: &Path, arguments: &[&str]) -> Output {
    let fixed = ["accuracy", "scene.toml", "--out", "out"];
    rumple(folder, &[&fixed[..], arguments].concat())
}

/// Rows of the table.
pub fn table(folder: &Path) -> Vec<BTreeMap<String, String>> {
    rows(&folder.join("out/accuracy.csv"))
}

/// The row of an integrator at a tolerance.
pub fn row<'a>(
    rows: &'a [BTreeMap<String, String>],
    integrator: &str,
    tolerance: f64,
) -> &'a BTreeMap<String, String> {
    let found = rows
        .iter()
        .find(|row| row["integrator"] == integrator && number(row, "tolerance") == tolerance);
    found.unwrap_or_else(|| panic!("no {integrator} at {tolerance}: {rows:?}"))
}

/// The errors of all rows, as they are written.
pub fn errors(rows: &[BTreeMap<String, String>]) -> Vec<String> {
    rows.iter().map(|row| row["error of the species"].clone()).collect()
}
