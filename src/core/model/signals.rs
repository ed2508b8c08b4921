//! Signals: what kinetics may read of the shape, at the points where species live.
//!
//! ```text
//! mean_curvature      H          1/length      > 0 at the top of a bump towards the normal
//! gaussian_curvature  K          1/length²
//! area_strain         A/Ā - 1    elastic: current over optimal area
//! area_ratio          A/A⁰       current over rest area, growth included
//! tension             σ          force/length, by one of three readings of the mean strain ē
//! position, normal    x, n       three columns each
//! contact_pressure    |f|/A      force/length²: f the force of contacts on a vertex, A a third of the current areas around
//! time                t
//! ```
//!
//! At the boundary curvatures are 0, or one-sided: extrapolated from within ([`BoundaryFit`]).
//! Curvatures belong to vertices, strains to faces. On vertices a strain is the mean over the
//! adjacent faces; on faces a curvature is the mean of the three corners.
//!
//! Readings of the tension, with `ē = mean(A_j/Ā_j - 1)`: `trace`, `σ_αα = Y/(1-ν) ē`, the trace of
//! the stress of an isotropic strain; `mean`, `Y ē`; `paper`, the printed `(Y/3) Σ_j (A_j/Ā_j - 1)`
//! over the adjacent triangles, `2Y ē` where six meet (and on faces). Where Y differs from triangle to triangle, each
//! strain is multiplied by that of its triangle.

mod derivatives;
#[cfg(test)]
mod tests;

pub(crate) use derivatives::Derivatives;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::potential::Potential;
use crate::Vec3;
use crate::effects::{FieldValues, MaterialField};
use crate::geometry::{BoundaryFit, Curvature, Shape, VertexArea};
use crate::kinetics::{Location, Signal};
use crate::num::real;
use crate::parallel;
use crate::sheet::Sheet;
use crate::tally::{Meter, Scope, Tally};

/// How tension is read off the area strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TensionReading {
    /// `Y/(1-ν)` times the mean strain.
    #[default]
    Trace,
    /// `Y` times the mean strain.
    Mean,
    /// `Y/3` times the sum over adjacent triangles, as printed.
    Paper,
}

/// Curvatures at the boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AtBoundary {
    /// 0, as in the paper.
    #[default]
    Zero,
    /// From those within, by a linear function.
    OneSided,
}

/// Evaluates signals on one sheet.
#[derive(Debug, Clone)]
pub struct Signals {
    wanted: Vec<Signal>,
    location: Location,
    area: VertexArea,
    /// Y of the triangles.
    modulus: FieldValues,
    /// Y/(1-ν) of the triangles.
    areal_modulus: FieldValues,
    reading: TensionReading,
    rest_area: Arc<[f64]>,
    /// What gives curvatures at the boundary, if they are not 0.
    fit: Option<Arc<BoundaryFit>>,
    planar: bool,
    /// Of the geometry that curvatures share, then one for each signal; none of signals that are not counted.
    meters: Vec<Meter>,
}

impl Signals {
    /// Prepares the `wanted` signals, in that order.
    #[must_use]
    pub fn new(
        wanted: Vec<Signal>,
        location: Location,
        area: VertexArea,
        material: Option<&MaterialField>,
        reading: TensionReading,
        rest_area: impl Into<Arc<[f64]>>,
    ) -> Self {
        Self {
            wanted,
            location,
            area,
            // Of use to the tension alone, which is refused without a material.
            modulus: material.map_or(FieldValues::Same(0.0), MaterialField::stretching_modulus),
            areal_modulus: material.map_or(FieldValues::Same(0.0), |material| {
                material.per_triangle(|m| m.stretching_modulus() / (1.0 - m.poisson))
            }),
            reading,
            rest_area: rest_area.into(),
            fit: None,
            planar: false,
            meters: Vec::new(),
        }
    }

    /// The same for a sheet that stays in a plane: its curvatures are 0 and are not computed.
    #[must_use]
    pub fn in_plane(self, planar: bool) -> Self {
        Self { planar, ..self }
    }

    /// The same with curvatures at the boundary of `sheet` by a rule. A sheet over ranks has only 0.
    #[must_use]
    pub fn with_boundary(self, rule: AtBoundary, sheet: &Sheet) -> Self {
        let fitted = rule == AtBoundary::OneSided
            && self.reads_curvature()
            && sheet.reduction().ranks().is_none();
        Self { fit: fitted.then(|| Arc::new(BoundaryFit::new(sheet))), ..self }
    }

    /// Whether curvatures are wanted and can be different from 0.
    fn reads_curvature(&self) -> bool {
        let curved = |s: &Signal| matches!(s, Signal::MeanCurvature | Signal::GaussianCurvature);
        !self.planar && self.wanted.iter().any(curved)
    }

    /// Counts what they cost from now on.
    pub(super) fn count_with(&mut self, tally: &Tally) {
        let each = self.wanted.iter().map(|signal| tally.meter("signal", signal.name()));
        // The geometry that several signals share.
        let curvature = tally.meter("signal", "curvature of the sheet");
        self.meters = std::iter::once(curvature).chain(each).collect();
    }

    /// The scope of meter number k.
    fn scope(&self, k: usize, what: &'static str) -> Option<Scope> {
        self.meters.get(k).map(|meter| meter.scope(what))
    }

    /// The curvatures, where they are wanted and can be different from 0.
    fn curvature(&self, shape: &Shape<'_>, what: &'static str) -> Option<Curvature> {
        self.reads_curvature().then(|| {
            let _scope = self.scope(0, what);
            let mut curvature = Curvature::evaluate(shape, &self.area);
            if let Some(fit) = &self.fit {
                let mut both = [&mut curvature.mean, &mut curvature.gaussian].map(std::mem::take);
                both.iter_mut().for_each(|values| fit.extend(values));
                shape.sheet.reduction().update_ghost_columns(&mut both);
                [curvature.mean, curvature.gaussian] = both;
            }
            curvature
        })
    }

    /// The signals evaluated.
    #[must_use]
    pub fn wanted(&self) -> &[Signal] {
        &self.wanted
    }

    /// The columns of all wanted signals at `x`: one value a point, vectors as three columns,
    /// time as a column of one value.
    #[must_use]
    pub fn evaluate(&self, potential: &mut Potential, x: &[Vec3], time: f64) -> Vec<Vec<f64>> {
        let mut columns = Vec::new();
        self.update(potential, (x, time), &mut columns);
        columns
    }

    /// [`Signals::evaluate`] in place of the columns of another shape.
    pub(super) fn update(
        &self,
        potential: &mut Potential,
        (x, time): (&[Vec3], f64),
        columns: &mut Vec<Vec<f64>>,
    ) {
        let touches = self.wanted.contains(&Signal::ContactPressure);
        let pressure = if touches { potential.contact_pressure(x) } else { Vec::new() };
        let shape = &potential.shape(x);
        let count = self.wanted.iter().map(|signal| signal.columns().len()).sum();
        let mut before = std::mem::replace(columns, Vec::with_capacity(count)).into_iter();
        let curvature = self.curvature(shape, "values");
        for (k, signal) in self.wanted.iter().enumerate() {
            let _scope = self.scope(k + 1, "values");
            // Where they are counted they are freed.
            before.by_ref().take(signal.columns().len()).for_each(drop);
            match (signal, &curvature) {
                (Signal::MeanCurvature, Some(c)) => {
                    columns.push(self.carry_vertices(shape, &c.mean))
                }
                (Signal::GaussianCurvature, Some(c)) => {
                    columns.push(self.carry_vertices(shape, &c.gaussian));
                }
                (Signal::Time, _) => columns.push(vec![time]),
                (Signal::Position, _) => columns.extend(self.positions(shape)),
                (Signal::Normal, _) => columns.extend(self.normals(shape)),
                (Signal::AreaRatio, _) => {
                    let ratio = |t: usize| shape.face(t).area / self.rest_area[t];
                    columns.push(self.carry_faces(shape, ratio));
                }
                (Signal::AreaStrain, _) => columns.push(self.carry_faces(shape, strain(shape))),
                (Signal::Tension, _) => columns.push(self.tension(shape)),
                (Signal::ContactPressure, _) => columns.push(self.carry_vertices(shape, &pressure)),
                // Curvature is evaluated whenever it is wanted and can be different from 0.
                (_, None) => columns.push(vec![0.0; self.points(shape)]),
            }
        }
        self.free(curvature);
    }

    /// Frees the curvatures where they are counted.
    fn free(&self, curvature: Option<Curvature>) {
        if let Some(curvature) = curvature {
            let _scope = self.meters.first().map(Meter::uncounted_scope);
            drop(curvature);
        }
    }

    fn points(&self, shape: &Shape<'_>) -> usize {
        match self.location {
            Location::Vertex => shape.sheet.vertex_count(),
            Location::Face | Location::Edge => shape.sheet.triangle_count(),
        }
    }

    fn filled(&self, shape: &Shape<'_>, f: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let mut column = vec![0.0; self.points(shape)];
        parallel::fill(&mut column, f);
        column
    }

    fn carry_vertices(&self, shape: &Shape<'_>, value: &[f64]) -> Vec<f64> {
        match self.location {
            Location::Vertex => value.to_vec(),
            Location::Face | Location::Edge => {
                let triangles = shape.sheet.triangles();
                self.filled(shape, |t| {
                    let [a, b, c] = triangles[t].map(|v| value[v as usize]);
                    (a + b + c) / 3.0
                })
            }
        }
    }

    fn carry_faces(&self, shape: &Shape<'_>, value: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        match self.location {
            Location::Face | Location::Edge => self.filled(shape, value),
            Location::Vertex => {
                let incident = shape.sheet.vertex_triangles();
                self.filled(shape, |i| {
                    let around = incident.entries(i);
                    let sum: f64 = around.iter().map(|&(t, _)| value(t as usize)).sum();
                    sum / real(around.len())
                })
            }
        }
    }

    fn tension(&self, shape: &Shape<'_>) -> Vec<f64> {
        let strain = strain(shape);
        let modulus = &self.modulus;
        match (self.reading, self.location) {
            (TensionReading::Trace, _) => {
                self.carry_faces(shape, |t| self.areal_modulus.at(t) * strain(t))
            }
            (TensionReading::Mean, _) => self.carry_faces(shape, |t| modulus.at(t) * strain(t)),
            (TensionReading::Paper, Location::Face | Location::Edge) => {
                self.filled(shape, |t| 2.0 * modulus.at(t) * strain(t))
            }
            (TensionReading::Paper, Location::Vertex) => {
                let incident = shape.sheet.vertex_triangles();
                self.filled(shape, |i| {
                    let around = incident.entries(i).iter().map(|&(t, _)| t as usize);
                    match modulus {
                        FieldValues::Same(modulus) => {
                            modulus / 3.0 * around.map(&strain).sum::<f64>()
                        }
                        FieldValues::Each(of) => around.map(|t| of[t] / 3.0 * strain(t)).sum(),
                    }
                })
            }
        }
    }

    fn positions(&self, shape: &Shape<'_>) -> [Vec<f64>; 3] {
        std::array::from_fn(|axis| {
            let at: Vec<f64> = shape.x.iter().map(|x| x[axis]).collect();
            self.carry_vertices(shape, &at)
        })
    }

    fn normals(&self, shape: &Shape<'_>) -> [Vec<f64>; 3] {
        let mut normal = vec![Vec3::zeros(); self.points(shape)];
        parallel::fill(&mut normal, |i| match self.location {
            Location::Face | Location::Edge => shape.face(i).normal,
            Location::Vertex => {
                let around = shape.sheet.vertex_triangles().entries(i).iter();
                let faces = around.map(|&(t, _)| shape.face(t as usize));
                faces.map(|f| f.area * f.normal).sum::<Vec3>().normalize()
            }
        });
        std::array::from_fn(|axis| normal.iter().map(|n| n[axis]).collect())
    }
}

/// `A/Ā - 1` of every triangle.
fn strain<'a>(shape: &'a Shape<'_>) -> impl Fn(usize) -> f64 + Sync + 'a {
    |t| shape.face(t).area / shape.metric.area()[t] - 1.0
}
