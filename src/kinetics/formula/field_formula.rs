//! Formulas of position and time: `f(x, y, z, t)` at given points.

use super::graph::Graph;
use super::kinks::Kinks;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Column;
use crate::breakpoints::TimeDependence;
use crate::error::nearest;
use rumple_numerics::Vec3;

/// The names of the rest position.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Inputs of a [`FieldFormula`].
pub(super) const NAMES: [&str; 4] = ["x", "y", "z", "t"];
/// The number of the time among them.
pub(super) const TIME: u32 = 3;

/// A formula of the rest position `x`, `y`, `z` and, if it may, the time `t`.
#[derive(Debug, Clone)]
pub struct FieldFormula {
    program: Program,
    kinks: Kinks,
    placed: bool,
    timed: bool,
}

impl FieldFormula {
    /// Reads it; `t` is a name if it is `timed`.
    ///
    /// # Errors
    /// If the text is not a formula, or mentions anything else.
    pub fn new(text: &str, timed: bool) -> Result<Self, FormulaError> {
        let names = &NAMES[..if timed { 4 } else { 3 }];
        let mut graph = Graph::of(text.len());
        let tree = parse::parse(text)?;
        let (mut placed, mut varying) = (false, false);
        let id = graph.insert(&tree, &mut |graph, name| {
            if name == "pi" {
                return Ok(graph.constant(std::f64::consts::PI));
            }
            match names.iter().position(|known| *known == name) {
                Some(k) => {
                    placed |= k < 3;
                    varying |= k == 3;
                    Ok(graph.input(rumple_numerics::num::index(k)))
                }
                None => {
                    let time = if timed { ", t (time)" } else { "" };
                    Err(match nearest(name, names.iter().copied()) {
                        Some(near) => {
                            format!("did you mean `{near}`? There are {}, pi", names.join(", "))
                        }
                        None => format!("there are x, y, z (rest position, length){time} and pi"),
                    })
                }
            }
        })?;
        let kinks = Kinks::of(&mut graph, &[id], (TIME, !placed), |_| true);
        Ok(Self { program: Program::new(&graph, &[id]), kinks, placed, timed: varying })
    }

    /// Whether it reads the position.
    #[must_use]
    pub fn depends_on_position(&self) -> bool {
        self.placed
    }

    /// Whether it reads the time.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        self.timed
    }

    /// Adds the times from 0 to `until` at which it has a kink or a jump at some of `points`, and its course between
    /// these; whether they are all.
    pub fn time_dependence(&self, points: &[Vec3], until: f64, found: &mut TimeDependence) -> bool {
        self.kinks.at_points(until, points.len(), |axis, point| points[point][axis], found)
    }

    /// Its values at all points.
    #[must_use]
    pub fn at(&self, points: &[Vec3], time: f64) -> Vec<f64> {
        let columns: Vec<Vec<f64>> =
            (0..3).map(|k| points.iter().map(|point| point[k]).collect()).collect();
        let mut inputs: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
        inputs.push(Column::uniform(&time));
        let mut values = vec![0.0; points.len()];
        self.program.run(&inputs, points.len(), &mut [&mut values]);
        values
    }
}

/// Adds what [`FieldFormula::time_dependence`] does, of a formula that reads other names as well: of its parts that read
/// none of these.
pub fn time_dependence(text: &str, points: &[Vec3], until: f64, found: &mut TimeDependence) {
    let mut graph = Graph::of(text.len());
    let Ok(tree) = parse::parse(text) else { return };
    let id = graph.insert(&tree, &mut |graph, name| {
        let known = NAMES.iter().position(|known| *known == name).unwrap_or(NAMES.len());
        Ok(match name {
            "pi" => graph.constant(std::f64::consts::PI),
            _ => graph.input(rumple_numerics::num::index(known)),
        })
    });
    if let Ok(id) = id {
        let kinks = Kinks::of(&mut graph, &[id], (TIME, false), |input| input < TIME);
        kinks.at_points(until, points.len(), |axis, point| points[point][axis], found);
    }
}

/// The values of a formula of `x`, `y` and `z` at all points.
///
/// # Errors
/// If the text is not a formula, or mentions anything else.
pub fn over_positions(text: &str, points: &[Vec3]) -> Result<Vec<f64>, FormulaError> {
    Ok(FieldFormula::new(text, false)?.at(points, 0.0))
}
