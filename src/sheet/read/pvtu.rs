//! VTK's index of surfaces in pieces (`.pvtu`), as runs over ranks write their frames.
//!
//! ```text
//! <Piece Source="frame_000001.vtu"/>      relative to the index
//! ```
//!
//! Pieces with the point array `vertex number` and the cell array `triangle number`, from 0 in the whole, are put together by
//! these: points that several pieces have become one. Other pieces stand side by side.

use std::path::{Path, PathBuf};

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, whole};

use super::xml::{Scanner, Token};
use crate::{Array, Surface};

/// The name of the array with the numbers of the vertices.
pub const VERTEX_NUMBER: &str = "vertex number";
/// The name of the array with the numbers of the triangles.
pub const TRIANGLE_NUMBER: &str = "triangle number";

/// The surface of all pieces that the index at `path` names.
pub(super) fn parse(
    path: &Path,
    bytes: &[u8],
    read: impl Fn(&Path) -> Result<Surface, String>,
) -> Result<Surface, String> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let pieces: Vec<Surface> = sources(bytes)?
        .iter()
        .map(|source| read(&folder.join(source)).map_err(|e| format!("its piece {e}")))
        .collect::<Result<_, _>>()?;
    if pieces.is_empty() {
        return Err("it names no piece: <Piece Source=\"…\"/>".into());
    }
    merged(pieces)
}

/// The files that it names.
fn sources(bytes: &[u8]) -> Result<Vec<PathBuf>, String> {
    let (mut scanner, mut all) = (Scanner::new(bytes), Vec::new());
    while let Some(token) = scanner.token()? {
        if let Token::Start(tag) = token
            && tag.name == "Piece"
        {
            let missing = || format!("line {}: a piece without Source", tag.line);
            all.push(tag.get("Source").ok_or_else(missing)?.into());
        }
    }
    Ok(all)
}

/// The numbers in the whole of `count` points or cells, where the piece gives them.
fn numbers(arrays: &[Array], name: &str, count: usize) -> Option<Vec<usize>> {
    let array = arrays.iter().find(|a| a.name == name && a.components == 1)?;
    let sound = |v: &f64| *v >= 0.0 && *v < 4e9 && v.fract() == 0.0;
    let fits = array.values.len() == count && array.values.iter().all(sound);
    fits.then(|| array.values.iter().map(|v| whole(*v)).collect())
}

/// All pieces as one surface.
fn merged(pieces: Vec<Surface>) -> Result<Surface, String> {
    let numbered: Option<Vec<_>> = pieces
        .iter()
        .map(|piece| {
            let vertices = numbers(&piece.point_arrays, VERTEX_NUMBER, piece.points.len())?;
            let triangles = numbers(&piece.cell_arrays, TRIANGLE_NUMBER, piece.triangles.len())?;
            Some((vertices, triangles))
        })
        .collect();
    let places = numbered.unwrap_or_else(|| {
        let (mut points, mut cells) = (0, 0);
        let row = |next: &mut usize, count: usize| {
            *next += count;
            (*next - count..*next).collect::<Vec<usize>>()
        };
        let each = pieces.iter();
        each.map(|p| (row(&mut points, p.points.len()), row(&mut cells, p.triangles.len())))
            .collect()
    });
    let (vertices, triangles): (Vec<_>, Vec<_>) = places.into_iter().unzip();
    let count = |all: &[Vec<usize>]| all.iter().flatten().max().map_or(0, |last| last + 1);
    let (points, cells) = (count(&vertices), count(&triangles));
    let held: usize = pieces.iter().map(|piece| piece.points.len() + piece.triangles.len()).sum();
    if points + cells > held {
        return Err("its pieces do not hold all numbers of vertices and triangles".into());
    }
    let mut whole = Surface { points: vec![Vec3::repeat(f64::NAN); points], ..Surface::default() };
    whole.triangles = vec![[u32::MAX; 3]; cells];
    for (piece, (vertices, triangles)) in pieces.iter().zip(vertices.iter().zip(&triangles)) {
        for (point, &v) in piece.points.iter().zip(vertices) {
            whole.points[v] = *point;
        }
        for (corners, &t) in piece.triangles.iter().zip(triangles) {
            let place = |v: u32| vertices.get(v as usize).map_or(u32::MAX, |v| index(*v));
            whole.triangles[t] = corners.map(place);
        }
    }
    if whole.points.iter().any(|x| x.x.is_nan())
        || whole.triangles.iter().flatten().any(|v| *v == u32::MAX)
    {
        return Err("its pieces do not hold all vertices and triangles that they number".into());
    }
    whole.point_arrays = arrays(points, &pieces, |piece| &piece.point_arrays, &vertices);
    whole.cell_arrays = arrays(cells, &pieces, |piece| &piece.cell_arrays, &triangles);
    (whole.time, whole.notes) = (pieces[0].time, pieces[0].notes.clone());
    Ok(whole)
}

/// The arrays that all pieces have, but for the numbers, with rows at `places`.
fn arrays(
    count: usize,
    pieces: &[Surface],
    of: impl Fn(&Surface) -> &Vec<Array>,
    places: &[Vec<usize>],
) -> Vec<Array> {
    let own = |array: &&Array| ![VERTEX_NUMBER, TRIANGLE_NUMBER].contains(&array.name.as_str());
    let merged = of(&pieces[0]).iter().filter(own).filter_map(|array| {
        let width = array.components;
        let mut values = vec![0.0; width * count];
        for (piece, places) in pieces.iter().zip(places) {
            let same = |a: &&Array| a.name == array.name && a.components == width;
            let found = of(piece).iter().find(same)?;
            for (row, &place) in found.values.chunks_exact(width).zip(places) {
                values[place * width..(place + 1) * width].copy_from_slice(row);
            }
        }
        Some(Array { name: array.name.clone(), components: width, values })
    });
    merged.collect()
}
