//! What `inspect` says of a state, for people: numbers, and of lists their range and mean.

use std::fmt::Write;

use serde_json::Value;

use crate::num::real;

/// The evaluated state `all`, as [`inspect`](super::inspect::inspect) gives it, in a few lines; of vectors the lengths.
#[must_use]
pub fn overview(all: &Value) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{:<40} {:>13} {:>13} {:>13}", "quantity", "least", "mean", "largest");
    add(&mut text, "", all);
    text.push_str("\n--json FILE writes all numbers (- for standard output), --vtu FILE a frame\n");
    text
}

fn add(text: &mut String, name: &str, value: &Value) {
    for (key, value) in value.as_object().into_iter().flatten().filter(|(k, _)| *k != "vertices") {
        add(text, format!("{name} {key}").trim_start(), value);
    }
    if let Some(number) = value.as_f64() {
        let _ = writeln!(text, "{name:<40} {number:>13.6e}");
    }
    let length = |vector: &Vec<Value>| {
        vector.iter().filter_map(Value::as_f64).map(|x| x * x).sum::<f64>().sqrt()
    };
    let number = |value: &Value| value.as_f64().or_else(|| value.as_array().map(length));
    let values: Vec<f64> = value.as_array().into_iter().flatten().filter_map(number).collect();
    if !values.is_empty() {
        let (least, largest) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (v.min(l), v.max(m)));
        let mean = values.iter().sum::<f64>() / real(values.len());
        let _ = writeln!(text, "{name:<40} {least:>13.6e} {mean:>13.6e} {largest:>13.6e}");
    }
}
