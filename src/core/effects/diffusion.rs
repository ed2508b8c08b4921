//! Diffusion of one species along the surface.
//!
//! ```text
//! ∂c/∂t = … + D Δ c
//! ```
//!
//! `scheme = "cotan"` (default, species on vertices): Laplace-Beltrami of linear finite elements
//! with lumped mass,
//!
//! ```text
//! (Δc)_i = (1/A_i) Σ_j w_ij (c_j - c_i),   w_ij = ½ (cot α_ij + cot β_ij),   A_i = ⅓ Σ_{T∋i} A_T
//! ```
//!
//! No flux through the boundary comes for free, and `Σ A_i c_i` is conserved because w is symmetric. On
//! Delaunay meshes w ≥ 0, so c stays ≥ 0. The areas are thirds because that is the lumped mass
//! matrix of the same elements: any other split would break second order.
//!
//! **Coefficients that differ from place to place** are constant on each triangle, and `∂c/∂t = ∇·(D ∇c)`:
//!
//! ```text
//! D w_ij → ½ (D_α cot α_ij + D_β cot β_ij)
//! ```
//!
//! with the D of the triangle of each angle. This is the stiffness of the same elements, so it stays symmetric, conserves
//! the total, and no mean is chosen: across a step of D along edges the flux is continuous, as with the harmonic mean; along
//! it the flows add up, as with the arithmetic one.
//!
//! `scheme = "green-gauss"` (species on faces): the paper's, see [`GreenGauss`](super::GreenGauss).
//!
//! `metric = "rest"` uses the rest positions once and for all. With `measure = "amount"` the value
//! is `C = c A/A⁰` and `∂C/∂t = (A/A⁰) D Δ(C A⁰/A)`, which conserves `Σ A⁰ C`.
//!
//! Source: Pinkall & Polthier, Exp. Math. 2 (1993) 15, doi:10.1080/10586458.1993.10504266.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::green_gauss::GreenGauss;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Field, Measure, Needs, Transport, Values,
};
use crate::Vec3;
use crate::geometry::sum_at_corners;
use crate::kinetics::Location;
use crate::num::checked::NonNegative;
use crate::parallel;
use crate::sheet::{Edge, Sheet};

/// Parameters of diffusion in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Diffusion {
    /// Which species.
    pub species: String,
    /// Coefficient D, length²/time; the plugin's default if not given, which must be above 0 then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coefficient: Option<Field<NonNegative>>,
    /// Discretisation; by default the one that fits where the species lives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scheme: Option<DiffusionScheme>,
    /// Surface along which the species diffuses.
    #[serde(default)]
    pub metric: DiffusionMetric,
}

/// Discretisations of diffusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DiffusionScheme {
    /// Cotangent Laplace-Beltrami on vertices.
    Cotan,
    /// The paper's Green-Gauss scheme on faces.
    GreenGauss,
}

/// Surfaces to diffuse along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DiffusionMetric {
    /// The current shape.
    #[default]
    Current,
    /// The rest shape.
    Rest,
}

#[typetag::serialize(name = "diffusion")]
impl EffectSpec for Diffusion {
    fn name(&self) -> String {
        format!("diffusion of {}", self.species)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let file = self.coefficient.as_ref().and_then(Field::file);
        file.map(|file| ("coefficient.file", file)).into_iter().collect()
    }

    fn count_paths_from(&mut self, folder: &Path) {
        if let Some(coefficient) = &mut self.coefficient {
            coefficient.count_path_from(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let refuse = |key, message: String, help: String| {
            Err(EffectError { key, message, help: Some(help) })
        };
        let Some((descriptor, location)) = context.kinetics else {
            return refuse(
                "species",
                format!("`{}` cannot diffuse: there are no kinetics", self.species),
                "add a [kinetics] table with a plugin".into(),
            );
        };
        let Some(species) = descriptor.species_index(&self.species) else {
            let names: Vec<&str> = descriptor.species.iter().map(|s| s.name.as_str()).collect();
            return refuse(
                "species",
                format!("{} has no species `{}`", descriptor.name, self.species),
                format!("its species: {}", names.join(", ")),
            );
        };
        let usual = descriptor.species[species].diffusion;
        if self.coefficient.is_none() && usual == 0.0 {
            return refuse(
                "species",
                format!("diffusion of {} has no coefficient, and the law gives none", self.species),
                "coefficient = D in length²/time; a law written as text has no default, and 0 can be given"
                    .into(),
            );
        }
        let given = self.coefficient.as_ref();
        let given = given.map(|field| context.values(field, Location::Face, "coefficient"));
        let coefficient = given.transpose()?.unwrap_or(Values::Same(usual));
        let fitting = match location {
            Location::Vertex => DiffusionScheme::Cotan,
            Location::Face | Location::Edge => DiffusionScheme::GreenGauss,
        };
        if self.scheme.is_some_and(|scheme| scheme != fitting) {
            return refuse(
                "scheme",
                format!("this scheme does not fit species on {}", location.nouns()),
                "`cotan` is for species on vertices, `green-gauss` for species on faces; \
                 kinetics.location says where they are"
                    .into(),
            );
        }
        let rest = self.metric == DiffusionMetric::Rest;
        Ok(match fitting {
            DiffusionScheme::Cotan => {
                let measure = context.measure;
                Effect::transport(Cotan::new(context.sheet, species, coefficient, measure, rest))
            }
            DiffusionScheme::GreenGauss => {
                if context.measure == Measure::Amount {
                    return refuse(
                        "scheme",
                        "the Green-Gauss scheme does not conserve amounts".into(),
                        "use kinetics.location = \"vertex\" with measure = \"amount\"".into(),
                    );
                }
                let Values::Same(coefficient) = coefficient else {
                    return refuse(
                        "coefficient",
                        "the Green-Gauss scheme has one coefficient".into(),
                        "give a number, or use kinetics.location = \"vertex\"".into(),
                    );
                };
                Effect::transport(GreenGauss::new(context.sheet, species, coefficient, rest))
            }
        })
    }
}

crate::register_kind!(dyn EffectSpec, "diffusion", Diffusion);

/// What a triangle adds to its edges and vertices.
#[derive(Debug, Clone, Copy, Default)]
struct Corners {
    /// Cotangents of its angles.
    cot: [f64; 3],
    /// A third of its area.
    third: f64,
}

/// Cotangent diffusion of one species.
#[derive(Debug)]
pub struct Cotan {
    species: usize,
    /// D; 1 where it differs from triangle to triangle.
    coefficient: f64,
    /// D of the triangles where it differs, which then is part of the operator; else empty.
    varying: Vec<f64>,
    measure: Measure,
    /// Lumped areas at rest; of amounts only.
    rest_area: Vec<f64>,
    /// The operator on a surface that does not change, if it is to be that.
    frozen: Option<CotanOperator>,
}

/// The operator on one surface.
#[derive(Debug, Default)]
pub struct CotanOperator {
    area: Vec<f64>,
    weight: Vec<f64>,
    bound: f64,
}

impl CotanOperator {
    /// On the shape `x`, with the factors `varying` of the triangles; none for 1.
    fn assemble(&mut self, sheet: &Sheet, x: &[Vec3], varying: &[f64]) {
        let triangles = sheet.triangles();
        self.weight.resize(sheet.edges().len(), 0.0);
        self.area.resize(sheet.vertex_count(), 0.0);
        // Not kept: twice as large as the operator.
        let mut corner = vec![Corners::default(); triangles.len()];
        parallel::fill(&mut corner, |t| {
            let [a, b, c] = triangles[t].map(|v| x[v as usize]);
            let (ab, bc, ca) = (b - a, c - b, a - c);
            let double = ab.cross(&bc).norm();
            let mut cot = [-ab.dot(&ca), -bc.dot(&ab), -ca.dot(&bc)].map(|dot| dot / double);
            if let Some(factor) = varying.get(t) {
                cot = cot.map(|cot| factor * cot);
            }
            Corners { cot, third: double / 6.0 }
        });
        let (corner, edges, opposite) = (&corner, sheet.edges(), sheet.triangle_edges());
        parallel::fill(&mut self.weight, |e| {
            let cot = |t: u32| -> f64 {
                if t == Edge::NONE {
                    return 0.0;
                }
                let t = t as usize;
                (0..3).filter(|&k| opposite[t][k] as usize == e).map(|k| corner[t].cot[k]).sum()
            };
            let [left, right] = edges[e].triangles;
            0.5 * (cot(left) + cot(right))
        });
        sum_at_corners(sheet, |t| corner[t].third, &mut self.area);
        // Gershgorin: twice the largest row sum of |w|/A.
        let (weight, area, neighbours) = (&self.weight, &self.area, sheet.vertex_edges());
        self.bound = 2.0
            * parallel::max(area.len(), |i| {
                let row: f64 =
                    neighbours.of(i).iter().map(|&(e, _)| weight[e as usize].abs()).sum();
                row / area[i]
            });
    }

    /// Lumped areas `A_i` of the surface.
    #[must_use]
    pub fn area(&self) -> &[f64] {
        &self.area
    }

    /// Edges whose weight is negative: where a maximum principle may fail.
    #[must_use]
    pub fn negative_weights(&self) -> usize {
        self.weight.iter().filter(|w| **w < 0.0).count()
    }
}

impl Cotan {
    /// On `sheet` in its rest state; `frozen` keeps that surface.
    #[must_use]
    pub fn new(
        sheet: &Sheet,
        species: usize,
        coefficient: impl Into<Values>,
        measure: Measure,
        frozen: bool,
    ) -> Self {
        let (coefficient, varying) = match coefficient.into() {
            Values::Same(coefficient) => (coefficient, Vec::new()),
            Values::Each(all) => (1.0, all),
        };
        // Without diffusion nothing needs to follow the shape.
        let frozen = frozen || coefficient == 0.0;
        let amount = measure == Measure::Amount;
        let at_rest = (frozen || amount).then(|| {
            let mut at_rest = CotanOperator::default();
            at_rest.assemble(sheet, sheet.rest(), &varying);
            at_rest
        });
        let area = at_rest.as_ref().filter(|_| amount).map(|at_rest| at_rest.area.clone());
        let (rest_area, frozen) = (area.unwrap_or_default(), at_rest.filter(|_| frozen));
        Self { species, coefficient, varying, measure, rest_area, frozen }
    }

    /// The operator in use where that of the shape is `operator`.
    #[must_use]
    pub fn in_use<'a>(&'a self, operator: &'a CotanOperator) -> &'a CotanOperator {
        self.frozen.as_ref().unwrap_or(operator)
    }
}

impl Transport for Cotan {
    type Operator = CotanOperator;

    fn name(&self) -> &'static str {
        "diffusion"
    }

    fn species(&self) -> usize {
        self.species
    }

    /// Measure and a coefficient that is the same everywhere are not in it.
    fn has_operator_of(&self, other: &Self) -> bool {
        let own = |it: &Self| it.frozen.is_some() || !it.varying.is_empty();
        !own(self) && !own(other)
    }

    fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut CotanOperator) {
        if self.frozen.is_none() {
            operator.assemble(sheet, x, &self.varying);
        }
    }

    fn add_rate(&self, sheet: &Sheet, operator: &CotanOperator, c: &[f64], out: &mut [f64]) {
        if self.coefficient == 0.0 {
            return;
        }
        let neighbours = sheet.vertex_edges();
        let CotanOperator { weight, area, .. } = self.in_use(operator);
        let rest = &self.rest_area;
        let d = self.coefficient;
        match self.measure {
            Measure::Concentration => parallel::update(out, |i, rate| {
                let flow: f64 = neighbours
                    .of(i)
                    .iter()
                    .map(|&(e, j)| weight[e as usize] * (c[j as usize] - c[i]))
                    .sum();
                *rate += d * flow / area[i];
            }),
            Measure::Amount => {
                let density = |i: usize| c[i] * rest[i] / area[i];
                parallel::update(out, |i, rate| {
                    let flow: f64 = neighbours
                        .of(i)
                        .iter()
                        .map(|&(e, j)| weight[e as usize] * (density(j as usize) - density(i)))
                        .sum();
                    *rate += d * flow / rest[i];
                });
            }
        }
    }

    fn spectral_bound(&self, operator: &CotanOperator) -> f64 {
        self.coefficient * self.in_use(operator).bound
    }

    fn entries(
        &self,
        sheet: &Sheet,
        operator: &CotanOperator,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        let CotanOperator { weight, area, .. } = self.in_use(operator);
        let neighbours = sheet.vertex_edges();
        for i in 0..sheet.vertex_count() {
            // Rows per area; columns from values to densities.
            let (per, density): (f64, &dyn Fn(usize) -> f64) = match self.measure {
                Measure::Concentration => (area[i], &|_| 1.0),
                Measure::Amount => (self.rest_area[i], &|j| self.rest_area[j] / area[j]),
            };
            let mut diagonal = 0.0;
            for &(e, j) in neighbours.of(i) {
                let flow = self.coefficient * weight[e as usize] / per;
                emit(i, j as usize, flow * density(j as usize));
                diagonal -= flow;
            }
            emit(i, i, diagonal * density(i));
        }
    }

    fn shape_derivatives(
        &self,
        sheet: &Sheet,
        operator: &CotanOperator,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        if self.frozen.is_some() {
            return;
        }
        let CotanOperator { weight, area, .. } = operator;
        let amount = self.measure == Measure::Amount;
        let density = |i: usize| if amount { c[i] * self.rest_area[i] / area[i] } else { c[i] };
        let per = |i: usize| if amount { self.rest_area[i] } else { area[i] };
        let mut rate = vec![0.0; c.len()];
        self.add_rate(sheet, operator, c, &mut rate);
        let neighbours = sheet.vertex_edges();
        for (t, triangle) in sheet.triangles().iter().enumerate() {
            let factor = self.varying.get(t).copied().unwrap_or(self.coefficient);
            let v = triangle.map(|v| v as usize);
            let [a, b, d] = v.map(|v| x[v]);
            let e = [d - b, a - d, b - a];
            let normal = e[0].cross(&e[1]);
            let double = normal.norm();
            let normal = normal / double;
            // ∂A/∂x_m = ½ n × e_m.
            let by_area = e.map(|e| 0.5 * normal.cross(&e));
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                // cot θ_k = -e_i·e_j/2A drives the flow between the ends of the opposite edge.
                let cot = -e[i].dot(&e[j]) / double;
                let flow = 0.5 * factor * (density(v[j]) - density(v[i]));
                for m in 0..3 {
                    let by_dot = match (m + 3 - k) % 3 {
                        // e_i = x_k - x_j, e_j = x_i - x_k.
                        0 => e[j] - e[i],
                        1 => e[i],
                        _ => -e[j],
                    };
                    let by = -by_dot / double - (2.0 * cot / double) * by_area[m];
                    emit(v[i], v[m], (flow / per(v[i])) * by);
                    emit(v[j], v[m], (-flow / per(v[j])) * by);
                }
            }
            // Areas of the vertices: of the row, or of the densities.
            for m in 0..3 {
                let third = by_area[m] / 3.0;
                for i in v {
                    if amount {
                        let slope = -density(i) / area[i];
                        let mut own = 0.0;
                        for &(edge, j) in neighbours.of(i) {
                            let flow = self.coefficient * weight[edge as usize] * slope;
                            emit(j as usize, v[m], (flow / per(j as usize)) * third);
                            own -= flow;
                        }
                        emit(i, v[m], (own / per(i)) * third);
                    } else {
                        emit(i, v[m], (-rate[i] / area[i]) * third);
                    }
                }
            }
        }
    }
}
