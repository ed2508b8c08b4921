//! A series of frames and its index (`.pvd`), which gives every frame its time.

use std::fs;
use std::path::{Path, PathBuf};

use super::encode::decimal;
use super::vtu::{self, Compression};
use super::{Frame, OutputError, ResultDirectory, atomic};

/// Writes frames one after another and keeps the index in step with them.
///
/// After every [`push`](Self::push) the index on the disk lists all frames so far, with times
/// that read back to the last bit; a run that is killed leaves a series that opens.
#[derive(Debug)]
pub struct Series {
    directory: ResultDirectory,
    compression: Compression,
    times: Vec<f64>,
}

impl Series {
    /// Starts a series in `directory`; nothing is written yet.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the directory of the frames cannot be made.
    pub fn create(
        directory: &ResultDirectory,
        compression: Compression,
    ) -> Result<Self, OutputError> {
        let frames = directory.frames();
        fs::create_dir_all(&frames).map_err(OutputError::write(&frames))?;
        Ok(Self { directory: directory.clone(), compression, times: Vec::new() })
    }

    /// Writes `frame` and then the index with it; returns the path of the frame.
    ///
    /// # Errors
    /// [`OutputError::Frame`] if the frame contradicts itself, [`OutputError::Write`] if the disk
    /// is full or refuses. The index then still lists the frames written before, all whole.
    pub fn push(&mut self, frame: &Frame<'_>) -> Result<PathBuf, OutputError> {
        let path = self.directory.frame(self.times.len());
        vtu::write(&path, frame, self.compression)?;
        self.times.push(frame.time);
        if let Err(error) = self.write_index() {
            self.times.pop();
            return Err(error);
        }
        Ok(path)
    }

    /// Times of the frames written so far.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The index, which is the file to open.
    #[must_use]
    pub fn index(&self) -> PathBuf {
        self.directory.pvd()
    }

    fn write_index(&self) -> Result<(), OutputError> {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
        );
        for (number, &time) in self.times.iter().enumerate() {
            let name = ResultDirectory::frame_name(number);
            let file = Path::new(ResultDirectory::FRAMES).join(name);
            text += &format!(
                "<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n",
                decimal(time),
                file.display()
            );
        }
        text += "</Collection>\n</VTKFile>\n";
        atomic::replace(&self.index(), |writer| writer.write_all(text.as_bytes()))
    }
}
