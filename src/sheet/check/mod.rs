//! What can be wrong with a triangle soup, each fault with its place.
//!
//! A sheet is one connected, oriented manifold: every edge has one or two triangles, the triangles
//! around a vertex form one fan, and every vertex has a triangle. Orientation is repaired (a closed
//! surface has its normals outwards), anything else is fatal: a guess about what was meant would
//! change the physics silently.

mod graph;
mod manifold;

use std::collections::HashMap;
use std::fmt;
use std::hash::Hash;
use std::path::Path;
use std::sync::Arc;

use rumple_numerics::Vec3;
use serde::Serialize;

use super::quality::{ZERO_QUALITY, triangle_quality};
use super::surface::{Attributes, Surface};
use crate::{Sheet, SheetError};
use graph::Edges;

/// Quality below which a triangle counts as a needle: an angle below two degrees.
const NEEDLE_QUALITY: f64 = 0.05;

/// Places that are kept of one kind of fault.
const MAX_PLACES: usize = 5;

/// The kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Fault {
    /// There are no points or no triangles.
    Empty,
    /// A coordinate is infinite or not a number.
    NonFinite,
    /// A triangle names a vertex that does not exist.
    IndexOutOfRange,
    /// A triangle names a vertex twice.
    RepeatedVertex,
    /// Two triangles have the same three vertices.
    DuplicateTriangle,
    /// Two vertices are at the same point.
    CoincidentVertices,
    /// A vertex belongs to no triangle.
    UnreferencedVertex,
    /// A triangle has no area.
    ZeroArea,
    /// A triangle is nearly without area.
    Needle,
    /// An edge belongs to more than two triangles.
    NonManifoldEdge,
    /// The triangles around a vertex form several fans that meet only there.
    NonManifoldVertex,
    /// Triangles faced against their neighbours and were turned.
    Orientation,
    /// A closed surface had its normals inwards and was turned over.
    FacesInwards,
    /// No orientation suits all triangles (a Möbius strip).
    NotOrientable,
    /// The mesh falls into pieces that share no vertex.
    SeveralComponents,
}

impl Fault {
    /// What to do about it in a program for meshes.
    #[must_use]
    pub fn advice(self) -> Option<&'static str> {
        Some(match self {
            Self::NonManifoldEdge => {
                "At most two triangles of a sheet share an edge: remove the triangles of inner walls and of parts that lie \
                 on one another, or cut the mesh along these edges"
            }
            Self::NonManifoldVertex => {
                "Parts of a sheet that touch in one vertex are not joined: give each part a vertex of its own, a little \
                 apart, or join them along an edge"
            }
            Self::NotOrientable => "A sheet has two sides: cut a one-sided surface along a line",
            Self::SeveralComponents => {
                "A sheet is one part: remove all but the largest, or merge vertices of parts that nearly touch"
            }
            Self::ZeroArea => "Give these triangles an area, or remove them and close the hole",
            Self::NonFinite => "Give these vertices finite coordinates",
            Self::IndexOutOfRange => {
                "Give these triangles vertices that exist: the file may be cut short"
            }
            Self::Empty => "The file holds no triangles",
            _ => return None,
        })
    }
}

/// One kind of fault with the places where it was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What is wrong.
    pub fault: Fault,
    /// Whether the mesh cannot be used.
    pub fatal: bool,
    /// How often it was found.
    pub count: usize,
    /// What is wrong, in words.
    pub message: String,
    /// The first few places: vertex and triangle numbers from 0, with the line of a text file.
    pub places: Vec<String>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        if !self.places.is_empty() {
            write!(f, ": {}", self.places.join("; "))?;
        }
        if self.count > self.places.len() && !self.places.is_empty() {
            write!(f, "; and {} more", self.count - self.places.len())?;
        }
        Ok(())
    }
}

/// Finds everything that is wrong with a soup, fatal faults first, and turns its triangles so that
/// neighbours agree (the majority of every piece keeps its side) and a closed surface has its normals
/// outwards.
///
/// Faults that hide others end the search: edges are not inspected while triangles name vertices
/// that do not exist.
#[must_use]
pub fn examine(surface: &Surface) -> (Vec<Finding>, Vec<[u32; 3]>) {
    let mut found = Findings { surface, list: Vec::new() };
    let mut triangles = surface.triangles.clone();
    if surface.points.is_empty() || triangles.is_empty() {
        found.report(Fault::Empty, "the mesh has no points or no triangles", 1, std::iter::empty());
        return (found.list, triangles);
    }
    found.points();
    if found.indices() {
        found.shapes();
        let edges = Edges::new(&triangles);
        if found.edges(&edges) {
            found.fans(&edges);
            let oriented = found.orient(&edges, &mut triangles);
            if found.pieces() && oriented {
                found.outwards(&edges, &mut triangles);
            }
        } else {
            found.pieces();
        }
    }
    found.list.sort_by_key(|f| !f.fatal);
    (found.list, triangles)
}

/// The bits of a point; adding zero turns -0 into +0, which is the same place.
pub(crate) fn place_of(p: &Vec3) -> [u64; 3] {
    [0, 1, 2].map(|k| (p[k] + 0.0).to_bits())
}

/// Pairs of the first with a key and a later one with the same.
fn repetitions<K: Eq + Hash>(keys: impl ExactSizeIterator<Item = K>) -> Vec<[usize; 2]> {
    let mut first = HashMap::with_capacity(keys.len());
    let known = keys.enumerate().map(|(k, key)| [*first.entry(key).or_insert(k), k]);
    known.filter(|[known, k]| known != k).collect()
}

struct Findings<'a> {
    surface: &'a Surface,
    list: Vec<Finding>,
}

impl Findings<'_> {
    fn vertex(&self, v: usize) -> String {
        match self.surface.point_lines.get(v) {
            Some(line) => format!("vertex {v} (line {line})"),
            None => format!("vertex {v}"),
        }
    }

    fn triangle(&self, t: usize) -> String {
        match self.surface.triangle_lines.get(t) {
            Some(line) => format!("triangle {t} (line {line})"),
            None => format!("triangle {t}"),
        }
    }

    /// Keeps a finding if there is anything in it.
    fn report(
        &mut self,
        fault: Fault,
        message: &str,
        count: usize,
        places: impl Iterator<Item = String>,
    ) {
        if count > 0 {
            let turned = matches!(fault, Fault::Orientation | Fault::FacesInwards);
            let fatal = !turned && fault != Fault::Needle;
            let places = places.take(MAX_PLACES).collect();
            self.list.push(Finding { fault, fatal, count, message: message.to_owned(), places });
        }
    }

    fn vertices(&mut self, fault: Fault, message: &str, at: &[usize]) {
        let places: Vec<_> = at.iter().take(MAX_PLACES).map(|&v| self.vertex(v)).collect();
        self.report(fault, message, at.len(), places.into_iter());
    }

    fn triangles(&mut self, fault: Fault, message: &str, at: &[usize]) {
        let places: Vec<_> = at.iter().take(MAX_PLACES).map(|&t| self.triangle(t)).collect();
        self.report(fault, message, at.len(), places.into_iter());
    }

    /// Non-finite numbers and vertices in the same place.
    fn points(&mut self) {
        let points = &self.surface.points;
        let wrong: Vec<_> =
            (0..points.len()).filter(|&v| !points[v].iter().all(|x| x.is_finite())).collect();
        self.vertices(Fault::NonFinite, "a coordinate is not a finite number", &wrong);
        let twice = repetitions(points.iter().map(place_of));
        let places =
            twice.iter().map(|&[a, b]| format!("{} and {}", self.vertex(a), self.vertex(b)));
        let places: Vec<_> = places.take(MAX_PLACES).collect();
        self.report(
            Fault::CoincidentVertices,
            "vertices lie at the same point (merge them, or the sheet is cut there)",
            twice.len(),
            places.into_iter(),
        );
    }

    /// Vertex numbers of the triangles; false if edges cannot be made of them.
    fn indices(&mut self) -> bool {
        let triangles = &self.surface.triangles;
        let n = self.surface.points.len();
        let all = || 0..triangles.len();
        let outside: Vec<_> =
            all().filter(|&t| triangles[t].iter().any(|&v| v as usize >= n)).collect();
        let message = format!("a triangle names a vertex beyond the last one, {}", n - 1);
        self.triangles(Fault::IndexOutOfRange, &message, &outside);
        let repeated: Vec<_> = all()
            .filter(|&t| {
                let [a, b, c] = triangles[t];
                a == b || b == c || c == a
            })
            .collect();
        self.triangles(Fault::RepeatedVertex, "a triangle names a vertex twice", &repeated);
        outside.is_empty() && repeated.is_empty()
    }

    /// Duplicates, areas and vertices without a triangle.
    fn shapes(&mut self) {
        let Surface { points, triangles, .. } = self.surface;
        let twice = repetitions(triangles.iter().map(|corners| {
            let mut key = *corners;
            key.sort_unstable();
            key
        }));
        let pair = |&[a, b]: &[usize; 2]| format!("{} and {}", self.triangle(a), self.triangle(b));
        let places: Vec<_> = twice.iter().take(MAX_PLACES).map(pair).collect();
        self.report(
            Fault::DuplicateTriangle,
            "triangles have the same three vertices",
            twice.len(),
            places.into_iter(),
        );
        let quality = |t: &[u32; 3]| triangle_quality(t.map(|v| points[v as usize]));
        let poor =
            triangles.iter().map(quality).enumerate().filter(|(_, q)| !(*q > NEEDLE_QUALITY));
        // Not q <= …, so that corners that are not numbers count as well.
        let (mut needles, flat): (Vec<_>, Vec<_>) = poor.partition(|(_, q)| *q > ZERO_QUALITY);
        let flat: Vec<_> = flat.into_iter().map(|(t, _)| t).collect();
        self.triangles(Fault::ZeroArea, "a triangle has no area", &flat);
        needles.sort_by(|a, b| a.1.total_cmp(&b.1));
        let places: Vec<_> = needles
            .iter()
            .take(MAX_PLACES)
            .map(|(t, q)| format!("{}, quality {q:.1e}", self.triangle(*t)))
            .collect();
        self.report(
            Fault::Needle,
            "a triangle is a needle or nearly flat: forces and curvatures are poor there, and \
             relaxations slow",
            needles.len(),
            places.into_iter(),
        );
        let mut used = vec![false; points.len()];
        for &v in triangles.iter().flatten() {
            used[v as usize] = true;
        }
        let loose: Vec<_> = (0..points.len()).filter(|&v| !used[v]).collect();
        self.vertices(
            Fault::UnreferencedVertex,
            "a vertex belongs to no triangle, so no force acts on it",
            &loose,
        );
    }
}

impl Surface {
    /// Checks the soup and makes it a sheet, vertices and triangles in the same order.
    ///
    /// Triangles that face against their neighbours are turned, and so are all of a closed surface with
    /// its normals inwards; the findings say which. Only findings that are not fatal are returned.
    ///
    /// # Errors
    /// The first fatal finding of [`examine`], with the file's name where there is one.
    pub fn into_sheet(mut self) -> Result<(Sheet, Vec<Finding>), SheetError> {
        let (findings, triangles) = examine(&self);
        let path = self.path.take();
        if let Some(fatal) = findings.iter().find(|f| f.fatal) {
            return Err(refusal(path.as_deref(), fatal.to_string()));
        }
        let attributes = Attributes::take_from(&mut self, &triangles);
        let sheet = Sheet::new(self.points, triangles)
            .map_err(|e| refusal(path.as_deref(), e.to_string()))?;
        Ok((sheet.with_attributes(attributes.map(Arc::new)), findings))
    }
}

/// An error that names the file if there is one.
fn refusal(path: Option<&Path>, message: String) -> SheetError {
    match path {
        Some(path) => SheetError::File { path: path.to_owned(), message },
        None => SheetError::Unusable(message),
    }
}
