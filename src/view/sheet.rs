//! The frames of one run: which of them are shown, and their positions and fields with 16 bits.
//!
//! ```text
//! position   q ∈ -32767..32767   x = least + (q + 32767) (largest - least)/65534   box over all frames shown
//! field      q ∈ 0..65534        f = least + q (largest - least)/65534             range of the frame
//! ```
//!
//! -32768 and 65535 stand for numbers that are not finite. A block of a frame is x y z of every vertex, then the
//! components of the fields one after another, little-endian. `displacement` is not stored: it is the position less the
//! rest position, which is stored once.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::blocks::Blocks;
use super::record::text_of;
use crate::num::{real, whole};
use crate::output::ResultDirectory;
use crate::run::{Error, Result};
use crate::sheet::{Array, Surface, read};

/// Levels of a number above the least one.
const LEVELS: u16 = 65534;
/// Level of a number that is not finite.
const MISSING: u16 = 65535;

/// A sheet as the page has it.
#[derive(Debug, Serialize)]
pub(super) struct Sheet {
    pub(super) vertices: usize,
    #[serde(skip)]
    pub(super) faces: usize,
    /// Block of the triangles, three 32-bit vertex numbers each.
    triangles: usize,
    /// Block of the rest positions, if they are known.
    rest: Option<usize>,
    #[serde(rename = "box")]
    bounds: Bounds,
    fields: Vec<FieldTitle>,
    pub(super) frames: Vec<FrameBlock>,
    /// Frames that the run has.
    pub(super) of: usize,
}

/// A bounding box.
#[derive(Debug, Serialize)]
struct Bounds {
    least: [f64; 3],
    largest: [f64; 3],
}

/// What a field is called.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct FieldTitle {
    name: String,
    /// `vertex` or `triangle`.
    at: &'static str,
    components: usize,
}

/// One frame.
#[derive(Debug, Serialize)]
pub(super) struct FrameBlock {
    /// Its number in the run.
    number: usize,
    time: f64,
    block: usize,
    /// Least and largest value of every component of every field.
    ranges: Vec<[f64; 2]>,
}

/// The frames of the index of the run in `root`: times and paths; none without an index.
///
/// # Errors
/// An entry without a time or a file, or with a file outside of the directory.
pub(super) fn index(root: &Path) -> Result<Vec<(f64, PathBuf)>> {
    let pvd = root.join(ResultDirectory::PVD);
    let Some(text) = text_of(&pvd)? else {
        let old = ResultDirectory::OLD_FRAMES.map(|name| root.join(name));
        return match old.iter().find(|path| path.is_file()) {
            Some(path) => Err(Error::Refused(format!(
                "{}: frames are read from `.vtu` files alone; ParaView opens these, and saves them as such",
                path.display()
            ))),
            None => Ok(Vec::new()),
        };
    };
    if !(text.contains("<VTKFile") && text.trim_end().ends_with("</VTKFile>")) {
        let message =
            "expected an index of frames, as a run writes it; it is cut, or something else";
        return Err(Error::Refused(format!("{}: {message}", pvd.display())));
    }
    let entries = text.split("<DataSet").skip(1).map(|entry| {
        let part = |name: &str| entry.split(&format!(" {name}=\"")).nth(1)?.split('"').next();
        let time = part("timestep").and_then(|time| time.parse::<f64>().ok());
        place(root, &pvd, time, part("file"))
    });
    entries.collect()
}

/// Checks an entry of `index`.
fn place(
    root: &Path,
    index: &Path,
    time: Option<f64>,
    file: Option<&str>,
) -> Result<(f64, PathBuf)> {
    let inside = |file: &&str| {
        Path::new(file).components().all(|c| matches!(c, std::path::Component::Normal(_)))
    };
    match (time.filter(|time| time.is_finite()), file.filter(inside)) {
        (Some(time), Some(file)) => Ok((time, root.join(file))),
        _ => Err(Error::Refused(format!(
            "{}: expected a time and a file in the directory for each frame, found {time:?} and {file:?}",
            index.display()
        ))),
    }
}

/// Which of `count` frames are shown if `most` are: the first, the last, and others at equal distances.
pub(super) fn chosen(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    let step = real(count - 1) / real(most.max(2) - 1);
    (0..most.max(2)).map(|k| whole(step * real(k))).collect()
}

/// Reads the frames of the run in `root`, at most `frames` of them in at most `bytes` of the page; none where it has none.
///
/// # Errors
/// Frames that cannot be read or are not of one sheet; a bound that not even the first and the last keep.
pub(super) fn read(
    root: &Path,
    frames: usize,
    bytes: usize,
    blocks: &mut Blocks,
) -> Result<Option<Sheet>> {
    let all = index(root)?;
    let Some((_, path)) = all.first() else { return Ok(None) };
    let first = Loaded::read(path, None)?;
    let most = first.most(all.len().min(frames), bytes).ok_or_else(|| {
        let needed = first.size(all.len().min(2));
        Error::Refused(format!(
            "{}: the first and the last frame take {} MB of the page, and {} MB are left for them; give a larger \
             --size-limit",
            root.display(),
            megabytes(needed),
            megabytes(bytes)
        ))
    })?;
    let numbers = chosen(all.len(), most);
    let mut loaded = Vec::with_capacity(numbers.len());
    for number in &numbers[1..] {
        loaded.push(Loaded::read(&all[*number].1, Some(&first))?);
    }
    loaded.insert(0, first);
    Ok(Some(pack(&all, &numbers, &loaded, blocks)))
}

/// Whether an array is the field that positions and rest positions give.
fn is_displacement(array: &Array) -> bool {
    array.name.starts_with("displacement") && array.components == 3
}

/// Millions of bytes, rounded up.
fn megabytes(bytes: usize) -> f64 {
    (real(bytes) / 1e5).ceil() / 10.0
}

/// A frame with the fields of the page.
struct Loaded {
    surface: Surface,
    fields: Vec<FieldTitle>,
}

impl Loaded {
    /// Reads the frame `path`, which is to be of the sheet and with the fields of `first`.
    fn read(path: &Path, first: Option<&Self>) -> Result<Self> {
        let surface = read::surface(path)?;
        let refuse = |what: String| Err(Error::Refused(format!("{}: {what}", path.display())));
        let count = surface.points.len();
        if let Some(t) =
            surface.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= count))
        {
            return refuse(format!("triangle {t} has a vertex beyond the {count} of the frame"));
        }
        let title = |at, array: &Array| FieldTitle {
            name: array.name.clone(),
            at,
            components: array.components,
        };
        let points = surface.point_arrays.iter().filter(|array| !is_displacement(array));
        let mut fields: Vec<FieldTitle> = points.map(|array| title("vertex", array)).collect();
        fields.extend(surface.cell_arrays.iter().map(|array| title("triangle", array)));
        let Some(first) = first else { return Ok(Self { surface, fields }) };
        if first.surface.triangles != surface.triangles || first.surface.points.len() != count {
            return refuse("its sheet is another one than that of the first frame".into());
        }
        if first.fields != fields {
            let names = |fields: &[FieldTitle]| {
                fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ")
            };
            let (expected, found) = (names(&first.fields), names(&fields));
            return refuse(format!(
                "expected the fields of the first frame ({expected}), found {found}"
            ));
        }
        Ok(Self { surface, fields })
    }

    /// The numbers of a field.
    fn values(&self, field: &FieldTitle) -> &[f64] {
        let arrays = match field.at {
            "vertex" => self.surface.point_array(&field.name),
            _ => self.surface.cell_array(&field.name),
        };
        arrays.map_or(&[], |array| &array.values)
    }

    /// Rest positions, where the frame has displacements.
    fn rest(&self) -> Option<Vec<[f64; 3]>> {
        let array = self.surface.point_arrays.iter().find(|array| is_displacement(array))?;
        let points = self.surface.points.iter().zip(array.values.as_chunks::<3>().0);
        Some(points.map(|(x, u)| [x.x - u[0], x.y - u[1], x.z - u[2]]).collect())
    }

    /// Bytes of the page for `count` frames like this one.
    fn size(&self, count: usize) -> usize {
        let numbers: usize = self.fields.iter().map(|field| self.values(field).len()).sum();
        let rest = usize::from(self.rest().is_some()) * Blocks::size(6 * self.surface.points.len());
        let ranges = 60 * self.fields.iter().map(|field| field.components).sum::<usize>() + 100;
        let frame = Blocks::size(6 * self.surface.points.len() + 2 * numbers) + ranges;
        let titles: usize = self.fields.iter().map(|field| 100 + 2 * field.name.len()).sum();
        Blocks::size(12 * self.surface.triangles.len()) + rest + 1000 + titles + count * frame
    }

    /// How many frames like this one, at most `frames`, take at most `bytes`; none if not even the first and the last do.
    fn most(&self, frames: usize, bytes: usize) -> Option<usize> {
        let (fixed, one) = (self.size(0), self.size(1) - self.size(0));
        let room = bytes.checked_sub(fixed)? / one;
        (room >= frames.min(2)).then(|| room.min(frames))
    }
}

/// Adds the blocks of the frames `loaded`, `numbers` of `all`.
fn pack(
    all: &[(f64, PathBuf)],
    numbers: &[usize],
    loaded: &[Loaded],
    blocks: &mut Blocks,
) -> Sheet {
    let first = &loaded[0];
    let rest = first.rest();
    let points: Vec<Vec<[f64; 3]>> = loaded
        .iter()
        .map(|frame| frame.surface.points.iter().map(|x| [x.x, x.y, x.z]).collect())
        .collect();
    let bounds = Bounds::enclosing(points.iter().chain(&rest).flatten());
    let triangles = first.surface.triangles.iter().flatten().flat_map(|v| v.to_le_bytes());
    let triangles = blocks.add(triangles.collect());
    let rest = rest.map(|rest| blocks.add(bounds.positions(&rest)));
    let mut frames = Vec::with_capacity(loaded.len());
    for ((frame, points), number) in loaded.iter().zip(&points).zip(numbers) {
        let mut bytes = bounds.positions(points);
        let mut ranges = Vec::new();
        for field in &frame.fields {
            let values = frame.values(field);
            for c in 0..field.components {
                let component = || values.iter().skip(c).step_by(field.components).copied();
                let range = extent(component());
                ranges.push(range);
                bytes.extend(component().flat_map(|value| level(value, range).to_le_bytes()));
            }
        }
        frames.push(FrameBlock {
            number: *number,
            time: all[*number].0,
            block: blocks.add(bytes),
            ranges,
        });
    }
    let (vertices, faces) = (first.surface.points.len(), first.surface.triangles.len());
    let fields = first.fields.clone();
    Sheet { vertices, faces, triangles, rest, bounds, fields, frames, of: all.len() }
}

impl Bounds {
    /// Of the finite coordinates of `points`.
    fn enclosing<'a>(points: impl Iterator<Item = &'a [f64; 3]> + Clone) -> Self {
        let range = [0, 1, 2].map(|c| extent(points.clone().map(|x| x[c])));
        Self { least: range.map(|r| r[0]), largest: range.map(|r| r[1]) }
    }

    /// Positions as signed 16-bit numbers.
    fn positions(&self, points: &[[f64; 3]]) -> Vec<u8> {
        let coordinate = |x: &[f64; 3], c: usize| level(x[c], [self.least[c], self.largest[c]]);
        // In two's complement: the least level becomes -32767, the missing one -32768.
        let signed = |level: u16| level.wrapping_sub(LEVELS / 2).to_le_bytes();
        let all = points.iter().flat_map(|x| [0, 1, 2].map(|c| coordinate(x, c)));
        all.flat_map(signed).collect()
    }
}

/// The least and the largest of the finite numbers among `values`; zeros of none.
fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let wide = (f64::INFINITY, f64::NEG_INFINITY);
    let finite = values.filter(|value| value.is_finite());
    let (least, largest) = finite.fold(wide, |(l, h), v| (l.min(v), h.max(v)));
    if least <= largest { [least, largest] } else { [0.0, 0.0] }
}

/// The level of `value` in a range.
fn level(value: f64, [least, largest]: [f64; 2]) -> u16 {
    if !value.is_finite() {
        return MISSING;
    }
    // Halves: the width of a range of doubles may be infinite.
    let width = 0.5 * largest - 0.5 * least;
    let share = if width > 0.0 { (0.5 * value - 0.5 * least) / width } else { 0.0 };
    u16::try_from(whole(share * f64::from(LEVELS))).unwrap_or(LEVELS).min(LEVELS)
}
