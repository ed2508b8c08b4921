//! Cotangent Laplace-Beltrami of linear elements with lumped mass, of a species by itself or by another one.
//!
//! Equation and reference: see the files `diffusion.rs`, `cross_diffusion.rs` and, along fibres, `fibre_diffusion.rs`.

use super::fibre_diffusion::AnisotropicDiffusivity;
use super::{FieldValues, Measure, Transport};
use crate::Vec3;
use crate::geometry::sum_at_corners;
use crate::parallel;
use crate::sheet::{Edge, Sheet};

/// What a triangle adds to its edges and vertices.
#[derive(Debug, Clone, Copy, Default)]
struct Corners {
    /// Cotangents of its angles.
    cot: [f64; 3],
    /// A third of its area.
    third_area: f64,
}

/// Cotangent diffusion of one species.
#[derive(Debug)]
pub struct Cotan {
    species: usize,
    read_species: usize,
    /// D; 1 where it differs from triangle to triangle.
    coefficient: f64,
    /// D of the triangles where it differs, which then is part of the operator; else empty.
    varying: Vec<f64>,
    /// Fibres along which D is another; D is that across them then.
    fibres: Option<AnisotropicDiffusivity>,
    measure: Measure,
    /// Lumped areas at rest; of amounts only.
    rest_area: Vec<f64>,
    /// The operator on a surface that does not change, if it is to be that.
    frozen: Option<CotanOperator>,
}

/// The operator on one surface.
#[derive(Debug, Default)]
pub struct CotanOperator {
    /// Lumped areas of the vertices.
    area: Vec<f64>,
    /// Half the sum of the cotangents opposite every edge, weighted by the coefficients of the triangles where these differ.
    weight: Vec<f64>,
    /// Gershgorin's bound on the moduli of the eigenvalues, for the coefficient 1.
    bound: f64,
}

impl CotanOperator {
    /// On the shape `x`, with the factors `varying` of the triangles, none for 1, and what fibres add.
    fn assemble(
        &mut self,
        sheet: &Sheet,
        x: &[Vec3],
        (varying, fibres): (&[f64], Option<&AnisotropicDiffusivity>),
    ) {
        let triangles = sheet.triangles();
        self.weight.resize(sheet.edges().len(), 0.0);
        self.area.resize(sheet.vertex_count(), 0.0);
        // Not kept: twice as large as the operator.
        let mut corner = vec![Corners::default(); triangles.len()];
        parallel::fill(&mut corner, |t| {
            let [a, b, c] = triangles[t].map(|v| x[v as usize]);
            let (ab, bc, ca) = (b - a, c - b, a - c);
            let double_area = ab.cross(&bc).norm();
            let mut cot = [-ab.dot(&ca), -bc.dot(&ab), -ca.dot(&bc)].map(|dot| dot / double_area);
            if let Some(factor) = varying.get(t) {
                cot = cot.map(|cot| factor * cot);
            }
            if let Some(fibres) = fibres {
                let added = fibres.weights(t, &[a, b, c], double_area);
                cot.iter_mut().zip(added).for_each(|(cot, added)| *cot += added);
            }
            Corners { cot, third_area: double_area / 6.0 }
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
        sum_at_corners(sheet, |t| corner[t].third_area, &mut self.area);
        // Gershgorin: twice the largest row sum of |w|/A.
        let (weight, area, neighbours) = (&self.weight, &self.area, sheet.vertex_edges());
        self.bound = 2.0
            * parallel::max(sheet.reduction().owned(area.len()), |i| {
                let row: f64 =
                    neighbours.entries(i).iter().map(|&(e, _)| weight[e as usize].abs()).sum();
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
        coefficient: impl Into<FieldValues>,
        measure: Measure,
        frozen: bool,
    ) -> Self {
        Self::build(sheet, species, (coefficient.into(), None), measure, frozen)
    }

    /// With another coefficient along fibres than the one `across`.
    pub(super) fn along(
        sheet: &Sheet,
        species: usize,
        (across, fibres): (&FieldValues, AnisotropicDiffusivity),
        measure: Measure,
        frozen: bool,
    ) -> Self {
        let each = (0..sheet.triangle_count()).map(|t| across.at(t)).collect();
        Self::build(sheet, species, (FieldValues::Each(each), Some(fibres)), measure, frozen)
    }

    fn build(
        sheet: &Sheet,
        species: usize,
        (coefficient, fibres): (FieldValues, Option<AnisotropicDiffusivity>),
        measure: Measure,
        frozen: bool,
    ) -> Self {
        let (coefficient, varying) = match coefficient {
            FieldValues::Same(coefficient) => (coefficient, Vec::new()),
            FieldValues::Each(all) => (1.0, all),
        };
        // Without diffusion nothing needs to follow the shape.
        let frozen = frozen || coefficient == 0.0;
        let amount = measure == Measure::Amount;
        let at_rest = (frozen || amount).then(|| {
            let mut at_rest = CotanOperator::default();
            at_rest.assemble(sheet, sheet.rest(), (&varying, fibres.as_ref()));
            at_rest
        });
        let area = at_rest.as_ref().filter(|_| amount).map(|at_rest| at_rest.area.clone());
        let (rest_area, frozen) = (area.unwrap_or_default(), at_rest.filter(|_| frozen));
        Self {
            species,
            read_species: species,
            coefficient,
            varying,
            fibres,
            measure,
            rest_area,
            frozen,
        }
    }

    /// The same with the gradient of the species `read_species` in place of its own: cross-diffusion.
    #[must_use]
    pub fn reading(self, read_species: usize) -> Self {
        Self { read_species, ..self }
    }

    /// The operator in use where that of the shape is `operator`.
    #[must_use]
    pub fn effective_operator<'a>(&'a self, operator: &'a CotanOperator) -> &'a CotanOperator {
        self.frozen.as_ref().unwrap_or(operator)
    }
}

impl Transport for Cotan {
    type Operator = CotanOperator;

    fn name(&self) -> &'static str {
        if self.read_species == self.species { "diffusion" } else { "cross-diffusion" }
    }

    fn species(&self) -> usize {
        self.species
    }

    fn read_species(&self) -> usize {
        self.read_species
    }

    /// Of fibres the least of D along and across them.
    fn diffusivity(&self) -> Option<FieldValues> {
        let least = |(t, across): (usize, &f64)| {
            across + self.fibres.as_ref().map_or(0.0, |fibres| fibres.excess(t).min(0.0))
        };
        Some(match self.varying.is_empty() {
            true => FieldValues::Same(self.coefficient),
            false => FieldValues::Each(self.varying.iter().enumerate().map(least).collect()),
        })
    }

    fn speed_key(&self) -> &'static str {
        if self.fibres.is_some() { "along" } else { "coefficient" }
    }

    /// Measure and a coefficient that is the same everywhere are not in it.
    fn has_operator_of(&self, other: &Self) -> bool {
        let own = |it: &Self| it.frozen.is_some() || !it.varying.is_empty();
        !own(self) && !own(other)
    }

    fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut CotanOperator) {
        if self.frozen.is_none() {
            operator.assemble(sheet, x, (&self.varying, self.fibres.as_ref()));
        }
    }

    fn add_rate(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &CotanOperator,
        c: &[f64],
        out: &mut [f64],
    ) {
        if self.coefficient == 0.0 {
            return;
        }
        let neighbours = sheet.vertex_edges();
        let CotanOperator { weight, area, .. } = self.effective_operator(operator);
        let rest = &self.rest_area;
        let d = self.coefficient;
        match self.measure {
            Measure::Concentration => parallel::update(out, |i, rate| {
                let flow: f64 = neighbours
                    .entries(i)
                    .iter()
                    .map(|&(e, j)| weight[e as usize] * (c[j as usize] - c[i]))
                    .sum();
                *rate += d * flow / area[i];
            }),
            Measure::Amount => {
                let density = |i: usize| c[i] * rest[i] / area[i];
                parallel::update(out, |i, rate| {
                    let flow: f64 = neighbours
                        .entries(i)
                        .iter()
                        .map(|&(e, j)| weight[e as usize] * (density(j as usize) - density(i)))
                        .sum();
                    *rate += d * flow / rest[i];
                });
            }
        }
    }

    fn spectral_bound(&self, _: (&Sheet, f64), operator: &CotanOperator) -> f64 {
        self.coefficient.abs() * self.effective_operator(operator).bound
    }

    fn entries(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &CotanOperator,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        let CotanOperator { weight, area, .. } = self.effective_operator(operator);
        let neighbours = sheet.vertex_edges();
        for i in 0..sheet.vertex_count() {
            // Rows per area; columns from values to densities.
            let (per, density): (f64, &dyn Fn(usize) -> f64) = match self.measure {
                Measure::Concentration => (area[i], &|_| 1.0),
                Measure::Amount => (self.rest_area[i], &|j| self.rest_area[j] / area[j]),
            };
            let mut diagonal = 0.0;
            for &(e, j) in neighbours.entries(i) {
                let flow = self.coefficient * weight[e as usize] / per;
                emit(i, j as usize, flow * density(j as usize));
                diagonal -= flow;
            }
            emit(i, i, diagonal * density(i));
        }
    }

    fn shape_derivatives(
        &self,
        (sheet, time): (&Sheet, f64),
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
        self.add_rate((sheet, time), operator, c, &mut rate);
        let neighbours = sheet.vertex_edges();
        for (t, triangle) in sheet.triangles().iter().enumerate() {
            let factor = self.varying.get(t).copied().unwrap_or(self.coefficient);
            let v = triangle.map(|v| v as usize);
            let corners = v.map(|v| x[v]);
            let (e, double_area, area_slopes) = edges_and_area(&corners);
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                // cot θ_k drives the flow between the ends of the opposite edge.
                let half = 0.5 * (density(v[j]) - density(v[i]));
                let mut add = |flow: f64, slopes: [Vec3; 3]| {
                    for (m, slope) in slopes.into_iter().enumerate() {
                        emit(v[i], v[m], (flow / per(v[i])) * slope);
                        emit(v[j], v[m], (-flow / per(v[j])) * slope);
                    }
                };
                add(factor * half, cotangent_slopes(&e, double_area, &area_slopes, k));
                if let Some(fibres) = &self.fibres {
                    add(half, fibres.slopes(t, &corners, (double_area, &area_slopes), k));
                }
            }
            // Areas of the vertices: of the row, or of the densities.
            for m in 0..3 {
                let third_slope = area_slopes[m] / 3.0;
                for i in v {
                    if amount {
                        let slope = -density(i) / area[i];
                        let mut own = 0.0;
                        for &(edge, j) in neighbours.entries(i) {
                            let flow = self.coefficient * weight[edge as usize] * slope;
                            emit(j as usize, v[m], (flow / per(j as usize)) * third_slope);
                            own -= flow;
                        }
                        emit(i, v[m], (own / per(i)) * third_slope);
                    } else {
                        emit(i, v[m], (-rate[i] / area[i]) * third_slope);
                    }
                }
            }
        }
    }
}

/// The edges of a triangle, each opposite the corner of its number, twice its area, and the derivatives `½ n × e_m` of its area by
/// the corners.
fn edges_and_area([a, b, d]: &[Vec3; 3]) -> ([Vec3; 3], f64, [Vec3; 3]) {
    let e = [d - b, a - d, b - a];
    let normal = e[0].cross(&e[1]);
    let double_area = normal.norm();
    let normal = normal / double_area;
    (e, double_area, e.map(|e| 0.5 * normal.cross(&e)))
}

/// Derivatives of cot θ_k = -e_i·e_j/2A by the corners of a triangle with the edges `e`, the area `double_area`/2 and the
/// derivatives `area_slopes` of the area.
fn cotangent_slopes(
    e: &[Vec3; 3],
    double_area: f64,
    area_slopes: &[Vec3; 3],
    k: usize,
) -> [Vec3; 3] {
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let cot = -e[i].dot(&e[j]) / double_area;
    std::array::from_fn(|m| {
        let dot_slope = match (m + 3 - k) % 3 {
            // e_i = x_k - x_j, e_j = x_i - x_k.
            0 => e[j] - e[i],
            1 => e[i],
            _ => -e[j],
        };
        -dot_slope / double_area - (2.0 * cot / double_area) * area_slopes[m]
    })
}
