//! Invalid values of a scene.

use super::{Choices, Table};

/// In place of any value.
const VALUES: [&str; 44] = [
    "nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "-1",
    "-1.0",
    "1",
    "2",
    "7",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-300",
    "1e100",
    "1e-100",
    "1e9",
    "1e-9",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "true",
    "1979-05-27T07:32:00Z",
    "\"\"",
    "\" \"",
    "\"x\"",
    "\"all\"",
    "\"c\"",
    "\"\\u0000\"",
    "\"1/x\"",
    "\"exp(exp(exp(9)))\"",
    "\"1e308*1e308*c\"",
    "\"log(-1)\"",
    "\"sqrt(-t)\"",
    "\"1e300*t\"",
    "\"-c^0.5\"",
    "\"../..\"",
    "[]",
    "[nan, 0, 0]",
    "[1e308, 1e308, 1e308]",
    "[[0, 0], [0, 1]]",
    "[\"c\", \"c\"]",
    "{}",
    "{ formula = \"0/0\" }",
];

/// Keys that are nowhere, or elsewhere.
const KEYS: [&str; 8] =
    ["kind", "", "\"\"", "nothing", "vertices", "rates.c", "where.box.min", "shape.x"];

/// Makes one thing wrong.
pub fn spoil(choices: &mut Choices, tables: &mut Vec<Table>) {
    let chosen = choices.below(tables.len());
    let value = choices.pick(&VALUES);
    let other = choices.below(tables.len());
    let moved = choices.below(64);
    let several = tables.len() > 1;
    let table = &mut tables[chosen];
    let row = moved % table.rows.len().max(1);
    match choices.below(12) {
        // Something else for a person to contradict.
        0 if table.head.starts_with("[[") => {
            let copy = Table { head: table.head, rows: table.rows.clone() };
            tables.push(copy);
        }
        1 if several => drop(tables.remove(chosen)),
        2 if !table.rows.is_empty() => drop(table.rows.remove(row)),
        3 => table.set(choices.pick(&KEYS), value),
        4 if !table.rows.is_empty() => {
            let copy = table.rows[row].clone();
            if tables[other].rows.iter().all(|(key, _)| *key != copy.0) {
                tables[other].rows.push(copy);
            }
        }
        5 if !table.rows.is_empty() => {
            let other = table.rows[choices.below(table.rows.len())].1.clone();
            table.rows[row].1 = other;
        }
        _ if !table.rows.is_empty() => table.rows[row].1 = value.to_owned(),
        _ => {}
    }
}
