//! All frames of a run in one file: temporal VTKHDF, an unstructured grid of triangles whose points move.
//!
//! ```text
//! frame_writer   what VTK asks for: groups, data sets and steps, written frame by frame
//! frame_reader   frames read back
//! extendible     a file of data sets that frames extend, and the order of its writes
//! tree           the index of the pieces of a data set
//! object         headers and messages of HDF5
//! read           data sets of a file, read row by row
//! chunk          filters of their pieces
//! ```
//!
//! The layout is that of HDF5 1.0: superblock 0, symbol tables, B-trees of version 1. Nothing in it has a checksum, so that
//! every change of a file is one of
//!
//! 1. bytes behind its end or in places that nothing points to;
//! 2. one number of 2 or 8 bytes that makes them part of it,
//!
//! and `NSteps`, which says how many frames there are, is the last number written. A file whose writer is killed between
//! any two of these is whole, with all frames before the last. (The HDF5 Group, HDF5 file format specification 3.0;
//! VTK documentation, VTKHDF file format.)

mod chunk;
mod extendible;
mod frame_reader;
mod frame_writer;
mod object;
mod read;
#[cfg(test)]
mod tests;
mod tree;

use std::path::{Path, PathBuf};

pub use extendible::Disk;
pub use frame_reader::{FieldValues, FrameReader};
pub use frame_writer::{Field, FrameWriter, State, Topology};

/// The file, and the number of the frame if it is given, that a path names: `FILE.vtkhdf` or `FILE.vtkhdf#K`; none of other
/// files.
#[must_use]
pub fn frame_of(path: &Path) -> Option<(PathBuf, Option<usize>)> {
    let text = path.to_str()?;
    if text.to_lowercase().ends_with(".vtkhdf") {
        return Some((path.to_owned(), None));
    }
    let (file, number) = text.rsplit_once('#')?;
    let known = file.to_lowercase().ends_with(".vtkhdf");
    number.parse().ok().filter(|_| known).map(|number| (PathBuf::from(file), Some(number)))
}
