//! What `inspect` says of a state, for people: energies, and of everything else the range.

use std::fmt::Write;

use serde_json::Value;

use crate::num::real;

/// Quantities at vertices and points with their units.
const FIELDS: [(&str, &str); 4] = [
    ("mean_curvature", "1/length"),
    ("gaussian_curvature", "1/length^2"),
    ("vertex_area", "length^2"),
    ("length_factor", "1"),
];

/// Groups of quantities that are listed by name, and what one of them is called.
const GROUPS: [(&str, &str); 4] = [
    ("species", "species"),
    ("signals", "signal"),
    ("reaction", "reaction"),
    ("diffusion", "diffusion"),
];

/// The evaluated state `all`, as [`inspect`](super::inspect::inspect) gives it, in a few lines.
#[must_use]
pub fn overview(all: &Value) -> String {
    let mut text = String::new();
    let forces = &all["force"];
    let _ = writeln!(text, "{:<32} {:>13} {:>16}", "effect", "energy", "largest force");
    for (name, energy) in all["energy"].as_object().into_iter().flatten() {
        let largest = norms(&forces[name]).fold(0.0, f64::max);
        let energy = energy.as_f64().unwrap_or(f64::NAN);
        let _ = writeln!(text, "{name:<32} {energy:>13.6e} {largest:>16.6e}");
    }
    for (name, about) in all["constraint"].as_object().into_iter().flatten() {
        let number = |key: &str| about[key].as_f64().unwrap_or(f64::NAN);
        let (value, multiplier) = (number("value"), number("multiplier"));
        let _ = writeln!(text, "constraint {name}: {value:.3e}, multiplier {multiplier:.6e}");
    }
    let _ = writeln!(text, "\n{:<32} {:>13} {:>13} {:>13}", "quantity", "least", "mean", "largest");
    for (name, unit) in FIELDS {
        row(&mut text, &super::fields::titled(name, unit), &all[name]);
    }
    let bond =
        |key: &str| all["bond"][key].as_array().into_iter().flatten().filter_map(Value::as_f64);
    let strain: Vec<Value> = bond("length")
        .zip(bond("optimal_length"))
        .map(|(length, optimal)| (length / optimal - 1.0).into())
        .collect();
    row(&mut text, "strain of bonds", &strain.into());
    for (group, one) in GROUPS {
        for (name, values) in all[group].as_object().into_iter().flatten() {
            row(&mut text, &format!("{one} {name}"), values);
        }
    }
    text.push_str("\n--json FILE writes all numbers (- for standard output), --vtu FILE a frame\n");
    text
}

/// Range and mean of the numbers in `values`; nothing where there are none.
fn row(text: &mut String, title: &str, values: &Value) {
    let (mut least, mut largest, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0);
    for value in values.as_array().into_iter().flatten().filter_map(Value::as_f64) {
        (least, largest) = (value.min(least), value.max(largest));
        (sum, count) = (sum + value, count + 1);
    }
    if count > 0 {
        let mean = sum / real(count);
        let _ = writeln!(text, "{title:<32} {least:>13.6e} {mean:>13.6e} {largest:>13.6e}");
    }
}

/// The lengths of the vectors of an array.
fn norms(vectors: &Value) -> impl Iterator<Item = f64> {
    let vectors = vectors.as_array().into_iter().flatten().filter_map(Value::as_array);
    vectors.map(|v| v.iter().filter_map(Value::as_f64).map(|x| x * x).sum::<f64>().sqrt())
}
