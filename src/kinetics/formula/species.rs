//! Formulas of position and species: `f(x, y, z, c)` at given points, and `∂f/∂c`.

use super::field_formula::AXES;
use super::graph::Graph;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Column;
use crate::error::nearest;
use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// A formula of the rest position `x`, `y`, `z` and of species, with its derivatives by these.
#[derive(Debug, Clone)]
pub struct SpeciesFormula {
    value: Program,
    slopes: Program,
    read: Vec<usize>,
}

impl SpeciesFormula {
    /// Reads it; a species called x, y or z is hidden by the position.
    ///
    /// # Errors
    /// If the text is not a formula, or mentions anything else.
    pub fn new(text: &str, species: &[&str]) -> Result<Self, FormulaError> {
        let mut graph = Graph::of(text.len());
        let tree = parse::parse(text)?;
        let mut read = Vec::new();
        let id = graph.insert(&tree, &mut |graph, name| {
            if name == "pi" {
                return Ok(graph.constant(std::f64::consts::PI));
            }
            if let Some(axis) = AXES.iter().position(|axis| *axis == name) {
                return Ok(graph.input(index(axis)));
            }
            let Some(s) = species.iter().position(|known| *known == name) else {
                let all = || AXES.iter().chain(species).copied();
                let near = nearest(name, all())
                    .map(|near| format!("did you mean `{near}`? "))
                    .unwrap_or_default();
                let species = match species.is_empty() {
                    true => "no species".to_owned(),
                    false => format!("the species {}", species.join(", ")),
                };
                return Err(format!(
                    "{near}There are x, y, z (rest position, length), pi and {species}"
                ));
            };
            read.push(s);
            Ok(graph.input(index(AXES.len() + s)))
        })?;
        read.sort_unstable();
        read.dedup();
        let slopes = read.iter().map(|s| graph.slope(id, index(AXES.len() + s)));
        let slopes: Vec<_> = slopes.collect::<Result<_, _>>().map_err(|large| large.at(text))?;
        graph.complete();
        let (value, slopes) = (Program::new(&graph, &[id]), Program::new(&graph, &slopes));
        Ok(Self { value, slopes, read })
    }

    /// Numbers of the species that it reads, ascending.
    #[must_use]
    pub fn species(&self) -> &[usize] {
        &self.read
    }

    /// Its values at all points; `species` gives the values there of the species of a number.
    #[must_use]
    pub fn at<'a>(&self, points: &[Vec3], species: impl Fn(usize) -> &'a [f64]) -> Vec<f64> {
        self.run(&self.value, 1, points, species).pop().unwrap_or_default()
    }

    /// Its derivatives there by each of the species that it reads.
    #[must_use]
    pub fn slopes<'a>(
        &self,
        points: &[Vec3],
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        self.run(&self.slopes, self.read.len(), points, species)
    }

    fn run<'a>(
        &self,
        program: &Program,
        outputs: usize,
        points: &[Vec3],
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        let axes: Vec<Vec<f64>> =
            (0..AXES.len()).map(|k| points.iter().map(|point| point[k]).collect()).collect();
        let last = self.read.last().map_or(0, |last| last + 1);
        let of = |s: usize| match self.read.contains(&s) {
            true => species(s).into(),
            false => Column::uniform(&0.0),
        };
        let inputs: Vec<Column<'_>> =
            axes.iter().map(Into::into).chain((0..last).map(of)).collect();
        let mut values = vec![vec![0.0; points.len()]; outputs];
        let mut columns: Vec<&mut [f64]> = values.iter_mut().map(Vec::as_mut_slice).collect();
        program.run(&inputs, points.len(), &mut columns);
        values
    }
}
