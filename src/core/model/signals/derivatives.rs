//! Derivatives of the signals by positions and by optimal lengths.
//!
//! With `L_i`, `A_i`, `Θ_i` as for the curvatures and `u = ±L_i/|L_i|` (the normal where L = 0),
//!
//! ```text
//! ∂H_i/∂x_m = u·∂L_i/∂x_m/(4A_i) - H_i/A_i ∂A_i/∂x_m
//! ∂L_i/∂x_m = Σ_T (e_i·e_m)/(2A_T) n nᵀ + s_im [n]×        s = 1 for m before i, -1 after, else 0
//! ∂K_i/∂x_m = -(∂Θ_i/∂x_m + K_i ∂A_i/∂x_m)/A_i
//! ∂(A_T/Ā_T)/∂x_m = ½ n × e_m/Ā_T,   ∂(A_T/Ā_T)/∂l̄_e = -A_T/Ā_T² ∂Ā_T/∂l̄_e
//! ```

use super::{Signals, TensionReading};
use crate::Vec3;
use crate::geometry::{Curvature, Shape};
use crate::kinetics::{Location, Signal};
use crate::num::real;

/// Takes derivatives: (signal column, point, by what).
pub(crate) trait Derivatives {
    /// By the position of a vertex.
    fn by_position(&mut self, column: usize, point: usize, vertex: usize, value: Vec3);
    /// By the optimal length of an edge.
    fn by_length(&mut self, column: usize, point: usize, edge: usize, value: f64);
}

impl Signals {
    /// Hands all derivatives that can be different from zero to `into`, in an order that depends on
    /// the sheet alone; a pair may come more than once, and then counts as the sum.
    pub(crate) fn derivatives(&self, shape: &Shape<'_>, into: &mut impl Derivatives) {
        let curvature = self.curvature(shape, "derivatives");
        let mut column = 0;
        for (k, signal) in self.wanted.iter().enumerate() {
            let _scope = self.scope(k + 1, "derivatives");
            match signal {
                // Who solves with derivatives refuses a law that reads the pressure of contact.
                Signal::ContactPressure | Signal::Time => {}
                Signal::MeanCurvature | Signal::GaussianCurvature => {
                    if let Some(curvature) = &curvature {
                        let mean = *signal == Signal::MeanCurvature;
                        self.curvatures(shape, curvature, mean, column, into);
                    }
                }
                Signal::AreaStrain => self.strains(shape, |_, _| 1.0, column, into),
                Signal::Tension => {
                    let factor = self.tension_factor(shape);
                    self.strains(shape, factor, column, into);
                }
                Signal::AreaRatio => self.ratios(shape, column, into),
                Signal::Position => self.at_vertices(shape, |point, vertex, share| {
                    for axis in 0..3 {
                        let mut unit = Vec3::zeros();
                        unit[axis] = share;
                        into.by_position(column + axis, point, vertex, unit);
                    }
                }),
                Signal::Normal => self.normal_derivatives(shape, column, into),
            }
            column += signal.columns().len();
        }
        self.free(curvature);
    }

    /// Which vertices' values a point takes, with their shares.
    fn at_vertices(&self, shape: &Shape<'_>, mut each: impl FnMut(usize, usize, f64)) {
        match self.location {
            Location::Vertex => (0..shape.sheet.vertex_count()).for_each(|i| each(i, i, 1.0)),
            Location::Face | Location::Edge => {
                for (t, corners) in shape.sheet.triangles().iter().enumerate() {
                    for v in corners {
                        each(t, *v as usize, 1.0 / 3.0);
                    }
                }
            }
        }
    }

    /// Which faces' values a point takes, with their shares.
    fn at_faces(&self, shape: &Shape<'_>, mut each: impl FnMut(usize, usize, f64)) {
        match self.location {
            Location::Face | Location::Edge => {
                (0..shape.sheet.triangle_count()).for_each(|t| each(t, t, 1.0));
            }
            Location::Vertex => {
                for i in 0..shape.sheet.vertex_count() {
                    let around = shape.sheet.vertex_triangles().entries(i);
                    for &(t, _) in around {
                        each(i, t as usize, 1.0 / real(around.len()));
                    }
                }
            }
        }
    }

    fn curvatures(
        &self,
        shape: &Shape<'_>,
        curvature: &Curvature,
        mean: bool,
        column: usize,
        into: &mut impl Derivatives,
    ) {
        let boundary = shape.sheet.boundary();
        self.at_vertices(shape, |point, i, share| {
            let mut add = |i: usize, share: f64| {
                self.curvature_at(shape, (curvature, mean), i, |vertex, by| {
                    into.by_position(column, point, vertex, share * by);
                });
            };
            match &self.fit {
                _ if !boundary[i] => add(i, share),
                Some(fit) => {
                    // An image has the value of its owner, and moves as it does.
                    let weights = fit.weights(shape.sheet.number(i) as usize);
                    weights.iter().for_each(|(j, weight)| add(*j, weight * share));
                }
                None => {}
            }
        });
    }

    /// The derivatives of H, or of K, at the interior vertex `i`.
    fn curvature_at(
        &self,
        shape: &Shape<'_>,
        (curvature, mean): (&Curvature, bool),
        i: usize,
        mut emit: impl FnMut(usize, Vec3),
    ) {
        let direction = if mean { leaning(shape, i) } else { Vec3::zeros() };
        let area = curvature.area[i];
        for &(t, k) in shape.sheet.vertex_triangles().entries(i) {
            let (t, k) = (t as usize, k as usize);
            let e = shape.edge_vectors(t);
            let face = shape.face(t);
            let n = face.normal;
            let mut by_area = [Vec3::zeros(); 3];
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            self.area.add_gradient(shape, t, unit, &mut by_area);
            let by = if mean {
                let lean = direction.dot(&n) / (2.0 * face.area);
                let turn = direction.cross(&n);
                let signs = [0.0, -1.0, 1.0];
                std::array::from_fn::<Vec3, 3, _>(|m| {
                    let by_l = (lean * e[k].dot(&e[m])) * n + signs[(m + 3 - k) % 3] * turn;
                    0.25 * by_l - curvature.mean[i] * by_area[m]
                })
            } else {
                let (u, w) = (e[(k + 2) % 3], -e[(k + 1) % 3]);
                let by_next = (-1.0 / u.norm_squared()) * n.cross(&u);
                let by_last = (1.0 / w.norm_squared()) * n.cross(&w);
                let by_angle = [-(by_next + by_last), by_next, by_last];
                std::array::from_fn(|m| {
                    -(by_angle[(m + 3 - k) % 3] + curvature.gaussian[i] * by_area[m])
                })
            };
            for (v, by) in shape.sheet.triangles()[t].into_iter().zip(by) {
                emit(v as usize, by / area);
            }
        }
    }

    /// The strain `A/Ā - 1`, times `factor` of each point and triangle.
    fn strains(
        &self,
        shape: &Shape<'_>,
        factor: impl Fn(usize, usize) -> f64,
        column: usize,
        into: &mut impl Derivatives,
    ) {
        self.at_faces(shape, |point, t, share| {
            let face = shape.face(t);
            let optimal = shape.metric.area()[t];
            let share = share * factor(point, t);
            let e = shape.edge_vectors(t);
            for (m, v) in shape.sheet.triangles()[t].into_iter().enumerate() {
                let by = (0.5 * share / optimal) * face.normal.cross(&e[m]);
                into.by_position(column, point, v as usize, by);
            }
            let by_length = shape.metric.area_gradient(shape.sheet, t);
            for (e, slope) in shape.sheet.triangle_edges()[t].into_iter().zip(by_length) {
                let by = -share * face.area / (optimal * optimal) * slope;
                into.by_length(column, point, e as usize, by);
            }
        });
    }

    /// The tension at a point over the mean strain there: the share of a triangle.
    fn tension_factor<'a>(&'a self, shape: &'a Shape<'_>) -> impl Fn(usize, usize) -> f64 + 'a {
        let (modulus, areal, location) = (&self.modulus, &self.areal_modulus, self.location);
        let reading = self.reading;
        move |point, t| match (reading, location) {
            (TensionReading::Trace, _) => areal.at(t),
            (TensionReading::Mean, _) => modulus.at(t),
            (TensionReading::Paper, Location::Face | Location::Edge) => 2.0 * modulus.at(t),
            (TensionReading::Paper, Location::Vertex) => {
                modulus.at(t) / 3.0 * real(shape.sheet.vertex_triangles().entries(point).len())
            }
        }
    }

    fn ratios(&self, shape: &Shape<'_>, column: usize, into: &mut impl Derivatives) {
        self.at_faces(shape, |point, t, share| {
            let normal = shape.face(t).normal;
            let e = shape.edge_vectors(t);
            for (m, v) in shape.sheet.triangles()[t].into_iter().enumerate() {
                let by = (0.5 * share / self.rest_area[t]) * normal.cross(&e[m]);
                into.by_position(column, point, v as usize, by);
            }
        });
    }

    /// On faces `∂n = (1 - n nᵀ) Σ_m (e_m × ∂x_m)/2A`; on vertices the sum of `n A` over the faces,
    /// normalised.
    fn normal_derivatives(&self, shape: &Shape<'_>, column: usize, into: &mut impl Derivatives) {
        let mut emit = |point: usize, normal: Vec3, size: f64, t: usize| {
            let e = shape.edge_vectors(t);
            for (m, v) in shape.sheet.triangles()[t].into_iter().enumerate() {
                for axis in 0..3 {
                    let mut across = -normal[axis] * normal;
                    across[axis] += 1.0;
                    // across · (e_m × δ) = (across × e_m) · δ
                    let by = across.cross(&e[m]) / size;
                    into.by_position(column + axis, point, v as usize, by);
                }
            }
        };
        match self.location {
            Location::Face | Location::Edge => {
                for t in 0..shape.sheet.triangle_count() {
                    let face = shape.face(t);
                    emit(t, face.normal, 2.0 * face.area, t);
                }
            }
            Location::Vertex => {
                for i in 0..shape.sheet.vertex_count() {
                    let around = shape.sheet.vertex_triangles().entries(i);
                    let sum: Vec3 = around
                        .iter()
                        .map(|&(t, _)| shape.face(t as usize))
                        .map(|f| (2.0 * f.area) * f.normal)
                        .sum();
                    let size = sum.norm();
                    for &(t, _) in around {
                        emit(i, sum / size, size, t as usize);
                    }
                }
            }
        }
    }
}

/// `∂|H A|` direction at vertex `i`: ±L/|L| with the sign of H, or the normal where L = 0.
fn leaning(shape: &Shape<'_>, i: usize) -> Vec3 {
    let (mut l, mut normal) = (Vec3::zeros(), Vec3::zeros());
    for &(t, k) in shape.sheet.vertex_triangles().entries(i) {
        let face = shape.face(t as usize);
        l += face.normal.cross(&shape.edge_vectors(t as usize)[k as usize]);
        normal += face.area * face.normal;
    }
    let size = l.norm();
    if size > 0.0 { l / size.copysign(l.dot(&normal)) } else { normal.normalize() }
}
