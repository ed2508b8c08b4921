//! Advection of a species by a velocity along the sheet.
//!
//! ```text
//! ∂c/∂t = … - ∇_s·(c v),     v·n = 0 at the boundary
//! ```
//!
//! v is a formula of the rest position, carried with the surface and relative to it (length/time); its part along the
//! normal does nothing. Finite volumes on the cells of the vertices, which end at midpoints of edges and centroids of
//! triangles: across the part of the cell boundary of i and j that lies in a triangle T with the unit normal N,
//!
//! ```text
//! Φ_ij = Σ_T v_T·((g_T - m_ij) × N_T),     v_T the mean of the corners, g_T the centroid, m_ij the midpoint
//! A_i dc_i/dt = … - Σ_j Φ_ij ½ (c_i + c_j) - ½ |Φ_ij| (c_i - c_j)  [upwind]
//! ```
//!
//! Every Φ_ij leaves one cell for another and none crosses the boundary: `Σ A_i c_i` is conserved to round-off. `upwind`
//! (default) is of first order, keeps c ≥ 0, and adds the numerical diffusion ½ |v| h along v, h about the edge length.
//! `central` is of second order without numerical diffusion, and oscillates where the solution is not resolved: where
//! |v| h/D > 2 at a layer. Where ∇_s·v ≠ 0 species gather.
//!
//! Reference: Barth, Aspects of unstructured grids and finite-volume solvers, VKI Lecture Series 1994-05; central fluxes
//! on these cells are those of linear elements with lumped mass.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec, Field, Measure, Needs, Transport};
use crate::Vec3;
use crate::geometry::sum_at_corners;
use crate::kinetics::Location;
use crate::parallel;
use crate::sheet::{Edge, Sheet};

/// Parameters of advection in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Advection {
    /// Which species.
    pub species: String,
    /// v, length/time: numbers or formulas of the rest position.
    pub velocity: [Field; 3],
    /// Values at the boundaries of cells.
    #[serde(default)]
    pub scheme: AdvectionScheme,
}

/// Values at the boundaries of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AdvectionScheme {
    /// Those of the cell that it flows out of.
    #[default]
    Upwind,
    /// The mean of both cells.
    Central,
}

#[typetag::serialize(name = "advection")]
impl EffectSpec for Advection {
    fn name(&self) -> String {
        format!("advection of {}", self.species)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        self.velocity.iter().filter_map(|field| Some(("velocity.file", field.file()?))).collect()
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.velocity.iter_mut().for_each(|field| field.resolve_path_against(folder));
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let (species, location) = context.species("species", &self.species, "be advected")?;
        if location != Location::Vertex {
            return Err(EffectError {
                key: "species",
                message: format!(
                    "advection is for species on vertices, and `{}` is on {}",
                    self.species,
                    location.nouns()
                ),
                help: Some("kinetics.location = \"vertex\"".into()),
            });
        }
        let sheet = context.sheet;
        let mut columns = Vec::with_capacity(3);
        for component in &self.velocity {
            columns.push(context.at_vertices(component, "velocity")?);
        }
        let at = |v: u32| Vec3::from_fn(|axis, _| columns[axis][v as usize]);
        let mean = |corners: &[u32; 3]| corners.iter().map(|v| at(*v)).sum::<Vec3>() / 3.0;
        let velocity = sheet.triangles().iter().map(mean).collect();
        let upwind = self.scheme == AdvectionScheme::Upwind;
        let mut rest_area = Vec::new();
        if context.measure == Measure::Amount {
            rest_area.resize(sheet.vertex_count(), 0.0);
            cell_areas(sheet, sheet.rest(), &mut rest_area);
        }
        Ok(Effect::transport(CellAdvection { species, velocity, upwind, rest_area }))
    }
}

crate::register_kind!(dyn EffectSpec, "advection", Advection);

/// Advection of one species on the cells of the vertices.
#[derive(Debug)]
struct CellAdvection {
    species: usize,
    /// v of every triangle.
    velocity: Vec<Vec3>,
    upwind: bool,
    /// Of amounts only.
    rest_area: Vec<f64>,
}

/// Advection on one shape.
#[derive(Debug, Default)]
struct AdvectionOperator {
    area: Vec<f64>,
    /// Φ of every edge, from its first vertex to its second.
    flux: Vec<f64>,
    bound: f64,
}

/// Areas of the cells on the shape `x`.
fn cell_areas(sheet: &Sheet, x: &[Vec3], area: &mut [f64]) {
    let third_area = |t: usize| {
        let [a, b, c] = sheet.triangles()[t].map(|v| x[v as usize]);
        (b - a).cross(&(c - a)).norm() / 6.0
    };
    sum_at_corners(sheet, third_area, area);
}

/// Φ of the edge opposite corner k of a triangle, from corner k+1 to k+2.
fn flux_across(corners: [Vec3; 3], k: usize, velocity: &Vec3) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a)).normalize();
    velocity.dot(&to_centroid(&corners, k).cross(&normal))
}

/// From the midpoint of the edge opposite corner k to the centroid.
fn to_centroid(corners: &[Vec3; 3], k: usize) -> Vec3 {
    (2.0 * corners[k] - corners[(k + 1) % 3] - corners[(k + 2) % 3]) / 6.0
}

impl CellAdvection {
    /// The shares of Φ that are carried with the density of the first and of the second vertex.
    fn carried(&self, flux: f64) -> [f64; 2] {
        match self.upwind {
            true => [flux.max(0.0), flux.min(0.0)],
            false => [0.5 * flux; 2],
        }
    }

    /// Density over value.
    fn density_per_value(&self, operator: &AdvectionOperator, i: usize) -> f64 {
        self.rest_area.get(i).map_or(1.0, |rest| rest / operator.area[i])
    }

    /// The area that the value is counted per.
    fn value_area(&self, operator: &AdvectionOperator, i: usize) -> f64 {
        self.rest_area.get(i).copied().unwrap_or(operator.area[i])
    }

    /// What flows into cell i through edge e from the cell j, as shares of the densities of i and j.
    fn inflow_shares(&self, sheet: &Sheet, flux: &[f64], e: usize, i: usize) -> [f64; 2] {
        let [first, second] = self.carried(flux[e]);
        match sheet.edges()[e].vertices[0] as usize == i {
            true => [-first, -second],
            false => [second, first],
        }
    }
}

impl Transport for CellAdvection {
    type Operator = AdvectionOperator;

    fn name(&self) -> &'static str {
        "advection"
    }

    fn species(&self) -> usize {
        self.species
    }

    fn speed_key(&self) -> &'static str {
        "velocity"
    }

    fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut AdvectionOperator) {
        let triangles = sheet.triangles();
        operator.area.resize(sheet.vertex_count(), 0.0);
        operator.flux.resize(sheet.edges().len(), 0.0);
        let corners = |t: usize| triangles[t].map(|v| x[v as usize]);
        cell_areas(sheet, x, &mut operator.area);
        let (edges, opposite) = (sheet.edges(), sheet.triangle_edges());
        parallel::fill(&mut operator.flux, |e| {
            let sides = edges[e].triangles.iter().filter(|t| **t != Edge::NONE);
            let of = |t: &u32| {
                let t = *t as usize;
                let k = (0..3).find(|&k| opposite[t][k] as usize == e).unwrap_or(0);
                let flux = flux_across(corners(t), k, &self.velocity[t]);
                match triangles[t][(k + 1) % 3] == edges[e].vertices[0] {
                    true => flux,
                    false => -flux,
                }
            };
            sides.map(of).sum()
        });
        let shown: &AdvectionOperator = operator;
        let bound = parallel::max(shown.area.len(), |i| {
            let around = sheet.vertex_edges().entries(i).iter();
            let mut own = 0.0;
            let mut row = 0.0;
            for &(e, j) in around {
                let [mine, theirs] = self.inflow_shares(sheet, &shown.flux, e as usize, i);
                own += mine;
                row += theirs.abs() * self.density_per_value(shown, j as usize);
            }
            (row + own.abs() * self.density_per_value(shown, i)) / self.value_area(shown, i)
        });
        operator.bound = bound;
    }

    fn add_rate(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &AdvectionOperator,
        c: &[f64],
        out: &mut [f64],
    ) {
        parallel::update(out, |i, rate| {
            let mine = c[i] * self.density_per_value(operator, i);
            let around = sheet.vertex_edges().entries(i).iter();
            let flow: f64 = around
                .map(|&(e, j)| {
                    let [own, other] = self.inflow_shares(sheet, &operator.flux, e as usize, i);
                    let theirs = c[j as usize] * self.density_per_value(operator, j as usize);
                    own * mine + other * theirs
                })
                .sum();
            *rate += flow / self.value_area(operator, i);
        });
    }

    fn spectral_bound(&self, _: (&Sheet, f64), operator: &AdvectionOperator) -> f64 {
        operator.bound
    }

    fn entries(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &AdvectionOperator,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        for i in 0..sheet.vertex_count() {
            let value_area = self.value_area(operator, i);
            let mut diagonal = 0.0;
            for &(e, j) in sheet.vertex_edges().entries(i) {
                let [own, other] = self.inflow_shares(sheet, &operator.flux, e as usize, i);
                diagonal += own;
                emit(
                    i,
                    j as usize,
                    other * self.density_per_value(operator, j as usize) / value_area,
                );
            }
            emit(i, i, diagonal * self.density_per_value(operator, i) / value_area);
        }
    }

    fn shape_derivatives(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &AdvectionOperator,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let density: Vec<f64> =
            c.iter().enumerate().map(|(i, c)| c * self.density_per_value(operator, i)).collect();
        let mut rate = vec![0.0; c.len()];
        self.add_rate((sheet, time), operator, c, &mut rate);
        for (t, triangle) in sheet.triangles().iter().enumerate() {
            let v = triangle.map(|v| v as usize);
            let corners = v.map(|v| x[v]);
            let opposite = |m: usize| corners[(m + 2) % 3] - corners[(m + 1) % 3];
            let normal = opposite(0).cross(&opposite(1));
            let double_area = normal.norm();
            let normal = normal / double_area;
            let velocity = &self.velocity[t];
            for k in 0..3 {
                let (i, j) = (v[(k + 1) % 3], v[(k + 2) % 3]);
                let e = sheet.triangle_edges()[t][k] as usize;
                let forward = sheet.edges()[e].vertices[0] as usize == i;
                let total = if forward { operator.flux[e] } else { -operator.flux[e] };
                // The density that the flux carries.
                let carried = match (self.upwind, total > 0.0) {
                    (true, true) => density[i],
                    (true, false) => density[j],
                    (false, _) => 0.5 * (density[i] + density[j]),
                };
                let along = normal.cross(velocity);
                let tilt = velocity.cross(&to_centroid(&corners, k));
                for m in 0..3 {
                    let part = if m == k { 2.0 / 6.0 } else { -1.0 / 6.0 };
                    // The normal turns by -N (∇φ_m·dx).
                    let slope = normal.cross(&opposite(m)) / double_area;
                    let by = carried * (part * along - slope.dot(&tilt) * normal);
                    emit(i, v[m], -by / self.value_area(operator, i));
                    emit(j, v[m], by / self.value_area(operator, j));
                }
            }
            for m in 0..3 {
                let third_slope = normal.cross(&opposite(m)) / 6.0;
                self.area_derivatives(sheet, operator, (&density, &rate), v, &mut |i, by| {
                    emit(i, v[m], by * third_slope);
                });
            }
        }
    }
}

impl CellAdvection {
    /// Derivatives of the rates by the areas of the three vertices of a triangle.
    fn area_derivatives(
        &self,
        sheet: &Sheet,
        operator: &AdvectionOperator,
        (density, rate): (&[f64], &[f64]),
        corners: [usize; 3],
        emit: &mut dyn FnMut(usize, f64),
    ) {
        for i in corners {
            let area = operator.area[i];
            if self.rest_area.is_empty() {
                emit(i, -rate[i] / area);
                continue;
            }
            let slope = -density[i] / area;
            let mut own = 0.0;
            for &(e, j) in sheet.vertex_edges().entries(i) {
                let j = j as usize;
                let [mine, _] = self.inflow_shares(sheet, &operator.flux, e as usize, i);
                let [_, theirs] = self.inflow_shares(sheet, &operator.flux, e as usize, j);
                own += mine;
                emit(j, theirs * slope / self.value_area(operator, j));
            }
            emit(i, own * slope / self.value_area(operator, i));
        }
    }
}
