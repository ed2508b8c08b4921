//! Sweeps: keys, members, what is gathered; killed and gone on; planned, and run one by one.

mod axis;
mod errors;
mod measures;
mod periodic;
mod planned;
mod plots;
mod refinement;
mod resumed;
mod running;
mod statistics;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::run::program::{folder, rumple, text};

/// A small sheet that grows by a law; with a = -1 its rate is not a number.
pub const GROWING: &str = r#"
sheet = { shape = "disc", radius = 6.0, vertices = 120, bump = { amplitude = 0.3, width = 2.0 } }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "z" },
    { kind = "diffusion", species = "c", coefficient = 0.5 },
]
time = { until = 0.2, integrator = { kind = "staggered", method = "heun", step = 0.01 } }

[kinetics]
rates.c = "sqrt(a) - c"
length_factor = "1 + 0.1*c"
parameters = { a = 1.0 }
initial.c = { gaussian = { width = 2.0, amplitude = 0.5 } }
"#;

/// Rows of a CSV file with their cells by column.
pub fn rows(path: &Path) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines().map(cells);
    let head = lines.next().unwrap();
    lines
        .map(|row| {
            assert_eq!(row.len(), head.len(), "{row:?}");
            head.iter().cloned().zip(row).collect()
        })
        .collect()
}

/// The cells of a line; quotes protect commas.
fn cells(line: &str) -> Vec<String> {
    let (mut all, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            c => all.last_mut().unwrap().push(c),
        }
    }
    all
}

pub fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|e| panic!("{column}: {e}: {row:?}"))
}

/// Status of every member in the table.
pub fn statuses(rows: &[BTreeMap<String, String>]) -> Vec<&str> {
    rows.iter().map(|row| row["status"].as_str()).collect()
}
