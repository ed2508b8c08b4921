//! One scene over lists and ranges of its keys.
//!
//! ```text
//! DIR/sweep.json              the plan: keys, values, members with their fingerprints
//! DIR/members/h=0.5,D=0/      the run of one member, with measures.csv and shown.vtu
//! DIR/sweep.csv, sweep.md     a row of measures and costs a member
//! DIR/pictures.png            pictures of all members, arranged by the keys
//! DIR/plot-h.svg, plot-h.png  the measures against a key
//! DIR/sweep.sbatch, slurm/    an array job and what its tasks print
//! ```
//!
//! The members are planned, run and gathered as those of any [study](super); here are the table, the plots and
//! the contact sheet.

mod contact_sheet;
mod plots;
mod table;

pub use contact_sheet::contact_sheet;
pub use plots::{drawn_keys, figure};
pub use table::{COLUMNS, Column, csv, markdown};

use std::path::Path;

use super::gather::Found;
use super::plan::Plan;
use super::{draw, write_files};
use crate::run::Result;

/// Names of the files that gather a sweep.
pub const TABLE: &str = "sweep.csv";
/// The table for people.
pub const PAGE: &str = "sweep.md";
/// The pictures.
pub const PICTURES: &str = "pictures.png";
/// What the names of plots begin with.
pub const PLOT: &str = "plot-";

/// Writes the tables of `members` into `root`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_tables(plan: &Plan, members: &[Found], root: &Path) -> Result<()> {
    let files = [(TABLE, csv(plan, members)), (PAGE, markdown(plan, members))];
    write_files(root, files.map(|(name, text)| (name.to_owned(), text.into_bytes())).to_vec())
}

/// Writes tables, pictures and plots of `members` into `root`.
///
/// # Errors
/// A picture that cannot be drawn, a file that cannot be written.
pub fn write(plan: &Plan, members: &[Found], root: &Path) -> Result<()> {
    write_tables(plan, members, root)?;
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    if let Some(pictures) = contact_sheet(plan, members)? {
        files.push((PICTURES.to_owned(), pictures.png()?));
    }
    for key in drawn_keys(plan) {
        let drawn = figure(plan, members, key);
        if !drawn.panels.is_empty() {
            files.extend(draw::files(&format!("{PLOT}{}", plan.plot_name(key)), &drawn)?);
        }
    }
    write_files(root, files)
}
