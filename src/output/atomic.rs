//! Files that appear whole under their name or not at all.
//!
//! The text goes to a hidden file in the same directory, is forced to the disk, and takes the
//! name by a rename, which the file system does in one go. A reader, a killed run or a full disk
//! thus sees the old file or the new one, never a part of one. A device or a pipe (`/dev/stdout`)
//! cannot be replaced in this way, and must not be: it is written to directly.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::OutputError;

/// The end of the name of a file under construction; such files may be deleted at any time.
pub const PART_SUFFIX: &str = ".part";

/// Where `path` is built: `.NAME.part` beside it.
pub(super) fn part_of(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(PART_SUFFIX);
    path.with_file_name(name)
}

/// Whether `path` is a device or a pipe.
pub(super) fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Replaces the file `path` by what `fill` writes. A link there is replaced, not followed.
///
/// # Errors
/// [`OutputError::Write`] with the path and the message of the operating system. What was at
/// `path` before is then untouched, and nothing else is left behind.
pub fn replace(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), OutputError> {
    build(path, fill, |part| fs::rename(part, path))
}

/// Makes the file `path` of what `fill` writes, where nothing is yet.
///
/// # Errors
/// As for [`replace`]; also if there is something at `path`.
pub fn create(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), OutputError> {
    build(path, fill, |part| {
        // A second name is only given where there is none, unlike a new one.
        match fs::hard_link(part, path) {
            Ok(()) => fs::remove_file(part),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Err(e),
            // Not every file system has two names for one file.
            Err(_) if fs::symlink_metadata(path).is_err() => fs::rename(part, path),
            Err(e) => Err(e),
        }
    })
}

/// Writes to a device, or to a file beside `path` that `put` then gives its name.
fn build(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    put: impl FnOnce(&Path) -> std::io::Result<()>,
) -> Result<(), OutputError> {
    if is_device(path) {
        return OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|file| {
                let mut writer = BufWriter::new(file);
                fill(&mut writer)?;
                writer.flush()
            })
            .map_err(OutputError::write(path));
    }
    let part = part_of(path);
    // What a killed run left there is not written through: it might be a link.
    let _ = fs::remove_file(&part);
    let built = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&part)
        .and_then(|file| {
            let mut writer = BufWriter::new(file);
            fill(&mut writer)?;
            writer.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()
        })
        .and_then(|()| put(&part));
    if built.is_err() {
        // The first failure is the one to report; the part file may not even exist.
        let _ = fs::remove_file(&part);
    }
    built.map_err(OutputError::write(path))?;
    sync_directory(path);
    Ok(())
}

/// Forces the rename to the disk where the system offers it; the file is whole either way.
pub(super) fn sync_directory(path: &Path) {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(directory) = File::open(parent) {
        let _ = directory.sync_all();
    }
}
