//! What VTK asks of a temporal unstructured grid: groups, data sets, steps.
//!
//! ```text
//! VTKHDF                   Version = [2, 0], Type = "UnstructuredGrid"
//!   Points                 all frames one after another
//!   Connectivity, Offsets, Types, NumberOfPoints, NumberOfCells, NumberOfConnectivityIds      once
//!   PointData/…, CellData/…, FieldData/…       all frames one after another
//!   Steps                  NSteps
//!     Values               times
//!     PointOffsets         k · points;   PointDataOffsets/…, CellDataOffsets/…, FieldDataOffsets/… alike
//!     PartOffsets, CellOffsets, ConnectivityIdOffsets = 0,   NumberOfParts = 1,   FieldDataSizes/… = 1
//! ```
//!
//! Fields with equal offsets share one data set, linked under every field's name. HDF5 reserves `/`, so `1/length` is
//! stored as `1 per length`; the attribute `name` keeps the original.

use std::collections::BTreeMap;
use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::extendible::{Disk, ExtendibleFile, Extension, MAX_LINKS, Node, Row, Spec};
use super::object::{Attribute, Kind};

/// VTK's number of a triangle.
pub(crate) const TRIANGLE: u8 = 5;

/// Compression level of deflate: positions keep their full precision, so that higher levels gain little.
const DEFLATE_LEVEL: u32 = 1;

/// Named numbers on points or cells, entity by entity.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Name with its unit.
    pub name: &'a str,
    /// 1 or 3.
    pub components: usize,
    /// The values.
    pub values: &'a [f64],
}

/// The state of a frame.
#[derive(Debug, Clone)]
pub struct State<'a> {
    /// Time.
    pub time: f64,
    /// Coordinates of the points.
    pub points: &'a [[f64; 3]],
    /// Fields on points.
    pub point_fields: Vec<Field<'a>>,
    /// Fields on cells.
    pub cell_fields: Vec<Field<'a>>,
    /// Scalars of the whole frame, as (name, value): VTK's field data.
    pub scalars: &'a [(String, f64)],
}

/// What is the same in all frames: the triangles, and how many points there are.
#[derive(Debug, Clone, Copy)]
pub struct Topology<'a> {
    /// Number of points.
    pub points: usize,
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
}

/// Writes frames to a file, each whole before the next.
#[derive(Debug)]
pub struct FrameWriter<D> {
    file: ExtendibleFile<D>,
    compressed: bool,
    /// Names and components of the first frame, in the order of its data sets.
    layout: Vec<(String, usize)>,
    scalars: usize,
    cells: u64,
}

/// The name of a field as a link of an HDF5 group, and the attribute that keeps the original.
fn hdf5_name(name: &str) -> (String, Vec<(String, Attribute)>) {
    // `/` separates groups, and `.` is the group itself.
    let safe = name.replace('/', " per ");
    let safe = if safe.is_empty() || safe == "." { format!("field {safe}") } else { safe };
    (safe, vec![("name".to_owned(), Attribute::Text(name.to_owned()))])
}

/// Specifications of the extendible data sets, numbered in the order of a frame's rows.
#[derive(Default)]
struct DataSetSpecs(Vec<Spec>);

impl DataSetSpecs {
    fn add(
        &mut self,
        kind: Kind,
        columns: Option<u64>,
        extension: Extension,
        compressed: bool,
    ) -> usize {
        self.0.push(Spec { kind, columns, extension, compressed });
        self.0.len() - 1
    }
}

fn group(members: BTreeMap<String, Node>) -> Node {
    Node::Group(members, Vec::new())
}

impl<D: Disk> FrameWriter<D> {
    /// Writes a file without frames for states like `first` on `topology`.
    ///
    /// # Errors
    /// Those of the file, and more fields than a group can name.
    pub fn create(
        disk: D,
        topology: Topology<'_>,
        first: &State<'_>,
        compressed: bool,
    ) -> io::Result<Self> {
        let mut sets = DataSetSpecs::default();
        let (points, cells) = (topology.points as u64, topology.triangles.len() as u64);
        let mut top = BTreeMap::new();
        let of = |number: usize| Node::Extendible(number, Vec::new());
        // In the order of the rows of a frame.
        let all_points = sets.add(Kind::F64, Some(3), Extension::Chunk(points), compressed);
        top.insert("Points".to_owned(), of(all_points));
        let mut layout = Vec::new();
        let mut fields = [BTreeMap::new(), BTreeMap::new()];
        for (place, list, rows) in
            [(0, &first.point_fields, points), (1, &first.cell_fields, cells)]
        {
            for field in list {
                let columns = (field.components > 1).then_some(field.components as u64);
                let set = sets.add(Kind::F64, columns, Extension::Chunk(rows), compressed);
                let (name, title) = hdf5_name(field.name);
                fields[place].insert(name, Node::Extendible(set, title));
                layout.push((field.name.to_owned(), field.components));
            }
        }
        let mut scalars = BTreeMap::new();
        for (name, _) in first.scalars {
            let set = sets.add(Kind::F64, None, Extension::Number, false);
            let (name, title) = hdf5_name(name);
            scalars.insert(name, Node::Extendible(set, title));
        }
        let crowded = fields.iter().chain([&scalars]).any(|group| group.len() > MAX_LINKS);
        if crowded
            || fields[0].len() + fields[1].len() != layout.len()
            || scalars.len() != first.scalars.len()
        {
            let what = format!(
                "two fields get the same HDF5 name, or a group has more than {MAX_LINKS} fields"
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        let steps = steps(&mut sets, &fields, &scalars);
        let [point, cell] = fields;
        top.insert("PointData".to_owned(), group(point));
        top.insert("CellData".to_owned(), group(cell));
        top.insert("FieldData".to_owned(), group(scalars));
        top.insert("Steps".to_owned(), steps);
        for (name, node) in fixed(topology) {
            top.insert(name.to_owned(), node);
        }
        let attributes = vec![
            ("Version".to_owned(), Attribute::Pair([2, 0])),
            ("Type".to_owned(), Attribute::Text("UnstructuredGrid".to_owned())),
        ];
        let file = ExtendibleFile::create(disk, ("VTKHDF", top, attributes), sets.0)?;
        Ok(Self { file, compressed, layout, scalars: first.scalars.len(), cells })
    }

    /// Frames written.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.file.count
    }

    /// Adds a frame. After an error of the disk the file has the frames before, and takes no more.
    ///
    /// # Errors
    /// Those of the file, and a state with other fields than the first one.
    pub fn append(&mut self, state: &State<'_>) -> io::Result<()> {
        let fields: Vec<&Field<'_>> = state.point_fields.iter().chain(&state.cell_fields).collect();
        let layout = fields.iter().map(|f| (f.name, f.components));
        if !layout.eq(self.layout.iter().map(|(name, n)| (name.as_str(), *n)))
            || state.scalars.len() != self.scalars
        {
            let what = "the frame has other fields than the first one".to_owned();
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        let arrays: Vec<&[f64]> = std::iter::once(state.points.as_flattened())
            .chain(fields.iter().map(|f| f.values))
            .collect();
        let compressed = self.compressed;
        let chunks: io::Result<Vec<Vec<u8>>> =
            arrays.into_par_iter().map(|values| encoded(values, compressed)).collect();
        let chunks = chunks?;
        let k = self.file.count;
        let cells = self.cells;
        let mut rows: Vec<Row> = chunks.into_iter().map(Row::Chunk).collect();
        rows.extend(state.scalars.iter().map(|(_, value)| Row::Number(value.to_le_bytes())));
        rows.push(Row::Number(state.time.to_le_bytes()));
        rows.extend(
            [state.points.len() as u64 * k, cells * k, k].map(|n| Row::Number(n.to_le_bytes())),
        );
        rows.extend([(); 4].map(|()| Row::Constant));
        self.file.append(rows)
    }
}

/// The group `Steps`: times, and where each frame begins. Its data sets follow those of the fields in a frame's rows.
fn steps(
    sets: &mut DataSetSpecs,
    fields: &[BTreeMap<String, Node>; 2],
    scalars: &BTreeMap<String, Node>,
) -> Node {
    let of = |number: usize| Node::Extendible(number, Vec::new());
    let mut steps = BTreeMap::new();
    let times = sets.add(Kind::F64, None, Extension::Number, false);
    let [to_points, to_cells, to_scalars] =
        [(); 3].map(|()| sets.add(Kind::I64, None, Extension::Number, false));
    let zero = sets.add(Kind::I64, None, Extension::Constant(0), false);
    let zeros = sets.add(Kind::I64, Some(1), Extension::Constant(0), false);
    let one = sets.add(Kind::I64, None, Extension::Constant(1), false);
    let ones = sets.add(Kind::I64, Some(2), Extension::Constant(1), false);
    let offsets = |group: &BTreeMap<String, Node>, set: usize| {
        self::group(group.keys().map(|name| (name.clone(), of(set))).collect())
    };
    steps.insert("Values".to_owned(), of(times));
    steps.insert("PartOffsets".to_owned(), of(zero));
    steps.insert("NumberOfParts".to_owned(), of(one));
    steps.insert("PointOffsets".to_owned(), of(to_points));
    steps.insert("CellOffsets".to_owned(), of(zeros));
    steps.insert("ConnectivityIdOffsets".to_owned(), of(zeros));
    steps.insert("PointDataOffsets".to_owned(), offsets(&fields[0], to_points));
    steps.insert("CellDataOffsets".to_owned(), offsets(&fields[1], to_cells));
    steps.insert("FieldDataOffsets".to_owned(), offsets(scalars, to_scalars));
    steps.insert("FieldDataSizes".to_owned(), offsets(scalars, ones));
    Node::Group(steps, vec![("NSteps".to_owned(), Attribute::Number(0))])
}

/// The data sets that are the same in all frames.
fn fixed(topology: Topology<'_>) -> [(&'static str, Node); 6] {
    let triangles = topology.triangles;
    let whole = |numbers: &mut dyn Iterator<Item = u64>| -> Node {
        let bytes: Vec<u8> = numbers.flat_map(u64::to_le_bytes).collect();
        Node::Static(Kind::I64, bytes.len() as u64 / 8, bytes)
    };
    let one = |n: usize| whole(&mut std::iter::once(n as u64));
    let cells = triangles.len();
    [
        ("NumberOfPoints", one(topology.points)),
        ("NumberOfCells", one(cells)),
        ("NumberOfConnectivityIds", one(3 * cells)),
        ("Connectivity", whole(&mut triangles.as_flattened().iter().map(|v| u64::from(*v)))),
        ("Offsets", whole(&mut (0..=cells as u64).map(|k| 3 * k))),
        ("Types", Node::Static(Kind::U8, cells as u64, vec![TRIANGLE; cells])),
    ]
}

/// Little-endian bytes; if `compressed`, byte-shuffled and deflated.
fn encoded(values: &[f64], compressed: bool) -> io::Result<Vec<u8>> {
    if !compressed {
        return Ok(values.iter().flat_map(|x| x.to_le_bytes()).collect());
    }
    let mut shuffled = Vec::with_capacity(8 * values.len());
    for byte in 0..8 {
        shuffled.extend(values.iter().map(|x| x.to_le_bytes()[byte]));
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(DEFLATE_LEVEL));
    encoder.write_all(&shuffled)?;
    encoder.finish()
}
