//! The events of a run: a line for everything that happened rather than went on.
//!
//! ```text
//! time,step,kind,smallest eigenvalue [force/length^3],negative directions,energy released [energy],modes,vertex,x [length],y [length],z [length]
//! 1.25,37,loss of stability,-3.1e-5,1,,modes/mode_000000.vtu,,,,
//! 1.5,41,snap,,,0.32,,118,3.1,-0.2,1.4
//! ```

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use super::encode::decimal;
use super::ledger::cell;
use super::{OutputError, atomic};

const HEADER: &str = "time,step,kind,smallest eigenvalue [force/length^3],negative directions,\
                      energy released [energy],modes,vertex,x [length],y [length],z [length]\n";

/// Something that happened; what does not apply is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Event<'a> {
    /// Time of the accepted state in which it was seen.
    pub time: f64,
    /// Its step.
    pub step: u64,
    /// What happened, in a few words without commas.
    pub kind: &'a str,
    /// Smallest eigenvalue of the energy's Hessian per rest area, force/length³.
    pub eigenvalue: Option<f64>,
    /// Number of negative-curvature modes.
    pub negative: Option<usize>,
    /// Energy that it released.
    pub released: Option<f64>,
    /// The vertex that moved most, and where it came to.
    pub place: Option<(usize, [f64; 3])>,
    /// The file with the modes, from the result directory; empty without one.
    pub modes: &'a str,
}

/// The list of events; lines go to the disk as they are appended, and the file is created with the first.
#[derive(Debug)]
pub struct Events {
    path: PathBuf,
    file: Option<File>,
    count: usize,
}

impl Events {
    /// The list in the file `path`, which is made, or replaced, with the first event or [`Events::begin`].
    #[must_use]
    pub fn new(path: PathBuf) -> Self {
        Self { path, file: None, count: 0 }
    }

    /// Makes the file, if there is none yet.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the file cannot be written.
    pub fn begin(&mut self) -> Result<(), OutputError> {
        if self.file.is_none() {
            self.file = Some(File::create(&self.path).map_err(OutputError::write(&self.path))?);
            self.write(HEADER)?;
        }
        Ok(())
    }

    /// Opens the list of an earlier run to continue after its first `count` events; later ones are dropped, and the
    /// file too where none are left.
    ///
    /// # Errors
    /// [`OutputError::Read`] and [`OutputError::Write`] from the operating system; [`OutputError::Refused`] if
    /// there are fewer.
    pub fn reopen(path: PathBuf, count: usize) -> Result<Self, OutputError> {
        if count == 0 {
            return match std::fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    Err(OutputError::write(&path)(error))
                }
                _ => Ok(Self::new(path)),
            };
        }
        let text = std::fs::read_to_string(&path).map_err(OutputError::read(&path))?;
        let kept: Vec<&str> = text.split_inclusive('\n').take(1 + count).collect();
        if kept.len() != 1 + count || !kept.iter().all(|line| line.ends_with('\n')) {
            let message = format!("it had {count} events at the checkpoint, and has fewer now");
            return Err(OutputError::Refused { path, message });
        }
        atomic::replace(&path, |writer| writer.write_all(kept.concat().as_bytes()))?;
        let file =
            OpenOptions::new().append(true).open(&path).map_err(OutputError::write(&path))?;
        Ok(Self { path, file: Some(file), count })
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Appends one event.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the disk is full or refuses.
    pub fn append(&mut self, event: &Event<'_>) -> Result<(), OutputError> {
        let Event { time, step, kind, eigenvalue, negative, released, place, modes } = event;
        let number = |value: Option<f64>| value.map(cell).unwrap_or_default();
        let (time, eigenvalue, released) = (decimal(*time), number(*eigenvalue), number(*released));
        let negative = negative.map(|n| n.to_string()).unwrap_or_default();
        self.begin()?;
        let [x, y, z] = [0, 1, 2].map(|a| number(place.map(|(_, x)| x[a])));
        let vertex = place.map_or_else(String::new, |(vertex, _)| vertex.to_string());
        self.write(&format!(
            "{time},{step},{kind},{eigenvalue},{negative},{released},{modes},{vertex},{x},{y},{z}\n"
        ))?;
        self.count += 1;
        Ok(())
    }

    fn write(&mut self, text: &str) -> Result<(), OutputError> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(text.as_bytes())
            .and_then(|()| file.flush())
            .map_err(OutputError::write(&self.path))
    }
}
