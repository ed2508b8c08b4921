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
//! A [`Plan`] says which members there are; each is a run in a process of its own ([`run`]), started
//! by a [`Pool`] or by [`slurm`]; what is in their folders is gathered into tables, pictures and plots,
//! whether they have ended or not.

mod axis;
mod contact_sheet;
mod imported;
mod keys;
mod member;
mod memory;
mod plan;
mod plots;
mod pool;
pub mod slurm;
mod staleness;
mod table;
mod timing;

pub use axis::{Axis, MOST};
pub use contact_sheet::contact_sheet;
pub use keys::seeds;
pub use member::{Found, MemberStatus, Shown, limit_of, read, run, status};
pub use memory::{Needs, available};
pub use plan::{Plan, Point};
pub use plots::{drawn_keys, figure};
pub use pool::{Event, Pool};
pub use table::{COLUMNS, Column, csv, markdown};
pub use timing::Timing;

use std::path::Path;

use crate::output::atomic;
use crate::run::Result;

/// Names of the files that gather a sweep.
pub const TABLE: &str = "sweep.csv";
/// The table for people.
pub const PAGE: &str = "sweep.md";
/// The pictures.
pub const PICTURES: &str = "pictures.png";
/// What the names of plots begin with.
pub const PLOT: &str = "plot-";

/// Reads what there is of all members; what pictures show only with `pictures`.
#[must_use]
pub fn gather(plan: &Plan, root: &Path, pictures: bool) -> Vec<Found> {
    (0..plan.members.len()).map(|number| read(plan, root, number, pictures)).collect()
}

/// Writes the tables of `members` into `root`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_tables(plan: &Plan, members: &[Found], root: &Path) -> Result<()> {
    for (name, text) in [(TABLE, csv(plan, members)), (PAGE, markdown(plan, members))] {
        atomic::replace(&root.join(name), |writer| writer.write_all(text.as_bytes()))?;
    }
    Ok(())
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
        if drawn.panels.is_empty() {
            continue;
        }
        let name = format!("{PLOT}{}", plan.plot_name(key));
        files.push((format!("{name}.svg"), drawn.svg()?.into_bytes()));
        files.push((format!("{name}.png"), drawn.picture()?.png()?));
    }
    for (name, bytes) in files {
        atomic::replace(&root.join(name), |writer| writer.write_all(&bytes))?;
    }
    Ok(())
}
