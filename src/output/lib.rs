//! What a run writes: frames for ParaView, a ledger, and where everything came from.
//!
//! ```text
//! DIR/sheet.pvd                  times and frames; the file to open in ParaView
//! DIR/frames/frame_000123.vtu    one state each
//! DIR/ledger.csv                 one row a step
//! DIR/events.csv                 snaps, and losses of stability if the scene watches for them
//! DIR/modes/mode_000000.vtu      the modes of an event
//! DIR/resolved.toml              the scene with every default written out
//! DIR/provenance.json            versions, hashes, host, command line
//! DIR/costs.json                 what the run cost, part by part
//! DIR/plots.json                 of a study or of branches: paragraphs, tables and plots, which the viewer draws
//! DIR/report.html                a viewer of all this, written by the command line
//! DIR/status.json                running, complete, interrupted or failed, and why
//! DIR/measures.csv               of a member of a sweep: measures at the output times
//! DIR/failure/                   why a run failed, and its last good state
//! ```
//!
//! Observers get a state and give nothing back. Frames, the index of frames and the two records
//! appear whole under their names or not at all ([`atomic`]); the ledger grows by whole rows.

pub mod atomic;
pub mod checkpoint;
pub mod clock;
pub mod directory;
mod encode;
pub mod events;
pub mod file;
pub mod frame;
pub mod inputs;
pub mod interrupt;
pub mod ledger;
pub mod lock;
pub mod plot;
pub mod progress;
pub mod provenance;
mod pvtu;
pub mod series;
pub mod vtu;

use std::path::{Path, PathBuf};

pub use checkpoint::CheckpointFiles;
pub use directory::ResultDirectory;
pub use encode::Compression;
pub use file::ResultFile;
pub use frame::{Field, Frame};
pub use inputs::Inputs;
pub use interrupt::Interrupt;
pub use ledger::Ledger;
pub use lock::{Claim, Reached, RunStatus, SelfIntersection, Standing};
pub use progress::{Mode, Progress, ProgressLine};
pub use provenance::Provenance;
pub use series::Series;

/// Why something could not be written or read back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The operating system refused to write, make, rename or remove something.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or directory.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The operating system refused to read something.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A frame contradicts itself; the message names the array.
    #[error("frame at step {step}: {message}")]
    Frame {
        /// The step of the frame.
        step: u64,
        /// What does not fit.
        message: String,
    },
    /// A directory cannot take the results.
    #[error("result directory {}: {message}", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why not, and what would help.
        message: String,
    },
    /// A file may not be written.
    #[error("cannot write {}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// Why not, and what would help.
        message: String,
    },
    /// A ledger is not one of ours, or a row does not fit its columns.
    #[error("{}:{line}: {message}", path.display())]
    Ledger {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: usize,
        /// What was expected and what was found.
        message: String,
    },
    /// The handler of Ctrl-C could not be installed.
    #[error("cannot install a handler for Ctrl-C: {0}")]
    Interrupt(String),
}

impl OutputError {
    /// For `map_err` after an operation that writes `path`.
    pub fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        |source| Self::Write { path: path.to_owned(), source }
    }

    /// For `map_err` after an operation that reads `path`.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        |source| Self::Read { path: path.to_owned(), source }
    }
}
