//! The files of checkpoints: whole, of a known version, and unharmed, or not used.
//!
//! ```text
//! DIR/checkpoints/checkpoint_000012.bin
//!
//! 64 bytes   a line of text: format and program, with their versions, filled up by spaces
//!  8 bytes   length of the content
//!            the content, a record
//! 32 bytes   SHA-256 of all that
//! ```
//!
//! A file takes its name by a rename ([`atomic`]); the last few are kept.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use rumple_numerics::record::Record;
use sha2::{Digest, Sha256};

use super::{OutputError, ResultDirectory, atomic};

/// Version of the format, and the program that writes it: another one computes other bits.
const WRITER: &str =
    concat!("rumple checkpoint 8, by rumple ", env!("CARGO_PKG_VERSION"), ", little-endian");
const HEADER: usize = 64;
const HASH: usize = 32;

/// Why a checkpoint cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// Not a checkpoint, truncated, or with a wrong checksum.
    #[error("is damaged: {0}")]
    Damaged(&'static str),
    /// Another program has written it.
    #[error(
        "is of another version (`{found}`, expected `{WRITER}`): resume with the program that wrote it"
    )]
    Version {
        /// What it says of itself.
        found: String,
    },
}

/// The checkpoints of one run.
#[derive(Debug)]
pub struct CheckpointFiles {
    directory: ResultDirectory,
    keep: usize,
    next: usize,
}

impl CheckpointFiles {
    /// Those in `directory`, of which `keep` are kept; new ones come after those that are there.
    ///
    /// # Errors
    /// [`OutputError::Read`] from the operating system.
    pub fn open(directory: &ResultDirectory, keep: usize) -> Result<Self, OutputError> {
        let last = directory.checkpoints_found()?.pop();
        let next = last.map_or(0, |(number, _)| number + 1);
        Ok(Self { directory: directory.clone(), keep, next })
    }

    /// Writes `content` as the next one, and removes those that are too old; returns its path.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system; what was there before is then untouched.
    pub fn write(&mut self, content: &Record) -> Result<PathBuf, OutputError> {
        let folder = self.directory.checkpoints();
        fs::create_dir_all(&folder).map_err(OutputError::write(&folder))?;
        let path = self.directory.checkpoint(self.next);
        write(&path, content)?;
        self.next += 1;
        let mut found = self.directory.checkpoints_found()?;
        found.retain(|(number, _)| number + self.keep < self.next);
        for (_, old) in found {
            // One that stays does no harm.
            let _ = fs::remove_file(old);
        }
        Ok(path)
    }
}

/// Writes `content` to `path`.
///
/// # Errors
/// [`OutputError::Write`] from the operating system; what was there before is then untouched.
pub fn write(path: &Path, content: &Record) -> Result<(), OutputError> {
    let header = format!("{WRITER:<width$}\n", width = HEADER - 1);
    let content = content.as_bytes();
    let length = (content.len() as u64).to_le_bytes();
    let parts = [header.as_bytes(), &length, content];
    let mut hasher = Sha256::new();
    parts.iter().for_each(|part| hasher.update(part));
    let hash = hasher.finalize();
    atomic::replace(path, |writer| {
        parts.iter().try_for_each(|part| writer.write_all(part))?;
        writer.write_all(&hash)
    })
}

/// The content of the checkpoint at `path`, if it is whole.
///
/// # Errors
/// [`Unusable`].
pub fn read(path: &Path) -> Result<Record, Unusable> {
    let unread = |_| Unusable::Damaged("it cannot be read");
    let mut file = fs::File::open(path).map_err(unread)?;
    let mut bytes = Vec::new();
    // Whatever it is and however long: the rest is read only if the beginning is right.
    file.by_ref().take(HEADER as u64).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() < HEADER {
        return Err(Unusable::Damaged("it is too short"));
    }
    let header = String::from_utf8_lossy(&bytes).trim_end().to_owned();
    if !header.starts_with("rumple checkpoint ") {
        return Err(Unusable::Damaged("it does not begin as a checkpoint does"));
    }
    if header != WRITER {
        return Err(Unusable::Version { found: header });
    }
    file.read_to_end(&mut bytes).map_err(unread)?;
    let Some((all, hash)) = bytes.split_last_chunk::<HASH>() else {
        return Err(Unusable::Damaged("it is too short"));
    };
    if Sha256::digest(all)[..] != hash[..] {
        return Err(Unusable::Damaged("its checksum is wrong"));
    }
    bytes.truncate(bytes.len() - HASH);
    let length = bytes.get(HEADER..HEADER + 8).map(|word| (bytes.len() - HEADER - 8, word));
    match length {
        Some((length, word)) if (length as u64).to_le_bytes() == word => {
            bytes.drain(..HEADER + 8);
            Ok(bytes.into())
        }
        _ => Err(Unusable::Damaged("its length is wrong")),
    }
}
