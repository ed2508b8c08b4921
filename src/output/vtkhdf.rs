//! All frames in one file, temporal VTKHDF: appended to during a run, truncated where one is resumed.

use std::fs::{self, File, OpenOptions};
use std::path::Path;

use rumple_vtkhdf::{Field, FieldValues, FrameReader, FrameWriter, State, Topology};
use sha2::{Digest, Sha256};

use super::{Compression, Frame, OutputError, atomic};

/// The file of a run; there is none before its first frame.
#[derive(Debug, Default)]
pub(super) struct FramesFile(Option<FrameWriter<File>>);

impl FramesFile {
    /// Adds `frame` to the file `path`, which appears with its first one; returns the digest of the frame.
    pub(super) fn push(
        &mut self,
        path: &Path,
        frame: &Frame<'_>,
        compression: Compression,
    ) -> Result<u64, OutputError> {
        frame.check()?;
        let points: Vec<[f64; 3]> = frame.points.iter().map(|p| [p.x, p.y, p.z]).collect();
        let mut numbers = frame.field_data.clone();
        numbers.sort_by(|a, b| a.0.cmp(&b.0));
        let state = state(frame, &points, &numbers);
        let failed = OutputError::write(path);
        match &mut self.0 {
            Some(writer) => writer.append(&state).map_err(failed)?,
            None => {
                let part = atomic::part_of(path);
                // What a killed run left there is not written through: it might be a link.
                let _ = fs::remove_file(&part);
                let topology = Topology { points: frame.points.len(), triangles: frame.triangles };
                let made = begun(&part).and_then(|file| {
                    let compressed = compression.level().is_some();
                    let mut writer = FrameWriter::create(file, topology, &state, compressed)?;
                    writer.append(&state)?;
                    fs::rename(&part, path)?;
                    Ok(writer)
                });
                if made.is_err() {
                    let _ = fs::remove_file(&part);
                }
                self.0 = Some(made.map_err(failed)?);
                atomic::sync_directory(path);
            }
        }
        Ok(digest(&state))
    }

    /// The file `path` with its first frames, which have these times and digests, and no others.
    pub(super) fn after(
        path: &Path,
        times: &[f64],
        digests: &[u64],
        compression: Compression,
    ) -> Result<Self, OutputError> {
        if times.is_empty() {
            return Ok(Self::default());
        }
        let part = atomic::part_of(path);
        let copied = copy(path, &part, times, digests, compression);
        if copied.is_err() {
            let _ = fs::remove_file(&part);
        }
        let writer =
            copied.map_err(|message| OutputError::Directory { path: path.to_owned(), message })?;
        fs::rename(&part, path).map_err(OutputError::write(path))?;
        atomic::sync_directory(path);
        Ok(Self(Some(writer)))
    }
}

/// A new file that can be read and written.
fn begun(part: &Path) -> std::io::Result<File> {
    OpenOptions::new().read(true).write(true).create_new(true).open(part)
}

/// Hands the first frames of a file to `each`, checked; what is wrong with them.
fn frames(
    path: &Path,
    times: &[f64],
    digests: &[u64],
    mut each: impl FnMut(&State<'_>, &[[u32; 3]]) -> Result<(), String>,
) -> Result<(), String> {
    let mut reader =
        FrameReader::open(File::open(path).map_err(|e| format!("cannot be read: {e}"))?)?;
    let triangles = reader.triangles().to_vec();
    for (k, time) in times.iter().enumerate() {
        let points = reader.points(k)?;
        let mut arrays = reader.arrays(k)?;
        arrays.iter_mut().for_each(|list| list.sort_by(|a, b| a.name.cmp(&b.name)));
        let [point, cell, numbers] = arrays;
        let number = |a: FieldValues| (a.name, a.values.first().copied().unwrap_or(f64::NAN));
        let numbers: Vec<(String, f64)> = numbers.into_iter().map(number).collect();
        let state = State {
            time: reader.times()[k],
            points: &points,
            point_fields: point.iter().map(borrowed).collect(),
            cell_fields: cell.iter().map(borrowed).collect(),
            scalars: &numbers,
        };
        if state.time != *time || digests.get(k).is_some_and(|d| *d != digest(&state)) {
            return Err(format!("frame {k} is not as the run wrote it: its numbers have changed"));
        }
        each(&state, &triangles)?;
    }
    Ok(())
}

/// Copies the first frames of a file to `part`.
fn copy(
    path: &Path,
    part: &Path,
    times: &[f64],
    digests: &[u64],
    compression: Compression,
) -> Result<FrameWriter<File>, String> {
    let _ = fs::remove_file(part);
    let mut writer: Option<FrameWriter<File>> = None;
    frames(path, times, digests, |state, triangles| {
        let io = |e: std::io::Error| e.to_string();
        if writer.is_none() {
            let topology = Topology { points: state.points.len(), triangles };
            let compressed = compression.level().is_some();
            writer = Some(
                FrameWriter::create(begun(part).map_err(io)?, topology, state, compressed)
                    .map_err(io)?,
            );
        }
        writer.as_mut().map_or(Ok(()), |writer| writer.append(state).map_err(io))
    })?;
    writer.ok_or_else(|| "the file has no frame to continue from".to_owned())
}

/// What is wrong with the first frames of a file, if anything is: they are part of the results of a resumed run.
#[must_use]
pub fn fault(path: &Path, times: &[f64], digests: &[u64]) -> Option<String> {
    let wrong = frames(path, times, digests, |_, _| Ok(())).err()?;
    Some(format!("{} {wrong}", path.display()))
}

/// A frame as the file takes it, fields in the order of their names: a resumed run finds them in no other.
fn state<'a>(
    frame: &'a Frame<'_>,
    points: &'a [[f64; 3]],
    numbers: &'a [(String, f64)],
) -> State<'a> {
    fn fields<'a>(list: &'a [super::Field<'_>]) -> Vec<Field<'a>> {
        let field = |f: &'a super::Field<'_>| Field {
            name: &f.name,
            components: f.components,
            values: &f.data,
        };
        let mut fields: Vec<Field<'a>> = list.iter().map(field).collect();
        fields.sort_by_key(|field| field.name);
        fields
    }
    State {
        time: frame.time,
        points,
        point_fields: fields(&frame.point),
        cell_fields: fields(&frame.cell),
        scalars: numbers,
    }
}

fn borrowed(array: &FieldValues) -> Field<'_> {
    Field { name: &array.name, components: array.components, values: &array.values }
}

/// The first 64 bits of the SHA-256 of all numbers of a frame.
fn digest(state: &State<'_>) -> u64 {
    let mut hasher = Sha256::new();
    let mut feed = |values: &[f64]| values.iter().for_each(|x| hasher.update(x.to_le_bytes()));
    feed(&[state.time]);
    feed(state.points.as_flattened());
    state.point_fields.iter().chain(&state.cell_fields).for_each(|field| feed(field.values));
    state.scalars.iter().for_each(|(_, value)| feed(&[*value]));
    hasher.finalize().first_chunk().map_or(0, |first| u64::from_le_bytes(*first))
}
