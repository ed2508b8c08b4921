//! Measures J of an equilibrium, with their derivatives by shape and species.
//!
//! ```text
//! energy                  U                                        of all effects, energy
//! volume                  enclosed by a closed sheet               length³
//! integral(f)             Σ_i A⁰_i f_i,  A⁰ rest areas             f a formula of x, y, z (rest position), t, distance_to_boundary,
//! mean(f)                 the same over the area of the sheet      species, and ux, uy, uz (displacement)
//! shape(FILE)             A⁰/2n Σ_i |x_i - R y_i - t|²             y the n points of a mesh file, R and t the best rigid motion;
//!                                                                  none where something holds the sheet
//! 0.5*mean(uz)            times a number
//! ```
//!
//! f is that of the vertices or, where species live there, of the triangles: at the centroid, with the mean displacement of the
//! corners. At the best motion the derivatives of the distance by R and t are 0 (envelope theorem).

use std::borrow::Cow;
use std::path::PathBuf;

use crate::Vec3;
use crate::geometry::{self, aligned, lumped_areas};
use crate::kinetics::Location;
use crate::kinetics::formula::{Places, SpeciesFormula};
use crate::model::{EvaluationBuffers, Model, State};
use crate::num::real;
use crate::run::{Error, Result};
use crate::sheet::{self, Sheet};
use crate::solve::continuation::Unknowns;

/// Displacements by the names that formulas have for them.
const DISPLACEMENT: [&str; 3] = ["ux", "uy", "uz"];
/// Rigid motions of a free sheet.
const RIGID_MOTIONS: usize = 6;

/// A measure with its weight.
#[derive(Debug, Clone)]
pub struct Measure {
    weight: f64,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Energy,
    Volume,
    Integral { formula: Box<SpeciesFormula>, mean: bool },
    Shape { target: Vec<Vec3> },
}

impl Measure {
    /// Reads it for `model`; errors begin with `origin`.
    ///
    /// # Errors
    /// An unknown measure, a formula with unknown names, a file that does not fit.
    pub(crate) fn parse(origin: &str, text: &str, model: &Model) -> Result<Self> {
        let refuse = |message: String| Err(Error::Refused(format!("{origin} {text}: {message}")));
        let (weight, rest) = match text.split_once('*') {
            Some((number, rest)) if number.trim().parse::<f64>().is_ok_and(f64::is_finite) => {
                (number.trim().parse().unwrap_or(1.0), rest.trim())
            }
            _ => (1.0, text.trim()),
        };
        let call = rest.strip_suffix(')').and_then(|rest| rest.split_once('('));
        let kind = match (rest, call) {
            ("energy", _) => Kind::Energy,
            ("volume", _) if model.sheet().boundary().contains(&true) => {
                return refuse("the sheet has a boundary and encloses no volume".to_owned());
            }
            ("volume", _) => Kind::Volume,
            (_, Some((name @ ("integral" | "mean"), formula))) => {
                let known: Vec<&str> =
                    DISPLACEMENT.into_iter().chain(species_names(model)).collect();
                let formula = match SpeciesFormula::new(formula, &known, true) {
                    Ok(formula) => Box::new(formula),
                    Err(error) => {
                        let help = error.help.map(|help| format!("; {help}")).unwrap_or_default();
                        return refuse(format!("{}{help}", error.message));
                    }
                };
                Kind::Integral { formula, mean: name == "mean" }
            }
            (_, Some(("shape", file))) => {
                let surface = sheet::read::surface(PathBuf::from(file.trim()))?;
                let (given, needed) = (surface.points.len(), model.sheet().vertex_count());
                if given != needed {
                    return refuse(format!(
                        "the target has {given} points and the sheet {needed} vertices: they correspond one by one"
                    ));
                }
                Kind::Shape { target: surface.points }
            }
            _ => {
                let known = "energy, volume, integral(FORMULA), mean(FORMULA) or shape(FILE), with a number and * before it";
                return refuse(format!("expected {known}"));
            }
        };
        Ok(Self { weight, kind })
    }

    /// Whether it is a sum over the sheet of what depends on parameters place by place: then its derivatives by fields are known.
    pub(super) fn is_local(&self) -> bool {
        !matches!(self.kind, Kind::Energy)
    }

    /// J.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(crate) fn value(&self, model: &Model, state: &State) -> Result<f64> {
        let sheet = model.sheet();
        let value = match &self.kind {
            Kind::Energy => {
                let mut memory = EvaluationBuffers::default();
                let mut at = model.at(state, &mut memory);
                at.potential()?.energy(&state.x)
            }
            Kind::Volume => geometry::volume(sheet, &state.x, state.x[0]),
            Kind::Integral { .. } => {
                return Ok(self.parts(model, state).into_iter().flatten().sum());
            }
            Kind::Shape { target } => {
                let gaps = gaps(model, target, &state.x);
                0.5 * mean_area(sheet) * gaps.iter().map(Vec3::norm_squared).sum::<f64>()
            }
        };
        Ok(self.weight * value)
    }

    /// The values of the formula of an integral at the points of the law, or at the vertices without one.
    pub(crate) fn field(&self, model: &Model, state: &State) -> Option<Vec<f64>> {
        let Kind::Integral { formula, .. } = &self.kind else { return None };
        let points = Points::new(model, state);
        Some(formula.evaluate(points.places(), state.time, |s| points.column(s, state)))
    }

    /// The share of every point of the law, or every vertex without one, in an integral; none of other measures, which depend on
    /// parameters by the state alone.
    pub(super) fn parts(&self, model: &Model, state: &State) -> Option<Vec<f64>> {
        let Kind::Integral { formula, .. } = &self.kind else { return None };
        let points = Points::new(model, state);
        let values = formula.evaluate(points.places(), state.time, |s| points.column(s, state));
        let weights = self.weights(model, &points);
        Some(values.iter().zip(weights).map(|(value, weight)| weight * value).collect())
    }

    /// The weight of every point in an integral.
    fn weights(&self, model: &Model, points: &Points) -> Vec<f64> {
        let Kind::Integral { mean, .. } = &self.kind else { return Vec::new() };
        let whole = if *mean { geometry::area(model.sheet(), model.sheet().rest()) } else { 1.0 };
        points.area.iter().map(|area| self.weight * area / whole).collect()
    }

    /// ∂J/∂x and ∂J/∂c.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn slope(&self, model: &Model, state: &State) -> Result<Unknowns> {
        let mut x = vec![Vec3::zeros(); state.x.len()];
        let zeros = |values: &Vec<f64>| vec![0.0; values.len()];
        let mut species: Vec<Vec<f64>> = state.species.iter().map(zeros).collect();
        match &self.kind {
            Kind::Energy => {
                let mut memory = EvaluationBuffers::default();
                let mut at = model.at(state, &mut memory);
                at.potential()?.energy_gradient(&state.x, &mut x);
                x.iter_mut().for_each(|v| *v *= self.weight);
            }
            Kind::Volume => {
                let origin = state.x[0];
                for corners in model.sheet().triangles() {
                    let [a, b, c] = corners.map(|v| state.x[v as usize] - origin);
                    let opposite = [b.cross(&c), c.cross(&a), a.cross(&b)];
                    for (v, opposite) in corners.iter().zip(opposite) {
                        x[*v as usize] += self.weight / 6.0 * opposite;
                    }
                }
            }
            Kind::Integral { formula, .. } => {
                let points = Points::new(model, state);
                let slopes =
                    formula.slopes(points.places(), state.time, |s| points.column(s, state));
                let weights = self.weights(model, &points);
                for (number, slope) in formula.species().iter().zip(slopes) {
                    let of_points =
                        slope.iter().zip(&weights).map(|(slope, weight)| slope * weight);
                    match number.checked_sub(DISPLACEMENT.len()) {
                        Some(s) => species[s] = of_points.collect(),
                        None => {
                            let add = |(i, share)| {
                                points.spread(model.sheet(), (i, share), |v, share| {
                                    x[v][*number] += share
                                })
                            };
                            of_points.enumerate().for_each(add);
                        }
                    }
                }
            }
            Kind::Shape { target } => {
                let factor = self.weight * mean_area(model.sheet());
                x = gaps(model, target, &state.x).into_iter().map(|gap| factor * gap).collect();
            }
        }
        Ok(Unknowns { x, species })
    }
}

/// Where formulas are evaluated: the points of the law, or the vertices without one.
struct Points<'a> {
    at: Cow<'a, [Vec3]>,
    distance: &'a [f64],
    /// Components of the displacement.
    displacement: [Vec<f64>; 3],
    /// Rest areas.
    area: Vec<f64>,
    on_triangles: bool,
}

impl<'a> Points<'a> {
    fn new(model: &'a Model, state: &State) -> Self {
        let sheet = model.sheet();
        let law = model.chemistry().map(|chemistry| chemistry.location());
        let on_triangles = law.is_some_and(|location| location != Location::Vertex);
        let moved: Vec<Vec3> = state.x.iter().zip(sheet.rest()).map(|(x, rest)| x - rest).collect();
        let moved = match on_triangles {
            false => moved,
            true => {
                let mean = |corners: &[u32; 3]| {
                    corners.map(|v| moved[v as usize]).iter().sum::<Vec3>() / 3.0
                };
                sheet.triangles().iter().map(mean).collect()
            }
        };
        let area = match on_triangles {
            false => lumped_areas(sheet),
            true => geometry::face_areas(sheet, sheet.rest()),
        };
        let at = match on_triangles {
            true => Cow::Owned(sheet.triangle_places()),
            false => Cow::Borrowed(sheet.places()),
        };
        let distance = sheet.distances_to_boundary(on_triangles).unwrap_or_default();
        let displacement = [0, 1, 2].map(|axis| moved.iter().map(|u| u[axis]).collect());
        Self { at, distance, displacement, area, on_triangles }
    }

    fn places(&self) -> Places<'_> {
        Places::with_distances(&self.at, self.distance)
    }

    /// The values of a displacement or a species by its number in formulas.
    fn column<'s>(&'s self, number: usize, state: &'s State) -> &'s [f64] {
        match number.checked_sub(DISPLACEMENT.len()) {
            Some(s) => &state.species[s],
            None => &self.displacement[number],
        }
    }

    /// Gives the share of a point to the vertices of which its displacement is the mean.
    fn spread(&self, sheet: &Sheet, (point, share): (usize, f64), mut add: impl FnMut(usize, f64)) {
        match self.on_triangles {
            false => add(point, share),
            true => sheet.triangles()[point].iter().for_each(|v| add(*v as usize, share / 3.0)),
        }
    }
}

/// Distance of every vertex from its target, which is moved nearest to `x` first where the sheet is free to move.
fn gaps(model: &Model, target: &[Vec3], x: &[Vec3]) -> Vec<Vec3> {
    let free = model.mechanics().free_motions() == RIGID_MOTIONS;
    let moved = if free { aligned(target, x) } else { target.to_vec() };
    x.iter().zip(moved).map(|(x, y)| x - y).collect()
}

/// Rest area of the sheet over the number of its vertices.
fn mean_area(sheet: &Sheet) -> f64 {
    geometry::area(sheet, sheet.rest()) / real(sheet.vertex_count().max(1))
}

/// The names of the species.
pub(super) fn species_names(model: &Model) -> Vec<&str> {
    let descriptor = model.chemistry().map(|chemistry| chemistry.descriptor());
    descriptor.into_iter().flat_map(|d| &d.species).map(|species| species.name.as_str()).collect()
}
