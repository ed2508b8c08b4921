//! Patterns of the species and of the mean curvature: regions above a level, and how well the mesh resolves them.
//!
//! ```text
//! w = π √(∫ (c - c̄)² dA / ∫ |∇c|² dA)      half the wavelength of a plane wave, about the width of a spot
//! ∫ |∇c|² dA ≈ 2 A ⟨(Δc/ℓ)²⟩               mean over pairs of neighbours at the distance ℓ
//! ```
//!
//! The same of the mean curvature H, averaged over the neighbours of every vertex, is half the wavelength of wrinkles; the
//! boundary, where H is not defined, is left out.
//! Where w is below [`RESOLVED`] mean edges, number and size of regions depend on the mesh.
//!
//! On a periodic sheet images have no area of their own, every pair of neighbours counts once, and a region across the end of a
//! period is one.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::Stepper;
use crate::Vec3;
use crate::geometry::{AreaRule, Curvature, Face, VertexArea, sum_at_corners};
use crate::kinetics::Location;
use crate::model::{Evaluation, ModelError};
use crate::num::real;
use crate::sheet::Sheet;

/// Width of a pattern in mean edges from which on its regions can be counted.
pub const RESOLVED: f64 = 6.0;

/// Deviations from the mean below this share of the largest value are no pattern: round-off, and what is left of noise.
const UNIFORM: f64 = 1e-6;

/// Deviations of the mean curvature below this share of an inverse edge are no wrinkles: six edges wide, they would be
/// 0.04 edges high.
const FLAT: f64 = 0.01;

/// What is to be said of a pattern of species, and of wrinkles of the shape, that are so many mean edges wide; nothing where
/// they are resolved.
pub fn resolution_words(
    species: Option<f64>,
    wrinkles: Option<f64>,
) -> impl Iterator<Item = String> {
    let species = species.filter(|width| *width < RESOLVED).map(|width| {
        format!(
            "the pattern is {width:.1} edges wide: below {RESOLVED} the number and the size of its regions depend on the \
             mesh; more sheet.vertices, or a wider pattern; rumple sweep --refine shows what changes"
        )
    });
    let wrinkles = wrinkles.filter(|width| *width < RESOLVED).map(|width| {
        format!(
            "the wrinkles of the shape are {width:.1} edges wide: below {RESOLVED} the mesh decides how wide they are; more \
             sheet.vertices, or a thicker sheet; rumple sweep --refine shows what changes"
        )
    });
    species.into_iter().chain(wrinkles)
}

/// The same of the state of `stepper`; nothing of a sheet over ranks.
pub(super) fn resolution_notes(stepper: &mut Stepper) -> Vec<String> {
    let Stepper { workspace, state, .. } = stepper;
    let sheet = Arc::clone(workspace.model.sheet());
    if sheet.reduction().ranks().is_some() || sheet.edges().is_empty() {
        return Vec::new();
    }
    let species = Pattern::of_species(&mut workspace.at(state));
    let species = Pattern::narrowest(&species, &state.x, &sheet);
    let shape = Pattern::of_shape(&mut workspace.at(state)).ok().flatten();
    let shape = shape.and_then(|shape| shape.width(&state.x, &sheet));
    resolution_words(species, shape).collect()
}

/// A scalar field where it lives: what regions are made of.
pub struct Pattern {
    value: Vec<f64>,
    position: Arc<[Vec3]>,
    /// Of every point, in the deformed state; 0 of images.
    pub area: Arc<[f64]>,
    /// Pairs of points, each once.
    neighbours: Arc<[[u32; 2]]>,
    /// The point of which each is an image, or itself.
    owner: Arc<[u32]>,
}

impl Pattern {
    /// Every species, in their order.
    pub fn of_species(at: &mut Evaluation<'_>) -> Vec<Self> {
        let (model, state) = (at.model(), at.state());
        let (sheet, x) = (model.sheet(), &state.x);
        let Some(chemistry) = model.chemistry() else { return Vec::new() };
        let faces: Vec<f64> = sheet
            .triangles()
            .iter()
            .map(|t| Face::from_corners(&t.map(|v| x[v as usize])).area)
            .collect();
        let counted = sheet.edges().iter().filter(|e| sheet.counts(&e.vertices));
        let (values, position, mut area, neighbours): (_, Arc<[Vec3]>, Vec<f64>, Arc<[_]>) =
            match chemistry.location() {
                Location::Face => {
                    let centre =
                        |t: &[u32; 3]| t.iter().map(|v| x[*v as usize]).sum::<Vec3>() / 3.0;
                    let inner = counted.filter(|e| !e.is_boundary());
                    let position = sheet.triangles().iter().map(centre).collect();
                    let neighbours = inner.map(|e| e.triangles).collect();
                    (state.species.clone(), position, faces, neighbours)
                }
                _ => {
                    let mut area = vec![0.0; x.len()];
                    sum_at_corners(sheet, |t| faces[t] / 3.0, &mut area);
                    let neighbours = counted.map(|e| e.vertices).collect();
                    (at.species_at_vertices(), x.to_vec().into(), area, neighbours)
                }
            };
        let owner = owners(sheet, chemistry.location());
        leave_out_images(sheet, &mut area);
        let area: Arc<[f64]> = area.into();
        let pattern = |value| Self {
            value,
            position: Arc::clone(&position),
            area: Arc::clone(&area),
            neighbours: Arc::clone(&neighbours),
            owner: Arc::clone(&owner),
        };
        values.into_iter().map(pattern).collect()
    }

    /// The least width of `patterns` that have one.
    #[must_use]
    pub fn narrowest(patterns: &[Self], x: &[Vec3], sheet: &Sheet) -> Option<f64> {
        patterns.iter().filter_map(|pattern| pattern.width(x, sheet)).reduce(f64::min)
    }

    /// The mean curvature inside the boundary; none of a sheet that stays in a plane or does not move, or whose curvature
    /// is that of a surface as smooth as the mesh can show.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn of_shape(at: &mut Evaluation<'_>) -> Result<Option<Self>, ModelError> {
        let (model, x) = (at.model(), &at.state().x);
        let sheet = model.sheet();
        if model.mechanics().is_planar() || !model.moves() {
            return Ok(None);
        }
        let rule = VertexArea::lazy(AreaRule::Barycentric);
        let Curvature { mut area, mean, .. } =
            Curvature::evaluate(&at.potential()?.shape(x), &rule);
        let boundary = sheet.boundary();
        area.iter_mut().zip(boundary).filter(|(_, b)| **b).for_each(|(area, _)| *area = 0.0);
        leave_out_images(sheet, &mut area);
        let owner = owners(sheet, Location::Vertex);
        let inside = |[a, b]: &[u32; 2]| !boundary[*a as usize] && !boundary[*b as usize];
        let counted = sheet.edges().iter().map(|e| e.vertices).filter(|ends| sheet.counts(ends));
        let neighbours: Arc<[_]> = counted.filter(inside).collect();
        // H at a single vertex is as uneven as the triangles around it.
        let owned = neighbours.iter().map(|pair| pair.map(|v| owner[v as usize] as usize));
        let means = ring_means(&mean, &area, owned);
        let value = owner.iter().map(|owner| means[*owner as usize]).collect();
        let (position, area) = (x.to_vec().into(), area.into());
        let pattern = Self { value, position, area, neighbours, owner };
        let wrinkled = pattern.variance().sqrt() * mean_edge(x, sheet) > FLAT;
        Ok(wrinkled.then_some(pattern))
    }

    /// Mean over the area of what `of` makes of the values.
    fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let total: f64 = self.area.iter().sum();
        self.area.iter().zip(&self.value).map(|(area, c)| area * of(*c)).sum::<f64>() / total
    }

    /// Variance over the area.
    fn variance(&self) -> f64 {
        let mean = self.mean(|c| c);
        self.mean(|c| (c - mean).powi(2))
    }

    /// Half way between the least and the largest value; none where they are the same.
    #[must_use]
    pub fn half_way(&self) -> Option<f64> {
        let values = self.value.iter().copied();
        let least = values.clone().fold(f64::INFINITY, f64::min);
        let largest = values.fold(f64::NEG_INFINITY, f64::max);
        (largest > least).then_some(0.5 * (least + largest))
    }

    /// The width w in mean edges of `sheet` in the deformed state; none where the species is uniform.
    #[must_use]
    pub fn width(&self, x: &[Vec3], sheet: &Sheet) -> Option<f64> {
        let variance = self.variance();
        let largest = self.value.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let slope = |&[a, b]: &[u32; 2]| {
            let (a, b) = (a as usize, b as usize);
            let square = (self.position[a] - self.position[b]).norm_squared();
            if square > 0.0 { (self.value[a] - self.value[b]).powi(2) / square } else { 0.0 }
        };
        let slopes = self.neighbours.iter().map(slope).sum::<f64>() / real(self.neighbours.len());
        let width = PI * (variance / (2.0 * slopes)).sqrt() / mean_edge(x, sheet);
        (variance.sqrt() > UNIFORM * largest && width.is_finite()).then_some(width)
    }

    /// Centres of the regions above `level`, and their area in all.
    #[must_use]
    pub fn regions(&self, level: f64) -> (Vec<Vec3>, f64) {
        let points = (0u32..).take(self.value.len());
        let mut parent: Vec<(u32, Vec3)> = points.clone().map(|k| (k, Vec3::zeros())).collect();
        let above = |k: u32| self.value[k as usize] > level;
        for pair in self.neighbours.iter().filter(|pair| pair.iter().all(|k| above(*k))) {
            let [(a, of_a), (b, of_b)] = pair.map(|k| {
                let owner = self.owner[k as usize];
                let (first, by) = root(&mut parent, owner);
                (first, by - (self.position[k as usize] - self.position[owner as usize]))
            });
            if a < b {
                parent[b as usize] = (a, of_a - of_b);
            } else if b < a {
                parent[a as usize] = (b, of_b - of_a);
            }
        }
        // A region is known by its first point; its moments are summed there.
        let mut moments = vec![(0.0, Vec3::zeros()); self.value.len()];
        for k in points.filter(|k| above(*k)) {
            let ((first, by), point) = (root(&mut parent, k), k as usize);
            let moment = &mut moments[first as usize];
            moment.0 += self.area[point];
            moment.1 += self.area[point] * (self.position[point] + by);
        }
        let found = moments.iter().filter(|(area, _)| *area > 0.0);
        let centres = found.clone().map(|(area, moment)| moment / *area).collect();
        (centres, found.map(|(area, _)| area).sum())
    }
}

/// The owner of every vertex or triangle of `sheet`.
fn owners(sheet: &Sheet, location: Location) -> Arc<[u32]> {
    match location {
        Location::Face => (0..sheet.triangle_count()).map(|t| sheet.triangle_number(t)).collect(),
        _ => (0..sheet.vertex_count()).map(|i| sheet.number(i)).collect(),
    }
}

/// Sets the areas of images to 0.
fn leave_out_images(sheet: &Sheet, area: &mut [f64]) {
    let owned = sheet.reduction().owned(area.len());
    area[owned..].fill(0.0);
}

/// Means of `value` over points and their neighbours, weighed by `area`.
fn ring_means(
    value: &[f64],
    area: &[f64],
    neighbours: impl Iterator<Item = [usize; 2]>,
) -> Vec<f64> {
    let own: Vec<(f64, f64)> = value.iter().zip(area).map(|(v, a)| (v * a, *a)).collect();
    let mut sums = own.clone();
    for [a, b] in neighbours {
        for (at, from) in [(a, b), (b, a)] {
            sums[at] = (sums[at].0 + own[from].0, sums[at].1 + own[from].1);
        }
    }
    sums.into_iter().map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect()
}

/// Mean length of an edge.
fn mean_edge(x: &[Vec3], sheet: &Sheet) -> f64 {
    let counted = || sheet.edges().iter().map(|edge| edge.vertices).filter(|e| sheet.counts(e));
    let length = |[a, b]: [u32; 2]| (x[a as usize] - x[b as usize]).norm();
    counted().map(length).sum::<f64>() / real(counted().count())
}

/// The first of the points connected to `k`, and the translation that brings `k` next to it, with the way there made short.
fn root(parent: &mut [(u32, Vec3)], mut k: u32) -> (u32, Vec3) {
    let mut translation = Vec3::zeros();
    while parent[k as usize].0 != k {
        let (next, by) = parent[k as usize];
        let (after, more) = parent[next as usize];
        parent[k as usize] = (after, by + more);
        translation += by + more;
        k = after;
    }
    (k, translation)
}
