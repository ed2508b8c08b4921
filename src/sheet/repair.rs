//! Repair of a triangle soup, step by step, as far as nothing has to be guessed.
//!
//! ```text
//! vertices at the same point, or nearer than a distance     merged
//! triangles with a vertex twice, and duplicates             removed
//! triangles without area                                    their longest edge is flipped; removed at a boundary
//! parts smaller than a share of the area                    removed
//! triangles against their neighbours, closed surfaces inside out    reversed
//! vertices without a triangle                               removed
//! ```
//!
//! What is left is refused with its places: edges of more than two triangles, bow ties, one-sided surfaces, several large
//! parts, and numbers that are none. Vertices and triangles are named by their numbers in the file.

use std::collections::HashMap;

use serde::Serialize;

use super::check::{self, DisjointSets, Fault, Finding, MAX_PLACES};
use super::quality::{ZERO_QUALITY, triangle_quality};
use super::surface::Surface;
use super::{Sheet, SheetError};
use rumple_numerics::Vec3;
use rumple_numerics::num::{Short, index};

/// Passes over triangles without area: a flip may leave another one.
const MAX_PASSES: usize = 8;

/// How much a repair may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepairOptions {
    /// Vertices nearer than this are merged, in units of length; 0 for those at the same point only.
    pub merge_distance: f64,
    /// Parts of less than this share of the area are removed.
    pub small: f64,
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self { merge_distance: 0.0, small: 0.01 }
    }
}

/// One step of a repair that changed something.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// What was done, in words, with the count.
    pub done: String,
    /// The first few places.
    pub places: Vec<String>,
}

/// The result of a repair.
#[derive(Debug)]
pub struct Repaired {
    /// Steps in their order; none where nothing was wrong.
    pub steps: Vec<Step>,
    /// What is not fatal in the repaired mesh, and what was reversed.
    pub notes: Vec<Finding>,
    /// The sheet, or what cannot be repaired.
    pub result: Result<Sheet, Vec<Finding>>,
}

/// Repairs a soup.
///
/// # Errors
/// [`SheetError::Unusable`] if the options are out of range.
pub fn repair(surface: Surface, options: RepairOptions) -> Result<Repaired, SheetError> {
    if !(options.merge_distance >= 0.0 && options.merge_distance.is_finite()) {
        let message =
            format!("merge distance {}; a number from 0 is expected", options.merge_distance);
        return Err(SheetError::Unusable(message));
    }
    if !(0.0..=1.0).contains(&options.small) {
        let message =
            format!("share {} of the area; a number from 0 to 1 is expected", options.small);
        return Err(SheetError::Unusable(message));
    }
    let (findings, _) = check::examine(&surface);
    let hopeless =
        |f: &Finding| matches!(f.fault, Fault::Empty | Fault::NonFinite | Fault::IndexOutOfRange);
    if findings.iter().any(hopeless) {
        let left = findings.into_iter().filter(hopeless).collect();
        return Ok(Repaired { steps: Vec::new(), notes: Vec::new(), result: Err(left) });
    }
    let original = (0..index(surface.triangles.len())).collect();
    let mut bench = Bench { surface, original, steps: Vec::new() };
    bench.merge(options.merge_distance);
    bench.remove_collapsed();
    bench.remove_duplicates();
    bench.flip_flat();
    bench.remove_small(options.small);
    Ok(bench.finish())
}

/// The mesh under repair.
struct Bench {
    surface: Surface,
    /// Numbers of the triangles in the file.
    original: Vec<u32>,
    steps: Vec<Step>,
}

impl Bench {
    fn vertex(&self, v: u32) -> String {
        match self.surface.point_lines.get(v as usize) {
            Some(line) => format!("vertex {v} (line {line})"),
            None => format!("vertex {v}"),
        }
    }

    fn triangle(&self, t: usize) -> String {
        match self.surface.triangle_lines.get(t) {
            Some(line) => format!("triangle {} (line {line})", self.original[t]),
            None => format!("triangle {}", self.original[t]),
        }
    }

    fn record(&mut self, done: String, places: Vec<String>) {
        self.steps.push(Step { done, places });
    }

    /// Keeps some triangles; returns names of the first ones that go, and how many do.
    fn retain(&mut self, keep: &[bool]) -> (Vec<String>, usize) {
        let gone: Vec<usize> = (0..keep.len()).filter(|&t| !keep[t]).collect();
        let places = gone.iter().take(MAX_PLACES).map(|&t| self.triangle(t)).collect();
        let mut kept = keep.iter();
        self.surface.triangles.retain(|_| kept.next() == Some(&true));
        let mut kept = keep.iter();
        self.original.retain(|_| kept.next() == Some(&true));
        let mut kept = keep.iter();
        self.surface.triangle_lines.retain(|_| kept.next() == Some(&true));
        (places, gone.len())
    }

    /// Merges vertices at the same point, or nearer than `distance`.
    fn merge(&mut self, distance: f64) {
        let points = &self.surface.points;
        let mut used = vec![false; points.len()];
        for &v in self.surface.triangles.iter().flatten() {
            used[v as usize] = true;
        }
        let mut same = DisjointSets::new(points.len());
        let mut pairs = Vec::new();
        if distance > 0.0 {
            near(points, distance, |a, b| pairs.push((a, b)));
        } else {
            let mut first: HashMap<[u64; 3], usize> = HashMap::with_capacity(points.len());
            for (v, p) in points.iter().enumerate() {
                let known = *first.entry(check::place_of(p)).or_insert(v);
                if known != v {
                    pairs.push((known, v));
                }
            }
        }
        pairs.retain(|&(a, b)| used[a] && used[b]);
        let mut merged = Vec::new();
        for (a, b) in pairs {
            if same.root(a) != same.root(b) {
                same.join(a, b);
                merged.push((index(a), index(b)));
            }
        }
        if merged.is_empty() {
            return;
        }
        let place = |&(a, b): &(u32, u32)| format!("{} and {}", self.vertex(a), self.vertex(b));
        let places = merged.iter().take(MAX_PLACES).map(place).collect();
        let how = match distance > 0.0 {
            true => format!("nearer than {}", Short(distance)),
            false => "at the same point".to_owned(),
        };
        self.record(format!("merged {} vertices {how}", merged.len()), places);
        for v in self.surface.triangles.as_flattened_mut() {
            *v = index(same.root(*v as usize));
        }
    }

    /// Removes triangles with a vertex twice.
    fn remove_collapsed(&mut self) {
        let distinct = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        let keep: Vec<bool> = self.surface.triangles.iter().map(distinct).collect();
        let (places, count) = self.retain(&keep);
        if count > 0 {
            self.record(format!("removed {count} triangles with a vertex twice"), places);
        }
    }

    /// Removes triangles of the same three vertices as an earlier one.
    fn remove_duplicates(&mut self) {
        let mut known = HashMap::with_capacity(self.surface.triangles.len());
        let first = |(t, tri): (usize, &[u32; 3])| {
            let mut key = *tri;
            key.sort_unstable();
            *known.entry(key).or_insert(t) == t
        };
        let keep: Vec<bool> = self.surface.triangles.iter().enumerate().map(first).collect();
        let (places, count) = self.retain(&keep);
        if count > 0 {
            self.record(
                format!("removed {count} triangles with the vertices of another one"),
                places,
            );
        }
    }

    fn is_flat(&self, [a, b, c]: [u32; 3]) -> bool {
        let corners = [a, b, c].map(|v| self.surface.points[v as usize]);
        // Not q <= …, so that three corners in one point count as well.
        !(triangle_quality(corners) > ZERO_QUALITY)
    }

    /// Flips the longest edge of triangles without area.
    fn flip_flat(&mut self) {
        let (mut places, mut flipped, mut removed) = (Vec::new(), 0, 0);
        for _ in 0..MAX_PASSES {
            let triangles = &self.surface.triangles;
            let flat: Vec<usize> =
                (0..triangles.len()).filter(|&t| self.is_flat(triangles[t])).collect();
            if flat.is_empty() {
                break;
            }
            let across = triangles_by_edge(triangles);
            let mut keep = vec![true; triangles.len()];
            let mut touched = vec![false; triangles.len()];
            for t in flat {
                if touched[t] {
                    continue;
                }
                let [a, b, c] = self.longest_first(self.surface.triangles[t]);
                let sharing = across.get(&(a.min(b), a.max(b))).map_or(&[][..], |list| list);
                let others: Vec<usize> = sharing.iter().copied().filter(|&s| s != t).collect();
                if others.iter().any(|&s| touched[s]) {
                    continue;
                }
                match others[..] {
                    [] => {
                        keep[t] = false;
                        removed += 1;
                    }
                    [s] => {
                        let other = self.surface.triangles[s];
                        let d = other.into_iter().find(|v| *v != a && *v != b).unwrap_or(c);
                        let agree = (0..3).any(|k| other[k] == b && other[(k + 1) % 3] == a);
                        if d == c || !agree {
                            continue;
                        }
                        self.surface.triangles[t] = [a, d, c];
                        self.surface.triangles[s] = [d, b, c];
                        touched[s] = true;
                        flipped += 1;
                    }
                    _ => continue,
                }
                touched[t] = true;
                if places.len() < MAX_PLACES {
                    places.push(self.triangle(t));
                }
            }
            self.retain(&keep);
        }
        if flipped + removed > 0 {
            let done = format!(
                "removed {removed} and flipped the longest edge of {flipped} triangles without area"
            );
            self.record(done, places);
        }
    }

    /// The corners in their order, turned so that the longest side is the first one.
    fn longest_first(&self, t: [u32; 3]) -> [u32; 3] {
        let x = |v: u32| self.surface.points[v as usize];
        let turned = [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
        let length = |t: &[u32; 3]| (x(t[1]) - x(t[0])).norm();
        turned.into_iter().max_by(|s, t| length(s).total_cmp(&length(t))).unwrap_or(t)
    }

    /// Removes parts of less than the share `small` of the area.
    fn remove_small(&mut self, small: f64) {
        let Surface { points, triangles, .. } = &self.surface;
        let mut part = DisjointSets::new(points.len());
        for &[a, b, c] in triangles {
            part.join(a as usize, b as usize);
            part.join(b as usize, c as usize);
        }
        let mut area: HashMap<usize, f64> = HashMap::new();
        let roots: Vec<usize> = triangles.iter().map(|t| part.root(t[0] as usize)).collect();
        for (t, root) in triangles.iter().zip(&roots) {
            let [a, b, c] = t.map(|v| points[v as usize]);
            *area.entry(*root).or_default() += 0.5 * (b - a).cross(&(c - a)).norm();
        }
        let all: f64 = area.values().sum();
        let largest = area.values().copied().fold(0.0, f64::max);
        let kept = |root: &usize| area[root] >= small * all || area[root] >= largest;
        let parts = area.keys().filter(|root| !kept(root)).count();
        if parts == 0 {
            return;
        }
        let share = area.iter().filter(|(root, _)| !kept(root)).map(|(_, a)| a).sum::<f64>() / all;
        let keep: Vec<bool> = roots.iter().map(kept).collect();
        let (places, count) = self.retain(&keep);
        self.record(
            format!(
                "removed {parts} parts of less than {small} of the area: {count} triangles, {share:.2e} of the area in all"
            ),
            places,
        );
    }

    /// Orients the triangles, leaves vertices without any out, and checks the result.
    fn finish(mut self) -> Repaired {
        let (findings, oriented) = check::examine_numbered(&self.surface, &self.original);
        // Vertices that were merged or belong to no triangle are not part of the result, which is checked again.
        let gone = [Fault::UnreferencedVertex, Fault::CoincidentVertices];
        let (fatal, notes): (Vec<_>, Vec<_>) =
            findings.into_iter().filter(|f| !gone.contains(&f.fault)).partition(|f| f.fatal);
        if !fatal.is_empty() {
            return Repaired { steps: self.steps, notes, result: Err(fatal) };
        }
        let mut used = vec![false; self.surface.points.len()];
        for &v in oriented.iter().flatten() {
            used[v as usize] = true;
        }
        let loose: Vec<u32> = (0..index(used.len())).filter(|&v| !used[v as usize]).collect();
        if !loose.is_empty() {
            let places = loose.iter().take(MAX_PLACES).map(|&v| self.vertex(v)).collect();
            self.record(format!("left out {} vertices without a triangle", loose.len()), places);
        }
        let mut new = vec![0; used.len()];
        let mut points: Vec<Vec3> = Vec::with_capacity(used.len() - loose.len());
        for (v, point) in self.surface.points.iter().enumerate().filter(|(v, _)| used[*v]) {
            new[v] = index(points.len());
            points.push(*point);
        }
        let triangles = oriented.iter().map(|t| t.map(|v| new[v as usize])).collect();
        let compact = Surface { points, triangles, ..Surface::default() };
        let result = match compact.into_sheet() {
            Ok((sheet, _)) => Ok(sheet),
            Err(error) => Err(vec![Finding {
                fault: Fault::Empty,
                fatal: true,
                count: 1,
                message: error.to_string(),
                places: Vec::new(),
            }]),
        };
        Repaired { steps: self.steps, notes, result }
    }
}

/// Calls `found` for every pair of points nearer than `distance`, the smaller number first.
fn near(points: &[Vec3], distance: f64, mut found: impl FnMut(usize, usize)) {
    let cell = |p: &Vec3| [0, 1, 2].map(|k| (p[k] / distance).floor());
    let key = |c: [f64; 3]| c.map(|x| (x + 0.0).to_bits());
    let mut cells: HashMap<[u64; 3], Vec<usize>> = HashMap::with_capacity(points.len());
    for (v, p) in points.iter().enumerate() {
        let [i, j, k] = cell(p);
        for n in 0..27u8 {
            let shift = |m: u8| f64::from(n / m % 3) - 1.0;
            let there = key([i + shift(1), j + shift(3), k + shift(9)]);
            for &w in cells.get(&there).map_or(&[][..], |list| list) {
                if (points[w] - p).norm() < distance {
                    found(w, v);
                }
            }
        }
        cells.entry(key([i, j, k])).or_default().push(v);
    }
}

/// The triangles at every edge.
fn triangles_by_edge(triangles: &[[u32; 3]]) -> HashMap<(u32, u32), Vec<usize>> {
    let mut at: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            at.entry((a.min(b), a.max(b))).or_default().push(t);
        }
    }
    at
}
