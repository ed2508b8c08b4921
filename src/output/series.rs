//! A series of `.vtu` frames and its index (`.pvd`), which gives every frame its time.

use std::fs;
use std::path::{Path, PathBuf};

use super::encode::{Compression, decimal};
use super::provenance::digest_of;
use super::{Frame, OutputError, ResultDirectory, atomic, pvtu, vtu};

/// Writes frames one after another and keeps the index in step with them.
///
/// After every [`push`](Self::push) the index on the disk lists all frames so far, with times
/// that read back to the last bit; a run that is killed leaves a series that opens.
#[derive(Debug)]
pub struct Series {
    directory: ResultDirectory,
    compression: Compression,
    times: Vec<f64>,
    digests: Vec<u64>,
    /// The folders of the pieces of a frame, as seen from here; empty where a frame is one file.
    pieces: Vec<PathBuf>,
}

impl Series {
    /// Starts a series in `directory`; nothing is written yet.
    #[must_use]
    pub fn create(directory: &ResultDirectory, compression: Compression) -> Self {
        let (times, digests, pieces) = (Vec::new(), Vec::new(), Vec::new());
        Self { directory: directory.clone(), compression, times, digests, pieces }
    }

    /// The same with frames of pieces, of which the first is written here and the others under the same name into the
    /// other `folders`, relative to that of the frames.
    #[must_use]
    pub fn in_pieces(self, folders: Vec<PathBuf>) -> Self {
        Self { pieces: folders, ..self }
    }

    /// The same series after the frames at `times` with `digests`, which are in `directory`; those after them are no
    /// longer in the index.
    ///
    /// # Errors
    /// [`OutputError::Directory`] if one of them is not there, [`OutputError::Write`] if the index cannot be
    /// written.
    pub fn after(self, times: Vec<f64>, digests: Vec<u64>) -> Result<Self, OutputError> {
        let series = Self { times, digests, ..self };
        let missing =
            (0..series.times.len()).map(|k| series.directory.frame(k)).find(|path| !path.is_file());
        if let Some(path) = missing {
            let path = path.strip_prefix(series.directory.root()).unwrap_or(&path).display();
            let message = format!("`{path}`, written before the checkpoint, is not there any more");
            return Err(OutputError::Directory { path: series.directory.root().into(), message });
        }
        series.write_index()?;
        Ok(series)
    }

    /// Continues after frames of these times whose pieces other ranks wrote.
    #[must_use]
    pub fn after_those_of_others(self, times: Vec<f64>, digests: Vec<u64>) -> Self {
        Self { times, digests, ..self }
    }

    /// Writes `frame` and then the index with it; returns the path of the frame.
    ///
    /// # Errors
    /// [`OutputError::Frame`] if the frame contradicts itself, [`OutputError::Write`] and [`OutputError::Read`] if
    /// the disk is full or refuses. The index then still lists the frames written before, all whole.
    pub fn push(&mut self, frame: &Frame<'_>) -> Result<PathBuf, OutputError> {
        let frames = self.directory.frames();
        fs::create_dir_all(&frames).map_err(OutputError::write(&frames))?;
        let path = self.directory.frame(self.times.len());
        vtu::write(&path, frame, self.compression)?;
        if !self.pieces.is_empty() {
            let name = ResultDirectory::frame_name(self.times.len());
            let sources = self.pieces.iter().map(|folder| folder.join(&name));
            let index = path.with_extension("pvtu");
            let text = pvtu::encode(frame, sources);
            atomic::replace(&index, |writer| writer.write_all(text.as_bytes()))?;
        }
        // Of what was just written, which the system has in memory.
        let digest = digest_of(&path)?;
        self.times.push(frame.time);
        if let Err(error) = self.write_index() {
            self.times.pop();
            return Err(error);
        }
        self.digests.push(digest);
        Ok(path)
    }

    /// Digests of the files of the frames written so far.
    #[must_use]
    pub fn digests(&self) -> &[u64] {
        &self.digests
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
        let frames = self.times.iter().enumerate().map(|(number, &time)| {
            let ending = if self.pieces.is_empty() { "vtu" } else { "pvtu" };
            let name = Path::new(&ResultDirectory::frame_name(number)).with_extension(ending);
            (decimal(time), Path::new(ResultDirectory::FRAMES).join(name))
        });
        let text = collection(frames);
        atomic::replace(&self.index(), |writer| writer.write_all(text.as_bytes()))
    }
}

/// The index as a `.pvd`.
fn collection(frames: impl Iterator<Item = (String, PathBuf)>) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
    );
    for (time, file) in frames {
        text += &format!("<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>\n", file.display());
    }
    text + "</Collection>\n</VTKFile>\n"
}
