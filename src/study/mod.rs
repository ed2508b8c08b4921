//! Studies: many runs of one scene. One engine [`plan`]s, [`run`](mod@run)s and [`gather`](mod@gather)s them and shows a
//! [`Page`]; a [`Purpose`] says what the runs are for.
//!
//! ```text
//! plan      Axis, Plan, Member              which members there are: scene, overrides, directory, fingerprint
//! run       run, Pool                      one member; members as child processes
//! gather    MemberResults, Norm, Measures  how members stand, their results, their distances from one another
//! draw                                     tables, plots against time, cost or a key
//! gradient                                  derivatives of measures at rest or in time by parameters
//! fit       fit, Fitted, Uncertainty       parameters from data, with what these do not determine
//! sweep     a row of measures a member     compare   distances from the first     accuracy   errors against references
//! ```

pub mod accuracy;
pub mod compare;
pub(crate) mod directory;
pub(crate) mod draw;
pub mod fit;
pub mod gather;
pub mod gradient;
pub mod plan;
mod purpose;
pub mod refinement;
pub mod run;
pub mod sweep;
mod timescales;

pub use gather::{Difference, Distance, Measures, Norm, measure};
pub use purpose::Purpose;
pub use timescales::Timescales;

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use serde::{Serialize, de::DeserializeOwned};

use crate::output::plot::Block;
use crate::output::{OutputError, atomic};
use crate::run::{Error, Result};

/// What a study shows.
#[derive(Debug)]
pub struct Page {
    /// Paragraphs, tables and plots.
    pub blocks: Vec<Block>,
    /// Names and texts of files.
    pub files: Vec<(&'static str, String)>,
    /// What is printed.
    pub said: String,
}

/// Reads the JSON file `path` that a `writer` wrote; none if it does not exist.
fn read_document<T: DeserializeOwned>(path: &Path, writer: &str) -> Result<Option<T>> {
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        text => text.map_err(OutputError::read(path))?,
    };
    serde_json::from_str(&text).map(Some).map_err(|error| {
        Error::Refused(format!("{}: is not what a {writer} writes: {error}", path.display()))
    })
}

/// Writes `document` as JSON.
fn write_document(path: &Path, document: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(document).unwrap_or_default();
    Ok(atomic::replace(path, |writer| writeln!(writer, "{text}"))?)
}

/// Writes `files` into `root`: names and contents.
fn write_files(root: &Path, files: &[(&str, String)]) -> Result<()> {
    for (name, text) in files {
        atomic::replace(&root.join(name), |writer| writer.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// The least and the largest of `values`; infinite, the least above the largest, of none.
fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)))
}
