//! What a study shows: paragraphs, tables and plots, as data that the viewer draws.

use std::path::Path;

use serde::Serialize;

use super::{OutputError, ResultDirectory, atomic};

/// A named row of points; one point alone is a mark. Points that an axis does not reach, as those from 0 down on a
/// logarithmic one, are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// Which of the names of the figure it belongs to.
    pub name: usize,
    /// Across and up; what is not finite is left out.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Panel {
    /// Title of the axis up.
    pub title: String,
    /// Title of the axis across.
    pub across: String,
    /// Whether the axes are logarithmic: across, up.
    pub logarithmic: (bool, bool),
    /// The curves.
    pub curves: Vec<Curve>,
    /// What has a place across and no value: which of the names, and where. Crosses at the upper edge.
    pub failed: Vec<(usize, f64)>,
    /// What is 0, where the axis up is logarithmic: which of the names, and where. Triangles at the lower edge.
    pub zeros: Vec<(usize, f64)>,
}

/// The shape of marks that stand alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mark {
    /// A triangle that points up.
    Triangle,
    /// A square.
    Square,
    /// A square on its corner.
    Diamond,
}

/// Panels with one legend.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figure {
    /// Names in the legend, which leaves empty ones out.
    pub names: Vec<String>,
    /// How many of the names, the last ones, are of lines to compare with: grey and dashed, without marks.
    pub guides: usize,
    /// Names whose points stand alone, with the shape of their marks, black.
    pub marks: Vec<(usize, Mark)>,
    /// Panels, row by row.
    pub panels: Vec<Panel>,
}

/// A figure with its caption.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plot {
    /// Its name, each once.
    pub name: String,
    /// Its caption.
    pub caption: String,
    /// Its panels.
    pub figure: Figure,
}

/// A part of a report.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Block {
    /// A heading of this depth, from 1.
    Heading(usize, String),
    /// A paragraph.
    Text(String),
    /// A highlighted paragraph.
    Advice(String),
    /// Text with columns.
    Code(String),
    /// Points.
    List(Vec<String>),
    /// Rows; the first is the head.
    Table(Vec<Vec<String>>),
    /// A plot.
    Plot(Plot),
}

/// Writes `blocks` into the directory `root`, where the viewer finds them.
///
/// # Errors
/// [`OutputError::Write`] from the operating system.
pub fn write(root: &Path, blocks: &[Block]) -> Result<(), OutputError> {
    let text = serde_json::to_string(blocks).unwrap_or_default();
    atomic::replace(&root.join(ResultDirectory::PLOTS), |writer| writeln!(writer, "{text}"))
}

/// A number in few digits, with a power of ten where it is large or small.
#[must_use]
pub fn label(value: f64) -> String {
    let size = value.abs();
    if size >= 1e5 || (size > 0.0 && size < 1e-3) {
        let text = if size >= 1e5 { format!("{value:.4e}") } else { format!("{value:.2e}") };
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        format!("{digits}e{power}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}
