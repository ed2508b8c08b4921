//! Reads `[sheet]`: a shape with its sizes, or a file.

use std::path::PathBuf;

use super::{Annulus, Point, Polygon, ShapeSpec, SheetSource, SheetSpec};
use crate::document::{DocumentError, Node, Value, read};

/// Keys of `[sheet]` beside those of the shape.
const COMMON_KEYS: [&str; 5] = ["shape", "file", "planar", "imperfection", "bump"];

/// Names of the shapes.
const SHAPES: [&str; 13] = [
    "disc",
    "rectangle",
    "lattice",
    "annulus",
    "polygon",
    "sphere",
    "cylinder",
    "cap",
    "torus",
    "ellipsoid",
    "wavy-strip",
    "graph",
    "point",
];

/// Those of them that lie in a plane.
const FLAT_SHAPES: [&str; 5] = ["disc", "rectangle", "lattice", "annulus", "polygon"];

/// Reads the table `[sheet]`.
pub(crate) fn read_sheet(mut node: Node) -> Result<SheetSpec, DocumentError> {
    if !node.is_table() {
        return Err(DocumentError::mismatch("a table", node.value.describe()).placed(&node.place));
    }
    let planar = read_planar(&mut node)?;
    let imperfection = optional(&mut node, "imperfection")?;
    let bump = optional(&mut node, "bump")?;
    let place = node.place.clone();
    let source = match (node.take("shape"), node.take("file")) {
        (Some(_), Some((key, _))) => {
            Err(DocumentError::located(key.place, "shape and file exclude each other").help(
                "give shape = \"…\" for a generated sheet, or file = \"…\" for one from a file",
            ))
        }
        (Some((_, name)), None) => read_shape(name, node),
        (None, Some((_, file))) => read_file(file, &node),
        (None, None) => Err(unspecified(&node)),
    };
    let source = source.map_err(|problem| problem.placed(&place))?;
    Ok(SheetSpec { source, planar, imperfection, bump })
}

/// Reads `planar`, and refuses what cannot be in a plane.
fn read_planar(node: &mut Node) -> Result<bool, DocumentError> {
    let Some((_, value)) = node.take("planar") else { return Ok(false) };
    let place = value.place.clone();
    let planar: bool = read(value).map_err(|problem| problem.under("planar"))?;
    if !planar {
        return Ok(false);
    }
    for key in ["imperfection", "bump"] {
        if let Some(start) = node.get(key) {
            let message = "it displaces the start out of the plane, and this sheet is planar";
            let problem = DocumentError::plain(message).placed(&start.place).under(key);
            return Err(
                problem.help("leave it out: a planar sheet has nowhere to go but its plane")
            );
        }
    }
    if let Some(Value::String(shape)) = node.get("shape").map(|shape| &shape.value)
        && SHAPES.contains(&shape.as_str())
        && !FLAT_SHAPES.contains(&shape.as_str())
    {
        let message = format!("a {shape} does not lie in a plane z = const");
        let problem = DocumentError::plain(message).placed(&place).under("planar");
        return Err(problem
            .help(format!("a planar sheet is a flat file or one of: {}", FLAT_SHAPES.join(", "))));
    }
    Ok(true)
}

/// Reads the entry of `key`, where there is one, and takes it out.
fn optional<T: serde::de::DeserializeOwned>(
    node: &mut Node,
    key: &str,
) -> Result<Option<T>, DocumentError> {
    let entry = node.take(key).map(|(_, value)| read(value)).transpose();
    entry.map_err(|problem| problem.under(key))
}

fn read_shape(name: Node, sizes: Node) -> Result<SheetSource, DocumentError> {
    let place = name.place.clone();
    let name: String = read(name).map_err(|problem| problem.under("shape"))?;
    let shape = match name.as_str() {
        "disc" => read(sizes).map(ShapeSpec::Disc),
        "rectangle" => read(sizes).map(ShapeSpec::Rectangle),
        "lattice" => read(sizes).map(ShapeSpec::Lattice),
        "annulus" => return read_annulus(sizes).map(SheetSource::Generated),
        "point" => return read_point(&sizes),
        "polygon" => return read_polygon(sizes).map(SheetSource::Generated),
        "sphere" => read(sizes).map(ShapeSpec::Sphere),
        "cylinder" => read(sizes).map(ShapeSpec::Cylinder),
        "cap" => read(sizes).map(ShapeSpec::Cap),
        "torus" => read(sizes).map(ShapeSpec::Torus),
        "ellipsoid" => read(sizes).map(ShapeSpec::Ellipsoid),
        "wavy-strip" => read(sizes).map(ShapeSpec::WavyStrip),
        "graph" => read(sizes).map(ShapeSpec::Graph),
        _ => return Err(DocumentError::unknown_name("shape", &name, &SHAPES).placed(&place)),
    };
    shape
        .map(SheetSource::Generated)
        .map_err(|problem: DocumentError| problem.also_allowed(&COMMON_KEYS))
}

fn read_point(rest: &Node) -> Result<SheetSource, DocumentError> {
    match &rest.value {
        Value::Table(entries) if !entries.is_empty() => {
            let key = &entries[0].0;
            Err(DocumentError::unknown_key(&key.name, &["shape"])
                .placed(&key.place)
                .help("a point has no dimensions"))
        }
        _ => Ok(SheetSource::Point { shape: Point::Point }),
    }
}

fn read_polygon(sizes: Node) -> Result<ShapeSpec, DocumentError> {
    let place = sizes.place.clone();
    let found: Polygon =
        read(sizes).map_err(|problem: DocumentError| problem.also_allowed(&COMMON_KEYS))?;
    let listed = !found.points.is_empty();
    let problem = match (listed, found.outline.is_some()) {
        (false, false) => DocumentError::missing_key("points")
            .help("a polygon has points = [[x, y], …], or outline = \"FILE.svg\" or a CSV file"),
        (true, true) => DocumentError::plain("points and outline exclude each other"),
        (false, true) if !found.holes.is_empty() => {
            DocumentError::plain("the holes of an outline are in its file")
        }
        (true, false) if found.width.is_some() => {
            DocumentError::plain("width scales an outline; points are in units of length")
        }
        _ => return Ok(ShapeSpec::Polygon(found)),
    };
    Err(problem.placed(&place))
}

fn read_annulus(sizes: Node) -> Result<ShapeSpec, DocumentError> {
    let place = sizes.get("inner").map_or(&sizes.place, |inner| &inner.place).clone();
    let ring: Annulus =
        read(sizes).map_err(|problem: DocumentError| problem.also_allowed(&COMMON_KEYS))?;
    if ring.inner < ring.outer {
        return Ok(ShapeSpec::Annulus(ring));
    }
    let below = format!("a number below outer = {:?}", ring.outer.get());
    let problem = DocumentError::mismatch(&below, format!("{:?}", ring.inner.get()));
    Err(problem.placed(&place).under("inner"))
}

fn read_file(file: Node, rest: &Node) -> Result<SheetSource, DocumentError> {
    let file: PathBuf = read(file).map_err(|problem| problem.under("file"))?;
    match &rest.value {
        Value::Table(entries) if !entries.is_empty() => {
            let key = &entries[0].0;
            Err(DocumentError::unknown_key(&key.name, &["file", "planar", "imperfection", "bump"])
                .placed(&key.place))
        }
        _ => Ok(SheetSource::File { file }),
    }
}

/// Neither shape nor file: a misspelt key is more likely meant than a missing one.
fn unspecified(node: &Node) -> DocumentError {
    let sizes = [
        "vertices",
        "seed",
        "radius",
        "width",
        "height",
        "inner",
        "outer",
        "irregular",
        "caps",
        "major",
        "minor",
        "semi_axes",
        "amplitude",
        "wavelength",
        "z",
        "points",
        "holes",
        "outline",
        "periodic",
    ];
    let known: Vec<&str> = COMMON_KEYS.into_iter().chain(sizes).collect();
    if let Value::Table(entries) = &node.value
        && let Some((key, _)) = entries.iter().find(|(key, _)| !known.contains(&key.name.as_str()))
    {
        return DocumentError::unknown_key(&key.name, &known).placed(&key.place);
    }
    DocumentError::missing_key("shape")
        .help(format!("shape is one of: {}; or give file = \"…\"", SHAPES.join(", ")))
}
