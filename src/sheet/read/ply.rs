//! PLY, text or binary: vertices `x y z` and faces `vertex_indices`.
//!
//! Further numbers of vertices and faces become arrays; lists among them, and elements other than these two, are left
//! aside. G. Turk, The PLY polygon file format, 1994.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

use super::polygons::Polygons;
use super::stream::{Coding, Scalar, Stream};
use crate::Surface;
use crate::surface::Array;

/// Most elements and properties in all; each costs a line of the head.
const MAX_PROPERTIES: usize = 1000;

/// One number, or a list of numbers, of every element.
struct Property<'a> {
    name: &'a str,
    /// Type of the length, where it is a list.
    length: Option<Scalar>,
    kind: Scalar,
}

/// Elements of one kind.
struct Element<'a> {
    name: &'a str,
    count: usize,
    properties: Vec<Property<'a>>,
}

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let mut stream = Stream::new(bytes);
    if bytes.starts_with(b"ply\r") && !bytes.starts_with(b"ply\r\n") {
        stream.line_end = b'\r';
    }
    let (coding, elements) = head(&mut stream)?;
    stream.coding = coding;
    let mut surface = Surface::default();
    let mut polygons = Polygons::default();
    let mut lines = Vec::new();
    for element in &elements {
        match element.name {
            "vertex" => {
                vertices(&mut stream, element, &mut surface)?;
            }
            "face" => {
                lines = faces(&mut stream, element, &mut polygons, &mut surface)?;
            }
            "tristrips" if element.count > 0 => {
                return Err("has triangle strips (element tristrips); save it with faces".into());
            }
            name => {
                for k in 0..element.count {
                    for property in &element.properties {
                        skip(&mut stream, property, &format!("{} of {name} {k}", property.name))?;
                    }
                }
                surface.notes.push(format!("{} elements \"{name}\" were ignored", element.count));
            }
        }
    }
    let found = polygons.triangles(&surface.points, |k| format!("face {k}"))?;
    surface.notes.extend(found.note());
    found.spread(&mut surface.cell_arrays);
    if coding == Coding::Text {
        surface.triangle_lines = found.spread_lines(lines);
    }
    surface.triangles = found.corners;
    Ok(surface)
}

/// The coding of this name.
fn coding_of(name: &str) -> Result<Coding, String> {
    match name {
        "ascii" => Ok(Coding::Text),
        "binary_little_endian" => Ok(Coding::Little),
        "binary_big_endian" => Ok(Coding::Big),
        _ => Err(format!(
            "format \"{}\"; ascii, binary_little_endian and binary_big_endian are known",
            shown(name)
        )),
    }
}

/// Reads the head, which is text.
fn head<'a>(stream: &mut Stream<'a>) -> Result<(Coding, Vec<Element<'a>>), String> {
    if stream.line() != Some(b"ply") {
        return Err("line 1: expected \"ply\": this is not a PLY file".into());
    }
    let mut coding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut properties = 0;
    loop {
        let Some(line) = stream.line() else {
            return Err(stream.fault("the head ends without \"end_header\": the file is cut short"));
        };
        let text = std::str::from_utf8(line)
            .map_err(|_| stream.fault("the head of a PLY file is text, and this line is not"))?;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["end_header"] => break,
            ["format", name, _] => {
                coding = Some(coding_of(name).map_err(|why| stream.fault(why))?);
            }
            ["element", name, count] => {
                let what = || format!("\"{}\" is not a count of \"{}\"", shown(count), shown(name));
                let count = count.parse().map_err(|_| stream.fault(what()))?;
                elements.push(Element { name, count, properties: Vec::new() });
            }
            ["property", ref rest @ ..] => {
                let property = property(rest).map_err(|why| stream.fault(why))?;
                let element = elements.last_mut();
                let element =
                    element.ok_or_else(|| stream.fault("a property before any element"))?;
                element.properties.push(property);
                properties += 1;
            }
            _ => {
                return Err(stream.fault(format!(
                    "\"{}\" instead of format, element, property, comment or end_header",
                    shown(text)
                )));
            }
        }
        if properties + elements.len() > MAX_PROPERTIES {
            return Err(stream.fault(format!("more than {MAX_PROPERTIES} elements and properties")));
        }
    }
    let coding = coding.ok_or("the head has no line \"format\"")?;
    for (k, element) in elements.iter().enumerate() {
        if elements[..k].iter().any(|other| other.name == element.name) {
            return Err(format!("the head has two elements \"{}\"", shown(element.name)));
        }
        if element.properties.is_empty() && element.count > 0 {
            return Err(format!("the element \"{}\" has no property", shown(element.name)));
        }
    }
    Ok((coding, elements))
}

/// A property from the words after `property`.
fn property<'a>(words: &[&'a str]) -> Result<Property<'a>, String> {
    let scalar = |name: &str| {
        Ok(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => {
                return Err(format!(
                    "type \"{}\"; char, uchar, short, ushort, int, uint, float and double are known",
                    shown(name)
                ));
            }
        })
    };
    let real = |kind| matches!(kind, Scalar::F32 | Scalar::F64);
    match *words {
        ["list", length, kind, name] => {
            let (length, kind) = (scalar(length)?, scalar(kind)?);
            if real(length) {
                return Err(format!("the length of the list \"{}\" is a real number", shown(name)));
            }
            Ok(Property { name, length: Some(length), kind })
        }
        [kind, name] => Ok(Property { name, length: None, kind: scalar(kind)? }),
        _ => Err("expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"".into()),
    }
}

/// Reads and drops the numbers of a property.
fn skip(stream: &mut Stream, property: &Property, what: &str) -> Result<(), String> {
    let count = match property.length {
        None => 1,
        Some(length) => stream.count(length, what)?,
    };
    (0..count).try_for_each(|_| stream.real(property.kind, what).map(drop))
}

/// Reads the vertices.
fn vertices(stream: &mut Stream, element: &Element, surface: &mut Surface) -> Result<(), String> {
    let axis = |property: &Property| {
        let axis = ["x", "y", "z"].iter().position(|&axis| axis == property.name);
        axis.filter(|_| property.length.is_none())
    };
    for name in ["x", "y", "z"] {
        if !element.properties.iter().any(|p| p.name == name && p.length.is_none()) {
            return Err(format!("the vertices have no property \"{name}\""));
        }
    }
    let mut arrays = arrays(element, |p| axis(p).is_none());
    for k in 0..element.count {
        let mut point = Vec3::zeros();
        let mut array = arrays.iter_mut();
        for property in &element.properties {
            let what = format!("{} of vertex {k}", property.name);
            if let Some(axis) = axis(property) {
                point[axis] = stream.real(property.kind, &what)?;
            } else if property.length.is_some() {
                skip(stream, property, &what)?;
            } else if let Some(array) = array.next() {
                array.values.push(stream.real(property.kind, &what)?);
            }
        }
        surface.points.push(point);
        if stream.coding == Coding::Text {
            surface.point_lines.push(index(stream.number()));
        }
    }
    surface.point_arrays = arrays;
    Ok(())
}

/// Reads the faces; returns their lines.
fn faces(
    stream: &mut Stream,
    element: &Element,
    polygons: &mut Polygons,
    surface: &mut Surface,
) -> Result<Vec<u32>, String> {
    let corners =
        |p: &Property| matches!(p.name, "vertex_indices" | "vertex_index") && p.length.is_some();
    let list = element.properties.iter().find(|p| corners(p));
    let Some(list) = list else {
        return Err("the faces have no list \"vertex_indices\"".into());
    };
    if matches!(list.kind, Scalar::F32 | Scalar::F64) {
        return Err("the list \"vertex_indices\" holds real numbers".into());
    }
    let mut arrays = arrays(element, |_| true);
    let mut lines = Vec::new();
    let mut face = Vec::new();
    for k in 0..element.count {
        let mut array = arrays.iter_mut();
        for property in &element.properties {
            let what = format!("{} of face {k}", property.name);
            if corners(property) {
                let count = stream.count(property.length.unwrap_or(Scalar::U8), &what)?;
                face.clear();
                for _ in 0..count {
                    let vertex = stream.count(property.kind, &what)?;
                    face.push(index(vertex));
                }
            } else if property.length.is_some() {
                skip(stream, property, &what)?;
            } else if let Some(array) = array.next() {
                array.values.push(stream.real(property.kind, &what)?);
            }
        }
        polygons.push(face.iter().copied());
        lines.push(index(stream.number()));
    }
    surface.cell_arrays = arrays;
    Ok(lines)
}

/// Empty arrays for the single numbers of an element.
fn arrays(element: &Element, wanted: impl Fn(&Property) -> bool) -> Vec<Array> {
    let single = element.properties.iter().filter(|p| p.length.is_none() && wanted(p));
    single.map(|p| Array { name: p.name.to_owned(), components: 1, values: Vec::new() }).collect()
}

/// The beginning of a word, for people.
fn shown(word: &str) -> String {
    word.chars().take(30).collect()
}
