//! Formulas of position: `f(x, y, z)` at given points.

use super::graph::Graph;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Vec3;
use crate::kinetics::Column;
use crate::kinetics::error::nearest;

const NAMES: [&str; 3] = ["x", "y", "z"];

/// The values of a formula of `x`, `y` and `z` at all points.
///
/// # Errors
/// If the text is no formula, or mentions anything else.
pub fn over_positions(text: &str, points: &[Vec3]) -> Result<Vec<f64>, FormulaError> {
    let mut graph = Graph::default();
    let tree = parse::parse(text)?;
    let id = graph.insert(&tree, &mut |graph, name| {
        if name == "pi" {
            return Ok(graph.constant(std::f64::consts::PI));
        }
        match NAMES.iter().position(|known| *known == name) {
            Some(k) => Ok(graph.input(crate::num::index(k))),
            None => Err(match nearest(name, NAMES) {
                Some(near) => format!("did you mean `{near}`? There are x, y, z, pi"),
                None => "there are x, y, z (rest position, length) and pi".to_owned(),
            }),
        }
    })?;
    let columns: Vec<Vec<f64>> =
        (0..3).map(|k| points.iter().map(|point| point[k]).collect()).collect();
    let inputs: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
    let mut values = vec![0.0; points.len()];
    Program::new(&graph, &[id]).run(&inputs, points.len(), &mut [&mut values]);
    Ok(values)
}
