//! Outlines of flat sheets from files: rows of coordinates, or the paths of an SVG drawing.
//!
//! Curves become sides no further from them than [`FLATNESS`] of the width. The ring with the largest area is the outline, the
//! others are holes.

use std::fs;
use std::path::Path;

use kurbo::{BezPath, PathEl, Shape};

use super::xml::{Scanner, Tag, Token};
use crate::SheetError;
use crate::generate::outline::rings;

/// Distance of sides from the curve that they stand for, in widths of the drawing.
const FLATNESS: f64 = 1e-4;

/// A closed ring of points.
pub type Ring = Vec<[f64; 2]>;

/// A ring, and the line of the file that it begins in.
type Placed = (usize, Ring);

/// The outline and its holes in the file at `path`: `.svg`, or text with two coordinates a line and empty lines between
/// rings. Of a drawing y points up; with `width` it is scaled to this extent along x and centred.
///
/// # Errors
/// A file that cannot be read, with the line, and rings that are no outline with holes, with lines and points of the file.
pub fn outline(path: &Path, width: Option<f64>) -> Result<(Ring, Vec<Ring>), SheetError> {
    let refuse = |message: String| SheetError::File { path: path.to_owned(), message };
    let bytes = fs::read(path).map_err(|e| refuse(e.to_string()))?;
    let drawing = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    let placed = if drawing { drawn(&bytes) } else { listed(&bytes) };
    let mut placed = placed.map_err(refuse)?;
    let largest = (0..placed.len())
        .max_by(|a, b| area(&placed[*a].1).total_cmp(&area(&placed[*b].1)))
        .ok_or_else(|| refuse("no closed ring of three points or more".into()))?;
    placed[..=largest].rotate_right(1);
    let name = |k: usize| format!("the ring of line {}", placed[k].0);
    rings(placed.iter().map(|(_, ring)| ring.as_slice()), &name).map_err(|e| {
        let several = if drawing || placed.len() == 1 { "" } else { "; an empty line ends a ring" };
        refuse(format!("{e}{several}"))
    })?;
    let mut holes: Vec<Ring> = placed.into_iter().map(|(_, ring)| ring).collect();
    if drawing {
        holes.iter_mut().flatten().for_each(|point| point[1] = -point[1]);
    }
    if let Some(width) = width {
        scale(&mut holes, width);
    }
    let outline = holes.remove(0);
    Ok((outline, holes))
}

/// Twice the area of a ring, without its sign.
fn area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs()
}

/// Scales to this width, around the middle of the box.
fn scale(rings: &mut [Ring], width: f64) {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for point in rings.iter().flatten() {
        for axis in [0, 1] {
            bounds[0][axis] = bounds[0][axis].min(point[axis]);
            bounds[1][axis] = bounds[1][axis].max(point[axis]);
        }
    }
    let factor = width / (bounds[1][0] - bounds[0][0]);
    for point in rings.iter_mut().flatten() {
        for axis in [0, 1] {
            point[axis] = factor * (point[axis] - 0.5 * (bounds[0][axis] + bounds[1][axis]));
        }
    }
}

/// Rings of a text: two coordinates a line; a first line of words is a head.
fn listed(bytes: &[u8]) -> Result<Vec<Placed>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text".to_owned())?;
    let text = text.trim_start_matches('\u{feff}');
    let mut rings: Vec<Placed> = vec![(1, Ring::new())];
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let words: Vec<&str> =
            line.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty()).collect();
        if words.is_empty() {
            rings.push((number + 1, Ring::new()));
            continue;
        }
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        match (numbers.as_deref(), rings.last_mut()) {
            (Some([x, y]), Some((_, ring))) if x.is_finite() && y.is_finite() => {
                ring.push([*x, *y]);
            }
            (None, _) if number == 1 && words.iter().all(|word| word.parse::<f64>().is_err()) => {}
            _ => return Err(format!("line {number}: expected two numbers, found `{line}`")),
        }
    }
    rings.iter_mut().for_each(|(_, ring)| close(ring));
    rings.retain(|(_, ring)| !ring.is_empty());
    Ok(rings)
}

/// Drops a last point that repeats the first.
fn close(ring: &mut Ring) {
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
}

/// Rings of the paths and polygons of a drawing, in its coordinates.
fn drawn(bytes: &[u8]) -> Result<Vec<Placed>, String> {
    let mut scanner = Scanner::new(bytes);
    let (mut paths, mut all) = (Vec::new(), BezPath::new());
    while let Some(token) = scanner.token()? {
        let Token::Start(tag) = token else { continue };
        let line = tag.line;
        let Some(text) = path_data(&tag).map_err(|what| format!("line {line}: {what}"))? else {
            continue;
        };
        let path = BezPath::from_svg(&text).map_err(|e| format!("line {line}: path: {e}"))?;
        all.extend(path.elements().iter().copied());
        paths.push((line, path));
    }
    let mut rings: Vec<Placed> = Vec::new();
    let tolerance = FLATNESS * all.bounding_box().width();
    for (line, path) in paths {
        kurbo::flatten(&path, tolerance, |element| match (element, rings.last_mut()) {
            (PathEl::MoveTo(p), _) => rings.push((line, vec![[p.x, p.y]])),
            (PathEl::LineTo(p), Some((_, ring))) => ring.push([p.x, p.y]),
            _ => {}
        });
    }
    for (line, ring) in &mut rings {
        ring.dedup();
        close(ring);
        if !ring.iter().flatten().all(|number| number.is_finite()) {
            return Err(format!("line {line}: a coordinate that is not finite"));
        }
    }
    // Lines beside the outline.
    rings.retain(|(_, ring)| ring.len() > 2);
    Ok(rings)
}

/// The data of the path that `tag` draws, if it draws one.
fn path_data(tag: &Tag<'_>) -> Result<Option<String>, String> {
    let name = tag.name;
    let styled = tag.get("style").is_some_and(|style| style.contains("transform"));
    if styled || tag.get("transform").is_some() {
        return Err("a transform; apply it in the drawing program".to_owned());
    }
    match name {
        "defs" | "clipPath" | "mask" | "symbol" | "pattern" | "marker" => {
            Err(format!("<{name}>; leave only the paths of the outline"))
        }
        "rect" | "circle" | "ellipse" | "polyline" => Err(format!("<{name}>; make it a path")),
        "path" => Ok(tag.get("d").map(str::to_owned)),
        "polygon" => Ok(tag.get("points").map(|points| format!("M{points}Z"))),
        _ => Ok(None),
    }
}
