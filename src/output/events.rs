//! The events of a run: a line for everything that happened rather than went on.
//!
//! ```text
//! time,step,kind,smallest eigenvalue [force/length^3],negative directions,modes
//! 1.25,37,loss of stability,-3.1e-5,1,modes/mode_000000.vtu
//! ```

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::encode::decimal;
use super::{OutputError, atomic};

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Event<'a> {
    /// Time of the accepted state in which it was seen.
    pub time: f64,
    /// Its step.
    pub step: u64,
    /// What happened, in a few words without commas.
    pub kind: &'a str,
    /// Smallest eigenvalue of the energy's Hessian per rest area, force/length³.
    pub eigenvalue: f64,
    /// Directions that lower the energy.
    pub negative: usize,
    /// The file with the modes, from the result directory; empty without one.
    pub modes: &'a str,
}

/// An open list of events; lines go to the disk as they are appended.
#[derive(Debug)]
pub struct Events {
    path: PathBuf,
    file: File,
}

impl Events {
    /// Creates the file `path` (replacing one that is there) with its header.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the file cannot be written.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(OutputError::write(path))?;
        let mut events = Self { path: path.to_owned(), file };
        events.write(
            "time,step,kind,smallest eigenvalue [force/length^3],negative directions,modes\n",
        )?;
        Ok(events)
    }

    /// Opens the list of an earlier run to go on after its first `count` events; later ones are dropped.
    ///
    /// # Errors
    /// [`OutputError::Read`] and [`OutputError::Write`] from the operating system; [`OutputError::Refused`] if
    /// there are fewer.
    pub fn reopen(path: &Path, count: usize) -> Result<Self, OutputError> {
        let text = std::fs::read_to_string(path).map_err(OutputError::read(path))?;
        let kept: Vec<&str> = text.split_inclusive('\n').take(1 + count).collect();
        if kept.len() != 1 + count || !kept.iter().all(|line| line.ends_with('\n')) {
            let message = format!("it had {count} events at the checkpoint, and has fewer now");
            return Err(OutputError::Refused { path: path.to_owned(), message });
        }
        atomic::replace(path, |writer| writer.write_all(kept.concat().as_bytes()))?;
        let file = OpenOptions::new().append(true).open(path).map_err(OutputError::write(path))?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Appends one event.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the disk is full or refuses.
    pub fn append(&mut self, event: &Event<'_>) -> Result<(), OutputError> {
        let Event { time, step, kind, eigenvalue, negative, modes } = event;
        let (time, eigenvalue) = (decimal(*time), decimal(*eigenvalue));
        self.write(&format!("{time},{step},{kind},{eigenvalue},{negative},{modes}\n"))
    }

    fn write(&mut self, text: &str) -> Result<(), OutputError> {
        self.file
            .write_all(text.as_bytes())
            .and_then(|()| self.file.flush())
            .map_err(OutputError::write(&self.path))
    }
}
