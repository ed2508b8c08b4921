//! Formulas of position and time: `f(x, y, z, t)` at given points, on a sheet also of the distance to its boundary.

use super::graph::Graph;
use super::kinks::Kinks;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Column;
use crate::breakpoints::TimeDependence;
use crate::error::nearest;
use rumple_numerics::Vec3;

/// Inputs of a formula on a sheet, by their numbers.
pub(super) const NAMES: [&str; 5] = ["x", "y", "z", "t", "distance_to_boundary"];
/// The numbers of the time and of the distance among them.
pub(super) const TIME: u32 = 3;
pub(super) const DISTANCE: u32 = 4;

/// The names that a formula can read.
pub(super) fn known_names(
    timed: bool,
    on_sheet: bool,
) -> impl Iterator<Item = &'static str> + Clone {
    let read = move |k: u32| match k {
        TIME => timed,
        DISTANCE => on_sheet,
        _ => true,
    };
    (0..).zip(NAMES).filter(move |(k, _)| read(*k)).map(|(_, name)| name)
}

/// Points with their distances to the boundary of the sheet, which are needed where a formula reads them.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    points: &'a [Vec3],
    distances: &'a [f64],
}

impl<'a, P: AsRef<[Vec3]> + ?Sized> From<&'a P> for Places<'a> {
    fn from(points: &'a P) -> Self {
        Self { points: points.as_ref(), distances: &[] }
    }
}

impl<'a> Places<'a> {
    /// The points with these distances, one each or none at all.
    #[must_use]
    pub fn with_distances(points: &'a [Vec3], distances: &'a [f64]) -> Self {
        Self { points, distances }
    }

    /// Every `step`-th of them.
    #[must_use]
    pub fn some(&self, step: usize) -> (Vec<Vec3>, Vec<f64>) {
        let points = self.points.iter().step_by(step).copied().collect();
        (points, self.distances.iter().step_by(step).copied().collect())
    }

    /// Those of these numbers.
    #[must_use]
    pub fn at(&self, numbers: &[usize]) -> (Vec<Vec3>, Vec<f64>) {
        let distance = |k: &usize| self.distances.get(*k).copied();
        (
            numbers.iter().map(|k| self.points[*k]).collect(),
            numbers.iter().filter_map(distance).collect(),
        )
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// The input of this number at a point; that of the time is of no use.
    fn input(&self, k: usize, point: usize) -> f64 {
        match k {
            0..3 => self.points[point][k],
            _ => self.distances.get(point).copied().unwrap_or(f64::NAN),
        }
    }

    /// The coordinates as inputs.
    pub(super) fn columns(&self) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|k| self.points.iter().map(|point| point[k]).collect())
    }

    /// The distances as an input.
    pub(super) fn distances(&self) -> Column<'a> {
        match self.distances.is_empty() {
            true => Column::uniform(&f64::NAN),
            false => self.distances.into(),
        }
    }
}

/// A formula of the rest position `x`, `y`, `z` and, if it may, the time `t`.
#[derive(Debug, Clone)]
pub struct FieldFormula {
    program: Program,
    /// Its derivative by the time, where it reads that and is not too large.
    slope: Option<Program>,
    kinks: Kinks,
    placed: bool,
    timed: bool,
    distance: bool,
}

impl FieldFormula {
    /// Reads it; `t` is a name if it is `timed`.
    ///
    /// # Errors
    /// If the text is not a formula, or mentions anything else.
    pub fn new(text: &str, timed: bool) -> Result<Self, FormulaError> {
        Self::parse_with(text, timed, false)
    }

    /// Like [`FieldFormula::new`], where `distance_to_boundary` is a name as well.
    ///
    /// # Errors
    /// As for [`FieldFormula::new`].
    pub fn on_sheet(text: &str, timed: bool) -> Result<Self, FormulaError> {
        Self::parse_with(text, timed, true)
    }

    fn parse_with(text: &str, timed: bool, on_sheet: bool) -> Result<Self, FormulaError> {
        let names = known_names(timed, on_sheet);
        let mut graph = Graph::with_budget(text.len());
        let tree = parse::parse(text)?;
        let mut read = [false; NAMES.len()];
        let id = graph.insert(&tree, &mut |graph, name| {
            if name == "pi" {
                return Ok(graph.constant(std::f64::consts::PI));
            }
            if names.clone().any(|known| known == name)
                && let Some(k) = NAMES.iter().position(|known| *known == name)
            {
                read[k] = true;
                return Ok(graph.input(rumple_numerics::num::index(k)));
            }
            let time = if timed { ", t (time)" } else { "" };
            let distance = if on_sheet { ", distance_to_boundary" } else { "" };
            Err(match nearest(name, names.clone()) {
                Some(near) => {
                    let all: Vec<&str> = names.clone().collect();
                    format!("did you mean `{near}`? There are {}, pi", all.join(", "))
                }
                None => format!("there are x, y, z (rest position, length){time}{distance} and pi"),
            })
        })?;
        let [x, y, z, varying, distance] = read;
        let placed = x || y || z || distance;
        let kinks = Kinks::find(&mut graph, &[id], (TIME, !placed), |_| true);
        let slope = varying.then(|| graph.slope(id, TIME).ok()).flatten();
        let slope = slope.map(|slope| Program::new(&graph, &[slope]));
        let program = Program::new(&graph, &[id]);
        Ok(Self { program, slope, kinks, placed, timed: varying, distance })
    }

    /// Whether it reads the position.
    #[must_use]
    pub fn depends_on_position(&self) -> bool {
        self.placed
    }

    /// Whether it reads the distance to the boundary.
    #[must_use]
    pub fn depends_on_distance(&self) -> bool {
        self.distance
    }

    /// Whether it reads the time.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        self.timed
    }

    /// Whether it has derivatives by the time: it is not too large for them.
    #[must_use]
    pub fn is_differentiable(&self) -> bool {
        !self.timed || self.slope.is_some()
    }

    /// Adds the times from 0 to `until` at which it has a kink or a jump at some of `points`, and its course between
    /// these; whether they are all.
    pub fn time_dependence<'a>(
        &self,
        places: impl Into<Places<'a>>,
        until: f64,
        found: &mut TimeDependence,
    ) -> bool {
        let places = places.into();
        self.kinks.at_points(until, places.len(), |k, point| places.input(k, point), found)
    }

    /// Its values at all points.
    #[must_use]
    pub fn evaluate<'a>(&self, places: impl Into<Places<'a>>, time: f64) -> Vec<f64> {
        run(&self.program, places.into(), time)
    }

    /// Its derivatives by the time at all points, per unit of time; `None` if it does not read the time, or is too large.
    #[must_use]
    pub fn time_slopes<'a>(&self, places: impl Into<Places<'a>>, time: f64) -> Option<Vec<f64>> {
        self.slope.as_ref().map(|slope| run(slope, places.into(), time))
    }
}

fn run(program: &Program, places: Places<'_>, time: f64) -> Vec<f64> {
    let columns = places.columns();
    let mut inputs: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
    inputs.extend([Column::uniform(&time), places.distances()]);
    let mut values = vec![0.0; places.len()];
    program.run(&inputs, places.len(), &mut [&mut values]);
    values
}

/// Adds what [`FieldFormula::time_dependence`] does, of a formula that reads other names as well: of its parts that read
/// none of these.
pub fn time_dependence<'a>(
    text: &str,
    places: impl Into<Places<'a>>,
    until: f64,
    found: &mut TimeDependence,
) {
    let places = places.into();
    let mut graph = Graph::with_budget(text.len());
    let Ok(tree) = parse::parse(text) else { return };
    let id = graph.insert(&tree, &mut |graph, name| {
        let known = NAMES.iter().position(|known| *known == name).unwrap_or(NAMES.len());
        Ok(match name {
            "pi" => graph.constant(std::f64::consts::PI),
            _ => graph.input(rumple_numerics::num::index(known)),
        })
    });
    if let Ok(id) = id {
        let fixed = |input| input < TIME || input == DISTANCE;
        let kinks = Kinks::find(&mut graph, &[id], (TIME, false), fixed);
        kinks.at_points(until, places.len(), |k, point| places.input(k, point), found);
    }
}
