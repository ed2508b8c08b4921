//! What the program prints while it works, for the logger `rumple` of Python's `logging`.

use std::io::{self, Write};
use std::time::Duration;

use pyo3::prelude::*;
use rumple::output::Progress;

/// Logs `text`, as information.
pub(crate) fn info(text: &str) {
    // A handler that fails reports it itself.
    let _ = Python::attach(|py| -> PyResult<()> {
        let logger = py.import("logging")?.call_method1("getLogger", ("rumple",))?;
        logger.call_method1("info", ("%s", text)).map(drop)
    });
}

/// Logs lines.
#[derive(Default)]
struct Lines(Vec<u8>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        info(String::from_utf8_lossy(&std::mem::take(&mut self.0)).trim_end());
        Ok(())
    }
}

/// Progress of a run to the time `end`, as the program shows it without a terminal.
pub(crate) fn progress(end: f64) -> Progress {
    const INTERVAL: Duration = rumple::output::progress::INTERVAL;
    Progress::lines_to(Box::<Lines>::default(), INTERVAL, end)
}
