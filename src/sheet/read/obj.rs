//! Wavefront OBJ: `v x y z` and `f a b c` lines; the rest describes looks and is left aside.
//! Faces of more than three vertices are cut into triangles.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::polygons::Polygons;
use crate::Surface;
use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// Statements about looks, groups and names: no part of the geometry of a sheet.
const IGNORED_STATEMENTS: [&str; 11] =
    ["vn", "vt", "vp", "g", "o", "s", "usemtl", "mtllib", "l", "p", "maplib"];

/// Reads the text of an OBJ file.
///
/// Vertex numbers are checked here against 32 bits only; whether the vertex exists is for the mesh
/// checks to say, but negative numbers (counted back from the last vertex) must exist at once.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let mut surface = Surface::default();
    let mut faces = Polygons::default();
    let mut face_lines = Vec::new();
    let mut aside: BTreeMap<&str, usize> = BTreeMap::new();
    let mut lines = bytes.split(|&b| b == b'\n').zip(1..);
    while let Some((line, number)) = lines.next() {
        let line = continued(line, &mut lines);
        let text = std::str::from_utf8(&line)
            .map_err(|_| format!("line {number} is not text: this is not an OBJ file"))?;
        let mut words = text.split('#').next().unwrap_or_default().split_ascii_whitespace();
        match words.next() {
            None => {}
            Some("v") => {
                let point = point(words).map_err(|why| format!("line {number}: {why}"))?;
                surface.points.push(point);
                surface.point_lines.push(index(number));
            }
            Some("f") => {
                let corners = face(words, surface.points.len())
                    .map_err(|why| format!("line {number}: {why}"))?;
                faces.push(corners);
                face_lines.push(index(number));
            }
            Some(word) => match IGNORED_STATEMENTS.iter().find(|&&known| known == word) {
                Some(&known) => *aside.entry(known).or_default() += 1,
                None => {
                    let short: String = word.chars().take(20).collect();
                    return Err(format!(
                        "line {number}: \"{short}\" is not a statement of an OBJ file (v, f, {}, \
                         or # are known)",
                        IGNORED_STATEMENTS.join(", ")
                    ));
                }
            },
        }
    }
    let found =
        faces.triangles(&surface.points, |k| format!("line {}: the face", face_lines[k]))?;
    surface.notes.extend(found.note());
    surface.triangle_lines = found.spread_lines(face_lines);
    surface.triangles = found.corners;
    for (word, count) in aside {
        surface.notes.push(format!("{count} lines \"{word}\" were ignored"));
    }
    Ok(surface)
}

/// A line with those that continue it: a backslash at the end of a line joins the next one to it.
fn continued<'a>(
    line: &'a [u8],
    more: &mut impl Iterator<Item = (&'a [u8], usize)>,
) -> Cow<'a, [u8]> {
    let mut whole = Cow::Borrowed(line);
    while let Some(end) = whole.trim_ascii_end().strip_suffix(b"\\").map(<[u8]>::len) {
        let Some((next, _)) = more.next() else { break };
        let open = whole.to_mut();
        open.truncate(end);
        open.push(b' ');
        open.extend_from_slice(next);
    }
    whole
}

/// The numbers of a `v` line; a fourth one (weight) and colours are left aside.
fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Vec3, String> {
    let mut point = Vec3::zeros();
    for (x, axis) in point.iter_mut().zip(["x", "y", "z"]) {
        let word =
            words.next().ok_or_else(|| format!("a vertex needs x y z; {axis} is missing"))?;
        *x = word.parse().map_err(|_| format!("\"{word}\" is not a number for {axis}"))?;
    }
    Ok(point)
}

/// The vertex numbers of an `f` line, from 0.
fn face<'a>(words: impl Iterator<Item = &'a str>, points: usize) -> Result<Vec<u32>, String> {
    let mut corners = Vec::with_capacity(4);
    for word in words {
        // v, v/vt, v//vn and v/vt/vn
        let first = word.split('/').next().unwrap_or_default();
        let given: i64 =
            first.parse().map_err(|_| format!("\"{word}\" is not a vertex number of a face"))?;
        let last = i64::try_from(points).unwrap_or(i64::MAX);
        let vertex = match given {
            1.. => given - 1,
            0 => return Err("vertex number 0: OBJ counts from 1".into()),
            _ => last.saturating_add(given),
        };
        corners.push(u32::try_from(vertex).map_err(|_| {
            format!("vertex number {given} does not exist; {points} vertices came before")
        })?);
    }
    Ok(corners)
}
