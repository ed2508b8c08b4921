//! Periodic sheets: a flat rectangle whose opposite edges are one.
//!
//! ```text
//! vertices     those of one cell | images X + k₁ P₁ + k₂ P₂ of them, two rings around the cell
//! triangles    each once, with its lowest vertex in the cell | images that touch a vertex of the cell or a neighbour of one
//! ```
//!
//! An image moves as its owner does, so that it stays P away from it whatever the shape is. Every vertex of the cell has its
//! whole neighbourhood, and elements across an edge of the cell are ordinary ones: to effects the sheet is a part of a larger
//! one, as over ranks (`partition.rs`), and the other parts are the part itself.

use std::collections::BTreeSet;
use std::sync::Arc;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::reduction::{
    CommunicationCounts, Distribution, HaloMap, OneProcess, Reduction,
};

use super::topology::Share;
use super::{Array, Sheet, SheetError, Surface};

/// A vertex of the cell and its translation, in periods along x and y.
type Image = (u32, [i8; 2]);

/// Images of elements that may touch the cell or its neighbours are at most one period away.
const TRANSLATIONS: [i8; 3] = [-1, 0, 1];

/// The sheet of which `cell` is one period: a triangulated torus or ring whose vertices rest in a rectangle around the origin
/// that repeats itself after `periods` along x and y (infinite where it does not).
///
/// # Errors
/// Triangles that are no manifold.
pub(crate) fn with_images(cell: &Sheet, periods: [f64; 2]) -> Result<Sheet, SheetError> {
    let cover = Cover::new(cell, periods);
    let owned = cell.vertex_count();
    let ghosts: Vec<Image> = cover
        .vertices(&cover.triangles)
        .filter(is_image)
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let number = |&(v, shift): &Image| match ghosts.binary_search(&(v, shift)) {
        Ok(ghost) => index(owned + ghost),
        Err(_) => v,
    };
    let corners = cover.triangles.iter().map(|(_, corners)| corners.map(|corner| number(&corner)));
    let rest = cell.rest().iter().copied().chain(ghosts.iter().map(|image| cover.position(*image)));
    let made = Sheet::new(rest.collect(), corners.collect())?;
    let numbers: Vec<u32> = (0..index(owned)).chain(ghosts.iter().map(|(v, _)| *v)).collect();
    let triangle_numbers: Vec<u32> = cover.triangles.iter().map(|(t, _)| *t).collect();
    let finite = (0..2).filter(|axis| periods[*axis].is_finite());
    let distribution = Distribution {
        vertices: copies(&numbers, owned),
        faces: copies(&triangle_numbers, cell.triangle_count()),
        communicator: Arc::new(OneProcess),
        periods: finite.map(|axis| Vec3::ith(axis, periods[axis])).collect(),
        traffic: CommunicationCounts::default(),
    };
    let boundary = numbers.iter().map(|v| cell.boundary()[*v as usize]).collect();
    let places = numbers.iter().map(|v| cell.rest()[*v as usize]).collect();
    let share = Share {
        owned,
        before: 0,
        periodic: true,
        euler: cell.euler_characteristic(),
        numbers: Arc::new(numbers),
        triangle_numbers: Arc::new(triangle_numbers),
        whole: [owned, cell.triangle_count()],
    };
    Ok(made
        .part(boundary, share)
        .placed(places)
        .reduced_by(Reduction::over(Arc::new(distribution))))
}

impl Sheet {
    /// Completes `surface`, a frame of a periodic sheet or points without triangles, whose first points are those of the cell, by
    /// its images; leaves that of another sheet unchanged.
    ///
    /// # Errors
    /// A surface with as many vertices and triangles, of another mesh.
    pub fn add_images(&self, surface: &mut Surface) -> Result<(), String> {
        let [vertices, triangles] = self.counts_of_whole();
        if self.reduction().periods().is_empty()
            || surface.points.len() < vertices
            || ![0, triangles].contains(&surface.triangles.len())
        {
            return Ok(());
        }
        // Images have numbers of their own in a frame.
        let inside = |v: u32| (v as usize) < vertices;
        let differs = |(own, other): (&[u32; 3], &[u32; 3])| {
            own.iter().zip(other).any(|(v, w)| if inside(*v) { v != w } else { inside(*w) })
        };
        let mut pairs = self.triangles()[..triangles].iter().zip(&surface.triangles);
        if let Some(t) = pairs.position(differs) {
            return Err(format!(
                "triangle {t} has other vertices in the scene's sheet: it is a state of another mesh"
            ));
        }
        let (rest, places) = (self.rest(), self.places());
        let owner = |i: usize| self.number(i) as usize;
        let x = (0..rest.len()).map(|i| surface.points[owner(i)] + (rest[i] - places[i]));
        surface.points = x.collect();
        surface.triangles = self.triangles().to_vec();
        let rows = |array: &mut Array, numbers: &dyn Fn(usize) -> usize, count: usize| {
            let row = |i: usize| &array.values[numbers(i) * array.components..][..array.components];
            array.values = (0..count).flat_map(row).copied().collect();
        };
        for array in &mut surface.point_arrays {
            rows(array, &owner, rest.len());
        }
        let of_triangles = |array: &&mut Array| array.values.len() >= array.components * triangles;
        for array in surface.cell_arrays.iter_mut().filter(of_triangles) {
            rows(array, &|t| self.triangle_number(t) as usize, self.triangle_count());
        }
        Ok(())
    }
}

fn is_image((_, shift): &Image) -> bool {
    *shift != [0, 0]
}

/// Who copies what, where point i has what `numbers[i]` of the first `owned` has.
fn copies(numbers: &[u32], owned: usize) -> HaloMap {
    let ghosts = (index(owned)..index(numbers.len())).collect();
    let (send, receive) = (vec![(0, numbers[owned..].to_vec())], vec![(0, ghosts)]);
    HaloMap { owned, count: numbers.len(), send, receive }
}

/// The triangles of a cell and those around it.
struct Cover<'a> {
    cell: &'a Sheet,
    periods: [f64; 2],
    /// With their numbers in the cell; those of the cell come first.
    triangles: Vec<(u32, [Image; 3])>,
}

impl<'a> Cover<'a> {
    fn new(cell: &'a Sheet, periods: [f64; 2]) -> Self {
        let mut made = Self { cell, periods, triangles: Vec::new() };
        let own: Vec<_> =
            (0..cell.triangle_count()).map(|t| (index(t), made.unfolded(t))).collect();
        let mut others = Vec::new();
        for shift in translations(periods).filter(|shift| *shift != [0, 0]) {
            let moved = |image: Image| (image.0, [image.1[0] + shift[0], image.1[1] + shift[1]]);
            others.extend(own.iter().map(|(t, corners)| (*t, corners.map(moved))));
        }
        let touches = |corners: &[Image; 3]| corners.iter().any(|corner| !is_image(corner));
        let near: Vec<_> = own.iter().chain(&others).filter(|(_, c)| touches(c)).copied().collect();
        let near: BTreeSet<Image> = made.vertices(&near).collect();
        others.retain(|(_, corners)| corners.iter().any(|corner| near.contains(corner)));
        others.sort_unstable();
        made.triangles = own;
        made.triangles.append(&mut others);
        made
    }

    fn vertices(&self, triangles: &[(u32, [Image; 3])]) -> impl Iterator<Item = Image> + use<> {
        triangles.iter().flat_map(|(_, corners)| *corners).collect::<Vec<_>>().into_iter()
    }

    fn position(&self, (v, shift): Image) -> Vec3 {
        let mut x = self.cell.rest()[v as usize];
        for axis in (0..2).filter(|axis| shift[*axis] != 0) {
            x[axis] += f64::from(shift[axis]) * self.periods[axis];
        }
        x
    }

    /// The corners of triangle `t` next to one another, the lowest in the cell.
    fn unfolded(&self, t: usize) -> [Image; 3] {
        let corners = self.cell.triangles()[t];
        let lowest = corners.into_iter().min().unwrap_or_default();
        let at = self.cell.rest()[lowest as usize];
        corners.map(|v| {
            let x = self.cell.rest()[v as usize];
            let shift = |axis: usize| {
                let periods = (at[axis] - x[axis]) / self.periods[axis];
                if periods > 0.5 { 1 } else { -i8::from(periods < -0.5) }
            };
            (v, [shift(0), shift(1)])
        })
    }
}

/// The translations of elements around a cell.
fn translations(periods: [f64; 2]) -> impl Iterator<Item = [i8; 2]> {
    let along = move |axis: usize| {
        TRANSLATIONS.into_iter().filter(move |k| *k == 0 || periods[axis].is_finite())
    };
    along(0).flat_map(move |k| along(1).map(move |l| [k, l]))
}
