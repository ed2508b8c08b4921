//! Blocks and rows of cells as text; the first row is the head.

use crate::output::plot::Block;
use crate::tally::Work;

/// Wider columns (characters) are not padded: text cannot be padded to more than 65535.
const MAX_PADDED_WIDTH: usize = 200;

/// For people and for Markdown.
pub fn markdown_table(rows: &[Vec<String>]) -> String {
    let Some(head) = rows.first() else { return String::new() };
    let width =
        |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|c| c.chars().count()).max();
    let widths: Vec<usize> =
        (0..head.len()).map(|k| width(k).unwrap_or(0).clamp(3, MAX_PADDED_WIDTH)).collect();
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

/// Blocks as Markdown, without the plots.
pub fn markdown(blocks: &[Block]) -> String {
    let parts = blocks.iter().filter_map(|block| {
        Some(match block {
            Block::Heading(depth, words) => format!("{} {words}\n", "#".repeat(*depth)),
            Block::Text(words) => format!("{words}\n"),
            Block::Advice(words) => format!("**{words}**\n"),
            Block::Code(words) => format!("```text\n{words}```\n"),
            Block::List(items) => items.iter().map(|item| format!("* {item}\n")).collect(),
            Block::Table(rows) => markdown_table(rows),
            Block::Plot(_) => return None,
        })
    });
    parts.collect::<Vec<String>>().join("\n")
}

/// As comma-separated values.
pub fn csv_table(rows: &[Vec<String>]) -> String {
    let cell = |cell: &String| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let line = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    rows.iter().map(line).collect()
}

/// A cell of a number; empty where there is none.
pub fn number(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

/// Titles of the counts of work, without those in `but`.
pub fn work_titles(but: &[&str]) -> impl Iterator<Item = String> {
    work_columns(but).map(|k| Work::NAMES[k].0.replace('_', " "))
}

/// Cells of the counts of `work`, without those in `but`; empty where there is none.
pub fn work_cells(work: Option<Work>, but: &[&str]) -> impl Iterator<Item = String> {
    let counts = work.map(|work| work.values());
    work_columns(but).map(move |k| counts.map_or(String::new(), |counts| counts[k].to_string()))
}

fn work_columns(but: &[&str]) -> impl Iterator<Item = usize> {
    (0..Work::NAMES.len()).filter(move |k| !but.contains(&Work::NAMES[*k].0))
}
