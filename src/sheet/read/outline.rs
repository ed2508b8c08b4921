//! Outlines of flat sheets from files: rows of coordinates, or the paths of an SVG drawing.
//!
//! Curves become sides no further from them than [`FLATNESS`] of the width. The ring with the largest area is the outline, the
//! others are holes.

use std::fs;
use std::path::Path;

use kurbo::{BezPath, PathEl, Shape};

use super::xml::{Scanner, Token};
use crate::SheetError;

/// Distance of sides from the curve that they stand for, in widths of the drawing.
const FLATNESS: f64 = 1e-4;

/// A closed ring of points.
pub type Ring = Vec<[f64; 2]>;

/// The outline and its holes in the file at `path`: `.svg`, or text with two coordinates a line and empty lines between
/// rings. Of a drawing y points up; with `width` it is scaled to this extent along x and centred.
///
/// # Errors
/// A file that cannot be read, with the line, and one without a ring of three points.
pub fn outline(path: &Path, width: Option<f64>) -> Result<(Ring, Vec<Ring>), SheetError> {
    let refuse = |message: String| SheetError::File { path: path.to_owned(), message };
    let bytes = fs::read(path).map_err(|e| refuse(e.to_string()))?;
    let drawing = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    let rings = if drawing { drawn(&bytes) } else { listed(&bytes) };
    let mut rings = rings.map_err(refuse)?;
    rings.retain(|ring| ring.len() > 2);
    if let Some(width) = width {
        scale(&mut rings, width);
    }
    let largest = (0..rings.len()).max_by(|a, b| area(&rings[*a]).total_cmp(&area(&rings[*b])));
    let Some(largest) = largest else {
        return Err(refuse("no closed ring of three points or more".into()));
    };
    let outline = rings.remove(largest);
    Ok((outline, rings))
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
fn listed(bytes: &[u8]) -> Result<Vec<Ring>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text".to_owned())?;
    let text = text.trim_start_matches('\u{feff}');
    let mut rings = vec![Ring::new()];
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let words: Vec<&str> =
            line.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty()).collect();
        if words.is_empty() {
            rings.push(Ring::new());
            continue;
        }
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        match (numbers.as_deref(), rings.last_mut()) {
            (Some([x, y]), Some(ring)) if x.is_finite() && y.is_finite() => ring.push([*x, *y]),
            (None, _) if number == 0 && words.iter().all(|word| word.parse::<f64>().is_err()) => {}
            _ => return Err(format!("line {}: expected two numbers, found `{line}`", number + 1)),
        }
    }
    rings.iter_mut().for_each(close);
    Ok(rings)
}

/// Drops a last point that repeats the first.
fn close(ring: &mut Ring) {
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
}

/// Rings of the paths and polygons of a drawing.
fn drawn(bytes: &[u8]) -> Result<Vec<Ring>, String> {
    let (mut scanner, mut all) = (Scanner::new(bytes), BezPath::new());
    while let Some(token) = scanner.token()? {
        let Token::Start(tag) = token else { continue };
        let line = tag.line;
        if ["defs", "clipPath", "mask", "symbol", "pattern", "marker"].contains(&tag.name) {
            return Err(format!(
                "line {line}: <{}>; leave only the paths of the outline",
                tag.name
            ));
        }
        let styled = tag.get("style").is_some_and(|style| style.contains("transform"));
        if styled || tag.get("transform").is_some() {
            return Err(format!("line {line}: a transform; apply it in the drawing program"));
        }
        let text = match tag.name {
            "path" => tag.get("d").map(str::to_owned),
            "polygon" => tag.get("points").map(|points| format!("M{points}Z")),
            "rect" | "circle" | "ellipse" => {
                let name = tag.name;
                return Err(format!("line {line}: <{name}>; make it a path"));
            }
            _ => None,
        };
        let Some(text) = text else { continue };
        let path = BezPath::from_svg(&text).map_err(|e| format!("line {line}: path: {e}"))?;
        all.extend(path);
    }
    let mut rings: Vec<Ring> = Vec::new();
    let tolerance = FLATNESS * all.bounding_box().width();
    kurbo::flatten(&all, tolerance, |element| match element {
        PathEl::MoveTo(p) => rings.push(vec![[p.x, -p.y]]),
        PathEl::LineTo(p) => rings.last_mut().into_iter().for_each(|ring| ring.push([p.x, -p.y])),
        _ => {}
    });
    for ring in &mut rings {
        ring.dedup();
        close(ring);
    }
    match rings.iter().flatten().flatten().all(|number| number.is_finite()) {
        true => Ok(rings),
        false => Err("a coordinate that is not finite".into()),
    }
}
