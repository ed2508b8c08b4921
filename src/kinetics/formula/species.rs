//! Formulas of position, time and species: `f(x, y, z, t, c)` at given points, and `∂f/∂c`.

use super::field_formula::{AXES, NAMES, TIME};
use super::graph::Graph;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Column;
use crate::error::nearest;
use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// The number of the first species among its inputs, behind those of position and time.
const FIRST_SPECIES: usize = NAMES.len();

/// The names that a formula can read in place of one that it cannot.
fn unknown(name: &str, known: &[&str], species: &[&str]) -> String {
    let near = nearest(name, known.iter().chain(species).copied());
    let near = match near {
        _ if NAMES.contains(&name) => "the time is not read here. ".to_owned(),
        Some(near) => format!("did you mean `{near}`? "),
        None => String::new(),
    };
    let time = if known.len() > AXES.len() { ", t (time)" } else { "" };
    let species = match species.is_empty() {
        true => "no species".to_owned(),
        false => format!("the species {}", species.join(", ")),
    };
    format!("{near}There are x, y, z (rest position, length){time}, pi and {species}")
}

/// A formula of the rest position `x`, `y`, `z`, the time `t` and species, with its derivatives by these.
#[derive(Debug, Clone)]
pub struct SpeciesFormula {
    value: Program,
    slopes: Program,
    read: Vec<usize>,
    timed: bool,
}

impl SpeciesFormula {
    /// Reads it; the time `t` may be read if it is `timed`. A species called x, y, z or t is hidden by position and time.
    ///
    /// # Errors
    /// If the text is not a formula, or mentions anything else.
    pub fn new(text: &str, species: &[&str], timed: bool) -> Result<Self, FormulaError> {
        let known = &NAMES[..if timed { NAMES.len() } else { AXES.len() }];
        let mut graph = Graph::of(text.len());
        let tree = parse::parse(text)?;
        let (mut read, mut varying) = (Vec::new(), false);
        let id = graph.insert(&tree, &mut |graph, name| {
            if name == "pi" {
                return Ok(graph.constant(std::f64::consts::PI));
            }
            if let Some(k) = known.iter().position(|known| *known == name) {
                varying |= index(k) == TIME;
                return Ok(graph.input(index(k)));
            }
            let hidden = NAMES.contains(&name);
            let Some(s) = species.iter().position(|other| *other == name && !hidden) else {
                return Err(unknown(name, known, species));
            };
            read.push(s);
            Ok(graph.input(index(FIRST_SPECIES + s)))
        })?;
        read.sort_unstable();
        read.dedup();
        let slopes = read.iter().map(|s| graph.slope(id, index(FIRST_SPECIES + s)));
        let slopes: Vec<_> = slopes.collect::<Result<_, _>>().map_err(|large| large.at(text))?;
        graph.complete();
        let (value, slopes) = (Program::new(&graph, &[id]), Program::new(&graph, &slopes));
        Ok(Self { value, slopes, read, timed: varying })
    }

    /// Numbers of the species that it reads, ascending.
    #[must_use]
    pub fn species(&self) -> &[usize] {
        &self.read
    }

    /// Whether it reads the time.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        self.timed
    }

    /// Its values at all points and a time; `species` gives the values there of the species of a number.
    #[must_use]
    pub fn at<'a>(
        &self,
        points: &[Vec3],
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<f64> {
        self.run((&self.value, 1), points, time, species).pop().unwrap_or_default()
    }

    /// Its derivatives there by each of the species that it reads.
    #[must_use]
    pub fn slopes<'a>(
        &self,
        points: &[Vec3],
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        self.run((&self.slopes, self.read.len()), points, time, species)
    }

    fn run<'a>(
        &self,
        (program, outputs): (&Program, usize),
        points: &[Vec3],
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        let axes: Vec<Vec<f64>> =
            (0..AXES.len()).map(|k| points.iter().map(|point| point[k]).collect()).collect();
        let last = self.read.last().map_or(0, |last| last + 1);
        let of = |s: usize| match self.read.contains(&s) {
            true => species(s).into(),
            false => Column::uniform(&0.0),
        };
        let time = std::iter::once(Column::uniform(&time));
        let inputs: Vec<Column<'_>> =
            axes.iter().map(Into::into).chain(time).chain((0..last).map(of)).collect();
        let mut values = vec![vec![0.0; points.len()]; outputs];
        let mut columns: Vec<&mut [f64]> = values.iter_mut().map(Vec::as_mut_slice).collect();
        program.run(&inputs, points.len(), &mut columns);
        values
    }
}
