//! Rows of cells as text; the first row is the head.

/// Wider columns (characters) are not filled up: nobody reads them side by side, and text cannot be padded to
/// more than 65535.
const WIDEST: usize = 200;

/// For people and for Markdown.
pub(super) fn markdown_table(rows: &[Vec<String>]) -> String {
    let Some(head) = rows.first() else { return String::new() };
    let width =
        |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|c| c.chars().count()).max();
    let widths: Vec<usize> =
        (0..head.len()).map(|k| width(k).unwrap_or(0).clamp(3, WIDEST)).collect();
    let mut text = String::new();
    for (number, row) in rows.iter().enumerate() {
        for (cell, width) in row.iter().zip(&widths) {
            let cell = cell.replace('|', "\\|");
            text += &format!("| {cell:<width$} ");
        }
        text += "|\n";
        if number == 0 {
            for width in &widths {
                text += &format!("| {} ", "-".repeat(*width));
            }
            text += "|\n";
        }
    }
    text
}

/// As comma-separated values.
pub(super) fn csv_table(rows: &[Vec<String>]) -> String {
    let cell = |cell: &String| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let line = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    rows.iter().map(line).collect()
}
