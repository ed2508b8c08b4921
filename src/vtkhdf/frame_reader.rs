//! Frames of a temporal unstructured grid, read back.

use std::io::{Read, Seek};

use super::frame_writer::TRIANGLE;
use super::read::{Dataset, Reader};

/// A field that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldValues {
    /// Name with its unit.
    pub name: String,
    /// Numbers per entity.
    pub components: usize,
    /// The values.
    pub values: Vec<f64>,
}

/// Reads frames of a file.
pub struct FrameReader<R> {
    reader: Reader<R>,
    times: Vec<f64>,
    points: Dataset,
    point_count: u64,
    offsets: Option<Dataset>,
    triangles: Vec<[u32; 3]>,
    /// Data sets, and offsets of their frames, on points, cells and the whole.
    fields: [Vec<(String, Dataset, Option<Dataset>)>; 3],
}

impl<R: Read + Seek> FrameReader<R> {
    /// Reads everything but the frames; a file without steps has one frame.
    ///
    /// # Errors
    /// Files that are no VTKHDF of triangles that are the same in all frames; what is damaged.
    pub fn open(source: R) -> Result<Self, String> {
        let mut reader = Reader::open(source)?;
        let root = reader.root();
        let members = reader.members(root)?;
        let top = members.iter().find(|(name, _)| name == "VTKHDF").map(|(_, address)| *address);
        let top = top.ok_or("has no group VTKHDF: it is not a VTKHDF file")?;
        let kind = reader.attribute(top, "Type")?.unwrap_or_default();
        if !kind.starts_with(b"UnstructuredGrid") {
            let kind = String::from_utf8_lossy(&kind);
            return Err(format!(
                "is of type \"{}\"; UnstructuredGrid is read",
                kind.trim_end_matches('\0')
            ));
        }
        let inside = reader.members(top)?;
        let find = |name: &str| inside.iter().find(|(other, _)| other == name).map(|(_, a)| *a);
        let need = |name: &str| find(name).ok_or_else(|| format!("has no data set VTKHDF/{name}"));
        let mut whole = |name: &str| -> Result<Vec<f64>, String> {
            let set = reader.dataset(need(name)?)?;
            let rows = set.extents.first().copied().unwrap_or(0);
            reader.rows(&set, 0, rows).map_err(|why| format!("{name}: {why}"))
        };
        let counts = whole("NumberOfPoints")?;
        let [count] = counts[..] else {
            return Err(format!("has {} parts; one of all frames is read", counts.len()));
        };
        let point_count = rumple_numerics::num::whole(count) as u64;
        let triangles = triangles(&whole("Types")?, &whole("Offsets")?, &whole("Connectivity")?)?;
        let points = reader.dataset(need("Points")?)?;
        let steps = find("Steps").map(|at| reader.members(at)).transpose()?.unwrap_or_default();
        let step = |name: &str| steps.iter().find(|(other, _)| other == name).map(|(_, a)| *a);
        let mut times = vec![0.0];
        if let (Some(values), Some(at)) = (step("Values"), find("Steps")) {
            let bytes = reader.attribute(at, "NSteps")?.unwrap_or_default();
            let count = bytes.first_chunk().map_or(0, |n| u64::from_le_bytes(*n));
            let set = reader.dataset(values)?;
            times = reader.rows(&set, 0, count)?;
        }
        let offsets = step("PointOffsets").map(|at| reader.dataset(at)).transpose()?;
        let mut fields = [Vec::new(), Vec::new(), Vec::new()];
        for (list, name) in fields.iter_mut().zip(["PointData", "CellData", "FieldData"]) {
            let Some(group) = find(name) else { continue };
            let starts =
                step(&format!("{name}Offsets")).map(|at| reader.members(at)).transpose()?;
            for (name, address) in reader.members(group)? {
                let starts = starts.iter().flatten().find(|(other, _)| *other == name);
                let start = starts.map(|(_, at)| reader.dataset(*at)).transpose()?;
                // Texts are left aside.
                if let Ok(set) = reader.dataset(address) {
                    list.push((set.title.clone().unwrap_or(name), set, start));
                }
            }
        }
        Ok(Self { reader, times, points, point_count, offsets, triangles, fields })
    }

    /// Times of the frames.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The triangles of all frames.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The points of frame `k`.
    ///
    /// # Errors
    /// Frames that are not there or damaged.
    pub fn points(&mut self, k: usize) -> Result<Vec<[f64; 3]>, String> {
        let start = self.first_row(self.offsets.clone().as_ref(), k)?;
        if self.points.extents.get(1) != Some(&3) {
            return Err("has points of other than 3 coordinates".into());
        }
        let rows = self.reader.rows(&self.points, start, self.point_count)?;
        Ok(rows.as_chunks::<3>().0.to_vec())
    }

    /// The arrays of frame `k` on points, cells and the whole.
    ///
    /// # Errors
    /// As for [`points`](Self::points).
    pub fn arrays(&mut self, k: usize) -> Result<[Vec<FieldValues>; 3], String> {
        let counts = [self.point_count, self.triangles.len() as u64, 1];
        let mut found = [Vec::new(), Vec::new(), Vec::new()];
        for place in 0..3 {
            for (name, set, starts) in self.fields[place].clone() {
                let start = self.first_row(starts.as_ref(), k)?;
                let values = self.reader.rows(&set, start, counts[place]);
                let values = values.map_err(|why| format!("the array \"{name}\": {why}"))?;
                let components = set.extents.get(1).map_or(1, |n| usize::try_from(*n).unwrap_or(1));
                found[place].push(FieldValues { name, components, values });
            }
        }
        Ok(found)
    }

    /// The first row of frame `k`.
    fn first_row(&mut self, offsets: Option<&Dataset>, k: usize) -> Result<u64, String> {
        if k >= self.times.len() {
            return Err(format!("has {} frames; frame {k} is not among them", self.times.len()));
        }
        let Some(set) = offsets else { return Ok(0) };
        let found = self.reader.rows(set, k as u64, 1)?;
        Ok(rumple_numerics::num::whole(found.first().copied().unwrap_or(0.0)) as u64)
    }
}

/// Cells that must all be triangles.
fn triangles(types: &[f64], offsets: &[f64], corners: &[f64]) -> Result<Vec<[u32; 3]>, String> {
    if let Some((cell, kind)) =
        types.iter().enumerate().find(|(_, kind)| **kind != f64::from(TRIANGLE))
    {
        return Err(format!(
            "cell {cell} has VTK type {kind}; of VTKHDF files triangles (5) are read"
        ));
    }
    let regular =
        offsets.iter().enumerate().all(|(k, o)| *o == 3.0 * rumple_numerics::num::real(k));
    if !regular || offsets.len() != types.len() + 1 || corners.len() != 3 * types.len() {
        return Err(format!(
            "{} offsets and {} corners do not suit {} triangles",
            offsets.len(),
            corners.len(),
            types.len()
        ));
    }
    let corner = |v: f64| rumple_numerics::num::index(rumple_numerics::num::whole(v));
    Ok(corners.as_chunks::<3>().0.iter().map(|t| t.map(corner)).collect())
}
