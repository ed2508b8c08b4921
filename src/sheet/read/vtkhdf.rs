//! Frames of temporal VTKHDF files.

use std::fs::File;
use std::path::Path;

use rumple_numerics::Vec3;
use rumple_vtkhdf::{FieldValues, FrameReader};

use crate::Surface;
use crate::surface::Array;

fn open(path: &Path) -> Result<FrameReader<File>, String> {
    let about = std::fs::metadata(path).map_err(|e| format!("cannot be read: {e}"))?;
    if !about.is_file() {
        return Err("is not a file".into());
    }
    FrameReader::open(File::open(path).map_err(|e| format!("cannot be read: {e}"))?)
}

/// Times of the frames.
pub(super) fn times(path: &Path) -> Result<Vec<f64>, String> {
    Ok(open(path)?.times().to_vec())
}

/// Frame number `frame`, or the last one.
pub(super) fn surface(path: &Path, frame: Option<usize>) -> Result<Surface, String> {
    let mut reader = open(path)?;
    let last = reader.times().len().checked_sub(1).ok_or("has no frames")?;
    let frame = frame.unwrap_or(last);
    let points = reader.points(frame)?.into_iter().map(Vec3::from).collect();
    let [point, cell, _] = reader.arrays(frame)?;
    let array = |a: FieldValues| Array { name: a.name, components: a.components, values: a.values };
    Ok(Surface {
        path: Some(path.to_owned()),
        points,
        triangles: reader.triangles().to_vec(),
        point_arrays: point.into_iter().map(array).collect(),
        cell_arrays: cell.into_iter().map(array).collect(),
        time: reader.times().get(frame).copied(),
        ..Surface::default()
    })
}
