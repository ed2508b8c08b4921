//! A report as blocks, for people who read Markdown and for those who open one file in a browser.

use crate::output::plot::Figure;
use crate::study::draw::table::markdown_table;

/// A part of a report.
pub(super) enum Block {
    /// A heading of this depth, from 1.
    Heading(usize, String),
    /// A paragraph.
    Text(String),
    /// A highlighted paragraph.
    Advice(String),
    /// Points.
    List(Vec<String>),
    /// Rows; the first is the head.
    Table(Vec<Vec<String>>),
    /// A plot.
    Plot(Drawing),
}

/// A plot that is drawn.
pub(super) struct Drawing {
    /// Of which case it is, if of one.
    pub(super) case: Option<usize>,
    /// Name of its files, without their ends.
    pub(super) name: String,
    /// Its caption.
    pub(super) caption: String,
    /// Its panels.
    pub(super) figure: Figure,
    /// The drawing, once it is drawn.
    pub(super) svg: String,
}

/// As Markdown that shows the plots beside it.
pub(super) fn markdown(blocks: &[Block]) -> String {
    let mut text = String::new();
    for block in blocks {
        text += &match block {
            Block::Heading(depth, words) => format!("{} {words}\n", "#".repeat(*depth)),
            Block::Text(words) => format!("{words}\n"),
            Block::Advice(words) => format!("**{words}**\n"),
            Block::List(items) => items.iter().map(|item| format!("* {item}\n")).collect(),
            Block::Table(rows) => markdown_table(rows),
            Block::Plot(plot) => {
                format!("![{}]({}.png)\n\n{}\n", plot.name, plot.name, plot.caption)
            }
        };
        text.push('\n');
    }
    text
}

/// Few rules: readable on any screen and on paper.
const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.6rem}h2{font-size:1.25rem;margin-top:2rem}\
table{border-collapse:collapse;font-size:.85rem;display:block;overflow-x:auto}\
td,th{border-bottom:1px solid #ddd;padding:.25rem .6rem;text-align:left;white-space:nowrap}\
th{background:#f4f4f4}.advice{background:#eef5ee;border-left:4px solid #4a8;padding:.6rem 1rem}\
figure{margin:1.5rem 0}figcaption{color:#555;font-size:.9rem}svg{max-width:100%;height:auto}";

/// As a page that needs no other file.
pub(super) fn html(blocks: &[Block]) -> String {
    let title = blocks.iter().find_map(|block| match block {
        Block::Heading(_, words) => Some(escaped(words)),
        _ => None,
    });
    let title = title.unwrap_or_default();
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title}</title>\n\
         <style>{STYLE}</style></head>\n<body>\n"
    );
    for block in blocks {
        text += &match block {
            Block::Heading(depth, words) => format!("<h{depth}>{}</h{depth}>\n", escaped(words)),
            Block::Text(words) => format!("<p>{}</p>\n", escaped(words)),
            Block::Advice(words) => format!("<p class=\"advice\">{}</p>\n", escaped(words)),
            Block::List(items) => {
                let item = |item: &String| format!("<li>{}</li>\n", escaped(item));
                format!("<ul>\n{}</ul>\n", items.iter().map(item).collect::<String>())
            }
            Block::Table(rows) => table(rows),
            Block::Plot(plot) => {
                // What stands before the drawing belongs to a file of its own.
                let drawing = plot.svg.find("<svg").map_or("", |start| &plot.svg[start..]);
                let caption = escaped(&plot.caption);
                format!("<figure>{drawing}<figcaption>{caption}</figcaption></figure>\n")
            }
        };
    }
    text + "</body>\n</html>\n"
}

fn table(rows: &[Vec<String>]) -> String {
    let row = |(number, row): (usize, &Vec<String>)| {
        let tag = if number == 0 { "th" } else { "td" };
        let cell = |cell: &String| format!("<{tag}>{}</{tag}>", escaped(cell));
        format!("<tr>{}</tr>\n", row.iter().map(cell).collect::<String>())
    };
    format!("<table>\n{}</table>\n", rows.iter().enumerate().map(row).collect::<String>())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
