//! STL, text or binary: triangles by their corners, which become vertices where they are at the same point.
//!
//! ```text
//! binary   80 bytes, number of triangles (u32), then of each: normal, three corners (12 f32), 2 bytes
//! text     solid … / facet normal … / outer loop / vertex x y z (3 times) / endloop / endfacet / … endsolid
//! ```
//!
//! Corners are the same point if their numbers are equal; those that a program has rounded differently are to be merged by
//! another one. Normals are left aside: the order of the corners gives them.

use std::collections::HashMap;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

use super::stream::{Coding, Scalar, Stream};
use crate::Surface;
use crate::check::place_of;

/// Bytes before the number of triangles, and of one triangle.
const HEADER_BYTES: usize = 80;
const TRIANGLE_BYTES: usize = 50;

/// Triangles with their corners numbered as they are met.
#[derive(Default)]
struct Soup {
    surface: Surface,
    known: HashMap<[u64; 3], u32>,
}

impl Soup {
    fn vertex(&mut self, point: Vec3) -> u32 {
        let Self { surface, known } = self;
        *known.entry(place_of(&point)).or_insert_with(|| {
            surface.points.push(point);
            index(surface.points.len() - 1)
        })
    }
}

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let count = bytes
        .get(HEADER_BYTES..)
        .and_then(|rest| rest.first_chunk())
        .map(|n| u32::from_le_bytes(*n));
    let size = |count: u32| {
        (count as usize).saturating_mul(TRIANGLE_BYTES).saturating_add(HEADER_BYTES + 4)
    };
    // Binary files may begin with "solid" as those of text do: their size says what they are.
    let fits = count.is_some_and(|count| size(count) == bytes.len());
    let solid =
        bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Text has no zero bytes, and the head of a binary file has: it may have other data behind its triangles.
    let zeros = bytes.iter().take(HEADER_BYTES + 4 + TRIANGLE_BYTES).any(|byte| *byte == 0);
    let holds = zeros && count.is_some_and(|count| count > 0 && size(count) <= bytes.len());
    if !fits && !holds && solid {
        return text(bytes);
    }
    match count {
        Some(count) if size(count) > bytes.len() => Err(format!(
            "byte {HEADER_BYTES}: {count} triangles need {} bytes, and the file has {}: it is cut short, or it is not an STL \
             file (text begins with \"solid\")",
            size(count),
            bytes.len()
        )),
        Some(count) => binary(bytes, count),
        None => Err(format!(
            "has {} bytes, and neither begins with \"solid\" nor has the {} of a binary head: this is not an STL file",
            bytes.len(),
            HEADER_BYTES + 4
        )),
    }
}

fn binary(bytes: &[u8], count: u32) -> Result<Surface, String> {
    let mut stream = Stream::new(bytes);
    stream.coding = Coding::Little;
    stream.take::<{ HEADER_BYTES + 4 }>("the head")?;
    let mut soup = Soup::default();
    for k in 0..count {
        let what = format!("triangle {k}");
        stream.take::<12>(&what)?;
        let mut corners = [0; 3];
        for corner in &mut corners {
            let mut point = Vec3::zeros();
            for x in point.iter_mut() {
                *x = stream.real(Scalar::F32, &what)?;
            }
            *corner = soup.vertex(point);
        }
        stream.take::<2>(&what)?;
        soup.surface.triangles.push(corners);
    }
    Ok(soup.surface)
}

fn text(bytes: &[u8]) -> Result<Surface, String> {
    let mut stream = Stream::new(bytes);
    let mut soup = Soup::default();
    let mut corners = Vec::new();
    let mut open = false;
    while let Some(line) = stream.line() {
        let text = std::str::from_utf8(line).map_err(|_| {
            stream.fault("is not text, and the size of the file is not that of a binary one")
        })?;
        let mut words = text.split_ascii_whitespace();
        let first = words.next().unwrap_or_default().to_ascii_lowercase();
        match first.as_str() {
            "" | "outer" | "endloop" => {}
            "solid" => open = true,
            "endsolid" => open = false,
            "facet" => corners.clear(),
            "vertex" => {
                let mut point = Vec3::zeros();
                for (x, axis) in point.iter_mut().zip(["x", "y", "z"]) {
                    let word = words.next().unwrap_or_default();
                    *x = word.parse().map_err(|_| {
                        let word: String = word.chars().take(20).collect();
                        stream.fault(format!(
                            "expected a number as {axis} of a vertex, found \"{word}\""
                        ))
                    })?;
                }
                corners.push(soup.vertex(point));
                if soup.surface.point_lines.len() < soup.surface.points.len() {
                    soup.surface.point_lines.push(index(stream.number()));
                }
            }
            "endfacet" => {
                let [a, b, c] = corners[..] else {
                    let n = corners.len();
                    return Err(stream.fault(format!("a facet of {n} vertices; 3 are expected")));
                };
                soup.surface.triangles.push([a, b, c]);
                soup.surface.triangle_lines.push(index(stream.number()));
            }
            _ => {
                let word: String = first.chars().take(20).collect();
                return Err(stream.fault(format!(
                    "\"{word}\" instead of solid, facet, outer, vertex, endloop, endfacet or endsolid"
                )));
            }
        }
    }
    if open {
        return Err(stream.fault("the file ends without \"endsolid\": it is cut short"));
    }
    Ok(soup.surface)
}
